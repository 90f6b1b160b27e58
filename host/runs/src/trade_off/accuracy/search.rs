//! The search for increments, a scheme of the laws and a tolerance that are good enough.

use super::super::case_study::{LONG, law_schemes};
use super::super::driver_study::in_one_line;
use super::super::scheme::Scheme;
use super::super::settings::Settings;
use super::super::trials::Trials;
use super::STUDY;
use super::levels::{Levels, ORDERS};
use super::messages;
use super::table::Table;
use crate::Error;
use crate::experiment::progress::in_words;
use crate::experiment::{Timing, Trial};
use input::Kind;
use input::accuracy_settings::FailedTrial;
use std::path::Path;
use std::time::Instant;

/// Factors of the file's increments.
const FACTORS: [f64; 9] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// Tolerances tried, coarse to fine.
const TOLERANCES: [f64; 5] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// Share of the target that increments may use up, and share that the tolerance may.
const SHARES: [f64; 2] = [0.85, 0.1];
/// The finest run has to be better than the target by this factor before any run is chosen.
const MARGIN: f64 = 0.7;
/// Another scheme than the file's has to be cheaper by this factor.
const WORTH_A_CHANGE: f64 = 0.8;
/// An error that is still this many times the target at the most increments, would it fall in proportion
/// to them, does not get there.
const HOPELESS: f64 = 4.0;

/// Settings that are good enough, or the best there are.
pub(super) struct Found {
    /// Factor of the increments.
    factor: f64,
    /// Estimated relative error of the run with these settings, where three runs tell it.
    pub(super) error: Option<f64>,
    /// By how much the two finest runs differ.
    pub(super) difference: Option<f64>,
    /// What they differ most in.
    pub(super) worst: Option<String>,
    /// How the error was estimated.
    pub(super) estimate: String,
    /// Number of the runs behind it that cut steps back.
    pub(super) cut_back: usize,
    pub(super) trial: Trial,
    pub(super) scale: Vec<f64>,
}

/// A study on its way.
pub(super) struct Search<'a> {
    pub(super) trials: &'a Trials<'a>,
    /// The error that increments and tolerance may have.
    pub(super) asked: f64,
    pub(super) runs: usize,
    pub(super) table: Table,
    /// Trials that did not come to their end.
    pub(super) failed: Vec<FailedTrial>,
    pub(super) say: &'a mut dyn FnMut(&str),
}

impl<'a> Search<'a> {
    /// Before the first trial; `folder` is where its table is.
    ///
    /// # Errors
    /// The table cannot be written.
    pub(super) fn new(
        trials: &'a Trials<'a>,
        asked: f64,
        folder: &Path,
        say: &'a mut dyn FnMut(&str),
    ) -> Result<Self, Error> {
        Ok(Self {
            trials,
            asked,
            runs: 0,
            table: Table::begin(folder)?,
            failed: Vec::new(),
            say,
        })
    }

    /// The file's scheme, if it is good enough: looking for a better one costs more runs than it saves. Else
    /// of the others the cheapest that is, unless runs are long.
    ///
    /// # Errors
    /// No run came to its end; the study was stopped.
    pub(super) fn best(&mut self) -> Result<(Settings, Found), Error> {
        let aim = SHARES[0] * self.asked;
        let good = |found: &Found| found.error.is_some_and(|error| error <= aim);
        let plain = Settings::default();
        let found = self.with(&plain, FACTORS[FACTORS.len() - 1], None)?;
        let mut best = (plain, found);
        let as_in_file = best.1.trial.seconds / best.1.factor;
        let schemes: Vec<(String, Scheme)> = if good(&best.1) {
            Vec::new()
        } else if as_in_file > LONG {
            (self.say)(&messages::no_schemes(as_in_file));
            Vec::new()
        } else {
            (self.say)(&format!("{STUDY}: which schemes of the laws there are"));
            law_schemes(self.trials)?
        };
        let others = schemes.iter().filter(|(_, s)| s.is_finest && !s.is_default);
        for (law, scheme) in others {
            let settings = Settings::default().with_scheme(law, scheme);
            // More increments than the best so far needs do not pay.
            let cheap = WORTH_A_CHANGE * best.1.trial.seconds;
            let limit = good(&best.1).then_some(cheap);
            let found = self.with(&settings, f64::max(best.1.factor, 1.0), limit);
            self.trials.stop.check(STUDY)?;
            let Ok(found) = found else {
                continue;
            };
            let is_cheaper = found.trial.seconds < cheap;
            if good(&found) && (is_cheaper || !good(&best.1)) {
                best = (settings, found);
            }
        }
        let (settings, found) = best;
        Ok((settings.with_increments(found.factor), found))
    }

    /// Doubles increments until the finest run is good enough, or the coarsest takes more seconds than the
    /// limit. Runs that do not finish are skipped.
    fn with(&mut self, settings: &Settings, most: f64, limit: Option<f64>) -> Result<Found, Error> {
        let mut levels = Levels::of_increments();
        let mut last_increments = Vec::new();
        let mut failure = None;
        // Factor and seconds of the last run.
        let mut last: Option<(f64, f64)> = None;
        let factors = FACTORS.into_iter().filter(|f| *f <= f64::max(most, 2.0));
        for factor in factors.clone() {
            let settings = settings.clone().with_increments(factor);
            let phases = settings.apply(self.trials.case)?.file.phases;
            let increments: Vec<usize> = phases.iter().map(|p| *p.increments.get_ref()).collect();
            if increments == last_increments {
                continue;
            }
            last_increments = increments;
            let rest = factors.clone().filter(|f| *f >= factor).sum::<f64>();
            let left = last.map(|(of, took)| [factor, rest].map(|more| took * more / of));
            self.begin(&settings, left);
            let started = Instant::now();
            let outcome = self.trials.run(&settings, Timing::Once, 0);
            match self.passed_over(&settings, outcome)? {
                Ok(trial) => {
                    last = Some((factor, trial.seconds));
                    let is_dear = limit.is_some_and(|limit| trial.seconds > limit);
                    levels.push(factor, trial);
                    let told = [levels.difference(), levels.error()];
                    let done = levels.finest().map(|(_, done)| done);
                    if let Some(done) = done {
                        self.table.row((self.runs, &settings), Ok(done), told)?;
                    }
                    if levels.len() == 1 && is_dear {
                        break;
                    }
                    if told[1].is_some_and(|error| self.is_enough(error, factor)) {
                        break;
                    }
                }
                Err(error) => {
                    last = Some((factor, started.elapsed().as_secs_f64()));
                    failure = Some(error);
                }
            }
        }
        let none = || Error::internal("no level of increments was tried".to_owned());
        self.found(levels)
            .ok_or_else(|| failure.unwrap_or_else(none))
    }

    /// Says what is run next, and with the seconds that it and all others may take.
    pub(super) fn begin(&mut self, settings: &Settings, left: Option<[f64; 2]>) {
        self.runs += 1;
        let doing = format!("{STUDY}: run {}, {}", self.runs, settings.label());
        (self.say)(&match left {
            Some([next, all]) => format!(
                "{doing} (about {}, at most about {} left for these settings)",
                in_words(next),
                in_words(all)
            ),
            None => doing,
        });
    }

    /// A trial, or why none exists where the study goes on without it; that is kept and said.
    ///
    /// # Errors
    /// What ends the study.
    fn passed_over(
        &mut self,
        settings: &Settings,
        outcome: Result<Trial, Error>,
    ) -> Result<Result<Trial, Error>, Error> {
        let error = match outcome {
            Ok(trial) => return Ok(Ok(trial)),
            Err(error) => error,
        };
        if !matches!(error.kind(), Kind::NoEquilibrium | Kind::Library) {
            return Err(error);
        }
        self.failed(settings, &error)?;
        Ok(Err(error))
    }

    /// Keeps and says that the last run came to no end.
    ///
    /// # Errors
    /// The table cannot be written.
    pub(super) fn failed(&mut self, settings: &Settings, error: &Error) -> Result<(), Error> {
        let run = (self.runs, settings);
        self.table.row(run, Err(error), [None; 2])?;
        let failed = FailedTrial {
            setting: settings.label(),
            reason: in_one_line(error),
        };
        (self.say)(&messages::failed(self.runs, &failed));
        self.failed.push(failed);
        Ok(())
    }

    /// Whether a run of this error and factor of increments is the last one: it is good enough, or nothing will
    /// be.
    fn is_enough(&self, error: f64, factor: f64) -> bool {
        let at_most_increments = error * factor / FACTORS[FACTORS.len() - 1];
        error <= MARGIN * self.asked || at_most_increments > HOPELESS * self.asked
    }

    /// The best of the finished runs.
    fn found(&self, levels: Levels) -> Option<Found> {
        let (finest_factor, finest) = levels.finest()?;
        let scale = finest.rows.largest();
        let (difference, worst) = (levels.difference(), levels.worst());
        let cut_back = levels.cut_back();
        let of_finest = levels.error();
        let estimate = match (levels.next(), of_finest) {
            (Some((next, _)), Some(_)) => messages::estimate([*next, *finest_factor], ORDERS[1]),
            _ => messages::no_estimate(levels.len()),
        };
        let (factor, trial, error) = levels.take(of_finest, SHARES[0] * self.asked)?;
        Some(Found {
            factor,
            error,
            difference,
            worst,
            estimate,
            cut_back,
            trial,
            scale,
        })
    }

    /// Among sufficient settings, the loosest tolerance that takes fewer iterations and hardly changes
    /// the result, and how much that is.
    ///
    /// # Errors
    /// What ends the study.
    pub(super) fn loosened(
        &mut self,
        settings: Settings,
        found: &Found,
    ) -> Result<(Settings, f64), Error> {
        if found.error.is_none_or(|error| error > self.asked) {
            return Ok((settings, 0.0));
        }
        let given = self.trials.case.file.solver.get_ref().force_tolerance;
        for tolerance in TOLERANCES.into_iter().filter(|t| *t > given) {
            let loose = settings.clone().with_tolerance(tolerance);
            self.begin(&loose, None);
            let outcome = self.trials.run(&loose, Timing::Once, 0);
            let Ok(trial) = self.passed_over(&loose, outcome)? else {
                continue;
            };
            let change = trial.rows.difference(&found.trial.rows, &found.scale);
            let told = [Some(change), found.error.map(|error| error + change)];
            self.table.row((self.runs, &loose), Ok(&trial), told)?;
            if change <= SHARES[1] * self.asked
                && trial.counts.iterations < found.trial.counts.iterations
            {
                return Ok((loose, change));
            }
        }
        Ok((settings, 0.0))
    }
}
