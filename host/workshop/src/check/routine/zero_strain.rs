//! Does a routine stay where it is without strain? If not: what has the increment before that left unreturned?

use super::messages::{Words, has_sidecar, is_mfront};
use super::{differ, each};
use crate::check::coverage::beyond_elastic;
use crate::check::loading_path::Step;
use crate::check::mathematics::{ELASTIC, ITERATED, depends_on_time, flux_scale, largest};
use crate::check::specimen::{Specimen, is_success};
use crate::check::{Found, Subject, Verdict, refusal, skipped};
use abi::raw;
use law::probe::PointStart;

/// How much longer a rest is, to see whether that matters.
const LONGER: f64 = 1e3;

pub(super) fn routine_stays_at_rest(subject: &Subject) -> Found {
    let n = each(subject, "rest", |routine, steps, _| {
        // An MFront behaviour does not say whether it depends on the time.
        if routine.formulation.time_dependent
            || is_mfront(routine) && depends_on_time(routine, steps)?
        {
            return Ok(0);
        }
        let Words { strain, stress, .. } = Words::of(routine);
        let still: Vec<PointStart> = steps
            .iter()
            .map(|step| PointStart {
                gradient0: step.start.gradient1.clone(),
                gradient1: step.start.gradient1.clone(),
                flux0: step.end.flux.clone(),
                state0: step.end.state.clone(),
            })
            .collect();
        let answer = routine.call(&still, raw::PILUM_REQ_FLUX)?;
        for ((step, point), end) in steps.iter().zip(&still).zip(&answer.points) {
            if !is_success(end.status) {
                let why = refusal(end.status, answer.text().as_deref());
                return Err(routine.fails_at(point, format!("{strain} = 0 is refused: {why}")));
            }
            if differ(&end.flux, &step.end.flux, ITERATED * flux_scale(step)) {
                let hint = if let Some(hint) = unreturned(routine, step)? {
                    hint
                } else if has_sidecar(routine) && moves_with_time(routine, point)? {
                    "; what the time does is declared by `time_dependent = true` in the sidecar"
                        .to_owned()
                } else {
                    String::new()
                };
                let why = format!(
                    "{strain} = 0 changes {stress} {:?} to {:?}{hint}",
                    step.end.flux, end.flux
                );
                // A replay goes on from the end of the increment, too.
                return Err(routine.fails_at(&step.start, why));
            }
        }
        Ok(steps.len())
    })?;
    if n == 0 {
        return Err(skipped("the routine depends on the time"));
    }
    Ok(format!("{n} increments"))
}

/// How near a component is to what elasticity alone makes of it, and how far others are.
const PREDICTED: [f64; 2] = [1e-10, 1e-6];

/// Arguments that an increment has left unchanged, bit by bit, or as elasticity alone makes them,
/// by the routine's names. A component that is zero says nothing.
fn unreturned(routine: &Specimen, step: &Step) -> Result<Option<String>, Verdict> {
    let words = Words::of(routine);
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
