//! The error of the mesh, from uniform refinements.

use super::super::settings::Settings;
use super::levels::{Levels, ORDERS};
use super::search::Search;
use super::{STUDY, messages};
use crate::Error;
use crate::experiment::Timing;
use crate::experiment::progress::in_words;
use input::accuracy_settings::ChosenMesh;
use std::time::Duration;

/// Divisions of the sides of elements, coarse to fine.
const DIVISIONS: [usize; 3] = [2, 4, 8];
/// All refined runs together may take this many times the CPU time of the run on the file's mesh, or this many
/// seconds, whichever is more.
const BUDGET: f64 = 100.0;
const LEAST_BUDGET: f64 = 20.0;
/// A run on a mesh of half the size of elements probably takes this many times as long: four times the elements,
/// with twice the bandwidth.
const DEARER: f64 = 8.0;

/// The error of the finest mesh; of two as if it fell with the largest order, and none of those that show that it does
/// not fall.
fn error(levels: &Levels) -> Option<f64> {
    match levels.growth() {
        Some(_) => None,
        None => levels.error_of_order(ORDERS[1]),
    }
}

/// Refines the mesh until its error is at most `most`, or the time is up. Returns the settings with the coarsest
/// mesh that is good enough, else the finest that came to its end.
///
/// # Errors
/// The study was stopped; the table cannot be written.
pub(super) fn refine(
    search: &mut Search<'_>,
    settings: Settings,
    most: f64,
) -> Result<(Settings, ChosenMesh), Error> {
    let own = search.trials.run(&settings, Timing::Once, 0)?;
    let mut left = f64::max(BUDGET * own.seconds, LEAST_BUDGET);
    let (mut last, mut dearer) = (own.seconds, DEARER);
    let mut levels = Levels::default();
    levels.push(1.0, own);
    let mut why = None;
    for division in DIVISIONS {
        let finer = settings.clone().divided(division);
        let expected = last * dearer;
        if expected > left {
            why = Some(messages::too_long(division, [expected, left].map(in_words)));
            break;
        }
        search.begin(&finer, Some([expected, left]));
        let within = Timing::Within(Duration::from_secs_f64(left));
        let outcome = search.trials.run(&finer, within, 0);
        search.trials.stop.check(STUDY)?;
        let trial = match outcome {
            Ok(trial) => trial,
            Err(error) => {
                search.failed(&finer, &error)?;
                why = Some(messages::mesh_failed(division));
                break;
            }
        };
        left -= trial.seconds;
        dearer = trial.seconds / last;
        last = trial.seconds;
        levels.push(division as f64, trial);
        let told = [levels.difference(), error(&levels)];
        if let Some((_, done)) = levels.finest() {
            search.table.row((search.runs, &finer), Ok(done), told)?;
        }
        // Where increments alone have more than all of it, no mesh is fine enough.
        if most <= 0.0 || told[1].is_some_and(|error| error <= most) {
            break;
        }
    }
    let chosen = chosen(levels, most, why)?;
    Ok((settings.divided(chosen.divided_by), chosen))
}

/// The coarsest mesh whose error is at most `most`, else the finest; `why` there is no finer one.
fn chosen(levels: Levels, most: f64, why: Option<String>) -> Result<ChosenMesh, Error> {
    let (difference, worst) = (levels.difference(), levels.worst());
    let estimate = match levels.growth() {
        Some(differences) => messages::mesh_diverges(levels.len(), differences, why),
        None => messages::mesh_estimate(levels.len(), ORDERS, why),
    };
    let of_finest = error(&levels);
    let none = || Error::internal("the run on the file's mesh is lost".to_owned());
    let (division, _, error) = levels.take(of_finest, most).ok_or_else(none)?;
    Ok(ChosenMesh {
        divided_by: division as usize,
        error,
        difference,
        worst,
        estimate,
    })
}
