//! MEPI with softening.

use crate::contact;
use crate::interface::{Common, Interface, Peak, State};
use abi::substepping::Scheme;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent,
};

abi::parameters! {
    /// Parameters of `mepi_softening`.
    pub struct Parameters {
        /// Normal stiffness at a normal stress of 1 kPa.
        k_n: Parameter::new(c"k_n", c"kPa^(1-N)/m").above(0.0).usual(1e2, 1e9),
        /// Shear stiffness at a normal stress of 1 kPa.
        k_t: Parameter::new(c"k_t", c"kPa^(1-N)/m").above(0.0).usual(1e2, 1e9),
        /// Exponent of the normal stress in the stiffnesses.
        n: Parameter::new(c"N", c"-").at_least(0.0).at_most(2.0).usual(0.0, 1.0),
        /// Friction coefficient at the end of the elastic range.
        mu_0: Parameter::new(c"μ_0", c"-").at_least(0.0).usual(0.0, 1.0),
        /// Friction coefficient at failure.
        mu_p: Parameter::new(c"μ_p", c"-").above(0.0).usual(0.1, 1.5),
        /// Friction coefficient at the characteristic state, where contraction turns to dilation.
        mu_c0: Parameter::new(c"μ_c0", c"-").at_least(0.0).usual(0.1, 1.5),
        /// Slip that hardening takes; larger is softer.
        a: Parameter::new(c"A", c"-").above(0.0).usual(1e-5, 1e-1),
        /// Rate at which dilation dies out.
        c_0: Parameter::new(c"C_0", c"-").at_least(0.0).usual(1e-3, 1e2),
        /// Thickness of the interface, its internal length.
        t: Parameter::new(c"t", c"m").above(0.0).usual(1e-5, 1e-1),
        /// Reference pressure.
        p_0: Parameter::new(c"p_0", c"kPa").above(0.0).usual(1.0, 1e3).default(1.0),
        /// Initial normal stress, compression positive; taken from the initial state if left out.
        sigma_ni: Parameter::new(c"σ_ni", c"kPa").above(0.0).usual(1e-1, 1e5).optional(),
        /// Residual friction coefficient.
        mu_r: Parameter::new(c"μ_r", c"-").at_least(0.0).usual(0.1, 1.5),
        /// Rate of softening.
        a_0: Parameter::new(c"A_0", c"-").at_least(0.0).usual(1.0, 20.0),
        /// Plastic slip at the peak.
        u_tp: Parameter::new(c"u_tp", c"m").at_least(0.0).usual(1e-5, 1e-1),
        /// How softening starts: from the friction reached at the peak, or at μ_p with a jump.
        peak: Parameter::new(c"peak", c"-")
            .one_of(abi::choices!(c"continuous", c"published"))
            .default(0.0),
        /// How the flow is integrated.
        scheme: Parameter::new(c"scheme", c"-")
            .one_of(abi::choices!(c"implicit", c"explicit", c"error_controlled"))
            .default(0.0),
        /// Number of steps of the explicit scheme in an increment, whole.
        substeps: Parameter::new(c"n_s", c"-").at_least(1.0).at_most(1e6).default(10.0),
        /// Relative error that a step of the error-controlled scheme may have.
        scheme_tolerance: Parameter::new(c"ε_s", c"-")
            .above(0.0)
            .below(1.0)
            .usual(1e-10, 1e-2)
            .default(1e-6),
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
        let scheme = Scheme::new(p.scheme, p.substeps, p.scheme_tolerance)?;
        let common = Common {
            k_n: p.k_n,
            k_t: p.k_t,
            n: p.n,
            mu_0: p.mu_0,
            mu_p: p.mu_p,
            mu_c0: p.mu_c0,
            a: p.a,
            c_0: p.c_0,
            t: p.t,
            p_0: p.p_0,
            sigma_ni: p.sigma_ni,
        };
        let peak = Peak {
            mu_r: p.mu_r,
            a_0: p.a_0,
            u_tp: p.u_tp,
            published: p.peak > 0.5,
        };
        Interface::new(common, Some(peak), scheme).map(Self)
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
