//! The program as its users meet it, mistakes included: exit codes, messages, files.

mod arguments;
mod bases;
mod calibrate;
mod capsule;
mod ended;
mod isolate;
mod libraries;
mod loading;
mod measured;
mod mesh;
mod model;
mod names;
mod overflow;
mod parameters;
mod pile;
mod plausible;
mod point;
mod program;
mod results;
#[cfg(unix)]
mod resume;
mod run_table;
mod running;
mod settings;
mod shear_zone;
mod stopping;
mod streams;
mod study;
mod study_cases;
mod swapped;
mod syntax;
mod trade_off;
mod troubled;
mod trust;
mod udsm;
mod umat;
