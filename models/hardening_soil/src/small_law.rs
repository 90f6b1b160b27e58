//! The law with stiffness at small strains.

use crate::small::{Memory, Remembered, SmallStrain};
use crate::soil::{Soil, SoilParameters};
use crate::spectral::Principal;
use crate::step::{Increment, Point};
use abi::{
    ContinuumLaw, Description, Failure, HasTangent, Parameter, Refusal, SolidPoint, SolidResponse,
    Tangent, Variable,
};
use std::array;

abi::parameters! {
    /// Parameters of the law.
    pub struct SmallParameters {
        ..soil: SoilParameters,
        /// Shear modulus at very small strains, at a minor stress of p_ref.
        g_0_ref: Parameter::new(c"G_0", c"kPa").above(0.0).usual(1e4, 1e7),
        /// Shear strain at which the secant shear modulus is 0.722 of that at very small strains.
        gamma_07: Parameter::new(c"γ_0.7", c"-").above(0.0).usual(1e-5, 1e-3),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct SmallState {
        /// Preconsolidation pressure, where the cap meets the axis of p.
        p_p: Variable::scalar(c"p_p", c"kPa"),
        /// Shear strain that the shear surface belongs to.
        gamma_ps: Variable::scalar(c"γ_ps", c"-"),
        /// Deviatoric strain since the last reversals, compression positive, 11.
        history_11: Variable::scalar(c"H_11", c"-"),
        /// The same, 22.
        history_22: Variable::scalar(c"H_22", c"-"),
        /// The same, 33.
        history_33: Variable::scalar(c"H_33", c"-"),
        /// The same, engineering shear 12.
        history_12: Variable::scalar(c"H_12", c"-"),
        /// The same, engineering shear 13.
        history_13: Variable::scalar(c"H_13", c"-"),
        /// The same, engineering shear 23.
        history_23: Variable::scalar(c"H_23", c"-"),
        /// 1 before the first reversal, 2 after it.
        branch: Variable::scalar(c"b", c"-"),
        /// Least ratio of the shear modulus to that of unloading so far.
        least_ratio: Variable::scalar(c"ρ_m", c"-"),
        /// Ratio of the cap's axes, along q over along p; constant.
        cap_ratio: Variable::scalar(c"M", c"-").output_only(),
        /// Hardening modulus of the cap at the reference stress; constant.
        cap_modulus: Variable::scalar(c"H", c"kPa").output_only(),
    }
}

/// Hardening soil with stiffness at small strains.
#[derive(Debug)]
pub struct HardeningSoilSmall {
    pub(crate) soil: Soil,
    small: SmallStrain,
}

impl ContinuumLaw for HardeningSoilSmall {
    const DESCRIPTION: Description = abi::describe! {
        id: "hardening_soil_small",
        name: "hardening soil with small-strain stiffness",
        doc: "Experimental: hardening soil whose shear modulus decays with the strain since the last reversal.",
        references: "Benz (2007); Benz, Vermeer & Schwab (2009)",
    };
    type Parameters = SmallParameters;
    type State = SmallState;
    /// Where equal strains part, the axes of Eq. (25) turn ever faster, and there is no derivative.
    const TANGENT: HasTangent = HasTangent::Approximate;

    fn new(p: SmallParameters) -> Result<Self, Refusal> {
        let soil = Soil::new(&p.soil)?;
        Ok(Self {
            small: SmallStrain::new(&soil, p.g_0_ref, p.gamma_07)?,
            soil,
        })
    }

    fn initial_state<const N: usize>(&self, stress: &[f64; N]) -> Result<SmallState, Failure> {
        let start = self.soil.start(&Principal::of(&stress.map(|s| -s)).values);
        let memory = Memory {
            strain: [0.0; N],
            branch: 1.0,
            least: self.small.initial,
        };
        Ok(self.state(start, &memory))
    }

    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, SmallState>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, SmallState>, Failure> {
        let old = &point.state;
        let history = [
            old.history_11,
            old.history_22,
            old.history_33,
            old.history_12,
            old.history_13,
            old.history_23,
        ];
        let memory = Memory {
            strain: array::from_fn(|i| history[i]),
            branch: old.branch,
            least: old.least_ratio,
        };
        let strain = point.strain_increment.map(|e| -e);
        let now = self.small.remember(&memory, &strain);
        let start = Point {
            stress: point.stress.map(|s| -s),
            p_p: old.p_p,
            gamma: old.gamma_ps,
        };
        let mut increment = Increment {
            stiffening: now.mean,
            slowing: now.slowing,
            ..Increment::of(strain)
        };
        if tangent == Tangent::Consistent {
            self.slopes(&memory, &now, &mut increment);
        }
        let (end, derivative) =
            self.soil
                .carry(start, &increment, tangent == Tangent::Consistent)?;
        end.check()?;
        Ok(SolidResponse {
            stress: end.stress.map(|s| -s),
            state: self.state([end.p_p, end.gamma], &now.memory),
            tangent: match tangent {
                Tangent::None => [[0.0; N]; N],
                Tangent::Elastic => self.soil.operator(&end.stress, now.end),
                Tangent::Consistent => derivative.tangent(),
            },
            unreliable: None,
        })
    }
}

impl HardeningSoilSmall {
    /// Derivatives of the moduli by the strain increment, by differences; beside a jump those of this side. They
    /// are bounded, as the direction of a small increment may change the modulus ever faster.
    fn slopes<const N: usize>(
        &self,
        memory: &Memory<N>,
        now: &Remembered<N>,
        increment: &mut Increment<N>,
    ) {
        const STEP: f64 = 6e-6;
        let size = increment.strain.iter().fold(0.0_f64, |x, e| x.max(e.abs()));
        if size <= 0.0 {
            return;
        }
        let step = STEP * size;
        for j in 0..N {
            let moved = |by: f64| -> Remembered<N> {
                let mut strain = increment.strain;
                strain[j] += by;
                self.small.remember(memory, &strain)
            };
            let (above, below) = (moved(step), moved(-step));
            let slope = |of: fn(&Remembered<N>) -> f64| {
                let sides = [of(&above) - of(now), of(now) - of(&below)];
                let most = 1e3 * of(now) / size;
                (one_sided(sides) / step).clamp(-most, most)
            };
            increment.stiffening_slope.0[j] = slope(|r| r.mean);
            increment.slowing_slope.0[j] = slope(|r| r.slowing);
        }
    }

    fn state<const N: usize>(&self, [p_p, gamma_ps]: [f64; 2], memory: &Memory<N>) -> SmallState {
        let h: [f64; 6] = array::from_fn(|i| memory.strain.get(i).copied().unwrap_or(0.0));
        SmallState {
            p_p,
            gamma_ps,
            history_11: h[0],
            history_22: h[1],
            history_33: h[2],
            history_12: h[3],
            history_13: h[4],
            history_23: h[5],
            branch: memory.branch,
            least_ratio: memory.least,
            cap_ratio: self.soil.cap.M,
            cap_modulus: self.soil.cap.H,
        }
    }
}

/// The mean of differences to both sides, or the smaller one if there is a jump on the other side.
fn one_sided([above, below]: [f64; 2]) -> f64 {
    const ALIKE: f64 = 0.1;
    if (above - below).abs() <= ALIKE * above.abs().max(below.abs()) {
        0.5 * (above + below)
    } else if above.abs() < below.abs() {
        above
    } else {
        below
    }
}
