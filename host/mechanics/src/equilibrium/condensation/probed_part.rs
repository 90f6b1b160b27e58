//! The part of a domain that results look at, and its state in equilibrium with the boundary.

use super::probed_elements::Excerpt;
use super::{CheckedPoints, LinearDomain, Origin, Standing};
use crate::equilibrium::newton::{
    ACCEPTED_ROUND_OFF, DomainFailure, Loads, STILL_SMALL, last_bit_scattered, norm,
};
use crate::group::{Committed, Group};
use law::Operator;

/// Corrections of a complete state, at most.
const REFINEMENTS: usize = 3;
/// A complete state whose residual is within this of the tolerance is not corrected at all.
const REFINED: f64 = 0.1;

/// Some groups of a domain, with what gives their displacements.
#[derive(Debug)]
pub(super) struct Part {
    /// For every group of the model, whether it belongs to the part.
    pub(super) groups: Vec<bool>,
    /// Elements of others.
    pub(super) excerpts: Vec<Excerpt>,
    /// What was asked for: groups, and elements of others.
    asked: (Vec<bool>, Vec<Vec<usize>>),
    /// Degrees of freedom of their elements, ascending.
    dofs: Vec<usize>,
    /// Equations of their unknowns and of others that are wanted.
    wanted: Vec<usize>,
    /// Their places in the factors.
    places: Vec<u32>,
    /// Equations inside the domain of which no other group of the domain takes part.
    inner: Vec<usize>,
    /// Supernodes of the wanted equations, and those above them.
    fronts: Vec<bool>,
}

/// Displacement increments since both of them, by degree of freedom, as far as groups count from
/// there.
#[derive(Debug)]
struct Since {
    complete: Option<Vec<f64>>,
    latest: Option<Vec<f64>>,
}

impl Since {
    /// The same increments since both of them, as far as there are any.
    fn with(&self, increment: Vec<f64>) -> Self {
        Self {
            complete: self.complete.is_some().then(|| increment.clone()),
            latest: self.latest.is_some().then_some(increment),
        }
    }

    /// The largest of them.
    fn largest(&self) -> f64 {
        let each = self.complete.iter().chain(&self.latest);
        each.fold(0.0, |most: f64, increment| {
            most.max(algebra::largest(increment))
        })
    }
}

/// A state to be reached.
#[derive(Debug)]
pub(super) struct Goal<'g> {
    pub(super) loads: &'g Loads,
    pub(super) lambda: f64,
    pub(super) tolerance: f64,
}

impl Part {
    fn is_asked_for(&self, groups: &[bool], elements: &[Vec<usize>]) -> bool {
        self.asked.0 == groups && self.asked.1 == elements
    }
}

/// Share of ε ‖diag K_bb‖ u that rounding of a motion u of the boundary leaves of forces there: 0.35 to 0.5 in six
/// chambers, up to 1.1 in those with a toe of tiny elements.
const ROUNDED: f64 = 0.5;

impl LinearDomain {
    /// What rounding of the motion since the complete state leaves of forces on the boundary (2-norm), about.
    pub(super) fn rounded(&self) -> f64 {
        let moved = algebra::largest(&self.standing.complete.moved);
        ROUNDED * f64::EPSILON * self.diagonal_kept * moved
    }

    /// Whether a part is looked at, which is there from then on: not if it is all of the domain, or another
    /// one than that which the latest state is of.
    pub(super) fn choose_part(
        &mut self,
        looked_at: Option<CheckedPoints<'_>>,
        of_model: &[Group],
    ) -> bool {
        let Some(CheckedPoints {
            groups: looked,
            elements,
            dofs,
        }) = looked_at
        else {
            return false;
        };
        let of_latest = |part: &Part, standing: &Standing| {
            let groups = standing.part.as_ref();
            groups.is_none_or(|groups| part.groups == *groups && part.is_ahead(standing))
        };
        let known = self
            .part
            .as_ref()
            .filter(|part| part.is_asked_for(looked, elements))
            .filter(|part| part.excerpts.is_empty() || !self.standing.as_groups);
        if known.is_some_and(|part| of_latest(part, &self.standing)) {
            return true;
        }
        let mut groups = looked.to_vec();
        let mut excerpts = Vec::new();
        for (number, elements) in elements.iter().enumerate() {
            let is_other = !groups[number] && !elements.is_empty() && self.system.includes(number);
            if is_other {
                let excerpt = Excerpt::new(number, &of_model[number], elements);
                let excerpt = excerpt.filter(|_| !self.standing.as_groups);
                groups[number] = excerpt.is_none();
                excerpts.extend(excerpt);
            }
        }
        let mut numbered = groups.iter().enumerate();
        let others = numbered.any(|(number, in_part)| !in_part && self.system.includes(number));
        let part = others.then(|| self.of_groups(&groups, excerpts, dofs));
        self.part = part.filter(|part| of_latest(part, &self.standing));
        if let Some(part) = &mut self.part {
            part.asked = (looked.to_vec(), elements.to_vec());
        }
        self.part.is_some()
    }

    pub(super) fn of_groups(
        &self,
        groups: &[bool],
        excerpts: Vec<Excerpt>,
        dofs: &[usize],
    ) -> Part {
        let mut of_elements = vec![false; self.system.n_dofs()];
        let mut wanted = vec![false; self.system.n_equations()];
        let mut shared = vec![false; self.system.n_equations()];
        for (number, in_part) in groups.iter().enumerate() {
            let mark = if *in_part { &mut wanted } else { &mut shared };
            for dof in self.system.dofs_of(number) {
                of_elements[dof] |= *in_part;
                if let Some(equation) = self.system.equation(dof) {
                    mark[equation] = true;
                }
            }
        }
        let own = |&equation: &usize| {
            let is_inside = !self.on_boundary[equation] && !self.is_held[equation];
            wanted[equation] && !shared[equation] && is_inside
        };
        let inner = (0..wanted.len()).filter(own).collect();
        for dof in excerpts.iter().flat_map(Excerpt::dofs) {
            of_elements[dof] = true;
        }
        let of_excerpts = excerpts.iter().flat_map(Excerpt::dofs);
        let known = dofs.iter().copied().chain(of_excerpts);
        let known = known.flat_map(|dof| self.system.masters(dof));
        for equation in known.filter_map(|dof| self.system.equation(dof)) {
            wanted[equation] = true;
        }
        // Displacements that are prescribed are known.
        for (wanted, is_held) in wanted.iter_mut().zip(&self.is_held) {
            *wanted &= !is_held;
        }
        let fronts = self.factors.fronts_of(&wanted);
        let wanted: Vec<usize> = (0..wanted.len()).filter(|&e| wanted[e]).collect();
        let places = self.factors.places();
        Part {
            groups: groups.to_vec(),
            excerpts,
            asked: Default::default(),
            inner,
            fronts,
            places: wanted.iter().map(|&equation| places[equation]).collect(),
            wanted,
            dofs: (0..of_elements.len())
                .filter(|&dof| of_elements[dof])
                .collect(),
        }
    }

    /// Brings a part into a trial state in equilibrium with its goal and the positions of the boundary. Fills in
    /// displacements. Returns internal forces and displacement increments: since the latest state if the part is in
    /// that one, else since the complete one.
    pub(super) fn settle(
        &mut self,
        part: &Part,
        groups: &mut [Group],
        goal: &Goal<'_>,
        displacement: &mut [f64],
    ) -> Result<(Vec<f64>, Vec<f64>), DomainFailure> {
        let increment =
            |origin: &Origin, part: &Part| self.increment(origin, part, goal.lambda, displacement);
        let Standing {
            complete, latest, ..
        } = &self.standing;
        let is_looked_at = self.of_latest(part);
        // Only groups of the part that was looked at count from the latest state.
        let known = self.part.as_ref().filter(|known| self.of_latest(known));
        let of_latest = known.unwrap_or(part);
        let mut since = Since {
            complete: (!is_looked_at).then(|| increment(complete, part)),
            latest: (self.standing.part.as_ref()).map(|_| increment(latest, of_latest)),
        };
        let mut committed = None;
        let reached = self.balance(part, groups, goal, &mut since, &mut committed);
        if reached.is_err() {
            for (number, committed) in committed.into_iter().flatten() {
                groups[number].restore_committed(committed);
            }
        }
        let (relative, internal) = reached?;
        let (origin, increment) = match (since.complete, since.latest) {
            (None, Some(increment)) => (latest, increment),
            (increment, _) => (complete, increment.ok_or(DomainFailure::NoState)?),
        };
        for &equation in &part.wanted {
            let dof = self.system.free()[equation];
            displacement[dof] = origin.displacement[dof] + increment[dof];
        }
        self.standing.round_off = self.standing.round_off.max(relative);
        Ok((internal, increment))
    }

    /// Brings a part's groups into a trial state in equilibrium with its goal, from a motion that corrections are added
    /// to. Returns the relative residual that had to be taken for round-off, and internal forces. A correction counts
    /// from the state that it corrects, since rounding of the whole motion would hide it; then the state that was
    /// `committed` before is handed out.
    fn balance(
        &self,
        part: &Part,
        groups: &mut [Group],
        goal: &Goal<'_>,
        total: &mut Since,
        committed: &mut Option<Vec<(usize, Committed)>>,
    ) -> Result<(f64, Vec<f64>), DomainFailure> {
        let free = self.system.free();
        let mut tries = 0..REFINEMENTS;
        let mut before = f64::INFINITY;
        let mut own: Option<Since> = None;
        loop {
            let since = own.as_ref().unwrap_or(total);
            let internal = self.evaluate(groups, since, part)?;
            let left = |&equation: &usize| {
                let dof = free[equation];
                goal.loads.external_at(dof, goal.lambda) - internal[dof]
            };
            let residual: Vec<f64> = part.inner.iter().map(left).collect();
            let forces: Vec<f64> = part.dofs.iter().map(|&dof| internal[dof]).collect();
            let scale = norm(&forces).max(goal.loads.scale);
            let scale = scale.max(f64::MIN_POSITIVE);
            let relative = norm(&residual) / scale;
            if relative <= REFINED * goal.tolerance {
                return Ok((0.0, internal));
            }
            // Substitution with the best of factors leaves as much; more is corrected, within the tolerance or not.
            let is_solved = relative * scale <= f64::EPSILON * self.diagonal * since.largest();
            if relative <= goal.tolerance && (before.is_finite() || is_solved) {
                return Ok((0.0, internal));
            }
            // A residual that no longer falls has come down to round-off.
            if relative > 0.5 * before || tries.next().is_none() {
                let last_bit = self.last_bit(part, groups, (since, total), &internal)? / scale;
                let is_round_off = relative <= ACCEPTED_ROUND_OFF * last_bit;
                if is_round_off && relative <= STILL_SMALL {
                    return Ok((relative, internal));
                }
                // All forces are round-off: the body was moved as a whole.
                if is_round_off && ACCEPTED_ROUND_OFF * last_bit >= 1.0 {
                    return Ok((0.0, internal));
                }
                return Err(DomainFailure::Residual {
                    left: relative,
                    tolerance: goal.tolerance,
                    last_bit,
                });
            }
            before = relative;
            let fronts = Some(part.fronts.as_slice());
            let mut right = vec![0.0; free.len()];
            for (&equation, residual) in part.inner.iter().zip(residual) {
                right[equation] = residual;
            }
            let (y, left) = self.factors.forward(&right, fronts);
            let beside = match &self.aside {
                Some(aside) => aside.corrections(&left),
                None => vec![0.0; left.len()],
            };
            let correction = self.factors.backward(&y, &beside, fronts);
            let mut by_dof = vec![0.0; self.system.n_dofs()];
            for &equation in &part.wanted {
                by_dof[free[equation]] = correction[equation];
            }
            self.system.follow(&mut by_dof);
            for increment in total.complete.iter_mut().chain(&mut total.latest) {
                for &equation in &part.wanted {
                    increment[free[equation]] += correction[equation];
                }
                self.system.follow(increment);
            }
            own = Some(total.with(by_dof));
            if committed.is_none() {
                let in_part = |&number: &usize| part.groups[number] && self.system.includes(number);
                let in_part = (0..groups.len()).filter(in_part);
                let of_group = |number: usize| (number, groups[number].committed());
                *committed = Some(in_part.map(of_group).collect());
            }
            self.commit(groups, &part.groups);
        }
    }

    /// Whether a part is the one that the latest state is of.
    fn of_latest(&self, part: &Part) -> bool {
        self.standing.part.as_ref() == Some(&part.groups)
    }

    /// Displacement increments since a state, by degree of freedom: given ones, and those of a
    /// part's unknowns as they follow from the boundary and the load factor.
    fn increment(
        &self,
        origin: &Origin,
        part: &Part,
        lambda: f64,
        displacement: &[f64],
    ) -> Vec<f64> {
        let rise = lambda - origin.lambda;
        let kept = match &self.aside {
            Some(aside) => &aside.moved(rise, &origin.moved),
            None => &origin.moved,
        };
        let values = self
            .factors
            .backward_at(&part.places, (rise, &self.y), kept, &part.fronts);
        let mut increment = vec![0.0; displacement.len()];
        for &dof in &part.dofs {
            increment[dof] = displacement[dof] - origin.displacement[dof];
        }
        for (&equation, value) in part.wanted.iter().zip(values) {
            increment[self.system.free()[equation]] = value;
        }
        self.system.follow(&mut increment);
        increment
    }

    /// Trial state of a part's groups under displacement increments; their internal forces, by
    /// degree of freedom.
    fn evaluate(
        &self,
        groups: &mut [Group],
        since: &Since,
        part: &Part,
    ) -> Result<Vec<f64>, DomainFailure> {
        let mut internal = vec![0.0; self.system.n_dofs()];
        for (number, group) in groups.iter_mut().enumerate() {
            if !self.system.includes(number) || !part.groups[number] {
                continue;
            }
            let latest = self.standing.part.as_ref();
            let increment = if latest.is_some_and(|latest| latest[number]) {
                &since.latest
            } else {
                &since.complete
            };
            let increment = increment.as_ref().ok_or(DomainFailure::NoState)?;
            group
                .evaluate(increment, Operator::None, 0.0, 0.0)
                .map_err(|failure| DomainFailure::Law(Box::new(failure)))?;
            group
                .kinematics
                .add_forces(&group.carried_on_trial(), &mut internal);
        }
        self.system.fold(&mut internal);
        Ok(internal)
    }

    /// Change of the internal forces (2-norm) if every displacement increment of the whole motion is larger or
    /// smaller by its last bit, as the sum over many elements scatters them. The trial state, of the increments
    /// `since` the committed one, stays.
    fn last_bit(
        &self,
        part: &Part,
        groups: &mut [Group],
        (since, total): (&Since, &Since),
        internal: &[f64],
    ) -> Result<f64, DomainFailure> {
        let scattered = |(since, total): (&Vec<f64>, &Vec<f64>)| {
            let mut scattered = last_bit_scattered(total);
            self.system.follow(&mut scattered);
            for (scattered, (since, total)) in scattered.iter_mut().zip(since.iter().zip(total)) {
                *scattered = since + (*scattered - total);
            }
            scattered
        };
        let both = |of: fn(&Since) -> Option<&Vec<f64>>| of(since).zip(of(total)).map(scattered);
        let scattered = Since {
            complete: both(|since| since.complete.as_ref()),
            latest: both(|since| since.latest.as_ref()),
        };
        let moved = self.evaluate(groups, &scattered, part)?;
        self.evaluate(groups, since, part)?;
        let dofs = part
            .inner
            .iter()
            .map(|&equation| self.system.free()[equation]);
        Ok(norm(
            &dofs
                .map(|dof| moved[dof] - internal[dof])
                .collect::<Vec<f64>>(),
        ))
    }
}
