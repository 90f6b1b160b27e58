//! Does the time matter to a routine where that is reported, and nowhere else?

use crate::check::loading_path::{Step, flux_scale, starts};
use crate::check::points::{ITERATED, apart, bits, increment, is_success, moved_by};
use crate::check::specimen::Specimen;
use crate::check::{Found, Subject, Verdict, skipped, warned};
use abi::raw;
use law::foreign::Adapter;
use law::probe::{Form, PointEnd, PointStart};

/// What time increments differ by, to see whether they matter.
const SLOWER: f64 = 1e3;
/// Stress of the next increment that other internal variables make, relative to the stresses in play: substeps of
/// another length give another one within their tolerance.
const CARRIED: f64 = 1e-3;
/// Another time at which an increment begins.
const LATER: f64 = 1e5;

pub(super) fn time_as_declared(subject: &Subject) -> Found {
    if subject.foreign().map(|foreign| foreign.adapter) == Some(Adapter::Mfront) {
        return Err(skipped(
            "a behaviour of MFront does not say whether it depends on the time",
        ));
    }
    let (mut declared, mut seen) = (false, false);
    let n = subject.each_walk("time", |routine, steps, _| {
        let words = routine.words();
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
                let of_flux = apart(&end.flux, &step.end.flux) > ITERATED * flux_scale(step);
                let is_asked = is_success(end.status) && !(begins && what == words.time);
                if !(is_asked && (of_flux || carried)) {
                    continue;
                }
                seen = true;
                if !is_declared {
                    return Err(depends(routine, (step, end), what, of_flux));
                }
            }
        }
        Ok(steps.len())
    })?;
    if declared && !seen {
        let why = "it is said to depend on the time (`time_dependent = true` in a sidecar), and neither the length of an \
                   increment (DTIME) nor its time changes anything";
        return Err(warned(why));
    }
    Ok(format!("{n} increments"))
}

/// The warning of a step that ends otherwise with another time.
fn depends(
    routine: &Specimen,
    (step, end): (&Step, &PointEnd),
    what: &str,
    is_of_flux: bool,
) -> Verdict {
    let words = routine.words();
    let change = if is_of_flux {
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
    let why = format!(
        "with another {what} {change}, which {} does not say{}",
        words.describer,
        routine.advice(
            ": say `time_dependent = true` in the sidecar, so that phases and segments \
             without a `time` are told of"
        )
    );
    routine.warns_for(&step.start, why)
}

/// Whether other internal variables at the end of steps give another stress in a next increment like the last one.
/// Variables that do not change the stress, such as the length of substeps, do not count.
fn carried_on(
    routine: &Specimen,
    steps: &[Step],
    others: &[PointEnd],
) -> Result<Vec<bool>, Verdict> {
    let next = |step: &Step, state: &[f64]| {
        let moved = increment(&step.start);
        moved_by(&step.start.gradient1, &moved, &step.end.flux, state)
    };
    let pairs = || steps.iter().zip(others);
    let usual: Vec<PointStart> = steps
        .iter()
        .map(|step| next(step, &step.end.state))
        .collect();
    let other: Vec<PointStart> = pairs().map(|(step, end)| next(step, &end.state)).collect();
    let usual = routine.call(&usual, raw::PILUM_REQ_FLUX)?.points;
    let other = routine.call(&other, raw::PILUM_REQ_FLUX)?.points;
    let counts = pairs().zip(usual.iter().zip(&other));
    let counts = counts.map(|((step, end), (usual, other))| {
        let changed = bits(&step.end.state) != bits(&end.state);
        let both = is_success(usual.status) && is_success(other.status);
        changed && both && apart(&usual.flux, &other.flux) > CARRIED * flux_scale(step)
    });
    Ok(counts.collect())
}
