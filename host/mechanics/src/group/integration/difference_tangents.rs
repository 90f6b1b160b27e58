//! Tangents by central differences of the law's own answers, where its own tangents are no derivatives of
//! them. Whether one is, is asked of every point in one direction.
//!
//! A point is moved by a small share of its increment. Its response there is that of the law along
//! the current path, however the update is integrated. If nothing moves, the law's own tangent is
//! used.

use crate::group::{Field, Group, PER_TASK};
use crate::settings::Tangents;
use algebra::threads;
use law::{BatchFailure, BatchSuccess, End, Operator, Strided, Tangent};
use serde::{Deserialize, Serialize};

/// Size of the differences, relative to the increment of the gradients at a point; where that is less than
/// a share of its root mean square over the group, relative to that share.
const SIZE: f64 = 1e-3;
const LEAST: f64 = 1e-3;
/// Not less than this share of the gradients themselves: what their last bits leave of a difference.
const LAST_BITS: f64 = 1e-9;
/// The direction in which a point's own tangent is tried, and the share of its largest entry that it may be
/// off there: Newton's method loses nothing by that.
const DIRECTION: [f64; 4] = [1.0, -0.6, 0.35, 0.8];
const RIGHT: f64 = 1e-3;

/// Why a group's tangents are differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// The settings ask for it.
    Asked,
    /// The law declares its tangents approximate or missing.
    Declared,
    /// They were found not to be the derivatives of the stresses.
    Noticed,
}

/// Source of a group's tangents, and the findings about those of its law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// They are differences, for this reason.
    pub(in crate::group) differences: Option<Reason>,
    /// How often the law's own were looked at and found right, one time after another; and wrong.
    pub(in crate::group) right: u8,
    pub(in crate::group) wrong: u8,
}

impl Group {
    /// Why the tangents are differences, if they are.
    pub fn differences(&self) -> Option<Reason> {
        self.tangents.origin.differences
    }

    /// Takes up what the settings say of tangents, and what the law does.
    pub fn take_tangents(&mut self, wanted: Tangents, follows_derivative: bool) {
        let declared = self.law.built.law.formulation().tangent != Tangent::Consistent;
        let noticed = self.tangents.origin.differences;
        let noticed = noticed.filter(|reason| *reason == Reason::Noticed);
        self.tangents.origin.differences = match wanted {
            _ if self.tangents.are_constant => None,
            Tangents::Differences => Some(Reason::Asked),
            Tangents::Law => None,
            Tangents::Auto if !follows_derivative => None,
            Tangents::Auto if declared => Some(Reason::Declared),
            Tangents::Auto => noticed,
        };
    }

    /// Strains, or the jumps of a layer, that the law is called with.
    pub(in crate::group) fn gradient(&self) -> &Field {
        match &self.layer {
            Some(layer) if self.law.built.law.n_components() == 2 => &layer.jump,
            _ => &self.strain,
        }
    }

    /// Carries all points through the law; tangents that are wanted are its own, or differences.
    pub(in crate::group) fn run_with_tangents(
        &mut self,
        operator: Operator,
        period: (f64, f64),
        tangents: &mut [f64],
    ) -> Result<BatchSuccess, BatchFailure> {
        let success = self.run_law(operator, period, tangents)?;
        if operator == Operator::Consistent
            && self.tangents.origin.differences.is_some()
            && let Some(sizes) = self.sizes()
        {
            self.count(2 * sizes.len(), Operator::None);
            let wrong = self.wrong(&sizes, period, tangents);
            self.differentiate(&sizes, &wrong, period, tangents);
        }
        Ok(success)
    }

    /// Points whose own tangent is not what differences in one direction make it.
    pub(in crate::group) fn wrong(
        &self,
        sizes: &[f64],
        period: (f64, f64),
        tangents: &[f64],
    ) -> Vec<bool> {
        let n = self.law.built.law.n_components();
        let end = self.gradient().trial.clone();
        let all = vec![true; sizes.len()];
        let components = DIRECTION.into_iter().take(n).enumerate();
        let direction: Vec<f64> = components
            .map(|(i, d)| if self.moves(i) { d } else { 0.0 })
            .collect();
        let [ahead, behind] = [1.0, -1.0].map(|sign| {
            let mut moved = end.clone();
            for (moved, size) in moved.chunks_exact_mut(n).zip(sizes) {
                let pairs = moved.iter_mut().zip(&direction);
                pairs.for_each(|(moved, d)| *moved += sign * size * d);
            }
            self.fluxes_at(&moved, &all, period)
        });
        let is_wrong = |point: &usize| {
            let point = *point;
            let matrix = &tangents[point * n * n..][..n * n];
            let largest = matrix.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let off = |i: usize| {
                let row = matrix[i * n..][..n].iter().zip(&direction);
                let expected: f64 = row.map(|(c, d)| c * d).sum();
                let apart = 2.0 * sizes[point];
                ((ahead[n * point + i] - behind[n * point + i]) / apart - expected).abs()
            };
            // Nor is it right where the law fails nearby.
            !(0..n).all(|i| off(i) <= RIGHT * largest)
        };
        let points: Vec<usize> = (0..sizes.len()).collect();
        let of_some = |points: &[usize]| -> Vec<bool> { points.iter().map(is_wrong).collect() };
        threads::map(points.chunks(PER_TASK), of_some).concat()
    }

    /// Size of the differences at every point; `None` where nothing moves.
    pub(in crate::group) fn sizes(&self) -> Option<Vec<f64>> {
        let n = self.law.built.law.n_components();
        let Field { committed, trial } = self.gradient();
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let points = committed.chunks_exact(n).zip(trial.chunks_exact(n));
        let reaches: Vec<[f64; 2]> = points
            .map(|(start, end)| {
                let moved = largest(&mut start.iter().zip(end).map(|(a, b)| (b - a).abs()));
                [moved, largest(&mut end.iter().map(|e| e.abs()))]
            })
            .collect();
        let square: f64 = reaches.iter().map(|[moved, _]| moved * moved).sum();
        let least = LEAST * (square / reaches.len().max(1) as f64).sqrt();
        (least > 0.0).then(|| {
            let size = |[moved, at]: &[f64; 2]| (SIZE * moved.max(least)).max(LAST_BITS * at);
            reaches.iter().map(size).collect()
        })
    }

    /// Tangents of some points by differences of these sizes about the trial state. If the law
    /// fails on one side, the other side counts; if it fails on both, the column is unchanged.
    fn differentiate(
        &mut self,
        sizes: &[f64],
        wanted: &[bool],
        period: (f64, f64),
        tangents: &mut [f64],
    ) {
        let n = self.law.built.law.n_components();
        let place = self.flux_place();
        let end = self.gradient().trial.clone();
        let n_wanted = wanted.iter().filter(|wanted| **wanted).count();
        self.count(2 * n * n_wanted, Operator::None);
        for column in (0..n).filter(|column| self.moves(*column)) {
            let [ahead, behind] = [1.0, -1.0].map(|sign| {
                let mut moved = end.clone();
                let of_points = moved.chunks_exact_mut(n).zip(sizes);
                of_points.for_each(|(moved, size)| moved[column] += sign * size);
                let fluxes = self.fluxes_at(&moved, wanted, period);
                (moved, fluxes)
            });
            for point in (0..sizes.len()).filter(|point| wanted[*point]) {
                let first = n * point;
                let of_side = |(moved, fluxes): &(Vec<f64>, Vec<f64>)| {
                    let flux = fluxes[first..first + n].to_vec();
                    flux[0].is_finite().then(|| (moved[first + column], flux))
                };
                let here = || {
                    let flux = place.of_point(&self.stress.trial, point, n);
                    (end[first + column], flux)
                };
                let (to, from) = match (of_side(&ahead), of_side(&behind)) {
                    (Some(ahead), Some(behind)) => (ahead, behind),
                    (Some(ahead), None) => (ahead, here()),
                    (None, Some(behind)) => (here(), behind),
                    (None, None) => continue,
                };
                for i in 0..n {
                    let slope = (to.1[i] - from.1[i]) / (to.0 - from.0);
                    tangents[(first + i) * n + column] = slope;
                }
            }
        }
    }

    /// Whether this component of the gradient ever differs from zero: laws need not know of strains out of
    /// the plane where absent (the third of four components), nor say what they would call forth.
    pub(in crate::group) fn moves(&self, component: usize) -> bool {
        let n = self.law.built.law.n_components();
        let Field { committed, trial } = self.gradient();
        let of = |values: &[f64]| values.chunks_exact(n).any(|point| point[component] != 0.0);
        n < 4 || component != 2 || of(committed) || of(trial)
    }

    /// Fluxes of some points at these gradients, row by row; not a number where the law fails.
    fn fluxes_at(&self, gradient_end: &[f64], wanted: &[bool], period: (f64, f64)) -> Vec<f64> {
        let n = self.law.built.law.n_components();
        let mut fluxes = vec![0.0; gradient_end.len()];
        let end = End {
            flux: (&mut fluxes, Strided::rows(n)),
            state: &mut vec![0.0; self.internal.committed.len()],
            operator: &mut [],
        };
        let carried = self.carry((gradient_end, Some(wanted)), Operator::None, period, end);
        if carried.is_err() {
            // A batch that fails at one point says nothing of the others.
            let points = fluxes.chunks_exact_mut(n).zip(gradient_end.chunks_exact(n));
            let points = points.enumerate().filter(|(point, _)| wanted[*point]);
            for (point, (flux, end)) in points {
                match self.answer(point, end, Operator::None, period) {
                    Some((answer, _)) => flux.copy_from_slice(&answer),
                    None => flux.fill(f64::NAN),
                }
            }
        }
        fluxes
    }
}
