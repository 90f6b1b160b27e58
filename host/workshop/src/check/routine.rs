//! Abaqus user subroutines with a sidecar: does the routine do what the sidecar says, and what can go
//! wrong in it unseen?
//!
//! Every call goes through the adapter of a run, guard words included, in the process of the check.

use super::random::Random;
use super::{Check, Family, Found, Subject, Verdict, failed, skipped};
use crate::Error;
use abi::Hypothesis;
use abi::raw;
use abi::status::Outcome;
use law::adapter::{Foreign, sidecar, sidecar_of};
use law::probe::kept::{self, Function, KeptCall};
use law::probe::{Form, PointStart};
use law::{
    BatchFailure, End, Law, Moment, Operator, ParameterDescription, Start, Strided, Tangent,
};
use std::path::Path;
use text::{Source, suggestion};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "sidecar-is-read",
        family: Family::Routine,
        description: "UMAT: the sidecar beside the library is there and makes sense.",
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
        description: "UMAT: on random paths nothing is written beyond an array or over sizes, names and \
                      PROPS, results are finite, PNEWDT is sound; a copy that is used up is a warning.",
        needs: &["routine-answers"],
        run: routine_stays_inside,
    },
    Check {
        id: "routine-is-repeatable",
        family: Family::Routine,
        description: "UMAT: the same call gives the same bits after other calls, and in another image of \
                      the library: nothing is kept in SAVE or COMMON from point to point.",
        needs: &["routine-stays-inside"],
        run: routine_is_repeatable,
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
        description: "UMAT: DTIME changes the response where the sidecar says `time_dependent = true`, and \
                      nowhere else (warning).",
        needs: &["routine-is-repeatable"],
        run: time_as_declared,
    },
    Check {
        id: "ddsdde-matches-differences",
        family: Family::Routine,
        description: "UMAT: DDSDDE is the derivative of STRESS within 10⁻⁴ of the stiffness, and symmetric \
                      where the sidecar says so. Kinks are exempt; so is `tangent = \"approximate\"`.",
        needs: &["routine-is-repeatable"],
        run: ddsdde_matches_differences,
    },
    Check {
        id: "routine-agrees-in-the-plane",
        family: Family::Routine,
        description: "UMAT: with fewer components the routine gives what it gives with all of them: plane \
                      strain and axisymmetry what 3d gives, interface_2d what interface_3d gives.",
        needs: &["routine-is-repeatable"],
        run: routine_agrees_in_the_plane,
    },
    Check {
        id: "tangential-directions-are-alike",
        family: Family::Routine,
        description: "UMAT: with the tangential directions of an interface turned (reversed in the plane), \
                      the traction is the same, turned (warning).",
        needs: &["routine-is-repeatable"],
        run: tangential_directions_are_alike,
    },
];

/// Checks that mean the same for libraries of the contract.
pub(super) const SHARED: [&str; 3] = [
    "file-is-a-library",
    "description-is-complete",
    "units-are-known",
];

/// Increments of a random path, and of each of its straight pieces.
const N_INCREMENTS: usize = 48;
const STRAIGHT: usize = 6;
/// Compression that paths start under, kPa.
const PRESSURE: f64 = 100.0;
/// Differences of fluxes between two ways to compute them, relative to those in play.
const ITERATED: f64 = 1e-8;
/// Error of a tangent, relative to the largest stiffness.
const TANGENT: f64 = 1e-4;
/// Asymmetry, relative to the largest entry.
const ROUND_OFF: f64 = 1e-9;
/// Lengths of difference steps, relative to the increment.
const LENGTHS: [f64; 3] = [1e-3, 1e-5, 1e-7];
/// What time increments differ by, to see whether they matter.
const SLOWER: f64 = 1e3;

/// Whether a library is a UMAT and none of the contract. Nothing of it runs.
pub(super) fn is_one(path: &Path) -> bool {
    law::inspect::inspect(path).is_ok_and(|inspection| inspection.is_umat())
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

/// The library as a file would name it, called in this process: that of a check is one of its own.
pub(super) fn foreign(subject: &Subject) -> Foreign {
    Foreign {
        in_process: true,
        ..Foreign::umat(&subject.path)
    }
}

/// A routine under a hypothesis, with parameters.
struct Routine {
    law: Law,
}

/// A point and an increment.
#[derive(Clone, Debug)]
struct Point {
    gradient: Vec<f64>,
    gradient_end: Vec<f64>,
    flux: Vec<f64>,
    state: Vec<f64>,
}

/// What a routine makes of it.
#[derive(Clone, Debug, PartialEq)]
struct After {
    flux: Vec<f64>,
    state: Vec<f64>,
    tangent: Vec<f64>,
}

/// An increment that succeeded.
struct Step {
    point: Point,
    after: After,
    /// Largest entry of DDSDDE at the start of the path.
    stiffness: f64,
}

impl Step {
    fn increment(&self) -> Vec<f64> {
        let pairs = self.point.gradient_end.iter().zip(&self.point.gradient);
        pairs.map(|(end, start)| end - start).collect()
    }

    /// Fluxes in play.
    fn scale(&self) -> f64 {
        let moved = self.stiffness * largest(&self.increment());
        largest(&self.point.flux)
            .max(largest(&self.after.flux))
            .max(moved)
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}

/// A value that a parameter may have, unless one is set.
fn value(subject: &Subject, p: &ParameterDescription) -> f64 {
    let given = subject.settings.iter().find(|(id, _)| *id == p.id);
    given.map_or_else(|| law::vetting::plausible(p), |(_, value)| *value)
}

/// The routine under each hypothesis, in an image of its own.
fn routines(subject: &Subject) -> Result<Vec<Routine>, Verdict> {
    let library = subject.opener.open_foreign(&foreign(subject), |_| Ok(()));
    let library = library.map_err(|why| failed(why.to_string()))?;
    let mut routines = Vec::new();
    for description in library.laws() {
        let Some(law) = library.law(&description.id) else {
            continue;
        };
        let values: Vec<f64> = description
            .parameters
            .iter()
            .map(|p| value(subject, p))
            .collect();
        for hypothesis in Hypothesis::ALL {
            if description.formulation(hypothesis).is_none() {
                continue;
            }
            let built = law.build(hypothesis, &values);
            let law = built
                .map_err(|why| failed(format!("under {}: {}", hypothesis.name(), why.reason)))?;
            routines.push(Routine { law });
        }
    }
    Ok(routines)
}

impl Routine {
    /// Law, hypothesis and parameters, for messages.
    fn name(&self) -> String {
        let declared = self.law.description().parameters.iter();
        let values = declared.zip(self.law.parameters());
        let values: Vec<String> = values
            .map(|(p, value)| format!("{} = {value}", p.id))
            .collect();
        format!(
            "under {} with {}",
            self.law.hypothesis().name(),
            values.join(", ")
        )
    }

    fn fails(&self, why: impl std::fmt::Display) -> Verdict {
        failed(format!("{}: {why}", self.name()))
    }

    fn warns(&self, why: impl std::fmt::Display) -> Verdict {
        Verdict::Warning(format!("{}: {why}", self.name()))
    }

    fn is_time_dependent(&self) -> bool {
        self.law.formulation().time_dependent
    }

    /// Under plane strain, 33 stays zero.
    fn is_free(&self, component: usize) -> bool {
        self.law.hypothesis() != Hypothesis::PlaneStrain || component != 2
    }

    fn call(&self, point: &Point, operator: Operator, time: f64) -> Result<After, BatchFailure> {
        let n = self.law.n_components();
        let rows = Strided::rows(n);
        let mut after = After {
            flux: vec![0.0; n],
            state: vec![0.0; point.state.len()],
            tangent: vec![0.0; if operator == Operator::None { 0 } else { n * n }],
        };
        let start = Start {
            n_points: 1,
            gradient: (&point.gradient, rows),
            gradient_end: (&point.gradient_end, rows),
            flux: (&point.flux, rows),
            state: &point.state,
            time: 0.0,
            time_increment: time,
            moment: Moment::default(),
            sites: &[],
        };
        let end = End {
            flux: (&mut after.flux, rows),
            state: &mut after.state,
            operator: &mut after.tangent,
        };
        let kept = || self.kept(point, operator, time);
        // Without it a crash is known all the same.
        let _ = kept::keep(kept);
        self.law.integrate(&start, operator, end)?;
        Ok(after)
    }

    /// The call, for who looks after a crash.
    fn kept(&self, point: &Point, operator: Operator, time_increment: f64) -> KeptCall {
        let request = match operator {
            Operator::None => raw::PILUM_REQ_FLUX,
            Operator::Consistent => raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT,
            Operator::Elastic => raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
        };
        let form = Form {
            time_increment,
            ..Form::of(request)
        };
        let start = PointStart {
            gradient0: point.gradient.clone(),
            gradient1: point.gradient_end.clone(),
            flux0: point.flux.clone(),
            state0: point.state.clone(),
        };
        let names = (
            self.law.description().id.as_str(),
            self.law.hypothesis().name(),
        );
        KeptCall::new(
            names,
            Function::Integrate,
            form,
            self.law.parameters(),
            &[start],
        )
    }

    fn update(&self, point: &Point) -> Result<After, BatchFailure> {
        self.call(point, Operator::Consistent, 1.0)
    }

    /// A point under pressure before anything has happened, and the largest entry of its DDSDDE.
    fn origin(&self) -> Result<(Point, f64), Verdict> {
        let n = self.law.n_components();
        let normal = if self.law.hypothesis().is_interface() {
            1
        } else {
            3
        };
        let flux: Vec<f64> = (0..n)
            .map(|i| if i < normal { -PRESSURE } else { 0.0 })
            .collect();
        let state = self.law.initial_state(1, (&flux, Strided::rows(n)));
        let state = state.map_err(|why| self.fails(why.message))?;
        let point = Point {
            gradient: vec![0.0; n],
            gradient_end: vec![0.0; n],
            flux,
            state,
        };
        let at_rest = self.update(&point).map_err(|why| self.fails(why.message))?;
        Ok((point, largest(&at_rest.tangent)))
    }

    /// Leads a point along straight pieces in random directions. What the routine cannot follow starts
    /// anew; a defect is one of the routine.
    fn walk(&self, random: &mut Random) -> Result<Vec<Step>, Verdict> {
        let (origin, stiffness) = self.origin()?;
        if stiffness <= 0.0 {
            return Err(self.fails(
                "DDSDDE of a call without any strain is zero: the routine leaves it unset, and without it there is no \
                 iteration; an elastic one will do, declared by `tangent = \"approximate\"` in the sidecar",
            ));
        }
        let size = PRESSURE / stiffness;
        let mut steps = Vec::new();
        let mut point = origin.clone();
        let mut direction = vec![0.0; point.flux.len()];
        for increment in 0..N_INCREMENTS {
            if increment % STRAIGHT == 0 {
                let length = size * random.logarithmic(0.03, 10.0);
                for (c, value) in direction.iter_mut().enumerate() {
                    let part = random.between(-1.0, 1.0);
                    *value = if self.is_free(c) { length * part } else { 0.0 };
                }
            }
            let ends = point.gradient.iter().zip(&direction);
            point.gradient_end = ends.map(|(start, part)| start + part).collect();
            match self.update(&point) {
                Ok(after) => {
                    let next = Point {
                        gradient: point.gradient_end.clone(),
                        gradient_end: point.gradient_end.clone(),
                        flux: after.flux.clone(),
                        state: after.state.clone(),
                    };
                    steps.push(Step {
                        point: std::mem::replace(&mut point, next),
                        after,
                        stiffness,
                    });
                }
                Err(failure) => match failure.outcome {
                    Outcome::CutStep | Outcome::Domain | Outcome::Unsupported => {
                        point = origin.clone();
                    }
                    _ => return Err(self.fails(failure.message)),
                },
            }
        }
        if steps.is_empty() {
            return Err(skipped(format!("{}: no increment succeeded", self.name())));
        }
        Ok(steps)
    }
}

/// Walks of every routine; what is made of each of them.
fn each(
    subject: &Subject,
    name: &str,
    mut look: impl FnMut(&Routine, &[Step], &mut Random) -> Result<usize, Verdict>,
) -> Result<usize, Verdict> {
    let mut random = Random::new(subject.seed, name);
    let mut n = 0;
    for routine in routines(subject)? {
        let steps = routine.walk(&mut random)?;
        n += look(&routine, &steps, &mut random)?;
    }
    Ok(n)
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
    Ok(names.collect::<Vec<_>>().join("; "))
}

fn routine_answers(subject: &Subject) -> Found {
    let routines = routines(subject)?;
    let mut all = Vec::new();
    for routine in &routines {
        let (_, stiffness) = routine.origin()?;
        all.push(format!(
            "{} {stiffness:.3e}",
            routine.law.hypothesis().name()
        ));
    }
    Ok(format!("largest entry of DDSDDE: {}", all.join(", ")))
}

fn routine_stays_inside(subject: &Subject) -> Found {
    let mut notes = Vec::new();
    let n = each(subject, "inside", |routine, steps, _| {
        notes.extend(routine.law.take_notes());
        Ok(steps.len())
    })?;
    match notes.into_iter().next() {
        Some(note) => Err(Verdict::Warning(note)),
        None => Ok(format!("{n} increments")),
    }
}

fn routine_is_repeatable(subject: &Subject) -> Found {
    let others = routines(subject)?;
    let n = each(subject, "repeatable", |routine, steps, _| {
        let fresh = others
            .iter()
            .find(|other| other.law.hypothesis() == routine.law.hypothesis());
        for step in steps.iter().rev() {
            for (other, who) in [
                (Some(routine), "after other calls"),
                (fresh, "in another image"),
            ] {
                let Some(other) = other else { continue };
                let again = other
                    .update(&step.point)
                    .map_err(|why| routine.fails(why.message))?;
                let [before, after] = [&step.after, &again];
                let results = [
                    ("STRESS", &before.flux, &after.flux),
                    ("STATEV", &before.state, &after.state),
                    ("DDSDDE", &before.tangent, &after.tangent),
                ];
                let other = results
                    .into_iter()
                    .find(|(_, before, after)| before != after);
                if let Some((name, before, after)) = other {
                    return Err(routine.fails(format!(
                        "the same call gives another result {who}: {name} {before:?}, then {after:?}, \
                         at {:?}",
                        step.point
                    )));
                }
            }
        }
        Ok(steps.len())
    })?;
    Ok(format!("{n} increments"))
}

fn routine_stays_at_rest(subject: &Subject) -> Found {
    let n = each(subject, "rest", |routine, steps, _| {
        if routine.is_time_dependent() {
            return Ok(0);
        }
        for step in steps {
            let still = Point {
                gradient: step.point.gradient_end.clone(),
                gradient_end: step.point.gradient_end.clone(),
                flux: step.after.flux.clone(),
                state: step.after.state.clone(),
            };
            let after = routine
                .update(&still)
                .map_err(|why| routine.fails(why.message))?;
            if differ(&after.flux, &step.after.flux, ITERATED * step.scale()) {
                return Err(routine.fails(format!(
                    "DSTRAN = 0 changes STRESS {:?} to {:?}; what the time does is declared by \
                     `time_dependent = true` in the sidecar",
                    step.after.flux, after.flux
                )));
            }
        }
        Ok(steps.len())
    })?;
    if n == 0 {
        return Err(skipped("the routine depends on the time"));
    }
    Ok(format!("{n} increments"))
}

/// Whether components differ by more than this.
fn differ(a: &[f64], b: &[f64], bound: f64) -> bool {
    a.iter().zip(b).any(|(a, b)| (a - b).abs() > bound)
}

fn time_as_declared(subject: &Subject) -> Found {
    let (mut declared, mut seen) = (false, false);
    let n = each(subject, "time", |routine, steps, _| {
        declared |= routine.is_time_dependent();
        for step in steps {
            let slower = routine.call(&step.point, Operator::None, SLOWER);
            let Ok(slower) = slower else { continue };
            let depends = differ(&slower.flux, &step.after.flux, ITERATED * step.scale());
            seen |= depends;
            if depends && !routine.is_time_dependent() {
                return Err(routine.warns(format!(
                    "with another DTIME STRESS {:?} becomes {:?}: say `time_dependent = true` in the \
                     sidecar, so that phases and segments without a `time` are told of",
                    step.after.flux, slower.flux
                )));
            }
        }
        Ok(steps.len())
    })?;
    if declared && !seen {
        let why = "`time_dependent = true`, and DTIME changes nothing";
        return Err(Verdict::Warning(why.to_owned()));
    }
    Ok(format!("{n} increments"))
}

/// What differences say of DDSDDE.
enum Slope {
    Right,
    Kink,
    /// Row, column, DDSDDE, differences.
    Wrong(usize, usize, f64, f64),
}

fn ddsdde_matches_differences(subject: &Subject) -> Found {
    let mut n_kinks = 0;
    let n = each(subject, "ddsdde", |routine, steps, _| {
        let formulation = routine.law.formulation();
        let n = routine.law.n_components();
        let mut compared = 0;
        for step in steps.iter().step_by(3) {
            let tangent = &step.after.tangent;
            let scale = step.stiffness.max(largest(tangent));
            if formulation.symmetric {
                let entry = |i: usize, j: usize| tangent[i * n + j];
                let pairs = (0..n * n).map(|k| (k / n, k % n));
                let worst = pairs.map(|(i, j)| (entry(i, j) - entry(j, i)).abs());
                let worst = worst.fold(0.0, f64::max);
                if worst > ROUND_OFF * scale {
                    return Err(routine.fails(format!(
                        "`symmetric = true`, and DDSDDE is off by {:.1e} of the stiffness, at {:?}",
                        worst / scale,
                        step.point
                    )));
                }
            }
            let transposed: Vec<f64> = (0..n * n).map(|k| tangent[(k % n) * n + k / n]).collect();
            if formulation.tangent != Tangent::Consistent {
                // One that is near the derivative may be off, but not by rows for columns.
                let is_right =
                    |tangent: &[f64]| matches!(slope(routine, step, tangent, scale), Slope::Right);
                if is_right(&transposed) && !is_right(tangent) {
                    return Err(routine.fails(format!(
                        "the transpose of DDSDDE is the derivative of STRESS, DDSDDE is not: `tangent_order` in the \
                         sidecar, at {:?}",
                        step.point
                    )));
                }
                continue;
            }
            compared += 1;
            match slope(routine, step, tangent, scale) {
                Slope::Right => {}
                Slope::Kink => n_kinks += 1,
                Slope::Wrong(row, column, by_routine, by_differences) => {
                    let hint = if matches!(slope(routine, step, &transposed, scale), Slope::Right) {
                        "; its transpose fits: `tangent_order` in the sidecar"
                    } else {
                        "; an elastic or otherwise approximate one is declared by `tangent = \
                         \"approximate\"` in the sidecar"
                    };
                    let names = routine.law.hypothesis().components();
                    return Err(routine.fails(format!(
                        "DDSDDE({}, {}), {} by {}, is {by_routine:.6e}, differences give \
                         {by_differences:.6e}: wrong by {:.1e} of the stiffness{hint}, at {:?}",
                        row + 1,
                        column + 1,
                        names[row],
                        names[column],
                        (by_routine - by_differences).abs() / scale,
                        step.point
                    )));
                }
            }
        }
        Ok(compared)
    })?;
    if n == 0 {
        return Err(skipped("the sidecar says `tangent = \"approximate\"`"));
    }
    let details = format!("{n} increments, {n_kinks} at kinks");
    if 2 * n_kinks > n {
        let why = format!("too few were compared: {details}");
        return Err(Verdict::Warning(why));
    }
    Ok(details)
}

/// Compares a tangent with central differences of three lengths.
fn slope(routine: &Routine, step: &Step, tangent: &[f64], scale: f64) -> Slope {
    let n = routine.law.n_components();
    let size = largest(&step.increment());
    let mut verdict = Slope::Kink;
    for length in LENGTHS {
        let (mut error, mut disagreement) = (0.0_f64, 0.0_f64);
        let mut worst = Slope::Right;
        for column in (0..n).filter(|&c| routine.is_free(c)) {
            let moved = |sign: f64| {
                let mut point = step.point.clone();
                point.gradient_end[column] += sign * length * size;
                let by = point.gradient_end[column] - step.point.gradient_end[column];
                routine
                    .call(&point, Operator::None, 1.0)
                    .ok()
                    .map(|after| (by, after.flux))
            };
            let (Some((up, above)), Some((down, below))) = (moved(1.0), moved(-1.0)) else {
                disagreement = f64::INFINITY;
                continue;
            };
            for row in 0..n {
                let here = step.after.flux[row];
                let by_differences = (above[row] - below[row]) / (up - down);
                let by_routine = tangent[row * n + column];
                let sides = (above[row] - here) / up - (here - below[row]) / -down;
                disagreement = disagreement.max(sides.abs());
                let wrong = (by_differences - by_routine).abs();
                if wrong > error {
                    error = wrong;
                    worst = Slope::Wrong(row, column, by_routine, by_differences);
                }
            }
        }
        if disagreement.is_finite() && error <= TANGENT * scale {
            return Slope::Right;
        }
        if disagreement <= 0.1 * error {
            verdict = worst;
        }
    }
    verdict
}

fn routine_agrees_in_the_plane(subject: &Subject) -> Found {
    let all = routines(subject)?;
    let n = each(subject, "plane", |routine, steps, _| {
        let wanted = match routine.law.hypothesis() {
            Hypothesis::PlaneStrain | Hypothesis::Axisymmetric => Hypothesis::ThreeD,
            Hypothesis::Interface2d => Hypothesis::Interface3d,
            _ => return Ok(0),
        };
        let Some(larger) = all.iter().find(|other| other.law.hypothesis() == wanted) else {
            return Ok(0);
        };
        let longer = |values: &[f64]| {
            let mut longer = values.to_vec();
            longer.resize(larger.law.n_components(), 0.0);
            longer
        };
        for step in steps {
            let point = Point {
                gradient: longer(&step.point.gradient),
                gradient_end: longer(&step.point.gradient_end),
                flux: longer(&step.point.flux),
                state: step.point.state.clone(),
            };
            let after = larger
                .update(&point)
                .map_err(|why| larger.fails(why.message))?;
            if differ(
                &after.flux,
                &longer(&step.after.flux),
                ITERATED * step.scale(),
            ) {
                return Err(routine.fails(format!(
                    "STRESS is {:?}, under {} it is {:?}, at {:?}",
                    step.after.flux,
                    wanted.name(),
                    after.flux,
                    step.point
                )));
            }
        }
        Ok(steps.len())
    })?;
    if n == 0 {
        return Err(skipped(
            "it is written for the plane or for space, not for both",
        ));
    }
    Ok(format!("{n} increments"))
}

fn tangential_directions_are_alike(subject: &Subject) -> Found {
    let n = each(subject, "turned", |routine, steps, random| {
        if !routine.law.hypothesis().is_interface() {
            return Ok(0);
        }
        // Internal variables with a direction would have to turn as well, so every path starts fresh.
        let (origin, stiffness) = routine.origin()?;
        let mut compared = 0;
        for _ in steps {
            let size = PRESSURE / stiffness * random.logarithmic(0.03, 30.0);
            let mut point = origin.clone();
            let mut part = || size * random.between(-1.0, 1.0);
            point
                .gradient_end
                .iter_mut()
                .for_each(|value| *value = part());
            let Ok(after) = routine.update(&point) else {
                continue;
            };
            let step = Step {
                point,
                after,
                stiffness,
            };
            let angle = random.between(0.5, 2.5);
            let turn = |values: &[f64]| match *values {
                [n, t, s] => {
                    let (sin, cos) = f64::sin_cos(angle);
                    vec![n, cos * t - sin * s, sin * t + cos * s]
                }
                _ => vec![values[0], -values[1]],
            };
            let turned = Point {
                gradient: turn(&step.point.gradient),
                gradient_end: turn(&step.point.gradient_end),
                flux: turn(&step.point.flux),
                state: step.point.state.clone(),
            };
            let after = routine
                .update(&turned)
                .map_err(|why| routine.fails(why.message))?;
            if differ(
                &after.flux,
                &turn(&step.after.flux),
                ITERATED * step.scale(),
            ) {
                return Err(routine.warns(format!(
                    "the traction {:?} becomes {:?} where it should be {:?}, at {:?}",
                    step.after.flux,
                    after.flux,
                    turn(&step.after.flux),
                    step.point
                )));
            }
            compared += 1;
        }
        Ok(compared)
    })?;
    if n == 0 {
        return Err(skipped("it is no routine of interfaces"));
    }
    Ok(format!("{n} increments"))
}
