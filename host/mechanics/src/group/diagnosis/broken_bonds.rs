//! Bonds without normal stress that break at the first tension: tractions as small as round-off decide what their
//! points do.

use crate::group::Group;
use law::Operator;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Slip that a bond is tried with, and a trace of opening, m.
pub(super) const SLIP: f64 = 1e-9;
const TRACE: f64 = 1e-12;

/// State of an interface's bond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::group) enum Bond {
    /// Kept by a normal stress or a tensile strength, or no bond, or reported already.
    #[default]
    Other,
    /// The first tension breaks it, and no normal stress keeps it.
    Bare,
}

/// A bond that began bare, and what has become of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenBond {
    /// The group.
    pub group: String,
    /// Name of its law in the problem.
    pub law: String,
    /// Points that are open and carry nothing.
    pub open: usize,
    /// All points.
    pub of: usize,
}

impl fmt::Display for BrokenBond {
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
             however small: "
        )?;
        if *open > 0 {
            write!(f, "{open} of {of} points are open and carry no shear")?;
        } else {
            write!(f, "nothing presses it together")?;
        }
        write!(
            f,
            "; a normal stress to begin with, or a tensile strength, keeps it"
        )
    }
}

fn is_nothing(traction: &[f64]) -> bool {
    !traction.iter().any(|t| t.abs() > 0.0)
}

impl Group {
    /// Reports a bare bond in two cases. Points have opened, and the others carry no more normal traction than shear
    /// (if pressure held these, the open ones were lifted off). Or no equilibrium was `reached`, no point is open, and
    /// some carry no normal traction.
    pub fn torn(&mut self, reached: bool) -> Option<BrokenBond> {
        if self.bond != Bond::Bare {
            return None;
        }
        let of = self.kinematics.n_points();
        let (mut open, mut pressed, mut closed) = (0, 0, [0.0, 0.0]);
        for (jump, traction) in (0..of).filter_map(|point| self.jump_and_traction(point)) {
            open += usize::from(jump[0] > 0.0 && is_nothing(&traction));
            pressed += usize::from(traction[0].abs() > 0.0);
            closed = [0, 1].map(|c| closed[c] + traction[c].abs());
        }
        let is_lost = open > 0 && closed[0] <= closed[1];
        let is_in_the_way = !reached && open == 0 && pressed < of;
        if open > 0 || pressed == of {
            self.bond = Bond::Other;
        }
        (is_lost || is_in_the_way).then(|| BrokenBond {
            group: self.name.clone(),
            law: self.law.name.clone(),
            open,
            of,
        })
    }

    /// State of the bond: bare if most points have no normal traction, and the law carries shear there that a trace of
    /// opening takes away. At the surface of ground a point or two without normal traction are usual.
    pub(in crate::group) fn bond(&self) -> Bond {
        let law = &self.law.built.law;
        let is_plain = law.library().foreign().is_none() && law.loaded().shear_zone().is_none();
        if law.n_components() != 2 || !is_plain {
            return Bond::Other;
        }
        let n = self.kinematics.n_components();
        let normal = self.stress.committed.iter().skip(n / 4).step_by(n);
        let kept = normal.filter(|traction| traction.abs() > 0.0).count();
        if 2 * kept >= self.kinematics.n_points() {
            return Bond::Other;
        }
        let carries = |jump| self.tried(0, jump).map(|traction| !is_nothing(&traction));
        if [[0.0, SLIP], [TRACE, SLIP]].map(carries) == [Some(true), Some(false)] {
            Bond::Bare
        } else {
            Bond::Other
        }
    }

    /// Traction of a point's law after this jump from no stress, with the point's internal variables; `None` if it fails.
    pub(super) fn tried(&self, point: usize, jump: [f64; 2]) -> Option<[f64; 2]> {
        let now = (Operator::None, (0.0, 0.0));
        let (flux, _) = self.call(point, (&[0.0; 2], &jump), &[0.0; 2], now).ok()?;
        flux.try_into().ok()
    }
}
