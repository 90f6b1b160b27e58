//! Carrying points through the law of a group, batch by batch.

use super::Group;
use algebra::threads;
use law::{BatchFailure, BatchSuccess, End, Law, Operator, Start, Strided, current_call};
use std::ops::Range;

/// Points that one thread takes at a time.
const BATCH: usize = 1024;

/// Points of a batch, their law, and where their fluxes, internal variables and operators go.
type Batch<'a> = (Range<usize>, &'a Law, [&'a mut [f64]; 3]);

impl Group {
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
        let (moment, sites) = (self.moment, &self.sites);
        let (watched, per_element) = (self.watched, self.kinematics.points_of(0).len());
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
        let mut rest = [flux_end, end.state, end.operator];
        let mut work = Vec::new();
        let mut done = 0;
        for (points, law) in self.pieces(BATCH).into_iter().flat_map(|p| runs(p, wanted)) {
            let n_operator = if rest[2].is_empty() { 0 } else { n * n };
            let strides = [end_place.point, n_states, n_operator];
            let passed = strides.map(|stride| (points.start - done) * stride);
            let sizes = strides.map(|stride| points.len() * stride);
            done = points.end;
            let [flux, states, operators] = rest;
            let flux = &mut flux[passed[0]..];
            let states = &mut states[passed[1]..];
            let operators = &mut operators[passed[2]..];
            let (flux, flux_left) = flux.split_at_mut(sizes[0]);
            let (states, states_left) = states.split_at_mut(sizes[1]);
            let (operators, operators_left) = operators.split_at_mut(sizes[2]);
            rest = [flux_left, states_left, operators_left];
            work.push((points, law, [flux, states, operators]));
        }
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
        (time, time_increment): (f64, f64),
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let pieces = self.pieces(usize::MAX).into_iter();
        let (_, law) = pieces
            .into_iter()
            .find(|(points, _)| points.contains(&point))?;
        let (n, n_states) = (law.n_components(), law.n_states());
        let committed = &self.gradient().committed;
        let state = &self.internal.committed;
        let flux = self.flux_place().of_point(&self.stress.committed, point, n);
        let rows = Strided::rows(n);
        let (mut flux_end, mut state_end) = (vec![0.0; n], vec![0.0; n_states]);
        let mut matrix = vec![0.0; n * n];
        current_call::of_group(self.watched, point, self.kinematics.points_of(0).len());
        law.integrate(
            &Start {
                n_points: 1,
                gradient: (committed.get(n * point..n * (point + 1))?, rows),
                gradient_end: (gradient_end, rows),
                flux: (&flux, rows),
                state: state.get(n_states * point..n_states * (point + 1))?,
                time,
                time_increment,
                moment: self.moment,
                sites: self.sites.get(point..=point).unwrap_or_default(),
            },
            operator,
            End {
                flux: (&mut flux_end, rows),
                state: &mut state_end,
                operator: &mut matrix,
            },
        )
        .ok()?;
        Some((flux_end, matrix))
    }
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
