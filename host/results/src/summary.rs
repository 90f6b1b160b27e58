//! `summary.json`: what was run, with what, at what cost, and how it ended; as it is written and read.
//!
//! Every field may be missing, as in files of an earlier version.

mod progress;
mod settings;

pub use progress::{About, LawsOfGroup};
pub(crate) use progress::{Course, Progress, Stopped};
pub(crate) use settings::{RunSetting, names, settings, settings_of_files};

use crate::mesh_error::OfPhase;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::Path;
use text::write::replace_whole;
use text::{Error, Source};

/// Name of the file.
pub(crate) const FILE_NAME: &str = "summary.json";

/// Values by name.
pub(crate) type Named<T> = BTreeMap<String, T>;

/// The record of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Summary {
    #[serde(flatten)]
    pub(crate) head: Head,
    #[serde(flatten)]
    pub(crate) ending: Ending,
    /// None before a run has ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) warnings: Option<Vec<String>>,
    /// Phases that ended.
    pub phases: Vec<Phase>,
    pub(crate) law_calls: Named<LawCalls>,
    /// Points carried through laws, by group.
    pub law_calls_by_group: Named<u64>,
    pub(crate) operators_by_group: Named<u64>,
    pub(crate) state_bytes: Named<Value>,
    pub(crate) last_equilibrium: Option<Increment>,
    pub(crate) stopped_at: Option<Stop>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mesh_error: Option<Vec<OfPhase>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) pile: Option<Resistances>,
    pub(crate) probes: Named<Option<f64>>,
    /// The largest values that the probes could have had, by probe.
    pub probe_magnitudes: Named<Option<f64>>,
    pub(crate) seconds: Seconds,
}

/// The part of a summary that is known before the first increment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Head {
    pub(crate) program: String,
    pub(crate) case: String,
    pub(crate) variant: Option<String>,
    pub(crate) title: String,
    pub(crate) case_sha256: String,
    pub(crate) case_files: Vec<CaseFile>,
    pub(crate) set: Vec<String>,
    pub(crate) analysis: String,
    pub(crate) groups: Vec<Group>,
    pub(crate) solver: Map<String, Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) accuracy: Option<Value>,
    pub(crate) figures: Vec<Figure>,
    pub(crate) pictures: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) pile_section: Option<Section>,
    pub(crate) probe_units: Named<Option<String>>,
    pub(crate) laws: Named<Law>,
    pub(crate) mesh: Mesh,
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Ending {
    /// In a word.
    pub status: String,
    /// What went wrong, if something did.
    pub error: Option<String>,
    /// What gave way where no equilibrium was found.
    pub mechanism: Option<Value>,
}

/// The status of a run that goes on.
pub(crate) const RUNNING: &str = "running";
/// The status of a run that came to its end.
pub(crate) const DONE: &str = "done";

impl Ending {
    /// A run that came to its end.
    pub fn done() -> Self {
        Self {
            status: DONE.to_owned(),
            ..Self::default()
        }
    }
}

/// A file of a case.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct CaseFile {
    pub(crate) path: String,
    pub(crate) text: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Group {
    pub(crate) name: String,
    pub(crate) formulation: String,
    pub(crate) elements: Option<usize>,
    /// A number; in words where there are triangles and quads.
    pub(crate) points_per_element: Value,
    pub(crate) law: String,
    pub(crate) laws_from_phase: Named<String>,
}

/// A figure of probes; the page has its fields in this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Figure {
    /// None where another figure of the page has them already.
    pub(crate) measured: Option<Vec<Measured>>,
    pub(crate) name: String,
    pub(crate) phase: Option<String>,
    pub(crate) title: Option<String>,
    pub(crate) x: String,
    pub(crate) x_label: Option<String>,
    pub(crate) y: Vec<String>,
    pub(crate) y_label: Option<String>,
    #[serde(skip_serializing_if = "is_false")]
    pub(crate) y_reversed: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_false(value: &bool) -> bool {
    !value
}

/// A pile in the ground, for pictures; heights and widths in m.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Section {
    pub(crate) bottom: f64,
    /// From above.
    pub(crate) layers: Vec<Layer>,
    /// Phases that settlements and net loads are counted from.
    pub(crate) resets: Vec<String>,
    pub(crate) top: f64,
    /// Height of the water table by phase.
    pub(crate) water: Vec<(String, f64)>,
    pub(crate) width: f64,
}

/// A layer of the ground beside a pile.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Layer {
    pub(crate) bottom: f64,
    pub(crate) group: String,
    pub(crate) top: f64,
}

/// Measured points by coordinate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Measured {
    pub(crate) label: String,
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
#[expect(clippy::struct_field_names, reason = "names of the file")]
pub(crate) struct Law {
    pub(crate) law: String,
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) references: String,
    pub(crate) version: String,
    pub(crate) library: String,
    pub(crate) sha256: String,
    pub(crate) parameters: Named<Option<f64>>,
    pub(crate) described_parameters: Vec<Parameter>,
    pub(crate) internal_variables: Vec<Variable>,
    pub(crate) warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) shear_zone: Option<ShearZone>,
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub(crate) initial: Named<f64>,
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub(crate) expressions: Named<Expression>,
    /// Parameters without one value: over the height, or from group to group.
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub(crate) varying: Named<Range>,
}

/// The smallest and largest value of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Range {
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
}

/// A parameter that follows from others, with its smallest and largest value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[expect(clippy::struct_field_names, reason = "names of the file")]
pub(crate) struct Expression {
    pub(crate) expression: String,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Parameter {
    pub(crate) id: String,
    pub(crate) symbol: String,
    pub(crate) unit: String,
    pub(crate) value: Option<f64>,
    pub(crate) choice: Option<String>,
    pub(crate) by_default: Option<bool>,
    pub(crate) bounds: String,
    pub(crate) doc: String,
}

/// An internal variable.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Variable {
    pub(crate) id: String,
    pub(crate) symbol: String,
    pub(crate) unit: String,
    pub(crate) doc: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ShearZone {
    pub(crate) thickness: Option<f64>,
    pub(crate) lateral_ratio: Option<f64>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Mesh {
    pub(crate) nodes: Option<usize>,
    pub(crate) elements: Option<usize>,
    pub(crate) elements_by_group: Named<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<MeshFile>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct MeshFile {
    pub(crate) path: String,
    pub(crate) sha256: String,
}

/// A phase that ended.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Phase {
    pub(crate) name: String,
    pub(crate) method: String,
    pub(crate) equations: Option<usize>,
    pub(crate) out_of_balance: Option<f64>,
    pub(crate) at_rest: Option<f64>,
    /// Increments that reached equilibrium.
    pub increments: Option<u64>,
    /// Iterations of these, failed attempts included.
    pub iterations: Option<u64>,
    /// Steps repeated with a smaller length.
    pub cut_backs: Option<u64>,
    /// Where two halves of a step after a cut-back lead: how far from the whole, or that they lead nowhere.
    pub(crate) cut_back_in_halves: Value,
    pub(crate) unreliable_steps: Option<u64>,
    pub(crate) relaxed_steps: usize,
    pub(crate) viscous_steps: usize,
    pub(crate) viscous_from: Option<usize>,
    pub(crate) single_corrections_from: Option<usize>,
    pub(crate) regularised_steps: usize,
    pub(crate) tolerated_steps: usize,
    pub(crate) tolerated_residual: Option<f64>,
    pub(crate) tolerated_force: Option<f64>,
    pub(crate) residual_force: Option<f64>,
    pub(crate) by_force_steps: usize,
    pub(crate) by_force_open: LeftOpen,
    pub(crate) arc_length_steps: usize,
    /// Matrices factorised.
    pub factorisations: Option<u64>,
    pub(crate) fallbacks: u64,
    pub(crate) evaluations: u64,
    pub(crate) seconds: PhaseSeconds,
    pub(crate) probes: Named<Option<f64>>,
}

/// The most that steps left open in which the residual alone decided.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct LeftOpen {
    pub(crate) residual: Option<f64>,
    pub(crate) force: Option<f64>,
    pub(crate) correction: Option<f64>,
    pub(crate) nodes: usize,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct PhaseSeconds {
    pub(crate) laws_and_forces: Option<f64>,
    pub(crate) assembly: Option<f64>,
    pub(crate) equations: Option<f64>,
}

/// Points carried through a law, and how many of them with an operator.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct LawCalls {
    pub(crate) points: u64,
    pub(crate) operators: u64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Increment {
    pub(crate) phase: String,
    pub(crate) increment: usize,
}

/// The last state of equilibrium of a phase that could not go on.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Stop {
    pub(crate) phase: String,
    pub(crate) load_factor: Option<f64>,
    pub(crate) time: Option<f64>,
    pub(crate) probes: Named<Option<f64>>,
}

/// Resistances of a pile, net loads, each with the reason where there is none; the page has its fields in this
/// order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Resistances {
    pub(crate) base_at_10_percent_diameter: Option<f64>,
    pub(crate) diameter: Option<f64>,
    pub(crate) phase: Option<String>,
    pub(crate) resistance_10_percent_diameter: Option<f64>,
    pub(crate) resistance_10_percent_diameter_base: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resistance_10_percent_diameter_phase: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resistance_10_percent_diameter_reason: Option<String>,
    pub(crate) resistance_10_percent_diameter_shaft: Option<f64>,
    pub(crate) resistance_chin: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resistance_chin_reason: Option<String>,
    pub(crate) resistance_davisson: Option<f64>,
    pub(crate) resistance_davisson_base: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resistance_davisson_phase: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resistance_davisson_reason: Option<String>,
    pub(crate) resistance_davisson_shaft: Option<f64>,
    pub(crate) shaft_at_10_percent_diameter: Option<f64>,
    /// Settlement, and gross loads of head, shaft and base, that the curve of `phase` starts from.
    pub(crate) start: Option<[f64; 4]>,
    pub(crate) unit: String,
    pub(crate) uplift_10_percent_diameter: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) uplift_10_percent_diameter_phase: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) uplift_10_percent_diameter_reason: Option<String>,
    pub(crate) uplift_davisson: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) uplift_davisson_phase: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) uplift_davisson_reason: Option<String>,
    pub(crate) weight: Option<f64>,
}

/// Loads at the settlement of a criterion, or the reason why there is no value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Criterion {
    pub(crate) load: Option<f64>,
    pub(crate) shaft: Option<f64>,
    pub(crate) base: Option<f64>,
    pub(crate) phase: Option<String>,
    pub(crate) reason: Option<String>,
}

/// In total, and for output.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Seconds {
    pub(crate) total: Option<f64>,
    pub(crate) output: Option<f64>,
}

/// A run that goes on, as far as its summary knows it.
#[derive(Serialize)]
pub(crate) struct Running<'s> {
    #[serde(flatten)]
    pub(crate) head: &'s Head,
    pub(crate) status: &'static str,
}

impl Summary {
    /// Reads that of a folder.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Input`] if it is not one that a run has written.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(FILE_NAME);
        let text = std::fs::read_to_string(&path);
        let text = text.map_err(|why| Error::unreadable(&path, why))?;
        let summary: Self = serde_json::from_str(&text).map_err(|error| {
            let lines = text.split_inclusive('\n').take(error.line().max(1) - 1);
            let at = lines.map(str::len).sum::<usize>() + error.column().max(1) - 1;
            let at = (0..=at.min(text.len())).rfind(|&at| text.is_char_boundary(at));
            let at = at.unwrap_or(0);
            let message = format!("not written by a run: {error}");
            Source::new(&path, text.as_str()).error(at..at, message)
        })?;
        if summary.ending.status.is_empty() {
            let source = Source::new(&path, "");
            let message = format!("not written by a run: {} has no `status`", path.display());
            return Err(source.error(0..0, message).into());
        }
        Ok(summary)
    }
}

/// Writes what a folder's summary says whole or not at all, its keys in the order of the alphabet.
pub(crate) fn write(folder: &Path, summary: impl Serialize) -> Result<(), Error> {
    let internal = |error: serde_json::Error| Error::Internal(error.to_string());
    let summary = serde_json::to_value(summary).map_err(internal)?;
    let text = serde_json::to_string_pretty(&summary).map_err(internal)?;
    replace_whole(&folder.join(FILE_NAME), text + "\n")
}

/// Has the summary of a run that could not end it say how it ended. Whether there is one.
///
/// # Errors
/// [`Error::Unreadable`] or [`Error::Unwritable`].
pub fn end_summary(folder: &Path, ending: &Ending) -> Result<bool, Error> {
    /// A summary whose other values stay as they are.
    #[derive(Serialize, Deserialize)]
    struct Ended {
        #[serde(flatten)]
        ending: Ending,
        #[serde(flatten)]
        rest: Map<String, Value>,
    }

    let path = folder.join(FILE_NAME);
    if !path.is_file() {
        return Ok(false);
    }
    let text = std::fs::read_to_string(&path);
    let text = text.map_err(|why| Error::unreadable(&path, why))?;
    let Ok(mut summary) = serde_json::from_str::<Ended>(&text) else {
        return Ok(false);
    };
    summary.ending = ending.clone();
    write(folder, summary)?;
    Ok(true)
}
