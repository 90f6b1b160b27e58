#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod return_mapping;
#[cfg(test)]
mod tests;

use abi::friction::Strength;
use abi::{
    ContinuumLaw, Description, Failure, Hypothesis, Parameter, Refusal, SolidPoint, SolidResponse,
    Tangent, Variable,
};
use return_mapping::{Facet, Returned};

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Young's modulus.
        young_modulus: Parameter::new(c"E", c"kPa").above(0.0).usual(1e3, 1e9),
        /// Poisson's ratio.
        poisson_ratio: Parameter::new(c"ν", c"-").above(-1.0).below(0.5),
        /// Cohesion of the facet.
        cohesion: Parameter::new(c"c", c"kPa").at_least(0.0),
        /// Friction angle of the facet.
        friction_angle: Parameter::new(c"φ", c"deg").at_least(0.0).below(90.0).usual(0.0, 60.0),
        /// Angle of dilatancy, at most the angle of friction.
        dilatancy_angle: Parameter::new(c"ψ", c"deg").at_least(0.0).below(90.0).usual(0.0, 30.0),
        /// Bound on the normal stress of the facet, at most c cot φ; none if left out.
        tensile_strength: Parameter::new(c"R_t", c"kPa").at_least(0.0).optional(),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Accumulated plastic shear strain of the facet, the sum of |Δγ| over the increments.
        plastic_strain: Variable::scalar(c"γ_p", c"-"),
        /// Plastic normal strain of the facet, dilation positive.
        plastic_dilation: Variable::scalar(c"ε_p", c"-"),
    }
}

/// Elastic, perfectly plastic Mohr–Coulomb on a facet of given direction.
#[derive(Debug)]
pub struct OrientedMohrCoulomb {
    /// First Lamé constant λ.
    lambda: f64,
    /// Shear modulus G.
    shear_modulus: f64,
    /// Oedometric modulus M = λ + 2G.
    oedometric: f64,
    facet: Facet,
}

/// Places of the facet's normal and shear stress: 22 and 12.
const NORMAL: usize = 1;
const SHEAR: usize = 3;

impl ContinuumLaw for OrientedMohrCoulomb {
    const DESCRIPTION: Description = abi::describe! {
        id: "oriented_mohr_coulomb",
        name: "elastic, perfectly plastic Mohr–Coulomb on a facet of given direction",
        doc: "The oriented criterion: friction and dilatancy on the plane of the layer only.",
        references: "De Gennaro & Frank, Eqs. (1), (2), Table IV (3)",
    };
    const HYPOTHESES: &'static [Hypothesis] = &[Hypothesis::PlaneStrain, Hypothesis::Axisymmetric];
    const LOCAL_AXES: bool = true;
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let strength = Strength {
            cohesion: p.cohesion,
            friction_angle: p.friction_angle,
            dilatancy_angle: p.dilatancy_angle,
            tensile_strength: p.tensile_strength,
            apex: return_mapping::apex(p.cohesion, p.friction_angle),
        };
        strength.check()?;
        let (e, nu) = (p.young_modulus, p.poisson_ratio);
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let shear_modulus = e / (2.0 * (1.0 + nu));
        let oedometric = lambda + 2.0 * shear_modulus;
        Ok(Self {
            lambda,
            shear_modulus,
            oedometric,
            facet: Facet::new(oedometric, shear_modulus, &strength),
        })
    }

    #[inline]
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        // Eq. (1).
        let operator = self.elastic_operator();
        let mut stress = point.stress;
        for i in 0..N {
            for j in 0..N {
                stress[i] += operator[i][j] * point.strain_increment[j];
            }
        }
        let (normal, shear) = (stress[NORMAL], stress[SHEAR]);
        if !(normal - shear).is_finite() {
            return Err(Failure::Numeric("the elastic predictor overflows"));
        }
        // Eqs. (2) and (3).
        if self.facet.admits(normal, shear) {
            return Ok(SolidResponse {
                stress,
                state: point.state,
                tangent: operator,
                unreliable: None,
            });
        }
        let end = self.facet.return_stress(normal, shear);
        // Eq. (4).
        let opening = (normal - end.normal) / self.oedometric;
        let slip = (shear - end.shear) / self.shear_modulus;
        stress[0] -= self.lambda * opening;
        stress[2] -= self.lambda * opening;
        (stress[NORMAL], stress[SHEAR]) = (end.normal, end.shear);
        Ok(SolidResponse {
            stress,
            // Eq. (11).
            state: State {
                plastic_strain: point.state.plastic_strain + slip.abs(),
                plastic_dilation: point.state.plastic_dilation + opening,
            },
            tangent: if tangent == Tangent::Consistent {
                self.consistent_tangent(operator, &end)
            } else {
                operator
            },
            unreliable: None,
        })
    }
}

impl OrientedMohrCoulomb {
    /// Eq. (1), row by row.
    #[inline]
    fn elastic_operator<const N: usize>(&self) -> [[f64; N]; N] {
        let mut d = [[0.0; N]; N];
        for i in 0..N {
            if i < 3 {
                d[i][..3].fill(self.lambda);
                d[i][i] = self.oedometric;
            } else {
                d[i][i] = self.shear_modulus;
            }
        }
        d
    }

    /// Eq. (10), row by row.
    #[inline]
    fn consistent_tangent<const N: usize>(
        &self,
        elastic: [[f64; N]; N],
        end: &Returned,
    ) -> [[f64; N]; N] {
        let mut tangent = elastic;
        let [of_normal, of_shear] = self.facet.jacobian(end);
        let share = self.lambda / self.oedometric;
        for j in 0..N {
            let (normal, shear) = (elastic[NORMAL][j], elastic[SHEAR][j]);
            tangent[NORMAL][j] = of_normal[0] * normal + of_normal[1] * shear;
            tangent[SHEAR][j] = of_shear[0] * normal + of_shear[1] * shear;
            for i in [0, 2] {
                tangent[i][j] -= share * (normal - tangent[NORMAL][j]);
            }
        }
        tangent
    }
}

abi::export_laws!(continuum OrientedMohrCoulomb);
bridges::export!(continuum OrientedMohrCoulomb in PlaneStrain Axisymmetrical,
    properties: [YoungModulus PoissonRatio Cohesion FrictionAngle DilatancyAngle],
    parameters: [TensileStrength]);
