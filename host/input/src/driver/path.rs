//! The initial state and the path of a driver file: names and numbers in their places.

use super::{ControlTable, DriverFile, Initial};
use crate::Error;
use abi::Hypothesis;
use law::words;
use point::{Control, MAX_INCREMENTS, Misuse, N_MAX, Segment, Vector};
use std::ops::Range;
use text::{Source, Spanned};

pub(super) fn hypothesis(source: &Source, name: &Spanned<String>) -> Result<Hypothesis, Error> {
    let mut all = Hypothesis::ALL.into_iter();
    let found = all.find(|h| h.name() == name.get_ref());
    let names = Hypothesis::ALL.map(Hypothesis::name);
    found.ok_or_else(|| source.unknown("hypothesis", name, names).into())
}

pub(super) fn finite(source: &Source, what: &str, value: &Spanned<f64>) -> Result<f64, Error> {
    let number = *value.get_ref();
    if number.is_finite() {
        Ok(number)
    } else {
        Err(source
            .error(value.span(), format!("`{what}`: {number} is not finite"))
            .into())
    }
}

/// Number of the component that a key names.
fn component(
    source: &Source,
    name: &Spanned<String>,
    hypothesis: Hypothesis,
) -> Result<usize, Error> {
    let names = hypothesis.components();
    names
        .iter()
        .position(|candidate| candidate == name.get_ref())
        .ok_or_else(|| {
            source
                .error(
                    name.span(),
                    format!(
                        "there is no component `{}` under {}",
                        name.get_ref(),
                        hypothesis.name()
                    ),
                )
                .hint(format!("components: {}", names.join(", ")))
                .into()
        })
}

pub(super) fn initial_flux(
    source: &Source,
    initial: &Initial,
    hypothesis: Hypothesis,
) -> Result<Vector, Error> {
    let (_, word) = words(hypothesis);
    let (fits, misfit) = if hypothesis.is_interface() {
        (&initial.traction, &initial.stress)
    } else {
        (&initial.stress, &initial.traction)
    };
    if let Some(misfit) = misfit {
        return Err(source
            .error(
                misfit.span(),
                format!(
                    "under {} the initial state is a {word}, components {}",
                    hypothesis.name(),
                    hypothesis.components().join(", ")
                ),
            )
            .into());
    }
    let mut flux = [0.0; N_MAX];
    for (name, value) in fits.iter().flat_map(Spanned::get_ref) {
        flux[component(source, name, hypothesis)?] = finite(source, name.get_ref(), value)?;
    }
    Ok(flux)
}

/// The path, each control checked at its place.
pub(super) fn segments(
    source: &Source,
    file: &DriverFile,
    hypothesis: Hypothesis,
) -> Result<Vec<Segment>, Error> {
    if file.segment.is_empty() {
        return Err(source
            .error(file.law.span(), "the driver has no [[segment]]")
            .hint("a path is a list of [[segment]] tables with `increments` and `control`")
            .into());
    }
    let mut total = 0_usize;
    let tables = file.segment.iter().zip(1..);
    tables
        .map(|(table, number)| {
            let increments = usize::try_from(*table.increments.get_ref()).unwrap_or(0);
            total = total.saturating_add(increments);
            if increments == 0 || total > MAX_INCREMENTS {
                return Err(source
                    .error(
                        table.increments.span(),
                        format!(
                            "`increments`: {} is outside [1, {MAX_INCREMENTS}], all segments \
                             together",
                            table.increments.get_ref()
                        ),
                    )
                    .into());
            }
            let mut segment = Segment::new(hypothesis, number, increments);
            if let Some(time) = &table.time {
                segment.time = Some(*time.get_ref());
                segment
                    .check(hypothesis)
                    .map_err(|misuse| source.error(time.span(), misuse.to_string()))?;
            }
            for (name, written) in &table.control {
                let i = component(source, name, hypothesis)?;
                let (keyword, value, control) =
                    read_control(source, name.get_ref(), written, hypothesis)?;
                control.check(i, hypothesis).map_err(|misuse| {
                    let table = written.span();
                    misplaced(source, misuse, (keyword, value), table)
                })?;
                segment.control[i] = control;
            }
            Ok(segment)
        })
        .collect()
}

/// A control that there cannot be, at its value or its whole table.
fn misplaced(
    source: &Source,
    misuse: Misuse,
    (keyword, value): (&str, Range<usize>),
    table: Range<usize>,
) -> Error {
    let error = match misuse {
        Misuse::OutOfPlane => source
            .error(table, misuse.to_string())
            .hint("leave `33` out, write `{ strain = 0.0 }`, or use another hypothesis"),
        Misuse::NotFinite(_) => source.error(value, format!("`{keyword}`: {misuse}")),
        _ => source.error(value, misuse.to_string()),
    };
    match misuse.hint() {
        Some(hint) => error.hint(hint).into(),
        None => error.into(),
    }
}

/// The keyword that a component is led by, the place of its value, and what it means.
fn read_control(
    source: &Source,
    component: &str,
    written: &Spanned<ControlTable>,
    hypothesis: Hypothesis,
) -> Result<(&'static str, Range<usize>, Control), Error> {
    type Kind = fn(f64) -> Control;
    let table = written.get_ref();
    let interface = hypothesis.is_interface();
    // Keyword, value, whether it is made for interfaces, what it becomes.
    let kinds: [(&'static str, &Option<Spanned<f64>>, bool, Kind); 5] = [
        ("jump", &table.jump, true, Control::Gradient),
        ("traction", &table.traction, true, Control::Flux),
        ("stiffness", &table.stiffness, true, Control::Stiffness),
        ("strain", &table.strain, false, Control::Gradient),
        ("stress", &table.stress, false, Control::Flux),
    ];
    let choices: Vec<&str> = kinds
        .iter()
        .filter(|kind| kind.2 == interface)
        .map(|kind| kind.0)
        .collect();
    let mut given = kinds
        .iter()
        .filter_map(|(keyword, value, fits, kind)| Some((keyword, value.as_ref()?, fits, kind)));
    let (Some((keyword, value, fits, kind)), None) = (given.next(), given.next()) else {
        return Err(source
            .error(
                written.span(),
                format!(
                    "component `{component}` needs exactly one control, one of {}",
                    choices.join(", ")
                ),
            )
            .into());
    };
    if *fits != interface {
        return Err(source
            .error(
                value.span(),
                format!(
                    "component `{component}` cannot be controlled by `{keyword}` under {}",
                    hypothesis.name()
                ),
            )
            .hint(format!("it is controlled by one of {}", choices.join(", ")))
            .into());
    }
    Ok((*keyword, value.span(), kind(*value.get_ref())))
}
