//! Flow by substeps, Eqs. (14) to (16): the axes of each step are those of its start.
//!
//! Stresses are tensors here, in the plane and in space alike.

use crate::elasticity::Elasticity;
use crate::return_mapping::Zone;
use crate::spectral::{Pair, Spatial, jacobi};
use crate::{MohrCoulomb, State};
use abi::substepping::{Attempt, Scheme, error_controlled};
use abi::{Failure, SolidPoint, SolidResponse, Tangent};
use nalgebra::{Matrix3, Vector3};

/// A stress on its way through the increment.
#[derive(Clone, Copy, Debug)]
struct Step {
    stress: Matrix3<f64>,
    /// Zone of the last step; none if it was elastic.
    zone: Option<Zone>,
    /// Plastic strains of the increment so far, Eq. (13).
    shear: f64,
    dilation: f64,
}

/// By how much the elastic increment turns the axes of a step, relative: it settles the axes where
/// two principal stresses are equal, and no more.
const SETTLING: f64 = 1e-10;

/// Row and column of a component.
const PLACE: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

fn tensor(components: &[f64]) -> Matrix3<f64> {
    let mut s = Matrix3::zeros();
    for (&(i, j), &value) in PLACE.iter().zip(components) {
        s[(i, j)] = value;
        s[(j, i)] = value;
    }
    s
}

fn components<const N: usize>(s: &Matrix3<f64>) -> [f64; N] {
    std::array::from_fn(|c| s[PLACE[c]])
}

impl MohrCoulomb {
    /// Carries a point whose elastic predictor is inadmissible over the increment.
    ///
    /// # Errors
    /// The tolerance asks for too many steps.
    #[cold]
    pub(crate) fn substeps<const N: usize>(
        &self,
        point: &SolidPoint<N, State>,
        trial: &[f64; N],
        tangent: Tangent,
    ) -> Result<SolidResponse<N, State>, Failure> {
        let stress = tensor(&point.stress);
        let increment = tensor(trial) - stress;
        let elastic = self.elastic_fraction(&stress, &increment);
        let left = increment * (1.0 - elastic);
        let mut end = Step {
            stress: stress + increment * elastic,
            zone: None,
            shear: 0.0,
            dilation: 0.0,
        };
        match self.scheme {
            Scheme::Implicit => {}
            Scheme::Explicit { substeps } => {
                let each = left / f64::from(substeps);
                for _ in 0..substeps {
                    end = self.euler(&end, &each);
                }
            }
            Scheme::ErrorControlled { tolerance } => {
                end = self.brought_in(end);
                end = error_controlled(end, tolerance, |from, fraction| {
                    Ok(self.modified_euler(from, &(left * fraction)))
                })?;
            }
        }
        Ok(SolidResponse {
            stress: components(&end.stress),
            state: State {
                plastic_strain: point.state.plastic_strain + end.shear,
                plastic_dilation: point.state.plastic_dilation + end.dilation,
            },
            tangent: match (tangent, end.zone) {
                (Tangent::None, _) => [[0.0; N]; N],
                (Tangent::Consistent, Some(zone)) => self.continuum_tangent(&end.stress, zone),
                _ => self.elasticity.operator(),
            },
            unreliable: None,
        })
    }

    /// The last fraction of an elastic increment that is admissible; to the last bit, since the
    /// surface is convex.
    fn elastic_fraction(&self, stress: &Matrix3<f64>, increment: &Matrix3<f64>) -> f64 {
        const BISECTIONS: usize = 60;
        let admissible = |fraction: f64| {
            let (s, _) = jacobi(stress + increment * fraction);
            self.pyramid.admits(s[0], s[2])
        };
        let (mut low, mut high) = (0.0, 1.0);
        if admissible(low) {
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if admissible(middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
        }
        low
    }

    /// Eq. (14): a step with the axes of its start.
    fn euler(&self, from: &Step, increment: &Matrix3<f64>) -> Step {
        let (size, change) = (from.stress.norm(), increment.norm());
        let settled = if change > 0.0 {
            from.stress + increment * (SETTLING * size / change)
        } else {
            from.stress
        };
        let (_, axes) = jacobi(settled);
        let mut seen = axes.tr_mul(&((from.stress + increment) * axes));
        let trial = seen.diagonal();
        // The step may have changed the order.
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&a, &b| trial[b].total_cmp(&trial[a]));
        let sorted = Vector3::from(order.map(|i| trial[i]));
        if self.pyramid.admits(sorted[0], sorted[2]) {
            return Step {
                stress: from.stress + increment,
                zone: None,
                ..*from
            };
        }
        let end = self.pyramid.return_stress(&sorted);
        for (place, i) in order.into_iter().enumerate() {
            seen[(i, i)] = end.stress[place];
        }
        let (shear, dilation) = self.elasticity.equivalent_strains(&(sorted - end.stress));
        Step {
            stress: axes * seen * axes.transpose(),
            zone: Some(end.zone),
            shear: from.shear + shear,
            dilation: from.dilation + dilation,
        }
    }

    /// Eq. (15): the mean of a step from the start and one from its end, then back to the surface.
    fn modified_euler(&self, from: &Step, increment: &Matrix3<f64>) -> Attempt<Step> {
        let first = self.euler(from, increment);
        let second = self.euler(&first, increment);
        let mean = Step {
            stress: (from.stress + second.stress) * 0.5,
            zone: second.zone.or(first.zone),
            shear: 0.5 * (from.shear + second.shear),
            dilation: 0.5 * (from.dilation + second.dilation),
        };
        let off = (second.stress - first.stress * 2.0 + from.stress).norm() * 0.5;
        let end = self.on_surface(mean);
        Attempt {
            end,
            error: off / end.stress.norm().max(f64::MIN_POSITIVE),
        }
    }

    /// A stress carried in from outside the surface, returned at fixed strain: no step is small
    /// enough to make little of that.
    fn brought_in(&self, at: Step) -> Step {
        let (s, _) = jacobi(at.stress);
        if self.pyramid.admits(s[0], s[2]) {
            return at;
        }
        let end = self.pyramid.return_stress(&s);
        let (shear, dilation) = self.elasticity.equivalent_strains(&(s - end.stress));
        Step {
            shear,
            dilation,
            zone: Some(end.zone),
            ..self.on_surface(at)
        }
    }

    /// The closest return of what a step drifts, in the axes of its end.
    fn on_surface(&self, at: Step) -> Step {
        let (s, axes) = jacobi(at.stress);
        if self.pyramid.admits(s[0], s[2]) {
            return at;
        }
        let end = self.pyramid.return_stress(&s);
        Step {
            stress: axes * Matrix3::from_diagonal(&end.stress) * axes.transpose(),
            ..at
        }
    }

    /// Eq. (16): Eq. (11) for a step of no size.
    fn continuum_tangent<const N: usize>(
        &self,
        stress: &Matrix3<f64>,
        zone: Zone,
    ) -> [[f64; N]; N] {
        let merged = |pair: Pair| match zone {
            Zone::Edge12 | Zone::TensionEdge | Zone::Vertex12 => pair == Pair::First12,
            Zone::Edge23 | Zone::Vertex23 => pair == Pair::Last23,
            Zone::Apex | Zone::TensionCorner => true,
            Zone::Face | Zone::TensionPlane | Zone::FaceAndTension => false,
        };
        let Elasticity { G, .. } = self.elasticity;
        let shear = Pair::ALL.map(|pair| if merged(pair) { 0.0 } else { G });
        let all: [f64; 6] = components(stress);
        let tangent = Spatial::of(&all).tangent(self.pyramid.M(zone), shear);
        std::array::from_fn(|i| std::array::from_fn(|j| tangent[i][j]))
    }
}
