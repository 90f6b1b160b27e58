//! What an author writes: one trait for laws of solids, one for laws of interfaces.
//!
//! Across this boundary tension and opening are positive, shear strains are γ = 2ε, angles in
//! parameters are in degrees, and interface components come normal first. A law is free to use
//! other signs inside.

use crate::descriptor::{Description, Hypothesis, InternalVariables, Parameters};
use std::fmt;

/// Why a law cannot be built from its parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Identifier of the parameter to change.
    pub parameter: &'static str,
    /// The defect, value before bound.
    pub reason: String,
}

impl Refusal {
    /// Refuses a parameter.
    pub fn new(parameter: &'static str, reason: impl Into<String>) -> Self {
        Self {
            parameter,
            reason: reason.into(),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.parameter, self.reason)
    }
}

/// Why a law cannot carry a point over an increment. Reasons are static, since nothing may be
/// allocated during an update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failure {
    /// A smaller step would help.
    CutStep {
        /// The fraction of the increment, in (0, 1), that the law believes it can follow. NaN, or
        /// anything else outside (0, 1), leaves the choice to the host.
        factor: f64,
        /// Why.
        reason: &'static str,
    },
    /// The state or the gradient is outside the law's domain; a smaller step does not help.
    Domain(&'static str),
    /// The local computation broke down; a smaller step does not help.
    Numeric(&'static str),
}

impl Failure {
    /// The reason in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::CutStep { reason, .. } | Self::Domain(reason) | Self::Numeric(reason) => reason,
        }
    }
}

/// Which operator the host wants next to the update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangent {
    /// None: leave the matrix unchanged.
    None,
    /// The elastic operator in the end state.
    Elastic,
    /// The derivative of the update.
    Consistent,
}

/// Kind of consistent tangent of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HasTangent {
    /// The derivative of the update.
    Consistent,
    /// Something near it.
    Approximate,
    /// Nothing but the elastic operator: `update` is never asked for [`Tangent::Consistent`].
    No,
}

/// One integration point of a solid at the start of an increment, and the increment.
#[derive(Clone, Copy, Debug)]
pub struct SolidPoint<const N: usize, S> {
    /// Strain at the start.
    pub strain: [f64; N],
    /// Strain increment.
    pub strain_increment: [f64; N],
    /// Stress at the start, kPa.
    pub stress: [f64; N],
    /// Internal variables at the start.
    pub state: S,
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Time at the start, counted from the start of the phase or segment.
    pub step_time: f64,
}

/// The same point at the end of the increment.
#[derive(Clone, Copy, Debug)]
pub struct SolidResponse<const N: usize, S> {
    /// Stress, kPa.
    pub stress: [f64; N],
    /// Internal variables.
    pub state: S,
    /// ∂stress/∂strain, row by row, kPa; ignored unless requested.
    pub tangent: [[f64; N]; N],
    /// The outputs are valid but inaccurate, for this reason.
    pub unreliable: Option<&'static str>,
}

/// One integration point of an interface at the start of an increment, and the increment; in real
/// numbers, or in [others](crate::dual). `N` is 2 in the plane (normal, tangential), 3 in space (normal,
/// two tangential).
#[derive(Clone, Copy, Debug)]
pub struct InterfacePoint<S, T = f64, const N: usize = 2> {
    /// Relative displacement u⁺ − u⁻ at the start, normal first, m.
    pub jump: [T; N],
    /// Increment of the relative displacement, m.
    pub jump_increment: [T; N],
    /// Traction at the start, kPa.
    pub traction: [T; N],
    /// Internal variables at the start.
    pub state: S,
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Time at the start, counted from the start of the phase or segment.
    pub step_time: f64,
}

/// The same point at the end of the increment.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceResponse<S, const N: usize = 2> {
    /// Traction, kPa.
    pub traction: [f64; N],
    /// Internal variables.
    pub state: S,
    /// ∂traction/∂jump, row by row, kPa/m; ignored unless requested.
    pub tangent: [[f64; N]; N],
    /// The outputs are valid but inaccurate, for this reason.
    pub unreliable: Option<&'static str>,
}

impl<S, const N: usize> InterfaceResponse<S, N> {
    /// Faces that do not touch: no traction, no stiffness.
    pub const fn open(state: S) -> Self {
        Self {
            traction: [0.0; N],
            state,
            tangent: [[0.0; N]; N],
            unreliable: None,
        }
    }
}

/// Rates of what an update depends on. In [`InterfaceLaw::initial_rates`] only those of parameters
/// and traction are in use.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceRates<'a, S> {
    /// Rates of the parameters, in declared order; empty: all zero.
    pub parameter: Option<&'a [f64]>,
    /// Rate of the jump at the start.
    pub jump: [f64; 2],
    /// Rate of its increment.
    pub jump_increment: [f64; 2],
    /// Rate of the traction at the start.
    pub traction: [f64; 2],
    /// Rates of the internal variables at the start.
    pub state: S,
}

/// A law for solids. Immutable once built; `update` is a pure function of its arguments.
pub trait ContinuumLaw: Sized + Send + Sync + 'static {
    /// Name and origin of the law.
    const DESCRIPTION: Description;
    /// Hypotheses offered: any of plane strain, axisymmetry, three dimensions, at least one.
    /// Exporting a law with any other list does not compile.
    const HYPOTHESES: &'static [Hypothesis] = &[
        Hypothesis::PlaneStrain,
        Hypothesis::Axisymmetric,
        Hypothesis::ThreeD,
    ];
    /// The tangent is symmetric in every state.
    const SYMMETRIC: bool = false;
    /// The response is linear: one constant tangent, no internal variables.
    const LINEAR: bool = false;
    /// Kind of consistent tangent.
    const TANGENT: HasTangent = HasTangent::Consistent;
    /// Components are in axes of the material: 1 along the layer, 2 normal to it.
    const LOCAL_AXES: bool = false;
    /// Declared with [`parameters!`](crate::parameters).
    type Parameters: Parameters;
    /// Declared with [`internal_variables!`](crate::internal_variables), or `()`.
    type State: InternalVariables;

    /// Fixes the parameters. Each lies within its declared bounds; what is left to check is how
    /// they go together.
    ///
    /// # Errors
    /// Names the parameter to change.
    fn new(parameters: Self::Parameters) -> Result<Self, Refusal>;

    /// Internal variables of a point that carries this stress before anything has happened.
    ///
    /// # Errors
    /// [`Failure::Domain`] if the law cannot start from this stress.
    fn initial_state<const N: usize>(&self, stress: &[f64; N]) -> Result<Self::State, Failure> {
        let _ = stress;
        Ok(Self::State::initial())
    }

    /// Carries one point over an increment. `N` is 4 (11 22 33 12) or 6 (11 22 33 12 13 23). Does
    /// not allocate, lock or print.
    ///
    /// # Errors
    /// Why it cannot; the outputs are then ignored.
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, Self::State>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, Self::State>, Failure>;
}

/// A law for interfaces, in two dimensions and perhaps in three. Immutable once built; `update` is a pure function of
/// its arguments.
pub trait InterfaceLaw: Sized + Send + Sync + 'static {
    /// Name and origin of the law.
    const DESCRIPTION: Description;
    /// The tangent is symmetric in every state.
    const SYMMETRIC: bool = false;
    /// The response is linear: one constant tangent, no internal variables.
    const LINEAR: bool = false;
    /// Kind of consistent tangent.
    const TANGENT: HasTangent = HasTangent::Consistent;
    /// Offers [`rates`](Self::rates), in two dimensions.
    const RATES: bool = false;
    /// Offers three dimensions too: [`update_in_space`](Self::update_in_space).
    const IN_SPACE: bool = false;
    /// Declared with [`parameters!`](crate::parameters).
    type Parameters: Parameters;
    /// Declared with [`internal_variables!`](crate::internal_variables), or `()`.
    type State: InternalVariables;

    /// Fixes the parameters. Each lies within its declared bounds; what is left to check is how
    /// they go together.
    ///
    /// # Errors
    /// Names the parameter to change.
    fn new(parameters: Self::Parameters) -> Result<Self, Refusal>;

    /// Internal variables of a point that carries this traction (normal first, kPa) before
    /// anything has happened.
    ///
    /// # Errors
    /// [`Failure::Domain`] if the law cannot start from this traction.
    fn initial_state(&self, traction: &[f64; 2]) -> Result<Self::State, Failure> {
        let _ = traction;
        Ok(Self::State::initial())
    }

    /// Carries one point over an increment. Does not allocate, lock or print.
    ///
    /// # Errors
    /// Why it cannot; the outputs are then ignored.
    fn update(
        &self,
        point: &InterfacePoint<Self::State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<Self::State>, Failure>;

    /// As [`initial_state`](Self::initial_state), in three dimensions: that of the tangential traction's
    /// size, unless the law knows better.
    ///
    /// # Errors
    /// As [`initial_state`](Self::initial_state).
    fn initial_state_in_space(&self, traction: &[f64; 3]) -> Result<Self::State, Failure> {
        let [normal, first, second] = *traction;
        self.initial_state(&[normal, first.hypot(second)])
    }

    /// As [`update`](Self::update), in three dimensions. Called only where [`IN_SPACE`](Self::IN_SPACE)
    /// is set.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    fn update_in_space(
        &self,
        point: &InterfacePoint<Self::State, f64, 3>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<Self::State, 3>, Failure> {
        let _ = (point, tangent);
        Err(Failure::Numeric("the law is for two dimensions"))
    }

    /// The derivative of [`update`](Self::update) in one direction: rates of traction and internal
    /// variables at the end. Called only where [`RATES`](Self::RATES) is set.
    /// [`ByDuals`](crate::dual::ByDuals) does it for laws that are written for any number.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    fn rates(
        &self,
        point: &InterfacePoint<Self::State>,
        rates: &InterfaceRates<'_, Self::State>,
    ) -> Result<([f64; 2], Self::State), Failure> {
        let _ = (point, rates);
        Err(Failure::Numeric("the law offers no rates"))
    }

    /// The derivative of [`initial_state`](Self::initial_state) in one direction. Called only where
    /// [`RATES`](Self::RATES) is set.
    ///
    /// # Errors
    /// As [`initial_state`](Self::initial_state).
    fn initial_rates(
        &self,
        traction: &[f64; 2],
        rates: &InterfaceRates<'_, Self::State>,
    ) -> Result<Self::State, Failure> {
        let _ = (traction, rates);
        Err(Failure::Numeric("the law offers no rates"))
    }
}
