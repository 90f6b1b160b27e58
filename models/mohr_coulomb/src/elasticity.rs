//! Isotropic elasticity.
//!
//! `E`, `ν` Young's modulus and Poisson's ratio, `λ`, `G` Lamé's constants; Voigt components
//! 11 22 33 12 \[13 23\] with engineering shear strains.

use nalgebra::{Matrix3, Vector3};

/// Isotropic elastic constants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elasticity {
    pub(crate) E: f64,
    pub(crate) nu: f64,
    pub(crate) lambda: f64,
    pub(crate) G: f64,
    /// 1/(2G).
    shear_compliance: f64,
    /// 1/(3λ + 2G).
    bulk_compliance: f64,
}

impl Elasticity {
    pub(crate) fn new(E: f64, nu: f64) -> Self {
        Self {
            E,
            nu,
            lambda: E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            G: E / (2.0 * (1.0 + nu)),
            shear_compliance: (1.0 + nu) / E,
            bulk_compliance: (1.0 - 2.0 * nu) / E,
        }
    }

    /// Stress after an elastic increment, Eq. (1).
    #[inline]
    pub(crate) fn trial_stress<const N: usize>(
        &self,
        stress: &[f64; N],
        strain_increment: &[f64; N],
    ) -> [f64; N] {
        let Self { lambda, G, .. } = *self;
        let volumetric = strain_increment[0] + strain_increment[1] + strain_increment[2];
        std::array::from_fn(|i| {
            stress[i]
                + if i < 3 {
                    lambda * volumetric + 2.0 * G * strain_increment[i]
                } else {
                    G * strain_increment[i]
                }
        })
    }

    /// Elastic operator, Eq. (1), row by row.
    #[inline]
    pub(crate) fn operator<const N: usize>(&self) -> [[f64; N]; N] {
        let mut d = [[0.0; N]; N];
        for i in 0..N {
            if i < 3 {
                d[i][..3].fill(self.lambda);
                d[i][i] += 2.0 * self.G;
            } else {
                d[i][i] = self.G;
            }
        }
        d
    }

    /// D of Eq. (12), between principal strains and principal stresses.
    pub(crate) fn principal_operator(&self) -> Matrix3<f64> {
        Matrix3::from_element(self.lambda) + Matrix3::from_diagonal_element(2.0 * self.G)
    }

    /// Equivalent shear strain and volumetric strain that belong to principal stresses, Eq. (13).
    #[inline]
    pub(crate) fn equivalent_strains(&self, stress: &Vector3<f64>) -> (f64, f64) {
        let sum = stress.sum();
        let deviator = stress.add_scalar(-sum / 3.0);
        let shear = (2.0 / 3.0 * deviator.norm_squared()).sqrt() * self.shear_compliance;
        (shear, sum * self.bulk_compliance)
    }
}
