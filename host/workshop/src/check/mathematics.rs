//! Are operators, flags and restrictions what they claim to be?

use super::random::Random;
use super::specimen::{Specimen, Step, create_form, hypotheses, is_success};
use super::{Check, Family, Found, Subject, Verdict, skipped};
use abi::Hypothesis;
use abi::raw;
use law::Tangent;
use law::probe::{Form, PointEnd, PointRates, PointStart};
use nalgebra::{DMatrix, DVector};

const NEEDS: &[&str] = &["repeatable", "results-are-finite", "writes-stay-inside"];

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "tangent-matches-differences",
        family: Family::Mathematics,
        description: "The consistent tangent is the derivative of the update, within 10⁻⁴ of the \
                      elastic stiffness, on random paths. Where differences to the two sides \
                      disagree, the point is at a kink and exempt; so are laws that declare an \
                      approximate tangent or none.",
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
        description: "After an update, an increment of zero keeps flux and internal variables; \
                      laws that depend on time are passed over.",
        needs: NEEDS,
        run: zero_increment_changes_nothing,
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
        id: "plastic-work-is-not-negative",
        family: Family::Mathematics,
        description: "With a constant elastic operator, flux times inelastic part of the \
                      increment is not negative (warning, since energy stored by hardening may \
                      come back).",
        needs: NEEDS,
        run: plastic_work_is_not_negative,
    },
];

const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;
const ELASTIC: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC;
/// Error of a tangent, relative to the largest stiffness. Differences are good to 10⁻⁶ or so.
const TANGENT: f64 = 1e-4;
/// Differences of fluxes between two ways to compute them, relative to the fluxes in play.
/// Return mappings iterate to about 10⁻¹⁰.
const ITERATED: f64 = 1e-8;
/// Asymmetry, relative to the largest entry.
const ROUND_OFF: f64 = 1e-9;
/// Lengths of difference steps, relative to the increment.
const LENGTHS: [f64; 3] = [1e-3, 1e-5, 1e-7];

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}

fn increment(start: &PointStart) -> Vec<f64> {
    let pairs = start.gradient1.iter().zip(&start.gradient0);
    pairs.map(|(end, begin)| end - begin).collect()
}

/// Fluxes in play in a step.
fn flux_scale(step: &Step) -> f64 {
    let moved = step.stiffness * largest(&increment(&step.start));
    largest(&step.end.flux)
        .max(largest(&step.start.flux0))
        .max(moved)
}

/// What differences say of a tangent.
enum Slope {
    Right,
    Kink,
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
    for specimen in subject.specimens_by_default(5, &mut random)? {
        let steps = specimen.walk(36, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        if specimen.formulation.tangent != Tangent::Consistent {
            continue;
        }
        let elastic = specimen.call(&starts, ELASTIC)?.points;
        // Every fifth, and one more each time, so that all increments of a straight piece occur.
        for i in (0..steps.len()).step_by(5) {
            let step = &steps[i];
            let scale = step.stiffness.max(largest(&step.end.tangent));
            let difference = elastic[i].tangent.iter().zip(&step.end.tangent);
            n_inelastic += usize::from(
                difference.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) > TANGENT * scale,
            );
            n += 1;
            match slope(&specimen, step, scale)? {
                Slope::Right => {}
                Slope::Kink => n_kinks += 1,
                Slope::Wrong {
                    row,
                    column,
                    by_law,
                    by_differences,
                } => {
                    let names = specimen.hypothesis.components();
                    return Err(specimen.fails(format!(
                        "row `{}`, column `{}` of the tangent is {by_law:.6e}, differences give \
                         {by_differences:.6e}: wrong by {:.1e} of the stiffness, at {:?}",
                        names[row],
                        names[column],
                        (by_law - by_differences).abs() / scale,
                        step.start
                    )));
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
    Ok(details)
}

/// Compares the tangent of a step with differences of three lengths.
fn slope(specimen: &Specimen, step: &Step, scale: f64) -> Result<Slope, Verdict> {
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
    for (l, _) in LENGTHS.iter().enumerate() {
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
                let by_law = step.end.tangent[row * n + c];
                let wrong = (by_differences - by_law).abs();
                let forward = (above - here) / up;
                let backward = (here - below) / -down;
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
        if disagreement.is_finite() && error <= TANGENT * scale {
            return Ok(Slope::Right);
        }
        if disagreement <= 0.1 * error {
            verdict = worst;
        }
    }
    Ok(verdict)
}

/// Error of rates, relative to those of the inputs times what differences show; these are good to
/// about 10⁻⁸.
const RATE: f64 = 1e-6;

fn rates_match_differences(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "rates");
    let (mut n, mut n_kinks) = (0, 0);
    for specimen in subject.specimens_by_default(4, &mut random)? {
        if !specimen.formulation.rates {
            continue;
        }
        let steps = specimen.walk(36, &mut random)?.steps;
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
        for step in specimen.walk(36, &mut random)?.steps {
            let k = &step.end.tangent;
            let n = step.end.flux.len();
            let bound = ROUND_OFF * largest(k).max(step.stiffness);
            for row in 0..n {
                for column in 0..row {
                    let names = specimen.hypothesis.components();
                    let (lower, upper) = (k[row * n + column], k[column * n + row]);
                    if (lower - upper).abs() > bound {
                        return Err(specimen.fails(format!(
                            "the tangent is declared symmetric, but row `{0}`, column `{1}` is \
                             {lower:.6e}, row `{1}`, column `{0}` {upper:.6e}, at {2:?}",
                            names[row], names[column], step.start
                        )));
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
        let steps = specimen.walk(20, &mut random)?.steps;
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
                return Err(specimen.fails(format!(
                    "declared linear, but {}, at {:?}",
                    if off {
                        "the tangent does not predict the flux"
                    } else {
                        "the tangent changes"
                    },
                    step.start
                )));
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
        let steps = specimen.walk(30, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let slower = Form {
            time_increment: 10.0,
            ..Form::of(raw::PILUM_REQ_FLUX)
        };
        let later = specimen.probe.integrate(&starts, &slower)?.points;
        let pairs = steps.iter().zip(&later);
        if pairs
            .clone()
            .any(|(step, later)| step.end.flux != later.flux)
        {
            continue;
        }
        let rest: Vec<PointStart> = steps
            .iter()
            .map(|step| PointStart {
                gradient0: step.start.gradient1.clone(),
                gradient1: step.start.gradient1.clone(),
                flux0: step.end.flux.clone(),
                state0: step.end.state.clone(),
            })
            .collect();
        for (step, end) in steps.iter().zip(specimen.call(&rest, UPDATE)?.points) {
            let bound = ITERATED * flux_scale(step);
            let flux = end.flux.iter().zip(&step.end.flux);
            let size = largest(&increment(&step.start));
            let state = end
                .state
                .iter()
                .zip(&step.end.state)
                .zip(&step.start.state0);
            let moved = !is_success(end.status)
                || flux.clone().any(|(a, b)| (a - b).abs() > bound)
                || state.clone().any(|((a, b), before)| {
                    (a - b).abs() > 1e-6 * b.abs().max((b - before).abs()).max(size)
                });
            if moved {
                return Err(specimen.fails(format!(
                    "an increment of zero changes flux {:?} to {:?}, internal variables {:?} to \
                     {:?}",
                    step.end.flux, end.flux, step.end.state, end.state
                )));
            }
            n += 1;
        }
    }
    if n == 0 {
        return Err(skipped("all laws depend on the time increment"));
    }
    Ok(format!("{n} points"))
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
        let steps = specimen.walk(24, &mut random)?.steps;
        let starts: Vec<PointStart> = steps
            .iter()
            .map(|step| PointStart {
                gradient0: longer(&step.start.gradient0),
                gradient1: longer(&step.start.gradient1),
                flux0: longer(&step.start.flux0),
                state0: step.start.state0.clone(),
            })
            .collect();
        let ends = probe.integrate(&starts, &Form::of(UPDATE))?.points;
        for (step, end) in steps.iter().zip(&ends) {
            if let Some(why) = disagreement(step, end, size) {
                return Err(specimen.fails(format!(
                    "{} says otherwise: {why}, at {:?}",
                    hypothesis.name(),
                    step.start
                )));
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
        // Signed internal variables would have to be reversed as well, so paths start fresh.
        for step in specimen.walk(60, &mut random)?.steps {
            if step.start.gradient0.iter().any(|jump| *jump != 0.0) {
                continue;
            }
            let mut mirrored = step.start.clone();
            for values in [&mut mirrored.gradient1, &mut mirrored.flux0] {
                values[1..].iter_mut().for_each(|value| *value = -*value);
            }
            let end = &specimen.call(&[mirrored], UPDATE)?.points[0];
            let bound = ROUND_OFF * flux_scale(&step);
            let same = is_success(end.status)
                && (end.flux[0] - step.end.flux[0]).abs() <= bound
                && (1..end.flux.len()).all(|c| (end.flux[c] + step.end.flux[c]).abs() <= bound);
            if !same {
                return Err(Verdict::Warning(format!(
                    "{}: traction {:?} becomes {:?}, at {:?}",
                    specimen.name(),
                    step.end.flux,
                    end.flux,
                    step.start
                )));
            }
            n += 1;
        }
    }
    if n == 0 {
        return Err(skipped("there is no interface law"));
    }
    Ok(format!("{n} points"))
}

fn plastic_work_is_not_negative(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "work");
    let (mut n_steps, mut least) = (0, 0.0_f64);
    let mut where_least = String::new();
    for specimen in subject.specimens_by_default(4, &mut random)? {
        let steps = specimen.walk(36, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let elastic = specimen.call(&starts, ELASTIC)?.points;
        let Some(first) = elastic.first() else {
            continue;
        };
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
                where_least = format!("{}, at {:?}", specimen.name(), step.start);
            }
            n_steps += 1;
        }
    }
    if n_steps == 0 {
        return Err(skipped("no law has a constant elastic operator"));
    }
    if least < -1e-6 {
        return Err(Verdict::Warning(format!(
            "the plastic work is negative, {least:.1e} of the work in play: {where_least}"
        )));
    }
    Ok(format!("{n_steps} steps"))
}
