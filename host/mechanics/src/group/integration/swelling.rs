//! Stress-free strain of a group: heat, swelling, shrinkage.
//!
//! The strains ε of a group are those that its law sees, total strains less stress-free ones:
//!
//! - Δε = B Δu − Δε_0 (1)
//!
//! ε_0 changes in proportion to the phase's time along a leg of its course. It counts from when the group appeared.

use crate::group::{Field, Group};

/// The stress-free strain of a group.
#[derive(Debug)]
pub(in crate::group) struct Swelling {
    /// ε_0: components 11 22 33 in global axes, expansion positive.
    pub(in crate::group) strain: Field,
    /// Its change per share of the phase's time.
    rate: [f64; 3],
}

impl Group {
    /// Phases may give it a stress-free strain: its equations are not those of its law alone.
    pub(crate) fn may_swell(&mut self) {
        self.swelling = Some(Swelling {
            strain: Field::new(vec![0.0; 3]),
            rate: [0.0; 3],
        });
        if self.tangents.are_constant {
            self.tangents.are_constant = false;
            self.tangents.values = vec![0.0; 16 * self.kinematics.n_points()];
        }
    }

    /// Change of its stress-free strain per share of the phase's time from now on.
    pub(crate) fn swells_by(&mut self, rate: [f64; 3]) {
        if let Some(swelling) = &mut self.swelling {
            swelling.rate = rate;
        }
    }

    /// Stress-free strain since it appeared (committed): components 11 22 33 in global axes.
    pub fn stress_free_strain(&self) -> [f64; 3] {
        let swelling = self.swelling.as_ref();
        swelling.map_or([0.0; 3], |swelling| {
            std::array::from_fn(|c| swelling.strain.committed[c])
        })
    }

    /// Adds the nodal forces that a stress-free strain calls forth if it is held, by the law's elastic operator.
    pub(crate) fn add_held(&self, strain: [f64; 3], force: &mut [f64]) {
        if strain.iter().all(|strain| *strain == 0.0) {
            return;
        }
        let [e_11, e_22, e_33] = strain;
        let mut flux = Vec::with_capacity(4 * self.kinematics.n_points());
        for point in 0..self.kinematics.n_points() {
            // A layer with an interface law has no operator of this size.
            let Some(operator) = self.elastic_operator(point) else {
                return;
            };
            let axes = self.kinematics.axes_at(point);
            let [a, b, c, half_gamma] = axes.stress_from_global([e_11, e_22, e_33, 0.0]);
            let own = [a, b, c, 2.0 * half_gamma];
            let rows = operator.chunks_exact(4);
            flux.extend(rows.map(|row| row.iter().zip(own).map(|(d, e)| d * e).sum::<f64>()));
        }
        self.kinematics.add_forces(&flux, force);
    }

    /// Takes the stress-free strain out of the strains of the trial state, (1).
    pub(in crate::group) fn swell(&mut self, time_increment: f64) {
        let Some(swelling) = &mut self.swelling else {
            return;
        };
        let share = time_increment / self.moment.step_length;
        let change = swelling.rate.map(|rate| share * rate);
        let now = swelling.strain.committed.iter().zip(change);
        swelling.strain.trial = now.map(|(strain, change)| strain + change).collect();
        if change.iter().all(|change| *change == 0.0) {
            return;
        }
        let [e_11, e_22, e_33] = change;
        for element in 0..self.kinematics.n_elements() {
            let axes = self.kinematics.axes(element);
            let [a, b, c, half_gamma] = axes.stress_from_global([e_11, e_22, e_33, 0.0]);
            for point in self.kinematics.points_of(element) {
                let own = &mut self.strain.trial[4 * point..4 * point + 4];
                let free = [a, b, c, 2.0 * half_gamma];
                own.iter_mut()
                    .zip(free)
                    .for_each(|(own, free)| *own -= free);
            }
        }
    }

    /// Change of the stress-free volume strain in the trial state: pore water sees the total strain.
    pub(in crate::group) fn swollen(&self) -> f64 {
        let Some(Swelling { strain, .. }) = &self.swelling else {
            return 0.0;
        };
        let both = strain.trial.iter().zip(&strain.committed);
        both.map(|(now, before)| now - before).sum()
    }
}
