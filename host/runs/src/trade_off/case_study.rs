//! The study of a case: one setting at a time away from the file's, and some together.

use super::driver_study::in_one_line;
use super::pace::Pace;
use super::sampled::{Convergence, Sampled};
use super::scheme::{Scheme, Values, schemes};
use super::study::{Measurement, Reference, Row, Study};
use super::trial::{COUNTS, SOLVER_CHOICES, Scratch, Settings, Trial, repetitions, trial};
use crate::Error;
use crate::run::begin;
use input::Case;
use law::BuiltLaw;
use mechanics::equilibrium::Reuse;
use mechanics::problem::{Formulation, Integration};

/// Factors of the increments.
const FACTORS: [f64; 4] = [0.25, 0.5, 2.0, 4.0];
/// Factors of the increments of the reference, coarse to fine.
const REFERENCE_FACTORS: [f64; 3] = [4.0, 8.0, 16.0];
/// Tolerances of the residual.
const TOLERANCES: [f64; 6] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10];
/// Tolerance of the reference.
const TIGHT: f64 = 1e-10;
/// Rounds over all settings after the first, so that other work on the machine hits all alike.
const MORE_ROUNDS: usize = 3;
/// A probe that the finest runs disagree about by more is nothing but round-off.
const MEANINGLESS: f64 = 0.5;

/// Runs the study. `fine`: the mesh is also divided by 4.
pub(super) fn study(
    case: &Case,
    name: &str,
    fine: bool,
    scratch: &Scratch,
    say: &mut dyn FnMut(&str),
) -> Result<Study, Error> {
    if case.file.probes.is_empty() {
        let message = "there are no [probes], so there is nothing to measure the error of";
        return Err(case.source.error(0..0, message).into());
    }
    let mut cases = Cases {
        case,
        scratch,
        say,
        pace: Pace::new(1.0),
        unit: 1.0,
    };
    let mut default = cases.run(&Settings::default(), true)?;
    // Counted in runs with the file's settings; that one was repeated.
    cases.unit = default.seconds;
    let divisions: &[usize] = if fine { &[2, 4] } else { &[2] };
    cases.expect(REFERENCE_FACTORS.iter().sum());
    for &division in divisions {
        cases.expect(cases.weight(&divided(division), true));
    }
    let laws = law_schemes(case, scratch)?;
    let (mut reference, path) = cases.path_reference(&laws)?;
    let mut scale = path.rows.largest();
    let notes = path.leave_out_round_off(&mut scale);
    reference.convergence = path.convergence(&scale);
    let mut study = Study {
        name: name.to_owned(),
        title: case.file.title.clone(),
        columns: path.rows.names.clone(),
        counts: COUNTS,
        references: vec![reference],
        rows: vec![Row {
            family: "as in the file".to_owned(),
            label: "as in the file".to_owned(),
            is_default: true,
            reference: 0,
            outcome: Ok(measurement(&default, &path.rows, &scale)),
        }],
        notes,
    };
    let mut timed = vec![(0, Settings::default())];
    let settings = settings_on_this_mesh(case, &laws);
    for (_, settings) in &settings {
        let again = MORE_ROUNDS as f64 * cases.weight(settings, false);
        cases.expect(cases.weight(settings, true) + again);
    }
    for (family, settings) in settings {
        timed.push((study.rows.len(), settings.clone()));
        study
            .rows
            .push(cases.row(family, &settings, 0, &path.rows, &scale)?);
    }
    for _ in 0..MORE_ROUNDS {
        for (number, settings) in &timed {
            if let Ok(measured) = &mut study.rows[*number].outcome {
                let seconds = cases.run(settings, false)?.seconds;
                measured.seconds = measured.seconds.min(seconds);
            }
        }
    }
    if let Ok(measured) = &study.rows[0].outcome {
        default.seconds = measured.seconds;
    }
    cases.meshes(&mut study, &default, &scale, divisions)?;
    study.judge();
    Ok(study)
}

/// Settings that leave mesh and elements as they are, by family.
fn settings_on_this_mesh(case: &Case, laws: &[(String, Scheme)]) -> Vec<(String, Settings)> {
    let mut all = Vec::new();
    let default = Settings::default();
    let mut add = |family: &str, settings: Settings| all.push((family.to_owned(), settings));
    let fewer_or_more = |factor: f64| Settings {
        increments: factor,
        ..default.clone()
    };
    for factor in FACTORS {
        add("increments", fewer_or_more(factor));
    }
    let file = &case.file.solver;
    let is_new = |tolerance: &f64| (tolerance / file.force_tolerance - 1.0).abs() > 1e-9;
    for tolerance in TOLERANCES.into_iter().filter(is_new) {
        let settings = Settings {
            tolerance: Some(tolerance),
            ..default.clone()
        };
        add("tolerance", settings);
    }
    for factor in [0.25, 0.5] {
        for tolerance in [1e-3, 1e-4, 1e-6] {
            let settings = Settings {
                tolerance: Some(tolerance),
                ..fewer_or_more(factor)
            };
            add("increments and tolerance", settings);
        }
    }
    for (law, scheme) in laws.iter().filter(|(_, scheme)| !scheme.is_default) {
        let family = format!("{law}: {}", scheme.choice);
        let mut factors = vec![1.0];
        if scheme.is_finest {
            factors.extend([0.25, 0.5, 4.0]);
        }
        for factor in factors {
            let settings = Settings {
                law: Some(scheme.of(law)),
                ..fewer_or_more(factor)
            };
            add(&family, settings);
        }
    }
    for choice in SOLVER_CHOICES {
        let mut with = *file;
        (choice.set)(&mut with);
        if with != *file {
            let settings = Settings {
                solver: Some(choice),
                ..default.clone()
            };
            add("solver", settings);
        }
    }
    all
}

fn measurement(trial: &Trial, reference: &Sampled, scale: &[f64]) -> Measurement {
    let errors = trial.rows.differences(reference, scale);
    Measurement::new(trial.seconds, trial.counts.clone(), errors)
}

/// The finest run, with the differences that lead to it.
struct Finest {
    rows: Sampled,
    coarser: [Sampled; 2],
}

impl Finest {
    /// Sets the scale of probes to 0 that even the finest runs disagree about, and says so.
    fn leave_out_round_off(&self, scale: &mut [f64]) -> Vec<String> {
        let differences = self.coarser[1].differences(&self.rows, scale);
        let mut notes = Vec::new();
        for ((name, scale), difference) in self.rows.names.iter().zip(scale).zip(differences) {
            if difference > MEANINGLESS {
                *scale = 0.0;
                notes.push(format!(
                    "probe `{name}` is left out: the two finest runs differ by {difference:.1} \
                     times its largest value"
                ));
            }
        }
        notes
    }

    fn convergence(&self, scale: &[f64]) -> Convergence {
        let [coarse, middle] = &self.coarser;
        Convergence::of_runs([coarse, middle, &self.rows], scale)
    }
}

struct Cases<'a> {
    case: &'a Case,
    scratch: &'a Scratch,
    say: &'a mut dyn FnMut(&str),
    pace: Pace,
    /// Seconds of a run with the file's settings.
    unit: f64,
}

fn divided(division: usize) -> Settings {
    Settings {
        division,
        ..Settings::default()
    }
}

impl Cases<'_> {
    fn run(&mut self, settings: &Settings, timed: bool) -> Result<Trial, Error> {
        (self.say)(&self.pace.line(&settings.label()));
        let outcome = trial(self.case, settings, self.scratch, timed);
        self.pace.did(self.weight(settings, timed));
        // Whatever became of it, the study goes no further once it is to stop.
        self.scratch.stop.check("the study")?;
        outcome
    }

    /// Probable cost of a trial, in runs with the file's settings. An element more costs time, and
    /// an equation more bandwidth.
    fn weight(&self, settings: &Settings, timed: bool) -> f64 {
        let once = settings.increments * (settings.division as f64).powi(3);
        if timed {
            once * repetitions(once * self.unit)
        } else {
            once
        }
    }

    fn expect(&mut self, more: f64) {
        self.pace.add(more);
    }

    fn row(
        &mut self,
        family: String,
        settings: &Settings,
        number: usize,
        reference: &Sampled,
        scale: &[f64],
    ) -> Result<Row, Error> {
        let outcome = self.run(settings, true);
        self.scratch.stop.check("the study")?;
        let outcome = outcome.map(|trial| measurement(&trial, reference, scale));
        Ok(Row {
            family,
            label: settings.label(),
            is_default: false,
            reference: number,
            outcome: outcome.map_err(|error| in_one_line(&error)),
        })
    }

    /// The finest run on the file's mesh: many increments, a tight tolerance, and the scheme that
    /// changes least when the increments are halved.
    fn path_reference(&mut self, laws: &[(String, Scheme)]) -> Result<(Reference, Finest), Error> {
        let tight = Settings {
            tolerance: Some(TIGHT.min(self.case.file.solver.force_tolerance)),
            ..Settings::default()
        };
        let mut candidates = vec![tight.clone()];
        let finest = laws.iter().filter(|(_, s)| s.is_finest && !s.is_default);
        candidates.extend(finest.map(|(law, scheme)| Settings {
            law: Some(scheme.of(law)),
            ..tight.clone()
        }));
        if candidates.len() > 1 {
            let mut rated = Vec::new();
            for candidate in candidates {
                let [a, b] = [2.0, 4.0].map(|factor| self.at(&candidate, factor));
                self.scratch.stop.check("the study")?;
                let difference = match (a, b) {
                    (Ok(a), Ok(b)) => a.rows.difference(&b.rows, &b.rows.largest()),
                    _ => f64::INFINITY,
                };
                rated.push((difference, candidate));
            }
            rated.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            candidates = rated.into_iter().map(|(_, candidate)| candidate).collect();
        }
        let mut failure = None;
        for candidate in candidates {
            let [coarse, middle, fine] = REFERENCE_FACTORS.map(|f| self.at(&candidate, f));
            self.scratch.stop.check("the study")?;
            match (coarse, middle, fine) {
                (Ok(coarse), Ok(middle), Ok(fine)) => {
                    let label = |increments: f64| {
                        let settings = Settings {
                            increments,
                            ..candidate.clone()
                        };
                        settings.label()
                    };
                    let [_, next, finest] = REFERENCE_FACTORS.map(label);
                    let scale = fine.rows.largest();
                    let runs = [&coarse.rows, &middle.rows, &fine.rows];
                    let reference = Reference::new([next, finest], runs, &scale);
                    let finest = Finest {
                        rows: fine.rows,
                        coarser: [coarse.rows, middle.rows],
                    };
                    return Ok((reference, finest));
                }
                (Err(error), _, _) | (_, Err(error), _) | (_, _, Err(error)) => {
                    failure = Some(error);
                }
            }
        }
        Err(failure.unwrap_or_else(|| Error::internal("no reference to try".to_owned())))
    }

    fn at(&mut self, settings: &Settings, increments: f64) -> Result<Trial, Error> {
        let settings = Settings {
            increments,
            ..settings.clone()
        };
        self.run(&settings, false)
    }

    /// Divided meshes, and other integrations of thin layers, against the finest mesh.
    fn meshes(
        &mut self,
        study: &mut Study,
        default: &Trial,
        scale: &[f64],
        divisions: &[usize],
    ) -> Result<(), Error> {
        let mut trials = vec![(divided(1), Ok(default.clone()))];
        for &division in divisions {
            let settings = divided(division);
            let run = self.run(&settings, true);
            self.scratch.stop.check("the study")?;
            trials.push((settings, run));
        }
        let done: Vec<(&Settings, &Trial)> = trials
            .iter()
            .filter_map(|(settings, run)| Some((settings, run.as_ref().ok()?)))
            .collect();
        let [.., (next, before), (finest, reference)] = done.as_slice() else {
            for (settings, run) in &trials {
                if let Err(error) = run {
                    let why = in_one_line(error);
                    study.notes.push(format!("{}: {why}", settings.label()));
                }
            }
            return Ok(());
        };
        let rows = reference.rows.clone();
        let coarse = done.len().checked_sub(3).map(|i| done[i].1);
        let number = study.references.len();
        study.references.push(Reference {
            label: finest.label(),
            next: if next.division == 1 {
                "the file's mesh".to_owned()
            } else {
                next.label()
            },
            convergence: Convergence::of(
                coarse.map(|coarse| coarse.rows.difference(&before.rows, scale)),
                before.rows.difference(&rows, scale),
            ),
        });
        let finest = finest.division;
        for (settings, run) in &trials {
            if settings.division == finest {
                continue;
            }
            let outcome = run.as_ref().map(|trial| measurement(trial, &rows, scale));
            study.rows.push(Row {
                family: "mesh".to_owned(),
                label: if settings.division == 1 {
                    "the file's mesh".to_owned()
                } else {
                    settings.label()
                },
                is_default: settings.division == 1,
                reference: number,
                outcome: outcome.map_err(in_one_line),
            });
        }
        for settings in self.integrations() {
            let row = self.row("integration".to_owned(), &settings, number, &rows, scale)?;
            study.rows.push(row);
        }
        Ok(())
    }

    /// Integrations of thin layers that no layer has in the file.
    fn integrations(&self) -> Vec<Settings> {
        let layers: Vec<Integration> = self
            .case
            .file
            .groups
            .values()
            .map(toml::Spanned::get_ref)
            .filter(|group| group.formulation == Formulation::ThinLayer)
            .map(|group| {
                let given = group.integration.as_ref();
                given.map_or(Integration::Full, |i| *i.get_ref())
            })
            .collect();
        let mut others = vec![Integration::Full, Integration::Reduced, Integration::Mean];
        others.retain(|integration| !layers.is_empty() && !layers.contains(integration));
        let settings = |integration| Settings {
            integration: Some(integration),
            ..Settings::default()
        };
        others.into_iter().map(settings).collect()
    }
}

/// Schemes of the laws that have any, by the law's name in the file.
pub(super) fn law_schemes(case: &Case, scratch: &Scratch) -> Result<Vec<(String, Scheme)>, Error> {
    let (_, laws) = begin(case, Reuse::default())?;
    let mut found: Vec<(String, Scheme)> = Vec::new();
    for ((name, _), built) in &laws {
        if found.iter().any(|(known, _)| known == name) {
            continue;
        }
        let few = |values: &Values| {
            let settings = Settings {
                increments: 0.25,
                law: Some((name.clone(), values.clone(), String::new())),
                ..Settings::default()
            };
            let run = trial(case, &settings, scratch, false).ok()?;
            Some(run.rows)
        };
        let mut all = schemes(
            built.law.description(),
            |id| used(built, id),
            |a, b| few(a) != few(b),
        );
        // The finest is the finest that runs at all.
        for i in (1..all.len()).rev() {
            let has_coarser = all[i - 1].choice == all[i].choice;
            if all[i].is_finest && has_coarser && few(&all[i].values).is_none() {
                all[i].is_finest = false;
                all[i - 1].is_finest = true;
            }
        }
        scratch.stop.check("the study")?;
        let named = all.into_iter().filter(|scheme| !scheme.label.is_empty());
        found.extend(named.map(|scheme| (name.clone(), scheme)));
    }
    Ok(found)
}

fn used(built: &BuiltLaw, id: &str) -> Option<f64> {
    let found = built.parameters.iter().find(|p| p.id == id)?;
    Some(found.value)
}
