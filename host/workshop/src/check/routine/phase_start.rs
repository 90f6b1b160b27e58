//! Does a routine go on where a phase begins? There KINC and the time of the step start again, and internal
//! variables do not.

use crate::check::loading_path::{Step, flux_scale};
use crate::check::points::{ITERATED, apart, bits, increment, is_success, moved_by};
use crate::check::specimen::Specimen;
use crate::check::verdict::Outcome;
use crate::check::words::Words;
use crate::check::{Found, Subject, Verdict, counted};
use abi::raw;
use law::Moment;
use law::probe::{Form, PointEnd, PointStart};

/// Arguments of a routine that differ from those in the second increment of a second step.
struct Other {
    /// In words.
    what: String,
    time: f64,
    moment: Moment,
    /// Every phase and every segment begins with it; else the first one alone has it.
    is_frequent: bool,
    /// The routine says that it may matter.
    is_declared: bool,
}

/// Arguments of a routine in the second increment of a second step: time and numbers.
fn later(routine: &Specimen) -> (f64, Moment) {
    let length = routine.time_increment;
    let moment = Moment {
        step: 2,
        increment: 2,
        step_start: 2.0 * length,
        step_length: 2.0 * length,
        is_undrained: false,
    };
    (3.0 * length, moment)
}

/// Arguments that must not change a routine that has begun.
fn others(routine: &Specimen) -> Vec<Other> {
    let (time, moment) = later(routine);
    let counter = routine.words().increment;
    let first = Moment {
        increment: 1,
        ..moment
    };
    let mut all = vec![Other {
        what: format!("{counter} = 1 in place of 2"),
        time,
        moment: first,
        is_frequent: true,
        is_declared: false,
    }];
    if !routine.has_sidecar() {
        return all;
    }
    all.push(Other {
        what: format!("TIME(1) = 0 in place of {}", routine.time_increment),
        time,
        moment: Moment {
            step_start: time,
            ..moment
        },
        is_frequent: true,
        is_declared: routine.formulation.time_dependent,
    });
    all.push(Other {
        what: "KSTEP = 1 in place of 2".to_owned(),
        time,
        moment: Moment { step: 1, ..moment },
        is_frequent: false,
        is_declared: false,
    });
    all
}

fn form(routine: &Specimen, (time, moment): (f64, Moment)) -> Form {
    Form {
        time,
        moment: Some(moment),
        ..routine.form(raw::PILUM_REQ_FLUX)
    }
}

/// The next increment from these internal variables, on and back.
fn next(step: &Step, stress: &[f64], state: &[f64]) -> [PointStart; 2] {
    let moved = increment(&step.start);
    [1.0, -1.0].map(|sign| {
        let by: Vec<f64> = moved.iter().map(|value| sign * value).collect();
        moved_by(&step.start.gradient1, &by, stress, state)
    })
}

/// Whether these internal variables give another stress in the next increment than those.
fn matters(
    routine: &Specimen,
    step: &Step,
    usual: &PointEnd,
    other: &PointEnd,
) -> Result<bool, Verdict> {
    let form = form(routine, later(routine));
    let of = |state: &[f64]| {
        routine
            .probe
            .integrate(&next(step, &usual.flux, state), &form)
    };
    let (usual, other) = (of(&usual.state)?.points, of(&other.state)?.points);
    let mut pairs = usual.iter().zip(&other);
    Ok(pairs.any(|(a, b)| has_other_flux(step, a, b)))
}

/// Whether one of them fails, or their fluxes differ.
fn has_other_flux(step: &Step, a: &PointEnd, b: &PointEnd) -> bool {
    is_success(a.status) != is_success(b.status)
        || is_success(a.status) && apart(&a.flux, &b.flux) > ITERATED * flux_scale(step)
}

/// What another moment changes: a failure, or a warning that others may replace; whether it changes stresses.
fn judged(
    routine: &Specimen,
    step: &Step,
    other: &Other,
    [usual, found]: [&PointEnd; 2],
) -> Result<Option<(Verdict, bool)>, Verdict> {
    let Words { stress, state, .. } = routine.words();
    let of_flux = has_other_flux(step, usual, found);
    let of_state = bits(&usual.state) != bits(&found.state);
    if !of_flux && !of_state {
        return Ok(None);
    }
    let counts = of_flux || matters(routine, step, usual, found)?;
    if other.is_declared && !counts {
        return Ok(None);
    }
    let change = if !is_success(found.status) {
        "the routine fails".to_owned()
    } else if of_flux {
        format!("{stress} {:?} becomes {:?}", usual.flux, found.flux)
    } else {
        let then = if counts {
            format!(", and {stress} of the next increment changes")
        } else {
            String::new()
        };
        format!("{state} {:?} becomes {:?}{then}", usual.state, found.state)
    };
    let why = format!(
        "with {} {change}{}",
        other.what,
        routine.advice(if other.is_frequent {
            ": every phase and segment begins so. Internal variables begin with `initial` in the sidecar; a \
             routine that begins by itself asks for KSTEP and KINC, or for TIME(2)"
        } else {
            ": the first phase of a case and the first segment of a driver have it, all others do not"
        })
    );
    let verdict = if counts && other.is_frequent && !other.is_declared {
        routine.fails_at(&step.start, why)
    } else {
        routine.warns_at(&step.start, why)
    };
    Ok(Some((verdict, counts)))
}

/// How many increments are asked one by one.
const ALONE: usize = 4;

/// Whether the first call after another moment is the same as when it is repeated: the two differ by what is
/// kept in SAVE. The last increments, with the largest changes, each alone.
fn remembers(routine: &Specimen, steps: &[&Step], other: &Other) -> Result<(), Verdict> {
    let Words { stress, state, .. } = routine.words();
    for step in steps.iter().rev().take(ALONE) {
        let call = |at: (f64, Moment)| {
            let start = std::slice::from_ref(&step.start);
            let answer = routine.probe.integrate(start, &form(routine, at))?;
            Ok::<_, Verdict>(answer.points)
        };
        call((other.time, other.moment))?;
        let [first, repeated] = [call(later(routine))?, call(later(routine))?];
        let (first, repeated) = (&first[0], &repeated[0]);
        let (what, first, repeated) = if bits(&first.flux) == bits(&repeated.flux) {
            (state, &first.state, &repeated.state)
        } else {
            (stress, &first.flux, &repeated.flux)
        };
        if bits(first) != bits(repeated) {
            return Err(routine.fails_at(
                &step.start,
                format!(
                    "after a call with {} the usual one leaves {what} {first:?}, and {repeated:?} when it is \
                     repeated: something is kept from call to call (SAVE, COMMON)",
                    other.what
                ),
            ));
        }
    }
    Ok(())
}

pub(super) fn routine_does_not_begin_again(subject: &Subject) -> Found {
    let mut doubtful: Option<(Verdict, bool)> = None;
    let n = subject.each_walk("first", |routine, steps, _| {
        if routine.is_mfront() {
            return Ok(0);
        }
        let moved = |step: &&Step| step.start.gradient0.iter().any(|value| *value != 0.0);
        let steps: Vec<&Step> = steps.iter().filter(moved).collect();
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let usual = form(routine, later(routine));
        let usual = routine.probe.integrate(&starts, &usual)?.points;
        for other in others(routine) {
            let form = form(routine, (other.time, other.moment));
            let found = routine.probe.integrate(&starts, &form)?.points;
            for ((step, usual), found) in steps.iter().zip(&usual).zip(&found) {
                if !is_success(usual.status) {
                    continue;
                }
                let Some((verdict, counts)) = judged(routine, step, &other, [usual, found])? else {
                    continue;
                };
                if verdict.outcome == Outcome::Failed {
                    return Err(verdict);
                }
                // The first one; of those that change stresses, if there are any.
                if doubtful.as_ref().is_none_or(|(_, known)| counts && !known) {
                    doubtful = Some((verdict, counts));
                }
            }
            remembers(routine, &steps, &other)?;
        }
        Ok(steps.len())
    })?;
    if let Some((verdict, _)) = doubtful {
        return Err(verdict);
    }
    let none = "it is not told which increment it is, or no increment follows another one";
    counted(n, "increments", none)
}
