//! A law built from values by name: each held against what the law says of its parameters.

use crate::process::process_state;
use crate::{Law, LawDescription, LoadedLaw, ParameterDescription};
use abi::Hypothesis;
use std::fmt;
use text::suggestion;

/// A value that is given to a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number, in the parameter's unit.
    Number(f64),
    /// The label of a choice.
    Label(String),
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Value {
    fn from(label: &str) -> Self {
        Self::Label(label.to_owned())
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

/// A law with its parameters, and what the user should know about them.
#[derive(Debug)]
pub struct BuiltLaw {
    /// The law.
    pub law: Law,
    /// Parameters in declared order.
    pub parameters: Vec<UsedParameter>,
    /// Values outside their usual range, in words.
    pub warnings: Vec<String>,
}

/// Why a law cannot be built: what is wrong, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildFailure {
    /// Id of the law.
    pub law: String,
    /// The parameter that is concerned, if it is one.
    pub parameter: Option<String>,
    /// The defect.
    pub cause: BuildCause,
}

/// Defect of a law and its values.
#[derive(Clone, Debug, PartialEq)]
pub enum BuildCause {
    /// The law has nothing to offer at all, for this reason.
    Nothing(String),
    /// It is made for other hypotheses.
    Hypothesis {
        /// Names of those that it offers.
        offered: Vec<&'static str>,
        /// The one that was asked for.
        wanted: Hypothesis,
    },
    /// It has no such parameter; it has these.
    Unknown(Vec<String>),
    /// A parameter without a default is left out.
    Missing {
        /// Its unit.
        unit: String,
        /// Its kind.
        doc: String,
        /// All that have to be given, with their units.
        needed: Vec<String>,
    },
    /// A text where a number is expected.
    Text(String),
    /// No such choice; there are these.
    NoChoice(String, Vec<String>),
    /// A number where one of these choices is expected.
    Choice(Vec<String>),
    /// Outside its bounds.
    OutOfBounds {
        /// Value with its unit.
        value: String,
        /// The bounds.
        bounds: String,
        /// The parameter.
        doc: String,
    },
    /// An angle that can only be meant in radians.
    Radians(f64),
    /// The law refuses them for its own reason.
    Refused(String),
    /// The library is at fault, not the values.
    Library {
        /// Its place.
        library: String,
        /// What it did.
        reason: String,
    },
}

impl fmt::Display for BuildFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let law = &self.law;
        let id = self.parameter.as_deref().unwrap_or_default();
        match &self.cause {
            BuildCause::Nothing(why) => write!(f, "law `{law}`: {why}"),
            BuildCause::Hypothesis { offered, wanted } => write!(
                f,
                "law `{law}` is made for {}, expected {}",
                offered.join(", "),
                wanted.name()
            ),
            BuildCause::Unknown(_) => write!(f, "law `{law}` has no parameter `{id}`"),
            BuildCause::Missing { unit, doc, .. } => {
                write!(f, "law `{law}` needs parameter `{id}` [{unit}]: {doc}")
            }
            BuildCause::Text(label) => {
                write!(f, "`{id}`: found the text \"{label}\", expected a number")
            }
            BuildCause::NoChoice(label, _) => write!(f, "`{id}` has no choice `{label}`"),
            BuildCause::Choice(choices) => write!(f, "`{id}` is one of {}", choices.join(", ")),
            BuildCause::OutOfBounds { value, bounds, .. } => {
                write!(f, "`{id}`: {value} is outside {bounds}")
            }
            BuildCause::Radians(value) => {
                write!(f, "`{id}`: {value} deg looks like an angle in radians")
            }
            BuildCause::Refused(reason) => {
                write!(f, "law `{law}` refuses its parameters: {reason}")
            }
            BuildCause::Library { library, reason } => {
                write!(f, "law `{law}` of library {library}: {reason}")
            }
        }
    }
}

impl std::error::Error for BuildFailure {}

impl BuildFailure {
    /// A hint for the user, if one is known.
    pub fn hint(&self) -> Option<String> {
        let names = |names: &[String], given: &str| {
            suggestion(given, names.iter().map(String::as_str).collect::<Vec<_>>())
        };
        match &self.cause {
            BuildCause::Unknown(known) => {
                Some(names(known, self.parameter.as_deref().unwrap_or_default()))
            }
            BuildCause::NoChoice(label, choices) => Some(names(choices, label)),
            BuildCause::Missing { needed, .. } => Some(format!("it needs: {}", needed.join(", "))),
            BuildCause::Radians(value) => Some(format!(
                "angles are given in degrees: {:.1}?",
                value.to_degrees()
            )),
            _ => None,
        }
    }
}

impl LoadedLaw {
    /// Fixes parameters by name under a hypothesis. Omitted parameters take their default.
    ///
    /// # Errors
    /// The hypothesis or a value does not fit, or the library is at fault.
    pub fn with(
        &self,
        hypothesis: Hypothesis,
        given: &[(&str, Value)],
    ) -> Result<BuiltLaw, BuildFailure> {
        let description = self.description();
        if description.formulation(hypothesis).is_none() {
            let cause = not_offered(description, hypothesis);
            return Err(self.failure(None, cause));
        }
        let (used, unusual) = self.values(given)?;
        let warnings = self.library().warnings().iter().cloned();
        let mut warnings: Vec<String> = warnings.chain(unusual).collect();
        let values: Vec<f64> = used.iter().map(|p| p.value).collect();
        let law = self.build(hypothesis, &values).map_err(|refusal| {
            if refusal.library_at_fault {
                let library = self.library().path().display().to_string();
                let reason = refusal.reason;
                return self.failure(None, BuildCause::Library { library, reason });
            }
            let parameter = refusal.parameter.as_deref();
            self.failure(parameter, BuildCause::Refused(refusal.reason.clone()))
        })?;
        let id = &description.id;
        let zone = self.shear_zone();
        warnings.extend(zone.and_then(|zone| zone.implausible(id)));
        warnings.extend(law.changes().iter().map(|it| format!("law `{id}`: {it}")));
        warnings.extend(process_state::remarks());
        Ok(BuiltLaw {
            law,
            parameters: used,
            warnings,
        })
    }

    fn missing(&self, declared: &ParameterDescription) -> BuildFailure {
        let missing = BuildCause::Missing {
            unit: declared.unit.clone(),
            doc: declared.doc.clone(),
            needed: needed(self.description()),
        };
        self.failure(Some(&declared.id), missing)
    }

    /// Values of all parameters in declared order, each held against what the law says of it, and what is unusual
    /// about them, in words. The law is not called.
    ///
    /// # Errors
    /// A value does not fit, or is missing.
    pub fn values(
        &self,
        given: &[(&str, Value)],
    ) -> Result<(Vec<UsedParameter>, Vec<String>), BuildFailure> {
        let description = self.description();
        let mut unusual = Vec::new();
        let ids = || description.parameters.iter().map(|p| p.id.clone());
        if let Some((key, _)) = given.iter().find(|(key, _)| !ids().any(|id| id == *key)) {
            return Err(self.failure(Some(key), BuildCause::Unknown(ids().collect())));
        }
        let mut used = Vec::new();
        for declared in &description.parameters {
            let value = given.iter().find(|(key, _)| *key == declared.id);
            let number = match value {
                Some((_, value)) => {
                    let wrong = |cause| self.failure(Some(&declared.id), cause);
                    let number = number(declared, value).map_err(wrong)?;
                    if !declared.usual.contain(number) {
                        unusual.push(format!(
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
                    None => return Err(self.missing(declared)),
                },
            };
            used.push(UsedParameter {
                id: declared.id.clone(),
                value: number,
                by_default: value.is_none(),
            });
        }
        if let Some(UsedParameter { id, value, .. }) = radians(description, &used) {
            return Err(self.failure(Some(id), BuildCause::Radians(*value)));
        }
        Ok((used, unusual))
    }

    fn failure(&self, parameter: Option<&str>, cause: BuildCause) -> BuildFailure {
        BuildFailure {
            law: self.description().id.clone(),
            parameter: parameter.map(str::to_owned),
            cause,
        }
    }
}

fn not_offered(description: &LawDescription, wanted: Hypothesis) -> BuildCause {
    if description.formulations.is_empty() {
        return BuildCause::Nothing(description.doc.clone());
    }
    BuildCause::Hypothesis {
        offered: description
            .formulations
            .iter()
            .map(|f| f.hypothesis)
            .collect(),
        wanted,
    }
}

fn needed(description: &LawDescription) -> Vec<String> {
    let needed = description.parameters.iter();
    let needed = needed.filter(|p| p.default.is_none() && !p.optional);
    needed.map(|p| format!("{} [{}]", p.id, p.unit)).collect()
}

/// The number that a given value stands for, within its bounds.
fn number(declared: &ParameterDescription, value: &Value) -> Result<f64, BuildCause> {
    let choices = &declared.choices;
    let number = match value {
        Value::Label(label) => {
            return match choices.iter().position(|choice| choice == label) {
                Some(index) => Ok(index as f64),
                None if choices.is_empty() => Err(BuildCause::Text(label.clone())),
                None => Err(BuildCause::NoChoice(label.clone(), choices.clone())),
            };
        }
        Value::Number(number) => *number,
    };
    if !choices.is_empty() {
        return Err(BuildCause::Choice(choices.clone()));
    }
    if !number.is_finite() || !declared.bounds.contain(number) {
        return Err(BuildCause::OutOfBounds {
            value: with_unit(number, declared),
            bounds: declared.bounds.to_string(),
            doc: declared.doc.clone(),
        });
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

/// The largest angle, if all of them can only be meant in radians: none reaches π/2 degrees.
fn radians<'u>(
    description: &LawDescription,
    used: &'u [UsedParameter],
) -> Option<&'u UsedParameter> {
    let declared = description.parameters.iter().zip(used);
    let angles = declared.filter(|(declared, _)| declared.unit == "deg");
    let largest = angles
        .map(|(_, used)| used)
        .max_by(|a, b| a.value.total_cmp(&b.value));
    largest.filter(|used| (0.05..=std::f64::consts::FRAC_PI_2).contains(&used.value))
}
