//! Integration: carrying the points of a group through its law, and the stresses and tangents of its elements.

mod depth_profile;
mod difference_tangents;
mod law_start;
mod pore_water;
mod swelling;
mod tangents;
mod thin_layer;
mod traction_projection;

pub(super) use depth_profile::Varying;
pub use difference_tangents::{Origin, Reason as MadeBy};
pub use law_start::LawStart;
pub(super) use pore_water::Pores;
pub(super) use swelling::Swelling;
pub(super) use tangents::PointTangents;
pub(super) use thin_layer::Layer;

use super::state::copy;
use super::{Group, PER_TASK};
use abi::status::Outcome;
use algebra::threads;
use law::{BatchFailure, BatchSuccess, End, Law, Operator, Site, Start, Strided, current_call};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Components of the strain (jump) that a linear law is tried with, and what its stress may be off
/// its tangent's, relative to the largest of both.
const PROBE: [f64; 4] = [1e-4, -5e-5, 2.5e-5, 7.5e-5];
const LINEAR: f64 = 1e-8;

/// Stresses, and strains, of some points, each with those at the start.
type Both<'v> = ((&'v mut [f64], &'v [f64]), (&'v [f64], &'v [f64]));

/// How often a group has called a law, calls included that came to nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LawCalls {
    /// Name of the law in the case: two may have one library and id.
    pub law: String,
    /// Points carried through an increment.
    pub points: u64,
    /// How many of them with an operator, consistent or elastic.
    pub operators: u64,
}

/// A failed point, by element.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFailure {
    /// Name of the group.
    pub group: String,
    /// Name of the law in the case file.
    pub law: String,
    /// Id of the law.
    pub law_id: String,
    /// Element within the group, from 1.
    pub element: usize,
    /// Integration point within the element, from 1.
    pub point: usize,
    /// Coordinates.
    pub position: [f64; 2],
    /// What happened.
    pub failure: BatchFailure,
}

impl std::fmt::Display for PointFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            group,
            law_id,
            element,
            point,
            position: [x, y],
            failure,
            ..
        } = self;
        write!(
            f,
            "law `{law_id}`, group `{group}`, element {element}, point {point} at ({x:.4}, {y:.4}): {}",
            if failure.message.is_empty() {
                "no reason given"
            } else {
                &failure.message
            }
        )
    }
}

/// What calls of a group's law take besides stresses, strains and internal variables.
#[derive(Debug, Default)]
pub(super) struct CallContext {
    /// Laws of the elements, if their parameters vary.
    pub(super) varying: Option<Varying>,
    /// Where the points lie, if the law asks.
    pub(super) sites: Vec<Site>,
    /// The group's name where calls of laws are watched.
    pub(super) watched: u64,
}

/// Points that one thread takes at a time.
const BATCH: usize = 1024;

/// Points of a batch, their law, and where their fluxes, internal variables and operators go.
type Batch<'a> = (Range<usize>, &'a Law, [&'a mut [f64]; 3]);

impl Group {
    /// Computes the trial state under displacement increments (two per node) since the committed
    /// state, and the tangents if wanted; else those of an earlier evaluation stay.
    ///
    /// # Errors
    /// The worst point.
    pub fn evaluate(
        &mut self,
        increment: &[f64],
        operator: Operator,
        time: f64,
        time_increment: f64,
    ) -> Result<BatchSuccess, PointFailure> {
        self.strain.begin();
        copy(&self.strain.committed, &mut self.strain.trial);
        self.kinematics
            .add_gradients(increment, &mut self.strain.trial);
        self.swell(time_increment);
        self.follow_pores(time, time_increment);
        if self.tangents.are_constant {
            self.evaluate_linear();
            return Ok(BatchSuccess::default());
        }
        if let Some(layer) = self
            .layer
            .as_mut()
            .filter(|_| self.law.built.law.n_components() == 2)
        {
            layer.jumps_from_strains(&self.strain.committed, &self.strain.trial);
        }
        let mut tangent = std::mem::take(&mut self.tangents.values);
        let result = if self.uses_layer() {
            let mut operators = vec![0.0; self.kinematics.n_points() * 4];
            let result = self.run_with_tangents(operator, (time, time_increment), &mut operators);
            if let (Ok(_), Some(layer)) = (&result, &self.layer) {
                layer.stresses_along(&self.strain, &mut self.stress);
                if operator != Operator::None {
                    layer.tangents(&operators, &mut tangent);
                }
            }
            result
        } else {
            let result = self.run_with_tangents(operator, (time, time_increment), &mut tangent);
            if operator != Operator::None {
                self.stiffen(&mut tangent);
            }
            result
        };
        self.tangents.values = tangent;
        result.map_err(|failure| self.locate(&failure))
    }

    /// σ = σ₀ + D Δε.
    fn evaluate_linear(&mut self) {
        self.stress.begin();
        let n = self.kinematics.n_components();
        let tangent = &self.tangents.values;
        let per_task = n * PER_TASK;
        let stresses = self.stress.trial.chunks_mut(per_task);
        let stresses = stresses.zip(self.stress.committed.chunks(per_task));
        let strains = self.strain.trial.chunks(per_task);
        let strains = strains.zip(self.strain.committed.chunks(per_task));
        let of_points = |((stresses, stresses_0), (strains, strains_0)): Both<'_>| {
            let stresses = stresses.chunks_exact_mut(n);
            let stresses = stresses.zip(stresses_0.chunks_exact(n));
            let strains = strains.chunks_exact(n).zip(strains_0.chunks_exact(n));
            for ((stress, stress_0), (strain, strain_0)) in stresses.zip(strains) {
                for i in 0..n {
                    let row = &tangent[i * n..][..n];
                    let change: f64 = (0..n).map(|j| row[j] * (strain[j] - strain_0[j])).sum();
                    stress[i] = stress_0[i] + change;
                }
            }
        };
        threads::each(stresses.zip(strains), of_points);
    }

    /// The constant tangent of a linear law, held against what the law makes of a small strain.
    pub(super) fn operator_of_first_point(&mut self) -> Result<Vec<f64>, BatchFailure> {
        let n = self.law.built.law.n_components();
        let zero = vec![0.0; n];
        let strain: Vec<f64> = PROBE.iter().copied().cycle().take(n).collect();
        let now = (Operator::Consistent, (0.0, 0.0));
        let (flux, operator) = self.call(0, (&zero, &strain), &zero, now)?;
        self.count(1, Operator::Consistent);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let scale = largest(&operator) * largest(&strain);
        for (i, row) in operator.chunks_exact(n).enumerate() {
            let product: f64 = row.iter().zip(&strain).map(|(d, e)| d * e).sum();
            if (flux[i] - product).abs() > LINEAR * scale {
                return Err(BatchFailure {
                    point: 0,
                    outcome: Outcome::Internal,
                    message: format!(
                        "the law calls itself linear, but a strain of {strain:?} gives stress {} = \
                         {:.6e} where its tangent gives {product:.6e}; `pilum check` says more",
                        i + 1,
                        flux[i]
                    ),
                    factor: None,
                    claims_success: false,
                    call: None,
                });
            }
        }
        Ok(operator)
    }

    /// Internal variables that the law starts with, from the committed stresses.
    pub(super) fn initial_state(&self) -> Result<Vec<f64>, PointFailure> {
        let place = self.flux_place();
        current_call::of_group(self.calls.watched, 0, self.kinematics.points_of(0).len());
        let mut internal = Vec::new();
        for (points, law) in self.pieces(usize::MAX) {
            let flux = &self.stress.committed[points.start * place.point..points.end * place.point];
            let state = law.initial_state(points.len(), (flux, place));
            internal.extend(state.map_err(|failure| {
                self.locate(&BatchFailure {
                    point: points.start + failure.point,
                    ..failure
                })
            })?);
        }
        Ok(internal)
    }

    /// Consecutive points of one law, at most this many at a time.
    pub(super) fn pieces(&self, most: usize) -> Vec<(Range<usize>, &Law)> {
        let all = [(0..self.kinematics.n_points(), 0)];
        let runs = self
            .calls
            .varying
            .as_ref()
            .map_or(&all[..], |varying| &varying.runs);
        let law = |number: usize| match &self.calls.varying {
            Some(varying) => &varying.law(number).law,
            None => &self.law.built.law,
        };
        let pieces = runs.iter().flat_map(|(run, number)| {
            let starts = run.clone().step_by(most.min(run.len().max(1)));
            let end = run.end;
            starts.map(move |start| (start..end.min(start.saturating_add(most)), law(*number)))
        });
        pieces.collect()
    }

    pub(super) fn site(&self, point: usize) -> Site {
        let (element, within) = self.kinematics.place_of(point);
        Site {
            position: self.kinematics.position(point),
            length: self.kinematics.length(element),
            element: element as u32 + 1,
            point: within as u32 + 1,
        }
    }

    /// A thin layer whose law is an interface law.
    pub(super) fn uses_layer(&self) -> bool {
        self.layer.is_some() && self.law.built.law.n_components() == 2
    }

    /// Positions of the law's fluxes within the stresses: all of them, or, of a thin layer with an
    /// interface law, components 22 (normal) and 12 (shear).
    pub(super) fn flux_place(&self) -> Strided {
        if self.uses_layer() {
            Strided {
                offset: 1,
                point: 4,
                component: 2,
            }
        } else {
            Strided::rows(self.kinematics.n_components())
        }
    }

    /// The first point of a thin layer whose normal and shear stiffness cannot be those of an
    /// elastic layer: (normal, shear).
    pub fn impossible_layer(&self) -> Option<[f64; 2]> {
        self.layer
            .as_ref()
            .filter(|_| self.uses_layer())
            .and_then(Layer::impossible)
    }

    pub(super) fn count(&mut self, n_points: usize, operator: Operator) {
        if let Some(calls) = self.law_calls.last_mut() {
            calls.points += n_points as u64;
            if operator != Operator::None {
                calls.operators += n_points as u64;
            }
        }
    }

    pub(super) fn locate(&self, failure: &BatchFailure) -> PointFailure {
        let point = failure
            .point
            .min(self.kinematics.n_points().saturating_sub(1));
        let (element, within) = self.kinematics.place_of(point);
        PointFailure {
            group: self.name.clone(),
            law: self.law.name.clone(),
            law_id: self.law.built.law.description().id.clone(),
            element: element + 1,
            point: within + 1,
            position: self.kinematics.position(point),
            failure: BatchFailure {
                // The law counts points of the batch; the element says more.
                message: failure
                    .message
                    .strip_prefix(&format!("point {}: ", failure.point))
                    .unwrap_or(&failure.message)
                    .to_owned(),
                ..failure.clone()
            },
        }
    }

    /// Carries all points through the law. `operators` holds room for them, wanted or not.
    pub(super) fn run_law(
        &mut self,
        operator: Operator,
        period: (f64, f64),
        operators: &mut [f64],
    ) -> Result<BatchSuccess, BatchFailure> {
        self.count(self.kinematics.n_points(), operator);
        for field in self.fields() {
            field.begin();
        }
        // The trial state is written while the rest of the group is read.
        let mut flux_end = std::mem::take(&mut self.stress.trial);
        let mut states_end = std::mem::take(&mut self.internal.trial);
        let end = End {
            flux: (&mut flux_end, self.flux_place()),
            state: &mut states_end,
            operator: operators,
        };
        let outcome = self.carry((&self.gradient().trial, None), operator, period, end);
        self.stress.trial = flux_end;
        self.internal.trial = states_end;
        outcome
    }

    /// Response of the requested points, or of all, to these gradients at the end of the increment.
    pub(super) fn carry(
        &self,
        (gradient_end, wanted): (&[f64], Option<&[bool]>),
        operator: Operator,
        (time, time_increment): (f64, f64),
        end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        let place = self.flux_place();
        let gradient = self.gradient();
        let law = &self.law.built.law;
        let (n, n_states) = (law.n_components(), law.n_states());
        let rows = Strided::rows(n);
        let (committed, state) = (&self.stress.committed, &self.internal.committed);
        let (moment, sites) = (self.moment, &self.calls.sites);
        let (watched, per_element) = (self.calls.watched, self.kinematics.points_of(0).len());
        let (flux_end, end_place) = end.flux;
        let batch = |(points, law, [flux, state_end, operator_end]): Batch<'_>| {
            current_call::of_group(watched, points.start, per_element);
            let of = |stride: usize| points.start * stride..points.end * stride;
            law.integrate(
                &Start {
                    n_points: points.len(),
                    gradient: (&gradient.committed[of(n)], rows),
                    gradient_end: (&gradient_end[of(n)], rows),
                    flux: (&committed[of(place.point)], place),
                    state: &state[of(n_states)],
                    time,
                    time_increment,
                    moment,
                    sites: sites.get(points.clone()).unwrap_or_default(),
                },
                operator,
                End {
                    flux: (flux, end_place),
                    state: state_end,
                    operator: operator_end,
                },
            )
            .map_err(|failure| BatchFailure {
                point: points.start + failure.point,
                ..failure
            })
            .map(|success| BatchSuccess {
                unreliable: success
                    .unreliable
                    .map(|(point, why)| (points.start + point, why)),
            })
        };
        let pieces = self.pieces(BATCH).into_iter();
        let n_operator = if end.operator.is_empty() { 0 } else { n * n };
        let work = batches(
            pieces.flat_map(|piece| runs(piece, wanted)),
            [flux_end, end.state, end.operator],
            [end_place.point, n_states, n_operator],
        );
        let outcomes: Vec<_> = if self.kinematics.n_points() <= BATCH {
            work.into_iter().map(batch).collect()
        } else {
            threads::map(work, batch)
        };
        together(outcomes)
    }

    /// Response of one point to these gradients at the end of the increment: fluxes, and the
    /// operator if requested. `None` where the law fails.
    pub(super) fn answer(
        &self,
        point: usize,
        gradient_end: &[f64],
        operator: Operator,
        period: (f64, f64),
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.law.built.law.n_components();
        let gradient = self.gradient().committed.get(n * point..n * (point + 1))?;
        let flux = self.flux_place().of_point(&self.stress.committed, point, n);
        let gradients = (gradient, gradient_end);
        self.call(point, gradients, &flux, (operator, period)).ok()
    }

    /// The law's elastic operator at a point in the committed state, row by row. `None` if the law has no operator there,
    /// or has other components than the element.
    pub fn elastic_operator(&self, point: usize) -> Option<Vec<f64>> {
        let n = self.kinematics.n_components();
        if self.law.built.law.n_components() != n {
            return None;
        }
        let stress = self.stress.committed.get(point * n..(point + 1) * n)?;
        let still = vec![0.0; n];
        let now = (Operator::Elastic, (self.moment.step_start, 0.0));
        let answer = self.call(point, (&still, &still), stress, now);
        answer.ok().map(|(_, operator)| operator)
    }

    /// Carries one point through its law, from these gradients to others, from these fluxes and its committed internal
    /// variables: fluxes, and room for the operator.
    pub(super) fn call(
        &self,
        point: usize,
        (gradient, gradient_end): (&[f64], &[f64]),
        flux: &[f64],
        (operator, (time, time_increment)): (Operator, (f64, f64)),
    ) -> Result<(Vec<f64>, Vec<f64>), BatchFailure> {
        let law = self.law_at(point);
        let (n, n_states) = (law.n_components(), law.n_states());
        let state = n_states * point..n_states * (point + 1);
        let rows = Strided::rows(n);
        let (mut flux_end, mut state_end) = (vec![0.0; n], vec![0.0; n_states]);
        let mut matrix = vec![0.0; n * n];
        let (calls, per_element) = (&self.calls, self.kinematics.points_of(0).len());
        current_call::of_group(calls.watched, point, per_element);
        let start = Start {
            n_points: 1,
            gradient: (gradient, rows),
            gradient_end: (gradient_end, rows),
            flux: (flux, rows),
            state: self.internal.committed.get(state).unwrap_or_default(),
            time,
            time_increment,
            moment: self.moment,
            sites: calls.sites.get(point..=point).unwrap_or_default(),
        };
        let end = End {
            flux: (&mut flux_end, rows),
            state: &mut state_end,
            operator: &mut matrix,
        };
        law.integrate(&start, operator, end)?;
        Ok((flux_end, matrix))
    }

    /// The law of a point.
    fn law_at(&self, point: usize) -> &Law {
        let Some(varying) = &self.calls.varying else {
            return &self.law.built.law;
        };
        let mut runs = varying.runs.iter();
        let own = runs.find(|(points, _)| points.contains(&point));
        own.map_or(&self.law.built.law, |(_, number)| &varying.law(*number).law)
    }
}

/// Runs of points with their parts of these arrays, which have such strides by point.
fn batches<'a>(
    runs: impl Iterator<Item = (Range<usize>, &'a Law)>,
    mut rest: [&'a mut [f64]; 3],
    strides: [usize; 3],
) -> Vec<Batch<'a>> {
    let mut done = 0;
    let batch = |(points, law): (Range<usize>, &'a Law)| {
        let passed = points.start - done;
        done = points.end;
        let mut own = [&mut [][..], &mut [], &mut []];
        for ((own, rest), stride) in own.iter_mut().zip(&mut rest).zip(strides) {
            let left = &mut std::mem::take(rest)[passed * stride..];
            (*own, *rest) = left.split_at_mut(points.len() * stride);
        }
        (points, law, own)
    };
    runs.map(batch).collect()
}

/// Consecutive points of a piece that are wanted.
fn runs<'l>(
    (points, law): (Range<usize>, &'l Law),
    wanted: Option<&[bool]>,
) -> Vec<(Range<usize>, &'l Law)> {
    let Some(wanted) = wanted else {
        return vec![(points, law)];
    };
    let mut runs: Vec<(Range<usize>, &Law)> = Vec::new();
    for point in points.filter(|point| wanted[*point]) {
        match runs.last_mut() {
            Some((run, _)) if run.end == point => run.end += 1,
            _ => runs.push((point..point + 1, law)),
        }
    }
    runs
}

/// The outcome of some batches: the worst failure, or the first that is unreliable.
fn together(
    outcomes: Vec<Result<BatchSuccess, BatchFailure>>,
) -> Result<BatchSuccess, BatchFailure> {
    let mut all = BatchSuccess::default();
    let mut worst: Option<BatchFailure> = None;
    for outcome in outcomes {
        match outcome {
            Ok(success) => all.unreliable = all.unreliable.or(success.unreliable),
            Err(failure) => {
                worst = Some(match worst {
                    Some(worst) => worst.or_worse(failure),
                    None => failure,
                });
            }
        }
    }
    worst.map_or(Ok(all), Err)
}
