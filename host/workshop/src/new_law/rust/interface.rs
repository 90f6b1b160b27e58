//! `my_law`: an elastic interface with Coulomb friction and separation.
//!
//! (1) `t_n = K_n ([u_n] + g)`, `t_t = t_t0 + K_t [u_t]`: trial; g is the gap at the start
//! (2) `t_n > 0`: the interface opens, t = 0, `g = t_n / K_n`
//! (3) `|t_t| ≤ −t_n tan φ`, otherwise it slides
//!
//! Tension and opening are positive.
#![forbid(unsafe_code)]

use abi::{Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse};
use abi::{Parameter, Refusal, Tangent, Variable};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Stiffness against closing.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Stiffness against sliding.
        shear_stiffness: Parameter::new(c"K_t", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Friction angle.
        friction_angle: Parameter::new(c"phi", c"deg").at_least(0.0).below(90.0).usual(0.0, 50.0),
    }
}

abi::internal_variables! {
    /// Internal variables of the law; 0 at first.
    pub struct State {
        /// Slip, accumulated over both directions.
        plastic_slip: Variable::scalar(c"xi", c"m"),
        /// Opening; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
    }
}

/// The law with its parameters fixed.
#[derive(Debug)]
pub struct Joint {
    k_n: f64,
    k_t: f64,
    tan_phi: f64,
}

impl InterfaceLaw for Joint {
    const DESCRIPTION: Description = abi::describe! {
        id: "my_law",
        name: "interface with Coulomb friction",
        doc: "Linear elasticity, Coulomb friction without dilatancy, separation.",
        references: "none",
    };
    type Parameters = Parameters;
    type State = State;

    /// Each value is within its bounds. Return a `Refusal` if they do not go together.
    fn new(p: Parameters) -> Result<Self, Refusal> {
        Ok(Self {
            k_n: p.normal_stiffness,
            k_t: p.shear_stiffness,
            tan_phi: p.friction_angle.to_radians().tan(),
        })
    }

    /// One point over one increment. No allocation, no output, nothing remembered between calls.
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        let Self { k_n, k_t, tan_phi } = *self;
        // (1) In contact the traction carries what is known of the past, open the gap does.
        let normal = point.traction[0] + k_n * (point.state.gap + point.jump_increment[0]);
        let shear = point.traction[1] + k_t * point.jump_increment[1];
        let consistent = tangent == Tangent::Consistent;
        let mut end = InterfaceResponse {
            traction: [normal, shear],
            state: State {
                gap: 0.0,
                ..point.state
            },
            tangent: [[k_n, 0.0], [0.0, k_t]],
            unreliable: None,
        };
        if normal > 0.0 {
            // (2)
            end.traction = [0.0; 2];
            end.state.gap = point.state.gap + point.jump_increment[0] + point.traction[0] / k_n;
            if consistent {
                end.tangent = [[0.0; 2]; 2];
            }
            return Ok(end);
        }
        let excess = shear.abs() + normal * tan_phi;
        if excess > 0.0 {
            // (3)
            let sign = 1.0_f64.copysign(shear);
            end.traction[1] = -sign * normal * tan_phi;
            end.state.plastic_slip += excess / k_t;
            if consistent {
                end.tangent[1] = [-sign * k_n * tan_phi, 0.0];
            }
        }
        Ok(end)
    }
}

abi::export_laws!(interface Joint);
