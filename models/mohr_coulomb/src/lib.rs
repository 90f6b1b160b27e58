#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]
#![expect(non_snake_case, reason = "the letters of LAW.md: G is not g, M not m")]

mod elasticity;
mod return_mapping;
mod spectral;
mod substeps;
mod surface;
#[cfg(test)]
mod tests;

use abi::friction::Strength;
use abi::substepping::{Scheme, SchemeParameters};
use abi::{
    ContinuumLaw, Description, Failure, Parameter, Refusal, SolidPoint, SolidResponse, Tangent,
    Variable,
};
use elasticity::Elasticity;
use nalgebra::Vector3;
use spectral::{MohrCircle, Pair, Spatial};
use std::array;
use surface::Pyramid;

abi::parameters! {
    /// Parameters of the law.
    pub struct Parameters {
        /// Young's modulus.
        young_modulus: Parameter::new(c"E", c"kPa").above(0.0).usual(1e3, 1e9),
        /// Poisson's ratio.
        poisson_ratio: Parameter::new(c"ν", c"-").above(-1.0).below(0.5),
        /// Cohesion.
        cohesion: Parameter::new(c"c", c"kPa").at_least(0.0),
        /// Angle of internal friction.
        friction_angle: Parameter::new(c"φ", c"deg").at_least(0.0).below(90.0).usual(0.0, 60.0),
        /// Angle of dilatancy, at most the angle of friction.
        dilatancy_angle: Parameter::new(c"ψ", c"deg").at_least(0.0).below(90.0).usual(0.0, 30.0),
        /// Bound on the largest principal stress, at most c cot φ; none if left out.
        tensile_strength: Parameter::new(c"R_t", c"kPa").at_least(0.0).optional(),
        ..scheme: SchemeParameters,
        /// Time in which an overstress falls to 1/e; the law depends on no time if left out.
        relaxation_time: Parameter::new(c"τ", c"s").at_least(0.0).default(0.0),
    }
}

abi::internal_variables! {
    /// Internal variables of the law.
    pub struct State {
        /// Accumulated equivalent plastic shear strain, the sum of √(2/3 e:e) over the increments,
        /// e the deviator of the plastic strain increment.
        plastic_strain: Variable::scalar(c"ε_q", c"-"),
        /// Plastic volumetric strain, dilation positive.
        plastic_dilation: Variable::scalar(c"ε_v", c"-"),
    }
}

/// Elastic, perfectly plastic Mohr–Coulomb.
#[derive(Debug)]
pub struct MohrCoulomb {
    elasticity: Elasticity,
    pyramid: Pyramid,
    scheme: Scheme,
    relaxation_time: f64,
}

impl ContinuumLaw for MohrCoulomb {
    const DESCRIPTION: Description = abi::describe! {
        id: "mohr_coulomb",
        name: "elastic, perfectly plastic Mohr–Coulomb",
        doc: "Exact pyramid with edges and apex, non-associated flow, optional tension cut-off.",
        references: "De Gennaro & Frank, Table III; de Souza Neto, Perić & Owen (2008), ch. 8",
    };
    type Parameters = Parameters;
    type State = State;

    fn new(p: Parameters) -> Result<Self, Refusal> {
        let strength = Strength {
            cohesion: p.cohesion,
            friction_angle: p.friction_angle,
            dilatancy_angle: p.dilatancy_angle,
            tensile_strength: p.tensile_strength,
            apex: surface::apex(p.cohesion, p.friction_angle),
        };
        strength.check()?;
        let elasticity = Elasticity::new(p.young_modulus, p.poisson_ratio);
        Ok(Self {
            elasticity,
            pyramid: Pyramid::new(&elasticity, &strength),
            scheme: Scheme::new(p.scheme)?,
            relaxation_time: p.relaxation_time,
        })
    }

    #[inline]
    fn update<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        // Eq. (1).
        let trial = self
            .elasticity
            .trial_stress(&point.stress, &point.strain_increment);
        if !trial.iter().map(|s| s * s).sum::<f64>().is_finite() {
            return Err(Failure::Numeric("the elastic predictor overflows"));
        }
        if self.relaxation_time > 0.0 {
            return self.overstressed(point, &trial, tangent);
        }
        self.without_viscosity(point, trial, tangent)
    }
}

impl MohrCoulomb {
    /// The update once all overstress has relaxed.
    #[inline]
    fn without_viscosity<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: [f64; N],
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        if N == 4 {
            self.in_plane(point, trial, tangent)
        } else {
            self.in_space(point, trial, tangent)
        }
    }

    /// Eqs. (2), (3), (10) and (11), of one known principal axis.
    #[inline]
    fn in_plane<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: [f64; N],
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let circle = MohrCircle::of(&trial);
        let (largest, smallest) = circle.extremes();
        if self.pyramid.admits(largest, smallest) {
            return Ok(self.elastic(point, trial, tangent));
        }
        if self.scheme != Scheme::Implicit {
            return self.substeps(point, &trial, tangent);
        }
        let principal = circle.principal();
        let end = self.pyramid.return_stress(&principal.stress);
        let consistent = || {
            let M = self.pyramid.in_plane_M(end.zone, principal.pair);
            let kappa = end.kappa(&principal.stress, principal.pair);
            let shear = self.elasticity.G * kappa;
            resized(principal.tangent(M, shear).map(resized))
        };
        let stress = resized(principal.compose(&end.stress));
        let tangent = self.operator(tangent, consistent);
        Ok(self.plastic(point, &(principal.stress - end.stress), stress, tangent))
    }

    /// The same of three principal axes.
    #[inline]
    fn in_space<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: [f64; N],
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let (above, below) = spectral::bounds(&trial);
        if self.pyramid.admits(above, below) {
            return Ok(self.elastic(point, trial, tangent));
        }
        let principal = Spatial::of(&trial);
        let s = &principal.stress;
        if self.pyramid.admits(s[0], s[2]) {
            return Ok(self.elastic(point, trial, tangent));
        }
        if self.scheme != Scheme::Implicit {
            return self.substeps(point, &trial, tangent);
        }
        let end = self.pyramid.return_stress(s);
        let consistent = || {
            let shear = Pair::ALL.map(|pair| self.elasticity.G * end.kappa(s, pair));
            let M = self.pyramid.M(end.zone);
            resized(principal.tangent(M, shear).map(resized))
        };
        let stress = resized(principal.compose(&end.stress));
        let tangent = self.operator(tangent, consistent);
        Ok(self.plastic(point, &(s - end.stress), stress, tangent))
    }

    #[inline]
    fn elastic<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: [f64; N],
        tangent: Tangent,
    ) -> SolidResponse<N, State> {
        SolidResponse {
            stress: trial,
            state: point.state,
            tangent: self.operator(tangent, || self.elasticity.operator()),
            unreliable: None,
        }
    }

    /// Eq. (13): what the return takes from the principal stresses is plastic strain.
    #[inline]
    fn plastic<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        relaxed: &Vector3<f64>,
        stress: [f64; N],
        tangent: [[f64; N]; N],
    ) -> SolidResponse<N, State> {
        let (shear, dilation) = self.elasticity.equivalent_strains(relaxed);
        SolidResponse {
            stress,
            state: State {
                plastic_strain: point.state.plastic_strain + shear,
                plastic_dilation: point.state.plastic_dilation + dilation,
            },
            tangent,
            unreliable: None,
        }
    }

    /// The operator that is asked for.
    #[inline]
    fn operator<const N: usize>(
        &self,
        tangent: Tangent,
        consistent: impl FnOnce() -> [[f64; N]; N],
    ) -> [[f64; N]; N] {
        match tangent {
            Tangent::None => [[0.0; N]; N],
            Tangent::Elastic => self.elasticity.operator(),
            Tangent::Consistent => consistent(),
        }
    }

    /// The update with the overstress that the time of the increment leaves, Eqs. (17) and (18).
    #[cold]
    fn overstressed<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: &[f64; N],
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let rested = self.without_viscosity(point, *trial, tangent)?;
        let relaxed = point.time_increment / (self.relaxation_time + point.time_increment);
        let between = |all: f64, none: f64| none + relaxed * (all - none);
        let D = self.elasticity.operator::<N>();
        Ok(SolidResponse {
            stress: array::from_fn(|i| between(rested.stress[i], trial[i])),
            state: State {
                plastic_strain: between(rested.state.plastic_strain, point.state.plastic_strain),
                plastic_dilation: between(
                    rested.state.plastic_dilation,
                    point.state.plastic_dilation,
                ),
            },
            tangent: match tangent {
                Tangent::None | Tangent::Elastic => rested.tangent,
                Tangent::Consistent => {
                    array::from_fn(|i| array::from_fn(|j| between(rested.tangent[i][j], D[i][j])))
                }
            },
            unreliable: rested.unreliable,
        })
    }
}

/// An array whose length the compiler does not know to be `N`.
#[inline]
fn resized<T: Copy, const M: usize, const N: usize>(values: [T; M]) -> [T; N] {
    array::from_fn(|i| values[i])
}

abi::export_laws!(continuum MohrCoulomb);
bridges::export!(continuum MohrCoulomb,
    properties: [YoungModulus PoissonRatio Cohesion FrictionAngle DilatancyAngle],
    parameters: [TensileStrength Scheme Substeps SchemeTolerance RelaxationTime]);
