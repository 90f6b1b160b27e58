//! Does a point that does not move stay where it is?

use super::{ITERATED, UPDATE, flux_scale, increment, largest};
use crate::check::loading_path::{Origin, Step};
use crate::check::random::Random;
use crate::check::specimen::{INSTANT, Specimen, first_difference, is_finite, is_success};
use crate::check::{Found, Subject, Verdict, skipped, status_name};
use abi::raw;
use law::probe::{Form, PointEnd, PointStart};

pub(super) fn zero_increment_changes_nothing(subject: &Subject) -> Found {
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
            told: step.start.clone(),
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
                let Rest { point, told, .. } = rest;
                let what = if is_success(end.status) {
                    format!(
                        "to {:?}, internal variables {:?} to {:?}",
                        end.flux, point.state0, end.state
                    )
                } else {
                    format!("to a failure, {}", status_name(end.status))
                };
                let why = format!("an increment of zero changes flux {:?} {what}", point.flux0);
                return Err(specimen.fails_at(told, why));
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
                return Err(specimen.fails_at(&rest.told, why));
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
    /// The call that a capsule has: the increment that has led there, so that a replay leads there too.
    told: PointStart,
    /// Flux that counts as zero.
    flux: f64,
    /// The increment before, and the internal variables before it.
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
pub(in crate::check) fn counts(specimen: &Specimen, steps: &[Step], k: usize) -> bool {
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

pub(super) fn initial_states_fit(subject: &Subject) -> Found {
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
                    told: start.clone(),
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
