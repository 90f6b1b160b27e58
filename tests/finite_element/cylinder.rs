//! Closed forms of long cylinders under radial pressure.

use crate::setup::Lame;

/// A ring of an elastic layered cylinder in plane strain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    /// Outer radius.
    pub(crate) to: f64,
    /// Elastic constants.
    pub(crate) constants: Lame,
    /// Normal stiffness of a joint at its outer face; infinite: none.
    pub(crate) joint: f64,
}

impl Ring {
    /// A ring that is glued to the next one.
    pub(crate) fn glued(to: f64, constants: Lame) -> Self {
        Self {
            to,
            constants,
            joint: f64::INFINITY,
        }
    }
}

/// Radial stresses (tension positive) at the outer faces of the rings of a full cylinder under
/// a unit pressure from outside.
///
/// In a ring u = A r + B/r, σ = 2 (λ + G) A − 2 G B/r². The core has B = 0; from there
/// displacement and stress at the inner face of every ring give its A and B, and a joint adds
/// σ/K_n to the displacement. Everything is in proportion, so the last stress is made −1.
pub(crate) fn stresses_at_faces(rings: &[Ring]) -> Vec<f64> {
    let mut stresses = Vec::new();
    let mut inner: Option<(f64, f64, f64)> = None;
    for ring in rings {
        let Lame { lambda, shear, .. } = ring.constants;
        let bulk = 2.0 * (lambda + shear);
        let (a, b) = match inner {
            None => (1.0, 0.0),
            Some((r, u, stress)) => {
                // bulk A − 2 G B/r² = σ, A + B/r² = u/r.
                let a = (stress + 2.0 * shear * u / r) / (bulk + 2.0 * shear);
                (a, r * u - a * r * r)
            }
        };
        let r = ring.to;
        let stress = bulk * a - 2.0 * shear * b / (r * r);
        stresses.push(stress);
        inner = Some((r, a * r + b / r + stress / ring.joint, stress));
    }
    let last = stresses[stresses.len() - 1];
    stresses.iter().map(|stress| -stress / last).collect()
}
