//! The two traits of [`law`](crate::law) as one, which is what the boundary calls.

use crate::access::{Access, Directions};
use crate::descriptor::{Description, Hypothesis, InternalVariables, Parameters, Variable};
use crate::law::{
    ContinuumLaw, Failure, HasTangent, InterfaceLaw, InterfacePoint, InterfaceRates,
    InterfaceResponse, SolidPoint, SolidResponse, Tangent,
};
use crate::raw::{self, Formulation};
use std::marker::PhantomData;

mod sealed {
    /// Keeps [`Exported`](super::Exported) to this file: its formulations are pointers.
    pub trait Sealed {}
    impl<L> Sealed for super::Continuum<L> {}
    impl<L> Sealed for super::Interface<L> {}
}

/// What the boundary needs of a law, whichever trait its author chose.
pub trait Exported: sealed::Sealed + Sized + Send + Sync + 'static {
    /// Name of the law.
    const DESCRIPTION: Description;
    /// Parameters.
    type Parameters: Parameters;
    /// Formulations.
    const FORMULATIONS: &'static [Formulation];
    /// Internal variables, the same in all formulations.
    const STATE: &'static [Variable];
    /// Fixes the parameters.
    ///
    /// # Errors
    /// The message, starting with the parameter's id and a colon.
    fn new(parameters: Self::Parameters) -> Result<Self, String>;
    /// Initial internal variables of point `i`.
    ///
    /// # Errors
    /// Why the law cannot start there.
    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure>;
    /// Carries point `i` over the increment.
    ///
    /// # Errors
    /// Why it cannot.
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure>;
    /// Rates of point `i` at the end of the increment.
    ///
    /// # Errors
    /// Why none exist.
    fn rates<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        rates: &Directions<'_>,
        i: usize,
    ) -> Result<(), Failure> {
        let _ = (access, rates, i);
        Err(NO_RATES)
    }
    /// Rates of the initial internal variables of point `i`.
    ///
    /// # Errors
    /// Why none exist.
    fn initial_rates<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        rates: &Directions<'_>,
        i: usize,
    ) -> Result<(), Failure> {
        let _ = (access, rates, i);
        Err(NO_RATES)
    }
}

/// The boundary asks only laws that declare rates.
const NO_RATES: Failure = Failure::Numeric("the law offers no rates");

/// Flags of what a law has for a consistent tangent.
///
/// # Panics
/// If a law with `LINEAR` has another tangent than the consistent one; at compile time, where it is
/// exported.
const fn flags_of_tangent(tangent: HasTangent, is_linear: bool) -> u32 {
    assert!(
        !is_linear || matches!(tangent, HasTangent::Consistent),
        "a law with `LINEAR` has its consistent tangent"
    );
    match tangent {
        HasTangent::Consistent => 0,
        HasTangent::Approximate => raw::PILUM_T_TANGENT_APPROXIMATE,
        HasTangent::No => raw::PILUM_T_NO_TANGENT,
    }
}

/// Adapter for laws of solids.
#[derive(Debug)]
pub struct Continuum<L>(L);

/// Adapter for laws of interfaces.
#[derive(Debug)]
pub struct Interface<L>(L);

struct ContinuumFormulations<L>(PhantomData<L>);

impl<L: ContinuumLaw> ContinuumFormulations<L> {
    const FLAGS: u32 = flag(L::SYMMETRIC, raw::PILUM_T_SYMMETRIC)
        | flag(L::LINEAR, raw::PILUM_T_LINEAR)
        | flag(L::LOCAL_AXES, raw::PILUM_T_LOCAL_AXES)
        | flags_of_tangent(L::TANGENT, L::LINEAR);
    const TABLE: [Formulation; 3] = {
        assert_solid(L::HYPOTHESES);
        let state = <L::State as InternalVariables>::TABLE;
        let mut table = [Formulation::new(L::HYPOTHESES[0], Self::FLAGS, state); 3];
        let mut i = 1;
        while i < L::HYPOTHESES.len() {
            table[i] = Formulation::new(L::HYPOTHESES[i], Self::FLAGS, state);
            i += 1;
        }
        table
    };
}

/// Refuses hypotheses whose points a law for solids cannot read: what it is called with has four
/// or six components.
///
/// # Panics
/// At compile time, where a law is exported.
pub(super) const fn assert_solid(hypotheses: &[Hypothesis]) {
    assert!(!hypotheses.is_empty(), "`HYPOTHESES` is empty");
    assert!(
        hypotheses.len() <= 3,
        "`HYPOTHESES` has more than three entries"
    );
    let mut i = 0;
    while i < hypotheses.len() {
        assert!(
            !hypotheses[i].is_interface(),
            "`HYPOTHESES` of a `ContinuumLaw` holds an interface: implement `InterfaceLaw`"
        );
        i += 1;
    }
}

const fn flag(set: bool, bit: u32) -> u32 {
    if set { bit } else { 0 }
}

impl<L: ContinuumLaw> Exported for Continuum<L> {
    const DESCRIPTION: Description = L::DESCRIPTION;
    type Parameters = L::Parameters;
    const FORMULATIONS: &'static [Formulation] = ContinuumFormulations::<L>::TABLE
        .split_at(L::HYPOTHESES.len())
        .0;
    const STATE: &'static [Variable] = <L::State as InternalVariables>::TABLE;

    fn new(parameters: L::Parameters) -> Result<Self, String> {
        L::new(parameters)
            .map(Self)
            .map_err(|refusal| refusal.to_string())
    }

    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure> {
        let state = if access.n_components == 6 {
            self.0.initial_state::<6>(&access.flux0(i)?)?
        } else {
            self.0.initial_state::<4>(&access.flux0(i)?)?
        };
        access.put_state(i, &state);
        Ok(())
    }

    #[inline]
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure> {
        if access.n_components == 6 {
            update_solid::<L, 6, PACKED>(&self.0, access, i, tangent)
        } else {
            update_solid::<L, 4, PACKED>(&self.0, access, i, tangent)
        }
    }
}

#[inline]
fn update_solid<L: ContinuumLaw, const N: usize, const PACKED: bool>(
    law: &L,
    access: &Access<'_, PACKED>,
    i: usize,
    tangent: Tangent,
) -> Result<Option<&'static str>, Failure> {
    let start = access.start::<N, L::State>(i)?;
    let point = SolidPoint {
        strain: start.gradient,
        strain_increment: start.gradient_increment,
        stress: start.flux,
        state: start.state,
        time: access.batch.time,
        time_increment: access.batch.time_increment,
        step_time: access.batch.step_time,
    };
    let SolidResponse {
        stress,
        state,
        tangent: operator,
        unreliable,
    } = law.update::<N>(&point, tangent)?;
    access.put(
        i,
        &stress,
        &state,
        (tangent != Tangent::None).then_some(&operator),
    )?;
    Ok(unreliable)
}

impl<L> Continuum<L> {
    /// The law itself.
    pub const fn law(&self) -> &L {
        &self.0
    }
}

impl<L> Interface<L> {
    /// The law itself.
    pub const fn law(&self) -> &L {
        &self.0
    }
}

impl<L: InterfaceLaw> Interface<L> {
    const FLAGS: u32 = flag(L::SYMMETRIC, raw::PILUM_T_SYMMETRIC)
        | flag(L::LINEAR, raw::PILUM_T_LINEAR)
        | flags_of_tangent(L::TANGENT, L::LINEAR);
    const TABLE: [Formulation; 2] = {
        let state = <L::State as InternalVariables>::TABLE;
        let rates = flag(L::RATES, raw::PILUM_T_RATES);
        [
            Formulation::new(Hypothesis::Interface2d, Self::FLAGS | rates, state),
            Formulation::new(Hypothesis::Interface3d, Self::FLAGS, state),
        ]
    };
}

impl<L: InterfaceLaw> Exported for Interface<L> {
    const DESCRIPTION: Description = L::DESCRIPTION;
    type Parameters = L::Parameters;
    const FORMULATIONS: &'static [Formulation] = Self::TABLE.split_at(1 + L::IN_SPACE as usize).0;
    const STATE: &'static [Variable] = <L::State as InternalVariables>::TABLE;

    fn new(parameters: L::Parameters) -> Result<Self, String> {
        L::new(parameters)
            .map(Self)
            .map_err(|refusal| refusal.to_string())
    }

    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure> {
        let state = if L::IN_SPACE && access.n_components == 3 {
            self.0.initial_state_in_space(&access.flux0(i)?)?
        } else {
            self.0.initial_state(&access.flux0(i)?)?
        };
        access.put_state(i, &state);
        Ok(())
    }

    #[inline]
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure> {
        if L::IN_SPACE && access.n_components == 3 {
            let point = interface_point::<L::State, 3, PACKED>(access, i)?;
            let end = self.0.update_in_space(&point, tangent)?;
            return put_interface(access, i, &end, tangent);
        }
        let point = interface_point::<L::State, 2, PACKED>(access, i)?;
        let end = self.0.update(&point, tangent)?;
        put_interface(access, i, &end, tangent)
    }

    fn rates<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        rates: &Directions<'_>,
        i: usize,
    ) -> Result<(), Failure> {
        let point = interface_point::<L::State, 2, PACKED>(access, i)?;
        let [jump, end]: [[f64; 2]; 2] = [rates.gradient0(i)?, rates.gradient1(i)?];
        let given = InterfaceRates {
            parameter: rates.parameter(),
            jump,
            jump_increment: [end[0] - jump[0], end[1] - jump[1]],
            traction: rates.flux0(i)?,
            state: rates.state0(i)?,
        };
        let (traction, state) = self.0.rates(&point, &given)?;
        rates.put(i, Some(&traction), &state)
    }

    fn initial_rates<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        rates: &Directions<'_>,
        i: usize,
    ) -> Result<(), Failure> {
        let given = InterfaceRates {
            parameter: rates.parameter(),
            jump: [0.0; 2],
            jump_increment: [0.0; 2],
            traction: rates.flux0(i)?,
            state: L::State::read(|_| 0.0),
        };
        let state = self.0.initial_rates(&access.flux0(i)?, &given)?;
        rates.put::<2, _>(i, None, &state)
    }
}

/// Point `i` as a law for interfaces receives it.
#[inline]
fn interface_point<S: InternalVariables, const N: usize, const PACKED: bool>(
    access: &Access<'_, PACKED>,
    i: usize,
) -> Result<InterfacePoint<S, f64, N>, Failure> {
    let start = access.start(i)?;
    Ok(InterfacePoint {
        jump: start.gradient,
        jump_increment: start.gradient_increment,
        traction: start.flux,
        state: start.state,
        time: access.batch.time,
        time_increment: access.batch.time_increment,
        step_time: access.batch.step_time,
    })
}

/// Writes what a law for interfaces makes of point `i`.
#[inline]
fn put_interface<S: InternalVariables, const N: usize, const PACKED: bool>(
    access: &Access<'_, PACKED>,
    i: usize,
    end: &InterfaceResponse<S, N>,
    tangent: Tangent,
) -> Result<Option<&'static str>, Failure> {
    access.put(
        i,
        &end.traction,
        &end.state,
        (tangent != Tangent::None).then_some(&end.tangent),
    )?;
    Ok(end.unreliable)
}

/// What a law for solids may not declare stops the compiler; the same law with a solid's
/// hypothesis compiles.
///
/// ```compile_fail
/// use abi::{ContinuumLaw, Description, Failure, Hypothesis, Refusal};
/// use abi::{SolidPoint, SolidResponse, Tangent};
/// abi::parameters! { pub struct Nothing {} }
/// struct Astray;
/// impl ContinuumLaw for Astray {
///     const DESCRIPTION: Description =
///         abi::describe! { id: "astray", name: "", doc: "", references: "" };
///     const HYPOTHESES: &'static [Hypothesis] = &[Hypothesis::Interface2d];
///     type Parameters = Nothing;
///     type State = ();
///     fn new(_: Nothing) -> Result<Self, Refusal> { Ok(Self) }
///     fn update<const N: usize>(&self, _: &SolidPoint<N, ()>, _: Tangent)
///         -> Result<SolidResponse<N, ()>, Failure> { Err(Failure::Domain("")) }
/// }
/// const _: abi::raw::Law = abi::export::law::<abi::export::Continuum<Astray>>();
/// ```
///
/// ```
/// use abi::{ContinuumLaw, Description, Failure, Hypothesis, Refusal};
/// use abi::{SolidPoint, SolidResponse, Tangent};
/// abi::parameters! { pub struct Nothing {} }
/// struct Astray;
/// impl ContinuumLaw for Astray {
///     const DESCRIPTION: Description =
///         abi::describe! { id: "astray", name: "", doc: "", references: "" };
///     const HYPOTHESES: &'static [Hypothesis] = &[Hypothesis::PlaneStrain];
///     type Parameters = Nothing;
///     type State = ();
///     fn new(_: Nothing) -> Result<Self, Refusal> { Ok(Self) }
///     fn update<const N: usize>(&self, _: &SolidPoint<N, ()>, _: Tangent)
///         -> Result<SolidResponse<N, ()>, Failure> { Err(Failure::Domain("")) }
/// }
/// const _: abi::raw::Law = abi::export::law::<abi::export::Continuum<Astray>>();
/// ```
#[cfg(doctest)]
struct HypothesesOfSolids;
