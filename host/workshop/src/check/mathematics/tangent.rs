//! Is the consistent tangent the derivative of the update, symmetric and constant where that is declared?

use super::slope::{Entry, Slope, TANGENT, slope};
use crate::check::draw::Draw;
use crate::check::loading_path::{Step, flux_scale, starts};
use crate::check::points::{ELASTIC, ROUND_OFF, apart, increment, largest};
use crate::check::specimen::Specimen;
use crate::check::words::Words;
use crate::check::{Found, Subject, Verdict, counted, skipped, warned};
use law::Tangent;
use law::probe::PointEnd;
use std::collections::BTreeMap;

/// Number of compared tangents, and findings about them.
#[derive(Default)]
struct Tally {
    n: usize,
    n_kinks: usize,
    /// For laws of the contract: inelastic ones, and a little stiffness that is left.
    n_inelastic: usize,
    left: Option<Verdict>,
    /// For routines: those that are wrong, and the worst.
    n_wrong: usize,
    worst: Option<(f64, Verdict)>,
}

impl Tally {
    /// A warning where most were at kinks.
    fn found(&self, none: &str, details: String) -> Found {
        if self.n == 0 {
            Err(skipped(none))
        } else if 2 * self.n_kinks > self.n {
            Err(warned(format!("too few were compared: {details}")))
        } else {
            Ok(details)
        }
    }

    /// Judges the tangent of a step. An error is one of a kind that no iteration pays for.
    fn take(&mut self, law: &Specimen, step: &Step) -> Result<(), Verdict> {
        let scale = step.stiffness.max(largest(&step.end.tangent));
        let is_own = law.adapter().is_none();
        self.n += 1;
        match slope(law, step, scale)? {
            Slope::Kink => self.n_kinks += 1,
            Slope::Left(row, column) if is_own && self.left.is_none() => {
                let names = law.hypothesis.components();
                let entry = step.end.tangent[row * names.len() + column];
                let why = format!(
                    "row `{}`, column `{}` of the tangent is {entry:.6e}, {:.1e} of the stiffness, \
                     where the flux does not change at all: a little stiffness left for the solver? \
                     At {}",
                    names[row],
                    names[column],
                    entry.abs() / scale,
                    law.at(&step.start)
                );
                self.left = Some(law.warns_for(&step.start, why));
            }
            Slope::Right | Slope::Left(..) => {}
            Slope::Wrong(entry) if is_own => {
                let names = law.hypothesis.components();
                let why = format!(
                    "row `{}`, column `{}` of the tangent is {:.6e}, differences give \
                     {:.6e}: wrong by {:.1e} of the stiffness",
                    names[entry.row],
                    names[entry.column],
                    entry.by_law,
                    entry.by_differences,
                    entry.off(scale)
                );
                return Err(law.fails_at(&step.start, why));
            }
            Slope::Wrong(entry) => {
                if fits(law, &transposed(step), scale)? {
                    return Err(by_columns(law, step));
                }
                self.n_wrong += 1;
                let off = entry.off(scale);
                if self.worst.as_ref().is_none_or(|(most, _)| *most < off) {
                    let why = of_entry(law, step, entry, off);
                    self.worst = Some((off, law.warns_for(&step.start, why)));
                }
            }
        }
        Ok(())
    }
}

pub(super) fn tangent_matches_differences(subject: &Subject) -> Found {
    let mut tally = Tally::default();
    subject.each(Draw::DefaultChoices, "tangent", 5, |specimen, random| {
        let steps = specimen.paths(36, random)?.steps;
        if specimen.formulation.tangent != Tangent::Consistent {
            return Ok(0);
        }
        let elastic = specimen.call(&starts(&steps), ELASTIC)?.points;
        let mut kinds: BTreeMap<Vec<u8>, usize> = BTreeMap::new();
        for (i, (step, elastic)) in steps.iter().zip(&elastic).enumerate() {
            // Every fifth, so that all increments of a straight piece occur, and the first ones of each kind,
            // since some, as those in which contact re-forms, are rare.
            let seen = kinds.entry(kind(step, elastic)).or_insert(0);
            *seen += 1;
            if specimen.course.is_none() && i % 5 > 0 && *seen > OF_EACH_KIND {
                continue;
            }
            let scale = step.stiffness.max(largest(&step.end.tangent));
            let is_inelastic = apart(&elastic.tangent, &step.end.tangent) > TANGENT * scale;
            tally.n_inelastic += usize::from(is_inelastic);
            tally.take(specimen, step)?;
        }
        Ok(0)
    })?;
    let Tally {
        n,
        n_inelastic,
        n_kinks,
        ..
    } = tally;
    let details = format!("{n} tangents, {n_inelastic} of them inelastic, {n_kinks} at kinks");
    let found = tally.found("no law declares a consistent tangent", details)?;
    tally.left.map_or(Ok(found), Err)
}

/// Steps of a routine whose tangents are compared with differences, one in this many.
const COMPARED: usize = 3;

pub(in crate::check) fn ddsdde_matches_differences(subject: &Subject) -> Found {
    let mut tally = Tally::default();
    subject.each_walk("ddsdde", |routine, steps, _| {
        for step in steps.iter().step_by(COMPARED) {
            let scale = step.stiffness.max(largest(&step.end.tangent));
            if routine.formulation.symmetric {
                is_symmetric(routine, step, scale)?;
            }
            if routine.formulation.tangent == Tangent::Consistent {
                tally.take(routine, step)?;
            } else if fits(routine, &transposed(step), scale)? && !fits(routine, step, scale)? {
                // One that is near the derivative may be off, but not by rows for columns.
                return Err(by_columns(routine, step));
            }
        }
        Ok(0)
    })?;
    let (n, n_kinks, n_wrong) = (tally.n, tally.n_kinks, tally.n_wrong);
    if let Some((_, mut worst)) = tally.worst.take() {
        worst.why = format!("{n_wrong} of {n} increments: {}", worst.why);
        return Err(worst);
    }
    let details = format!("{n} increments, {n_kinks} at kinks");
    tally.found("the stiffness is said to be approximate", details)
}

/// Whether the tangent of a step is the derivative.
fn fits(routine: &Specimen, step: &Step, scale: f64) -> Result<bool, Verdict> {
    let slope = slope(routine, step, scale)?;
    Ok(matches!(slope, Slope::Right | Slope::Left(..)))
}

/// Steps of each kind that are compared at least.
const OF_EACH_KIND: usize = 3;

/// Outside view of a step: the size of each entry of its tangent relative to the elastic operator,
/// and the change of each internal variable.
fn kind(step: &Step, elastic: &PointEnd) -> Vec<u8> {
    let scale = largest(&elastic.tangent);
    let entries = step.end.tangent.iter().zip(&elastic.tangent);
    let entries = entries.map(|(a, e)| match (a - e) / scale {
        off if off.abs() <= TANGENT => 0,
        _ if a.abs() <= TANGENT * scale => 1,
        off if off < 0.0 => 2,
        _ => 3,
    });
    let states = step.end.state.iter().zip(&step.start.state0);
    let states = states.map(|(end, start)| match (*start, *end) {
        (start, end) if start.to_bits() == end.to_bits() => 0,
        (_, 0.0) => 1,
        (0.0, _) => 2,
        (start, end) if end > start => 3,
        _ => 4,
    });
    entries.chain(states).collect()
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
        if routine.has_sidecar() {
            "`symmetric = true`"
        } else {
            "it is said to be symmetric"
        },
        routine.words().stiffness,
        most / scale,
        routine.at(&step.start)
    );
    Err(routine.fails_for(&step.start, why))
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
    let words = routine.words();
    let why = format!(
        "the transpose of {0} is the derivative of {1}, {0} is not: its transpose fits: `tangent_order` in {2}, \
         at {3}",
        words.stiffness,
        words.stress,
        if routine.has_sidecar() {
            "the sidecar"
        } else {
            "the driver and the case"
        },
        routine.at(&step.start)
    );
    routine.fails_for(&step.start, why)
}

/// An entry that is wrong by so much of the stiffness, in words.
fn of_entry(routine: &Specimen, step: &Step, entry: Entry, off: f64) -> String {
    let names = routine.hypothesis.components();
    format!(
        "{}({}, {}), {} by {}, is {:.6e}, differences give {:.6e}: wrong by {off:.1e} of \
         the stiffness, the most of all, which a run pays for with iterations. {}{}At {}",
        routine.words().stiffness,
        entry.row + 1,
        entry.column + 1,
        names[entry.row],
        names[entry.column],
        entry.by_law,
        entry.by_differences,
        cause(
            routine,
            step,
            (entry.row, entry.column),
            entry.by_differences / entry.by_law
        ),
        routine.advice(
            "An elastic or otherwise approximate one is declared by `tangent = \"approximate\"` in the \
             sidecar. "
        ),
        routine.at(&step.start)
    )
}

/// How near a ratio is to 2 or 1/2 where shear strains are confused.
const FACTOR: f64 = 1e-3;

/// What a wrong entry looks like, where it looks like something.
fn cause(routine: &Specimen, step: &Step, (row, column): (usize, usize), ratio: f64) -> String {
    let Words {
        stress,
        strain,
        stiffness,
        ..
    } = routine.words();
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

pub(super) fn tangent_symmetry_as_declared(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "symmetry", 4, |specimen, random| {
        if !specimen.formulation.symmetric {
            return Ok(0);
        }
        let steps = specimen.paths(36, random)?.steps;
        for step in &steps {
            let k = &step.end.tangent;
            let n = step.end.flux.len();
            let bound = ROUND_OFF * largest(k).max(step.stiffness);
            let mut pairs = (0..n).flat_map(|row| (0..row).map(move |column| (row, column)));
            let unlike = pairs
                .find(|(row, column)| (k[row * n + column] - k[column * n + row]).abs() > bound);
            if let Some((row, column)) = unlike {
                let names = specimen.hypothesis.components();
                let why = format!(
                    "the tangent is declared symmetric, but row `{0}`, column `{1}` is \
                     {2:.6e}, row `{1}`, column `{0}` {3:.6e}",
                    names[row],
                    names[column],
                    k[row * n + column],
                    k[column * n + row]
                );
                return Err(specimen.fails_at(&step.start, why));
            }
        }
        Ok(steps.len())
    })?;
    counted(n, "tangents", "no tangent is declared symmetric")
}

pub(super) fn linearity_as_declared(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "linearity", 3, |specimen, random| {
        if !specimen.formulation.linear {
            return Ok(0);
        }
        let steps = specimen.paths(20, random)?.steps;
        for step in &steps {
            let constant = &steps[0].end.tangent;
            let moved = increment(&step.start);
            let rows = constant.chunks(moved.len());
            let predicted: Vec<f64> = rows
                .zip(&step.start.flux0)
                .map(|(row, flux)| {
                    let entries = row.iter().zip(&moved);
                    flux + entries.map(|(k, d)| k * d).sum::<f64>()
                })
                .collect();
            let why = if apart(&predicted, &step.end.flux) > ROUND_OFF * flux_scale(step) {
                "the tangent does not predict the flux"
            } else if apart(constant, &step.end.tangent) > ROUND_OFF * step.stiffness {
                "the tangent changes"
            } else {
                continue;
            };
            return Err(specimen.fails_at(&step.start, format_args!("declared linear, but {why}")));
        }
        Ok(steps.len())
    })?;
    counted(n, "steps", "no law is declared linear")
}
