//! What results and other groups read of a group: stresses and strains in global axes, nodal forces, jumps and
//! tractions.

use super::Group;
use crate::problem::Formulation;

impl Group {
    /// Thickness at a point of a thin layer.
    pub fn thickness(&self, point: usize) -> Option<f64> {
        self.layer.as_ref().map(|layer| layer.thickness_at(point))
    }

    /// Stress of a point in global axes (committed); `None` for zero-thickness elements.
    pub fn global_stress(&self, point: usize) -> Option<[f64; 4]> {
        let s = self.stress.committed.get(4 * point..4 * point + 4)?;
        let axes = self.kinematics.axes(self.kinematics.place_of(point).0);
        (self.kinematics.n_components() == 4)
            .then(|| axes.stress_to_global([s[0], s[1], s[2], s[3]]))
    }

    /// Stress of an element at a place in it or next to it, in global axes (committed): the plane
    /// that is nearest to the stresses at its points.
    pub fn carried_at(&self, element: usize, at: [f64; 2]) -> [f64; 4] {
        let (points, axes) = (
            self.kinematics.points_of(element),
            self.kinematics.axes(element),
        );
        let carried = self.carried();
        let n = points.len() as f64;
        let mut middle = [0.0; 2];
        let mut mean = [0.0; 4];
        let global = |point: usize| {
            let s = &carried[4 * point..4 * point + 4];
            axes.stress_to_global([s[0], s[1], s[2], s[3]])
        };
        for point in points.clone() {
            let (place, stress) = (self.kinematics.position(point), global(point));
            (0..2).for_each(|c| middle[c] += place[c] / n);
            (0..4).for_each(|c| mean[c] += stress[c] / n);
        }
        let arm = |place: [f64; 2]| [place[0] - middle[0], place[1] - middle[1]];
        // Normal equations of the slopes.
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut with = [[0.0; 2]; 4];
        for point in points {
            let ([x, y], stress) = (arm(self.kinematics.position(point)), global(point));
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
            for c in 0..4 {
                with[c][0] += x * (stress[c] - mean[c]);
                with[c][1] += y * (stress[c] - mean[c]);
            }
        }
        let determinant = xx * yy - xy * xy;
        let [x, y] = arm(at);
        std::array::from_fn(|c| {
            if determinant <= 0.0 {
                return mean[c];
            }
            let [a, b] = with[c];
            mean[c] + (x * (yy * a - xy * b) + y * (xx * b - xy * a)) / determinant
        })
    }

    /// Strain of a point in global axes (committed), stress-free strain included, γ = 2ε; `None` for zero-thickness elements.
    pub fn global_strain(&self, point: usize) -> Option<[f64; 4]> {
        let e = self.strain.committed.get(4 * point..4 * point + 4)?;
        let axes = self.kinematics.axes(self.kinematics.place_of(point).0);
        (self.kinematics.n_components() == 4).then(|| {
            let [e_11, e_22, e_33, e_12] = axes.stress_to_global([e[0], e[1], e[2], e[3] / 2.0]);
            let [f_11, f_22, f_33] = self.stress_free_strain();
            [e_11 + f_11, e_22 + f_22, e_33 + f_33, 2.0 * e_12]
        })
    }

    /// An internal variable of a point (committed); `None` if the law has no variable of this id.
    pub fn internal_variable(&self, point: usize, id: &str) -> Option<f64> {
        let variables = &self.law.built.law.formulation().internal_variables;
        let number = variables.iter().position(|variable| variable.id == id)?;
        self.internal
            .committed
            .get(point * variables.len() + number)
            .copied()
    }

    /// Nodal forces of this group's elements (committed), by degree of freedom.
    pub fn forces(&self, n_dofs: usize) -> Vec<f64> {
        let mut force = vec![0.0; n_dofs];
        self.kinematics.add_forces(&self.carried(), &mut force);
        force
    }

    /// Nodal forces of some of this group's elements (committed), by degree of freedom.
    pub fn forces_of(&self, elements: &[usize], n_dofs: usize) -> Vec<f64> {
        let carried = self.carried();
        let mut force = vec![0.0; n_dofs];
        if let Some(few) = self.kinematics.only(elements) {
            let own = self.places(elements).flat_map(|own| &carried[own]);
            few.add_forces(&own.copied().collect::<Vec<f64>>(), &mut force);
            return force;
        }
        let mut stress = vec![0.0; carried.len()];
        for own in self.places(elements) {
            stress[own.clone()].copy_from_slice(&carried[own]);
        }
        self.kinematics.add_forces(&stress, &mut force);
        force
    }

    /// Force that some of this group's zero-thickness elements exert on the side of smaller coordinates
    /// (committed), kN. At an end that is not doubled the nodal forces of both sides cancel; the
    /// tractions do not.
    pub fn handed_on(&self, elements: &[usize], component: usize) -> f64 {
        let carried = self.carried();
        let of_point = |point: usize| {
            let axes = self.kinematics.axes_at(point);
            let [normal, tangential] = [0, 1].map(|c| carried[2 * point + c]);
            let traction = axes.across[component] * normal + axes.along[component] * tangential;
            self.kinematics.weight(point) * traction
        };
        let of_element = |&element: &usize| {
            self.kinematics
                .points_of(element)
                .map(of_point)
                .sum::<f64>()
        };
        -elements.iter().map(of_element).sum::<f64>()
    }

    /// Jump and traction (normal, tangential) of a point of a thin layer or zero-thickness
    /// element (committed); `None` for solids.
    pub fn jump_and_traction(&self, point: usize) -> Option<([f64; 2], [f64; 2])> {
        match self.formulation {
            Formulation::Solid => None,
            Formulation::ZeroThickness => {
                let pair = |values: &[f64]| [values[2 * point], values[2 * point + 1]];
                Some((pair(&self.strain.committed), pair(&self.stress.committed)))
            }
            Formulation::ThinLayer => {
                let layer = self.layer.as_ref()?;
                let pair = |values: &[f64]| [values[4 * point + 1], values[4 * point + 3]];
                let jump = if self.uses_layer() {
                    [
                        layer.jump.committed[2 * point],
                        layer.jump.committed[2 * point + 1],
                    ]
                } else {
                    pair(&self.strain.committed).map(|strain| strain * layer.thickness_at(point))
                };
                Some((jump, pair(&self.stress.committed)))
            }
        }
    }
}
