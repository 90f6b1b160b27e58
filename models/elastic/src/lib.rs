#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

#[cfg(test)]
mod tests;

use abi::{
    ContinuumLaw, Description, Failure, Parameter, Refusal, SolidPoint, SolidResponse, Tangent,
};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Young's modulus.
        young_modulus: Parameter::new(c"E", c"kPa").above(0.0).usual(1e3, 1e9),
        /// Poisson's ratio.
        poisson_ratio: Parameter::new(c"ν", c"-").above(-1.0).below(0.5),
    }
}

/// Isotropic linear elasticity.
#[derive(Debug)]
pub struct Elastic {
    /// First Lamé constant λ.
    lambda: f64,
    /// Shear modulus G.
    shear_modulus: f64,
}

impl ContinuumLaw for Elastic {
    const DESCRIPTION: Description = abi::describe! {
        id: "elastic",
        name: "isotropic linear elasticity",
        doc: "Hooke's law in increments: the stress carried in is kept.",
        references: "De Gennaro & Frank, Table III",
    };
    const SYMMETRIC: bool = true;
    const LINEAR: bool = true;
    type Parameters = Parameters;
    type State = ();

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let (e, nu) = (p.young_modulus, p.poisson_ratio);
        Ok(Self {
            // Eq. (2).
            lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            shear_modulus: e / (2.0 * (1.0 + nu)),
        })
    }

    #[inline]
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, ()>,
        _: Tangent,
    ) -> Result<SolidResponse<N, ()>, Failure> {
        let (lambda, g) = (self.lambda, self.shear_modulus);
        let strain = &point.strain_increment;
        // Eq. (1).
        let volumetric = strain[0] + strain[1] + strain[2];
        let mut stress = point.stress;
        let mut tangent = [[0.0; N]; N];
        for i in 0..N {
            if i < 3 {
                stress[i] += lambda * volumetric + 2.0 * g * strain[i];
                tangent[i][..3].fill(lambda);
                tangent[i][i] += 2.0 * g;
            } else {
                stress[i] += g * strain[i];
                tangent[i][i] = g;
            }
        }
        Ok(SolidResponse {
            stress,
            state: (),
            tangent,
            unreliable: None,
        })
    }
}

abi::export_laws!(continuum Elastic);
bridges::export!(continuum Elastic, properties: [YoungModulus PoissonRatio], parameters: []);
