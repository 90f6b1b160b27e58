//! Steps along the path of equilibrium whose load factor is unknown: arc-length control.
//!
//! Where some points soften faster than the rest of the model unloads, there is no equilibrium at
//! the next load. The path turns back in load and in displacement (a snap-back), but the
//! deformation of those points goes on. So a step is measured by that,
//!
//! - c·Δu = s, c = Σ ∫ Bᵀ Δε₀ dV / ‖Δε₀‖ (of interfaces ∫ Bᵀ Δ⟦u⟧₀ dA)
//!
//! with Δε₀ the strain increments, of interfaces the jump increments, of the non-linear groups in
//! the last step: a local, linear arc length (Riks 1979; de Borst 1987; Geers 1999). It is blind to
//! motions of a body as a whole. The load factor is the unknown that goes with it,
//!
//! - K δ_r = r, K δ_q = q = dr/dλ (prescribed displacements included, also in δ_q), dλ = (s − c·(Δu + δ_r)) / c·δ_q, δ = δ_r + dλ δ_q.

use super::{Iteration, Iterations, Loads, Newton, Reason, StepFailure, StepSuccess, Task};
use crate::assembly::Places;
use crate::group::Group;
use crate::problem::Formulation;

/// Lengths of a correction that are tried, in order.
const STEP_LENGTHS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// What a step along the path is measured by: c.
#[derive(Debug)]
pub struct Measure {
    weights: Vec<f64>,
}

impl Measure {
    /// That of the direction of a step, given by its displacement increments (by place). `None` if no non-linear group has deformed. Interfaces alone count if there are
    /// any: their jumps, in metres, cannot be added to strains.
    pub fn new(groups: &[Group], places: &Places, increment: &[f64]) -> Option<Self> {
        let is_interface = |group: &&Group| group.formulation != Formulation::Solid;
        let nonlinear = || groups.iter().filter(|group| !group.is_linear());
        let any_interface = nonlinear().any(|group| is_interface(&group));
        let mut displacement = vec![0.0; places.n_dofs()];
        places.scatter(increment, &mut displacement);
        let mut weights = vec![0.0; places.n_dofs()];
        let mut square = 0.0;
        for group in nonlinear().filter(|group| is_interface(group) == any_interface) {
            let mut strains = vec![0.0; group.strain.committed.len()];
            group.kinematics.add_gradients(&displacement, &mut strains);
            let n = group.kinematics.n_components();
            for (point, strain) in strains.chunks_exact_mut(n).enumerate() {
                let weight = group.kinematics.weight(point);
                if let Some(thickness) = group.thickness(point) {
                    // Strains across the layer times its thickness are its jumps.
                    strain[0] = 0.0;
                    strain[2] = 0.0;
                    // The weight is a volume: jumps² dA = t e² dV.
                    square += weight * thickness * strain.iter().map(|e| e * e).sum::<f64>();
                    for e in strain.iter_mut() {
                        *e *= thickness;
                    }
                } else {
                    square += weight * strain.iter().map(|e| e * e).sum::<f64>();
                }
            }
            group.kinematics.add_forces(&strains, &mut weights);
        }
        let size = square.sqrt();
        let mut weights = places.take(&mut weights);
        (size > 0.0).then(|| {
            for weight in &mut weights {
                *weight /= size;
            }
            Self { weights }
        })
    }

    /// c·Δu.
    pub fn of(&self, increment: &[f64]) -> f64 {
        self.weights.iter().zip(increment).map(|(c, u)| c * u).sum()
    }
}

impl Newton<'_> {
    /// Seeks equilibrium at this distance along the path from load factor `from`, starting from a
    /// guess of the displacement increments and of the load factor's. Returns the load factor too.
    ///
    /// # Errors
    /// No equilibrium within the allowed iterations, or a law or the equations failed.
    pub fn step_along(
        &mut self,
        loads: &Loads,
        [from, time]: [f64; 2],
        (measure, distance): (&Measure, f64),
        guess: (Vec<f64>, f64),
    ) -> Result<(StepSuccess, f64), StepFailure> {
        self.set_out(loads);
        let mut iterations = Vec::new();
        let outcome = self.iterate_along(
            loads,
            [from, time],
            (measure, distance),
            guess,
            &mut iterations,
        );
        outcome.map_err(|failure| self.explained(failure, iterations, from, (time + from, 0.0)))
    }

    fn iterate_along(
        &mut self,
        loads: &Loads,
        [from, time]: [f64; 2],
        (measure, distance): (&Measure, f64),
        (mut increment, mut rise): (Vec<f64>, f64),
        iterations: &mut Vec<Iteration>,
    ) -> Result<(StepSuccess, f64), StepFailure> {
        let rate = self.places.gather(&loads.prescribed_rate());
        let right = self.load_rate(loads);
        self.starts_from(&increment, false);
        let mut balance = self.evaluate_along(loads, &rate, [from, time], &mut increment, rise)?;
        iterations.push(Iteration::first(&balance));
        for _ in 0..self.settings.max_iterations() {
            self.may_go_on()?;
            let external = loads.external(from + rise);
            let task = Task {
                external: &self.places.gather(&external),
                imposed: self.imposed(&external),
                prescribed: &scaled(&rate, rise),
                period: (time + from, rise.abs()),
            };
            self.prepare(&increment, &task)?;
            let of_residual = self.solve(&balance.residual, None)?;
            let mut of_load = self.solve(&right, Some(&rate))?;
            for (value, rate) in of_load.iter_mut().zip(&rate) {
                *value += rate;
            }
            self.places.follow(&mut of_load);
            let missing = distance - measure.of(&increment) - measure.of(&of_residual);
            let more = missing / measure.of(&of_load);
            if !more.is_finite() {
                return Err(Reason::LoadMovesNothing.into());
            }
            let correction: Vec<f64> = of_residual
                .iter()
                .zip(&of_load)
                .map(|(r, q)| r + more * q)
                .collect();
            // As far as the residual does not grow; never less than the shortest length.
            let tries = if self.settings.line_search {
                STEP_LENGTHS.len()
            } else {
                1
            };
            let mut lengths = STEP_LENGTHS[..tries].iter().copied().peekable();
            let length = loop {
                let Some(length) = lengths.next() else {
                    return Err(Reason::PathEnds.into());
                };
                self.may_go_on()?;
                let moved = increment.iter().zip(&correction);
                let mut moved: Vec<f64> = moved.map(|(u, d)| u + length * d).collect();
                let risen = rise + length * more;
                let is_last = lengths.peek().is_none();
                match self.evaluate_along(loads, &rate, [from, time], &mut moved, risen) {
                    Ok(at) if is_last || at.relative <= balance.relative => {
                        (increment, balance, rise) = (moved, at, risen);
                        break length;
                    }
                    Err(failure) if is_last => return Err(failure),
                    _ => {}
                }
            };
            let last = self.took(&balance, &correction, &increment, length);
            iterations.push(last);
            let is_there = (measure.of(&increment) - distance).abs() <= 1e-6 * distance.abs();
            if is_there && self.is_equilibrium(&balance, &last) {
                let success = StepSuccess {
                    increment,
                    iterations: std::mem::take(iterations),
                    unreliable: balance.unreliable,
                    relaxed: false,
                    round_off: 0.0,
                    scales: balance.scales,
                };
                return Ok((success, from + rise));
            }
        }
        let correction = iterations.last().and_then(|last| last.correction);
        let n = self.settings.max_iterations();
        Err(Reason::Unmet(Iterations::Path(n), self.unmet(&balance, correction)).into())
    }

    /// As [`Self::evaluate`] at a load factor, which sets the prescribed displacements.
    fn evaluate_along(
        &mut self,
        loads: &Loads,
        rate: &[f64],
        [from, time]: [f64; 2],
        increment: &mut [f64],
        rise: f64,
    ) -> Result<super::Balance, StepFailure> {
        let external = loads.external(from + rise);
        for &place in &self.places.prescribed {
            increment[place] = rise * rate[place];
        }
        self.places.follow(increment);
        if let Some(domain) = self.domain {
            self.domain_forces = domain.forces_at(from + rise);
        }
        let task = Task {
            external: &self.places.gather(&external),
            imposed: self.imposed(&external),
            prescribed: &scaled(rate, rise),
            period: (time + from, rise.abs()),
        };
        let operator = self.operator();
        self.evaluate(increment, &task, operator)
            .map_err(StepFailure::from)
    }

    /// Change of the residual with the load factor at constant displacements, by equation; without
    /// that of prescribed displacements in the groups that iterate.
    fn load_rate(&self, loads: &Loads) -> Vec<f64> {
        let mut rate = self.places.gather(&loads.external_rate());
        if let Some(domain) = self.domain {
            let boundary = self.places.boundary.iter();
            for (&place, force) in boundary.zip(domain.load_rate()) {
                rate[place] += force;
            }
        }
        self.places.free.iter().map(|&place| rate[place]).collect()
    }
}

/// Increments at this rate.
fn scaled(rate: &[f64], rise: f64) -> Vec<f64> {
    rate.iter().map(|rate| rise * rate).collect()
}
