//! A thin layer with an interface law: the paper's isotropic layer (equations 4, 5, 18, 19),
//! written as an interface law plus elasticity along the layer.
//!
//! With the law's elastic stiffnesses K_n, K_t and the thickness t, the layer's oedometric
//! modulus is M = K_n t, its shear modulus G = K_t t, and λ = M − 2G. Plastic strain occurs only
//! in the normal and the shear component, so with κ = λ/M = 1 − 2K_t/K_n and ε_i = ε_m + ε_θ
//!
//! - \[u_n\] = t (ε_n + κ ε_i), \[u_t\] = t γ (1)
//! - Δσ_m = κ (Δσ_n − λ Δε_i) + M Δε_m + λ Δε_θ, and the same for θ (2)
//!
//! In elasticity (1), (2) are Hooke's law: Δσ_n = K_n \[u_n\] = M Δε_n + λ Δε_i.
//! Components of the layer's strains and stresses: 0 = m (along), 1 = n (across), 2 = θ (out of
//! plane), 3 = shear.

use crate::group::Field;
use crate::problem::InPlane;

/// State of a thin layer with an interface law.
#[derive(Debug)]
pub(in crate::group) struct Layer {
    /// Jumps of all points.
    pub(in crate::group) jump: Field,
    /// Thickness of every element, m.
    thickness: Vec<f64>,
    in_plane: InPlane,
    points_per_element: usize,
    /// K_n, K_t of every point, of the stress that the law started from.
    pub(in crate::group) stiffness: Vec<[f64; 2]>,
}

/// Constants of one point.
struct Moduli {
    t: f64,
    kappa: f64,
    lambda: f64,
    m: f64,
}

impl Layer {
    pub(in crate::group) fn new(
        thickness: Vec<f64>,
        in_plane: InPlane,
        points_per_element: usize,
    ) -> Self {
        let n_points = thickness.len() * points_per_element;
        Self {
            jump: Field::new(vec![0.0; 2 * n_points]),
            thickness,
            in_plane,
            points_per_element,
            stiffness: vec![[0.0; 2]; n_points],
        }
    }

    /// Takes the elastic operators of a law that starts now, or restarts with other parameters.
    pub(in crate::group) fn start(&mut self, operators: &[f64], anew: bool) {
        if anew {
            self.jump.committed.fill(0.0);
        }
        for (stiffness, operator) in self.stiffness.iter_mut().zip(operators.chunks_exact(4)) {
            *stiffness = [operator[0], operator[3]];
        }
    }

    pub(in crate::group) fn thickness_at(&self, point: usize) -> f64 {
        self.thickness[point / self.points_per_element]
    }

    /// E* of (18) is positive only for K_n > 4/3 K_t; the first point where it is not.
    pub(in crate::group) fn impossible(&self) -> Option<[f64; 2]> {
        (self.in_plane == InPlane::Elastic)
            .then(|| {
                self.stiffness
                    .iter()
                    .find(|[k_n, k_t]| *k_n <= 4.0 / 3.0 * k_t)
                    .copied()
            })
            .flatten()
    }

    fn moduli(&self, point: usize) -> Moduli {
        let t = self.thickness_at(point);
        let [k_n, k_t] = self.stiffness[point];
        match self.in_plane {
            InPlane::Elastic => {
                let kappa = 1.0 - 2.0 * k_t / k_n;
                Moduli {
                    t,
                    kappa,
                    lambda: kappa * k_n * t,
                    m: k_n * t,
                }
            }
            InPlane::None => Moduli {
                t,
                kappa: 0.0,
                lambda: 0.0,
                m: 0.0,
            },
        }
    }

    /// Trial jumps, equation (1) in increments.
    pub(in crate::group) fn jumps_from_strains(&mut self, strain_0: &[f64], strain: &[f64]) {
        self.jump.begin();
        for point in 0..self.stiffness.len() {
            let Moduli { t, kappa, .. } = self.moduli(point);
            let change = |c: usize| strain[4 * point + c] - strain_0[4 * point + c];
            let jump = [
                t * (change(1) + kappa * (change(0) + change(2))),
                t * change(3),
            ];
            for c in 0..2 {
                self.jump.trial[2 * point + c] = self.jump.committed[2 * point + c] + jump[c];
            }
        }
    }

    /// Trial stresses along the layer, equation (2); those across it are already there.
    pub(in crate::group) fn stresses_along(&self, strain: &Field, stress: &mut Field) {
        for point in 0..self.stiffness.len() {
            let Moduli {
                kappa, lambda, m, ..
            } = self.moduli(point);
            let at = |c: usize| 4 * point + c;
            let change = |c: usize| strain.trial[at(c)] - strain.committed[at(c)];
            let (e_m, e_theta) = (change(0), change(2));
            let common =
                kappa * (stress.trial[at(1)] - stress.committed[at(1)] - lambda * (e_m + e_theta));
            stress.trial[at(0)] = stress.committed[at(0)] + common + m * e_m + lambda * e_theta;
            stress.trial[at(2)] = stress.committed[at(2)] + common + m * e_theta + lambda * e_m;
        }
    }

    /// 4 × 4 tangents of the layer from the law's 2 × 2 ones: derivatives of (1) and (2).
    pub(in crate::group) fn tangents(&self, operators: &[f64], tangents: &mut [f64]) {
        let points = operators.chunks_exact(4).zip(tangents.chunks_exact_mut(16));
        for (point, (d, tangent)) in points.enumerate() {
            let Moduli {
                t,
                kappa,
                lambda,
                m,
            } = self.moduli(point);
            // Derivatives of normal and shear stress by (ε_m, ε_n, ε_θ, γ).
            let normal = [t * d[0] * kappa, t * d[0], t * d[0] * kappa, t * d[1]];
            let shear = [t * d[2] * kappa, t * d[2], t * d[2] * kappa, t * d[3]];
            for c in 0..4 {
                let in_plane = if c == 0 || c == 2 { 1.0 } else { 0.0 };
                let common = kappa * (normal[c] - lambda * in_plane);
                let own = |own: usize, other: usize| {
                    m * f64::from(u8::from(c == own)) + lambda * f64::from(u8::from(c == other))
                };
                tangent[c] = common + own(0, 2);
                tangent[4 + c] = normal[c];
                tangent[8 + c] = common + own(2, 0);
                tangent[12 + c] = shear[c];
            }
        }
    }
}
