//! One point carried over its increment, whichever program gives it.

use abi::access::{INPUT_NOT_FINITE, assert_declared, defect};
use abi::export::{Continuum, Exported, Interface};
use abi::{
    ContinuumLaw, Failure, InterfaceLaw, InterfacePoint, InternalVariables, SolidPoint, Tangent,
};

/// One point as another program gives it.
#[derive(Clone, Copy, Debug)]
pub struct Point<const N: usize> {
    /// Gradient at the start.
    pub(crate) gradient: [f64; N],
    /// Its increment.
    pub(crate) increment: [f64; N],
    /// Flux at the start.
    pub(crate) flux: [f64; N],
    /// Internal variables at the start and at the end, which may be one place; valid for as many
    /// values as the law declares.
    pub(crate) state0: *const f64,
    pub(crate) state1: *mut f64,
    /// Time at the start.
    pub(crate) time: f64,
    /// Time increment.
    pub(crate) time_increment: f64,
    /// Time at the start, counted from the start of the step.
    pub(crate) step_time: f64,
}

/// The point at the end of the increment; the internal variables are written where it says.
#[derive(Debug)]
pub struct Answer<const N: usize> {
    pub(crate) flux: [f64; N],
    /// Nothing that means anything unless requested.
    pub(crate) operator: [[f64; N]; N],
    pub(crate) unreliable: Option<&'static str>,
}

/// Internal variables at the start. Other programs start them from zero, so where all of them are,
/// the point has not begun: they are then the law's own for the flux it carries.
#[inline]
fn start<const N: usize, S: InternalVariables>(
    point: &Point<N>,
    initial: impl FnOnce() -> Result<S, Failure>,
) -> Result<S, Failure> {
    let n = S::TABLE.len();
    // SAFETY: `Point::state0` holds as many values as the table.
    let value = |v: usize| unsafe { *point.state0.add(v) };
    let mut defects = 0.0;
    let mut begun = n == 0;
    for v in 0..n {
        defects += 0.0 * value(v);
        begun |= value(v) != 0.0;
    }
    if defect(&point.gradient) + defect(&point.increment) + defect(&point.flux) + defects != 0.0 {
        return Err(INPUT_NOT_FINITE);
    }
    if begun {
        let declared = |v: usize| {
            assert_declared::<S>(v);
            value(v)
        };
        Ok(S::read(declared))
    } else {
        initial()
    }
}

/// The results, all of them finite; the internal variables are written.
#[inline]
fn end<const N: usize, S: InternalVariables>(
    point: &Point<N>,
    state: &S,
    answer: Answer<N>,
    tangent: Tangent,
) -> Result<Answer<N>, Failure> {
    let mut defects = defect(&answer.flux);
    state.write(|_, value| defects += 0.0 * value);
    if tangent != Tangent::None {
        defects += defect(answer.operator.as_flattened());
    }
    if defects != 0.0 {
        return Err(Failure::Numeric("a result is not finite"));
    }
    state.write(|v, value| {
        assert_declared::<S>(v);
        // SAFETY: `Point::state1` holds as many values as the table.
        unsafe { *point.state1.add(v) = value };
    });
    Ok(answer)
}

/// A law that can carry the points of other programs, with `N` components.
pub trait Carried<const N: usize>: Exported {
    /// Carries a point over its increment.
    ///
    /// # Errors
    /// Why it cannot; nothing is written then.
    fn carry(&self, point: &Point<N>, tangent: Tangent) -> Result<Answer<N>, Failure>;
}

impl<L: ContinuumLaw, const N: usize> Carried<N> for Continuum<L> {
    #[expect(
        clippy::inline_always,
        reason = "a request that is a constant must reach the update"
    )]
    #[inline(always)]
    fn carry(&self, point: &Point<N>, tangent: Tangent) -> Result<Answer<N>, Failure> {
        let law = self.law();
        let solid = SolidPoint {
            strain: point.gradient,
            strain_increment: point.increment,
            stress: point.flux,
            state: start(point, || law.initial_state::<N>(&point.flux))?,
            time: point.time,
            time_increment: point.time_increment,
            step_time: point.step_time,
        };
        let response = law.update::<N>(&solid, tangent)?;
        let answer = Answer {
            flux: response.stress,
            operator: response.tangent,
            unreliable: response.unreliable,
        };
        end(point, &response.state, answer, tangent)
    }
}

impl<L: InterfaceLaw> Carried<2> for Interface<L> {
    #[expect(
        clippy::inline_always,
        reason = "a request that is a constant must reach the update"
    )]
    #[inline(always)]
    fn carry(&self, point: &Point<2>, tangent: Tangent) -> Result<Answer<2>, Failure> {
        let law = self.law();
        let interface = InterfacePoint {
            jump: point.gradient,
            jump_increment: point.increment,
            traction: point.flux,
            state: start(point, || law.initial_state(&point.flux))?,
            time: point.time,
            time_increment: point.time_increment,
            step_time: point.step_time,
        };
        let response = law.update(&interface, tangent)?;
        let answer = Answer {
            flux: response.traction,
            operator: response.tangent,
            unreliable: response.unreliable,
        };
        end(point, &response.state, answer, tangent)
    }
}
