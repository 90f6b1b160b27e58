//! The `pilum` program.
fn main() {}
