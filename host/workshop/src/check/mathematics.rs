//! Are operators, flags and restrictions what they claim to be?

use super::margins;
use super::random::Random;
use super::specimen::{
    INSTANT, Specimen, create_form, first_difference, hypotheses, is_finite, is_success,
};
use super::walk::{Origin, Step, sum};
use super::{Check, Family, Found, Subject, Verdict, skipped};
use abi::Hypothesis;
use abi::raw;
use law::Tangent;
use law::probe::{Form, PointEnd, PointRates, PointStart};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

pub(super) const NEEDS: &[&str] = &[
    "repeatable",
    "independent-of-split",
    "independent-of-request",
    "results-are-finite",
    "writes-stay-inside",
];

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "tangent-matches-differences",
        family: Family::Mathematics,
        description: "The consistent tangent is the derivative of the update, within 10⁻⁴ of the \
                      elastic stiffness, on random paths and on those that go far, \
                      there and back. Where differences to the two sides \
                      disagree, the point is at a kink and exempt; so are laws that declare an \
                      approximate tangent or none. A little stiffness where the flux does not change at \
                      all is a warning.",
        needs: NEEDS,
        run: tangent_matches_differences,
    },
    Check {
        id: "rates-match-differences",
        family: Family::Mathematics,
        description: "Where PILUM_T_RATES is set, rates of flux and internal variables are the \
                      derivative of the update in random directions, by parameters too, within \
                      10⁻⁶ of the largest term, on random paths; kinks are exempt.",
        needs: NEEDS,
        run: rates_match_differences,
    },
    Check {
        id: "tangent-symmetry-as-declared",
        family: Family::Mathematics,
        description: "Where PILUM_T_SYMMETRIC is set, the consistent tangent is symmetric on \
                      random paths.",
        needs: NEEDS,
        run: tangent_symmetry_as_declared,
    },
    Check {
        id: "linearity-as-declared",
        family: Family::Mathematics,
        description: "Where PILUM_T_LINEAR is set, there is one tangent for all states, and it \
                      predicts every update.",
        needs: NEEDS,
        run: linearity_as_declared,
    },
    Check {
        id: "zero-increment-changes-nothing",
        family: Family::Mathematics,
        description: "After an update, an increment of zero keeps flux and internal variables, 300 times \
                      over too; laws that depend on time are passed over, and variables that count or \
                      are a rate.",
        needs: NEEDS,
        run: zero_increment_changes_nothing,
    },
    Check {
        id: "initial-states-fit",
        family: Family::Mathematics,
        description: "Where `init_state` makes internal variables fit the initial flux, an increment of \
                      zero keeps both (warning, since a flux may be more than a law carries).",
        needs: NEEDS,
        run: initial_states_fit,
    },
    Check {
        id: "hypotheses-agree",
        family: Family::Mathematics,
        description: "Plane strain and axisymmetry give the stresses that 3D gives in a plane \
                      (without 3D: plane strain those of axisymmetry); interfaces in two dimensions those of three.",
        needs: NEEDS,
        run: hypotheses_agree,
    },
    Check {
        id: "tangential-axis-is-arbitrary",
        family: Family::Mathematics,
        description: "With the tangential axis of an interface reversed, the traction is the \
                      same, reversed (warning, since a law may say otherwise in its `doc`).",
        needs: NEEDS,
        run: tangential_axis_is_arbitrary,
    },
    Check {
        id: "response-is-isotropic",
        family: Family::Mathematics,
        description: "In rotated axes a solid gives the stresses, rotated, as it does not where shear \
                      strains γ = 2ε are taken for ε; laws with PILUM_T_LOCAL_AXES are exempt (warning, \
                      since a law may have directions).",
        needs: NEEDS,
        run: response_is_isotropic,
    },
    Check {
        id: "compression-is-negative",
        family: Family::Mathematics,
        description: "A law carries no more shear under tension than under as much compression \
                      (warning, since some may).",
        needs: NEEDS,
        run: compression_is_negative,
    },
    Check {
        id: "angles-are-degrees",
        family: Family::Mathematics,
        description: "Parameters in deg do not repeat after 2π, as angles do that are taken for \
                      radians, nor after 2π · π/180.",
        needs: NEEDS,
        run: angles_are_degrees,
    },
    Check {
        id: "plastic-work-is-not-negative",
        family: Family::Mathematics,
        description: "With a constant elastic operator, flux times inelastic part of the \
                      increment is not negative; laws that depend on time are passed over (warning, \
                      since energy stored by hardening may come back).",
        needs: NEEDS,
        run: plastic_work_is_not_negative,
    },
];

pub(super) const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;
pub(super) const ELASTIC: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC;
/// Error of a tangent, relative to the largest stiffness. Differences are good to 10⁻⁶ or so.
const TANGENT: f64 = 1e-4;
/// Differences of fluxes between two ways to compute them, relative to the fluxes in play.
/// Return mappings iterate to about 10⁻¹⁰.
pub(super) const ITERATED: f64 = 1e-8;
/// Asymmetry, relative to the largest entry.
pub(super) const ROUND_OFF: f64 = 1e-9;
/// Roundings of a flux, each of half a unit of the largest term in play, that two sides of a difference may
/// have between them: a component of a solid is a sum of six terms.
const NOISE: f64 = 6.0;
/// Lengths of difference steps, relative to the increment.
const LENGTHS: [f64; 3] = [1e-3, 1e-5, 1e-7];

pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}

pub(super) fn increment(start: &PointStart) -> Vec<f64> {
    let pairs = start.gradient1.iter().zip(&start.gradient0);
    pairs.map(|(end, begin)| end - begin).collect()
}

/// Fluxes in play in a step.
pub(super) fn flux_scale(step: &Step) -> f64 {
    let moved = step.stiffness * largest(&increment(&step.start));
    largest(&step.end.flux)
        .max(largest(&step.start.flux0))
        .max(moved)
}

/// What differences say of a tangent.
pub(super) enum Slope {
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

fn tangent_matches_differences(subject: &Subject) -> Found {
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
                         At {:?}",
                        specimen.name(),
                        names[row],
                        names[column],
                        entry.abs() / scale,
                        step.start
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
                         {by_differences:.6e}: wrong by {:.1e} of the stiffness, at {:?}",
                        names[row],
                        names[column],
                        (by_law - by_differences).abs() / scale,
                        step.start
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

/// What a step looks like from outside: how large each entry of its tangent is beside the elastic
/// operator, and what became of each internal variable.
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
pub(super) fn slope(specimen: &Specimen, step: &Step, scale: f64) -> Result<Slope, Verdict> {
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

/// Error of rates, relative to those of the inputs times what differences show; these are good to
/// about 10⁻⁸.
const RATE: f64 = 1e-6;

fn rates_match_differences(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "rates");
    let (mut n, mut n_kinks) = (0, 0);
    for specimen in subject.specimens_by_default(4, &mut random)? {
        // They are asked for over an increment of one unit of time.
        if !specimen.formulation.rates || specimen.time_increment.to_bits() != 1.0_f64.to_bits() {
            continue;
        }
        let steps = specimen.paths(36, &mut random)?.steps;
        for step in steps.iter().step_by(5) {
            n += 1;
            n_kinks += usize::from(!one_direction(&specimen, step, &mut random)?);
        }
    }
    if n == 0 {
        return Err(skipped("no law declares rates"));
    }
    if 2 * n_kinks > n {
        return Err(Verdict::Warning(format!(
            "too few were compared: {n} directions, {n_kinks} at kinks"
        )));
    }
    Ok(format!("{n} directions, {n_kinks} at kinks"))
}

/// Compares the rates of a step in a random direction with differences. `false`: at a kink.
fn one_direction(specimen: &Specimen, step: &Step, random: &mut Random) -> Result<bool, Verdict> {
    let start = &step.start;
    let size = largest(&increment(start));
    let flux = largest(&start.flux0).max(step.stiffness * size);
    // Each input moves by a part of its own size; choices, and what is left out, stay.
    let mut part = |scale: f64| scale * random.between(-1.0, 1.0);
    let parameters = specimen.law.description().parameters.iter();
    let parameter: Vec<f64> = parameters
        .zip(&specimen.values)
        .map(|(p, value)| {
            let moves = p.choices.is_empty() && value.is_finite() && *value != 0.0;
            if moves { part(0.1 * value.abs()) } else { 0.0 }
        })
        .collect();
    let state: Vec<f64> = start.state0.iter().map(|s| 0.1 * s.abs()).collect();
    let direction = PointRates {
        gradient0: start.gradient0.iter().map(|_| part(size)).collect(),
        gradient1: start.gradient0.iter().map(|_| part(size)).collect(),
        flux0: start.flux0.iter().map(|_| part(0.1 * flux)).collect(),
        state0: state.into_iter().map(part).collect(),
    };
    let (answer, rates) = specimen.probe.rates(
        std::slice::from_ref(start),
        std::slice::from_ref(&direction),
        &parameter,
    )?;
    let ([end], [(flux_rate, state_rate)]) = (answer.points.as_slice(), rates.as_slice()) else {
        return Err(specimen.fails("no rates are written"));
    };
    if !is_success(end.status) {
        return Err(specimen.fails(format!(
            "with rates `integrate` returned {}",
            super::refusal(answer.status, answer.text().as_deref())
        )));
    }
    if end.flux != step.end.flux {
        return Err(specimen.fails("with rates the update gives another flux"));
    }
    let found: Vec<f64> = flux_rate.iter().chain(state_rate).copied().collect();
    let scales: Vec<f64> = found
        .iter()
        .enumerate()
        .map(|(k, rate)| {
            let least = if k < flux_rate.len() {
                0.1 * flux
            } else {
                size
            };
            rate.abs().max(least)
        })
        .collect();
    let mut verdict = Ok(false);
    for length in LENGTHS {
        let moved = |sign: f64| moved_end(specimen, start, &direction, &parameter, sign * length);
        let (Some(above), Some(below)) = (moved(1.0)?, moved(-1.0)?) else {
            continue;
        };
        let here: Vec<f64> = end.flux.iter().chain(&end.state).copied().collect();
        let (mut error, mut disagreement) = (0.0_f64, 0.0_f64);
        let mut worst = 0;
        for k in 0..found.len() {
            let by_differences = (above[k] - below[k]) / (2.0 * length);
            let sides = (above[k] - 2.0 * here[k] + below[k]) / length;
            let wrong = (by_differences - found[k]).abs() / scales[k];
            disagreement = disagreement.max(sides.abs() / scales[k]);
            if wrong > error {
                (error, worst) = (wrong, k);
            }
        }
        if error <= RATE {
            return Ok(true);
        }
        if disagreement <= 0.1 * error {
            verdict = Err(specimen.fails(format!(
                "rate {worst} of flux and internal variables is {:.9e}, differences say otherwise by \
                 {error:.1e} of it, at {start:?} in the direction {direction:?}, parameters \
                 {parameter:?}",
                found[worst]
            )));
        }
    }
    verdict
}

/// Flux and internal variables with all inputs and parameters moved along a direction; `None` where
/// the law does not follow.
fn moved_end(
    specimen: &Specimen,
    start: &PointStart,
    direction: &PointRates,
    parameter: &[f64],
    length: f64,
) -> Result<Option<Vec<f64>>, Verdict> {
    let along = |values: &[f64], rates: &[f64]| -> Vec<f64> {
        let pairs = values.iter().zip(rates);
        pairs.map(|(value, rate)| value + length * rate).collect()
    };
    let values = along(&specimen.values, parameter);
    let form = create_form(&specimen.formulation, specimen.hypothesis, &values);
    let Some(probe) = specimen.law.probe(&form)?.probe else {
        return Ok(None);
    };
    let point = PointStart {
        gradient0: along(&start.gradient0, &direction.gradient0),
        gradient1: along(&start.gradient1, &direction.gradient1),
        flux0: along(&start.flux0, &direction.flux0),
        state0: along(&start.state0, &direction.state0),
    };
    let mut answer = probe.integrate(&[point], &Form::of(raw::PILUM_REQ_FLUX))?;
    let end = answer.points.remove(0);
    Ok(is_success(end.status).then(|| end.flux.into_iter().chain(end.state).collect()))
}

fn tangent_symmetry_as_declared(subject: &Subject) -> Found {
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
                             {lower:.6e}, row `{1}`, column `{0}` {upper:.6e}, at {2:?}",
                            names[row], names[column], step.start
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

fn linearity_as_declared(subject: &Subject) -> Found {
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
                    "declared linear, but {}, at {:?}",
                    if off {
                        "the tangent does not predict the flux"
                    } else {
                        "the tangent changes"
                    },
                    step.start
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

fn zero_increment_changes_nothing(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "zero");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        let steps = specimen.paths(30, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let slower = Form {
            time_increment: 10.0 * specimen.time_increment,
            ..specimen.form(raw::PILUM_REQ_FLUX)
        };
        let later = specimen.probe.integrate(&starts, &slower)?.points;
        let pairs = steps.iter().zip(&later);
        if pairs
            .clone()
            .any(|(step, later)| step.end.flux != later.flux)
        {
            continue;
        }
        // A rate that is stored, and what counts, are others at rest.
        let may_change: Vec<bool> = (0..specimen.probe.n_states())
            .map(|k| {
                let is_rate = |(step, later): (&Step, &PointEnd)| {
                    step.end.state[k].to_bits() != later.state[k].to_bits()
                };
                counts(&specimen, &steps, k) || pairs.clone().any(is_rate)
            })
            .collect();
        let ended = steps.iter().map(|step| Rest {
            point: at_rest(&step.start.gradient1, &step.end.flux, &step.end.state),
            flux: ITERATED * flux_scale(step),
            size: largest(&increment(&step.start)),
            before: step.start.state0.clone(),
            may_change: may_change.clone(),
        });
        let rests: Vec<Rest> = ended.collect();
        let points: Vec<PointStart> = rests.iter().map(|rest| rest.point.clone()).collect();
        let ends = specimen.call(&points, UPDATE)?.points;
        for (rest, end) in rests.iter().zip(ends) {
            if rest.moves(&end) {
                let Rest { point, .. } = rest;
                let what = if is_success(end.status) {
                    format!(
                        "to {:?}, internal variables {:?} to {:?}",
                        end.flux, point.state0, end.state
                    )
                } else {
                    format!("to a failure, {}", super::status_name(end.status))
                };
                let why = format!("an increment of zero changes flux {:?} {what}", point.flux0);
                return Err(specimen.fails_at(point, why));
            }
            n += 1;
        }
        drifts(&specimen, &rests)?;
    }
    if n == 0 {
        return Err(skipped("all laws depend on the time increment"));
    }
    Ok(format!("{n} points"))
}

/// Increments of zero one after the other, and points that do them.
const RESTS: usize = 300;
const RESTING: usize = 16;

/// What an increment of zero changes too little to be seen adds up.
fn drifts(specimen: &Specimen, rests: &[Rest]) -> Result<(), Verdict> {
    let few = rests.iter().step_by(rests.len().div_ceil(RESTING).max(1));
    let few: Vec<&Rest> = few.collect();
    let mut points: Vec<PointStart> = few.iter().map(|rest| rest.point.clone()).collect();
    for _ in 0..RESTS {
        let ends = specimen.call(&points, raw::PILUM_REQ_FLUX)?.points;
        for ((rest, point), end) in few.iter().zip(&mut points).zip(ends) {
            if rest.moves(&end) {
                let why = format!(
                    "increments of zero, one after the other, change flux {:?} to {:?}, internal \
                     variables {:?} to {:?}",
                    rest.point.flux0, end.flux, rest.point.state0, end.state
                );
                return Err(specimen.fails_at(&rest.point, why));
            }
            point.flux0 = end.flux;
            point.state0 = end.state;
        }
    }
    Ok(())
}

/// A point that is to stay where it is.
struct Rest {
    point: PointStart,
    /// How little flux is none.
    flux: f64,
    /// Of the increment before, and internal variables before it.
    size: f64,
    before: Vec<f64>,
    /// Internal variables that need not stay.
    may_change: Vec<bool>,
}

impl Rest {
    /// Whether it does not stay; what is not a number does not.
    fn moves(&self, end: &PointEnd) -> bool {
        let near = |a: f64, b: f64, bound: f64| (a - b).abs() <= bound;
        let mut fluxes = end.flux.iter().zip(&self.point.flux0);
        let states = end.state.iter().zip(&self.point.state0).zip(&self.before);
        let mut states = states.zip(&self.may_change);
        !(is_success(end.status)
            && is_finite(end)
            && fluxes.all(|(a, b)| near(*a, *b, self.flux))
            && states.all(|(((a, b), before), may_change)| {
                *may_change
                    || near(
                        *a,
                        *b,
                        1e-6 * b.abs().max((b - before).abs()).max(self.size),
                    )
            }))
    }
}

/// Whether an internal variable counts something, as substeps: it has no unit, and whole values, some
/// beyond those of a switch.
pub(super) fn counts(specimen: &Specimen, steps: &[Step], k: usize) -> bool {
    let ends = || steps.iter().map(|step| step.end.state[k]);
    specimen.formulation.internal_variables[k].unit == "-"
        && ends().all(|value| value.fract() == 0.0)
        && ends().any(|value| value.abs() >= 2.0)
}

fn at_rest(gradient: &[f64], flux: &[f64], state: &[f64]) -> PointStart {
    PointStart {
        gradient0: gradient.to_vec(),
        gradient1: gradient.to_vec(),
        flux0: flux.to_vec(),
        state0: state.to_vec(),
    }
}

/// Initial fluxes of one law, and the part of them that has to move for a fault of `init_state`: it may
/// be asked for more than a law can carry.
const STARTS: usize = 24;
const MOST_MOVE: f64 = 0.9;

fn initial_states_fit(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "initial fluxes");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        if specimen.course.is_some() || specimen.probe.init_state(&[], &Form::of(0))?.is_none() {
            continue;
        }
        let followed = followed(&specimen)?;
        let mut rests = Vec::new();
        for _ in 0..STARTS {
            let pressure = random.logarithmic(10.0, 1000.0);
            let part = random.logarithmic(1e-3, 0.3);
            let mut flux = specimen.under_pressure(pressure);
            for (value, followed) in flux.iter_mut().zip(&followed) {
                if *followed {
                    *value += part * pressure * random.between(-1.0, 1.0);
                }
            }
            if let Ok(Origin { start, size, .. }) = specimen.started(flux)? {
                rests.push(Rest {
                    flux: ITERATED * pressure,
                    size,
                    before: start.state0.clone(),
                    may_change: vec![false; start.state0.len()],
                    point: start,
                });
            }
        }
        // A law that has the same state for all of them does not fit it to any.
        let mut pairs = rests.windows(2);
        if pairs.all(|pair| pair[0].before == pair[1].before) {
            continue;
        }
        let points: Vec<PointStart> = rests.iter().map(|rest| rest.point.clone()).collect();
        let mut ends = specimen.call(&points, UPDATE)?.points;
        let later = specimen.lasting(10.0, &points, UPDATE)?;
        if first_difference(&ends, &later).is_some() {
            // What creeps or relaxes does not in no time.
            ends = specimen.lasting(INSTANT, &points, UPDATE)?;
        }
        let moving: Vec<_> = rests
            .iter()
            .zip(&ends)
            .filter(|(rest, end)| rest.moves(end))
            .collect();
        n += rests.len();
        if let Some((rest, end)) = moving.first()
            && moving.len() as f64 >= MOST_MOVE * STARTS as f64
        {
            let Rest { point, .. } = rest;
            let why = format!(
                "{}: `init_state` gives internal variables {:?} to the flux {:?}, and an increment of zero \
                 changes them to {:?} and {:?}, as with {} of {STARTS} other fluxes",
                specimen.name(),
                point.state0,
                point.flux0,
                end.state,
                end.flux,
                moving.len() - 1
            );
            return Err(specimen.recorded(point, Verdict::Warning(why)));
        }
    }
    if n == 0 {
        return Err(skipped(
            "no internal variable follows from the initial flux",
        ));
    }
    Ok(format!("{n} fluxes"))
}

/// Components of the initial flux that an internal variable follows from. The others may be more than
/// a law carries, whatever it makes of these: shear, where friction begins with nothing.
fn followed(specimen: &Specimen) -> Result<Vec<bool>, Verdict> {
    let pressure = 100.0;
    let plain = specimen.under_pressure(pressure);
    let before = specimen.initial_state(&plain)?;
    (0..plain.len())
        .map(|c| {
            let mut flux = plain.clone();
            flux[c] += 1e-2 * pressure;
            Ok(specimen.initial_state(&flux)? != before)
        })
        .collect()
}

fn hypotheses_agree(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "hypotheses");
    let specimens = subject.specimens_by_default(3, &mut random)?;
    let mut n = 0;
    for specimen in &specimens {
        let offered = hypotheses(&specimen.law);
        let wanted = match specimen.hypothesis {
            Hypothesis::PlaneStrain => [Hypothesis::ThreeD, Hypothesis::Axisymmetric].as_slice(),
            Hypothesis::Axisymmetric => [Hypothesis::ThreeD].as_slice(),
            Hypothesis::Interface2d => [Hypothesis::Interface3d].as_slice(),
            _ => continue,
        };
        let larger = wanted
            .iter()
            .find_map(|h| offered.iter().find(|(_, o)| o == h));
        let Some((formulation, hypothesis)) = larger else {
            continue;
        };
        let ids = |f: &law::FormulationDescription| -> Vec<String> {
            f.internal_variables.iter().map(|v| v.id.clone()).collect()
        };
        if ids(formulation) != ids(&specimen.formulation) {
            continue;
        }
        let form = create_form(formulation, *hypothesis, &specimen.values);
        let Some(probe) = specimen.law.probe(&form)?.probe else {
            return Err(specimen.fails(format!(
                "the same parameters are refused under {}",
                hypothesis.name()
            )));
        };
        let size = hypothesis.n_components();
        let longer = |values: &[f64]| -> Vec<f64> {
            let zeros = std::iter::repeat(0.0);
            values.iter().copied().chain(zeros).take(size).collect()
        };
        let steps = specimen.paths(24, &mut random)?.steps;
        let starts: Vec<PointStart> = steps
            .iter()
            .map(|step| PointStart {
                gradient0: longer(&step.start.gradient0),
                gradient1: longer(&step.start.gradient1),
                flux0: longer(&step.start.flux0),
                state0: step.start.state0.clone(),
            })
            .collect();
        let ends = probe.integrate(&starts, &specimen.form(UPDATE))?.points;
        for (step, end) in steps.iter().zip(&ends) {
            if let Some(why) = disagreement(step, end, size) {
                let why = format!(
                    "{} says otherwise: {why}, at {:?}",
                    hypothesis.name(),
                    step.start
                );
                return Err(specimen.fails_at(&step.start, why));
            }
            n += 1;
        }
    }
    if n == 0 {
        return Err(skipped("no law offers two hypotheses of one kind"));
    }
    Ok(format!("{n} points"))
}

/// What differs between a step in the plane and the same in more components.
fn disagreement(step: &Step, end: &PointEnd, size: usize) -> Option<String> {
    if !is_success(end.status) {
        return Some("the update fails".to_owned());
    }
    // Not tangents: at an edge of a yield surface, round-off chooses between those of its sides.
    let bound = ITERATED * flux_scale(step);
    for c in 0..size {
        let expected = step.end.flux.get(c).copied().unwrap_or(0.0);
        if (end.flux[c] - expected).abs() > bound {
            return Some(format!("flux {:?} and {:?}", step.end.flux, end.flux));
        }
    }
    None
}

fn tangential_axis_is_arbitrary(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "mirror");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        if !specimen.hypothesis.is_interface() {
            continue;
        }
        // The normal direction stays.
        let mut signs = vec![-1.0; specimen.probe.n_components()];
        signs[0] = 1.0;
        let mirror = DMatrix::from_diagonal(&DVector::from_vec(signs));
        for _ in 0..TWINS {
            n += twin(
                &specimen,
                &mirror,
                &mirror,
                ("mirrored", ROUND_OFF),
                &mut random,
            )?
            .map_err(|unlike| {
                margins::note(unlike.part.0, unlike.part.1);
                let name = specimen.name();
                specimen.recorded(&unlike.start, Verdict::Warning(format!("{name}: {unlike}")))
            })?;
        }
    }
    if n == 0 {
        return Err(skipped("there is no interface law"));
    }
    Ok(format!("{n} points"))
}

/// Pairs of points that are led side by side, and the increments of each.
const TWINS: usize = 24;
const TWIN_INCREMENTS: usize = 8;
/// Differences of fluxes after several increments, relative to the fluxes in play: substeps whose number
/// follows from a tolerance need not be the same in other axes.
const ROTATED: f64 = 1e-4;

/// Fluxes of a point and of its image that do not belong together.
struct Unlike {
    /// How far, as a part of the threshold of this name.
    part: (&'static str, f64),
    start: PointStart,
    flux: Vec<f64>,
    image: Vec<f64>,
    expected: Vec<f64>,
}

impl std::fmt::Display for Unlike {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            start,
            flux,
            image,
            expected,
            ..
        } = self;
        write!(
            f,
            "flux {flux:?}, turned {expected:?}, is {image:?} where the increment is turned, at \
             {start:?}"
        )
    }
}

/// Leads a point along a random path from an initial flux of any direction, and its image under a
/// change of axes along that of the path. Increments at which both were compared.
fn twin(
    specimen: &Specimen,
    of_fluxes: &DMatrix<f64>,
    of_gradients: &DMatrix<f64>,
    (name, tolerance): (&'static str, f64),
    random: &mut Random,
) -> Result<Result<usize, Unlike>, Verdict> {
    let turned = |by: &DMatrix<f64>, values: &[f64]| -> Vec<f64> {
        (by * DVector::from_row_slice(values)).as_slice().to_vec()
    };
    let origin = specimen.origin(random)?;
    // An initial flux with a direction, if the law can start there; else the pressure alone.
    let pressure = largest(&origin.start.flux0);
    let mut flux = origin.start.flux0.clone();
    for (c, value) in flux.iter_mut().enumerate() {
        let part = if c < specimen.n_normal() { 0.2 } else { 0.1 };
        *value += part * pressure * random.between(-1.0, 1.0);
    }
    let directed = specimen.started(flux)?.unwrap_or(origin);
    let image = specimen.started(turned(of_fluxes, &directed.start.flux0))?;
    // A law may refuse what a little rounding adds.
    let Ok(Origin {
        start: mut second, ..
    }) = image
    else {
        return Ok(Ok(0));
    };
    let Origin {
        start: mut first,
        stiffness,
        size,
    } = directed;
    let mut n = 0;
    let mut move_ = Vec::new();
    for increment in 0..TWIN_INCREMENTS {
        if increment % 4 == 0 {
            move_ = specimen.direction(size * random.logarithmic(0.03, 100.0), random);
        }
        first.gradient1 = sum(&first.gradient0, &move_);
        second.gradient1 = sum(&second.gradient0, &turned(of_gradients, &move_));
        let mut ends = specimen
            .call(
                &[first.clone(), second.clone()],
                raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
            )?
            .points;
        let (Some(b), Some(a)) = (ends.pop(), ends.pop()) else {
            break;
        };
        if !(is_success(a.status) && is_success(b.status)) {
            break;
        }
        let expected = turned(of_fluxes, &a.flux);
        let scale = largest(&a.flux)
            .max(largest(&first.flux0))
            .max(stiffness * largest(&move_));
        let pairs = expected.iter().zip(&b.flux);
        let off = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        if off > tolerance * scale || off.is_nan() {
            return Ok(Err(Unlike {
                part: (name, off / (tolerance * scale)),
                start: second,
                flux: a.flux,
                image: b.flux,
                expected,
            }));
        }
        margins::note(name, off / (tolerance * scale));
        n += 1;
        for (point, end) in [(&mut first, a), (&mut second, b)] {
            point.gradient0.clone_from(&point.gradient1);
            point.flux0 = end.flux;
            point.state0 = end.state;
        }
    }
    Ok(Ok(n))
}

/// A rotation of space, about axis 3 if components are those of a plane: how it turns stresses, and
/// strains with γ = 2ε.
fn rotation(n_components: usize, random: &mut Random) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut angle = || random.between(0.0, std::f64::consts::TAU);
    let turn = if n_components == 4 {
        nalgebra::Rotation3::from_euler_angles(0.0, 0.0, angle())
    } else {
        nalgebra::Rotation3::from_euler_angles(angle(), angle(), angle())
    };
    let q = turn.matrix();
    // 11, 22, 33, 12, 13, 23.
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let stress = DMatrix::from_fn(n_components, n_components, |row, column| {
        let ((i, j), (k, l)) = (pairs[row], pairs[column]);
        let once = q[(i, k)] * q[(j, l)];
        if k == l {
            once
        } else {
            once + q[(i, l)] * q[(j, k)]
        }
    });
    let strain = DMatrix::from_fn(n_components, n_components, |row, column| {
        let double = |c: usize| if c < 3 { 1.0 } else { 2.0 };
        stress[(row, column)] * double(row) / double(column)
    });
    (stress, strain)
}

fn response_is_isotropic(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "isotropy");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        let components = specimen.probe.n_components();
        if components < 4 || specimen.formulation.local_axes {
            continue;
        }
        for _ in 0..TWINS {
            let (of_fluxes, of_gradients) = rotation(components, &mut random);
            let mut found = twin(
                &specimen,
                &of_fluxes,
                &of_gradients,
                ("rotated", ROTATED),
                &mut random,
            )?;
            // Where a law branches, rounding may take the other branch: a fault shows again and again.
            for _ in 0..2 {
                if found.is_err() {
                    let (of_fluxes, of_gradients) = rotation(components, &mut random);
                    found = twin(
                        &specimen,
                        &of_fluxes,
                        &of_gradients,
                        ("rotated", ROTATED),
                        &mut random,
                    )?;
                }
            }
            n += found.map_err(|unlike| {
                margins::note(unlike.part.0, unlike.part.1);
                let hint = shear_factor(&specimen, &mut random).map_or(String::new(), |factor| {
                    format!(
                        "; the shear modulus is {factor:.3} times (D11 − D12)/2, where shear \
                         strains are γ = 2ε"
                    )
                });
                let verdict = Verdict::Warning(format!(
                    "{}: {unlike}{hint}; a law that is meant to have directions says so in its \
                     `doc`",
                    specimen.name()
                ));
                specimen.recorded(&unlike.start, verdict)
            })?;
        }
    }
    if n == 0 {
        return Err(skipped("no law of solids is without axes of its own"));
    }
    Ok(format!("{n} increments"))
}

/// What the elastic shear modulus is of that which belongs to the normal components, if it is another.
fn shear_factor(specimen: &Specimen, random: &mut Random) -> Option<f64> {
    let start = specimen.origin(random).ok()?.start;
    let answer = specimen.call(&[start], ELASTIC).ok()?;
    let d = &answer.points.first()?.tangent;
    let n = specimen.probe.n_components();
    let factor = d[3 * n + 3] / (0.5 * (d[0] - d[1]));
    ((factor - 1.0).abs() > 1e-6 && factor.is_finite()).then_some(factor)
}

/// How much stronger in tension than in compression a law is that has signs confused.
const STRONGER: f64 = 1.05;

fn compression_is_negative(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "compression");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        if specimen.course.is_some() {
            return Err(skipped("the path is the author's"));
        }
        for pressure in [10.0, 100.0, 1000.0] {
            let sheared = |pressure: f64| -> Result<Option<(PointStart, f64)>, Verdict> {
                let flux = specimen.under_pressure(pressure);
                let Ok(origin) = specimen.started(flux)? else {
                    return Ok(None);
                };
                sheared_far(&specimen, origin).map(Some)
            };
            let (compressed, pulled) = (sheared(pressure)?, sheared(-pressure)?);
            let why = match (&compressed, &pulled) {
                (None, Some(_)) => format!(
                    "it starts from a tension of {pressure} kPa, but not from as much compression"
                ),
                (Some((_, compressed)), Some((_, pulled))) if *pulled > STRONGER * compressed => {
                    format!(
                        "under a tension of {pressure} kPa it carries a shear stress of \
                         {pulled:.6e} kPa, under as much compression {compressed:.6e}"
                    )
                }
                _ => String::new(),
            };
            if let (false, Some((start, _))) = (why.is_empty(), &pulled) {
                let name = specimen.name();
                let why = format!("{name}: {why}; compression is negative here");
                return Err(specimen.recorded(start, Verdict::Warning(why)));
            }
            n += 1;
        }
    }
    Ok(format!("{n} pressures"))
}

/// Shears a point, at constant other gradients, far beyond its elastic range: the largest shear stress,
/// and the increment that led there.
fn sheared_far(specimen: &Specimen, origin: Origin) -> Result<(PointStart, f64), Verdict> {
    let Origin {
        start: mut point,
        size,
        ..
    } = origin;
    let shear = specimen.n_normal();
    let mut most = (point.clone(), 0.0_f64);
    let mut length = 0.03 * size;
    while length < 1e3 * size {
        point.gradient1[shear] += length;
        let mut ends = specimen
            .call(std::slice::from_ref(&point), raw::PILUM_REQ_FLUX)?
            .points;
        let Some(end) = ends.pop().filter(|end| is_success(end.status)) else {
            break;
        };
        if end.flux[shear].abs() > most.1 {
            most = (point.clone(), end.flux[shear].abs());
        }
        point.gradient0.clone_from(&point.gradient1);
        point.flux0 = end.flux;
        point.state0 = end.state;
        length *= 1.5;
    }
    Ok(most)
}

/// What sine, cosine and tangent repeat after, in degrees that are taken for radians, and in radians
/// that are turned into degrees once more.
const PERIODS: [f64; 2] = [
    std::f64::consts::TAU,
    std::f64::consts::TAU * std::f64::consts::PI / 180.0,
];

fn angles_are_degrees(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "angles");
    let mut n = 0;
    for specimen in subject.specimens_by_default(3, &mut random)? {
        let angles = specimen.law.description().parameters.iter().enumerate();
        let angles: Vec<usize> = angles
            .filter(|(i, p)| p.unit == "deg" && specimen.values[*i].is_finite())
            .map(|(i, _)| i)
            .collect();
        if angles.is_empty() {
            continue;
        }
        let steps = specimen.paths(12, &mut random)?.steps;
        for i in angles {
            // The largest difference that another value of the angle makes; nothing where it is refused.
            let effect = |by: f64| -> Result<Option<f64>, Verdict> {
                let mut values = specimen.values.clone();
                values[i] += by;
                if !specimen.law.description().parameters[i]
                    .bounds
                    .contain(values[i])
                {
                    return Ok(None);
                }
                let form = create_form(&specimen.formulation, specimen.hypothesis, &values);
                let Some(probe) = specimen.law.probe(&form)?.probe else {
                    return Ok(None);
                };
                let starts: Vec<PointStart> = steps.iter().map(|s| s.start.clone()).collect();
                let ends = probe.integrate(&starts, &specimen.form(raw::PILUM_REQ_FLUX))?;
                let differences = steps.iter().zip(&ends.points).map(|(step, end)| {
                    if !is_success(end.status) {
                        return f64::INFINITY;
                    }
                    let pairs = step.end.flux.iter().zip(&end.flux);
                    let most = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
                    most / flux_scale(step)
                });
                Ok(Some(differences.fold(0.0, f64::max)))
            };
            for period in PERIODS {
                for by in [period, -period] {
                    // Half a period less a little: neither does the tangent repeat there.
                    let (Some(whole), Some(part)) = (effect(by)?, effect(0.4 * by)?) else {
                        continue;
                    };
                    n += 1;
                    if whole < ITERATED && part > 1e3 * ITERATED {
                        let p = &specimen.law.description().parameters[i];
                        return Err(specimen.fails(format!(
                            "`{}` = {} and {} give the same fluxes, others between do not: angles \
                             come in degrees",
                            p.id,
                            specimen.values[i],
                            specimen.values[i] + by
                        )));
                    }
                }
            }
        }
    }
    if n == 0 {
        return Err(skipped("no parameter is an angle"));
    }
    Ok(format!("{n} pairs of angles"))
}

/// Whether the flux depends on how long an increment takes.
pub(super) fn depends_on_time(specimen: &Specimen, steps: &[Step]) -> Result<bool, Verdict> {
    let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
    let slower = specimen.lasting(10.0, &starts, raw::PILUM_REQ_FLUX)?;
    let mut pairs = steps.iter().zip(&slower);
    Ok(pairs.any(|(step, slower)| step.end.flux != slower.flux))
}

fn plastic_work_is_not_negative(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "work");
    let (mut n_steps, mut least) = (0, -1e-6);
    let mut worst = None;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        let steps = specimen.paths(36, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let elastic = specimen.call(&starts, ELASTIC)?.points;
        let Some(first) = elastic.first() else {
            continue;
        };
        // What creeps back gives work that was stored.
        if depends_on_time(&specimen, &steps)? {
            continue;
        }
        let constant = elastic.iter().all(|end| {
            let pairs = end.tangent.iter().zip(&first.tangent);
            pairs
                .into_iter()
                .all(|(a, b)| (a - b).abs() <= ROUND_OFF * largest(&first.tangent))
        });
        let n = first.flux.len();
        let Some(compliance) = DMatrix::from_row_slice(n, n, &first.tangent).try_inverse() else {
            continue;
        };
        if !constant {
            continue;
        }
        for step in &steps {
            let flux = DVector::from_row_slice(&step.end.flux);
            let change = &flux - DVector::from_row_slice(&step.start.flux0);
            let moved = DVector::from_vec(increment(&step.start));
            let work = flux.dot(&(&moved - &compliance * change));
            let relative = work / (flux_scale(step) * largest(moved.as_slice()));
            if relative < least {
                least = relative;
                let verdict = Verdict::Warning(format!(
                    "the plastic work is negative, {relative:.1e} of the work in play: {}, at {:?}",
                    specimen.name(),
                    step.start
                ));
                worst = Some(specimen.recorded(&step.start, verdict));
            }
            n_steps += 1;
        }
    }
    if n_steps == 0 {
        return Err(skipped(
            "no law that is independent of time has a constant elastic operator",
        ));
    }
    worst.map_or(Ok(format!("{n_steps} steps")), Err)
}
