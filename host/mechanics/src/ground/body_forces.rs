//! Weights and pore pressures within a phase, group by group, as they are among the loads.

use super::Loading;
use crate::group::Group;
use crate::problem::{Problem, Water};

/// Body forces at one time: a part of the way between two loadings, each with its active groups.
#[derive(Clone, Debug, Default)]
pub struct Acting {
    start: Loading,
    end: Loading,
    share: f64,
    /// The water of either loading.
    water: [Option<Water>; 2],
}

impl Acting {
    /// Before the first phase.
    pub(crate) fn before(problem: &Problem) -> Self {
        let start = Loading::before(problem);
        Self::between(problem, start.clone(), start, 1.0)
    }

    /// On the way from one loading to another.
    pub(crate) fn between(problem: &Problem, start: Loading, end: Loading, share: f64) -> Self {
        Self {
            water: [start.water(problem), end.water(problem)],
            start,
            end,
            share,
        }
    }

    /// The two loadings, each with its share.
    pub fn parts(&self) -> [(&Loading, f64); 2] {
        [(&self.start, 1.0 - self.share), (&self.end, self.share)]
    }

    /// Nodal forces of a group's weight, by degree of freedom, kN (upward positive).
    pub fn weight_of(&self, number: usize, problem: &Problem, group: &Group) -> Vec<f64> {
        self.forces(problem, |loading, force| {
            let water = loading.water(problem);
            loading.add_weight_of(problem, (number, group), None, water.as_ref(), force);
        })
    }

    /// Nodal forces of the hydrostatic pressure in a group's pores, by degree of freedom, kN: what has to
    /// be taken from those of its effective stresses to have those of its total ones.
    pub fn pore_forces_of(&self, number: usize, problem: &Problem, group: &Group) -> Vec<f64> {
        self.forces(problem, |loading, force| {
            let fills = loading.active[number] && problem.groups[number].pore_water;
            if let Some(water) = loading.water(problem).filter(|_| fills) {
                group.add_pore_forces(&water, None, force);
            }
        })
    }

    /// Hydrostatic pressure in a group's pores at a place, compression positive, kPa.
    pub fn pore_pressure(&self, number: usize, problem: &Problem, at: [f64; 2]) -> f64 {
        if !problem.groups[number].pore_water {
            return 0.0;
        }
        let of = |((loading, share), water): ((&Loading, f64), &Option<Water>)| {
            let water = water.as_ref().filter(|_| loading.active[number]);
            share * water.map_or(0.0, |water| water.pressure(at))
        };
        self.parts().into_iter().zip(&self.water).map(of).sum()
    }

    /// Nodal forces of weight and pore water in group `number`, or in some of its elements, by degree of
    /// freedom; `None` if there is neither. Other forces balance the rest of its stresses.
    pub fn in_bodies(
        &self,
        problem: &Problem,
        (number, group): (usize, &Group),
        elements: Option<&[usize]>,
    ) -> Option<Vec<f64>> {
        let loadings = self.parts().into_iter().map(|(loading, _)| loading);
        let mut acting = loadings.filter(|loading| loading.acts_in(number, problem));
        acting.next()?;
        Some(self.forces(problem, |loading, force| {
            loading.add_bodies(problem, (number, group), elements, force);
        }))
    }

    /// Nodal forces of what acts on lines and, as water, on the outline, by degree of freedom, kN.
    pub fn on_outline(&self, problem: &Problem) -> Vec<f64> {
        self.forces(problem, |loading, force| {
            loading.add_outline(problem, force);
        })
    }

    fn forces(&self, problem: &Problem, add: impl Fn(&Loading, &mut [f64])) -> Vec<f64> {
        let n = 2 * problem.mesh.nodes.len();
        let mut sum = vec![0.0; n];
        for (loading, share) in self.parts().into_iter().filter(|(_, share)| *share != 0.0) {
            let mut force = vec![0.0; n];
            add(loading, &mut force);
            sum.iter_mut()
                .zip(force)
                .for_each(|(sum, force)| *sum += share * force);
        }
        sum
    }
}
