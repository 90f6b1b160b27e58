//! Combinations of stress components that are controlled in place of the components themselves.

use crate::state::{N_MAX, Vector};
use abi::Hypothesis;
use nalgebra::{SMatrix, SVector};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

type Matrix = SMatrix<f64, N_MAX, N_MAX>;

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Coordinates of a segment. With flux components M σ, strains go by M⁻ᵀ, so that the work stays.
/// Shear components are the same in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// The components themselves.
    #[default]
    Cartesian,
    /// p = −(σ₁₁ + σ₂₂ + σ₃₃)/3, q = −σ₁₁ + (σ₂₂ + σ₃₃)/2, z = −σ₂₂ + σ₃₃.
    Roscoe,
    /// The same directions, M orthogonal.
    RoscoeIsomorph,
    /// −σ₁₁, −(σ₂₂ + σ₃₃)/√2, (−σ₂₂ + σ₃₃)/√2.
    Rendulic,
}

impl Frame {
    /// Names of its components, if they are not those of the hypothesis.
    fn components(self) -> Option<[&'static str; N_MAX]> {
        match self {
            Self::Cartesian => None,
            Self::Roscoe => Some(["p", "q", "z", "12", "13", "23"]),
            Self::RoscoeIsomorph => Some(["P", "Q", "Z", "12", "13", "23"]),
            Self::Rendulic => Some(["a", "r", "z", "12", "13", "23"]),
        }
    }

    /// Name of a component.
    pub(crate) fn component(self, number: usize, hypothesis: Hypothesis) -> &'static str {
        let names = self.components();
        names.map_or_else(|| hypothesis.components()[number], |names| names[number])
    }

    /// M.
    fn matrix(self) -> Matrix {
        let rows: [[f64; 3]; 3] = match self {
            Self::Cartesian => return Matrix::identity(),
            Self::Roscoe => [[-1.0 / 3.0; 3], [-1.0, 0.5, 0.5], [0.0, -1.0, 1.0]],
            Self::RoscoeIsomorph => [
                [-1.0 / SQRT_3; 3],
                [
                    -SQRT_2 / SQRT_3,
                    FRAC_1_SQRT_2 / SQRT_3,
                    FRAC_1_SQRT_2 / SQRT_3,
                ],
                [0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2],
            ],
            Self::Rendulic => [
                [-1.0, 0.0, 0.0],
                [0.0, -FRAC_1_SQRT_2, -FRAC_1_SQRT_2],
                [0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2],
            ],
        };
        let mut m = Matrix::identity();
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                m[(i, j)] = *value;
            }
        }
        m
    }

    /// M⁻¹. The rows of M are at right angles to each other.
    fn inverse(self) -> Matrix {
        let m = self.matrix();
        let squares = SVector::<f64, N_MAX>::from_fn(|i, _| m.row(i).norm_squared());
        Matrix::from_fn(|i, j| m[(j, i)] / squares[j])
    }

    /// The components of a flux in this frame.
    pub(crate) fn flux(self, cartesian: &Vector) -> Vector {
        self.times(&self.matrix(), cartesian)
    }

    /// The flux of components in this frame.
    pub(crate) fn cartesian_flux(self, components: &Vector) -> Vector {
        self.times(&self.inverse(), components)
    }

    /// The components of a gradient in this frame.
    pub(crate) fn gradient(self, cartesian: &Vector) -> Vector {
        self.times(&self.inverse().transpose(), cartesian)
    }

    /// The gradient of components in this frame.
    pub(crate) fn cartesian_gradient(self, components: &Vector) -> Vector {
        self.times(&self.matrix().transpose(), components)
    }

    fn times(self, matrix: &Matrix, vector: &Vector) -> Vector {
        if self == Self::Cartesian {
            return *vector;
        }
        (matrix * SVector::from(*vector)).into()
    }

    /// M D Mᵀ of a row-major operator.
    pub(crate) fn operator(self, operator: &mut [f64]) {
        if self == Self::Cartesian || operator.len() != N_MAX * N_MAX {
            return;
        }
        let m = self.matrix();
        let product = m * Matrix::from_row_slice(operator) * m.transpose();
        for i in 0..N_MAX {
            for j in 0..N_MAX {
                operator[i * N_MAX + j] = product[(i, j)];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const ALL: [Frame; 4] = [
        Frame::Cartesian,
        Frame::Roscoe,
        Frame::RoscoeIsomorph,
        Frame::Rendulic,
    ];

    #[test]
    fn there_and_back_and_the_same_work() {
        let stress = [-100.0, -50.0, -20.0, 5.0, 6.0, 7.0];
        let strain = [1e-3, -2e-3, 3e-3, 4e-3, 5e-3, 6e-3];
        let work = |a: &Vector, b: &Vector| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        for frame in ALL {
            let (s, e) = (frame.flux(&stress), frame.gradient(&strain));
            assert_relative_eq!(work(&s, &e), work(&stress, &strain), epsilon = 1e-12);
            let (stress_2, strain_2) = (frame.cartesian_flux(&s), frame.cartesian_gradient(&e));
            for i in 0..N_MAX {
                assert_relative_eq!(stress_2[i], stress[i], epsilon = 1e-11);
                assert_relative_eq!(strain_2[i], strain[i], epsilon = 1e-15);
            }
        }
    }

    #[test]
    fn roscoe_is_the_triaxial_test() {
        let p_q = Frame::Roscoe.flux(&[-250.0, -100.0, -100.0, 0.0, 0.0, 0.0]);
        assert_relative_eq!(p_q[0], 150.0, epsilon = 1e-12);
        assert_relative_eq!(p_q[1], 150.0, epsilon = 1e-12);
        let strain = Frame::Roscoe.gradient(&[-0.02, 0.01, 0.01, 0.0, 0.0, 0.0]);
        assert_relative_eq!(strain[0], 0.0, epsilon = 1e-17);
        assert_relative_eq!(strain[1], 0.02, epsilon = 1e-15);
    }
}
