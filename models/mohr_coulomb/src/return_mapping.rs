//! Return mapping to the Mohr–Coulomb pyramid and its tension cut-off, in principal stresses.
//!
//! Letters are those of `LAW.md`; here `s` is the trial stress s\*, largest principal value first, and
//! `delta` is Δ, kPa.

use crate::spectral::Pair;
use crate::surface::{CutOff, Pyramid};
use nalgebra::Vector3;

/// Where a trial stress returns to. Each inadmissible trial stress has exactly one zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Zone {
    /// A face of the pyramid.
    Face,
    /// The edge s₁ = s₂ of the pyramid (triaxial compression).
    Edge12,
    /// The edge s₂ = s₃ of the pyramid (triaxial extension).
    Edge23,
    /// The apex of the pyramid.
    Apex,
    /// s₁ at the tensile strength.
    TensionPlane,
    /// s₁ = s₂ at the tensile strength.
    TensionEdge,
    /// All three at the tensile strength.
    TensionCorner,
    /// The edge between a face and the tension plane.
    FaceAndTension,
    /// The vertex between the edge s₁ = s₂ and the tension edge.
    Vertex12,
    /// The vertex between the edge s₂ = s₃ and the tension plane.
    Vertex23,
}

/// A stress on the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Returned {
    pub(crate) zone: Zone,
    /// Principal stresses, in the order of the trial stress.
    pub(crate) stress: Vector3<f64>,
    /// s₁ − s₂ and s₂ − s₃, free of the cancellation in `stress`.
    gaps: [f64; 2],
}

impl Returned {
    #[inline]
    fn to(zone: Zone, stress: [f64; 3], gaps: [f64; 2]) -> Self {
        Self {
            zone,
            stress: stress.into(),
            gaps,
        }
    }

    /// `κ_ij = (s_i − s_j)/(s_i* − s_j*)` of a pair: what the return leaves of a shear increment between
    /// the two principal axes, Eq. (11).
    #[inline]
    pub(crate) fn kappa(&self, trial: &Vector3<f64>, pair: Pair) -> f64 {
        let [x, y] = self.gaps;
        // Where two trial values coincide the return leaves both alone or merges both.
        let (gap, merged) = match pair {
            Pair::First12 => (x, 0.0),
            Pair::Outer13 => (x + y, 0.0),
            Pair::Last23 => (y, f64::from(self.zone == Zone::TensionPlane)),
        };
        let [i, j, _] = pair.places();
        let trial_gap = trial[i] - trial[j];
        if trial_gap > 0.0 {
            gap / trial_gap
        } else {
            merged
        }
    }
}

impl Pyramid {
    /// Returns an inadmissible trial stress, largest principal value first, Eq. (10).
    #[inline]
    pub(crate) fn return_stress(&self, s: &Vector3<f64>) -> Returned {
        let Some(cut) = &self.cut_off else {
            return self.to_pyramid(s);
        };
        if s[0] > cut.R_t {
            let end = self.to_cut_off(s, cut);
            if self.f(end.stress[0], end.stress[2]) <= 0.0 {
                return end;
            }
        }
        let end = self.to_pyramid(s);
        if end.stress[0] <= cut.R_t {
            end
        } else {
            self.to_intersection(s, cut)
        }
    }

    /// Face, edges and apex.
    #[inline]
    fn to_pyramid(&self, s: &Vector3<f64>) -> Returned {
        // Eq. (5).
        let delta = self.f(s[0], s[2]) / self.face.h;
        let x = s[0] - s[1] - 2.0 * delta * self.psi.a;
        let y = s[1] - s[2] - 2.0 * delta * self.psi.b;
        if x >= 0.0 && y >= 0.0 {
            let s3 = s[2] - delta * self.face.g[2];
            if self.gap_above(s3) >= 0.0 {
                let s1 = self.s1_above(s3);
                // Held in order: s₂ has the rounding of the trial stress.
                let s2 = (s[1] - delta * self.face.g[1]).min(s1).max(s3);
                return Returned::to(Zone::Face, [s1, s2, s3], [x, y]);
            }
        }
        // Eq. (6).
        if x < 0.0 {
            let mean = 0.5 * (s[0] + s[1]);
            let delta = self.f(mean, s[2]) / self.edge_12.h;
            let s3 = s[2] - delta * self.edge_12.g[2];
            let gap = self.gap_above(s3);
            if gap >= 0.0 {
                let s1 = self.s1_above(s3);
                return Returned::to(Zone::Edge12, [s1, s1, s3], [0.0, gap]);
            }
        }
        if y < 0.0 {
            let mean = 0.5 * (s[1] + s[2]);
            let delta = self.f(s[0], mean) / self.edge_23.h;
            let s3 = mean - delta * self.edge_23.g[2];
            let gap = self.gap_above(s3);
            if gap >= 0.0 {
                return Returned::to(Zone::Edge23, [self.s1_above(s3), s3, s3], [gap, 0.0]);
            }
        }
        // Eq. (7). For φ = 0 the gap is 2c and the apex is never reached.
        Returned::to(Zone::Apex, [self.apex; 3], [0.0, 0.0])
    }

    /// Tension plane, edge and corner, Eq. (8), for s₁\* above the tensile strength.
    #[inline]
    fn to_cut_off(&self, s: &Vector3<f64>, cut: &CutOff) -> Returned {
        let (R_t, nu) = (cut.R_t, self.nu);
        let fall = (s[0] - R_t) * nu / (1.0 - nu);
        let s2 = s[1] - fall;
        if s2 <= R_t {
            return Returned {
                zone: Zone::TensionPlane,
                stress: Vector3::new(R_t, s2, s[2] - fall),
                gaps: [R_t - s2, s[1] - s[2]],
            };
        }
        let s3 = s[2] - nu * ((s[0] - R_t) + (s[1] - R_t));
        let (zone, s3) = if s3 <= R_t {
            (Zone::TensionEdge, s3)
        } else {
            (Zone::TensionCorner, R_t)
        };
        Returned::to(zone, [R_t, R_t, s3], [0.0, R_t - s3])
    }

    /// Where the pyramid meets the cut-off, Eq. (9).
    #[inline]
    fn to_intersection(&self, s: &Vector3<f64>, cut: &CutOff) -> Returned {
        let (s1, s3) = (cut.R_t, cut.t_3);
        let s2 = s[1] - self.nu * ((s[0] - s1) + (s[2] - s3));
        let (zone, s2) = if s2 >= s1 {
            (Zone::Vertex12, s1)
        } else if s2 <= s3 {
            (Zone::Vertex23, s3)
        } else {
            (Zone::FaceAndTension, s2)
        };
        Returned::to(zone, [s1, s2, s3], [s1 - s2, s2 - s3])
    }
}
