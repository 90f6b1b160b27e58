//! Libraries made for other programs: does a routine do what is said of it, in a sidecar or by itself, and
//! what can go wrong in it unseen?
//!
//! Every call goes through the adapter of a run, guard words included, in the process of the check.

mod axes;
mod beside;
mod first;
mod tangent;
mod words;

use super::extent::beyond_elastic;
use super::mathematics::{
    ELASTIC, ITERATED, UPDATE, depends_on_time, flux_scale, increment, largest,
};
use super::random::Random;
use super::specimen::{LONG, Specimen, first_difference, is_success};
use super::walk::{Refused, Step, sum};
use super::{Check, Family, Found, Subject, Verdict, course, refusal, skipped};
use crate::Error;
use abi::raw;
use abi::status::Outcome;
use beside::reads_beside;
use law::adapter::{Adapter, sidecar, sidecar_of};
use law::probe::{Form, PointEnd, PointStart};
use law::vetting::plausible;
use law::{Bounds, LoadedLaw, Site};
use std::path::Path;
use text::{Source, suggestion};
use words::{Words, advice, has_sidecar, is_mfront};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "sidecar-is-read",
        family: Family::Routine,
        description: "UMAT: the sidecar beside the library, or that of the driver, is there and makes sense; its \
                      parameters have a default or a usual range, or are set (warning). (What is \
                      asked of a UMAT here is asked of a UDSM and of MFront behaviours, too, along a driver.)",
        needs: &["file-is-a-library"],
        run: sidecar_is_read,
    },
    Check {
        id: "routine-answers",
        family: Family::Routine,
        description: "UMAT: under every hypothesis of the sidecar the routine is found with all that it \
                      calls, and a first call without any strain gives finite results.",
        needs: &["sidecar-is-read"],
        run: routine_answers,
    },
    Check {
        id: "routine-stays-inside",
        family: Family::Routine,
        description: "UMAT: on random paths and on those that go far, there and back, nothing is written or \
                      read beyond an array, nor written over sizes, names and PROPS, and PNEWDT is sound; results are finite \
                      on random ones; the process goes on: PNEWDT asks for a smaller increment, STOP and XIT end \
                      it; a copy that is used up is a warning.",
        needs: &["routine-answers"],
        run: routine_stays_inside,
    },
    Check {
        id: "routine-is-repeatable",
        family: Family::Routine,
        description: "UMAT: the same call gives the same bits after other calls, and in another image of \
                      the library: nothing is kept in SAVE or COMMON from point to point. In another place \
                      too, by NOEL, NPT, COORDS and CELENT (warning, since they may stand for properties).",
        needs: &["routine-stays-inside"],
        run: routine_is_repeatable,
    },
    Check {
        id: "routine-does-not-begin-again",
        family: Family::Routine,
        description: "UMAT: where a phase begins, with KINC = 1 and TIME(1) = 0, a routine goes on from its internal \
                      variables: STRESS is the same, and stays so in the next increment; with KSTEP = 1 too (warning). \
                      Where a routine depends on the time, TIME(1) is a warning. After a call of another step the usual \
                      one, made twice, gives the same both times.",
        needs: &["routine-is-repeatable"],
        run: first::routine_does_not_begin_again,
    },
    Check {
        id: "routine-stays-at-rest",
        family: Family::Routine,
        description: "UMAT: after an update, DSTRAN = 0 keeps STRESS; routines that depend on the time are \
                      passed over.",
        needs: &["routine-is-repeatable"],
        run: routine_stays_at_rest,
    },
    Check {
        id: "time-as-declared",
        family: Family::Routine,
        description: "UMAT: DTIME or TIME changes the response where the sidecar says `time_dependent = \
                      true`, and nowhere else (warning).",
        needs: &["routine-is-repeatable"],
        run: time_as_declared,
    },
    Check {
        id: "ddsdde-matches-differences",
        family: Family::Routine,
        description: "UMAT: DDSDDE is the derivative of STRESS within 10⁻⁴ of the stiffness, far beyond \
                      yielding and in unloading too (warning, with the largest error); it is not the \
                      transpose of it, and symmetric where the sidecar says so. Kinks are exempt; so is \
                      `tangent = \"approximate\"`.",
        needs: &["routine-is-repeatable"],
        run: tangent::ddsdde_matches_differences,
    },
    Check {
        id: "routine-agrees-in-the-plane",
        family: Family::Routine,
        description: "UMAT: with fewer components the routine gives what it gives with all of them: plane \
                      strain and axisymmetry what 3d gives, interface_2d what interface_3d gives.",
        needs: &["routine-is-repeatable"],
        run: axes::routine_agrees_in_the_plane,
    },
    Check {
        id: "tangential-directions-are-alike",
        family: Family::Routine,
        description: "UMAT: with the tangential directions of an interface turned (reversed in the plane), \
                      the traction is the same, turned (warning).",
        needs: &["routine-is-repeatable"],
        run: axes::tangential_directions_are_alike,
    },
];

/// Checks that mean the same for libraries of the contract.
pub(super) const SHARED: [&str; 3] = [
    "file-is-a-library",
    "description-is-complete",
    "units-are-known",
];

/// Those that mean the same for a routine, too, whose parameters and increments are random or far away. What
/// they fail of a law they warn of here: public routines are often imprecise, and are of use all the same.
pub(super) const OF_RESPONSES: [&str; 9] = [
    "response-is-isotropic",
    "compression-is-negative",
    "angles-are-degrees",
    "plastic-work-is-not-negative",
    "response-is-continuous",
    "states-are-carried-on",
    "plastic-variables-rest",
    "units-belong-together",
    "paths-leave-elasticity",
];

/// A routine that ends its process far away fails this check; others warn of it.
pub(super) const GOES_FAR: &str = "routine-stays-inside";

/// Increments of the random part of a path.
const N_INCREMENTS: usize = 36;
/// What time increments differ by, to see whether they matter.
const SLOWER: f64 = 1e3;
/// Increments that are asked for what is read beside arguments.
const MOST_READ: usize = 400;
/// Stress of the next increment that other internal variables make, relative to the stresses in play: substeps of
/// another length give another one within their tolerance.
const CARRIED: f64 = 1e-3;
/// Another time at which an increment begins.
const LATER: f64 = 1e5;

/// What a library is made for, if not for the contract. Nothing of it runs.
pub(super) fn adapter(path: &Path) -> Option<Adapter> {
    law::inspect::inspect(path).ok()?.adapter()
}

/// Whether a library is made for another program.
pub(super) fn is_one(path: &Path) -> bool {
    adapter(path).is_some()
}

/// Refuses a library whose description has no ranges that parameters could be drawn from.
///
/// # Errors
/// [`text::Error::Usage`].
pub(super) fn refuse_without_driver(path: &Path, has_driver: bool) -> Result<(), Error> {
    let what = match adapter(path) {
        Some(Adapter::Udsm) if !has_driver => "a UDSM of PLAXIS",
        Some(Adapter::Mfront) if !has_driver => "a library of MFront behaviours",
        _ => return Ok(()),
    };
    Err(Error::usage(format!(
        "{} is {what}, which says nothing of the ranges of its parameters: `--driver FILE` checks it along a \
         path of yours",
        path.display()
    )))
}

/// Refuses settings that the sidecar does not know, or whose values are outside its bounds.
///
/// # Errors
/// [`text::Error::Usage`]. What is wrong with the sidecar is for the checks to say.
pub(super) fn refuse_settings(settings: &[(String, f64)], path: &Path) -> Result<(), Error> {
    let source = sidecar_of(path).and_then(|sidecar| Source::read(&sidecar).ok());
    let Some(Ok(law)) = source.map(|source| sidecar(&source)) else {
        return Ok(());
    };
    for (id, value) in settings {
        let Some(p) = law.parameters.iter().find(|p| p.id == *id) else {
            let known = suggestion(id, law.parameters.iter().map(|p| p.id.as_str()));
            let message =
                format!("--set {id}={value}: the sidecar names no parameter `{id}`: {known}");
            return Err(Error::usage(message));
        };
        if !p.bounds.contain(*value) {
            let message = format!("--set {id}={value}: {value} is outside {}", p.bounds);
            return Err(Error::usage(message));
        }
    }
    Ok(())
}

/// What a check of responses says of a routine: it is not led far if its calls take long, and a failure of
/// a law is a warning.
pub(super) fn of_response(check: &Check, subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "speed");
    let routines = subject.specimens_by_default(1, &mut random)?;
    if routines.iter().any(|routine| routine.is_led_near) {
        let why = if subject.near {
            "it is not led far".to_owned()
        } else {
            format!("a call takes longer than {LONG:?}, so that paths are short")
        };
        return Err(skipped(why));
    }
    (check.run)(subject).map_err(Verdict::milder)
}

/// Walks of every routine, far too; what is made of each of them.
fn each(
    subject: &Subject,
    name: &str,
    mut look: impl FnMut(&Specimen, &[Step], &mut Random) -> Result<usize, Verdict>,
) -> Result<usize, Verdict> {
    let mut random = Random::new(subject.seed, name);
    let mut n = 0;
    for routine in subject.specimens_by_default(1, &mut random)? {
        let walk = routine.paths(N_INCREMENTS, &mut random)?;
        if walk.steps.is_empty() {
            let why = format!("{}: no increment succeeded: {}", routine.name(), walk.why());
            return Err(skipped(why));
        }
        n += look(&routine, &walk.steps, &mut random)?;
    }
    Ok(n)
}

/// Starts of steps.
fn starts(steps: &[Step]) -> Vec<PointStart> {
    steps.iter().map(|step| step.start.clone()).collect()
}

fn sidecar_is_read(subject: &Subject) -> Found {
    let laws = subject.laws()?;
    let names = laws.iter().map(|law| {
        let description = law.description();
        let formulation = description.formulations.first();
        let n_states = formulation.map_or(0, |f| f.internal_variables.len());
        format!(
            "{} ({}), {} parameters, {n_states} internal variables",
            description.id,
            description.hypotheses(),
            description.parameters.len()
        )
    });
    let names = names.collect::<Vec<_>>().join("; ");
    let groundless = groundless(subject, &laws);
    if groundless.is_empty() {
        return Ok(names);
    }
    Err(Verdict::Warning(format!(
        "{names}; checked with {}, for which the sidecar has neither `default` nor `usual = [a, b]`, so that what is \
         found may be of no use: write them there, or give values by `--set ID=VALUE` or `--driver FILE`",
        groundless.join(", ")
    )))
}

/// Parameters of a sidecar, with the values that they are checked with, for which nothing speaks.
fn groundless(subject: &Subject, laws: &[LoadedLaw]) -> Vec<String> {
    if subject.driver.is_some() || subject.at.is_some() {
        return Vec::new();
    }
    let parameters = laws.iter().flat_map(|law| &law.description().parameters);
    let is_range = |bounds: &Bounds| bounds.lower.is_finite() && bounds.upper.is_finite();
    parameters
        .filter(|p| p.default.is_none() && !p.optional && p.choices.is_empty())
        .filter(|p| !is_range(&p.usual) && !is_range(&p.bounds))
        .filter(|p| subject.settings.iter().all(|(id, _)| *id != p.id))
        .map(|p| format!("`{}` = {}", p.id, plausible(p)))
        .collect()
}

/// Compression of a first call, kPa.
const PRESSURE: f64 = 100.0;

/// A point that is compressed and has not moved.
fn under_pressure(routine: &Specimen) -> Result<PointStart, Verdict> {
    let flux0 = routine.under_pressure(PRESSURE);
    let state0 = match routine.initial_state(&flux0)? {
        Ok(state0) => state0,
        Err(why) => return Err(routine.fails(why)),
    };
    let zero = vec![0.0; flux0.len()];
    Ok(PointStart {
        gradient0: zero.clone(),
        gradient1: zero,
        flux0,
        state0,
    })
}

fn routine_answers(subject: &Subject) -> Found {
    course::is_followed(subject)?;
    let mut random = Random::new(subject.seed, "answers");
    let mut all = Vec::new();
    for routine in subject.specimens_by_default(1, &mut random)? {
        let start = match routine.course.iter().flatten().next() {
            Some(first) => PointStart {
                gradient1: first.gradient0.clone(),
                ..first.clone()
            },
            None => under_pressure(&routine)?,
        };
        let answer = routine.call(std::slice::from_ref(&start), UPDATE)?;
        if !is_success(answer.status) {
            let why = refusal(answer.status, answer.text().as_deref());
            let read = reads_beside(&routine, std::slice::from_ref(&start))?;
            let read = read.map_or(String::new(), |(_, read)| format!("; {read}"));
            return Err(routine.fails_at(&start, format!("{why}{read}")));
        }
        let stiffness = largest(&answer.points[0].tangent);
        if stiffness <= 0.0 {
            let why = format!(
                "{} of a call without any strain is zero: the routine leaves it unset, and without it there is no \
                 iteration{}",
                Words::of(&routine).stiffness,
                advice(
                    &routine,
                    "; an elastic one will do, declared by `tangent = \"approximate\"` in the sidecar"
                )
            );
            return Err(routine.fails_at(&start, why));
        }
        all.push(format!("{} {stiffness:.3e}", routine.hypothesis.name()));
    }
    Ok(format!(
        "largest entry of the stiffness: {}",
        all.join(", ")
    ))
}

fn routine_stays_inside(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "inside");
    let (mut n, mut notes) = (0, Vec::new());
    for routine in subject.specimens_by_default(1, &mut random)? {
        let near = routine.walk(N_INCREMENTS, &mut random)?;
        let all = routine.paths(N_INCREMENTS, &mut random)?;
        // Far away results may be no numbers: who goes there is told then.
        let is_defect = |status: raw::Status, is_near: bool| match Outcome::from_code(status) {
            Outcome::CutStep | Outcome::Domain | Outcome::Unsupported => false,
            Outcome::Numeric => is_near,
            _ => true,
        };
        let near_ones = near.refusals.iter().map(|refused| (refused, true));
        let mut refused = near_ones.chain(all.refusals.iter().map(|refused| (refused, false)));
        if let Some((refused, _)) =
            refused.find(|(refused, is_near)| is_defect(refused.status, *is_near))
        {
            return Err(refuses(&routine, refused)?);
        }
        if near.steps.is_empty() && all.steps.is_empty() {
            let why = format!("{}: no increment succeeded: {}", routine.name(), near.why());
            return Err(skipped(why));
        }
        let some = near.steps.iter().chain(&all.steps);
        let every = (near.steps.len() + all.steps.len())
            .div_ceil(MOST_READ)
            .max(1);
        let some: Vec<PointStart> = some.step_by(every).map(|step| step.start.clone()).collect();
        if let Some((start, why)) = reads_beside(&routine, &some)? {
            let why = format!("{why}, at {}", routine.at(&start));
            return Err(routine.fails_at(&start, why));
        }
        n += near.steps.len() + all.steps.len();
        let names = routine.probe.take_overwritten();
        if !names.is_empty() {
            notes.push(format!(
                "the routine overwrites {}, which it is given to read; here that is a copy, and what is \
                 left there is not used",
                names.join(", ")
            ));
        }
    }
    match notes.into_iter().next() {
        Some(note) => Err(Verdict::Warning(note)),
        None => Ok(format!("{n} increments")),
    }
}

/// The failure of an increment that a routine refuses: alone if it does so alone, too, as is repeated by its
/// capsule.
fn refuses(routine: &Specimen, refused: &Refused) -> Result<Verdict, Verdict> {
    let alone = routine.call(std::slice::from_ref(&refused.start), UPDATE)?;
    let status = alone.points[0].status;
    let text = alone.text().filter(|_| status == refused.status);
    let why = refusal(refused.status, Some(text.as_ref().unwrap_or(&refused.text)));
    let read = reads_beside(routine, std::slice::from_ref(&refused.start))?;
    let read = read.map_or(String::new(), |(_, read)| format!("; {read}"));
    let why = format!("{why}{read}, at {}", routine.at(&refused.start));
    Ok(match text {
        Some(_) => routine.fails_at(&refused.start, why),
        None => routine.fails(why),
    })
}

/// Whether it is the same law with the same parameters.
fn is_like(other: &Specimen, routine: &Specimen) -> bool {
    other.hypothesis == routine.hypothesis
        && other.law.description().id == routine.law.description().id
        && bits(&other.values) == bits(&routine.values)
}

/// Places that differ from the usual one in the number of the element, of its point, where it lies and how long
/// it is; which of these it is. A routine may be another law in the first element or at one of the points.
fn elsewhere() -> Vec<(Site, usize)> {
    let here = Site::default();
    let elements = [1, 40].map(|element| (Site { element, ..here }, 0));
    let points = [1, 2, 3, 4, 8].map(|point| (Site { point, ..here }, 1));
    let position = [3.0, -7.0];
    let length = 0.25;
    let others = [(Site { position, ..here }, 2), (Site { length, ..here }, 3)];
    elements.into_iter().chain(points).chain(others).collect()
}

/// What first differs between two results, in words.
fn change(routine: &Specimen, before: &PointEnd, after: &PointEnd) -> String {
    let words = Words::of(routine);
    let results = [
        (words.stress, &before.flux, &after.flux),
        (words.state, &before.state, &after.state),
        (words.stiffness, &before.tangent, &after.tangent),
    ];
    let mut all = results.into_iter();
    all.find(|(_, before, after)| bits(before) != bits(after))
        .map_or_else(
            || format!("outcome {}, then {}", before.status, after.status),
            |(name, before, after)| format!("{name} {before:?}, then {after:?}"),
        )
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn routine_is_repeatable(subject: &Subject) -> Found {
    let mut others = subject.specimens_by_default(1, &mut Random::new(subject.seed, "images"))?;
    let mut by_site = None;
    let n = each(subject, "repeatable", |routine, steps, random| {
        let fresh = others.iter_mut().find(|other| is_like(other, routine));
        // Backwards, so that other calls come before; some with a component that does not move.
        let mut points = starts(steps);
        points.extend(routine.points(24, random)?);
        let expected = routine.call(&points, UPDATE)?.points;
        let mut back = points.clone();
        back.reverse();
        let mut after_others = routine.call(&back, UPDATE)?.points;
        after_others.reverse();
        let in_another_image = match fresh {
            Some(fresh) => fresh.call(&points, UPDATE)?.points,
            None => expected.clone(),
        };
        for (found, who) in [
            (&after_others, "after other calls"),
            (&in_another_image, "in another image"),
        ] {
            let Some(i) = first_difference(&expected, found) else {
                continue;
            };
            let what = change(routine, &expected[i], &found[i]);
            let why = format!(
                "the same call gives another result {who}: {what}, at {}",
                routine.at(&points[i])
            );
            return Err(routine.fails_at(&points[i], why));
        }
        for (site, which) in elsewhere() {
            let name = Words::of(routine).site[which];
            let form = Form {
                site: Some(site),
                ..routine.form(UPDATE)
            };
            let there = routine.probe.integrate(&points, &form)?.points;
            if let Some(i) = first_difference(&expected, &there) {
                let why = format!(
                    "with another {name}: {}, at {}",
                    change(routine, &expected[i], &there[i]),
                    routine.at(&points[i])
                );
                by_site = by_site
                    .take()
                    .or_else(|| Some(routine.warns_at(&points[i], why)));
            }
        }
        Ok(points.len())
    })?;
    by_site.map_or(Ok(format!("{n} increments")), Err)
}

fn routine_stays_at_rest(subject: &Subject) -> Found {
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

/// What an increment has left as it was, bit by bit, or as elasticity alone makes it, by the names that the routine
/// has for it. A component that is zero says nothing.
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
    let longer = routine.lasting(SLOWER, points, raw::PILUM_REQ_FLUX)?;
    Ok(usual[0].flux != longer[0].flux)
}

/// Whether components differ by more than this.
fn differ(a: &[f64], b: &[f64], bound: f64) -> bool {
    a.iter().zip(b).any(|(a, b)| (a - b).abs() > bound)
}

fn time_as_declared(subject: &Subject) -> Found {
    if subject.foreign().map(|foreign| foreign.adapter) == Some(Adapter::Mfront) {
        return Err(skipped(
            "a behaviour of MFront does not say whether it depends on the time",
        ));
    }
    let (mut declared, mut seen) = (false, false);
    let n = each(subject, "time", |routine, steps, _| {
        let words = Words::of(routine);
        let is_declared = routine.formulation.time_dependent;
        declared |= is_declared;
        let starts = starts(steps);
        let slower = routine.lasting(SLOWER, &starts, raw::PILUM_REQ_FLUX)?;
        let later = Form {
            time: LATER,
            ..routine.form(raw::PILUM_REQ_FLUX)
        };
        let later = routine.probe.integrate(&starts, &later)?.points;
        for (ends, what) in [(&slower, words.duration), (&later, words.time)] {
            let carried = carried_on(routine, steps, ends)?;
            for ((step, end), carried) in steps.iter().zip(ends).zip(carried) {
                // What begins at TIME(2) = 0 does not at another one.
                let begins = step.start.gradient0.iter().all(|value| *value == 0.0);
                let of_flux = differ(&end.flux, &step.end.flux, ITERATED * flux_scale(step));
                let depends = !(begins && what == words.time)
                    && is_success(end.status)
                    && (of_flux || carried);
                seen |= depends;
                if depends && !is_declared {
                    let change = if of_flux {
                        format!(
                            "{} {:?} becomes {:?}",
                            words.stress, step.end.flux, end.flux
                        )
                    } else {
                        format!(
                            "{} {:?} becomes {:?}, and {} of the next increment changes",
                            words.state, step.end.state, end.state, words.stress
                        )
                    };
                    return Err(routine.warns_at(
                        &step.start,
                        format!(
                            "with another {what} {change}, which {} does not say{}",
                            words.describer,
                            advice(
                                routine,
                                ": say `time_dependent = true` in the sidecar, so that phases and segments \
                                 without a `time` are told of"
                            )
                        ),
                    ));
                }
            }
        }
        Ok(steps.len())
    })?;
    if declared && !seen {
        let why = "it is said to depend on the time (`time_dependent = true` in a sidecar), and neither the length of an \
                   increment (DTIME) nor its time changes anything";
        return Err(Verdict::Warning(why.to_owned()));
    }
    Ok(format!("{n} increments"))
}

/// Whether other internal variables at the end of steps give another stress in a next increment like the last one:
/// what is kept for its own sake, such as the length of substeps, does not count.
fn carried_on(
    routine: &Specimen,
    steps: &[Step],
    others: &[PointEnd],
) -> Result<Vec<bool>, Verdict> {
    let next = |step: &Step, state: &[f64]| PointStart {
        gradient0: step.start.gradient1.clone(),
        gradient1: sum(&step.start.gradient1, &increment(&step.start)),
        flux0: step.end.flux.clone(),
        state0: state.to_vec(),
    };
    let pairs = || steps.iter().zip(others);
    let usual: Vec<PointStart> = pairs()
        .map(|(step, _)| next(step, &step.end.state))
        .collect();
    let other: Vec<PointStart> = pairs().map(|(step, end)| next(step, &end.state)).collect();
    let usual = routine.call(&usual, raw::PILUM_REQ_FLUX)?.points;
    let other = routine.call(&other, raw::PILUM_REQ_FLUX)?.points;
    let counts = pairs().zip(usual.iter().zip(&other));
    let counts = counts.map(|((step, end), (usual, other))| {
        let changed = bits(&step.end.state) != bits(&end.state);
        let both = is_success(usual.status) && is_success(other.status);
        changed && both && differ(&usual.flux, &other.flux, CARRIED * flux_scale(step))
    });
    Ok(counts.collect())
}
