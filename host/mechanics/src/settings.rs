//! How equilibrium is sought.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, de};
use std::fmt::Debug;

/// Solver settings.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Serialize)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "SolverInput")]
pub struct Settings {
    /// Matrix of the iterations.
    pub method: Method,
    /// Source of the laws' tangents.
    pub tangents: Tangents,
    /// Largest residual over the forces that `tolerance_of` names (2-norms).
    #[serde(deserialize_with = "tolerance")]
    pub force_tolerance: f64,
    /// Largest correction over the displacement increment (2-norms).
    #[serde(deserialize_with = "tolerance")]
    pub displacement_tolerance: f64,
    /// Residual, relative as `force_tolerance`, tolerated where iterations and relaxation stand still
    /// and displacements have settled to a tenth of the increment; reported and counted in the summary.
    /// 0: none.
    #[serde(deserialize_with = "tolerated")]
    pub tolerated_residual: f64,
    /// Forces that the residual is measured against.
    pub tolerance_of: ToleranceOf,
    /// Criterion of equilibrium.
    pub convergence: Convergence,
    /// Iterations before a cut-back; default: 25 for `auto` and `newton`, 200 for `modified_newton`,
    /// 1000 for `initial_stress`, 100 for `quasi_newton`.
    #[serde(deserialize_with = "iterations")]
    pub max_iterations: Option<usize>,
    /// Most halvings of an increment; at least 6 under viscous control.
    #[serde(deserialize_with = "halvings")]
    pub max_halvings: u32,
    /// Search along corrections that make the residual grow.
    pub line_search: bool,
    /// Relax viscously where Newton iterations stand still.
    pub relaxation: bool,
    /// Regularised corrections before viscous relaxation: a third of the iterations in ground whose dilatancy is smaller
    /// than its friction.
    pub regularisation: bool,
    /// Control of the path from one equilibrium to the next.
    pub control: Control,
    /// Treatment of linear groups.
    pub equations: Equations,
}

/// Bounds of the settings that are numbers: of tolerances, not below what double precision reaches, and not
/// above the quantity itself; a step halved more often hardly moves the load factor in double precision.
const TOLERANCE: [f64; 2] = [1e-14, 1.0];
const TOLERATED: [f64; 2] = [0.0, 0.1];
const ITERATIONS: [usize; 2] = [1, 10_000];
const HALVINGS: [u32; 2] = [0, 40];

impl Settings {
    /// The first number that is outside its bounds: its name in files, its value, the bounds.
    pub fn outside(&self) -> Option<(&'static str, f64, [f64; 2])> {
        let iterations = self.max_iterations.unwrap_or(ITERATIONS[0]);
        [
            ("force_tolerance", self.force_tolerance, TOLERANCE),
            (
                "displacement_tolerance",
                self.displacement_tolerance,
                TOLERANCE,
            ),
            ("tolerated_residual", self.tolerated_residual, TOLERATED),
            (
                "max_iterations",
                iterations as f64,
                ITERATIONS.map(|n| n as f64),
            ),
            (
                "max_halvings",
                f64::from(self.max_halvings),
                HALVINGS.map(f64::from),
            ),
        ]
        .into_iter()
        .find(|(_, value, [least, most])| !(least..=most).contains(&value))
    }

    /// Iterations after which an increment is cut back.
    pub fn max_iterations(&self) -> usize {
        self.max_iterations
            .unwrap_or_else(|| self.method.max_iterations())
    }
}

impl Settings {
    /// Criteria of the iterations: without a limit to the last correction if the residual alone
    /// decides.
    #[must_use]
    pub fn in_force(self) -> Self {
        match self.convergence {
            Convergence::Both => self,
            Convergence::Force => Self {
                displacement_tolerance: f64::INFINITY,
                ..self
            },
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            tangents: Tangents::default(),
            force_tolerance: 1e-9,
            displacement_tolerance: 1e-7,
            tolerated_residual: 1e-3,
            tolerance_of: ToleranceOf::ForcesInPlay,
            convergence: Convergence::Both,
            max_iterations: None,
            max_halvings: 10,
            line_search: true,
            equations: Equations::Auto,
            relaxation: true,
            regularisation: true,
            control: Control::Auto,
        }
    }
}

/// Which matrix the iterations use.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Consistent tangents, kept while each correction removes nearly all of the residual.
    #[default]
    Auto,
    /// Consistent tangents at every iteration.
    Newton,
    /// Consistent tangents of the first iteration of each step.
    ModifiedNewton,
    /// Elastic stiffness, factorised once a phase.
    InitialStress,
    /// Consistent tangents of an earlier iteration, renewed without progress, with acceleration.
    QuasiNewton,
}

impl Method {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Newton => "newton",
            Self::ModifiedNewton => "modified_newton",
            Self::InitialStress => "initial_stress",
            Self::QuasiNewton => "quasi_newton",
        }
    }

    /// Whether iterations fall back on consistent tangents wherever others do worse.
    pub fn is_newton(self) -> bool {
        matches!(self, Self::Auto | Self::Newton)
    }

    /// Iterations that are allowed by default: the slower the method, the more.
    pub fn max_iterations(self) -> usize {
        match self {
            Self::Auto | Self::Newton => 25,
            Self::ModifiedNewton => 200,
            Self::InitialStress => 1000,
            Self::QuasiNewton => 100,
        }
    }
}

/// Where the tangents of laws come from.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangents {
    /// The law's; with the methods `auto` and `newton` differences of its stresses if they are
    /// declared or found inexact.
    #[default]
    Auto,
    /// The law's, always.
    Law,
    /// Differences of the stresses of all nonlinear laws.
    Differences,
}

/// Forces that the residual is measured against.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ToleranceOf {
    /// All forces in play; of ground, its weight is the largest part.
    #[default]
    ForcesInPlay,
    /// The change of nodal forces and reactions since the start of the phase: that of a pile load, not of the weight
    /// of the ground around it.
    ActiveLoad,
}

impl ToleranceOf {
    /// Its words in messages.
    pub fn words(self) -> &'static str {
        match self {
            Self::ForcesInPlay => "forces in play",
            Self::ActiveLoad => "active load",
        }
    }
}

/// Tolerances of a state.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Convergence {
    /// Residual and last correction.
    #[default]
    Both,
    /// Residual alone, for displacements that drift at a known load; with a `force_tolerance` of 1e-2 to
    /// 1e-4 the tolerance of geotechnical programs. The end of the phase reports the corrections.
    Force,
}

/// What leads from one equilibrium to the next.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Control {
    /// Load factor; after five steps without equilibrium `viscous` to the end of the increment, unless
    /// `relaxation` is off.
    #[default]
    Auto,
    /// Load factor; the phase ends where that fails.
    Load,
    /// Load factor; where that fails, the arc length of the path, on which the load may fall.
    ArcLength,
    /// Load factor; where that fails, the path of a viscous body to its next equilibrium, step by step.
    Viscous,
}

impl Control {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Load => "load",
            Self::ArcLength => "arc_length",
            Self::Viscous => "viscous",
        }
    }

    /// Whether a standstill is left by viscous relaxation.
    pub fn relaxes(self) -> bool {
        matches!(self, Self::Auto | Self::Load)
    }
}

/// How the equations of a phase are set up.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Equations {
    /// Condensed where probably faster.
    #[default]
    Auto,
    /// Factorised once a phase and condensed onto the nodes shared with others.
    Condensed,
    /// All groups assembled and factorised at every iteration.
    Sparse,
}

fn tolerance<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
    within(f64::deserialize(input)?, TOLERANCE)
}

fn tolerated<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
    within(f64::deserialize(input)?, TOLERATED)
}

fn iterations<'de, D: Deserializer<'de>>(input: D) -> Result<Option<usize>, D::Error> {
    within(usize::deserialize(input)?, ITERATIONS).map(Some)
}

fn halvings<'de, D: Deserializer<'de>>(input: D) -> Result<u32, D::Error> {
    within(u32::deserialize(input)?, HALVINGS)
}

fn within<T: Copy + PartialOrd + Debug, E: de::Error>(
    value: T,
    [least, most]: [T; 2],
) -> Result<T, E> {
    if value >= least && value <= most {
        return Ok(value);
    }
    Err(E::custom(format!(
        "{value:?} is outside [{least:?}, {most:?}]"
    )))
}
