//! Result of a study: settings with their errors and costs, and the references they are measured
//! against.

use super::pareto::front;
use crate::experiment::Rows;
use crate::experiment::rows::{Convergence, worst};
use serde::Serialize;

/// The settings of one driver or case.
#[derive(Clone, Debug)]
pub(super) struct Study {
    /// Name of the case or driver, with its variant.
    pub(super) name: String,
    /// Title.
    pub(super) title: String,
    /// Names of the values whose errors are measured.
    pub(super) columns: Vec<String>,
    /// Names of the counts.
    pub(super) counts: &'static [&'static str],
    /// References for errors. The first holds for settings that leave the model (mesh, elements)
    /// unchanged.
    pub(super) references: Vec<Reference>,
    /// Settings.
    pub(super) rows: Vec<Row>,
    /// What the reader should know.
    pub(super) notes: Vec<String>,
}

/// Takes a study whenever a row is done.
pub(super) type Done<'a> = dyn FnMut(&Study) -> Result<(), crate::Error> + 'a;

/// A reference for errors.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// Settings in words.
    pub(super) label: String,
    /// The next finest settings in words.
    pub(super) next: String,
    /// How far it is converged.
    pub(super) convergence: Convergence,
}

/// A setting.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    /// What varies.
    pub(super) family: String,
    /// The setting in words.
    pub(super) label: String,
    /// It is what the file asks for.
    pub(super) is_default: bool,
    /// Number of the reference.
    pub(super) reference: usize,
    /// What became of it, or why it failed.
    pub(super) outcome: Result<Measurement, String>,
}

/// Error and cost.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Measurement {
    /// CPU time, s.
    pub(super) seconds: f64,
    /// Counts, in the order of the study's names.
    pub(super) counts: Vec<u64>,
    /// Relative errors, in the order of the study's columns.
    pub(super) errors: Vec<f64>,
    /// The largest of them.
    pub(super) error: f64,
    /// The error is below the uncertainty of the reference, and cannot be told from 0.
    pub(super) is_below: bool,
    /// No setting with the same reference is cheaper and as accurate.
    pub(super) is_optimal: bool,
}

/// The count of rows that a setting gives, where settings differ in it.
pub(super) const ROWS: &str = "increments";

impl Measurement {
    /// Before it is compared with others.
    pub(super) fn new(seconds: f64, counts: Vec<u64>, errors: Vec<f64>) -> Self {
        Self {
            seconds,
            counts,
            error: worst(&errors),
            errors,
            is_below: false,
            is_optimal: false,
        }
    }
}

impl Reference {
    /// From three runs, coarse to fine, and the labels of the last two.
    pub(super) fn new(labels: [String; 2], runs: [&Rows; 3], scale: &[f64]) -> Self {
        let [next, label] = labels;
        Self {
            label,
            next,
            convergence: Convergence::of_runs(runs, scale),
        }
    }

    /// Its name and convergence, in one line.
    pub(super) fn statement(&self) -> String {
        let Convergence {
            difference,
            order,
            uncertainty,
        } = self.convergence;
        let (label, next) = (&self.label, &self.next);
        let differs = format!("{label}; differs by {difference:.1e} from {next}");
        match order {
            Some(order) if order <= 0.0 => format!(
                "{differs}, no less than the next two from each other (order {order:.2}): the reference does not converge, its \
                 distance from a limit is unknown"
            ),
            Some(order) => {
                format!("{differs}, order {order:.2}: reference converged to {uncertainty:.0e}")
            }
            None => {
                format!("{differs}, order unknown: reference converged to {uncertainty:.0e}")
            }
        }
    }
}

impl Study {
    /// Nothing measured yet.
    pub(super) fn new(name: &str, title: &str, counts: &'static [&'static str]) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            columns: Vec::new(),
            counts,
            references: Vec::new(),
            rows: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Adds a row, judges all anew, and hands the study to `done`.
    ///
    /// # Errors
    /// That of `done`.
    pub(super) fn show(&mut self, row: Row, done: &mut Done<'_>) -> Result<(), crate::Error> {
        self.rows.push(row);
        self.judge();
        done(self)
    }

    /// Marks what lies below the uncertainty of its reference, and what nothing beats.
    pub(super) fn judge(&mut self) {
        for number in 0..self.references.len() {
            let floor = self.references[number].convergence.uncertainty;
            let points: Vec<Option<(f64, f64)>> = self
                .rows
                .iter()
                .map(|row| {
                    let measured = row.outcome.as_ref().ok()?;
                    (row.reference == number)
                        .then_some((measured.seconds, measured.error.max(floor)))
                })
                .collect();
            for (row, is_optimal) in self.rows.iter_mut().zip(front(&points)) {
                if let (true, Ok(measured)) = (row.reference == number, &mut row.outcome) {
                    measured.is_optimal = is_optimal;
                    measured.is_below = measured.error < floor;
                }
            }
        }
    }

    /// Settings that ran, with this reference.
    pub(super) fn measured(&self, reference: usize) -> impl Iterator<Item = (&Row, &Measurement)> {
        let rows = self.rows.iter().filter(move |r| r.reference == reference);
        rows.filter_map(|row| Some((row, row.outcome.as_ref().ok()?)))
    }

    /// Rank of the default, in one sentence.
    pub(super) fn verdict(&self) -> String {
        let Some((row, default)) = self.measured(0).find(|(row, _)| row.is_default) else {
            return "default: no result".to_owned();
        };
        let floor = self.references[row.reference].convergence.uncertainty;
        let error = if default.is_below {
            format!("error below {floor:.0e}")
        } else {
            format!("error {}", percent(default.error))
        };
        let as_good = |m: &Measurement| m.error.max(floor) <= default.error.max(floor);
        let cheapest = |wanted: &dyn Fn(&Measurement) -> bool| {
            self.measured(0)
                .filter(|(_, m)| as_good(m) && wanted(m))
                .min_by(|(_, a), (_, b)| a.seconds.total_cmp(&b.seconds))
                .filter(|(best, _)| !best.is_default)
        };
        let compared = |(best, m): (&Row, &Measurement)| {
            let ratio = default.seconds / m.seconds;
            format!(
                "{ratio:.1}× the cost of the cheapest as accurate ({})",
                best.label
            )
        };
        let any = cheapest(&|_| true).map(compared);
        let rows = self.counts.iter().position(|name| *name == ROWS);
        let of_as_many_rows = rows.map(|i| {
            let found = cheapest(&|m: &Measurement| m.counts[i] >= default.counts[i]);
            found.map(compared)
        });
        let none = || "none as accurate is cheaper".to_owned();
        let found = match (any, of_as_many_rows) {
            (None, _) => none(),
            (Some(any), None) => any,
            (Some(any), Some(many)) if many.as_ref() == Some(&any) => any,
            (Some(any), Some(many)) => {
                format!("{any}; with as many rows: {}", many.unwrap_or_else(none))
            }
        };
        format!("default ({}): {error}; {found}", row.label)
    }
}

/// A relative error in words.
pub(super) fn percent(error: f64) -> String {
    if error >= 1e-4 {
        format!("{:.2} %", 100.0 * error)
    } else {
        format!("{error:.1e}")
    }
}
