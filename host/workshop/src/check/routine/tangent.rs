//! Is the stiffness that a routine leaves the derivative of its stress?

use super::each;
use super::messages::{Words, advice, has_sidecar};
use crate::check::loading_path::Step;
use crate::check::mathematics::{ROUND_OFF, Slope, largest, slope};
use crate::check::specimen::Specimen;
use crate::check::{Found, Subject, Verdict, skipped};
use law::Tangent;

/// Steps whose tangents are compared with differences, one in this many.
const COMPARED: usize = 3;

/// How near a ratio is to 2 or 1/2 where shear strains are confused.
const FACTOR: f64 = 1e-3;

/// Findings about the stiffness of many steps.
#[derive(Default)]
struct Tally {
    n_compared: usize,
    n_kinks: usize,
    n_wrong: usize,
    worst: Option<(f64, Verdict)>,
}

pub(super) fn ddsdde_matches_differences(subject: &Subject) -> Found {
    let mut tally = Tally::default();
    each(subject, "ddsdde", |routine, steps, _| {
        for step in steps.iter().step_by(COMPARED) {
            tally.take(routine, step)?;
        }
        Ok(0)
    })?;
    let Tally {
        n_compared,
        n_kinks,
        n_wrong,
        worst,
    } = tally;
    if let Some((_, verdict)) = worst {
        return Err(verdict.led_by(&format!("{n_wrong} of {n_compared} increments: ")));
    }
    if n_compared == 0 {
        return Err(skipped("the stiffness is said to be approximate"));
    }
    let details = format!("{n_compared} increments, {n_kinks} at kinks");
    if 2 * n_kinks > n_compared {
        let why = format!("too few were compared: {details}");
        return Err(Verdict::Warning(why));
    }
    Ok(details)
}

impl Tally {
    /// Judges the stiffness of a step. An error is one of a kind that no iteration pays for.
    fn take(&mut self, routine: &Specimen, step: &Step) -> Result<(), Verdict> {
        let scale = step.stiffness.max(largest(&step.end.tangent));
        if routine.formulation.symmetric {
            is_symmetric(routine, step, scale)?;
        }
        let fits = |step: &Step| -> Result<bool, Verdict> {
            let slope = slope(routine, step, scale)?;
            Ok(matches!(slope, Slope::Right | Slope::Left(..)))
        };
        let is_transposed = || fits(&transposed(step));
        if routine.formulation.tangent != Tangent::Consistent {
            // One that is near the derivative may be off, but not by rows for columns.
            if is_transposed()? && !fits(step)? {
                return Err(by_columns(routine, step));
            }
            return Ok(());
        }
        self.n_compared += 1;
        match slope(routine, step, scale)? {
            Slope::Right | Slope::Left(..) => {}
            Slope::Kink => self.n_kinks += 1,
            Slope::Wrong {
                row,
                column,
                by_law,
                by_differences,
            } => {
                if is_transposed()? {
                    return Err(by_columns(routine, step));
                }
                self.n_wrong += 1;
                let off = (by_law - by_differences).abs() / scale;
                if self.worst.as_ref().is_none_or(|(most, _)| *most < off) {
                    let entry = (row, column, by_law, by_differences);
                    let why = of_entry(routine, step, entry, off);
                    self.worst = Some((off, routine.warns_at(&step.start, why)));
                }
            }
        }
        Ok(())
    }
}

/// Whether the stiffness is symmetric, as it is reported to be.
fn is_symmetric(routine: &Specimen, step: &Step, scale: f64) -> Result<(), Verdict> {
    let n = routine.probe.n_components();
    let entry = |i: usize, j: usize| step.end.tangent[i * n + j];
    let pairs = (0..n * n).map(|k| (k / n, k % n));
    let most = pairs.map(|(i, j)| (entry(i, j) - entry(j, i)).abs());
    let most = most.fold(0.0, f64::max);
    if most <= ROUND_OFF * scale {
        return Ok(());
    }
    let why = format!(
        "{}, and {} is off by {:.1e} of the stiffness, at {}",
        if has_sidecar(routine) {
            "`symmetric = true`"
        } else {
            "it is said to be symmetric"
        },
        Words::of(routine).stiffness,
        most / scale,
        routine.at(&step.start)
    );
    Err(routine.fails_at(&step.start, why))
}

/// The step with rows of its stiffness for columns.
fn transposed(step: &Step) -> Step {
    let n = step.end.flux.len();
    let mut other = step.clone();
    other.end.tangent = (0..n * n)
        .map(|k| step.end.tangent[(k % n) * n + k / n])
        .collect();
    other
}

/// The failure of a stiffness that stands row by row where columns are read, or the other way round.
fn by_columns(routine: &Specimen, step: &Step) -> Verdict {
    let words = Words::of(routine);
    let why = format!(
        "the transpose of {0} is the derivative of {1}, {0} is not: its transpose fits: `tangent_order` in {2}, \
         at {3}",
        words.stiffness,
        words.stress,
        if has_sidecar(routine) {
            "the sidecar"
        } else {
            "the driver and the case"
        },
        routine.at(&step.start)
    );
    routine.fails_at(&step.start, why)
}

/// An entry that is wrong by so much of the stiffness, in words.
fn of_entry(
    routine: &Specimen,
    step: &Step,
    (row, column, by_law, by_differences): (usize, usize, f64, f64),
    off: f64,
) -> String {
    let names = routine.hypothesis.components();
    let words = Words::of(routine);
    format!(
        "{}({}, {}), {} by {}, is {by_law:.6e}, differences give {by_differences:.6e}: wrong by {off:.1e} of \
         the stiffness, the most of all, which a run pays for with iterations. {}{}At {}",
        words.stiffness,
        row + 1,
        column + 1,
        names[row],
        names[column],
        cause(routine, step, (row, column), by_differences / by_law),
        advice(
            routine,
            "An elastic or otherwise approximate one is declared by `tangent = \"approximate\"` in the \
             sidecar. "
        ),
        routine.at(&step.start)
    )
}

/// What a wrong entry looks like, where it looks like something.
fn cause(routine: &Specimen, step: &Step, (row, column): (usize, usize), ratio: f64) -> String {
    let Words {
        stress,
        strain,
        stiffness,
        ..
    } = Words::of(routine);
    let (from, to) = (step.start.flux0[row], step.end.flux[row]);
    if ratio == 0.0 && from.to_bits() == to.to_bits() {
        return format!(
            "{stress}({}) stays {to:e} in this increment: is it returned? ",
            row + 1
        );
    }
    let is_shear = |c: usize| !routine.hypothesis.is_interface() && c >= routine.n_normal();
    if !(is_shear(row) && is_shear(column)) {
        return String::new();
    }
    let times = if (ratio - 2.0).abs() < FACTOR {
        "twice"
    } else if (ratio - 0.5).abs() < FACTOR {
        "half of"
    } else {
        return String::new();
    };
    format!(
        "{stress} changes by {times} what {stiffness} says: shear components of {strain} are γ = 2ε, with G in \
         {stiffness} and {stress} += G γ. "
    )
}
