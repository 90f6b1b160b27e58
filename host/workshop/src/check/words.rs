//! Names of a routine's arguments in the program that it is made for, and hints for its author.

use super::specimen::Specimen;
use law::foreign::Adapter;

/// A program's names of arguments, and who describes a routine of it.
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

const OF_CONTRACT: Words = Words {
    stress: "the flux",
    strain: "the increment",
    stiffness: "the tangent",
    state: "internal variables",
    duration: "time increment",
    time: "time",
    site: ["element", "point", "position", "length"],
    increment: "the number of the increment",
    describer: "the description",
};

const OF_ABAQUS: Words = Words {
    stress: "STRESS",
    strain: "DSTRAN",
    stiffness: "DDSDDE",
    state: "STATEV",
    duration: "DTIME",
    time: "TIME",
    site: ["NOEL", "NPT", "COORDS", "CELENT"],
    increment: "KINC",
    describer: "the sidecar",
};

const OF_PLAXIS: Words = Words {
    stress: "Sig",
    strain: "dEps",
    stiffness: "D",
    state: "StVar",
    duration: "dTime",
    time: "Time0",
    site: ["iEl", "Int", "X, Y", "length"],
    increment: "iStep",
    describer: "the library",
};

const OF_MFRONT: Words = Words {
    stress: "the stress",
    stiffness: "K",
    duration: "dt",
    time: "the time",
    describer: "the library",
    ..OF_CONTRACT
};

impl Specimen {
    /// The program that it is made for, if not for the contract.
    pub(super) fn adapter(&self) -> Option<Adapter> {
        self.law.library().foreign().map(|foreign| foreign.adapter)
    }

    /// That program's names of arguments.
    pub(super) fn words(&self) -> Words {
        match self.adapter() {
            None => OF_CONTRACT,
            Some(Adapter::Umat) => OF_ABAQUS,
            Some(Adapter::Udsm) => OF_PLAXIS,
            Some(Adapter::Mfront) => OF_MFRONT,
        }
    }

    /// Whether it is a behaviour of MFront.
    pub(super) fn is_mfront(&self) -> bool {
        self.adapter() == Some(Adapter::Mfront)
    }

    /// Whether a sidecar describes it.
    pub(super) fn has_sidecar(&self) -> bool {
        self.adapter() == Some(Adapter::Umat)
    }

    /// Hint for the author of a UMAT about the sidecar; empty for routines without one.
    pub(super) fn advice(&self, text: &'static str) -> &'static str {
        if self.has_sidecar() { text } else { "" }
    }
}
