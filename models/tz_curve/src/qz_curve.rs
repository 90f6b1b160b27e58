//! Pressure on the base. Compression is positive inside.

use crate::curve::{Curve, Ground, Mobilised};
use abi::reclosure::InContact;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        ..ground: Ground,
        /// Limit of the pressure on the base.
        base_resistance: Parameter::new(c"q_b", c"kPa").above(0.0).usual(100.0, 3e4),
        /// Shear stiffness in contact.
        shear_stiffness: Parameter::new(c"K_t", c"kPa/m").at_least(0.0).usual(0.0, 1e12),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Part of the pressure that the stiff slider carries.
        stiff_part: Variable::scalar(c"q_1", c"kPa"),
        /// Opening since the pressure vanished; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
    }
}

/// Load transfer curve of a base.
#[derive(Clone, Copy, Debug)]
pub struct QzCurve {
    curve: Curve,
    /// `K_t`.
    shear_stiffness: f64,
}

impl InterfaceLaw for QzCurve {
    const DESCRIPTION: Description = abi::describe! {
        id: "qz_curve",
        name: "q-z curve of Frank and Zhao",
        doc: "Load transfer curve of a base from the pressuremeter modulus, in two slopes up to its limit, gap in \
              tension.",
        references: "Frank & Zhao 1982, Bull. liaison Labo. P. et Ch. 119",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        Ok(Self {
            curve: Curve {
                // Eq. (2).
                slope: p.ground.slope(11.0, 4.8),
                strength: p.base_resistance,
            },
            shear_stiffness: p.shear_stiffness,
        })
    }

    fn initial_state(&self, traction: &[f64; 2]) -> Result<State, Failure> {
        let Mobilised { stiff_part, .. } = self.curve.at_first((-traction[0]).max(0.0));
        Ok(State {
            stiff_part,
            gap: 0.0,
        })
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        if point.state.gap < 0.0 {
            return Err(Failure::Domain("gap is below 0 m"));
        }
        let mut end = self.carry(point);
        if tangent == Tangent::Elastic {
            end.tangent = [[self.curve.slope, 0.0], [0.0, self.shear_stiffness]];
        }
        Ok(end)
    }
}

impl QzCurve {
    /// The end of an increment with its consistent tangent.
    #[inline]
    fn carry(&self, point: &InterfacePoint<State>) -> InterfaceResponse<State> {
        let State { stiff_part, gap } = point.state;
        // A tension is there at the start only: faces that stand apart by as much.
        let gap = gap.max(point.traction[0] / self.curve.slope);
        let contact = InContact::from(gap, point.traction, point.jump_increment);
        let (traction, part) = match contact {
            Ok(contact) => contact,
            Err(gap) => return InterfaceResponse::open(State { stiff_part, gap }),
        };
        let start = Mobilised {
            stress: -traction[0],
            stiff_part,
        };
        // Eq. (6): unloading is elastic down to no pressure.
        let unloaded = start.stress - self.curve.slope * part.opening;
        if unloaded < 0.0 {
            return InterfaceResponse::open(State {
                stiff_part: Curve::unloaded(start).stiff_part,
                gap: -unloaded / self.curve.slope,
            });
        }
        let (end, slope) = self.curve.moved(start, -part.opening);
        let k_t = self.shear_stiffness;
        let [by_normal, by_tangential] = part.slip_by_jump;
        InterfaceResponse {
            // Eq. (7).
            traction: [-end.stress, traction[1] + k_t * part.slip],
            state: State {
                stiff_part: end.stiff_part,
                gap: 0.0,
            },
            tangent: [[slope, 0.0], [k_t * by_normal, k_t * by_tangential]],
            unreliable: None,
        }
    }
}
