//! Does a point that does not move stay where it is? If not: what has the increment before that left unreturned?

use crate::check::coverage::beyond_elastic;
use crate::check::draw::Draw;
use crate::check::loading_path::{Origin, Step, flux_scale, starts};
use crate::check::points::{
    ELASTIC, ITERATED, UPDATE, apart, at_rest, first_difference, increment, is_finite, is_success,
    largest,
};
use crate::check::random::Random;
use crate::check::specimen::{INSTANT, Specimen};
use crate::check::{Found, Subject, Verdict, counted, refusal, status_name};
use abi::raw;
use law::probe::{Form, PointEnd, PointStart};

/// The ends of steps, from which a point does not move.
fn resting(steps: &[Step]) -> Vec<PointStart> {
    let still = |step: &Step| at_rest(&step.start.gradient1, &step.end.flux, &step.end.state);
    steps.iter().map(still).collect()
}

pub(super) fn zero_increment_changes_nothing(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "zero", 4, |specimen, random| {
        let steps = specimen.paths(30, random)?.steps;
        let slower = specimen.lasting(10.0, &starts(&steps), raw::PILUM_REQ_FLUX)?;
        let pairs = || steps.iter().zip(&slower);
        if pairs().any(|(step, slower)| step.end.flux != slower.flux) {
            return Ok(0);
        }
        // A rate that is stored, and what counts, are others at rest.
        let is_rate = |k: usize| {
            pairs().any(|(step, slower)| step.end.state[k].to_bits() != slower.state[k].to_bits())
        };
        let may_change: Vec<bool> = (0..specimen.probe.n_states())
            .map(|k| counts(specimen, &steps, k) || is_rate(k))
            .collect();
        let points = resting(&steps);
        let rests: Vec<Rest> = steps
            .iter()
            .zip(&points)
            .map(|(step, point)| Rest {
                told: step.start.clone(),
                point: point.clone(),
                flux: ITERATED * flux_scale(step),
                size: largest(&increment(&step.start)),
                before: step.start.state0.clone(),
                may_change: may_change.clone(),
            })
            .collect();
        let ends = specimen.call(&points, UPDATE)?.points;
        let mut all = rests.iter().zip(&ends);
        if let Some((Rest { point, told, .. }, end)) = all.find(|(rest, end)| rest.moves(end)) {
            let what = if is_success(end.status) {
                format!(
                    "to {:?}, internal variables {:?} to {:?}",
                    end.flux, point.state0, end.state
                )
            } else {
                format!("to a failure, {}", status_name(end.status))
            };
            let why = format!("an increment of zero changes flux {:?} {what}", point.flux0);
            return Err(specimen.fails_for(told, why));
        }
        drifts(specimen, &rests)?;
        Ok(rests.len())
    })?;
    counted(n, "points", "all laws depend on the time increment")
}

/// How much longer a rest is, to see whether that matters.
const LONGER: f64 = 1e3;

pub(in crate::check) fn routine_stays_at_rest(subject: &Subject) -> Found {
    let n = subject.each_walk("rest", |routine, steps, _| {
        // An MFront behaviour does not say whether it depends on the time.
        if routine.formulation.time_dependent
            || routine.is_mfront() && routine.depends_on_time(steps)?
        {
            return Ok(0);
        }
        let words = routine.words();
        let still = resting(steps);
        let answer = routine.call(&still, raw::PILUM_REQ_FLUX)?;
        for ((step, point), end) in steps.iter().zip(&still).zip(&answer.points) {
            if !is_success(end.status) {
                let why = refusal(end.status, answer.text().as_deref());
                let why = format!("{} = 0 is refused: {why}", words.strain);
                return Err(routine.fails_for(point, why));
            }
            if apart(&end.flux, &step.end.flux) > ITERATED * flux_scale(step) {
                let hint = if let Some(hint) = unreturned(routine, step)? {
                    hint
                } else if routine.has_sidecar() && moves_with_time(routine, point)? {
                    "; what the time does is declared by `time_dependent = true` in the sidecar"
                        .to_owned()
                } else {
                    String::new()
                };
                let why = format!(
                    "{} = 0 changes {} {:?} to {:?}{hint}",
                    words.strain, words.stress, step.end.flux, end.flux
                );
                // A replay goes on from the end of the increment, too.
                return Err(routine.fails_for(&step.start, why));
            }
        }
        Ok(steps.len())
    })?;
    counted(n, "increments", "the routine depends on the time")
}

/// How near a component is to what elasticity alone makes of it, and how far others are.
const PREDICTED: [f64; 2] = [1e-10, 1e-6];

/// Arguments that an increment has left unchanged, bit by bit, or as elasticity alone makes them,
/// by the routine's names. A component that is zero says nothing.
fn unreturned(routine: &Specimen, step: &Step) -> Result<Option<String>, Verdict> {
    let words = routine.words();
    let components = routine.hypothesis.components();
    let stress = |c: usize| format!("{}({}), {}", words.stress, c + 1, components[c]);
    let stays = |from: f64, to: f64| from.to_bits() == to.to_bits();
    let fluxes = step.start.flux0.iter().zip(&step.end.flux).enumerate();
    let fluxes = fluxes.filter(|(_, (from, to))| **to != 0.0 && stays(**from, **to));
    let variables = &routine.formulation.internal_variables;
    let states = step.start.state0.iter().zip(&step.end.state).enumerate();
    let states = states
        .filter(|(_, (from, to))| stays(**from, **to))
        .map(|(k, _)| format!("{}({}), `{}`", words.state, k + 1, variables[k].id));
    let left: Vec<String> = fluxes.map(|(c, _)| stress(c)).chain(states).collect();
    if !left.is_empty() {
        return Ok(Some(format!(
            "; the increment before that has left {}, as it was: is it returned?",
            left.join(", and ")
        )));
    }
    let start = std::slice::from_ref(&step.start);
    let elastic = routine.call(start, ELASTIC)?.points;
    let off = beyond_elastic(step, &elastic[0]);
    let scale = flux_scale(step);
    let is_predicted = |c: &usize| off[*c] <= PREDICTED[0] * scale && step.end.flux[*c] != 0.0;
    let predicted: Vec<String> = (0..off.len()).filter(is_predicted).map(stress).collect();
    let is_inelastic = largest(&off) > PREDICTED[1] * scale;
    Ok((is_inelastic && !predicted.is_empty()).then(|| {
        format!(
            "; in the increment before that {}, is what elasticity alone gives, and others are not: is it corrected?",
            predicted.join(", and ")
        )
    }))
}

/// Whether a stress at rest depends on how long the rest is.
fn moves_with_time(routine: &Specimen, point: &PointStart) -> Result<bool, Verdict> {
    let points = std::slice::from_ref(point);
    let usual = routine.call(points, raw::PILUM_REQ_FLUX)?.points;
    let longer = routine.lasting(LONGER, points, raw::PILUM_REQ_FLUX)?;
    Ok(usual[0].flux != longer[0].flux)
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
                return Err(specimen.fails_for(&rest.told, why));
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

/// Initial fluxes of one law, and the part of them that has to move for a fault of `init_state`: it may
/// be asked for more than a law can carry.
const STARTS: usize = 24;
const MOST_MOVE: f64 = 0.9;

/// Points at rest under initial fluxes, of which the components that internal variables follow from are random.
fn sheared(specimen: &Specimen, random: &mut Random) -> Result<Vec<Rest>, Verdict> {
    let followed = followed(specimen)?;
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
        if let Ok(Origin { start, size, .. }) = specimen.started(&flux)? {
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
    Ok(rests)
}

pub(super) fn initial_states_fit(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "initial fluxes", 4, |specimen, random| {
        if specimen.course.is_some() || specimen.probe.init_state(&[], &Form::of(0))?.is_none() {
            return Ok(0);
        }
        let rests = sheared(specimen, random)?;
        // A law that has the same state for all of them does not fit it to any.
        let mut pairs = rests.windows(2);
        if pairs.all(|pair| pair[0].before == pair[1].before) {
            return Ok(0);
        }
        let points: Vec<PointStart> = rests.iter().map(|rest| rest.point.clone()).collect();
        let mut ends = specimen.call(&points, UPDATE)?.points;
        let later = specimen.lasting(10.0, &points, UPDATE)?;
        if first_difference(&ends, &later).is_some() {
            // What creeps or relaxes does not in no time.
            ends = specimen.lasting(INSTANT, &points, UPDATE)?;
        }
        let pairs = rests.iter().zip(&ends);
        let moving: Vec<_> = pairs.filter(|(rest, end)| rest.moves(end)).collect();
        if let Some((Rest { point, .. }, end)) = moving.first()
            && moving.len() as f64 >= MOST_MOVE * STARTS as f64
        {
            let why = format!(
                "`init_state` gives internal variables {:?} to the flux {:?}, and an increment of zero \
                 changes them to {:?} and {:?}, as with {} of {STARTS} other fluxes",
                point.state0,
                point.flux0,
                end.state,
                end.flux,
                moving.len() - 1
            );
            return Err(specimen.warns_for(point, why));
        }
        Ok(rests.len())
    })?;
    counted(
        n,
        "fluxes",
        "no internal variable follows from the initial flux",
    )
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
