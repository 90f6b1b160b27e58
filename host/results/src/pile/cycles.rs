//! `cycles.csv`: what a pile does when its load goes up and down.

use super::criteria::Curve;
use crate::table::comma_separated;
use std::path::Path;
use text::Error;
use text::digits::number;
use text::write::replace;

/// Reversals smaller than this share of the largest load are none.
const LEAST: f64 = 0.01;
/// Loads closer than this share of the largest are one: where a pile slides, a reversal is at its end.
const SAME: f64 = 1e-6;
/// Share of the forces below which a load is nothing.
pub(super) const ROUND_OFF: f64 = 1e-8;
/// Name of the file.
pub(crate) const FILE_NAME: &str = "cycles.csv";
const COLUMNS: [&str; 8] = [
    "phase",
    "cycle",
    "load_max",
    "load_min",
    "settlement_max",
    "settlement_min",
    "permanent",
    "secant_stiffness",
];

/// A state of the head: net load, kN, and settlement, m.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Head<'c> {
    phase: &'c str,
    load: f64,
    settlement: f64,
}

/// A largest load and the smallest that follows.
#[derive(Clone, Debug, PartialEq)]
struct Cycle<'c> {
    max: Head<'c>,
    min: Head<'c>,
    /// Settlement that stays, since the cycle before.
    permanent: f64,
}

/// Writes the table, if there is a cycle.
///
/// # Errors
/// [`Error::Unwritable`].
pub(crate) fn write(folder: &Path, curve: &Curve) -> Result<(), Error> {
    let cycles = cycles(curve);
    if cycles.is_empty() {
        return Ok(());
    }
    let row = |(count, cycle): (usize, &Cycle<'_>)| {
        let Cycle {
            max,
            min,
            permanent,
        } = cycle;
        let back = max.settlement - min.settlement;
        let stiffness = (back > 0.0).then(|| (max.load - min.load) / back);
        let values = [
            max.load,
            min.load,
            max.settlement,
            min.settlement,
            *permanent,
        ];
        let values = values.map(number).into_iter();
        let place = [max.phase.to_owned(), (count + 1).to_string()].into_iter();
        let stiffness = stiffness.map(number).unwrap_or_default();
        place.chain(values).chain([stiffness]).collect()
    };
    let text = comma_separated(COLUMNS, cycles.iter().enumerate().map(row))?;
    replace(&folder.join(FILE_NAME), text)
}

/// The cycles of a pile that is in place. Cycles in phases that reset settlements are separate.
fn cycles(curve: &Curve) -> Vec<Cycle<'_>> {
    let phases = curve.phases().filter(|phase| phase.is_in_place);
    let points = || phases.clone().flat_map(|phase| &phase.points);
    let largest = points().fold(0.0, |m: f64, point| m.max(point[1].abs()));
    // The load of a free head is round-off of the forces below it.
    let forces = points().flat_map(|point| &point[1..]);
    if largest <= ROUND_OFF * forces.fold(0.0, |m: f64, force| m.max(force.abs())) {
        return Vec::new();
    }
    let least = LEAST * largest;
    let mut courses: Vec<Vec<Head<'_>>> = Vec::new();
    for phase in phases {
        let of = |[settlement, load, ..]: [f64; 4]| Head {
            phase: &phase.phase,
            load,
            settlement,
        };
        if courses.is_empty() || phase.resets {
            courses.push(vec![of(phase.start())]);
        }
        if let Some(course) = courses.last_mut() {
            course.extend(phase.points.iter().copied().map(of));
        }
    }
    courses
        .iter()
        .flat_map(|course| pairs(course, least, SAME * largest))
        .collect()
}

/// The pairs of a course, from its start.
fn pairs<'c>(course: &[Head<'c>], least: f64, same: f64) -> Vec<Cycle<'c>> {
    let mut pairs: Vec<Cycle<'c>> = Vec::new();
    let Some(&start) = course.first() else {
        return pairs;
    };
    let mut before = start.settlement;
    let mut end = |max: Option<Head<'c>>, min: Head<'c>| {
        if let Some(max) = max {
            pairs.push(Cycle {
                max,
                min,
                permanent: min.settlement - before,
            });
            before = min.settlement;
        }
    };
    // The last largest load, and the smallest since, if the load falls.
    let (mut max, mut min) = (None, Some(start));
    for &head in course {
        match (max, min) {
            (_, Some(low)) if head.load <= low.load + same => min = Some(head),
            (_, Some(low)) if head.load - low.load >= least => {
                end(max, low);
                (max, min) = (Some(head), None);
            }
            (Some(high), None) if head.load >= high.load - same => max = Some(head),
            (Some(high), None) if high.load - head.load >= least => {
                min = Some(head);
            }
            _ => {}
        }
    }
    if let Some(low) = min {
        end(max, low);
    }
    pairs
}
