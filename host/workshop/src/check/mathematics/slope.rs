//! Comparison of a tangent with differences of the flux.

use super::LENGTHS;
use crate::check::loading_path::{Step, flux_scale};
use crate::check::points::{ROUND_OFF, increment, is_success, largest};
use crate::check::specimen::Specimen;
use crate::check::{Verdict, margins};
use abi::raw;
use law::probe::{PointEnd, PointStart};

/// Error of a tangent, relative to the largest stiffness. Differences are good to 10⁻⁶ or so.
pub(super) const TANGENT: f64 = 1e-4;
/// Roundings of a flux that the two sides of a difference may have together, each of half a unit in the
/// last place of the largest term. A component of a solid is a sum of six terms.
const NOISE: f64 = 6.0;

/// A tangent, compared with differences.
pub(super) enum Slope {
    Right,
    Kink,
    /// Row and column where the flux does not change at all, though the tangent has a little stiffness.
    Left(usize, usize),
    Wrong(Entry),
}

/// An entry of the tangent, as the law has it and as differences do.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) by_law: f64,
    pub(super) by_differences: f64,
}

impl Entry {
    /// How wrong it is, as a part of this stiffness.
    pub(super) fn off(&self, scale: f64) -> f64 {
        (self.by_law - self.by_differences).abs() / scale
    }
}

/// Differences of one length.
#[derive(Default)]
struct Differences {
    n: usize,
    /// Entry by entry, by central differences.
    slopes: Vec<f64>,
    /// The largest error of the tangent, and where it is.
    error: f64,
    worst: Option<Entry>,
    /// The largest difference between the two sides.
    disagreement: f64,
    /// Row and column of a small entry of the tangent although differences of the stress are zero there.
    left: Option<(usize, usize)>,
}

impl Differences {
    /// By points moved to both sides in each of these components, in turn.
    fn of(
        step: &Step,
        scale: f64,
        columns: &[usize],
        moved: &[PointStart],
        ends: &[PointEnd],
    ) -> Self {
        let n = step.start.gradient1.len();
        let mut all = Self {
            n,
            slopes: vec![f64::NAN; n * n],
            ..Self::default()
        };
        let sides = moved.chunks_exact(2).zip(ends.chunks_exact(2));
        for (&c, (moved, ends)) in columns.iter().zip(sides) {
            let [plus, minus] = [&ends[0], &ends[1]];
            if !(is_success(plus.status) && is_success(minus.status)) {
                // The limit of what the law can follow is a kink as well.
                all.disagreement = f64::INFINITY;
                continue;
            }
            // What was really added, after rounding.
            let [up, down] = [0, 1].map(|i| moved[i].gradient1[c] - step.start.gradient1[c]);
            for row in 0..n {
                let [above, here, below] =
                    [&plus.flux, &step.end.flux, &minus.flux].map(|f| f[row]);
                let entry = Entry {
                    row,
                    column: c,
                    by_law: step.end.tangent[row * n + c],
                    by_differences: (above - below) / (up - down),
                };
                all.slopes[row * n + c] = entry.by_differences;
                let forward = (above - here) / up;
                let backward = (here - below) / -down;
                let stays = [above, below].iter().all(|f| f.to_bits() == here.to_bits());
                // Of a length at which this much stiffness would show.
                let shows = entry.by_law.abs() * up > 1e3 * f64::EPSILON * here.abs();
                if stays && shows && entry.by_law.abs() > ROUND_OFF * scale {
                    all.left = all.left.or(Some((row, c)));
                }
                all.disagreement = all.disagreement.max((forward - backward).abs());
                let wrong = entry.off(1.0);
                if wrong > all.error {
                    (all.error, all.worst) = (wrong, Some(entry));
                }
            }
        }
        all
    }

    /// The worst entry, if it is as wrong by the differences of the length before. Between two kinks, sides agree
    /// with each other, but the shorter the length the steeper.
    fn confirmed(&self, longer: &[f64], scale: f64) -> Option<Entry> {
        let worst = self.worst?;
        let at = worst.row * self.n + worst.column;
        let (before, slope) = (longer.get(at)?, self.slopes[at]);
        let is_steeper = slope.abs() > 10.0 * before.abs() && slope.abs() > 1e-2 * TANGENT * scale;
        let agrees = (before - slope).abs() <= 0.1 * self.error;
        (self.disagreement <= 0.1 * self.error && agrees && !is_steeper).then_some(worst)
    }
}

/// A point moved by each of the lengths, as parts of this size, in each of these components, to both sides.
fn to_both_sides(start: &PointStart, columns: &[usize], size: f64) -> Vec<PointStart> {
    let mut moved = Vec::new();
    for length in LENGTHS {
        for &c in columns {
            for sign in [1.0, -1.0] {
                let mut point = start.clone();
                point.gradient1[c] += sign * length * size;
                moved.push(point);
            }
        }
    }
    moved
}

/// Compares the tangent of a step with differences of three lengths, two of which have to agree with
/// each other where it is wrong.
pub(super) fn slope(specimen: &Specimen, step: &Step, scale: f64) -> Result<Slope, Verdict> {
    let size = largest(&increment(&step.start));
    let columns: Vec<usize> = specimen.free().collect();
    let moved = to_both_sides(&step.start, &columns, size);
    let ends = specimen.call(&moved, raw::PILUM_REQ_FLUX)?.points;
    let mut verdict = Slope::Kink;
    let mut left = None;
    let (mut off, mut right) = (0.0, f64::INFINITY);
    // The differences of the length before, entry by entry.
    let mut longer: Vec<f64> = Vec::new();
    let each = 2 * columns.len();
    let of_lengths = moved.chunks(each).zip(ends.chunks(each));
    for (l, (moved, ends)) in of_lengths.enumerate() {
        // What rounding of the fluxes makes of differences this short: where that is more than is allowed, they
        // say nothing.
        let noise = NOISE * f64::EPSILON * flux_scale(step) / (LENGTHS[l] * size);
        if noise > TANGENT * scale {
            break;
        }
        let allowed = TANGENT * scale + noise;
        let found = Differences::of(step, scale, &columns, moved, ends);
        if l == 0 {
            left = found.left;
        }
        if found.disagreement.is_finite() && found.error <= allowed {
            // The nearest of the lengths: the others have an error of their own.
            right = right.min(found.error / allowed);
        }
        if right.is_finite() {
            continue;
        }
        if let Some(worst) = found.confirmed(&longer, scale) {
            verdict = Slope::Wrong(worst);
            off = found.error / allowed;
        }
        longer = found.slopes;
    }
    if right.is_finite() {
        margins::note("tangent", right);
        return Ok(left.map_or(Slope::Right, |(row, c)| Slope::Left(row, c)));
    }
    margins::note("tangent", off);
    Ok(verdict)
}
