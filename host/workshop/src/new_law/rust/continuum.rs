//! `my_law`: linear elasticity and von Mises plasticity without hardening, for soft clay.
//!
//! (1) σ* = σ_0 + D Δε: elastic trial
//! (2) q = √(3/2 s:s) ≤ Y; s is the deviator of σ
//! (3) σ = p 1 + Y/q* s*, Δε_p = (q* − Y)/(3 G): radial return
//!
//! Components 11 22 33 12 [13 23], tension positive, shear strains γ = 2ε.
#![forbid(unsafe_code)]

use abi::{ContinuumLaw, Description, Failure, SolidPoint, SolidResponse};
use abi::{Parameter, Refusal, Tangent, Variable};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Young's modulus.
        young_modulus: Parameter::new(c"E", c"kPa").above(0.0).usual(1e2, 1e9),
        /// Poisson's ratio.
        poisson_ratio: Parameter::new(c"nu", c"-").above(-1.0).below(0.5).usual(0.0, 0.495),
        /// Strength in uniaxial compression, twice the undrained shear strength.
        yield_stress: Parameter::new(c"Y", c"kPa").above(0.0).usual(1.0, 1e6),
    }
}

abi::internal_variables! {
    /// Internal variables of the law; 0 at first.
    pub struct State {
        /// Equivalent plastic strain.
        plastic_strain: Variable::scalar(c"eps_p", c"-"),
    }
}

/// The law with its parameters fixed.
#[derive(Debug)]
pub struct Solid {
    /// Bulk modulus, kPa.
    k: f64,
    /// Shear modulus, kPa.
    g: f64,
    /// Y, kPa.
    yield_stress: f64,
}

impl ContinuumLaw for Solid {
    const DESCRIPTION: Description = abi::describe! {
        id: "my_law",
        name: "von Mises plasticity",
        doc: "Linear elasticity and von Mises plasticity without hardening.",
        references: "none",
    };
    const SYMMETRIC: bool = true;
    type Parameters = Parameters;
    type State = State;

    /// Each value is within its bounds. Return a `Refusal` if they do not go together.
    fn new(p: Parameters) -> Result<Self, Refusal> {
        Ok(Self {
            k: p.young_modulus / (3.0 * (1.0 - 2.0 * p.poisson_ratio)),
            g: p.young_modulus / (2.0 * (1.0 + p.poisson_ratio)),
            yield_stress: p.yield_stress,
        })
    }

    /// One point over one increment. No allocation, no output, nothing remembered between calls.
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let Self { k, g, yield_stress } = *self;
        // (1)
        let d_eps = point.strain_increment;
        let bulk = (k - 2.0 * g / 3.0) * (d_eps[0] + d_eps[1] + d_eps[2]);
        let mut stress: [f64; N] = std::array::from_fn(|i| match i {
            0..3 => point.stress[i] + bulk + 2.0 * g * d_eps[i],
            _ => point.stress[i] + g * d_eps[i],
        });
        let mean = (stress[0] + stress[1] + stress[2]) / 3.0;
        let s: [f64; N] =
            std::array::from_fn(|i| if i < 3 { stress[i] - mean } else { stress[i] });
        let weighted = |(i, s): (usize, &f64)| if i < 3 { s * s } else { 2.0 * s * s };
        let q = (1.5 * s.iter().enumerate().map(weighted).sum::<f64>()).sqrt();
        // (2), (3); what was returned before is within round-off.
        let yields = q > yield_stress * (1.0 + 1e-14);
        let scale = if yields { yield_stress / q } else { 1.0 };
        let mut state = point.state;
        if yields {
            state.plastic_strain += (q - yield_stress) / (3.0 * g);
            stress = std::array::from_fn(|i| scale * s[i] + if i < 3 { mean } else { 0.0 });
        }
        let mut matrix = [[0.0; N]; N];
        if tangent != Tangent::None {
            let plastic = yields && tangent == Tangent::Consistent;
            let shear = if plastic { scale * g } else { g };
            for (i, row) in matrix.iter_mut().enumerate() {
                for (j, d) in row.iter_mut().enumerate() {
                    if i < 3 && j < 3 {
                        *d = k - 2.0 * shear / 3.0;
                    }
                    if i == j {
                        *d += if i < 3 { 2.0 * shear } else { shear };
                    }
                    if plastic {
                        *d -= 3.0 * shear * s[i] * s[j] / (q * q);
                    }
                }
            }
        }
        Ok(SolidResponse {
            stress,
            state,
            tangent: matrix,
            unreliable: None,
        })
    }
}

abi::export_laws!(continuum Solid);
