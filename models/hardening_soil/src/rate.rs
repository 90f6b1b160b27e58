//! Derivatives by all components of the strain increment at once, so that a chain rule is written as for one number
//! and computed as for vectors.

use std::array;
use std::ops::{Add, Mul, Neg, Sub};

/// Derivatives of a number by the components of the strain increment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate<const N: usize>(pub(crate) [f64; N]);

impl<const N: usize> Rate<N> {
    pub(crate) const ZERO: Self = Self([0.0; N]);
}

impl<const N: usize> Add for Rate<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(array::from_fn(|j| self.0[j] + other.0[j]))
    }
}

impl<const N: usize> Sub for Rate<N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(array::from_fn(|j| self.0[j] - other.0[j]))
    }
}

impl<const N: usize> Mul<f64> for Rate<N> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}

impl<const N: usize> Neg for Rate<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

/// What linear formulas are about: numbers and their rates.
pub(crate) trait Linear:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

impl Linear for f64 {}
impl<const N: usize> Linear for Rate<N> {}

/// Σ xᵢ yᵢ.
#[inline]
pub(crate) fn dot<T: Linear>(x: &[f64; 3], y: &[T; 3]) -> T {
    y[0] * x[0] + y[1] * x[1] + y[2] * x[2]
}

#[inline]
pub(crate) fn mean<T: Linear>(x: &[T; 3]) -> T {
    (x[0] + x[1] + x[2]) * (1.0 / 3.0)
}

/// x + y factor.
#[inline]
pub(crate) fn plus<T: Linear>(x: &[T; 3], factor: T, y: &[f64; 3]) -> [T; 3] {
    array::from_fn(|i| x[i] + factor * y[i])
}

/// Rows of a matrix times a vector.
#[inline]
pub(crate) fn times<T: Linear>(rows: &[[f64; 2]; 2], [x, y]: [T; 2]) -> [T; 2] {
    rows.map(|[a, b]| x * a + y * b)
}
