//! Installed, not built: the archive is made of what cargo has built, unpacked where there is no repository, and
//! used with an environment that has `PATH` and `HOME` alone.
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

mod laws;
mod pages;
mod program;
mod projects;
