//! Bonds that the first tension breaks, where no normal stress keeps them: what their points do is decided by tractions
//! as small as rounding.

use super::Group;
use law::{End, Operator, Start, Strided};
use std::fmt;

/// Slip that a bond is tried with, m, and a trace of opening beside it.
const SLIP: f64 = 1e-9;
const TRACE: f64 = 1e-12;

/// What an interface's law is as it starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Bond {
    /// Kept by a normal stress or a tensile strength, or none.
    #[default]
    Other,
    /// The first tension breaks it, and no stress is there that keeps it.
    Bare,
}

/// A bond that began so, and what has become of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Torn {
    /// The group.
    pub group: String,
    /// Name of its law in the problem.
    pub law: String,
    /// Points that are open and carry nothing.
    pub open: usize,
    /// All points.
    pub of: usize,
}

impl fmt::Display for Torn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            group,
            law,
            open,
            of,
        } = self;
        write!(
            f,
            "interface `{group}` began without normal stress, and the bond of its law `{law}` breaks at the first tension, \
             if only that of rounding: {open} of {of} points are open and carry no shear; a normal stress to begin with, or a \
             tensile strength, keeps it"
        )
    }
}

fn is_nothing(traction: &[f64]) -> bool {
    !traction.iter().any(|t| t.abs() > 0.0)
}

impl Group {
    /// What has become of a bond that began so.
    pub fn torn(&self) -> Option<Torn> {
        let n_points = self.kinematics.n_points();
        let is_open = |point: &usize| {
            let both = self.jump_and_traction(*point);
            both.is_some_and(|(jump, traction)| jump[0] > 0.0 && is_nothing(&traction))
        };
        (self.bond == Bond::Bare).then(|| Torn {
            group: self.name.clone(),
            law: self.law.name.clone(),
            open: (0..n_points).filter(is_open).count(),
            of: n_points,
        })
    }

    /// What holds where no point has a normal traction, and the law carries shear there that a trace of opening
    /// takes away.
    pub(super) fn bond(&self) -> Bond {
        let law = &self.law.built.law;
        let is_plain = law.library().foreign().is_none() && law.loaded().shear_zone().is_none();
        if law.n_components() != 2 || !is_plain {
            return Bond::Other;
        }
        let n = self.kinematics.n_components();
        let mut normal = self.stress.committed.iter().skip(n / 4).step_by(n);
        if normal.any(|traction| traction.abs() > 0.0) {
            return Bond::Other;
        }
        let carries = |jump| self.tried(jump).map(|traction| !is_nothing(&traction));
        if [[0.0, SLIP], [TRACE, SLIP]].map(carries) == [Some(true), Some(false)] {
            Bond::Bare
        } else {
            Bond::Other
        }
    }

    /// Traction of the first point's law without stress after this jump; `None` if it fails.
    fn tried(&self, jump: [f64; 2]) -> Option<[f64; 2]> {
        let (_, law) = self.pieces(usize::MAX).into_iter().next()?;
        let state = self.internal.committed.get(..law.n_states())?;
        let (mut flux, mut after) = ([0.0; 2], state.to_vec());
        let rows = Strided::rows(2);
        let start = Start {
            n_points: 1,
            gradient: (&[0.0; 2], rows),
            gradient_end: (&jump, rows),
            flux: (&[0.0; 2], rows),
            state,
            time: 0.0,
            time_increment: 0.0,
            moment: self.moment,
            sites: &[],
        };
        let end = End {
            flux: (&mut flux, rows),
            state: &mut after,
            operator: &mut [],
        };
        law.integrate(&start, Operator::None, end).ok()?;
        Some(flux)
    }
}
