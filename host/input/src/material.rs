//! Laws as files name them: where their libraries are, and what their parameters are.

use crate::Error;
use crate::case::LawInput;
use crate::expression::Expression;
use crate::ground::Over;
use crate::spanned::Given;
use abi::Hypothesis;
use law::foreign::{Adapter, Externals, Foreign, Scratch};
use law::{
    BuildCause, BuildFailure, BuiltLaw, Law, LoadedLaw, Opener, Pins, SearchPath, ShearZone, Value,
};
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;
use std::path::PathBuf;
use text::{Named, Source, Spanned, suggestion};

/// The value of a parameter as written in a file.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(
    untagged,
    expecting = "expected a number, a text in quotes, or in a case values over the height such as \
                 `{ z = [[-10.0, 5.0], [0.0, 1.0]] }`"
)]
pub enum ParameterValue {
    /// A number.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// The label of a choice; in a case also an expression such as `= 0.7 * clay.cohesion`.
    Label(String),
    /// In a case: values over the height; each element takes that at its centre.
    Varying(Over),
}

impl ParameterValue {
    /// The text of its expression, if it is one.
    pub(crate) fn expression(&self) -> Option<&str> {
        match self {
            Self::Label(label) => Expression::text(label),
            _ => None,
        }
    }
}

/// Parameters of a law as written in a file.
pub type ParameterTable = Named<ParameterValue>;

/// Sets some parameters, whether the file gives them or not.
pub fn set_parameters(table: &mut ParameterTable, values: &[(String, ParameterValue)]) {
    for (id, value) in values {
        if let Some((_, written)) = table.iter_mut().find(|(key, _)| key.get_ref() == id) {
            *written.get_mut() = value.clone();
        } else {
            let key = Spanned::new(0..0, id.clone());
            table.insert(key, Spanned::new(0..0, value.clone()));
        }
    }
}

/// Fixes the parameters of a law under a hypothesis.
///
/// # Errors
/// [`law::Error::Library`] if the library is defective; [`text::Error::Input`] if the hypothesis or a
/// parameter does not fit, at its place in the file.
pub fn build_law(
    source: &Source,
    loaded: &LoadedLaw,
    id: &Spanned<String>,
    hypothesis: Hypothesis,
    parameters: &ParameterTable,
) -> Result<BuiltLaw, Error> {
    for value in parameters.values() {
        let message = match value.get_ref() {
            ParameterValue::Varying(_) => "one point has no height for a parameter to vary with",
            other if other.expression().is_some() => {
                "an expression takes its values from the laws of a case, and this is no case"
            }
            _ => continue,
        };
        return Err(source.error(value.span(), message).into());
    }
    try_law(loaded, hypothesis, parameters).map_err(|failure| {
        let error = place_failure(source, id, parameters, &failure);
        if is_solid_at_interface(&failure) {
            error.with_hint(ZONE)
        } else {
            error
        }
    })
}

/// What makes a law of solids one of interfaces.
pub(crate) const ZONE: &str =
    "`adapter = \"shear_zone\"` with a `thickness` makes an interface law of a law of solids";

/// Whether a law is made for solids alone and an interface is to take it.
pub(crate) fn is_solid_at_interface(failure: &BuildFailure) -> bool {
    let interface = Hypothesis::Interface2d;
    match &failure.cause {
        BuildCause::Hypothesis { offered, wanted } => {
            *wanted == interface && !offered.contains(&interface.name())
        }
        _ => false,
    }
}

/// The same, with what does not fit as data.
pub(crate) fn try_law(
    loaded: &LoadedLaw,
    hypothesis: Hypothesis,
    parameters: &ParameterTable,
) -> Result<BuiltLaw, BuildFailure> {
    loaded.with(hypothesis, &given(parameters))
}

/// Parameters as a law takes them.
pub(crate) fn given(parameters: &ParameterTable) -> Vec<(&str, Value)> {
    let given = parameters.iter();
    given
        .map(|(key, value)| (key.get_ref().as_str(), Value::from(value.get_ref())))
        .collect()
}

/// The error of a law that cannot be built, at its place in the file.
pub(crate) fn place_failure(
    source: &Source,
    id: &Spanned<String>,
    parameters: &ParameterTable,
    failure: &BuildFailure,
) -> Error {
    if let BuildCause::Library { .. } = failure.cause {
        return law::Error::library(failure.to_string()).into();
    }
    let mut given = parameters.iter();
    let given = given.find(|(key, _)| Some(key.get_ref()) == failure.parameter.as_ref());
    let span = match (&failure.cause, given) {
        (BuildCause::Unknown(_), Some((key, _))) => key.span(),
        (_, Some((_, value))) => value.span(),
        (BuildCause::Radians(_), None) => 0..0,
        (_, None) => id.span(),
    };
    let mut error = source.error(span, failure.to_string());
    if let BuildCause::OutOfBounds { doc, .. } = &failure.cause {
        error = error.label(doc.clone());
    }
    match failure.hint() {
        Some(hint) => error.hint(hint).into(),
        None => error.into(),
    }
}

impl From<&ParameterValue> for Value {
    fn from(value: &ParameterValue) -> Self {
        match value {
            ParameterValue::Number(number) => Self::Number(*number),
            ParameterValue::Integer(number) => Self::Number(*number as f64),
            ParameterValue::Label(label) => Self::Label(label.clone()),
            // Stands for all of them where one law is looked at.
            ParameterValue::Varying(over) => Self::Number(over.z.first().map_or(0.0, |p| p[1])),
        }
    }
}

/// Finds a law; a missing one is reported with its place in the file.
pub(crate) fn find_law(
    source: &Source,
    search: &SearchPath,
    id: &Spanned<String>,
    foreign: Option<&Foreign>,
) -> Result<LoadedLaw, Error> {
    let found = match foreign {
        None => search.law(id.get_ref()),
        Some(foreign) => search.foreign_law(id.get_ref(), foreign),
    };
    found.map_err(|error| match error {
        law::Error::Library { message, hint } => {
            let place = source.place(&id.span());
            let message = format!("{message}\n  needed by {place}");
            law::Error::Library { message, hint }.into()
        }
        other => other.into(),
    })
}

/// Route of a law from outside the contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Adapter")]
pub enum Route {
    /// Abaqus, `SUBROUTINE UMAT`.
    Umat,
    /// MFront's generic interface.
    Mfront,
    /// PLAXIS, `User_Mod`.
    Udsm,
    /// A law of solids fills a zone of some `thickness`.
    ShearZone,
}

impl Route {
    /// Program that the library is made for; `None` if absent.
    fn adapter(self) -> Option<Adapter> {
        match self {
            Self::Umat => Some(Adapter::Umat),
            Self::Mfront => Some(Adapter::Mfront),
            Self::Udsm => Some(Adapter::Udsm),
            Self::ShearZone => None,
        }
    }
}

/// The tables of laws in a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LawTables<'a> {
    /// The file.
    pub(crate) source: &'a Source,
    /// The tables, by name.
    pub(crate) tables: &'a Named<LawInput>,
}

impl<'a> LawTables<'a> {
    /// The law of a table, without its parameters.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit; [`law::Error::Library`].
    pub(crate) fn loaded(self, search: &SearchPath, entry: &LawInput) -> Result<LoadedLaw, Error> {
        let Self { source, .. } = self;
        let Some(zone) = entry.shear_zone(source)? else {
            let foreign = entry.foreign(source)?;
            return find_law(source, search, &entry.law, foreign.as_ref());
        };
        let law = match self.filler(entry) {
            None => find_law(source, search, &entry.law, None).map_err(|error| {
                let others = self.tables.iter();
                let others = others.filter(|(_, table)| !table.get_ref().is_shear_zone());
                let names: Vec<&str> = others.map(|(name, _)| name.get_ref().as_str()).collect();
                if names.is_empty() {
                    return error;
                }
                let tables = suggestion(entry.law.get_ref(), names);
                error.with_hint(&format!("of the tables under [laws]: {tables}"))
            })?,
            Some(table) if table.is_shear_zone() => {
                let message = format!("law `{}` is a shear zone itself", entry.law.get_ref());
                return Err(source.error(entry.law.span(), message).into());
            }
            Some(table) => {
                if let Some(sha256) = &entry.sha256 {
                    let message = "`sha256` belongs to the law that fills the zone";
                    let hint = format!("write it under [laws.{}]", entry.law.get_ref());
                    return Err(source.error(sha256.span(), message).hint(hint).into());
                }
                self.loaded(search, table)?
            }
        };
        law.in_shear_zone(zone)
            .map_err(|why| source.error(entry.law.span(), why).into())
    }

    /// The table of the law that fills a zone, if it has one.
    pub(crate) fn filler(self, entry: &LawInput) -> Option<&'a LawInput> {
        if !entry.is_shear_zone() {
            return None;
        }
        let mut tables = self.tables.iter();
        let named = tables.find(|(name, _)| name.get_ref() == entry.law.get_ref());
        let table = named.map(|(_, table)| table.get_ref());
        // A zone may be called like the law of the contract that fills it.
        table.filter(|table| !std::ptr::eq(*table, entry))
    }

    /// Whether a table is there for zones that it fills.
    pub(crate) fn is_filler(self, entry: &LawInput) -> bool {
        let mut tables = self.tables.values();
        tables.any(|zone| {
            let filler = self.filler(zone.get_ref());
            filler.is_some_and(|filler| std::ptr::eq(filler, entry))
        })
    }

    /// Parameters of a table: of a zone those of the law that fills it, and its own over them.
    pub(crate) fn parameters(self, entry: &LawInput) -> ParameterTable {
        let filler = self.filler(entry).map(|table| &table.parameters);
        over(filler, &entry.parameters)
    }

    /// Initial internal variables of a table, likewise.
    pub(crate) fn initial(self, entry: &LawInput) -> Named<f64> {
        let filler = self.filler(entry).map(|table| &table.initial);
        over(filler, &entry.initial)
    }
}

/// The entries of one table, and those of another over them.
pub(crate) fn over<T: Clone>(below: Option<&Named<T>>, above: &Named<T>) -> Named<T> {
    let mut all = above.clone();
    for (key, value) in below.into_iter().flatten() {
        if !above.keys().any(|other| other.get_ref() == key.get_ref()) {
            all.insert(key.clone(), value.clone());
        }
    }
    all
}

/// The zone of `adapter = "shear_zone"`; `None` if it is another one or none.
///
/// # Errors
/// [`text::Error::Input`] at the key that misses another or does not fit.
pub(crate) fn shear_zone(source: &Source, law: &LawInput) -> Result<Option<ShearZone>, Error> {
    let own = [
        ("thickness", law.thickness.place()),
        ("lateral_ratio", law.lateral_ratio.place()),
    ];
    let adapter = law.adapter.as_ref();
    let Some(adapter) = adapter.filter(|adapter| *adapter.get_ref() == Route::ShearZone) else {
        let mut given = own.into_iter().filter_map(|(key, at)| Some((key, at?)));
        return match given.next() {
            None => Ok(None),
            Some((key, at)) => {
                let message = format!("`{key}` is for `adapter = \"shear_zone\"`");
                Err(source.error(at, message).into())
            }
        };
    };
    if let Some((key, at)) = beside_adapter(law).next() {
        let message = format!("`{key}` belongs to the law that fills the zone");
        return Err(source
            .error(at, message)
            .hint("write that law as a table `[laws.NAME]` of its own, and here `law = \"NAME\"`")
            .into());
    }
    let Some(thickness) = law.thickness.value() else {
        let message = "`adapter = \"shear_zone\"` needs the `thickness` of the zone, m";
        return Err(source.error(adapter.span(), message).into());
    };
    let zone = ShearZone {
        thickness,
        lateral_ratio: law.lateral_ratio.value().unwrap_or(1.0),
    };
    let Some((key, why)) = zone.fault() else {
        return Ok(Some(zone));
    };
    let mut own = own.into_iter();
    let at = own.find_map(|(other, at)| at.filter(|_| key == other));
    Err(source.error(at.unwrap_or(adapter.span()), why).into())
}

/// The library of a law that is made for another program; `None` if it is one of the contract. Paths are
/// relative to the file.
///
/// # Errors
/// [`text::Error::Input`] at a key that misses another, or a file that is absent.
pub(crate) fn foreign(source: &Source, law: &LawInput) -> Result<Option<Foreign>, Error> {
    let path = |written: &Spanned<PathBuf>| {
        let path = source.file_named(written.get_ref(), &written.span());
        std::path::absolute(&path).unwrap_or(path)
    };
    let existing = |key: &str, written: &Spanned<PathBuf>| {
        let path = path(written);
        if path.is_file() {
            return Ok(path);
        }
        let message = format!("`{key}`: there is no file {}", path.display());
        Err(Error::from(source.error(written.span(), message)))
    };
    let Some(adapter) = &law.adapter else {
        return match beside_adapter(law).next() {
            None => Ok(None),
            Some((key, at)) => Err(source
                .error(at, format!("`{key}` needs an `adapter`"))
                .hint(
                    "libraries of the contract are found by the law's id, more folders are \
                     named in `law_path`; `adapter = \"umat\"` is for Abaqus user subroutines, \
                     `adapter = \"mfront\"` for MFront behaviours, `adapter = \"udsm\"` for soil \
                     models of PLAXIS",
                )
                .into()),
        };
    };
    let Some(made_for) = adapter.get_ref().adapter() else {
        return Ok(None);
    };
    let Some(library) = &law.library else {
        let message = "`adapter` needs the `library` that it is for";
        return Err(source.error(adapter.span(), message).into());
    };
    refuse_of_others(source, law, made_for)?;
    refuse_without_worker(source, law, made_for)?;
    let sidecar = law.sidecar.as_ref();
    let sidecar = sidecar.map(|written| existing("sidecar", written));
    Ok(Some(Foreign {
        adapter: made_for,
        library: existing("library", library)?,
        sidecar: sidecar.transpose()?,
        in_process: law.in_process.value() == Some(true),
        record: law.record.as_ref().map(path),
        records_once: false,
        externals: law.externals.value(),
        scratch: law.scratch.value(),
        tangent_order: law.tangent_order.value(),
    }))
}

/// Keys that an adapter for a library explains, as they are given.
fn beside_adapter(law: &LawInput) -> impl Iterator<Item = (&'static str, Range<usize>)> {
    let given = [
        ("library", law.library.place()),
        ("sidecar", law.sidecar.place()),
        ("in_process", law.in_process.place()),
        ("record", law.record.place()),
        ("externals", law.externals.place()),
        ("scratch", law.scratch.place()),
        ("tangent_order", law.tangent_order.place()),
    ];
    given.into_iter().filter_map(|(key, at)| Some((key, at?)))
}

/// Keys that one adapter has and others have not.
fn refuse_of_others(source: &Source, law: &LawInput, adapter: Adapter) -> Result<(), Error> {
    let keys = [
        ("sidecar", law.sidecar.place(), Adapter::Umat),
        ("record", law.record.place(), Adapter::Umat),
        ("tangent_order", law.tangent_order.place(), Adapter::Udsm),
    ];
    for (key, at, of) in keys {
        let Some(at) = at.filter(|_| adapter != of) else {
            continue;
        };
        let message = format!("`{key}` is for `adapter = \"{}\"`", of.name());
        let error = source.error(at, message);
        return Err(if key == "tangent_order" && adapter == Adapter::Umat {
            error.hint("of a UMAT the sidecar says it")
        } else {
            error
        }
        .into());
    }
    Ok(())
}

/// Traps and scratch folders are a matter of the workers of UMATs and UDSMs.
fn refuse_without_worker(source: &Source, law: &LawInput, adapter: Adapter) -> Result<(), Error> {
    let is_trap = law.externals.value() == Some(Externals::Trap);
    let is_kept = law.scratch.value() == Some(Scratch::Keep);
    let keys = [
        ("externals", law.externals.place(), is_trap),
        ("scratch", law.scratch.place(), is_kept),
    ];
    let in_process = law.in_process.value() == Some(true);
    for (key, at, needs_worker) in keys {
        let Some(at) = at else { continue };
        if adapter == Adapter::Mfront {
            let message = format!("`{key}` is for `adapter = \"umat\"` and `adapter = \"udsm\"`");
            return Err(source.error(at, message).into());
        }
        if needs_worker && in_process {
            let message = format!("`{key}` needs a worker process");
            return Err(source
                .error(at, message)
                .hint("leave out `in_process`")
                .into());
        }
    }
    Ok(())
}

/// A law that a table describes by itself: the keys of one of a case's [`laws`](crate::case::CaseFile).
/// `hypothesis` may be left out where the law offers one alone (next to interfaces in space), `folders` are looked
/// in for its library first. Returns the law, and initial internal variables that override its own, by their numbers.
///
/// # Errors
/// [`text::Error::Input`] at the key that does not fit; [`law::Error::Library`].
pub fn law_alone(
    opener: &Opener,
    source: &Source,
    hypothesis: Option<Hypothesis>,
    folders: &[PathBuf],
) -> Result<(BuiltLaw, Vec<(usize, f64)>), Error> {
    let entry: LawInput = text::parse(source)?;
    let pins = Pins::given(source, [(&entry.law, entry.sha256.as_ref())].into_iter())?;
    let search = SearchPath::of(opener, folders).pinned(pins);
    let none = Named::new();
    let tables = LawTables {
        source,
        tables: &none,
    };
    let loaded = tables.loaded(&search, &entry)?;
    let hypothesis = match hypothesis {
        Some(hypothesis) => hypothesis,
        None => only_hypothesis(&loaded).map_err(|why| source.error(entry.law.span(), why))?,
    };
    let built = build_law(source, &loaded, &entry.law, hypothesis, &entry.parameters)?;
    let mut initial = Vec::new();
    for (key, value) in &entry.initial {
        let number = internal_variable(source, &built.law, entry.law.get_ref(), key)?;
        initial.push((number, *value.get_ref()));
    }
    Ok((built, initial))
}

/// Number of an internal variable of a law that is called so.
pub(crate) fn internal_variable(
    source: &Source,
    law: &Law,
    called: &str,
    variable: &Spanned<String>,
) -> Result<usize, Error> {
    let variables = &law.formulation().internal_variables;
    let id = variable.get_ref();
    let number = variables.iter().position(|variable| variable.id == *id);
    let known = variables.iter().map(|v| v.id.as_str());
    number.ok_or_else(|| no_internal_variable(source, called, variable, known.collect()))
}

/// The error of an internal variable that a law has not: it has these.
pub(crate) fn no_internal_variable(
    source: &Source,
    law: &str,
    variable: &Spanned<String>,
    known: Vec<&str>,
) -> Error {
    let id = variable.get_ref();
    let message = format!("law `{law}` has no internal variable `{id}`");
    let error = source.error(variable.span(), message);
    error.hint(suggestion(id, known)).into()
}

/// The one hypothesis that a law is made for, interfaces in space aside: those are asked for.
fn only_hypothesis(law: &LoadedLaw) -> Result<Hypothesis, String> {
    let description = law.description();
    let offered = Hypothesis::ALL.into_iter();
    let mut offered = offered
        .filter(|one| *one != Hypothesis::Interface3d && description.formulation(*one).is_some());
    match (offered.next(), offered.next()) {
        (Some(only), None) => Ok(only),
        _ => Err(format!(
            "law `{}` is made for several hypotheses, say which one: {}",
            description.id,
            description.hypotheses()
        )),
    }
}
