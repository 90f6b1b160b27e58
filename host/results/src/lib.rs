//! Results of a simulation in a folder: tables, fields, pictures, a summary, checkpoints, and the report
//! that is made of them. They listen to a simulation and know nothing of the file it came from.

pub mod checkpoint;
mod fields;
pub mod figure;
mod file;
mod history_values;
mod leftovers;
mod log_file;
mod mesh_error;
mod mesh_table;
pub mod output_request;
pub mod pile;
pub mod point_figure;
pub mod point_table;
mod points;
pub mod pressures;
pub mod probe;
mod profile;
pub mod random;
mod recorder;
pub mod report;
pub mod run_table;
pub mod study;
mod summary;
mod table;

pub use checkpoint::Checkpoint;
pub use figure::Figures;
pub use history_values::HistoryValues;
pub use leftovers::{make_way, remove_comparison};
pub use mesh_table::MeshTable;
pub use output_request::OutputRequest;
pub use recorder::{Fault, Recorder, ResultsState};
pub use summary::{About, Ending, LawsOfGroup, Phase, Summary, end_summary};
pub use table::comma_separated;

/// The least and the greatest of some values; +∞ and -∞ if there are none.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}
