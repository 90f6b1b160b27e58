//! How large the quantities of probes are in the model, whatever a probe itself has: what a probe that is zero but for
//! round-off is held against.

use super::{PointQuantity, Probe, Probes};
use crate::ends;
use crate::output_request::Reduce;
use mechanics::group::Group;
use mechanics::problem::Formulation;
use mechanics::simulation::Snapshot;

/// Strains, and displacements as shares of the mesh's extent, below this are held against it: where nothing moves, all that
/// there is of them is round-off. Relative to it, 2e-16 counts as zero, the last bit of a strain of one.
const STILL: f64 = f64::EPSILON / 1e-8;

/// The largest magnitudes in a state, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// Sum of the nodal forces of a group, the largest of all groups, kN.
    pub force: f64,
    /// Displacements and jumps, m.
    pub length: f64,
    /// Stresses, tractions, pore pressures, kPa.
    pub stress: f64,
    /// Strains.
    pub strain: f64,
}

impl Sizes {
    /// For a whole state.
    pub fn of(snapshot: &Snapshot<'_>) -> Self {
        let n_dofs = snapshot.displacement.len();
        let nodes = &snapshot.mesh.nodes;
        let extent = [0, 1].map(|c| {
            let [low, high] = ends(nodes.iter().map(|node| node[c]));
            high - low
        });
        let mut sizes = Self {
            length: STILL * extent[0].max(extent[1]).max(0.0),
            strain: STILL,
            ..Self::default()
        };
        let raise = |size: &mut f64, values: &[f64]| {
            *size = values
                .iter()
                .fold(*size, |most, value| most.max(value.abs()));
        };
        raise(&mut sizes.length, snapshot.displacement);
        for group in snapshot.groups.iter().filter(|group| group.is_active) {
            let force: f64 = group.forces(n_dofs).iter().map(|force| force.abs()).sum();
            sizes.force = sizes.force.max(force);
            if group.formulation == Formulation::Solid {
                // Solids have no axes of their own.
                raise(&mut sizes.stress, &group.stress.committed);
                raise(&mut sizes.strain, &group.strain.committed);
                continue;
            }
            for point in 0..group.kinematics.n_points() {
                if let Some(stress) = group.global_stress(point) {
                    raise(&mut sizes.stress, &stress);
                }
                if let Some(strain) = group.global_strain(point) {
                    raise(&mut sizes.strain, &strain);
                }
                if let Some((jump, traction)) = group.jump_and_traction(point) {
                    raise(&mut sizes.length, &jump);
                    raise(&mut sizes.stress, &traction);
                }
            }
        }
        sizes
    }
}

impl Probes {
    /// For every probe how large it could be, by what is in the model.
    pub fn sizes(&self, snapshot: &Snapshot<'_>, of: &Sizes) -> Vec<f64> {
        let mut sizes: Vec<f64> = Vec::new();
        for (_, probe) in &self.probes {
            sizes.push(probe.size(snapshot, of, &sizes));
        }
        sizes
    }
}

impl Probe {
    fn size(&self, snapshot: &Snapshot<'_>, of: &Sizes, earlier: &[f64]) -> f64 {
        match self {
            Self::Points {
                group,
                points,
                weights,
                quantity,
                reduce,
                scale,
            } => {
                let group = &snapshot.groups[*group];
                let value = match quantity {
                    PointQuantity::Stress(_)
                    | PointQuantity::Traction(_)
                    | PointQuantity::Pressure(_) => of.stress,
                    PointQuantity::Strain(_) => of.strain,
                    PointQuantity::Jump(_) => of.length,
                    PointQuantity::Internal(id) => largest_internal(group, id),
                };
                scale.abs() * value * stands_for(*reduce, points.len(), weights)
            }
            Self::Displacement {
                nodes,
                reduce,
                scale,
                ..
            } => scale.abs() * of.length * stands_for(*reduce, nodes.len(), &[]),
            Self::Force { scale, .. } | Self::HandedOn { scale, .. } => scale.abs() * of.force,
            Self::Combination(terms) => (terms.iter())
                .map(|&(number, factor)| factor.abs() * earlier[number])
                .sum(),
        }
    }
}

/// The largest magnitude of an internal variable in a group.
fn largest_internal(group: &Group, id: &str) -> f64 {
    let points = 0..group.kinematics.n_points();
    let values = points.filter_map(|point| group.internal_variable(point, id));
    values.fold(0.0, |most, value| most.max(value.abs()))
}

/// How many times a value counts that a probe makes of this many.
fn stands_for(reduce: Reduce, n: usize, weights: &[f64]) -> f64 {
    match reduce {
        Reduce::Sum => n as f64,
        Reduce::Integral => weights.iter().sum(),
        Reduce::Mean | Reduce::Average | Reduce::Min | Reduce::Max => 1.0,
    }
}
