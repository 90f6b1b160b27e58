#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod flow;
mod root;
#[cfg(test)]
mod tests;

use abi::friction::tan;
use abi::reclosure::InContact;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};
use flow::{Flow, Sample};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Normal stiffness.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Shear stiffness.
        shear_stiffness: Parameter::new(c"K_t", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Friction angle at the critical state.
        critical_friction_angle: Parameter::new(c"φ_cs", c"deg")
            .above(0.0)
            .below(90.0)
            .usual(10.0, 45.0),
        /// Void ratio at the critical state without stress.
        critical_void_ratio: Parameter::new(c"e_c0", c"-").above(0.0).usual(0.5, 1.5),
        /// Granular hardness: the stress by which the critical void ratio falls.
        granular_hardness: Parameter::new(c"h_s", c"kPa").above(0.0).usual(1e4, 1e8),
        /// Exponent of the stress in the critical void ratio.
        hardness_exponent: Parameter::new(c"n", c"-").above(0.0).at_most(1.0).usual(0.1, 0.7),
        /// Growth of the peak friction with density.
        peak_exponent: Parameter::new(c"n_b", c"-").at_least(0.0).at_most(20.0).usual(0.0, 5.0),
        /// Fall of the friction from which sand dilates with density.
        dilatancy_exponent: Parameter::new(c"n_d", c"-")
            .at_least(0.0)
            .at_most(20.0)
            .usual(0.0, 8.0),
        /// Plastic slip after which 1/e of the way to the peak friction is left.
        hardening_slip: Parameter::new(c"ξ_h", c"m").above(0.0).usual(1e-6, 0.1),
        /// Thickness of the sheared layer.
        thickness: Parameter::new(c"t", c"m").above(0.0).usual(1e-4, 0.1),
        /// Void ratio at the start.
        initial_void_ratio: Parameter::new(c"e_0", c"-").above(0.0).usual(0.3, 1.5),
        /// Share of the dilatancy of Taylor's energy balance.
        dilatancy_factor: Parameter::new(c"A", c"-")
            .at_least(0.0)
            .at_most(10.0)
            .usual(0.0, 2.0)
            .default(1.0),
        /// Half of the elastic range of the stress ratio.
        elastic_range: Parameter::new(c"m", c"-").above(0.0).usual(1e-3, 0.2).default(0.02),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Void ratio of the sheared layer.
        void_ratio: Variable::scalar(c"e", c"-"),
        /// Stress ratio in the middle of the elastic range, with the sign of the shear stress.
        back_stress_ratio: Variable::scalar(c"α", c"-"),
        /// Opening since contact was lost; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
    }
}

/// Sand interface with dilatancy by the distance from the critical state.
#[derive(Clone, Copy, Debug)]
pub struct CriticalStateJoint {
    parameters: Parameters,
    /// M = `tan φ_cs`.
    critical_friction: f64,
}

impl InterfaceLaw for CriticalStateJoint {
    const DESCRIPTION: Description = abi::describe! {
        id: "critical_state_joint",
        name: "Critical state joint",
        doc: "Sand interface that remembers its density: peak friction and dilatancy by the distance from \
              the critical state, kinematic hardening, separation.",
        references: "after Lashkari 2013, IJST Transactions of Civil Engineering 37; \
                     Bauer 1996, Soils and Foundations 36(1)",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let critical_friction = tan(p.critical_friction_angle);
        if p.elastic_range >= critical_friction {
            return Err(Refusal::new(
                "elastic_range",
                format!(
                    "{} is not below the tangent of critical_friction_angle, {critical_friction}",
                    p.elastic_range
                ),
            ));
        }
        Ok(Self {
            parameters: p,
            critical_friction,
        })
    }

    fn initial_state(&self, &[normal, shear]: &[f64; 2]) -> Result<State, Failure> {
        let m = self.parameters.elastic_range;
        // Eq. (10).
        let ratio = if normal < 0.0 { shear / -normal } else { 0.0 };
        Ok(State {
            void_ratio: self.parameters.initial_void_ratio,
            back_stress_ratio: ratio - ratio.clamp(-m, m),
            gap: 0.0,
        })
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        if let Some(fault) = point.state.fault() {
            return Err(Failure::Domain(fault));
        }
        let mut end = self.end(point)?;
        if !end.state.void_ratio.is_finite() {
            return Err(Failure::Numeric(
                "the void ratio overflows: the layer is too thin for its springs",
            ));
        }
        if tangent == Tangent::Elastic {
            // Eq. (1).
            let p = &self.parameters;
            end.tangent = [[p.normal_stiffness, 0.0], [0.0, p.shear_stiffness]];
        }
        Ok(end)
    }
}

impl State {
    /// What no path leads to.
    #[inline]
    fn fault(&self) -> Option<&'static str> {
        if self.void_ratio < -1.0 {
            Some("void_ratio is below -1")
        } else if self.gap < 0.0 {
            Some("gap is below 0 m")
        } else {
            None
        }
    }
}

/// A joint in contact over its part of the increment, compression positive.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// `σ_n` at the start.
    sigma: f64,
    /// Trial of Eq. (1).
    sigma_trial: f64,
    tau_trial: f64,
    part: InContact,
    state: State,
}

impl CriticalStateJoint {
    /// The end of an increment with its consistent tangent.
    #[inline]
    fn end(&self, point: &InterfacePoint<State>) -> Result<InterfaceResponse<State>, Failure> {
        let InterfacePoint {
            traction,
            state,
            jump_increment,
            ..
        } = *point;
        let ([normal, shear], part) = match InContact::from(state.gap, traction, jump_increment) {
            Ok(contact) => contact,
            Err(gap) => return Ok(InterfaceResponse::open(State { gap, ..state })),
        };
        let p = &self.parameters;
        let contact = Contact {
            sigma: -normal,
            sigma_trial: -normal - p.normal_stiffness * part.opening,
            tau_trial: shear + p.shear_stiffness * part.slip,
            part,
            state,
        };
        if !(contact.sigma_trial - contact.tau_trial).is_finite() {
            return Err(Failure::Numeric("the elastic predictor overflows"));
        }
        self.carry(&contact)
    }

    #[inline]
    fn carry(&self, contact: &Contact) -> Result<InterfaceResponse<State>, Failure> {
        let p = &self.parameters;
        let Contact {
            sigma_trial,
            tau_trial,
            part,
            state,
            ..
        } = *contact;
        // No sand grows by as much as its own thickness.
        if contact.sigma.max(sigma_trial) <= 0.0 || part.opening >= p.thickness {
            return Ok(self.open(contact));
        }
        let void_ratio = self.void_ratio(&state, part.opening);
        // Eq. (2).
        let excess = tau_trial - state.back_stress_ratio * sigma_trial;
        let limit = p.elastic_range * sigma_trial + 8.0 * f64::EPSILON * tau_trial.abs();
        if sigma_trial >= 0.0 && excess.abs() <= limit {
            let state = State {
                void_ratio,
                gap: 0.0,
                ..state
            };
            let tangent = [[p.normal_stiffness, 0.0], [0.0, p.shear_stiffness]];
            return Ok(part.response([-sigma_trial, tau_trial], state, tangent));
        }
        let sign = 1.0_f64.copysign(excess);
        let flow = Flow {
            law: self,
            sigma: sigma_trial,
            tau: sign * tau_trial,
            ratio: sign * state.back_stress_ratio + p.elastic_range,
            void_ratio,
        };
        match flow.end() {
            Some(end) => self.slid(&flow, &end, sign, &part),
            None => Ok(self.open(contact)),
        }
    }

    /// After plastic slip, on the surface to the last bit.
    #[inline]
    fn slid(
        &self,
        flow: &Flow<'_>,
        end: &Sample,
        sign: f64,
        part: &InContact,
    ) -> Result<InterfaceResponse<State>, Failure> {
        let state = State {
            void_ratio: flow.void_ratio,
            back_stress_ratio: sign * (end.mu - self.parameters.elastic_range),
            gap: 0.0,
        };
        let [[a, b], [c, d]] = flow.tangent(end)?;
        let tangent = [[a, sign * b], [sign * c, d]];
        let traction = [-end.sigma, sign * end.mu * end.sigma];
        Ok(part.response(traction, state, tangent))
    }

    /// The faces part, or touch without stress: Eq. (9).
    #[cold]
    fn open(&self, contact: &Contact) -> InterfaceResponse<State> {
        let k_n = self.parameters.normal_stiffness;
        let (opening, gap) = if contact.sigma_trial < 0.0 {
            (contact.sigma / k_n, -contact.sigma_trial / k_n)
        } else {
            (contact.part.opening, 0.0)
        };
        InterfaceResponse::open(State {
            void_ratio: self.void_ratio(&contact.state, opening),
            back_stress_ratio: 0.0,
            gap,
        })
    }

    /// Eq. (7).
    #[inline]
    fn void_ratio(&self, state: &State, opening: f64) -> f64 {
        let growth = (opening / self.parameters.thickness).exp_m1();
        state.void_ratio + (1.0 + state.void_ratio) * growth
    }
}

abi::export_laws!(interface CriticalStateJoint);
bridges::export!(interface CriticalStateJoint,
    properties: [NormalStiffness ShearStiffness CriticalFrictionAngle CriticalVoidRatio
        GranularHardness HardnessExponent PeakExponent DilatancyExponent HardeningSlip Thickness
        InitialVoidRatio],
    parameters: [DilatancyFactor ElasticRange]);
