//! MEPI without softening.

use crate::contact;
use crate::interface::{Common, Interface, State};
use abi::substepping::{Scheme, SchemeParameters};
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Refusal, Tangent,
};

abi::parameters! {
    /// Parameters of `mepi`.
    pub struct Parameters {
        ..common: Common,
        ..scheme: SchemeParameters,
    }
}

/// MEPI without softening.
#[derive(Clone, Copy, Debug)]
pub struct Mepi(pub(crate) Interface);

impl InterfaceLaw for Mepi {
    const DESCRIPTION: Description = abi::describe! {
        id: "mepi",
        name: "MEPI, soil-structure interface without softening",
        doc: "Elastoplastic interface with hyperbolic friction hardening, contraction before and \
              dilation after the characteristic state, and separation.",
        references: "De Gennaro & Frank, eq. 6-10, 12-17; De Gennaro & Frank, Computers and \
                     Geotechnics 29 (2002)",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        Interface::new(p.common, None, Scheme::new(p.scheme)?).map(Self)
    }

    fn initial_state(&self, traction: &[f64; 2]) -> Result<State, Failure> {
        self.0.initial_state(traction)
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        contact::update(&self.0, point, tangent)
    }
}
