//! What a library says about its laws, copied out of it and validated.

use abi::Hypothesis;
use serde::{Deserialize, Deserializer, Serialize, de};

/// A law as described by its library.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct LawDescription {
    /// Identifier.
    pub id: String,
    /// Name in words.
    pub name: String,
    /// Version.
    pub version: String,
    /// Authors.
    pub author: String,
    /// Licence.
    pub licence: String,
    /// A sentence or two.
    pub doc: String,
    /// Sources.
    pub references: String,
    /// Parameters in the order of their values.
    pub parameters: Vec<ParameterDescription>,
    /// What the law offers, by hypothesis; only hypotheses this host knows.
    pub formulations: Vec<FormulationDescription>,
}

impl LawDescription {
    /// The formulation under a hypothesis.
    pub fn formulation(&self, hypothesis: Hypothesis) -> Option<&FormulationDescription> {
        self.formulations
            .iter()
            .find(|f| f.hypothesis == hypothesis.name())
    }

    /// Names of the hypotheses offered.
    pub fn hypotheses(&self) -> String {
        let names: Vec<&str> = self.formulations.iter().map(|f| f.hypothesis).collect();
        names.join(", ")
    }

    /// With words for what a library made for another program does not tell of its law.
    pub(crate) fn completed(self) -> Self {
        Self {
            name: or(self.name, &self.id),
            version: or(self.version, "unversioned"),
            author: or(self.author, "unknown"),
            licence: or(self.licence, "unknown licence"),
            references: or(self.references, "none given"),
            ..self
        }
    }
}

/// A text, or another if it is empty.
pub(crate) fn or(text: String, other: &str) -> String {
    if text.is_empty() {
        other.to_owned()
    } else {
        text
    }
}

/// The hypothesis of this name.
pub fn hypothesis_named(name: &str) -> Option<Hypothesis> {
    Hypothesis::ALL.into_iter().find(|h| h.name() == name)
}

/// Whether an id is made of a-z, 0-9 and _, and starts with a letter.
pub(crate) fn is_identifier(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(is_part)
}

/// A parameter as described by its library.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ParameterDescription {
    /// Identifier.
    pub id: String,
    /// Symbol.
    pub symbol: String,
    /// Unit.
    pub unit: String,
    /// One sentence.
    pub doc: String,
    /// Value if left out.
    pub default: Option<f64>,
    /// May be left out without a default; the law then does what `doc` says.
    pub optional: bool,
    /// Admissible values.
    pub bounds: Bounds,
    /// Usual values; outside them there is a warning.
    pub usual: Bounds,
    /// Labels, if the parameter is a choice; the value is the index.
    pub choices: Vec<String>,
}

/// An interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Lower end; may be −∞ (null in JSON).
    pub lower: f64,
    /// The lower end itself is excluded.
    pub open_lower: bool,
    /// Upper end; may be +∞ (null in JSON).
    pub upper: f64,
    /// The upper end itself is excluded.
    pub open_upper: bool,
}

impl Default for Bounds {
    /// Any value.
    fn default() -> Self {
        Self::closed(f64::NEG_INFINITY, f64::INFINITY)
    }
}

impl Bounds {
    /// Both ends belong to it.
    pub(crate) fn closed(lower: f64, upper: f64) -> Self {
        Self {
            lower,
            open_lower: false,
            upper,
            open_upper: false,
        }
    }

    /// Whether a value lies inside. NaN does not.
    pub fn contain(&self, value: f64) -> bool {
        let above = if self.open_lower {
            value > self.lower
        } else {
            value >= self.lower
        };
        let below = if self.open_upper {
            value < self.upper
        } else {
            value <= self.upper
        };
        above && below
    }
}

impl std::fmt::Display for Bounds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let open = if self.open_lower || self.lower == f64::NEG_INFINITY {
            '('
        } else {
            '['
        };
        let close = if self.open_upper || self.upper == f64::INFINITY {
            ')'
        } else {
            ']'
        };
        let end = |value: f64| match value {
            f64::INFINITY => "∞".to_owned(),
            f64::NEG_INFINITY => "−∞".to_owned(),
            _ => value.to_string(),
        };
        write!(f, "{open}{}, {}{close}", end(self.lower), end(self.upper))
    }
}

/// Quality of the tangents of a law for a solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// They are the derivatives of the update.
    #[default]
    Consistent,
    /// They are near them, such as elastic ones: Newton's method gains nothing by renewing them.
    Approximate,
    /// The law gives none: where one is wanted, the elastic operator takes its place.
    None,
}

impl Tangent {
    /// Whether they are the derivatives of the update.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
    fn is_consistent(&self) -> bool {
        *self == Self::Consistent
    }
}

/// By this name it is not taken for a text to borrow from the input.
type HypothesisName = &'static str;

/// What a law offers under one hypothesis.
#[expect(clippy::struct_excessive_bools, reason = "flags of the contract")]
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FormulationDescription {
    /// Name of the hypothesis.
    #[serde(deserialize_with = "hypothesis")]
    pub hypothesis: HypothesisName,
    /// Number of the formulation in its library.
    #[serde(skip)]
    pub index: u32,
    /// The tangent is symmetric in every state.
    pub symmetric: bool,
    /// One constant tangent, no internal variables.
    pub linear: bool,
    /// Quality of its tangents.
    #[serde(default, skip_serializing_if = "Tangent::is_consistent")]
    pub tangent: Tangent,
    /// It gives rates of its updates, by parameters too.
    #[serde(default, skip_serializing_if = "is_false")]
    pub rates: bool,
    /// Its response is known to depend on how long an increment takes.
    #[serde(default, skip_serializing_if = "is_false")]
    pub time_dependent: bool,
    /// Components are in axes of the layer.
    pub local_axes: bool,
    /// Internal variables in the order of their values, one entry per component.
    pub internal_variables: Vec<InternalVariable>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
pub(crate) fn is_false(value: &bool) -> bool {
    !value
}

fn hypothesis<'de, D: Deserializer<'de>>(input: D) -> Result<&'static str, D::Error> {
    let name = String::deserialize(input)?;
    hypothesis_named(&name)
        .map(Hypothesis::name)
        .ok_or_else(|| de::Error::custom(format!("there is no hypothesis `{name}`")))
}

/// An internal variable (one component of it, if it has several).
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct InternalVariable {
    /// Identifier; with `_<component>` if there are several components.
    pub id: String,
    /// Symbol.
    pub symbol: String,
    /// Unit.
    pub unit: String,
    /// One sentence.
    pub doc: String,
    /// Value before anything has happened, where the law does not compute one.
    pub initial_value: f64,
    /// A result to look at, without history.
    pub output_only: bool,
}

/// Names of gradient and flux of a hypothesis.
pub fn words(hypothesis: Hypothesis) -> (&'static str, &'static str) {
    match hypothesis {
        Hypothesis::Interface2d | Hypothesis::Interface3d => ("jump", "traction"),
        Hypothesis::PlaneStrain | Hypothesis::Axisymmetric | Hypothesis::ThreeD => {
            ("strain", "stress")
        }
    }
}
