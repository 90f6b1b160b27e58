//! What a study for an `accuracy` chose, as plain values.

use serde::Serialize;

/// Settings chosen for an `accuracy`.
#[derive(Clone, Debug, Serialize)]
pub struct AccuracySettings {
    /// Relative error asked for.
    pub asked: f64,
    /// Relative error estimated; none where too few runs came to their end.
    pub reached: Option<f64>,
    /// Share of increments and tolerance.
    pub without_mesh: Option<f64>,
    /// Share of the mesh, if it counts.
    pub mesh: Option<ChosenMesh>,
    /// It is known to be at most what was asked for.
    pub is_reached: bool,
    /// Whether it is.
    pub verdict: Verdict,
    /// By how much the two finest runs differ that came to their end, relative to the largest value.
    pub difference: Option<f64>,
    /// The column that they differ most in.
    pub worst: Option<String>,
    /// How the error was estimated.
    pub estimate: String,
    /// Number of the runs behind the error of increments that cut steps back: their steps are shorter than their increments.
    pub cut_back: usize,
    /// Increments by phase.
    pub increments: Vec<(String, usize)>,
    /// Tolerance of the residual.
    pub force_tolerance: f64,
    /// Tolerance of the correction.
    pub displacement_tolerance: f64,
    /// Parameters of laws that differ from the file, as `law.parameter = value`.
    pub parameters: Vec<String>,
    /// Columns that are zero but for round-off in all of the chosen run, and do not count.
    pub zero: Vec<String>,
    /// Runs that the study took.
    pub runs: usize,
    /// Those of them that did not come to their end.
    pub failed: Vec<FailedTrial>,
}

/// The mesh that such a study chose.
#[derive(Clone, Debug, Serialize)]
pub struct ChosenMesh {
    /// Sides of the file's elements are divided by this.
    pub divided_by: usize,
    /// Relative error estimated; none where no finer mesh tells it.
    pub error: Option<f64>,
    /// By how much the two finest meshes differ.
    pub difference: Option<f64>,
    /// The column that they differ most in.
    pub worst: Option<String>,
    /// How the error was estimated, or why it was not.
    pub estimate: String,
}

/// Whether an error that was asked for is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// The estimated error is at most this.
    #[serde(rename = "reached")]
    Reached,
    /// It is larger.
    #[serde(rename = "not reached")]
    NotReached,
    /// There is no estimate.
    #[serde(rename = "not known")]
    NotKnown,
}

impl Verdict {
    /// Compares the estimated error, if known, with the requested one.
    pub fn of(estimated: Option<f64>, asked: f64) -> Self {
        match estimated {
            Some(error) if error <= asked => Self::Reached,
            Some(_) => Self::NotReached,
            None => Self::NotKnown,
        }
    }
}

/// A run of the study that did not come to its end.
#[derive(Clone, Debug, Serialize)]
pub struct FailedTrial {
    /// What differed from the file.
    pub setting: String,
    /// Why, in one line.
    pub reason: String,
}
