//! Steps along the path of equilibrium whose load factor is unknown: arc-length control.
//!
//! If some points soften faster than the rest of the model unloads, there is no equilibrium at
//! the next load. The path turns back in load and in displacement (a snap-back), but the
//! deformation of those points goes on. So a step is measured by that,
//!
//! - c·Δu = s, c = Σ ∫ Bᵀ Δε₀ dV / ‖Δε₀‖ (of interfaces ∫ Bᵀ Δ⟦u⟧₀ dA)
//!
//! with Δε₀ the strain increments, of interfaces the jump increments, of the non-linear groups in
//! the last step: a local, linear arc length (Riks 1979; de Borst 1987; Geers 1999). It is blind to
//! motions of a body as a whole. The load factor is the unknown that goes with it,
//!
//! - K δ_r = r, K δ_q = q = dr/dλ (prescribed displacements included, also in δ_q), dλ = (s − c·(Δu + δ_r)) / c·δ_q,
//!   δ = δ_r + dλ δ_q.

use super::{Clock, STEP_LENGTHS};
use crate::assembly::Places;
use crate::equilibrium::newton::{
    Control, Correction, Iteration, Iterations, LineSearch, Loads, Newton, Otherwise, Reason,
    State, StepFailure, Task,
};
use crate::group::Group;
use crate::problem::Formulation;
use law::Operator;

/// How far from its distance a state may be, relative to it.
const THERE: f64 = 1e-6;

/// The vector c that measures a step along the path.
#[derive(Debug)]
pub struct Measure {
    weights: Vec<f64>,
}

impl Measure {
    /// That of the direction of a step, given by its displacement increments (by place). `None` if no non-linear group
    /// has deformed. Interfaces alone count if there are any: their jumps, in metres, cannot be added to strains.
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

/// A step to a given distance along the path.
#[derive(Debug)]
pub(super) struct ArcLength<'c> {
    loads: &'c Loads,
    measure: &'c Measure,
    distance: f64,
    /// Load factor at the start, and the time of the phase.
    from: f64,
    clock: Clock,
    /// Displacement increments and increment of the load factor to start from.
    guess: (Vec<f64>, f64),
    /// Change of the prescribed displacements with the load factor, by place.
    rate: Vec<f64>,
    /// Change of the residual with it, by equation.
    right: Vec<f64>,
}

impl<'c> ArcLength<'c> {
    /// A step of this distance from load factor `from`.
    pub(super) fn new(
        newton: &Newton<'_>,
        loads: &'c Loads,
        (from, clock): (f64, Clock),
        (measure, distance): (&'c Measure, f64),
        guess: (Vec<f64>, f64),
    ) -> Self {
        Self {
            loads,
            measure,
            distance,
            from,
            clock,
            guess,
            rate: newton.equations.places.gather(&loads.prescribed_rate()),
            right: load_rate(newton, loads),
        }
    }

    /// References of an iterate at this increment of the load factor.
    fn task(&self, newton: &Newton<'_>, rise: f64) -> Task {
        let external = self.loads.external(self.from + rise);
        let prescribed = self.rate.iter().map(|rate| rise * rate).collect();
        newton.task(&external, prescribed, self.clock.period(self.from, rise))
    }

    /// δ and dλ, with the matrix there is.
    fn correction(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
    ) -> Result<Correction, StepFailure> {
        let of_residual = newton.solve(&state.balance.residual, None)?;
        let of_load = newton.answer_to(&self.right, &self.rate)?;
        let measure = self.measure;
        let missing = self.distance - measure.of(&state.increment) - measure.of(&of_residual);
        let rise = missing / measure.of(&of_load);
        if !rise.is_finite() {
            return Err(Reason::LoadMovesNothing.into());
        }
        let pairs = of_residual.iter().zip(&of_load);
        Ok(Correction {
            increment: pairs.map(|(r, q)| r + rise * q).collect(),
            rise,
        })
    }
}

impl Control for ArcLength<'_> {
    fn predict(&mut self, newton: &mut Newton<'_>) -> Result<State, StepFailure> {
        let guess = std::mem::take(&mut self.guess);
        newton.starts_from(&guess.0, false);
        let operator = newton.operator();
        self.evaluate(newton, guess, operator)
    }

    /// The load factor sets the prescribed displacements.
    fn evaluate(
        &self,
        newton: &mut Newton<'_>,
        (increment, rise): (Vec<f64>, f64),
        operator: Operator,
    ) -> Result<State, StepFailure> {
        let task = self.task(newton, rise);
        let increment = newton.completed(increment, &task.prescribed);
        newton.take_domain_forces(self.from + rise);
        newton.state_at(increment, rise, (&task, operator))
    }

    /// The distance is held only by a correction: no guess is accepted without one.
    fn accept(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> Option<f64> {
        let last = iterations.last().filter(|last| last.correction.is_some())?;
        let off = (self.measure.of(&state.increment) - self.distance).abs();
        let is_there = off <= THERE * self.distance.abs();
        (is_there && newton.is_equilibrium(&state.balance, last)).then_some(0.0)
    }

    fn correct(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        let task = self.task(newton, state.rise);
        newton.prepare(&state.increment, &task)?;
        let correction = self.correction(newton, state)?;
        let (taken, next) = newton.search(self, state, &correction, false)?;
        iterations.push(taken);
        Ok(next)
    }

    /// As far as the residual does not grow, but never less than the shortest length: on its way
    /// round a turning point it has to.
    fn line_search(&self, _newton: &Newton<'_>, from: &State) -> LineSearch {
        LineSearch {
            lengths: &STEP_LENGTHS[..4],
            enough: from.balance.relative,
            otherwise: Otherwise::Shortest,
        }
    }

    fn give_up(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> StepFailure {
        let correction = iterations.last().and_then(|last| last.correction);
        let n = newton.settings.max_iterations();
        Reason::Unmet(
            Iterations::Path(n),
            newton.unmet(&state.balance, correction),
        )
        .into()
    }
}

/// Change of the residual with the load factor at constant displacements, by equation; without
/// that of prescribed displacements in the groups that iterate.
fn load_rate(newton: &Newton<'_>, loads: &Loads) -> Vec<f64> {
    let places = newton.equations.places;
    let mut rate = places.gather(&loads.external_rate());
    if let Some(domain) = newton.equations.domain {
        for (&place, force) in places.boundary.iter().zip(domain.load_rate()) {
            rate[place] += force;
        }
    }
    places.free.iter().map(|&place| rate[place]).collect()
}
