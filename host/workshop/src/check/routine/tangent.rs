//! Is the stiffness that a routine leaves the derivative of its stress?

use super::each;
use super::words::{Words, advice, has_sidecar};
use crate::check::mathematics::{ROUND_OFF, Slope, largest, slope};
use crate::check::specimen::Specimen;
use crate::check::walk::Step;
use crate::check::{Found, Subject, Verdict, skipped};
use law::Tangent;

/// Steps whose tangents are compared with differences, one in so many.
const COMPARED: usize = 3;

pub(super) fn ddsdde_matches_differences(subject: &Subject) -> Found {
    let (mut n_kinks, mut n_wrong) = (0, 0);
    let mut worst: Option<(f64, Verdict)> = None;
    let n = each(subject, "ddsdde", |routine, steps, _| {
        let formulation = &routine.formulation;
        let words = Words::of(routine);
        let n = routine.probe.n_components();
        let mut compared = 0;
        for step in steps.iter().step_by(COMPARED) {
            let tangent = &step.end.tangent;
            let scale = step.stiffness.max(largest(tangent));
            if formulation.symmetric {
                let entry = |i: usize, j: usize| tangent[i * n + j];
                let pairs = (0..n * n).map(|k| (k / n, k % n));
                let most = pairs.map(|(i, j)| (entry(i, j) - entry(j, i)).abs());
                let most = most.fold(0.0, f64::max);
                if most > ROUND_OFF * scale {
                    let said = if has_sidecar(routine) {
                        "`symmetric = true`"
                    } else {
                        "it is said to be symmetric"
                    };
                    let why = format!(
                        "{said}, and {} is off by {:.1e} of the stiffness, at {:?}",
                        words.stiffness,
                        most / scale,
                        step.start
                    );
                    return Err(routine.fails_at(&step.start, why));
                }
            }
            let mut transposed = step.clone();
            transposed.end.tangent = (0..n * n).map(|k| tangent[(k % n) * n + k / n]).collect();
            let is_right = |step: &Step| -> Result<bool, Verdict> {
                Ok(matches!(
                    slope(routine, step, scale)?,
                    Slope::Right | Slope::Left(..)
                ))
            };
            let by_columns = format!(
                "the transpose of {0} is the derivative of {1}, {0} is not: its transpose fits: \
                 `tangent_order` in {2}, at {3:?}",
                words.stiffness,
                words.stress,
                if has_sidecar(routine) {
                    "the sidecar"
                } else {
                    "the driver and the case"
                },
                step.start
            );
            if formulation.tangent != Tangent::Consistent {
                // One that is near the derivative may be off, but not by rows for columns.
                if is_right(&transposed)? && !is_right(step)? {
                    return Err(routine.fails_at(&step.start, by_columns));
                }
                continue;
            }
            compared += 1;
            match slope(routine, step, scale)? {
                Slope::Right | Slope::Left(..) => {}
                Slope::Kink => n_kinks += 1,
                Slope::Wrong {
                    row,
                    column,
                    by_law,
                    by_differences,
                } => {
                    if is_right(&transposed)? {
                        return Err(routine.fails_at(&step.start, by_columns));
                    }
                    n_wrong += 1;
                    let off = (by_law - by_differences).abs() / scale;
                    if worst.as_ref().is_some_and(|(most, _)| *most >= off) {
                        continue;
                    }
                    let entry = (row, column, by_law, by_differences);
                    let why = of_entry(routine, step, entry, off);
                    worst = Some((off, routine.warns_at(&step.start, why)));
                }
            }
        }
        Ok(compared)
    })?;
    if let Some((_, verdict)) = worst {
        return Err(verdict.led_by(&format!("{n_wrong} of {n} increments: ")));
    }
    if n == 0 {
        return Err(skipped("the stiffness is said to be approximate"));
    }
    let details = format!("{n} increments, {n_kinks} at kinks");
    if 2 * n_kinks > n {
        let why = format!("too few were compared: {details}");
        return Err(Verdict::Warning(why));
    }
    Ok(details)
}

/// An entry that is wrong by so much of the stiffness, in words.
fn of_entry(
    routine: &Specimen,
    step: &Step,
    (row, column, by_law, by_differences): (usize, usize, f64, f64),
    off: f64,
) -> String {
    let names = routine.hypothesis.components();
    format!(
        "{}({}, {}), {} by {}, is {by_law:.6e}, differences give {by_differences:.6e}: wrong by {off:.1e} of \
         the stiffness, the most of all, which a run pays for with iterations. {}At {:?}",
        Words::of(routine).stiffness,
        row + 1,
        column + 1,
        names[row],
        names[column],
        advice(
            routine,
            "An elastic or otherwise approximate one is declared by `tangent = \"approximate\"` in the \
             sidecar. "
        ),
        step.start
    )
}
