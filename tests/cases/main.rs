//! The cases in `cases/`, run as a user runs them, against what their READMEs say.

mod chamber;
