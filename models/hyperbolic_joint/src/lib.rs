#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod shear;
#[cfg(test)]
mod tests;

use abi::friction::tan;
use abi::reclosure::InContact;
use abi::{
    Description, Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Parameter, Refusal,
    Tangent, Variable,
};
use shear::{Interface, Start};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Normal stiffness.
        normal_stiffness: Parameter::new(c"K_n", c"kPa/m").above(0.0).usual(1e3, 1e12),
        /// Stiffness number.
        stiffness_number: Parameter::new(c"K", c"-").above(0.0).usual(1e2, 1e6),
        /// Exponent of the normal stress in the stiffness.
        stiffness_exponent: Parameter::new(c"n", c"-").at_least(0.0).at_most(2.0).usual(0.0, 1.2),
        /// Failure ratio: strength over the asymptote of the hyperbola.
        failure_ratio: Parameter::new(c"R_f", c"-").at_least(0.0).at_most(1.0).usual(0.5, 1.0),
        /// Adhesion, until the interface has opened.
        adhesion: Parameter::new(c"c_a", c"kPa").at_least(0.0).usual(0.0, 1e3),
        /// Friction angle of the interface.
        friction_angle: Parameter::new(c"δ", c"deg").at_least(0.0).below(90.0).usual(0.0, 50.0),
        /// Stiffness number of unloading and reloading; that of loading if left out.
        unloading_number: Parameter::new(c"K_ur", c"-").above(0.0).usual(1e2, 1e7).optional(),
        /// Unit weight of water, which gives the stiffness its unit.
        unit_weight_of_water: Parameter::new(c"γ_w", c"kN/m^3")
            .above(0.0)
            .usual(9.0, 11.0)
            .default(9.81),
        /// Atmospheric pressure, at which the stiffness is that of the number.
        atmospheric_pressure: Parameter::new(c"p_a", c"kPa")
            .above(0.0)
            .usual(90.0, 110.0)
            .default(101.325),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Greatest share of the strength that loading has mobilised, in either direction.
        stress_level: Variable::scalar(c"S_m", c"-"),
        /// Opening since the normal stress vanished; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
        /// 1 once the interface has opened, which breaks its adhesion; 0 before.
        broken: Variable::scalar(c"b", c"-"),
    }
}

/// Hyperbolic shear after Clough and Duncan.
#[derive(Clone, Copy, Debug)]
pub struct HyperbolicJoint {
    /// `K_n`.
    normal_stiffness: f64,
    /// `K_ur γ_w`, kPa/m: stiffness of unloading at `p_a`.
    unloading_stiffness: f64,
    /// `K/K_ur`.
    loading_share: f64,
    /// n.
    exponent: f64,
    /// `p_a`.
    atmospheric_pressure: f64,
    /// `R_f`.
    failure_ratio: f64,
    /// `c_a`.
    adhesion: f64,
    /// tan δ.
    tan_delta: f64,
}

impl InterfaceLaw for HyperbolicJoint {
    const DESCRIPTION: Description = abi::describe! {
        id: "hyperbolic_joint",
        name: "Hyperbolic joint",
        doc: "Hyperbolic shear with a stiffness that grows with the normal stress, linear unloading \
              and reloading, Coulomb strength, separation.",
        references: "Clough & Duncan 1971, J. Soil Mech. Found. Div. ASCE 97(12)",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let unloading = if p.unloading_number.is_nan() {
            p.stiffness_number
        } else {
            p.unloading_number
        };
        if unloading < p.stiffness_number {
            let reason = format!(
                "{unloading} is below stiffness_number = {}",
                p.stiffness_number
            );
            return Err(Refusal::new("unloading_number", reason));
        }
        if p.friction_angle <= 0.0 && p.adhesion <= 0.0 {
            let reason = "0 kPa with a friction angle of 0 deg leaves no strength";
            return Err(Refusal::new("adhesion", reason));
        }
        Ok(Self {
            normal_stiffness: p.normal_stiffness,
            unloading_stiffness: unloading * p.unit_weight_of_water,
            loading_share: p.stiffness_number / unloading,
            exponent: p.stiffness_exponent,
            atmospheric_pressure: p.atmospheric_pressure,
            failure_ratio: p.failure_ratio,
            adhesion: p.adhesion,
            tan_delta: tan(p.friction_angle),
        })
    }

    fn initial_state(&self, traction: &[f64; 2]) -> Result<State, Failure> {
        let strength = self.at((-traction[0]).max(0.0), 0.0).strength;
        let stress_level = if strength > 0.0 {
            (traction[1].abs() / strength).min(1.0)
        } else {
            0.0
        };
        Ok(State {
            stress_level,
            gap: 0.0,
            broken: 0.0,
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
        let mut end = self.carry(point);
        if tangent == Tangent::Elastic {
            // Eq. (1), (3).
            let unloading = if end.state.gap > 0.0 {
                0.0
            } else {
                self.at(-end.traction[0], end.state.broken).unloading
            };
            end.tangent = [[self.normal_stiffness, 0.0], [0.0, unloading]];
        }
        Ok(end)
    }
}

impl State {
    /// What no path leads to.
    #[inline]
    fn fault(&self) -> Option<&'static str> {
        if !(0.0..=1.0).contains(&self.stress_level) {
            Some("stress_level is outside [0, 1]")
        } else if self.gap < 0.0 {
            Some("gap is below 0 m")
        } else if self.broken * (1.0 - self.broken) != 0.0 {
            Some("broken is neither 0 nor 1")
        } else {
            None
        }
    }
}

impl HyperbolicJoint {
    /// The end of an increment with its consistent tangent.
    #[inline]
    fn carry(&self, point: &InterfacePoint<State>) -> InterfaceResponse<State> {
        let State { gap, broken, .. } = point.state;
        let contact = InContact::from(gap, point.traction, point.jump_increment);
        let (traction, part) = match contact {
            Ok(contact) => contact,
            Err(gap) => return InterfaceResponse::open(State { gap, ..point.state }),
        };
        // Eq. (1).
        let sigma = -(traction[0] + self.normal_stiffness * part.opening);
        let end = self.at(sigma.max(0.0), broken).shear(&Start {
            tau: traction[1],
            slip: part.slip,
            stress_level: point.state.stress_level,
        });
        if sigma < 0.0 {
            return InterfaceResponse::open(State {
                stress_level: end.stress_level,
                gap: -sigma / self.normal_stiffness,
                broken: 1.0,
            });
        }
        let state = State {
            stress_level: end.stress_level,
            gap: 0.0,
            broken,
        };
        // σ_n = −t_n falls by K_n with the opening.
        let by_sigma = -self.normal_stiffness * end.by_sigma;
        let tangent = [[self.normal_stiffness, 0.0], [by_sigma, end.by_slip]];
        part.response([-sigma, end.tau], state, tangent)
    }

    /// Stiffness and strength at a normal stress, compression positive.
    #[inline]
    fn at(&self, sigma: f64, broken: f64) -> Interface {
        let power = if self.exponent > 0.0 {
            (sigma / self.atmospheric_pressure).powf(self.exponent)
        } else {
            1.0
        };
        let adhesion = if broken > 0.5 { 0.0 } else { self.adhesion };
        // Eq. (2), (3), (4).
        let unloading = self.unloading_stiffness * power;
        Interface {
            unloading,
            // Of nothing, nothing: no slope where there is no stiffness.
            unloading_by_sigma: if unloading > 0.0 && sigma > 0.0 {
                self.exponent * unloading / sigma
            } else {
                0.0
            },
            loading_share: self.loading_share,
            failure_ratio: self.failure_ratio,
            strength: adhesion + sigma * self.tan_delta,
            tan_delta: self.tan_delta,
        }
    }
}

abi::export_laws!(interface HyperbolicJoint);
bridges::export!(interface HyperbolicJoint,
    properties: [NormalStiffness StiffnessNumber StiffnessExponent FailureRatio Adhesion
        FrictionAngle],
    parameters: [UnloadingNumber UnitWeightOfWater AtmosphericPressure]);
