//! Does a routine read next to its arguments? The guard words there hold a NaN, which a comparison passes over: other
//! numbers in their place change what depends on them.

use super::change;
use crate::check::Verdict;
use crate::check::points::{UPDATE, first_difference};
use crate::check::specimen::Specimen;
use law::probe::{PointEnd, PointStart};

/// What is there in turn: comparisons with zero and one come out otherwise.
const OTHERS: [f64; 3] = [1.0, -1.0, 0.0];

/// The first of the points at which a routine reads next to its arguments, with where that is, in words.
pub(super) fn reads_beside(
    routine: &Specimen,
    points: &[PointStart],
) -> Result<Option<(PointStart, String)>, Verdict> {
    let found = OTHERS.iter().find_map(|value| {
        let found = with_other(routine, points, *value);
        found.transpose()
    });
    routine.probe.put_beside(None, None);
    found.transpose()
}

fn with_other(
    routine: &Specimen,
    points: &[PointStart],
    value: f64,
) -> Result<Option<(PointStart, String)>, Verdict> {
    let call = |points: &[PointStart], gap: Option<usize>, value: Option<f64>| {
        let place = routine.probe.put_beside(gap, value);
        let ends = routine.call(points, UPDATE)?.points;
        Ok::<(Option<String>, Vec<PointEnd>), Verdict>((place, ends))
    };
    let (_, usual) = call(points, None, None)?;
    let (_, other) = call(points, None, Some(value))?;
    let Some(i) = first_difference(&usual, &other) else {
        return Ok(None);
    };
    // One that is not repeatable differs by itself.
    let (_, again) = call(points, None, None)?;
    if first_difference(&usual, &again).is_some() {
        return Ok(None);
    }
    let point = std::slice::from_ref(&points[i]);
    let (_, alone) = call(point, None, None)?;
    for gap in 0.. {
        let (Some(place), ends) = call(point, Some(gap), Some(value))? else {
            break;
        };
        if first_difference(&alone, &ends).is_some() {
            let why = format!(
                "the routine reads {place}: with {value} there in place of a number that is none {}",
                change(routine, &alone[0], &ends[0])
            );
            return Ok(Some((points[i].clone(), why)));
        }
    }
    Ok(None)
}
