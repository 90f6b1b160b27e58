//! What other programs call the arguments of a routine, and what an author can do about it.

use crate::check::specimen::Specimen;
use law::adapter::Adapter;

/// What a program calls arguments and who describes a routine of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words {
    pub(super) stress: &'static str,
    pub(super) strain: &'static str,
    pub(super) stiffness: &'static str,
    pub(super) state: &'static str,
    pub(super) duration: &'static str,
    pub(super) time: &'static str,
    /// Number of the element, integration point in it, coordinates, characteristic length.
    pub(super) site: [&'static str; 4],
    pub(super) increment: &'static str,
    pub(super) describer: &'static str,
}

impl Words {
    pub(super) fn of(routine: &Specimen) -> Self {
        match routine.law.library().foreign().map(|f| f.adapter) {
            Some(Adapter::Udsm) => Self {
                stress: "Sig",
                strain: "dEps",
                stiffness: "D",
                state: "StVar",
                duration: "dTime",
                time: "Time0",
                site: ["iEl", "Int", "X, Y", "length"],
                increment: "iStep",
                describer: "the library",
            },
            Some(Adapter::Mfront) => Self {
                stress: "the stress",
                strain: "the increment",
                stiffness: "K",
                state: "internal variables",
                duration: "dt",
                time: "the time",
                site: ["element", "point", "position", "length"],
                increment: "the number of the increment",
                describer: "the library",
            },
            _ => Self {
                stress: "STRESS",
                strain: "DSTRAN",
                stiffness: "DDSDDE",
                state: "STATEV",
                duration: "DTIME",
                time: "TIME",
                site: ["NOEL", "NPT", "COORDS", "CELENT"],
                increment: "KINC",
                describer: "the sidecar",
            },
        }
    }
}

/// Whether it is a behaviour of MFront.
pub(super) fn is_mfront(routine: &Specimen) -> bool {
    routine.law.library().foreign().map(|f| f.adapter) == Some(Adapter::Mfront)
}

/// Whether a sidecar describes it.
pub(super) fn has_sidecar(routine: &Specimen) -> bool {
    routine.law.library().foreign().map(|f| f.adapter) == Some(Adapter::Umat)
}

/// Hint for the author of a UMAT about the sidecar; empty for routines without one.
pub(super) fn advice(routine: &Specimen, text: &'static str) -> &'static str {
    if has_sidecar(routine) { text } else { "" }
}
