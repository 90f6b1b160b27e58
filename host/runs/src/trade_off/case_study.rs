//! The study of a case: one setting at a time away from the file's, and some together.

use super::accuracy::messages;
use super::driver_study::in_one_line;
use super::expected::Expected;
use super::scheme::{Scheme, Values, schemes};
use super::settings::{BY_FORCE, SOLVER_CHOICES, Settings, SolverChoice, with_choice};
use super::study::{Done, Measurement, Reference, Row, Study};
use super::trials::Trials;
use crate::Error;
use crate::experiment::clock::cpu_seconds;
use crate::experiment::progress::in_words;
use crate::experiment::rows::Convergence;
use crate::experiment::{Rows, Timing, Trial};
use crate::run::begin;
use input::Case;
use law::BuiltLaw;
use mechanics::problem::{Formulation, Integration};
use mechanics::settings::Convergence as Counted;
use std::time::{Duration, Instant};

/// Seconds of a run above which a study is shorter, so that it ends while somebody waits.
pub(super) const LONG: f64 = 0.3;
/// A probe that the finest runs disagree about by more is nothing but round-off.
const MEANINGLESS: f64 = 0.5;

/// What a study tries.
#[derive(Debug)]
struct Plan {
    /// Factors of the increments.
    factors: &'static [f64],
    /// Factors of the increments of the reference, coarse to fine.
    reference_factors: [f64; 3],
    /// Tolerances of the residual.
    tolerances: &'static [f64],
    /// Those that are tried with fewer increments.
    loose_tolerances: &'static [f64],
    /// Rounds over all settings after the first, so that other work on the machine hits all alike.
    more_rounds: usize,
    /// Whether schemes of laws are looked for.
    schemes: bool,
    /// Choices of the solver, and all else, are given up after this many times the CPU time of the file's
    /// settings.
    patience: Option<[f64; 2]>,
}

/// All there is to try.
const WHOLE: Plan = Plan {
    factors: &[0.25, 0.5, 2.0, 4.0],
    reference_factors: [4.0, 8.0, 16.0],
    tolerances: &[1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10],
    loose_tolerances: &[1e-3, 1e-4, 1e-6],
    more_rounds: 3,
    schemes: true,
    patience: None,
};

/// What tells the errors of increments, tolerance and mesh, and the cost of the solver's choices.
const SHORT: Plan = Plan {
    factors: &[0.25, 0.5],
    reference_factors: [0.5, 1.0, 2.0],
    tolerances: &[1e-3, 1e-6],
    loose_tolerances: &[1e-3],
    more_rounds: 0,
    schemes: false,
    patience: Some([5.0, 30.0]),
};

/// Tolerance of the reference.
const TIGHT: f64 = 1e-10;

/// Runs the study, and hands it to `done` after every row. `fine`: the mesh is also divided by 4.
/// `thorough`: all settings are tried, however long they take.
pub(super) fn study(
    trials: &Trials<'_>,
    study: &mut Study,
    (fine, thorough): (bool, bool),
    (done, say): (&mut Done<'_>, &mut dyn FnMut(&str)),
) -> Result<(), Error> {
    refuse_without_probes(trials.case, "there is nothing to measure the error of")?;
    let mut cases = Cases::new(trials, say);
    let default = cases.run(&Settings::default(), Timing::Repeated, 0)?;
    // Counted in runs with the file's settings; that one was repeated.
    cases.unit = default.seconds;
    study.columns.clone_from(&default.rows.names);
    let largest = default.rows.largest();
    study.rows.push(Row {
        family: "as in the file".to_owned(),
        label: "as in the file".to_owned(),
        is_default: true,
        reference: 0,
        outcome: Ok(measurement(&default, &default.rows, &largest)),
    });
    done(study)?;
    if cases.unit > LONG && !thorough {
        study.notes.push(cases.shorten());
    }
    let divisions: &[usize] = if fine { &[2, 4] } else { &[2] };
    let laws = cases.schemes()?;
    let settings = settings_on_this_mesh(trials.case, &laws, cases.plan)?;
    cases.expect_all(divisions, &settings);
    let (mut reference, path) = cases.path_reference(&laws)?;
    let mut scale = path.rows.largest();
    let zero = path.rows.zero();
    let of_zero = (!zero.is_empty()).then(|| messages::zero(&zero));
    study.notes.extend(of_zero);
    study.notes.extend(path.leave_out_round_off(&mut scale));
    reference.convergence = path.convergence(&scale);
    study.references.push(reference);
    study.rows[0].outcome = Ok(measurement(&default, &path.rows, &scale));
    study.judge();
    done(study)?;
    cases.meshes(study, &default, &scale, divisions, done)?;
    let mut timed = vec![(0, Settings::default())];
    for (family, settings) in settings {
        timed.push((study.rows.len(), settings.clone()));
        let row = cases.row(family, &settings, 0, (&path.rows, &scale))?;
        study.show(row, done)?;
    }
    cases.more_rounds(study, &timed, default.seconds)
}

/// Refuses a case whose history has nothing but its increments.
pub(super) fn refuse_without_probes(case: &Case, so: &str) -> Result<(), Error> {
    if case.file.probes.is_empty() && case.file.pile.is_none() {
        let message = format!("there are no [probes] and no [pile], so {so}");
        return Err(case.source.error(0..0, &message).into());
    }
    Ok(())
}

/// Settings that leave mesh and elements unchanged, by family.
fn settings_on_this_mesh(
    case: &Case,
    laws: &[(String, Scheme)],
    plan: &Plan,
) -> Result<Vec<(String, Settings)>, Error> {
    let mut all = Vec::new();
    let mut add = |family: &str, settings: Settings| all.push((family.to_owned(), settings));
    let with_increments = |factor: f64| Settings::default().with_increments(factor);
    let with_solver = |choice: SolverChoice| Settings::default().with_solver(choice);
    for &factor in plan.factors {
        add("increments", with_increments(factor));
    }
    let file = case.file.solver.get_ref();
    let is_new = |tolerance: &f64| (tolerance / file.force_tolerance - 1.0).abs() > 1e-9;
    for tolerance in plan.tolerances.iter().copied().filter(is_new) {
        add("tolerance", Settings::default().with_tolerance(tolerance));
    }
    for factor in [0.25, 0.5] {
        for &tolerance in plan.loose_tolerances {
            let settings = with_increments(factor).with_tolerance(tolerance);
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
            add(&family, with_increments(factor).with_scheme(law, scheme));
        }
    }
    for choice in SOLVER_CHOICES {
        if with_choice(file, choice)? != *file {
            add("solver", with_solver(choice));
        }
    }
    if file.convergence != Counted::Force {
        for &tolerance in plan.loose_tolerances {
            add("solver", with_solver(BY_FORCE).with_tolerance(tolerance));
        }
    }
    Ok(all)
}

fn label_of_mesh(settings: &Settings) -> String {
    match settings.division {
        1 => "the file's mesh".to_owned(),
        _ => settings.label(),
    }
}

fn measurement(trial: &Trial, reference: &Rows, scale: &[f64]) -> Measurement {
    let errors = trial.rows.differences(reference, scale);
    Measurement::new(trial.seconds, trial.counts.all(), errors)
}

/// The finest run, with the differences that lead to it.
struct Finest {
    rows: Rows,
    coarser: [Rows; 2],
}

impl Finest {
    /// Sets the scale of probes to 0 that even the finest runs disagree about, and reports it.
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

/// A run with these settings, or why there is none.
type Divided = (Settings, Result<Trial, Error>);

struct Cases<'a> {
    trials: &'a Trials<'a>,
    say: &'a mut dyn FnMut(&str),
    plan: &'static Plan,
    expected: Expected,
    /// Seconds of a run with the file's settings.
    unit: f64,
    /// The remaining work, as far as it is known.
    left: Vec<(Settings, Timing)>,
}

impl<'a> Cases<'a> {
    fn new(trials: &'a Trials<'a>, say: &'a mut dyn FnMut(&str)) -> Self {
        Self {
            trials,
            say,
            plan: &WHOLE,
            expected: Expected::default(),
            unit: 1.0,
            left: Vec::new(),
        }
    }

    /// Schemes of the laws, where they are looked for.
    fn schemes(&mut self) -> Result<Vec<(String, Scheme)>, Error> {
        if !self.plan.schemes {
            return Ok(Vec::new());
        }
        (self.say)("which schemes of the laws there are");
        law_schemes(self.trials)
    }

    fn run(&mut self, settings: &Settings, timing: Timing, round: usize) -> Result<Trial, Error> {
        if let Some(next) = self.left.iter().position(|(of, _)| of == settings) {
            self.left.remove(next);
        }
        if self.trials.has(settings, round) {
            return self.trials.run(settings, timing, round);
        }
        let line = self.line(settings, timing);
        (self.say)(&line);
        let bounded = self.bounded(settings, timing);
        let (started, cpu) = (Instant::now(), cpu_seconds());
        let outcome = self.trials.run(settings, bounded, round);
        let spent = [started.elapsed().as_secs_f64(), cpu_seconds() - cpu];
        let once = outcome.as_ref().ok().map(|trial| trial.seconds);
        self.expected.took(settings, spent, once);
        // Whatever became of it, the study goes no further once it is to stop.
        self.trials.stop.check("the study")?;
        outcome
    }

    /// The next run, with the predicted time of it and of all others.
    fn line(&self, settings: &Settings, timing: Timing) -> String {
        let this = (settings.clone(), timing);
        let left = self.left.iter().chain([&this]).map(|(of, timing)| {
            let bounded = self.bounded(of, *timing);
            self.expected.seconds(of, *timing, bounded)
        });
        let label = settings.label();
        match self.expected.lasts(left.sum()) {
            left if left > 0.0 => format!("{label} (about {} left)", in_words(left)),
            _ => label,
        }
    }

    /// How a setting is measured: within bounds, where everything was to be.
    fn bounded(&self, settings: &Settings, timing: Timing) -> Timing {
        let Some([of_solver, of_others]) = self.plan.patience else {
            return timing;
        };
        let times = if settings.solver.is_some() {
            of_solver
        } else {
            of_others * settings.increments.max(1.0) * settings.division as f64
        };
        Timing::Within(Duration::from_secs_f64(times * self.unit))
    }

    /// Takes the shorter plan. Returns the note about it.
    fn shorten(&mut self) -> String {
        self.plan = &SHORT;
        let note = format!(
            "a run takes {}: a shorter study, without the schemes of the laws, of one round; \
             --thorough tries everything",
            in_words(self.unit)
        );
        (self.say)(&note);
        note
    }

    fn expect(&mut self, settings: &Settings, timing: Timing) {
        self.left.push((settings.clone(), timing));
    }

    /// Notes the work that is left: the reference, divided meshes, and settings by family.
    fn expect_all(&mut self, divisions: &[usize], settings: &[(String, Settings)]) {
        let tight = self.tight();
        for factor in self.plan.reference_factors {
            self.expect(&tight.clone().with_increments(factor), Timing::Once);
        }
        for &division in divisions {
            self.expect(&Settings::default().divided(division), Timing::Repeated);
        }
        for (_, settings) in settings {
            self.expect(settings, Timing::Repeated);
            for _ in 0..self.plan.more_rounds {
                self.expect(settings, Timing::Once);
            }
        }
    }

    /// The file's settings with the tolerance of the reference.
    fn tight(&self) -> Settings {
        let given = self.trials.case.file.solver.get_ref().force_tolerance;
        Settings::default().with_tolerance(TIGHT.min(given))
    }

    fn row(
        &mut self,
        family: String,
        settings: &Settings,
        number: usize,
        (reference, scale): (&Rows, &[f64]),
    ) -> Result<Row, Error> {
        let outcome = self.run(settings, Timing::Repeated, 0);
        self.trials.stop.check("the study")?;
        let outcome = outcome.map(|trial| measurement(&trial, reference, scale));
        Ok(Row {
            family,
            label: settings.label(),
            is_default: false,
            reference: number,
            outcome: outcome.map_err(|error| in_one_line(&error)),
        })
    }

    /// Times settings, by the number of their row, in all rounds after the first. The file's settings take the seconds
    /// of the first row, or `seconds`, in all their rows.
    fn more_rounds(
        &mut self,
        study: &mut Study,
        timed: &[(usize, Settings)],
        seconds: f64,
    ) -> Result<(), Error> {
        for round in 1..=self.plan.more_rounds {
            for (number, settings) in timed {
                if let Ok(measured) = &mut study.rows[*number].outcome {
                    let seconds = self.run(settings, Timing::Once, round)?.seconds;
                    measured.seconds = measured.seconds.min(seconds);
                }
            }
        }
        let first = study.rows[0].outcome.as_ref();
        let seconds = first.map_or(seconds, |measured| measured.seconds);
        let defaults = study.rows.iter_mut().filter(|row| row.is_default);
        for measured in defaults.filter_map(|row| row.outcome.as_mut().ok()) {
            measured.seconds = seconds;
        }
        study.judge();
        Ok(())
    }

    /// The finest run on the file's mesh: many increments, a tight tolerance, and the scheme that
    /// changes least when the increments are halved.
    fn path_reference(&mut self, laws: &[(String, Scheme)]) -> Result<(Reference, Finest), Error> {
        let tight = self.tight();
        let mut candidates = vec![tight.clone()];
        let finest = laws.iter().filter(|(_, s)| s.is_finest && !s.is_default);
        candidates.extend(finest.map(|(law, scheme)| tight.clone().with_scheme(law, scheme)));
        if candidates.len() > 1 {
            let mut rated = Vec::new();
            for candidate in candidates {
                let [a, b] = [2.0, 4.0].map(|factor| self.at(&candidate, factor));
                self.trials.stop.check("the study")?;
                let difference = match (a, b) {
                    (Ok(a), Ok(b)) => a.rows.difference(&b.rows, &b.rows.largest()),
                    _ => f64::INFINITY,
                };
                rated.push((difference, candidate));
            }
            rated.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            candidates = rated.into_iter().map(|(_, candidate)| candidate).collect();
        }
        // What is not found that tightly is found as tightly as in the file.
        candidates.push(Settings::default());
        let mut failure = None;
        for candidate in candidates {
            let [coarse, middle, fine] =
                self.plan.reference_factors.map(|f| self.at(&candidate, f));
            self.trials.stop.check("the study")?;
            match (coarse, middle, fine) {
                (Ok(coarse), Ok(middle), Ok(fine)) => {
                    let label = |factor| candidate.clone().with_increments(factor).label();
                    let [_, next, finest] = self.plan.reference_factors.map(label);
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
        let settings = settings.clone().with_increments(increments);
        self.run(&settings, Timing::Once, 0)
    }

    /// Runs on the file's mesh and on divided ones.
    fn divided(&mut self, default: &Trial, divisions: &[usize]) -> Result<Vec<Divided>, Error> {
        let mut trials = vec![(Settings::default(), Ok(default.clone()))];
        for &division in divisions {
            let settings = Settings::default().divided(division);
            let run = self.run(&settings, Timing::Repeated, 0);
            self.trials.stop.check("the study")?;
            trials.push((settings, run));
        }
        Ok(trials)
    }

    /// Divided meshes, and other integrations of thin layers, against the finest mesh.
    fn meshes(
        &mut self,
        study: &mut Study,
        default: &Trial,
        scale: &[f64],
        divisions: &[usize],
        done: &mut Done<'_>,
    ) -> Result<(), Error> {
        let trials = self.divided(default, divisions)?;
        let ran = trials
            .iter()
            .filter_map(|(of, run)| Some((of, run.as_ref().ok()?)));
        let ran: Vec<(&Settings, &Trial)> = ran.collect();
        let [.., (next, before), (finest, reference)] = ran.as_slice() else {
            let failed = trials
                .iter()
                .filter_map(|(of, run)| Some((of, run.as_ref().err()?)));
            let note = |(of, error): (&Settings, &Error)| {
                format!("{}: {}", of.label(), in_one_line(error))
            };
            study.notes.extend(failed.map(note));
            return Ok(());
        };
        let rows = reference.rows.clone();
        let coarse = ran.len().checked_sub(3).map(|i| ran[i].1);
        let number = study.references.len();
        study.references.push(Reference {
            label: finest.label(),
            next: label_of_mesh(next),
            convergence: Convergence::of(
                coarse.map(|coarse| coarse.rows.difference(&before.rows, scale)),
                before.rows.difference(&rows, scale),
            ),
        });
        let finest = finest.division;
        for (settings, run) in trials.iter().filter(|(of, _)| of.division != finest) {
            let outcome = run.as_ref().map(|trial| measurement(trial, &rows, scale));
            study.rows.push(Row {
                family: "mesh".to_owned(),
                label: label_of_mesh(settings),
                is_default: settings.division == 1,
                reference: number,
                outcome: outcome.map_err(in_one_line),
            });
        }
        study.judge();
        done(study)?;
        self.integrations(study, number, (&rows, scale), done)
    }

    /// Other integrations of thin layers, against the reference of this number.
    fn integrations(
        &mut self,
        study: &mut Study,
        number: usize,
        reference: (&Rows, &[f64]),
        done: &mut Done<'_>,
    ) -> Result<(), Error> {
        for settings in self.other_integrations() {
            let row = self.row("integration".to_owned(), &settings, number, reference)?;
            study.show(row, done)?;
        }
        Ok(())
    }

    /// Integrations of thin layers that no layer has in the file.
    fn other_integrations(&self) -> Vec<Settings> {
        let groups = self.trials.case.file.groups.values();
        let groups = groups.map(text::Spanned::get_ref);
        let layers = groups.filter(|group| group.formulation == Formulation::ThinLayer);
        let layers: Vec<Integration> = layers
            .map(|group| group.integration.as_ref().map(|i| *i.get_ref()))
            .map(|integration| integration.unwrap_or(Integration::Full))
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
pub(super) fn law_schemes(trials: &Trials<'_>) -> Result<Vec<(String, Scheme)>, Error> {
    let (_, laws) = begin(trials.case)?;
    let mut found: Vec<(String, Scheme)> = Vec::new();
    for ((name, _), built) in &laws {
        if found.iter().any(|(known, _)| known == name) {
            continue;
        }
        let few = |values: &Values| {
            let scheme = Scheme {
                values: values.clone(),
                ..Scheme::default()
            };
            let settings = Settings::default().with_increments(0.25);
            let settings = settings.with_scheme(name, &scheme);
            let run = trials.run(&settings, Timing::Once, 0).ok()?;
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
        trials.stop.check("the study")?;
        let named = all.into_iter().filter(|scheme| !scheme.label.is_empty());
        found.extend(named.map(|scheme| (name.clone(), scheme)));
    }
    Ok(found)
}

fn used(built: &BuiltLaw, id: &str) -> Option<f64> {
    let found = built.parameters.iter().find(|p| p.id == id)?;
    Some(found.value)
}
