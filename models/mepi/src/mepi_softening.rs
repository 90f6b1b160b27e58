//! MEPI with softening.

use crate::contact;
use crate::interface::{Common, Interface, SofteningParameters, State};
use abi::substepping::{Scheme, SchemeParameters};
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Refusal, Tangent,
};

abi::parameters! {
    /// Parameters of `mepi_softening`.
    pub struct Parameters {
        ..common: Common,
        ..softening: SofteningParameters,
        ..scheme: SchemeParameters,
    }
}

/// MEPI with softening.
#[derive(Clone, Copy, Debug)]
pub struct MepiSoftening(pub(crate) Interface);

impl InterfaceLaw for MepiSoftening {
    const DESCRIPTION: Description = abi::describe! {
        id: "mepi_softening",
        name: "MEPI, soil-structure interface with softening",
        doc: "Elastoplastic interface with friction that hardens to a peak and softens to a \
              residual value, contraction before and dilation after the characteristic state, \
              and separation.",
        references: "De Gennaro & Frank, eq. 6-17; De Gennaro & Frank, Computers and \
                     Geotechnics 29 (2002)",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        Interface::new(p.common, Some(p.softening), Scheme::new(p.scheme)?).map(Self)
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
