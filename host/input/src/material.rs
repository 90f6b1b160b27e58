//! What all input files share: reading TOML with the place of every error, and building laws from
//! their parameters.

mod wording;

use crate::error::{Error, Source, suggestion};
use crate::plugin::adapter::{Adapter, Externals, Foreign, Scratch};
use crate::plugin::{Law, LawDescription, LoadedLaw, ParameterDescription, SearchPath};
use abi::Hypothesis;
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The value of a parameter as written in a file.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged, expecting = "expected a number, or a text in quotes")]
pub enum ParameterValue {
    /// A number.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// The label of a choice.
    Label(String),
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

/// A parameter as it was used, for the record.
#[derive(Clone, Debug, PartialEq)]
pub struct UsedParameter {
    /// Identifier.
    pub id: String,
    /// Value; NaN if it was left out and has no default.
    pub value: f64,
    /// It was left out.
    pub by_default: bool,
}

/// A law built from a file, with what the user should know about its parameters.
#[derive(Debug)]
pub struct BuiltLaw {
    /// The law.
    pub law: Law,
    /// Parameters in declared order.
    pub parameters: Vec<UsedParameter>,
    /// Values outside their usual range, in words.
    pub warnings: Vec<String>,
}

/// Fixes the parameters of a law under a hypothesis.
///
/// # Errors
/// [`Error::Plugin`] if the library is defective; [`Error::Input`] if the
/// hypothesis or a parameter does not fit, at its place in the file.
pub fn build_law(
    source: &Source,
    loaded: &LoadedLaw,
    id: &Spanned<String>,
    hypothesis: Hypothesis,
    parameters: &ParameterTable,
) -> Result<BuiltLaw, Error> {
    let description = loaded.description();
    if description.formulation(hypothesis).is_none() {
        let message = if description.formulations.is_empty() {
            format!("law `{}`: {}", description.id, description.doc)
        } else {
            format!(
                "law `{}` is made for {}, expected {}",
                description.id,
                description.hypotheses(),
                hypothesis.name()
            )
        };
        return Err(source.error(id.span(), message).into());
    }
    let mut used = Vec::new();
    let mut warnings = loaded.library().warnings().to_vec();
    refuse_unknown(source, description, parameters)?;
    for declared in &description.parameters {
        let given = parameters
            .iter()
            .find(|(key, _)| key.get_ref() == &declared.id);
        let value = match given {
            Some((_, value)) => {
                let number = number(source, declared, value)?;
                if !declared.usual.contain(number) {
                    warnings.push(format!(
                        "law `{}`: {} = {} is outside its usual range {}",
                        description.id,
                        declared.id,
                        with_unit(number, declared),
                        declared.usual
                    ));
                }
                number
            }
            None => match declared.default {
                Some(default) => default,
                None if declared.optional => f64::NAN,
                None => {
                    return Err(source
                        .error(
                            id.span(),
                            format!(
                                "law `{}` needs parameter `{}` [{}]: {}",
                                description.id, declared.id, declared.unit, declared.doc
                            ),
                        )
                        .hint(format!("it needs: {}", needed(description)))
                        .into());
                }
            },
        };
        used.push(UsedParameter {
            id: declared.id.clone(),
            value,
            by_default: given.is_none(),
        });
    }
    refuse_radians(source, description, &used, parameters)?;
    let values: Vec<f64> = used.iter().map(|p| p.value).collect();
    let law = loaded.build(hypothesis, &values).map_err(|failure| {
        if failure.library_at_fault {
            return Error::plugin(format!(
                "law `{}` of library {}: {}",
                description.id,
                loaded.library().path().display(),
                failure.reason
            ));
        }
        let place = failure.parameter.as_deref().and_then(|id| {
            parameters
                .iter()
                .find(|(key, _)| key.get_ref() == id)
                .map(|(_, value)| value.span())
        });
        source
            .error(
                place.unwrap_or_else(|| id.span()),
                format!(
                    "law `{}` refuses its parameters: {}",
                    description.id, failure.reason
                ),
            )
            .into()
    })?;
    let id = &description.id;
    warnings.extend(law.changes().iter().map(|it| format!("law `{id}`: {it}")));
    Ok(BuiltLaw {
        law,
        parameters: used,
        warnings,
    })
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
        Error::Plugin { message, hint } => {
            let place = source.place(&id.span());
            Error::Plugin {
                message: format!("{message}\n  needed by {place}"),
                hint,
            }
        }
        other => other,
    })
}

/// What a file says beside `law` if the library is made for another program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForeignKeys<'a> {
    /// The key `adapter`.
    pub(crate) adapter: Option<&'a Spanned<Adapter>>,
    /// The key `library`.
    pub(crate) library: Option<&'a Spanned<PathBuf>>,
    /// The key `sidecar`.
    pub(crate) sidecar: Option<&'a Spanned<PathBuf>>,
    /// The key `in_process`.
    pub(crate) in_process: Option<&'a Spanned<bool>>,
    /// The key `record`.
    pub(crate) record: Option<&'a Spanned<PathBuf>>,
    /// The key `externals`.
    pub(crate) externals: Option<&'a Spanned<Externals>>,
    /// The key `scratch`.
    pub(crate) scratch: Option<&'a Spanned<Scratch>>,
}

impl ForeignKeys<'_> {
    /// The library; `None` if it is one of the contract. Paths are relative to the file.
    ///
    /// # Errors
    /// [`Error::Input`] at a key that misses another, or a file that is not there.
    pub(crate) fn read(self, source: &Source) -> Result<Option<Foreign>, Error> {
        let path = |written: &Spanned<PathBuf>| {
            let file = source.path_at(&written.span());
            let path = file
                .parent()
                .unwrap_or(Path::new(""))
                .join(written.get_ref());
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
        let Some(adapter) = self.adapter else {
            let alone = [
                ("library", self.library.map(Spanned::span)),
                ("sidecar", self.sidecar.map(Spanned::span)),
                ("in_process", self.in_process.map(Spanned::span)),
                ("record", self.record.map(Spanned::span)),
                ("externals", self.externals.map(Spanned::span)),
                ("scratch", self.scratch.map(Spanned::span)),
            ];
            return match alone
                .into_iter()
                .find_map(|(key, at)| at.map(|at| (key, at)))
            {
                None => Ok(None),
                Some((key, at)) => Err(source
                    .error(at, format!("`{key}` needs an `adapter`"))
                    .hint(
                        "libraries of the contract are found by the law's id, more folders are \
                         named in `law_path`; `adapter = \"umat\"` is for Abaqus user subroutines, \
                         `adapter = \"mfront\"` for MFront behaviours",
                    )
                    .into()),
            };
        };
        let Some(library) = self.library else {
            let message = "`adapter` needs the `library` that it is for";
            return Err(source.error(adapter.span(), message).into());
        };
        self.refuse_without_worker(source, *adapter.get_ref())?;
        Ok(Some(Foreign {
            adapter: *adapter.get_ref(),
            library: existing("library", library)?,
            sidecar: self
                .sidecar
                .map(|written| existing("sidecar", written))
                .transpose()?,
            in_process: self.in_process.is_some_and(|written| *written.get_ref()),
            record: self.record.map(path),
            records_once: false,
            externals: self.externals.map(|written| *written.get_ref()),
            scratch: self.scratch.map(|written| *written.get_ref()),
        }))
    }

    /// Traps and scratch folders are a matter of the workers of UMATs.
    fn refuse_without_worker(self, source: &Source, adapter: Adapter) -> Result<(), Error> {
        let is_trap = |written: &Spanned<Externals>| *written.get_ref() == Externals::Trap;
        let is_kept = |written: &Spanned<Scratch>| *written.get_ref() == Scratch::Keep;
        let keys = [
            (
                "externals",
                self.externals.map(Spanned::span),
                self.externals.is_some_and(is_trap),
            ),
            (
                "scratch",
                self.scratch.map(Spanned::span),
                self.scratch.is_some_and(is_kept),
            ),
        ];
        let in_process = self.in_process.is_some_and(|written| *written.get_ref());
        for (key, at, needs_worker) in keys {
            let Some(at) = at else { continue };
            if adapter != Adapter::Umat {
                let message = format!("`{key}` is for `adapter = \"umat\"`");
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
}

fn refuse_unknown(
    source: &Source,
    description: &LawDescription,
    parameters: &ParameterTable,
) -> Result<(), Error> {
    let ids: Vec<&str> = description
        .parameters
        .iter()
        .map(|p| p.id.as_str())
        .collect();
    match parameters
        .keys()
        .find(|key| !ids.contains(&key.get_ref().as_str()))
    {
        None => Ok(()),
        Some(key) => Err(source
            .error(
                key.span(),
                format!(
                    "law `{}` has no parameter `{}`",
                    description.id,
                    key.get_ref()
                ),
            )
            .hint(suggestion(key.get_ref(), ids))
            .into()),
    }
}

fn needed(description: &LawDescription) -> String {
    let needed: Vec<String> = description
        .parameters
        .iter()
        .filter(|p| p.default.is_none() && !p.optional)
        .map(|p| format!("{} [{}]", p.id, p.unit))
        .collect();
    needed.join(", ")
}

/// The number that a written value stands for, within its bounds.
fn number(
    source: &Source,
    declared: &ParameterDescription,
    value: &Spanned<ParameterValue>,
) -> Result<f64, Error> {
    let id = &declared.id;
    let choices: Vec<&str> = declared.choices.iter().map(String::as_str).collect();
    let error = |message: String| source.error(value.span(), message);
    let number = match value.get_ref() {
        ParameterValue::Label(label) => {
            return match choices.iter().position(|choice| choice == label) {
                Some(index) => Ok(index as f64),
                None if choices.is_empty() => {
                    let message = format!("`{id}`: found the text \"{label}\", expected a number");
                    Err(error(message).into())
                }
                None => Err(error(format!("`{id}` has no choice `{label}`"))
                    .hint(suggestion(label, choices))
                    .into()),
            };
        }
        ParameterValue::Number(number) => *number,
        ParameterValue::Integer(number) => *number as f64,
    };
    if !choices.is_empty() {
        return Err(error(format!("`{id}` is one of {}", choices.join(", "))).into());
    }
    if !number.is_finite() || !declared.bounds.contain(number) {
        let bounds = declared.bounds;
        return Err(error(format!(
            "`{id}`: {} is outside {bounds}",
            with_unit(number, declared)
        ))
        .label(declared.doc.clone())
        .into());
    }
    Ok(number)
}

/// A value with its unit, if it has one.
fn with_unit(value: f64, declared: &ParameterDescription) -> String {
    let number = if value == 0.0 || (1e-6..1e10).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    };
    match declared.unit.as_str() {
        "" | "-" => number,
        unit => format!("{number} {unit}"),
    }
}

/// Refuses angles that can only be meant in radians: none of them reaches π/2 degrees.
fn refuse_radians(
    source: &Source,
    description: &LawDescription,
    used: &[UsedParameter],
    parameters: &ParameterTable,
) -> Result<(), Error> {
    let largest = description
        .parameters
        .iter()
        .zip(used)
        .filter(|(declared, _)| declared.unit == "deg")
        .map(|(_, used)| used)
        .max_by(|a, b| a.value.total_cmp(&b.value));
    let Some(UsedParameter { id, value, .. }) = largest else {
        return Ok(());
    };
    if !(0.05..=std::f64::consts::FRAC_PI_2).contains(value) {
        return Ok(());
    }
    let place = parameters.iter().find(|(key, _)| key.get_ref() == id);
    Err(source
        .error(
            place.map_or(0..0, |(_, value)| value.span()),
            format!("`{id}`: {value} deg looks like an angle in radians"),
        )
        .hint(format!(
            "angles are given in degrees: {:.1}?",
            value.to_degrees()
        ))
        .into())
}
