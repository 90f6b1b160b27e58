//! Is the consistent tangent the derivative of the update, symmetric and constant where that is declared?

use super::{ELASTIC, LENGTHS, ROUND_OFF, flux_scale, increment, largest};
use crate::check::loading_path::Step;
use crate::check::margins;
use crate::check::random::Random;
use crate::check::specimen::{Specimen, is_success};
use crate::check::{Found, Subject, Verdict, skipped};
use abi::raw;
use law::Tangent;
use law::probe::{PointEnd, PointStart};
use std::collections::BTreeMap;

/// Error of a tangent, relative to the largest stiffness. Differences are good to 10⁻⁶ or so.
const TANGENT: f64 = 1e-4;
/// Roundings of a flux that the two sides of a difference may have together, each of half a unit in the
/// last place of the largest term. A component of a solid is a sum of six terms.
const NOISE: f64 = 6.0;

/// What differences say of a tangent.
pub(in crate::check) enum Slope {
    Right,
    Kink,
    /// Row and column where the flux does not change at all, though the tangent has a little stiffness.
    Left(usize, usize),
    /// An entry of the tangent, as the law has it and as differences do.
    Wrong {
        row: usize,
        column: usize,
        by_law: f64,
        by_differences: f64,
    },
}

pub(super) fn tangent_matches_differences(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "tangent");
    let (mut n, mut n_kinks, mut n_inelastic) = (0, 0, 0);
    let mut left = None;
    for specimen in subject.specimens_by_default(5, &mut random)? {
        let steps = specimen.paths(36, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        if specimen.formulation.tangent != Tangent::Consistent {
            continue;
        }
        let elastic = specimen.call(&starts, ELASTIC)?.points;
        let mut kinds: BTreeMap<Vec<u8>, usize> = BTreeMap::new();
        for (i, step) in steps.iter().enumerate() {
            // Every fifth, so that all increments of a straight piece occur, and the first ones of each kind,
            // since some, as those in which contact re-forms, are rare.
            let seen = kinds.entry(kind(step, &elastic[i])).or_insert(0);
            *seen += 1;
            if specimen.course.is_none() && i % 5 > 0 && *seen > OF_EACH_KIND {
                continue;
            }
            let scale = step.stiffness.max(largest(&step.end.tangent));
            let difference = elastic[i].tangent.iter().zip(&step.end.tangent);
            n_inelastic += usize::from(
                difference.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) > TANGENT * scale,
            );
            n += 1;
            match slope(&specimen, step, scale)? {
                Slope::Right => {}
                Slope::Kink => n_kinks += 1,
                Slope::Left(row, column) => {
                    let names = specimen.hypothesis.components();
                    let entry = step.end.tangent[row * names.len() + column];
                    let verdict = Verdict::Warning(format!(
                        "{}: row `{}`, column `{}` of the tangent is {entry:.6e}, {:.1e} of the stiffness, \
                         where the flux does not change at all: a little stiffness left for the solver? \
                         At {}",
                        specimen.name(),
                        names[row],
                        names[column],
                        entry.abs() / scale,
                        specimen.at(&step.start)
                    ));
                    left = left.or_else(|| Some(specimen.recorded(&step.start, verdict)));
                }
                Slope::Wrong {
                    row,
                    column,
                    by_law,
                    by_differences,
                } => {
                    let names = specimen.hypothesis.components();
                    let why = format!(
                        "row `{}`, column `{}` of the tangent is {by_law:.6e}, differences give \
                         {by_differences:.6e}: wrong by {:.1e} of the stiffness, at {}",
                        names[row],
                        names[column],
                        (by_law - by_differences).abs() / scale,
                        specimen.at(&step.start)
                    );
                    return Err(specimen.fails_at(&step.start, why));
                }
            }
        }
    }
    if n == 0 {
        return Err(skipped("no law declares a consistent tangent"));
    }
    let details = format!("{n} tangents, {n_inelastic} of them inelastic, {n_kinks} at kinks");
    if 2 * n_kinks > n {
        return Err(Verdict::Warning(format!(
            "too few were compared: {details}"
        )));
    }
    left.map_or(Ok(details), Err)
}

/// Steps of each kind that are compared at least.
const OF_EACH_KIND: usize = 3;

/// Outside view of a step: the size of each entry of its tangent relative to the elastic operator,
/// and the change of each internal variable.
fn kind(step: &Step, elastic: &PointEnd) -> Vec<u8> {
    let scale = largest(&elastic.tangent);
    let entries = step.end.tangent.iter().zip(&elastic.tangent);
    let entries = entries.map(|(a, e)| match (a - e) / scale {
        off if off.abs() <= TANGENT => 0,
        _ if a.abs() <= TANGENT * scale => 1,
        off if off < 0.0 => 2,
        _ => 3,
    });
    let states = step.end.state.iter().zip(&step.start.state0);
    let states = states.map(|(end, start)| match (*start, *end) {
        (start, end) if start.to_bits() == end.to_bits() => 0,
        (_, 0.0) => 1,
        (0.0, _) => 2,
        (start, end) if end > start => 3,
        _ => 4,
    });
    entries.chain(states).collect()
}

/// Compares the tangent of a step with differences of three lengths, two of which have to agree with
/// each other where it is wrong.
pub(in crate::check) fn slope(
    specimen: &Specimen,
    step: &Step,
    scale: f64,
) -> Result<Slope, Verdict> {
    let n = step.start.gradient1.len();
    let size = largest(&increment(&step.start));
    let columns: Vec<usize> = (0..n).filter(|&c| specimen.is_free(c)).collect();
    let mut moved = Vec::new();
    for length in LENGTHS {
        for &c in &columns {
            for sign in [1.0, -1.0] {
                let mut point = step.start.clone();
                point.gradient1[c] += sign * length * size;
                moved.push(point);
            }
        }
    }
    let ends = specimen.call(&moved, raw::PILUM_REQ_FLUX)?.points;
    let mut verdict = Slope::Kink;
    let mut left = None;
    let (mut off, mut right) = (0.0, f64::INFINITY);
    // The differences of the length before, entry by entry.
    let mut longer: Vec<f64> = Vec::new();
    for (l, _) in LENGTHS.iter().enumerate() {
        // What rounding of the fluxes makes of differences this short: where that is more than is allowed, they
        // say nothing.
        let noise = NOISE * f64::EPSILON * flux_scale(step) / (LENGTHS[l] * size);
        if noise > TANGENT * scale {
            break;
        }
        let allowed = TANGENT * scale + noise;
        let mut slopes = vec![f64::NAN; n * n];
        let (mut error, mut disagreement, mut worst) = (0.0_f64, 0.0_f64, Slope::Right);
        for (k, &c) in columns.iter().enumerate() {
            let first = 2 * (l * columns.len() + k);
            let [plus, minus] = [first, first + 1].map(|i| &ends[i]);
            if !(is_success(plus.status) && is_success(minus.status)) {
                // The limit of what the law can follow is a kink as well.
                disagreement = f64::INFINITY;
                continue;
            }
            // What was really added, after rounding.
            let [up, down] =
                [first, first + 1].map(|i| moved[i].gradient1[c] - step.start.gradient1[c]);
            for row in 0..n {
                let [above, here, below] =
                    [&plus.flux, &step.end.flux, &minus.flux].map(|f| f[row]);
                let by_differences = (above - below) / (up - down);
                slopes[row * n + c] = by_differences;
                let by_law = step.end.tangent[row * n + c];
                let wrong = (by_differences - by_law).abs();
                let forward = (above - here) / up;
                let backward = (here - below) / -down;
                let stays = [above, below].iter().all(|f| f.to_bits() == here.to_bits());
                // Of a length at which this much stiffness would show.
                let shows = by_law.abs() * up > 1e3 * f64::EPSILON * here.abs();
                if l == 0 && stays && shows && by_law.abs() > ROUND_OFF * scale {
                    left = left.or(Some((row, c)));
                }
                disagreement = disagreement.max((forward - backward).abs());
                if wrong > error {
                    error = wrong;
                    worst = Slope::Wrong {
                        row,
                        column: c,
                        by_law,
                        by_differences,
                    };
                }
            }
        }
        if disagreement.is_finite() && error <= allowed {
            // The nearest of the lengths: the others have an error of their own.
            right = right.min(error / allowed);
        }
        if right.is_finite() {
            continue;
        }
        // Between two kinks, sides agree with each other, but the shorter the length the steeper.
        if let Slope::Wrong { row, column, .. } = worst
            && let Some(before) = longer.get(row * n + column)
            && disagreement <= 0.1 * error
        {
            let slope = slopes[row * n + column].abs();
            let is_steeper = slope > 10.0 * before.abs() && slope > 1e-2 * TANGENT * scale;
            let agrees = (before - slopes[row * n + column]).abs() <= 0.1 * error;
            if agrees && !is_steeper {
                verdict = worst;
                off = error / allowed;
            }
        }
        longer = slopes;
    }
    if right.is_finite() {
        margins::note("tangent", right);
        return Ok(left.map_or(Slope::Right, |(row, c)| Slope::Left(row, c)));
    }
    margins::note("tangent", off);
    Ok(verdict)
}

pub(super) fn tangent_symmetry_as_declared(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "symmetry");
    let mut n_tangents = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        if !specimen.formulation.symmetric {
            continue;
        }
        for step in specimen.paths(36, &mut random)?.steps {
            let k = &step.end.tangent;
            let n = step.end.flux.len();
            let bound = ROUND_OFF * largest(k).max(step.stiffness);
            for row in 0..n {
                for column in 0..row {
                    let names = specimen.hypothesis.components();
                    let (lower, upper) = (k[row * n + column], k[column * n + row]);
                    if (lower - upper).abs() > bound {
                        let why = format!(
                            "the tangent is declared symmetric, but row `{0}`, column `{1}` is \
                             {lower:.6e}, row `{1}`, column `{0}` {upper:.6e}, at {2}",
                            names[row],
                            names[column],
                            specimen.at(&step.start)
                        );
                        return Err(specimen.fails_at(&step.start, why));
                    }
                }
            }
            n_tangents += 1;
        }
    }
    if n_tangents == 0 {
        return Err(skipped("no tangent is declared symmetric"));
    }
    Ok(format!("{n_tangents} tangents"))
}

pub(super) fn linearity_as_declared(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "linearity");
    let mut n_steps = 0;
    for specimen in subject.specimens_by_default(3, &mut random)? {
        if !specimen.formulation.linear {
            continue;
        }
        let steps = specimen.paths(20, &mut random)?.steps;
        let Some(first) = steps.first() else { continue };
        let constant = &first.end.tangent;
        let n = first.end.flux.len();
        for step in &steps {
            let moved = increment(&step.start);
            let predicted = (0..n).map(|row| {
                let product: f64 = (0..n).map(|c| constant[row * n + c] * moved[c]).sum();
                step.start.flux0[row] + product
            });
            let bound = ROUND_OFF * flux_scale(step);
            let off = predicted
                .zip(&step.end.flux)
                .any(|(predicted, found)| (predicted - found).abs() > bound);
            let changed = constant
                .iter()
                .zip(&step.end.tangent)
                .any(|(a, b)| (a - b).abs() > ROUND_OFF * step.stiffness);
            if off || changed {
                let why = format!(
                    "declared linear, but {}, at {}",
                    if off {
                        "the tangent does not predict the flux"
                    } else {
                        "the tangent changes"
                    },
                    specimen.at(&step.start)
                );
                return Err(specimen.fails_at(&step.start, why));
            }
            n_steps += 1;
        }
    }
    if n_steps == 0 {
        return Err(skipped("no law is declared linear"));
    }
    Ok(format!("{n_steps} steps"))
}
