//! Effective stress before the first phase.

use super::Columns;
use crate::mesh::Mesh;
use crate::problem::{Ground, InitialStress, Problem, Water};
use std::collections::HashMap;

/// A point on an interface is moved this far into the adjacent element, as a fraction of the way to
/// its middle, so that its column is unique.
const INSIDE: f64 = 1e-9;

/// The stresses before the first phase, at any point of any group.
#[derive(Debug)]
pub struct InitialStresses<'p> {
    mesh: &'p Mesh,
    water: Option<&'p Water>,
    groups: Vec<Ground>,
    columns: Option<Columns<'p>>,
    /// For every group, its own.
    surcharges: Vec<Option<f64>>,
    /// Element on the outside of a joint's face, by the node in the face's middle.
    beside: HashMap<usize, usize>,
}

impl<'p> InitialStresses<'p> {
    pub(crate) fn of(problem: &'p Problem) -> Self {
        let groups = problem.groups.iter().map(Ground::from).collect();
        Self::new(&problem.mesh, problem.water.as_ref(), groups)
    }

    /// Those of a mesh whose groups, in their order, are this ground.
    pub fn new(mesh: &'p Mesh, water: Option<&'p Water>, groups: Vec<Ground>) -> Self {
        let is_at_rest =
            |group: &Ground| matches!(group.initial_stress, Some(InitialStress::AtRest(_)));
        let columns = groups.iter().any(is_at_rest).then(|| {
            Columns::new(mesh, water, |number| {
                let group: &Ground = &groups[number];
                group.is_active.then_some(group.unit_weight)
            })
        });
        let surcharge = |group: &Ground| match &group.initial_stress {
            Some(InitialStress::AtRest(at_rest)) => at_rest.surcharge,
            _ => None,
        };
        Self {
            mesh,
            water,
            columns,
            surcharges: groups.iter().map(surcharge).collect(),
            beside: beside_joints(mesh),
            groups,
        }
    }

    /// For every element of a group, in their order, its centre and the effective stress of the ground there,
    /// components 11 22 33 12, tension positive, kPa: of zero-thickness elements the mean of the sides that have one.
    /// Zero where there is none.
    pub fn of_elements(&self, number: usize) -> Vec<([f64; 2], [f64; 4])> {
        let mesh = self.mesh;
        let solids = mesh.solids.iter().filter(|solid| solid.group == number);
        let solids = solids.map(|solid| {
            let at = mesh.towards_middle(solid, mesh.nodes[solid.nodes()[0]], 1.0);
            (at, self.at(number, at).unwrap_or_default())
        });
        let joints = mesh.joints.iter().filter(|joint| joint.group == number);
        let joints = joints.map(|joint| {
            let at = mesh.nodes[joint.minus[2]];
            let sides = [joint.minus[2], joint.plus[2]];
            (at, self.mean_of_sides(sides, at, |_| 0.0))
        });
        solids.chain(joints).collect()
    }

    /// Stress of a solid group at a point, components 11 22 33 12 in global axes, tension positive, kPa.
    /// `None` if the group has no initial stress.
    pub(crate) fn at(&self, number: usize, at: [f64; 2]) -> Option<[f64; 4]> {
        let group = &self.groups[number];
        Some(match group.initial_stress.as_ref()? {
            InitialStress::Constant(stress) => *stress,
            InitialStress::Profiles(profiles) => [0, 1, 2, 3].map(|c| profiles[c].at(at[1])),
            InitialStress::AtRest(at_rest) => {
                let [total, pore] = self.on_a_plane(number, at);
                let vertical = (total - pore).max(0.0);
                let horizontal = at_rest.ratio.horizontal(vertical, at[1]);
                [-horizontal, -vertical, -horizontal, 0.0]
            }
        })
    }

    /// Total vertical stress at a point of a group at rest (weight above it and surcharge), and its pore pressure;
    /// compression positive, kPa.
    pub(crate) fn on_a_plane(&self, number: usize, at: [f64; 2]) -> [f64; 2] {
        let columns = self.columns.as_ref();
        let own = self.surcharges[number];
        let is_carried = || self.surcharges.iter().any(Option::is_some);
        let from_above = || {
            let columns = columns.filter(|_| is_carried())?;
            columns.nearest_above(at, |group| self.surcharges[group])
        };
        let surcharge = own.or_else(from_above);
        let has_water = self.groups[number].pore_water;
        let water = self.water.filter(|_| has_water);
        [
            columns.map_or(0.0, |columns| columns.above(at)) + surcharge.unwrap_or(0.0),
            water.map_or(0.0, |water| water.pressure(at)),
        ]
    }

    /// Stress of the ground around a joint of group `number` at a point of it: the mean of the sides that have one. It
    /// is effective if there is water between the faces, else total. `faces`: the nodes in the middle of its two faces.
    pub(crate) fn beside(&self, number: usize, faces: [usize; 2], at: [f64; 2]) -> [f64; 4] {
        let has_water = |group: usize| self.groups[group].pore_water;
        let pressure = self.water.map_or(0.0, |water| water.pressure(at));
        self.mean_of_sides(faces, at, |side| {
            match (has_water(side), has_water(number)) {
                (true, false) => -pressure,
                (false, true) => pressure,
                _ => 0.0,
            }
        })
    }

    /// Mean of the stresses on those sides of a joint that have one, each with a normal stress added by its group.
    fn mean_of_sides(
        &self,
        faces: [usize; 2],
        at: [f64; 2],
        excess: impl Fn(usize) -> f64,
    ) -> [f64; 4] {
        let of_side = |face: &usize| {
            let solid = &self.mesh.solids[*self.beside.get(face)?];
            let inside = self.mesh.towards_middle(solid, at, INSIDE);
            let mut stress = self.at(solid.group, inside)?;
            let excess = excess(solid.group);
            stress[..3].iter_mut().for_each(|normal| *normal += excess);
            Some(stress)
        };
        let sides: Vec<[f64; 4]> = faces.iter().filter_map(of_side).collect();
        let n = sides.len().max(1) as f64;
        std::array::from_fn(|c| sides.iter().map(|side| side[c]).sum::<f64>() / n)
    }
}

/// Element at each face of every joint, by the node in the face's middle.
pub(crate) fn beside_joints(mesh: &Mesh) -> HashMap<usize, usize> {
    let joints = mesh.joints.iter();
    let mut beside: HashMap<usize, Option<usize>> = joints
        .flat_map(|joint| [(joint.minus[2], None), (joint.plus[2], None)])
        .collect();
    for (number, solid) in mesh.solids.iter().enumerate() {
        for [_, _, middle] in solid.edges() {
            if let Some(of) = beside.get_mut(&middle) {
                of.get_or_insert(number);
            }
        }
    }
    let found = beside.into_iter();
    found
        .filter_map(|(middle, of)| Some((middle, of?)))
        .collect()
}
