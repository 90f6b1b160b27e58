//! One point carried over its increment, whichever program gives it.

use abi::access::{INPUT_NOT_FINITE, assert_declared, defect};
use abi::export::{Continuum, Exported, Interface};
use abi::{
    ContinuumLaw, Failure, InterfaceLaw, InterfacePoint, InternalVariables, SolidPoint,
    SolidResponse, Tangent,
};

/// One point as another program gives it.
#[derive(Debug)]
pub struct Point {
    /// Number of components of gradient and flux.
    pub(crate) n_components: usize,
    /// Gradient at the start.
    pub(crate) gradient: [f64; 6],
    /// Its increment.
    pub(crate) increment: [f64; 6],
    /// Flux at the start.
    pub(crate) flux: [f64; 6],
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
pub struct Answer {
    pub(crate) flux: [f64; 6],
    /// Row by row, n × n values; zero unless requested.
    pub(crate) operator: [f64; 36],
    pub(crate) unreliable: Option<&'static str>,
}

fn first<const N: usize>(values: &[f64; 6]) -> [f64; N] {
    std::array::from_fn(|i| values[i])
}

/// Internal variables at the start. Other programs start them from zero, so where all of them are,
/// the point has not begun: they are then the law's own for the flux it carries.
fn start<S: InternalVariables>(
    point: &Point,
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
    let whole = |values: &[f64; 6]| defect(&values[..point.n_components]);
    if whole(&point.gradient) + whole(&point.increment) + whole(&point.flux) + defects != 0.0 {
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

fn end<const N: usize, S: InternalVariables>(
    point: &Point,
    flux: &[f64; N],
    state: &S,
    tangent: Option<&[[f64; N]; N]>,
    unreliable: Option<&'static str>,
) -> Result<Answer, Failure> {
    let mut defects = defect(flux);
    state.write(|_, value| defects += 0.0 * value);
    let mut answer = Answer {
        flux: [0.0; 6],
        operator: [0.0; 36],
        unreliable,
    };
    answer.flux[..N].copy_from_slice(flux);
    if let Some(tangent) = tangent {
        defects += defect(tangent.as_flattened());
        answer.operator[..N * N].copy_from_slice(tangent.as_flattened());
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

/// A law that can carry the points of other programs.
pub trait Carried: Exported {
    /// Carries a point over its increment.
    ///
    /// # Errors
    /// Why it cannot; nothing is written then.
    fn carry(&self, point: &Point, tangent: Tangent) -> Result<Answer, Failure>;
}

impl<L: ContinuumLaw> Carried for Continuum<L> {
    fn carry(&self, point: &Point, tangent: Tangent) -> Result<Answer, Failure> {
        if point.n_components == 6 {
            carry_solid::<L, 6>(self.law(), point, tangent)
        } else {
            carry_solid::<L, 4>(self.law(), point, tangent)
        }
    }
}

fn carry_solid<L: ContinuumLaw, const N: usize>(
    law: &L,
    point: &Point,
    tangent: Tangent,
) -> Result<Answer, Failure> {
    let stress = first::<N>(&point.flux);
    let solid = SolidPoint {
        strain: first(&point.gradient),
        strain_increment: first(&point.increment),
        stress,
        state: start(point, || law.initial_state::<N>(&stress))?,
        time: point.time,
        time_increment: point.time_increment,
        step_time: point.step_time,
    };
    let SolidResponse {
        stress,
        state,
        tangent: operator,
        unreliable,
    } = law.update::<N>(&solid, tangent)?;
    let operator = (tangent != Tangent::None).then_some(&operator);
    end(point, &stress, &state, operator, unreliable)
}

impl<L: InterfaceLaw> Carried for Interface<L> {
    fn carry(&self, point: &Point, tangent: Tangent) -> Result<Answer, Failure> {
        let law = self.law();
        let traction = first::<2>(&point.flux);
        let interface = InterfacePoint {
            jump: first(&point.gradient),
            jump_increment: first(&point.increment),
            traction,
            state: start(point, || law.initial_state(&traction))?,
            time: point.time,
            time_increment: point.time_increment,
            step_time: point.step_time,
        };
        let response = law.update(&interface, tangent)?;
        let operator = (tangent != Tangent::None).then_some(&response.tangent);
        end(
            point,
            &response.traction,
            &response.state,
            operator,
            response.unreliable,
        )
    }
}
