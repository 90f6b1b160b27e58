//! Derivatives without algebra, exact to round-off: a law written once for any [`Number`] gets its
//! consistent tangent and its rates from dual numbers, which carry derivatives along with values.
//!
//! [`tangent`] serves a law that keeps its form; a [`DualInterfaceLaw`] is exported as
//! [`ByDuals`] and offers `PILUM_REQ_RATES` too:
//!
//! ```
//! use abi::dual::{ByDuals, DualInterfaceLaw, InterfaceEnd, Number};
//! use abi::{Description, Failure, InterfaceLaw, InterfacePoint, Parameter, Refusal, Tangent, Variable};
//!
//! abi::parameters! {
//!     /// Parameters of the law.
//!     pub struct Parameters<T> {
//!         /// Stiffness at the start.
//!         stiffness: Parameter::new(c"k", c"kPa/m").above(0.0),
//!         /// Strength, which is approached.
//!         strength: Parameter::new(c"c", c"kPa").above(0.0),
//!     }
//! }
//! abi::internal_variables! {
//!     /// Internal variables of the law.
//!     pub struct State<T> {
//!         /// Sum of all slip.
//!         slip: Variable::scalar(c"s", c"m"),
//!     }
//! }
//!
//! struct Joint;
//!
//! impl DualInterfaceLaw for Joint {
//!     const DESCRIPTION: Description =
//!         abi::describe! { id: "joint", name: "", doc: "", references: "" };
//!     type Parameters<T: Number> = Parameters<T>;
//!     type State<T: Number> = State<T>;
//!     type Fixed<T: Number> = Parameters<T>;
//!
//!     fn new<T: Number>(p: Parameters<T>) -> Result<Parameters<T>, Refusal> {
//!         Ok(p)
//!     }
//!
//!     fn update<T: Number>(
//!         p: &Parameters<T>,
//!         point: &InterfacePoint<State<T>, T>,
//!     ) -> Result<InterfaceEnd<State<T>, T>, Failure> {
//!         let slip = point.state.slip + point.jump_increment[1].abs();
//!         let jump = point.jump[1] + point.jump_increment[1];
//!         Ok(InterfaceEnd {
//!             traction: [
//!                 point.traction[0] + p.stiffness * point.jump_increment[0],
//!                 p.strength * (p.stiffness * jump / p.strength).tanh(),
//!             ],
//!             state: State { slip },
//!         })
//!     }
//!
//!     // The softer the more of the strength is carried.
//!     fn elastic(p: &Parameters<f64>, traction: &[f64; 2], _: &State<f64>) -> [[f64; 2]; 2] {
//!         let part = traction[1] / p.strength;
//!         [[p.stiffness, 0.0], [0.0, p.stiffness * (1.0 - part * part)]]
//!     }
//! }
//! const _: abi::raw::Law = abi::export::law::<abi::export::Interface<ByDuals<Joint>>>();
//!
//! let joint = ByDuals::<Joint>::new(Parameters { stiffness: 1e4, strength: 50.0 }).unwrap();
//! let point = InterfacePoint {
//!     jump: [0.0; 2],
//!     jump_increment: [0.0, 5e-3],
//!     traction: [-100.0, 0.0],
//!     state: State { slip: 0.0 },
//!     time: 0.0,
//!     time_increment: 1.0,
//!     step_time: 0.0,
//! };
//! let [elastic, consistent] =
//!     [Tangent::Elastic, Tangent::Consistent].map(|of| joint.update(&point, of).unwrap().tangent);
//! // d tanh(x) = 1 − tanh²(x).
//! assert!((elastic[1][1] - consistent[1][1]).abs() < 1e-9 * consistent[1][1]);
//! ```

mod by_duals;

pub use by_duals::{ByDuals, DualInterfaceLaw, InterfaceEnd, Values};

use crate::law::Failure;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What a law computes with: a real number, or a [`Dual`]. Comparisons look at values only, so that
/// branches are those of the real numbers.
pub trait Number:
    Copy
    + Debug
    + PartialOrd
    + PartialOrd<f64>
    + Send
    + Sync
    + 'static
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// The value without derivatives.
    fn value(self) -> f64;
    /// A function of this number with this value and this derivative.
    #[must_use]
    fn chained(self, value: f64, derivative: f64) -> Self;
    /// |x|; at 0 the derivative is that of x.
    #[must_use]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The larger one; `self` if they are equal.
    #[must_use]
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() {
            other
        } else {
            self
        }
    }
    /// The smaller one; `self` if they are equal.
    #[must_use]
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() {
            other
        } else {
            self
        }
    }
    /// √x.
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chained(root, 0.5 / root)
    }
    /// eˣ.
    #[must_use]
    fn exp(self) -> Self {
        let power = self.value().exp();
        self.chained(power, power)
    }
    /// ln x.
    #[must_use]
    fn ln(self) -> Self {
        self.chained(self.value().ln(), 1.0 / self.value())
    }
    /// sin x, in radians.
    #[must_use]
    fn sin(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chained(sin, cos)
    }
    /// cos x, in radians.
    #[must_use]
    fn cos(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chained(cos, -sin)
    }
    /// tan x, in radians.
    #[must_use]
    fn tan(self) -> Self {
        let tan = self.value().tan();
        self.chained(tan, 1.0 + tan * tan)
    }
    /// tanh x.
    #[must_use]
    fn tanh(self) -> Self {
        let tanh = self.value().tanh();
        self.chained(tanh, 1.0 - tanh * tanh)
    }
    /// xⁿ for a constant n.
    #[must_use]
    fn powf(self, n: f64) -> Self {
        let x = self.value();
        let derivative = if n == 0.0 { 0.0 } else { n * x.powf(n - 1.0) };
        self.chained(x.powf(n), derivative)
    }
    /// From degrees to radians.
    #[must_use]
    fn to_radians(self) -> Self {
        self * (std::f64::consts::PI / 180.0)
    }
}

impl Number for f64 {
    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn chained(self, value: f64, _: f64) -> f64 {
        value
    }
}

/// A value with its derivatives in `N` directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// Value.
    pub value: f64,
    /// Derivatives.
    pub rates: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A value that depends on nothing.
    pub const fn constant(value: f64) -> Self {
        Self {
            value,
            rates: [0.0; N],
        }
    }

    /// The variable of one direction: its own derivative is 1.
    pub const fn variable(value: f64, direction: usize) -> Self {
        let mut rates = [0.0; N];
        rates[direction] = 1.0;
        Self { value, rates }
    }

    /// A value, and rates a·a′ + b·b′ of a function of two numbers.
    #[inline]
    fn of_two(value: f64, by_a: f64, a: &Self, by_b: f64, b: &Self) -> Self {
        Self {
            value,
            rates: std::array::from_fn(|k| times(by_a, a.rates[k]) + times(by_b, b.rates[k])),
        }
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline]
    fn value(self) -> f64 {
        self.value
    }
    #[inline]
    fn chained(self, value: f64, derivative: f64) -> Self {
        Self {
            value,
            rates: self.rates.map(|rate| times(derivative, rate)),
        }
    }
}

/// A derivative times a rate: what does not change adds nothing, though the derivative be infinite.
#[inline]
fn times(derivative: f64, rate: f64) -> f64 {
    if rate == 0.0 { 0.0 } else { derivative * rate }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> PartialEq<f64> for Dual<N> {
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl<const N: usize> PartialOrd<f64> for Dual<N> {
    fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(other)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.chained(-self.value, -1.0)
    }
}

/// An operation of two duals, and of a dual and a real number, from the value and the derivatives by
/// both.
macro_rules! operation {
    ($trait:ident $function:ident: |$a:ident, $b:ident| $value:expr, $by_a:expr, $by_b:expr) => {
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            #[inline]
            fn $function(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                Self::of_two($value, $by_a, &self, $by_b, &other)
            }
        }
        impl<const N: usize> $trait<f64> for Dual<N> {
            type Output = Self;
            #[inline]
            fn $function(self, $b: f64) -> Self {
                let $a = self.value;
                let _ = $a;
                self.chained($value, $by_a)
            }
        }
    };
}
operation!(Add add: |a, b| a + b, 1.0, 1.0);
operation!(Sub sub: |a, b| a - b, 1.0, -1.0);
operation!(Mul mul: |a, b| a * b, b, a);
operation!(Div div: |a, b| a / b, 1.0 / b, -(a / b) / b);

impl<const N: usize> AddAssign for Dual<N> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// The derivative of an update by its increment, row by row, and the flux: one evaluation with
/// numbers that carry `N` derivatives. The update is written once, for any [`Number`]; whatever it
/// branches on, the derivative is that of the branch it took:
///
/// ```
/// use abi::Failure;
/// use abi::dual::{Number, tangent};
///
/// /// Traction of a joint whose friction rises to `mu` (1 − exp(−slip/scale)), per kPa.
/// fn traction<T: Number>([closing, slip]: [T; 2]) -> Result<[T; 2], Failure> {
///     let (stiffness, mu, scale) = (1e5, 0.6, 1e-3);
///     let normal = closing * stiffness;
///     let mobilised = -(-slip.abs() / scale).exp() + 1.0;
///     let friction = -normal * mobilised * mu;
///     Ok([normal, if slip.value() < 0.0 { -friction } else { friction }])
/// }
///
/// let jump = [-1e-3, 2e-3];
/// let (end, rows) = tangent(&jump, traction)?;
/// // The update is that of plain numbers, to the last bit.
/// assert_eq!(end, traction(jump)?);
/// // ∂t/∂slip = 100 kPa · mu exp(−slip/scale)/scale, by hand.
/// assert!((rows[1][1] / (100.0 * 0.6 * f64::exp(-2.0) / 1e-3) - 1.0).abs() < 1e-14);
/// assert_eq!(rows[0], [1e5, 0.0]);
/// # Ok::<(), Failure>(())
/// ```
///
/// # Errors
/// What `update` fails with.
#[inline]
pub fn tangent<const N: usize>(
    increment: &[f64; N],
    update: impl FnOnce([Dual<N>; N]) -> Result<[Dual<N>; N], Failure>,
) -> Result<([f64; N], [[f64; N]; N]), Failure> {
    let moved = std::array::from_fn(|k| Dual::variable(increment[k], k));
    let flux = update(moved)?;
    Ok((flux.map(|row| row.value), flux.map(|row| row.rates)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every function against central differences; the bound is what those can tell.
    #[test]
    fn derivatives_are_those_of_the_functions() {
        fn all<T: Number>(x: T) -> [T; 12] {
            [
                x.sqrt(),
                x.exp(),
                x.ln(),
                x.sin(),
                x.cos(),
                x.tan(),
                x.tanh(),
                x.powf(2.5),
                x.to_radians(),
                -x.abs() * 3.0 + x.max(T::from(2.0)),
                (x * x + 1.0) / (x - 5.0),
                (x / 2.0 - x) * x.min(T::from(0.5)),
            ]
        }
        for x in [0.3, 0.9, 1.4] {
            let exact = all(Dual::<1>::variable(x, 0));
            let h = 6e-6;
            let (above, below) = (all(x + h), all(x - h));
            for (k, dual) in exact.iter().enumerate() {
                assert_eq!(dual.value.to_bits(), all(x)[k].to_bits(), "function {k}");
                let difference = (above[k] - below[k]) / (2.0 * h);
                let error = (dual.rates[0] - difference).abs();
                assert!(
                    error < 1e-8 * difference.abs().max(1.0),
                    "function {k}: {error:e}"
                );
            }
        }
    }

    /// At 0 a root has no derivative, but a constant does not need one.
    #[test]
    #[expect(clippy::float_cmp, reason = "zeros are exact")]
    fn constants_stay_constant_where_a_derivative_is_infinite() {
        let zero = Dual::<1>::constant(0.0);
        for (value, result) in [
            (0.0, zero.sqrt()),
            (0.0, zero.powf(0.5)),
            (f64::NEG_INFINITY, zero.ln()),
            (1.0, zero.powf(0.0)),
            (0.0, zero * Dual::constant(f64::INFINITY).powf(-1.0)),
        ] {
            assert_eq!((result.value, result.rates), (value, [0.0]));
        }
        let x = Dual::<1>::variable(0.0, 0);
        assert_eq!(x.powf(0.0).rates, [0.0]);
        assert_eq!(x.sqrt().rates, [f64::INFINITY]);
        // 1e-200 over 1e-200: the square of the divisor is no number any more.
        let tiny = Dual::<1>::variable(1e-200, 0);
        let ratio = Dual::constant(2e-200) / tiny;
        assert_eq!((ratio.value, ratio.rates[0]), (2.0, -2e200));
        assert_eq!((tiny / tiny).rates, [0.0]);
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "small whole numbers are exact")]
    fn a_tangent_is_exact() {
        let (flux, operator) = tangent(&[2.0, 3.0], |[x, y]| {
            let mut sum = x * y;
            sum += x;
            sum -= y * y;
            Ok([sum, x / y])
        })
        .unwrap();
        assert_eq!(flux, [-1.0, 2.0 / 3.0]);
        assert_eq!(operator, [[4.0, -4.0], [1.0 / 3.0, -2.0 / 9.0]]);
    }
}
