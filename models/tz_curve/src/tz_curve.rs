//! Shear of the shaft.

use crate::curve::{Curve, Ground, Mobilised};
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        ..ground: Ground,
        /// Limit of the shaft friction.
        shaft_friction: Parameter::new(c"q_s", c"kPa").above(0.0).usual(1.0, 500.0),
        /// Normal stiffness, in compression and in tension.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Part of the shear stress that the stiff slider carries.
        stiff_part: Variable::scalar(c"τ_1", c"kPa"),
    }
}

/// Load transfer curve of a shaft.
#[derive(Clone, Copy, Debug)]
pub struct TzCurve {
    curve: Curve,
    /// `K_n`.
    normal_stiffness: f64,
}

impl InterfaceLaw for TzCurve {
    const DESCRIPTION: Description = abi::describe! {
        id: "tz_curve",
        name: "t-z curve of Frank and Zhao",
        doc: "Load transfer curve of a shaft from the pressuremeter modulus, in two slopes up to its limit, whatever the \
              normal stress.",
        references: "Frank & Zhao 1982, Bull. liaison Labo. P. et Ch. 119",
    };
    const SYMMETRIC: bool = true;
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        Ok(Self {
            curve: Curve {
                // Eq. (1).
                slope: p.ground.slope(2.0, 0.8),
                strength: p.shaft_friction,
            },
            normal_stiffness: p.normal_stiffness,
        })
    }

    fn initial_state(&self, traction: &[f64; 2]) -> Result<State, Failure> {
        let Mobilised { stiff_part, .. } = self.curve.at_first(traction[1]);
        Ok(State { stiff_part })
    }

    #[inline]
    fn update(
        &self,
        point: &InterfacePoint<State>,
        tangent: Tangent,
    ) -> Result<InterfaceResponse<State>, Failure> {
        let start = Mobilised {
            stress: point.traction[1],
            stiff_part: point.state.stiff_part,
        };
        let [opening, slip] = point.jump_increment;
        let (end, slope) = self.curve.moved(start, slip);
        let slope = if tangent == Tangent::Elastic {
            self.curve.slope
        } else {
            slope
        };
        let k_n = self.normal_stiffness;
        Ok(InterfaceResponse {
            // Eq. (5).
            traction: [point.traction[0] + k_n * opening, end.stress],
            state: State {
                stiff_part: end.stiff_part,
            },
            tangent: [[k_n, 0.0], [0.0, slope]],
            unreliable: None,
        })
    }
}
