#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]
#![expect(non_snake_case, reason = "the letters of LAW.md: G is not g, M not m")]

mod cap;
mod rate;
mod return_mapping;
mod small;
mod small_law;
mod soil;
mod spectral;
mod step;
mod system;
#[cfg(test)]
mod tests;

use abi::{
    ContinuumLaw, Description, Failure, Refusal, SolidPoint, SolidResponse, Tangent, Variable,
};
pub use small_law::HardeningSoilSmall;
use soil::{Soil, SoilParameters};
use spectral::Principal;
use step::{Increment, Point};

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Preconsolidation pressure, where the cap meets the axis of p.
        p_p: Variable::scalar(c"p_p", c"kPa"),
        /// Plastic shear strain, major less intermediate and minor plastic strain, compression positive.
        gamma_ps: Variable::scalar(c"γ_ps", c"-"),
        /// Ratio of the cap's axes, along q over along p; constant.
        cap_ratio: Variable::scalar(c"M", c"-").output_only(),
        /// Hardening modulus of the cap at the reference stress; constant.
        cap_modulus: Variable::scalar(c"H", c"kPa").output_only(),
    }
}

/// Hardening soil: shear surface, cap and strength.
#[derive(Debug)]
pub struct HardeningSoil {
    soil: Soil,
}

impl ContinuumLaw for HardeningSoil {
    const DESCRIPTION: Description = abi::describe! {
        id: "hardening_soil",
        name: "hardening soil",
        doc: "Hyperbolic shear hardening, a cap, Mohr–Coulomb strength, and moduli that depend on stress.",
        references: "Schanz, Vermeer & Bonnier (1999)",
    };
    type Parameters = SoilParameters;
    type State = State;

    fn new(p: SoilParameters) -> Result<Self, Refusal> {
        Ok(Self {
            soil: Soil::new(&p)?,
        })
    }

    fn initial_state<const N: usize>(&self, stress: &[f64; N]) -> Result<State, Failure> {
        let [p_p, gamma_ps] = self.soil.start(&Principal::of(&stress.map(|s| -s)).values);
        Ok(self.state(p_p, gamma_ps))
    }

    #[inline]
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let start = Point {
            stress: point.stress.map(|s| -s),
            p_p: point.state.p_p,
            gamma: point.state.gamma_ps,
        };
        let increment = Increment::of(point.strain_increment.map(|e| -e));
        let (end, derivative) =
            self.soil
                .carry(start, &increment, tangent == Tangent::Consistent)?;
        end.check()?;
        Ok(SolidResponse {
            stress: end.stress.map(|s| -s),
            state: self.state(end.p_p, end.gamma),
            tangent: match tangent {
                Tangent::None => [[0.0; N]; N],
                Tangent::Elastic => self.soil.operator(&end.stress, 1.0),
                Tangent::Consistent => derivative.tangent(),
            },
            unreliable: None,
        })
    }
}

impl HardeningSoil {
    fn state(&self, p_p: f64, gamma_ps: f64) -> State {
        State {
            p_p,
            gamma_ps,
            cap_ratio: self.soil.cap.M,
            cap_modulus: self.soil.cap.H,
        }
    }
}

abi::export_laws!(continuum HardeningSoil, continuum HardeningSoilSmall);

bridges::export_mfront!(continuum HardeningSoil);
bridges::export_mfront!(continuum HardeningSoilSmall);
bridges::export_umat!(HardeningSoil);
