//! Requested results of a run, as plain values.

use crate::pile::{self, Pile};
use crate::probe::Probes;
use mechanics::simulation::{Part, Simulation};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The results that are wanted.
#[derive(Debug)]
pub struct OutputRequest {
    /// When the larger tables and the fields are written.
    pub output: Output,
    /// Numbers for every increment.
    pub probes: Probes,
    /// A pile whose forces are written for every increment.
    pub pile: Option<Pile>,
    /// Title of figures without a title.
    pub title: String,
    /// Curves that are drawn.
    pub figures: Vec<Figure>,
    /// Whether steps along the path of equilibrium are written, too.
    pub follows_path: bool,
}

impl OutputRequest {
    /// Columns of numbers that `history.csv` has for every increment.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let of_pile = self.pile.iter().flat_map(|_| pile::COLUMNS);
        self.probes.names().chain(of_pile)
    }

    /// What the numbers of every increment look at.
    pub(crate) fn looks_at(&self, simulation: &Simulation) -> Part {
        let mut part = self.probes.looks_at(simulation);
        if let Some(pile) = &self.pile {
            pile.looks_at(&mut part, simulation);
        }
        part
    }
}

/// Curves of columns over another one, of a stress over the integration points of a cut, or of what
/// holds along a pile.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Name of the file, without `.svg`.
    pub name: String,
    /// Title, if not the common one.
    pub title: Option<String>,
    /// Column (of a cut: quantity of a point; along a pile: of a station) along the horizontal axis.
    pub x: String,
    /// Text of the horizontal axis; the name if left out.
    pub x_label: Option<String>,
    /// Columns (quantities) along the vertical axis.
    pub y: Vec<String>,
    /// Text of the vertical axis.
    pub y_label: Option<String>,
    /// The vertical axis points downward.
    pub y_reversed: bool,
    /// Only this phase; all if left out.
    pub phase: Option<String>,
    /// The integration points of a cut instead of columns.
    pub points: Option<Cut>,
    /// The stations of the pile instead of columns, from the head down, after these increments of the
    /// phase, a curve for each; after the last one if absent.
    pub along_pile: Option<Vec<usize>>,
    /// Measured points, drawn as markers.
    pub measured: Vec<Measured>,
}

impl Figure {
    /// Whether its curves are columns, a point for each increment.
    pub fn is_of_columns(&self) -> bool {
        self.points.is_none() && self.along_pile.is_none()
    }
}

/// Measured points with their name.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Name, for the legend.
    pub label: String,
    /// Points in the order of their file.
    pub points: Vec<(f64, f64)>,
    /// The curve, from 0, that they are measured values of: they have its colour and no separate
    /// entry in the legend.
    pub of_curve: Option<usize>,
    /// The curve, from 0, whose colour they have, with an entry in the legend.
    pub colour_of: Option<usize>,
}

/// Integration points inside extents (ends excluded), at chosen increments.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// Group; by default all.
    pub group: Option<String>,
    /// Extent in x (r).
    pub x: Option<[f64; 2]>,
    /// Extent in y (z).
    pub y: Option<[f64; 2]>,
    /// After these increments of the phase, a curve for each; after the last one if absent.
    pub increments: Vec<usize>,
    /// Factor of what stands along the vertical axis.
    pub scale: f64,
}

/// How values become one.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Reduce {
    /// Arithmetic mean: regions of small elements have more points.
    Mean,
    /// Mean weighted by the area of each point, in axisymmetry times 2πr; for a layer or interface by
    /// its own area.
    Average,
    /// Sum of values times these areas; stresses and strains of a thin layer over its volume.
    Integral,
    /// Smallest.
    Min,
    /// Largest.
    Max,
    /// Sum.
    Sum,
}

/// Output.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "OutputInput")]
pub struct Output {
    /// Profile along interfaces and thin layers.
    pub profile: When,
    /// All integration points.
    pub points: When,
    /// Fields for a viewer.
    pub fields: When,
    /// Estimate the error of the mesh in the strains after every phase, and in the fields.
    pub mesh_error: bool,
}

/// When something is written.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// Never.
    #[default]
    Never,
    /// After each phase.
    Phases,
    /// After every increment.
    Increments,
}

impl When {
    /// Whether to write after increment `i` of `n`.
    pub fn includes(self, i: usize, n: usize) -> bool {
        match self {
            Self::Never => false,
            Self::Phases => i == n,
            Self::Increments => true,
        }
    }
}
