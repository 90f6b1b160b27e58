//! Pilum for Python: laws on arrays, drivers, runs, and simulations that are stepped.
//!
//! This crate converts between Python's objects and those of the rooms; pages, tables and meshes are
//! Python's own (`host/python/pilum`). Whatever takes time is done without the interpreter's lock,
//! in a separate thread, while the calling thread listens for Ctrl-C and calls back (`task`).
#![expect(
    clippy::needless_pass_by_value,
    reason = "functions take what Python hands over"
)]

mod arrays;
mod arrow;
mod error;
mod law;
mod point;
mod posed;
mod process;
mod residuals;
mod run;
mod simulation;
mod state;
mod task;
mod value;

use pyo3::prelude::*;

/// The part of the package that is written in Rust.
#[pymodule]
fn _pilum(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<law::Law>()?;
    module.add_class::<residuals::Residuals>()?;
    module.add_class::<state::State>()?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<simulation::SimulationState>()?;
    module.add_function(wrap_pyfunction!(state::state_of, module)?)?;
    module.add_function(wrap_pyfunction!(law::found::describe, module)?)?;
    module.add_function(wrap_pyfunction!(law::found::laws, module)?)?;
    module.add_function(wrap_pyfunction!(point::point, module)?)?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(arrow::stream, module)?)?;
    module.add_function(wrap_pyfunction!(process::stands_for, module)?)?;
    module.add_function(wrap_pyfunction!(process::goes_on_as_copy, module)?)
}
