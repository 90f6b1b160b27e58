//! What a library says about its laws, copied out of it and validated.

use abi::Hypothesis;
use serde::{Deserialize, Deserializer, Serialize, de};

/// A law as described by its library.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
}

/// A parameter as described by its library.
#[derive(Clone, Debug, Serialize, Deserialize)]
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

impl Bounds {
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
#[derive(Clone, Debug, Serialize, Deserialize)]
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
fn is_false(value: &bool) -> bool {
    !value
}

fn hypothesis<'de, D: Deserializer<'de>>(input: D) -> Result<&'static str, D::Error> {
    let name = String::deserialize(input)?;
    let mut known = Hypothesis::ALL.into_iter().map(Hypothesis::name);
    known
        .find(|known| *known == name)
        .ok_or_else(|| de::Error::custom(format!("there is no hypothesis `{name}`")))
}

/// An internal variable (one component of it, if it has several).
#[derive(Clone, Debug, Serialize, Deserialize)]
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
