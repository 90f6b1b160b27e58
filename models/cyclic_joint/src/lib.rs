#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod return_mapping;
#[cfg(test)]
mod tests;

use abi::friction::tan;
use abi::reclosure::InContact;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};
use return_mapping::Contact;

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Normal stiffness.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Shear stiffness.
        shear_stiffness: Parameter::new(c"K_t", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Friction angle before any slip.
        peak_friction_angle: Parameter::new(c"φ_p", c"deg")
            .at_least(0.0)
            .below(90.0)
            .usual(0.0, 50.0),
        /// Friction angle after much slip.
        residual_friction_angle: Parameter::new(c"φ_r", c"deg")
            .at_least(0.0)
            .below(90.0)
            .usual(0.0, 50.0),
        /// Accumulated slip after which 1/e of the way from peak to residual friction is left.
        friction_slip: Parameter::new(c"ξ_φ", c"m").above(0.0).usual(1e-4, 1.0),
        /// Angle of contraction before any slip.
        contraction_angle: Parameter::new(c"ψ_c", c"deg").at_least(0.0).below(90.0).usual(0.0, 30.0),
        /// Accumulated slip after which 1/e of the contraction is left to come.
        contraction_slip: Parameter::new(c"ξ_c", c"m").above(0.0).usual(1e-4, 1.0),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Plastic slip, accumulated over both directions.
        plastic_slip: Variable::scalar(c"ξ", c"m"),
        /// Plastic contraction.
        plastic_contraction: Variable::scalar(c"c", c"m"),
        /// Opening since contact was lost; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
    }
}

/// Coulomb joint whose friction and contraction fade with the accumulated slip.
#[derive(Clone, Copy, Debug)]
pub struct CyclicJoint {
    /// `K_n`.
    normal_stiffness: f64,
    /// `K_t`.
    shear_stiffness: f64,
    /// `tan φ_r`.
    residual_friction: f64,
    /// `tan φ_p − tan φ_r`.
    friction_to_lose: f64,
    /// `ξ_φ`.
    friction_slip: f64,
    /// `tan ψ_c`.
    contraction_rate: f64,
    /// `ξ_c`.
    contraction_slip: f64,
}

impl InterfaceLaw for CyclicJoint {
    const DESCRIPTION: Description = abi::describe! {
        id: "cyclic_joint",
        name: "Cyclic joint",
        doc: "Linear elasticity, Coulomb friction and contraction that fade with the accumulated slip, \
              separation.",
        references: "after DeJong, Randolph & White 2003, Soils and Foundations 43(4)",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let (peak, residual) = (p.peak_friction_angle, p.residual_friction_angle);
        if residual > peak {
            return Err(Refusal::new(
                "residual_friction_angle",
                format!("{residual} deg is above peak_friction_angle = {peak} deg"),
            ));
        }
        Ok(Self {
            normal_stiffness: p.normal_stiffness,
            shear_stiffness: p.shear_stiffness,
            residual_friction: tan(residual),
            friction_to_lose: tan(peak) - tan(residual),
            friction_slip: p.friction_slip,
            contraction_rate: tan(p.contraction_angle),
            contraction_slip: p.contraction_slip,
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
        if tangent == Tangent::Elastic {
            // Eq. (1).
            end.tangent = [[self.normal_stiffness, 0.0], [0.0, self.shear_stiffness]];
        }
        Ok(end)
    }
}

impl State {
    /// What no path leads to.
    #[inline]
    fn fault(&self) -> Option<&'static str> {
        if self.plastic_slip < 0.0 {
            Some("plastic_slip is below 0 m")
        } else if self.plastic_contraction < 0.0 {
            Some("plastic_contraction is below 0 m")
        } else if self.gap < 0.0 {
            Some("gap is below 0 m")
        } else {
            None
        }
    }
}

impl CyclicJoint {
    /// The end of an increment with its consistent tangent.
    #[inline]
    fn end(&self, point: &InterfacePoint<State>) -> Result<InterfaceResponse<State>, Failure> {
        let InterfacePoint {
            traction,
            state,
            jump_increment,
            ..
        } = *point;
        match InContact::from(state.gap, traction, jump_increment) {
            Ok((traction, part)) => self.carry(&Contact {
                traction,
                part,
                state,
            }),
            Err(gap) => Ok(InterfaceResponse::open(State { gap, ..state })),
        }
    }
}

abi::export_laws!(interface CyclicJoint);
bridges::export!(interface CyclicJoint,
    properties: [NormalStiffness ShearStiffness PeakFrictionAngle ResidualFrictionAngle
        FrictionSlip ContractionAngle ContractionSlip],
    parameters: []);
