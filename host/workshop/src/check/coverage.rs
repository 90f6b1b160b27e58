//! How far do the paths of the checks lead a law? One that is only ever asked what is elastic passes them all.

use super::draw::Draw;
use super::loading_path::{Step, flux_scale, starts};
use super::mathematics::NEEDS;
use super::points::{ELASTIC, ROUND_OFF, bits, increment, largest};
use super::specimen::Specimen;
use super::{Check, Found, Subject, Verdict, counted, skipped, warned};
use law::probe::PointEnd;
use std::fmt::Write as _;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "results-do-not-blow-up",
        description: "No flux or internal variable exceeds 10³⁰ on the paths, in whatever unit; \
                      the other checks end there (warning, since a path may be too long).",
        needs: NEEDS,
        run: results_do_not_blow_up,
    },
    Check {
        id: "paths-leave-elasticity",
        description: "With internal variables, some increments are inelastic or change one of \
                      them; no component of the flux with a stiffness stays constant (warning). \
                      Variables that never change are reported.",
        needs: NEEDS,
        run: paths_leave_elasticity,
    },
];

fn results_do_not_blow_up(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "blow up", 4, |specimen, random| {
        let walk = specimen.paths(N_FAR, random)?;
        match &walk.blown_up {
            Some(step) => Err(blows_up(specimen, step)),
            None => Ok(walk.steps.len()),
        }
    })?;
    counted(n, "increments", "no increment succeeded")
}

/// The warning of a step whose results are larger than any that mean something.
fn blows_up(specimen: &Specimen, step: &Step) -> Verdict {
    let names = specimen.hypothesis.components().iter().copied();
    let variables = specimen.formulation.internal_variables.iter();
    let names = names.chain(variables.map(|v| v.id.as_str()));
    let values = step.end.flux.iter().chain(&step.end.state);
    let before = step.start.flux0.iter().chain(&step.start.state0);
    let all = names.zip(before.zip(values));
    let worst = all.max_by(|(_, (_, a)), (_, (_, b))| a.abs().total_cmp(&b.abs()));
    let (name, (before, after)) = worst.unwrap_or(("n", (&0.0, &0.0)));
    let why = format!(
        "it has blown up: `{name}` goes from {before:e} to {after:e} in an increment. A scheme that is not \
         stable over it asks for a smaller one (PILUM_CUT_STEP) or takes substeps; what is not meant \
         to go so far ends with PILUM_E_DOMAIN. No check looks farther. At {}",
        specimen.at(&step.start)
    );
    specimen.warns_for(&step.start, why)
}

/// Increments of the random part of a path, and the most of any check.
const N_INCREMENTS: usize = 24;
const N_FAR: usize = 36;
/// Inelastic flux, relative to what is elastic in an increment.
const INELASTIC: f64 = 1e-6;

fn paths_leave_elasticity(subject: &Subject) -> Found {
    let mut n_inelastic = 0;
    let mut still: Option<Vec<String>> = None;
    let mut idle = None;
    let n = subject.each(Draw::DefaultChoices, "extent", 1, |specimen, random| {
        let walk = specimen.paths(N_INCREMENTS, random)?;
        let steps = &walk.steps;
        if steps.is_empty() {
            return Ok(0);
        }
        if let Some(why) = silent_component(specimen, steps) {
            return Err(specimen.warns_for(&steps[0].start, why));
        }
        let elastic = specimen.call(&starts(steps), ELASTIC)?.points;
        let pairs = steps.iter().zip(&elastic);
        let inelastic = pairs.filter(|(step, elastic)| is_inelastic(step, elastic));
        let n_own = inelastic.count();
        n_inelastic += n_own;
        let has_own = !specimen.formulation.internal_variables.is_empty();
        let is_idle = n_own == 0 && !steps.iter().any(changes_later);
        if is_idle && has_own && !specimen.formulation.linear && idle.is_none() {
            idle = Some((specimen.name(), walk.refusals.len(), walk.why()));
        }
        // Under none of the hypotheses, and with no parameters.
        let mut own = still_variables(specimen, steps);
        own.retain(|id| still.as_ref().is_none_or(|still| still.contains(id)));
        still = Some(own);
        Ok(steps.len())
    })?;
    if n == 0 {
        return Err(skipped("no increment succeeded"));
    }
    if let Some((name, n_refused, why)) = idle {
        let refused = if n_refused > 0 {
            format!("; {n_refused} increments did not succeed, the first one by {why}")
        } else {
            String::new()
        };
        return Err(warned(format!(
            "{name}: none of the increments leaves elasticity, and no internal variable changes after the first: no \
             check has seen what comes after yielding; other parameters by `--set`, or a path of your own by `--driver`{refused}"
        )));
    }
    let mut details = format!("{n} increments, {n_inelastic} of them inelastic");
    let still = still.unwrap_or_default();
    if n_inelastic > 0 && !still.is_empty() {
        let _ = write!(details, ", never changed: {}", still.join(", "));
    }
    Ok(details)
}

/// Whether an increment that is not the first one of a point changes an internal variable.
fn changes_later(step: &Step) -> bool {
    let is_later = step.start.gradient0.iter().any(|value| *value != 0.0);
    is_later && bits(&step.start.state0) != bits(&step.end.state)
}

/// Whether the flux is not what the elastic operator makes of the increment.
fn is_inelastic(step: &Step, elastic: &PointEnd) -> bool {
    let most = largest(&elastic.tangent) * largest(&increment(&step.start));
    largest(&beyond_elastic(step, elastic)) > INELASTIC * most + ROUND_OFF * flux_scale(step)
}

/// By how much each component of the flux is off what the elastic operator makes of the increment.
pub(super) fn beyond_elastic(step: &Step, elastic: &PointEnd) -> Vec<f64> {
    let moved = increment(&step.start);
    let n = moved.len();
    let off = (0..n).map(|row| {
        let entries = elastic.tangent[row * n..].iter().zip(&moved);
        let rise: f64 = entries.map(|(k, d)| k * d).sum();
        (step.end.flux[row] - step.start.flux0[row] - rise).abs()
    });
    off.collect()
}

/// A component of the flux that keeps its bits in all steps, though the tangent says otherwise; in words.
fn silent_component(specimen: &Specimen, steps: &[Step]) -> Option<String> {
    let names = specimen.hypothesis.components();
    let n = names.len();
    let stays = |c: usize| {
        let mut all = steps.iter();
        all.all(|step| step.end.flux[c].to_bits() == step.start.flux0[c].to_bits())
    };
    let has_stiffness = |c: usize| {
        let mut all = steps.iter();
        all.any(|step| {
            let stiffness = step.end.tangent[c * n + c].abs();
            let moved = increment(&step.start)[c];
            stiffness > ROUND_OFF * step.stiffness && moved != 0.0
        })
    };
    let c = (0..n).find(|&c| stays(c) && has_stiffness(c))?;
    Some(format!(
        "component `{}` of the flux, number {}, stays what it was in all of {} increments, though the tangent has a \
         stiffness for it: is it returned?",
        names[c],
        c + 1,
        steps.len()
    ))
}

/// Internal variables that keep their bits in all steps.
fn still_variables(specimen: &Specimen, steps: &[Step]) -> Vec<String> {
    let variables = specimen.formulation.internal_variables.iter().enumerate();
    let stays = |k: usize| {
        let mut all = steps.iter();
        all.all(|step| step.end.state[k].to_bits() == step.start.state0[k].to_bits())
    };
    variables
        .filter(|(k, _)| stays(*k))
        .map(|(_, v)| format!("`{}`", v.id))
        .collect()
}
