//! Libraries made for other programs: does a routine do what is reported of it, in a sidecar or by itself, and
//! what can go wrong in it unseen?
//!
//! Every call goes through the adapter of a run, guard words included, in the process of the check.

mod outside_reads;
mod phase_start;
mod time;

use super::draw::Draw;
use super::draw::is_known;
use super::loading_path::{Refused, Step, starts};
use super::points::{UPDATE, at_rest, bits, first_difference, is_success, largest};
use super::random::Random;
use super::specimen::{LONG, Specimen};
use super::{Check, Found, Subject, Verdict, author_path, mathematics, refusal, skipped, warned};
use crate::Error;
use abi::status::Outcome;
use law::foreign::{Adapter, sidecar, sidecar_of};
use law::probe::{Form, PointEnd, PointStart};
use law::trial::plausible;
use law::{Bounds, LoadedLaw, Site};
use outside_reads::reads_beside;
use std::path::Path;
use text::Source;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "sidecar-is-read",
        description: "UMAT (or UDSM, MFront along a driver): its sidecar, or that of the driver, \
                      is readable; parameters have a default, a usual range, or are set \
                      (warning).",
        needs: &["file-is-a-library"],
        run: sidecar_is_read,
    },
    Check {
        id: "routine-answers",
        description: "UMAT: for every hypothesis of the sidecar the routine is found with all \
                      that it calls, and a first call without strain gives finite results.",
        needs: &["sidecar-is-read"],
        run: routine_answers,
    },
    Check {
        id: "routine-stays-inside",
        description: "UMAT: on random and on far paths nothing is read or written outside \
                      arrays, nor written over sizes, names and PROPS; PNEWDT is sound, results \
                      on random paths are finite, and the process does not end by STOP or XIT. A \
                      copy that is used up is a warning.",
        needs: &["routine-answers"],
        run: routine_stays_inside,
    },
    Check {
        id: "routine-is-repeatable",
        description: "UMAT: the same call gives the same bits after other calls and in another \
                      image of the library: SAVE or COMMON keep nothing. With other NOEL, NPT, \
                      COORDS and CELENT, too (warning, since they may mean properties).",
        needs: &["routine-stays-inside"],
        run: routine_is_repeatable,
    },
    Check {
        id: "routine-does-not-begin-again",
        description: "UMAT: at the start of a phase, with KINC = 1 and TIME(1) = 0, a routine \
                      goes on from its internal variables: STRESS is the same, also in the next \
                      increment; with KSTEP = 1, too (warning). TIME(1) is a warning if the \
                      routine depends on time. After a call of another step two equal calls give \
                      the same.",
        needs: &["routine-is-repeatable"],
        run: phase_start::routine_does_not_begin_again,
    },
    Check {
        id: "routine-stays-at-rest",
        description: "UMAT: after an update, DSTRAN = 0 keeps STRESS; routines that depend on \
                      time are exempt.",
        needs: &["routine-is-repeatable"],
        run: mathematics::routine_stays_at_rest,
    },
    Check {
        id: "time-as-declared",
        description: "UMAT: DTIME or TIME changes the response if the sidecar has \
                      `time_dependent = true`, and only then (warning).",
        needs: &["routine-is-repeatable"],
        run: time::time_as_declared,
    },
    Check {
        id: "ddsdde-matches-differences",
        description: "UMAT: DDSDDE is the derivative of STRESS within 10⁻⁴ of the stiffness, \
                      also far beyond yielding and in unloading (warning, with the largest \
                      error), not its transpose, and symmetric if declared. Exempt: kinks and \
                      `tangent = \"approximate\"`.",
        needs: &["routine-is-repeatable"],
        run: mathematics::ddsdde_matches_differences,
    },
    Check {
        id: "routine-agrees-in-the-plane",
        description: "UMAT: with fewer components the routine gives the same: plane strain and \
                      axisymmetry as 3d, interface_2d as interface_3d.",
        needs: &["routine-is-repeatable"],
        run: mathematics::routine_agrees_in_the_plane,
    },
    Check {
        id: "tangential-directions-are-alike",
        description: "UMAT: with the tangential directions of an interface turned (in the plane: \
                      reversed), the traction turns alike (warning).",
        needs: &["routine-is-repeatable"],
        run: mathematics::tangential_directions_are_alike,
    },
];

/// Checks that mean the same for libraries of the contract.
pub(super) const SHARED: [&str; 3] = [
    "file-is-a-library",
    "description-is-complete",
    "units-are-known",
];

/// Those that mean the same for a routine, too, whose parameters and increments are random or far
/// away. Failures of laws are warnings here: public routines are often imprecise but useful.
pub(super) const OF_RESPONSES: [&str; 10] = [
    "response-is-isotropic",
    "compression-is-negative",
    "angles-are-degrees",
    "plastic-work-is-not-negative",
    "response-is-continuous",
    "states-are-carried-on",
    "plastic-variables-rest",
    "units-belong-together",
    "results-do-not-blow-up",
    "paths-leave-elasticity",
];

/// A routine that ends its process far away fails this check; others warn of it.
pub(super) const GOES_FAR: &str = "routine-stays-inside";

/// Increments of the random part of a path.
const N_INCREMENTS: usize = 36;
/// Increments that are asked for what is read next to arguments.
const MOST_READ: usize = 400;
/// Program that a library is made for, if not for the contract. Nothing of it runs.
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
/// [`text::Error::Usage`]. The checks report defects of the sidecar.
pub(super) fn refuse_settings(settings: &[(String, f64)], path: &Path) -> Result<(), Error> {
    let source = sidecar_of(path).and_then(|sidecar| Source::read(&sidecar).ok());
    let Some(Ok(law)) = source.map(|source| sidecar(&source)) else {
        return Ok(());
    };
    let parameters: Vec<_> = law.parameters.iter().collect();
    for (id, value) in settings {
        let nobody = "the sidecar names no parameter";
        is_known(id, *value, &parameters, nobody).map_err(Error::usage)?;
    }
    Ok(())
}

/// Response checks of a routine: short paths if its calls take long, and warnings instead of
/// failures.
pub(super) fn of_response(check: &Check, subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "speed");
    let routines = subject.specimens(Draw::DefaultChoices, 1, &mut random)?;
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

impl Subject {
    /// Leads every routine along paths, far too. Returns the sum of the counts.
    pub(super) fn each_walk(
        &self,
        name: &str,
        mut look: impl FnMut(&Specimen, &[Step], &mut Random) -> Result<usize, Verdict>,
    ) -> Result<usize, Verdict> {
        self.each(Draw::DefaultChoices, name, 1, |routine, random| {
            let walk = routine.paths(N_INCREMENTS, random)?;
            if walk.steps.is_empty() {
                let why = format!("{}: no increment succeeded: {}", routine.name(), walk.why());
                return Err(skipped(why));
            }
            look(routine, &walk.steps, random)
        })
    }
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
    Err(warned(format!(
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
    Ok(at_rest(&vec![0.0; flux0.len()], &flux0, &state0))
}

fn routine_answers(subject: &Subject) -> Found {
    author_path::is_followed(subject)?;
    let mut all = Vec::new();
    subject.each(Draw::DefaultChoices, "answers", 1, |routine, _| {
        let start = match routine.course.iter().flatten().next() {
            Some(first) => PointStart {
                gradient1: first.gradient0.clone(),
                ..first.clone()
            },
            None => under_pressure(routine)?,
        };
        let one = std::slice::from_ref(&start);
        let answer = routine.call(one, UPDATE)?;
        if !is_success(answer.status) {
            let why = refusal(answer.status, answer.text().as_deref());
            let why = format!("{why}{}", what_is_read(routine, one)?);
            return Err(routine.fails_for(&start, why));
        }
        let stiffness = largest(&answer.points[0].tangent);
        if stiffness <= 0.0 {
            let why = format!(
                "{} of a call without any strain is zero: the routine leaves it unset, and without it there is no \
                 iteration{}",
                routine.words().stiffness,
                routine.advice(
                    "; an elastic one will do, declared by `tangent = \"approximate\"` in the sidecar"
                )
            );
            return Err(routine.fails_for(&start, why));
        }
        all.push(format!("{} {stiffness:.3e}", routine.hypothesis.name()));
        Ok(0)
    })?;
    Ok(format!(
        "largest entry of the stiffness: {}",
        all.join(", ")
    ))
}

/// Reads of a routine next to its arguments at these points, for the end of a sentence.
fn what_is_read(routine: &Specimen, points: &[PointStart]) -> Result<String, Verdict> {
    let read = reads_beside(routine, points)?;
    Ok(read.map_or(String::new(), |(_, read)| format!("; {read}")))
}

fn routine_stays_inside(subject: &Subject) -> Found {
    let mut overwritten = None;
    let n = subject.each(Draw::DefaultChoices, "inside", 1, |routine, random| {
        let near = routine.walk(N_INCREMENTS, random)?;
        let all = routine.paths(N_INCREMENTS, random)?;
        // Far away results may be no numbers: who goes there is told then.
        let is_defect = |refused: &&Refused, is_near: bool| match Outcome::from_code(refused.status)
        {
            Outcome::CutStep | Outcome::Domain | Outcome::Unsupported => false,
            Outcome::Numeric => is_near,
            _ => true,
        };
        let near_one = near
            .refusals
            .iter()
            .find(|refused| is_defect(refused, true));
        let far_one = || {
            all.refusals
                .iter()
                .find(|refused| is_defect(refused, false))
        };
        if let Some(refused) = near_one.or_else(far_one) {
            return Err(refuses(routine, refused)?);
        }
        let n = near.steps.len() + all.steps.len();
        if n == 0 {
            let why = format!("{}: no increment succeeded: {}", routine.name(), near.why());
            return Err(skipped(why));
        }
        let some = near.steps.iter().chain(&all.steps);
        let some = some.step_by(n.div_ceil(MOST_READ).max(1));
        let some: Vec<PointStart> = some.map(|step| step.start.clone()).collect();
        if let Some((start, why)) = reads_beside(routine, &some)? {
            return Err(routine.fails_at(&start, why));
        }
        let names = routine.probe.take_overwritten();
        if !names.is_empty() && overwritten.is_none() {
            overwritten = Some(names.join(", "));
        }
        Ok(n)
    })?;
    overwritten.map_or(Ok(format!("{n} increments")), |names| {
        Err(warned(format!(
            "the routine overwrites {names}, which it is given to read; here that is a copy, and what is \
             left there is not used"
        )))
    })
}

/// The failure of an increment that a routine refuses: alone if it does so alone, too, as is repeated by its
/// capsule.
fn refuses(routine: &Specimen, refused: &Refused) -> Result<Verdict, Verdict> {
    let alone = routine.call(std::slice::from_ref(&refused.start), UPDATE)?;
    let status = alone.points[0].status;
    let text = alone.text().filter(|_| status == refused.status);
    let why = refusal(refused.status, Some(text.as_ref().unwrap_or(&refused.text)));
    let read = what_is_read(routine, std::slice::from_ref(&refused.start))?;
    let why = format!("{why}{read}, at {}", routine.at(&refused.start));
    Ok(match text {
        Some(_) => routine.fails_for(&refused.start, why),
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
    let words = routine.words();
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

fn routine_is_repeatable(subject: &Subject) -> Found {
    let others = subject.specimens(
        Draw::DefaultChoices,
        1,
        &mut Random::new(subject.seed, "images"),
    )?;
    let mut by_site = None;
    let n = subject.each_walk("repeatable", |routine, steps, random| {
        let fresh = others.iter().find(|other| is_like(other, routine));
        // Backwards, so that other calls come before; some with a component that does not move.
        let mut points = starts(steps);
        points.extend(routine.points(24, random)?);
        let expected = routine.call(&points, UPDATE)?.points;
        let differs = |found: &[PointEnd], when: &str| {
            let i = first_difference(&expected, found)?;
            let what = change(routine, &expected[i], &found[i]);
            Some((&points[i], format!("{when}: {what}")))
        };
        let back: Vec<PointStart> = points.iter().rev().cloned().collect();
        let mut after_others = routine.call(&back, UPDATE)?.points;
        after_others.reverse();
        let in_another_image = match fresh {
            Some(fresh) => fresh.call(&points, UPDATE)?.points,
            None => expected.clone(),
        };
        let other = differs(&after_others, "after other calls")
            .or_else(|| differs(&in_another_image, "in another image"));
        if let Some((start, what)) = other {
            let why = format!("the same call gives another result {what}");
            return Err(routine.fails_at(start, why));
        }
        for (site, which) in elsewhere() {
            let form = Form {
                site: Some(site),
                ..routine.form(UPDATE)
            };
            let there = routine.probe.integrate(&points, &form)?.points;
            let when = format!("with another {}", routine.words().site[which]);
            if by_site.is_none()
                && let Some((start, what)) = differs(&there, &when)
            {
                by_site = Some(routine.warns_at(start, what));
            }
        }
        Ok(points.len())
    })?;
    by_site.map_or(Ok(format!("{n} increments")), Err)
}
