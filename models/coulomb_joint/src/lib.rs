#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod in_space;
mod return_mapping;
#[cfg(test)]
mod tests;

use abi::friction::tan;
use abi::reclosure::InContact;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};
use return_mapping::{Contact, Strength};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Normal stiffness.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Shear stiffness.
        shear_stiffness: Parameter::new(c"K_t", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Cohesion, until the joint has opened.
        cohesion: Parameter::new(c"c", c"kPa").at_least(0.0).usual(0.0, 1e3),
        /// Friction angle.
        friction_angle: Parameter::new(c"φ", c"deg").at_least(0.0).below(90.0).usual(0.0, 50.0),
        /// Dilatancy angle.
        dilatancy_angle: Parameter::new(c"ψ", c"deg").at_least(0.0).below(90.0).usual(0.0, 30.0),
        /// Tensile strength, until the joint has opened.
        tensile_strength: Parameter::new(c"R_t", c"kPa").at_least(0.0).usual(0.0, 1e3).default(0.0),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Plastic slip, accumulated over both directions.
        plastic_slip: Variable::scalar(c"ξ", c"m"),
        /// Plastic opening by dilatancy.
        plastic_opening: Variable::scalar(c"[u_n^p]", c"m"),
        /// Opening beyond the position of contact without stress; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
        /// 1 once the joint has opened, which breaks its bond; 0 before.
        broken: Variable::scalar(c"b", c"-"),
    }
}

/// Elastic, perfectly plastic Coulomb joint with brittle tensile strength.
#[derive(Clone, Copy, Debug)]
pub struct CoulombJoint {
    /// `K_n`.
    normal_stiffness: f64,
    /// `K_t`.
    shear_stiffness: f64,
    /// Strength of the intact joint, and of the broken one.
    intact: Strength,
    broken: Strength,
}

impl InterfaceLaw for CoulombJoint {
    const DESCRIPTION: Description = abi::describe! {
        id: "coulomb_joint",
        name: "Coulomb joint",
        doc: "Linear elasticity, Coulomb friction with constant dilatancy, brittle tensile \
              strength and separation.",
        references: "De Gennaro & Frank, Table IV (2)",
    };
    const IN_SPACE: bool = true;
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let (phi, psi) = (p.friction_angle, p.dilatancy_angle);
        if psi > phi {
            return Err(Refusal::new(
                "dilatancy_angle",
                format!("{psi} deg is above friction_angle = {phi} deg"),
            ));
        }
        let (tan_phi, tan_psi) = (tan(phi), tan(psi));
        // Equality is legal, however the two numbers are rounded.
        if p.tensile_strength * tan_phi > p.cohesion * (1.0 + 1e-12) {
            return Err(Refusal::new(
                "tensile_strength",
                format!(
                    "{} kPa is above cohesion / tan(friction_angle) = {} kPa",
                    p.tensile_strength,
                    p.cohesion / tan_phi
                ),
            ));
        }
        let intact = Strength {
            cohesion: p.cohesion,
            tensile: p.tensile_strength,
            tan_phi,
            tan_psi,
        };
        Ok(Self {
            normal_stiffness: p.normal_stiffness,
            shear_stiffness: p.shear_stiffness,
            intact,
            broken: Strength {
                cohesion: 0.0,
                tensile: 0.0,
                ..intact
            },
        })
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        let state = point.state;
        let mut end = match self.contact(point) {
            Ok(contact) => self.carry(state, &contact),
            Err(gap) => InterfaceResponse::open(State {
                gap,
                broken: 1.0,
                ..state
            }),
        };
        if tangent == Tangent::Elastic {
            // Eq. (1).
            end.tangent = [[self.normal_stiffness, 0.0], [0.0, self.shear_stiffness]];
        }
        Ok(end)
    }

    #[inline]
    fn update_in_space(
        &self,
        point: &InterfacePoint<State, f64, 3>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State, 3>, Failure> {
        Ok(self.slide_in_space(point, self.update(&self.along(point), tangent)?, tangent))
    }
}

impl CoulombJoint {
    /// The part of the increment in contact, or the gap at its end if absent.
    #[inline]
    fn contact(&self, point: &InterfacePoint<State>) -> Result<Contact, f64> {
        let State { gap, broken, .. } = point.state;
        let (traction, part) = InContact::from(gap, point.traction, point.jump_increment)?;
        Ok(Contact {
            traction,
            part,
            strength: if gap > 0.0 || broken > 0.5 {
                self.broken
            } else {
                self.intact
            },
        })
    }
}

abi::export_laws!(interface CoulombJoint);
bridges::export!(interface CoulombJoint,
    properties: [NormalStiffness ShearStiffness Cohesion FrictionAngle DilatancyAngle],
    parameters: [TensileStrength]);
