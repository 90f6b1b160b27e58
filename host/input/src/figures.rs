//! Figures as files ask for them.

use crate::case::{Case, CutInput, FigureInput};
use crate::{Error, measured};
use results::output_request::{Cut, Figure};
use results::pile::OF_STATION;
use text::{Source, Spanned};

/// Quantities along a cut; `k_0` is the ratio of radial to vertical stress, both
/// effective. Without water pore pressures are zero.
const CUT_QUANTITIES: [&str; 13] = [
    "x",
    "y",
    "stress_11",
    "stress_22",
    "stress_33",
    "stress_12",
    "k_0",
    "pore_pressure",
    "excess_pore_pressure",
    "total_stress_11",
    "total_stress_22",
    "total_stress_33",
    "total_stress_12",
];

/// The figures of a case, with the points measured for them.
///
/// # Errors
/// [`text::Error::Input`] at the name of a probe or phase that does not exist, of a second figure of
/// one name, or at what cannot be used of measured points.
pub fn case_figures(case: &Case, names: &[&str]) -> Result<Vec<Figure>, Error> {
    let source = &case.source;
    let phases: Vec<&str> = case
        .file
        .phases
        .iter()
        .map(|phase| phase.name.get_ref().as_str())
        .collect();
    check_names(source, &case.file.figures)?;
    for figure in &case.file.figures {
        match (&figure.points, &figure.along_pile) {
            (None, None) => check_columns(source, figure, "probe", names)?,
            (Some(_), None) => {
                check_columns(source, figure, "quantity of a point", &CUT_QUANTITIES)?;
            }
            (None, Some(_)) => check_columns(source, figure, "column of pile.csv", &OF_STATION)?,
            (Some(_), Some(along)) => {
                let message = "a figure is over points or along the pile, not both";
                return Err(source.error(along.span(), message).into());
            }
        }
        if let Some(along) = &figure.along_pile
            && case.file.pile.is_none()
        {
            let message = "there is no pile: it is named under [pile]";
            return Err(source.error(along.span(), message).into());
        }
        if let Some(group) = figure.points.as_ref().and_then(|cut| cut.group.as_ref())
            && !case.file.groups.contains_key(group.get_ref().as_str())
        {
            let groups = case.file.groups.keys().map(|k| k.get_ref().as_str());
            return Err(source.unknown("group", group, groups).into());
        }
        if let Some(phase) = &figure.phase
            && !phases.contains(&phase.get_ref().as_str())
        {
            return Err(source.unknown("phase", phase, phases).into());
        }
    }
    let figures = case.file.figures.iter();
    figures.map(|figure| wanted(source, figure)).collect()
}

/// The figures of a table, with the points measured for them.
///
/// # Errors
/// [`text::Error::Input`] at the name of a column that does not exist, of a second figure of one
/// name, or at what cannot be used of measured points.
pub fn table_figures(
    source: &Source,
    figures: &[FigureInput],
    columns: &[&str],
) -> Result<Vec<Figure>, Error> {
    check_names(source, figures)?;
    for figure in figures {
        check_columns(source, figure, "column", columns)?;
        if let Some(phase) = &figure.phase {
            let message = "a driver has no phases";
            return Err(source.error(phase.span(), message).into());
        }
        if figure.points.is_some() {
            let message = "a driver has one point, there is no cut through it";
            return Err(source.error(figure.name.span(), message).into());
        }
        if let Some(along) = &figure.along_pile {
            let message = "a driver has no pile";
            return Err(source.error(along.span(), message).into());
        }
    }
    let figures = figures.iter();
    figures.map(|figure| wanted(source, figure)).collect()
}

fn check_names(source: &Source, figures: &[FigureInput]) -> Result<(), Error> {
    let mut seen: Vec<&str> = Vec::new();
    for figure in figures {
        let name = figure.name.get_ref().as_str();
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            let message = format!("`{name}` cannot be a file's name: letters, digits, _ and -");
            return Err(source.error(figure.name.span(), message).into());
        }
        if seen.contains(&name) {
            let message = format!("two figures are called `{name}`");
            return Err(source.error(figure.name.span(), message).into());
        }
        seen.push(name);
    }
    Ok(())
}

fn check_columns(
    source: &Source,
    figure: &FigureInput,
    kind: &str,
    known: &[&str],
) -> Result<(), Error> {
    for wanted in figure.y.iter().chain([&figure.x]) {
        if !known.contains(&wanted.get_ref().as_str()) {
            return Err(source.unknown(kind, wanted, known.iter().copied()).into());
        }
    }
    Ok(())
}

/// A figure as plain values, with the points measured for it.
fn wanted(source: &Source, input: &FigureInput) -> Result<Figure, Error> {
    let tables = input.measured.iter().flat_map(|tables| &tables.0);
    let measured = tables.map(|table| measured::read(source, table));
    Ok(Figure {
        name: input.name.get_ref().clone(),
        title: input.title.clone(),
        x: input.x.get_ref().clone(),
        x_label: input.x_label.clone(),
        y: input.y.iter().map(|y| y.get_ref().clone()).collect(),
        y_label: input.y_label.clone(),
        y_reversed: input.y_reversed,
        phase: input.phase.as_ref().map(|phase| phase.get_ref().clone()),
        points: input.points.as_ref().map(Cut::from),
        along_pile: input
            .along_pile
            .as_ref()
            .map(|along| along.get_ref().increments.clone()),
        measured: measured.collect::<Result<_, _>>()?,
    })
}

impl From<&CutInput> for Cut {
    fn from(input: &CutInput) -> Self {
        Self {
            group: input.group.as_ref().map(Spanned::get_ref).cloned(),
            x: input.x,
            y: input.y,
            increments: input.increments.clone(),
            scale: input.scale,
        }
    }
}
