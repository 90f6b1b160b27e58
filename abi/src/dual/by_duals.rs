//! A law that is written for any number, as a law with consistent tangent and rates.

use super::{Dual, Number};
use crate::descriptor::{Description, InternalVariables, Parameters};
use crate::law::{
    Failure, InterfaceLaw, InterfacePoint, InterfaceRates, InterfaceResponse, Refusal, Tangent,
};
use std::fmt::Debug;

/// A struct of numbers of one kind, made by [`parameters!`](crate::parameters) or
/// [`internal_variables!`](crate::internal_variables) with `struct Name<T>`.
pub trait Values<T>: Copy + Send + Sync {
    /// Collects the values, number by number.
    fn collect(value: impl Fn(usize) -> T) -> Self;
    /// Hands out the values, number by number.
    fn hand_out(&self, put: impl FnMut(usize, T));
}

impl<T> Values<T> for () {
    fn collect(_: impl Fn(usize) -> T) -> Self {}
    fn hand_out(&self, _: impl FnMut(usize, T)) {}
}

/// The end of an increment, for any number.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceEnd<S, T> {
    /// Traction, kPa.
    pub traction: [T; 2],
    /// Internal variables.
    pub state: S,
}

/// A law for interfaces in two dimensions that is written for any number. [`ByDuals`] makes an
/// [`InterfaceLaw`] of it.
pub trait DualInterfaceLaw: Sized + Send + Sync + 'static {
    /// Name of the law.
    const DESCRIPTION: Description;
    /// The tangent is symmetric in every state.
    const SYMMETRIC: bool = false;
    /// Declared with [`parameters!`](crate::parameters) as `struct Name<T>`.
    type Parameters<T: Number>: Values<T>;
    /// Declared with [`internal_variables!`](crate::internal_variables) as `struct Name<T>`, or `()`.
    type State<T: Number>: Values<T>;
    /// What updates need of the parameters.
    type Fixed<T: Number>: Send + Sync + 'static;

    /// Fixes the parameters, each within its bounds.
    ///
    /// # Errors
    /// Names the parameter to change.
    fn new<T: Number>(parameters: Self::Parameters<T>) -> Result<Self::Fixed<T>, Refusal>;

    /// Internal variables of a point that carries this traction before anything has happened;
    /// `declared` are the declared initial values.
    ///
    /// # Errors
    /// [`Failure::Domain`] if the law cannot start from this traction.
    fn initial_state<T: Number>(
        fixed: &Self::Fixed<T>,
        traction: &[T; 2],
        declared: Self::State<T>,
    ) -> Result<Self::State<T>, Failure> {
        let _ = (fixed, traction);
        Ok(declared)
    }

    /// Carries one point over an increment.
    ///
    /// # Errors
    /// Why it cannot.
    fn update<T: Number>(
        fixed: &Self::Fixed<T>,
        point: &InterfacePoint<Self::State<T>, T>,
    ) -> Result<InterfaceEnd<Self::State<T>, T>, Failure>;

    /// The elastic operator of a point that carries this traction in this state, row by row, kPa/m.
    fn elastic(
        fixed: &Self::Fixed<f64>,
        traction: &[f64; 2],
        state: &Self::State<f64>,
    ) -> [[f64; 2]; 2];
}

/// A [`DualInterfaceLaw`] as a law: its consistent tangent by duals with two derivatives, its rates
/// by duals with one.
pub struct ByDuals<L: DualInterfaceLaw> {
    parameters: L::Parameters<f64>,
    fixed: L::Fixed<f64>,
    fixed_2: L::Fixed<Dual<2>>,
}

impl<L: DualInterfaceLaw> Debug for ByDuals<L> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("ByDuals").field(&L::DESCRIPTION.id).finish()
    }
}

/// The values of a struct as duals, the `k`-th with the rates that `rates` gives.
fn lifted<const N: usize, V: Values<f64>, D: Values<Dual<N>>>(
    values: &V,
    rates: impl Fn(usize) -> [f64; N],
) -> D {
    D::collect(|k| {
        let mut value = f64::NAN;
        values.hand_out(|i, x| {
            if i == k {
                value = x;
            }
        });
        Dual {
            value,
            rates: rates(k),
        }
    })
}

/// The values of duals.
fn dropped<const N: usize, D: Values<Dual<N>>, V: Values<f64>>(duals: &D) -> V {
    of_one(duals, |dual| dual.value)
}

/// One number of each dual.
fn of_one<const N: usize, D: Values<Dual<N>>, V: Values<f64>>(
    duals: &D,
    number: impl Fn(Dual<N>) -> f64,
) -> V {
    V::collect(|k| {
        let mut found = f64::NAN;
        duals.hand_out(|i, dual| {
            if i == k {
                found = number(dual);
            }
        });
        found
    })
}

/// The point of an interface as duals with one derivative.
fn with_rates<L: DualInterfaceLaw>(
    point: &InterfacePoint<L::State<f64>>,
    rates: &InterfaceRates<'_, L::State<f64>>,
) -> InterfacePoint<L::State<Dual<1>>, Dual<1>> {
    let both = |values: &[f64; 2], rates: &[f64; 2]| {
        std::array::from_fn(|k| Dual {
            value: values[k],
            rates: [rates[k]],
        })
    };
    InterfacePoint {
        jump: both(&point.jump, &rates.jump),
        jump_increment: both(&point.jump_increment, &rates.jump_increment),
        traction: both(&point.traction, &rates.traction),
        state: lifted(&point.state, |k| [value_of(&rates.state, k)]),
        time: point.time,
        time_increment: point.time_increment,
        step_time: point.step_time,
    }
}

/// One value of a struct.
fn value_of<V: Values<f64>>(values: &V, number: usize) -> f64 {
    let mut found = 0.0;
    values.hand_out(|i, x| {
        if i == number {
            found = x;
        }
    });
    found
}

impl<L: DualInterfaceLaw> ByDuals<L> {
    /// The law with parameters that have these rates.
    fn with_parameter_rates(&self, rates: Option<&[f64]>) -> Result<L::Fixed<Dual<1>>, Failure> {
        let rate = |k: usize| [rates.and_then(|all| all.get(k)).copied().unwrap_or(0.0)];
        L::new(lifted(&self.parameters, rate))
            .map_err(|_| Failure::Numeric("the parameters are refused with their rates"))
    }
}

impl<L> InterfaceLaw for ByDuals<L>
where
    L: DualInterfaceLaw,
    L::Parameters<f64>: Parameters,
    L::State<f64>: InternalVariables,
{
    const DESCRIPTION: Description = L::DESCRIPTION;
    const SYMMETRIC: bool = L::SYMMETRIC;
    const RATES: bool = true;
    type Parameters = L::Parameters<f64>;
    type State = L::State<f64>;

    fn new(parameters: Self::Parameters) -> Result<Self, Refusal> {
        Ok(Self {
            parameters,
            fixed: L::new(parameters)?,
            fixed_2: L::new(lifted(&parameters, |_| [0.0; 2]))?,
        })
    }

    fn initial_state(&self, traction: &[f64; 2]) -> Result<Self::State, Failure> {
        L::initial_state(&self.fixed, traction, Self::State::initial())
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<Self::State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<Self::State>, Failure> {
        let without = |end: InterfaceEnd<Self::State, f64>, tangent| InterfaceResponse {
            traction: end.traction,
            state: end.state,
            tangent,
            unreliable: None,
        };
        match tangent {
            Tangent::None => Ok(without(L::update(&self.fixed, point)?, [[0.0; 2]; 2])),
            Tangent::Elastic => {
                let end = L::update(&self.fixed, point)?;
                let operator = L::elastic(&self.fixed, &end.traction, &end.state);
                Ok(without(end, operator))
            }
            Tangent::Consistent => {
                let lift = |values: &[f64; 2]| values.map(Dual::constant);
                let start = InterfacePoint {
                    jump: lift(&point.jump),
                    jump_increment: std::array::from_fn(|k| {
                        Dual::variable(point.jump_increment[k], k)
                    }),
                    traction: lift(&point.traction),
                    state: lifted(&point.state, |_| [0.0; 2]),
                    time: point.time,
                    time_increment: point.time_increment,
                    step_time: point.step_time,
                };
                let end = L::update(&self.fixed_2, &start)?;
                Ok(InterfaceResponse {
                    traction: end.traction.map(|row| row.value),
                    state: dropped(&end.state),
                    tangent: end.traction.map(|row| row.rates),
                    unreliable: None,
                })
            }
        }
    }

    fn rates(
        &self,
        point: &InterfacePoint<Self::State>,
        rates: &InterfaceRates<'_, Self::State>,
    ) -> Result<([f64; 2], Self::State), Failure> {
        let fixed = self.with_parameter_rates(rates.parameter)?;
        let end = L::update(&fixed, &with_rates::<L>(point, rates))?;
        let rate = |dual: Dual<1>| dual.rates[0];
        Ok((end.traction.map(rate), of_one(&end.state, rate)))
    }

    fn initial_rates(
        &self,
        traction: &[f64; 2],
        rates: &InterfaceRates<'_, Self::State>,
    ) -> Result<Self::State, Failure> {
        let fixed = self.with_parameter_rates(rates.parameter)?;
        let traction = std::array::from_fn(|k| Dual {
            value: traction[k],
            rates: [rates.traction[k]],
        });
        let declared = lifted(&Self::State::initial(), |_| [0.0; 1]);
        let state = L::initial_state(&fixed, &traction, declared)?;
        Ok(of_one(&state, |dual| dual.rates[0]))
    }
}
