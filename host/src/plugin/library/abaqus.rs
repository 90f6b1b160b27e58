//! Utility routines of Abaqus that user subroutines call.

/// Keeps the routines in the program.
pub(super) fn keep() {}
