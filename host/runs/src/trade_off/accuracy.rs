//! Settings that reach an accuracy: `accuracy = 0.01` in a case file.
//!
//! Increments are doubled from a quarter of the file's on until the estimated error of the finest
//! run is below the target; of the runs made, the coarsest that is good enough is chosen. The
//! error of the mesh is not part of it. Every run is a row of `accuracy.csv` as soon as it is done, and
//! kept, so that a study that is stopped goes on from there.

use super::case_study::law_schemes;
use super::driver_study::in_one_line;
use super::kept::Kept;
use super::pace::in_words;
use super::sampled::Sampled;
use super::scheme::Scheme;
use super::trial::{Scratch, Settings, Timing, Trial};
use crate::Error;
use crate::run::{Observer, Options, identity_of, run_reusing};
use input::case::Chosen;
use input::material::ParameterValue;
use input::{Case, Kind};
use law::Stop;
use mechanics::equilibrium::Reuse;
use results::Figures;
use std::path::{Path, PathBuf};
use std::time::Instant;
use text::write::replace;

/// Factors of the file's increments.
const FACTORS: [f64; 9] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// What it is called where it is said what is being done.
const STUDY: &str = "accuracy";
/// Tolerances tried, coarse to fine.
const TOLERANCES: [f64; 5] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// Share of the target that increments may use up, and share that the tolerance may.
const SHARES: [f64; 2] = [0.85, 0.1];
/// The finest run has to be better than the target by this factor before any run is chosen.
const MARGIN: f64 = 0.7;
/// Of other schemes than the file's one has to be cheaper than another by this factor.
const WORTH_A_CHANGE: f64 = 0.8;
/// An error that is still this many times the target at the most increments, would it fall in proportion
/// to them, does not get there.
const HOPELESS: f64 = 4.0;
/// Bounds of the order that is extrapolated with. A larger one is not relied on.
const ORDERS: [f64; 2] = [0.3, 1.0];

/// The case with settings that reach the accuracy it asks for; `None` if it asks for none.
/// `folder` is where the study may write, and leaves nothing.
///
/// # Errors
/// Bad input before anything is written; no equilibrium with any settings; [`text::Error::Unwritable`].
pub fn reach(case: &Case, folder: &Path) -> Result<Option<Case>, Error> {
    reach_until(case, (folder, false), &Stop::never(), &mut |_| ())
}

/// Runs a case; where it asks for an accuracy, with settings that reach it.
///
/// # Errors
/// As [`reach_until`] and [`run_reusing`].
pub fn run_accurately(
    case: &Case,
    folder: &Path,
    observer: &mut dyn Observer,
    reuse: &mut Reuse,
    options: Options,
) -> Result<Figures, Error> {
    let stop = observer.stop();
    let studied = reach_until(case, (folder, options.resume), &stop, &mut |doing| {
        observer.note(doing);
    })?;
    let case = studied.as_ref().unwrap_or(case);
    if let Some(chosen) = &case.file.chosen {
        let settings = words(chosen);
        if chosen.is_reached {
            observer.note(&format!("accuracy: {settings}"));
        } else {
            observer.warning(&format!("the accuracy is not reached: {settings}"));
        }
    }
    run_reusing(case, folder, observer, reuse, options)
}

/// What was chosen, and the error that it has.
fn words(chosen: &Chosen) -> String {
    let increments: Vec<String> = chosen
        .increments
        .iter()
        .map(|(phase, n)| format!("{phase} {n}"))
        .collect();
    let settings = format!(
        "error {:.1e} estimated, {:.1e} asked for; increments {}, force tolerance {:e} {}",
        chosen.reached,
        chosen.asked,
        increments.join(", "),
        chosen.force_tolerance,
        chosen.parameters.join(" ")
    );
    settings.trim_end().to_owned()
}

/// As [`reach`], to be stopped on its way, and to go on (`resume`) with what is kept of an earlier study
/// in the folder. `say` takes what is being done.
///
/// # Errors
/// As [`reach`]; [`law::Stopped`]; what is kept belongs to another case.
pub fn reach_until(
    case: &Case,
    (folder, resume): (&Path, bool),
    stop: &Stop,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Case>, Error> {
    let Some(accuracy) = &case.file.accuracy else {
        return Ok(None);
    };
    crate::run::check(case)?;
    if case.file.probes.is_empty() && case.file.pile.is_none() {
        let message =
            "`accuracy` is the error of the [probes] and of the [pile], and there are none";
        return Err(case.source.error(accuracy.span(), message).into());
    }
    let kept = Kept::begin(folder, &identity_of(case)?, resume)?;
    let scratch = Scratch::new(folder, stop)?.keeping(kept);
    let mut search = Search {
        case,
        scratch: &scratch,
        asked: *accuracy.get_ref(),
        runs: 0,
        table: Table::begin(folder)?,
        say,
    };
    let (settings, found) = search.best()?;
    let (settings, tolerance_error) = search.loosened(settings, &found)?;
    let reached = found.error + tolerance_error;
    let mut chosen = settings.apply(case)?;
    let phases = chosen.file.phases.iter();
    let increments = phases.map(|phase| {
        let name = phase.name.get_ref().clone();
        (name, *phase.increments.get_ref())
    });
    chosen.file.chosen = Some(Chosen {
        asked: search.asked,
        reached,
        is_reached: reached <= search.asked,
        estimate: found.estimate,
        increments: increments.collect(),
        force_tolerance: chosen.file.solver.force_tolerance,
        displacement_tolerance: chosen.file.solver.displacement_tolerance,
        parameters: settings.law.iter().flat_map(parameters).collect(),
        runs: search.runs,
    });
    Ok(Some(chosen))
}

/// `law.parameter = value`.
fn parameters((law, values, _): &(String, Vec<(String, ParameterValue)>, String)) -> Vec<String> {
    let written = |(id, value): &(String, ParameterValue)| {
        let value = match value {
            ParameterValue::Number(number) => number.to_string(),
            ParameterValue::Integer(number) => number.to_string(),
            ParameterValue::Label(label) => format!("{label:?}"),
            ParameterValue::Varying(over) => format!("{:?}", over.z),
        };
        format!("{law}.{id} = {value}")
    };
    values.iter().map(written).collect()
}

/// Settings that are good enough, or the best there are.
struct Found {
    factor: f64,
    /// Estimated relative error of the run with these settings.
    error: f64,
    estimate: String,
    trial: Trial,
    scale: Vec<f64>,
}

struct Search<'a> {
    case: &'a Case,
    scratch: &'a Scratch,
    asked: f64,
    runs: usize,
    table: Table,
    say: &'a mut dyn FnMut(&str),
}

/// `accuracy.csv`: a row for every run of the study.
struct Table {
    path: PathBuf,
    text: String,
}

impl Table {
    /// Begins the table in a folder.
    fn begin(folder: &Path) -> Result<Self, Error> {
        let table = Self {
            path: folder.join("accuracy.csv"),
            text: "run,setting,cpu_seconds,iterations,change,error,failure\n".to_owned(),
        };
        table.write()?;
        Ok(table)
    }

    /// Adds a run: its trial, by how much it differs from the one before it, the error that is estimated
    /// for it.
    fn row(
        &mut self,
        (run, settings): (usize, &Settings),
        outcome: Result<&Trial, &Error>,
        [change, error]: [Option<f64>; 2],
    ) -> Result<(), Error> {
        let number = |value: Option<f64>| value.map(|v| format!("{v:e}")).unwrap_or_default();
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let label = quoted(&settings.label());
        let row = match outcome {
            Ok(trial) => format!(
                "{run},{label},{:e},{},{},{},\n",
                trial.seconds,
                trial.counts[0],
                number(change),
                number(error)
            ),
            Err(error) => format!("{run},{label},,,,,{}\n", quoted(&in_one_line(error))),
        };
        self.text += &row;
        self.write()
    }

    fn write(&self) -> Result<(), Error> {
        Ok(replace(&self.path, &self.text)?)
    }
}

impl Search<'_> {
    /// The file's scheme, if it is good enough: looking for a better one costs more runs than it saves. Else
    /// of the others the cheapest that is.
    fn best(&mut self) -> Result<(Settings, Found), Error> {
        let aim = SHARES[0] * self.asked;
        let good = |found: &Found| found.error <= aim;
        let plain = Settings::default();
        let found = self.with(&plain, FACTORS[FACTORS.len() - 1], None)?;
        let mut best = (plain, found);
        let schemes: Vec<(String, Scheme)> = if good(&best.1) {
            Vec::new()
        } else {
            (self.say)(&format!("{STUDY}: which schemes of the laws there are"));
            law_schemes(self.case, self.scratch)?
        };
        let others = schemes.iter().filter(|(_, s)| s.is_finest && !s.is_default);
        for (law, scheme) in others {
            let settings = Settings {
                law: Some(scheme.of(law)),
                ..Settings::default()
            };
            // More increments than the best so far needs do not pay.
            let cheap = WORTH_A_CHANGE * best.1.trial.seconds;
            let limit = good(&best.1).then_some(cheap);
            let found = self.with(&settings, f64::max(best.1.factor, 1.0), limit);
            self.scratch.stop.check(STUDY)?;
            let Ok(found) = found else {
                continue;
            };
            let is_cheaper = found.trial.seconds < cheap;
            if good(&found) && (is_cheaper || !good(&best.1)) {
                best = (settings, found);
            }
        }
        let (settings, found) = best;
        let settings = Settings {
            increments: found.factor,
            ..settings
        };
        Ok((settings, found))
    }

    /// Doubles increments until the finest run is good enough, or the coarsest takes more seconds than the
    /// limit.
    fn with(&mut self, settings: &Settings, most: f64, limit: Option<f64>) -> Result<Found, Error> {
        let mut levels: Vec<(f64, Trial)> = Vec::new();
        let mut last_increments = Vec::new();
        let mut failure = None;
        // Factor and seconds of the last run.
        let mut last: Option<(f64, f64)> = None;
        let factors = FACTORS.into_iter().filter(|f| *f <= f64::max(most, 2.0));
        for factor in factors.clone() {
            let settings = Settings {
                increments: factor,
                ..settings.clone()
            };
            let phases = settings.apply(self.case)?.file.phases;
            let increments: Vec<usize> = phases.iter().map(|p| *p.increments.get_ref()).collect();
            if increments == last_increments {
                continue;
            }
            last_increments = increments;
            self.runs += 1;
            let rest = factors.clone().filter(|f| *f >= factor).sum::<f64>();
            let doing = format!("{STUDY}: run {}, {}", self.runs, settings.label());
            (self.say)(&match last {
                Some((of, took)) => format!(
                    "{doing} (about {}, at most about {} left for these settings)",
                    in_words(took * factor / of),
                    in_words(took * rest / of)
                ),
                None => doing,
            });
            let started = Instant::now();
            let outcome = self.scratch.trial(self.case, &settings, Timing::Once, 0);
            match outcome {
                Ok(trial) => {
                    last = Some((factor, trial.seconds));
                    let is_dear = limit.is_some_and(|limit| trial.seconds > limit);
                    levels.push((factor, trial));
                    let [.., (_, done)] = levels.as_slice() else {
                        continue;
                    };
                    let change = levels.len().checked_sub(2).map(|before| {
                        let before = &levels[before].1.rows;
                        before.difference(&done.rows, &done.rows.largest())
                    });
                    let found = [change, finest_error(&levels)];
                    self.table.row((self.runs, &settings), Ok(done), found)?;
                    if levels.len() == 1 && is_dear {
                        break;
                    }
                }
                Err(error) if error.kind() == Kind::NoEquilibrium => {
                    last = Some((factor, started.elapsed().as_secs_f64()));
                    // Finer runs are not compared with coarser ones across a gap.
                    levels.clear();
                    self.table
                        .row((self.runs, &settings), Err(&error), [None; 2])?;
                    failure = Some(error);
                    continue;
                }
                Err(error) => return Err(error),
            }
            if let Some(estimated) = finest_error(&levels) {
                let at_most_increments = estimated * factor / FACTORS[FACTORS.len() - 1];
                if estimated <= MARGIN * self.asked || at_most_increments > HOPELESS * self.asked {
                    break;
                }
            }
        }
        let Some((_, finest)) = levels.last() else {
            let none = || Error::internal("no level of increments was tried".to_owned());
            return Err(failure.unwrap_or_else(none));
        };
        let finest = finest.clone();
        let scale = finest.rows.largest();
        let of_finest = finest_error(&levels).unwrap_or(f64::INFINITY);
        let error = |rows: &Sampled| rows.difference(&finest.rows, &scale) + of_finest;
        let n = levels.len();
        let enough = levels
            .iter()
            .position(|(_, trial)| error(&trial.rows) <= SHARES[0] * self.asked);
        let finest_factor = levels[n - 1].0;
        let (factor, trial) = levels.swap_remove(enough.unwrap_or(n - 1));
        Ok(Found {
            factor,
            error: error(&trial.rows),
            estimate: format!(
                "the difference of two runs with increments × {} and × {} of the file, \
                 extrapolated with an order of at most {}, plus the difference of the chosen run \
                 to the finest, plus the effect of the tolerance; largest over probes and common \
                 rows, relative to the largest value of the probe. The error of the mesh is not \
                 included",
                finest_factor / 2.0,
                finest_factor,
                ORDERS[1]
            ),
            trial,
            scale,
        })
    }

    /// The loosest tolerance that takes fewer iterations and hardly changes the result, and how
    /// much that is.
    fn loosened(&mut self, settings: Settings, found: &Found) -> Result<(Settings, f64), Error> {
        let given = self.case.file.solver.force_tolerance;
        for tolerance in TOLERANCES.into_iter().filter(|t| *t > given) {
            let loose = Settings {
                tolerance: Some(tolerance),
                ..settings.clone()
            };
            self.runs += 1;
            (self.say)(&format!("{STUDY}: run {}, {}", self.runs, loose.label()));
            let trial = match self.scratch.trial(self.case, &loose, Timing::Once, 0) {
                Ok(trial) => trial,
                Err(error) if error.kind() == Kind::NoEquilibrium => {
                    self.table
                        .row((self.runs, &loose), Err(&error), [None; 2])?;
                    continue;
                }
                Err(error) => return Err(error),
            };
            let change = trial.rows.difference(&found.trial.rows, &found.scale);
            let told = [Some(change), Some(found.error + change)];
            self.table.row((self.runs, &loose), Ok(&trial), told)?;
            if change <= SHARES[1] * self.asked && trial.counts[0] < found.trial.counts[0] {
                return Ok((loose, change));
            }
        }
        Ok((settings, 0.0))
    }
}

/// Estimated relative error of the finest of at least three levels.
fn finest_error(levels: &[(f64, Trial)]) -> Option<f64> {
    let [.., (_, coarse), (_, middle), (_, fine)] = levels else {
        return None;
    };
    let scale = fine.rows.largest();
    let differences =
        [(coarse, middle), (middle, fine)].map(|(a, b)| a.rows.difference(&b.rows, &scale));
    let order = (differences[0] / differences[1]).log2();
    let order = if order.is_nan() { ORDERS[1] } else { order };
    let order = order.clamp(ORDERS[0], ORDERS[1]);
    Some(differences[1] / (order.exp2() - 1.0))
}
