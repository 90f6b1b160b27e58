//! Results in a folder: `history.csv`, `profile.csv`, `pile.csv`, `points.csv`, `fields.pvd` with `*.vtu`,
//! `summary.json`, `log.jsonl`. Rows are flushed as increments converge, so whatever was reported
//! is in its file. Files of an earlier run are removed first. A resumed run continues them from its
//! last checkpoint.

mod quantity;

use crate::fields::{self, Fields, Written};
use crate::figure::{Curve, Figures};
use crate::file::{self, Extent};
use crate::leftovers;
use crate::log_file::LogFile;
use crate::mesh_error::OfPhase;
use crate::output_request::{Output, OutputRequest, When};
use crate::pile::{self, Record as PileRecord, Resistances, State as PileState};
use crate::points::Points;
use crate::probe::{Probes, Sizes};
use crate::profile::Profile;
use crate::report::Known;
use crate::summary::{self, About, Course, Ending, Progress, RUNNING, Running, Stopped};
use crate::table::{Cell, Table};
use mechanics::equilibrium::Iteration;
use mechanics::group::Group;
use mechanics::simulation::{self, Increment, PhaseRecord, Snapshot};
use mechanics::{NoEquilibrium, Place, Simulation};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use text::Error;

/// The results of a run, as they are written.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    settings: Output,
    probes: Probes,
    /// What the probes look at.
    looked_at: simulation::Part,
    history: Table,
    path: Option<Table>,
    profile: Option<Profile>,
    pile: Option<PileRecord>,
    points: Option<Points>,
    fields: Option<Fields>,
    log: LogFile,
    summary: Progress,
    figures: Figures,
    seconds: Duration,
}

/// How far the results of a run had come at a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ResultsState {
    history: Extent,
    path: Option<Extent>,
    profile: Option<Extent>,
    pile: Option<pile::Kept>,
    points: Option<Extent>,
    log: Extent,
    fields: Option<Vec<Written>>,
    course: Course,
    curves: Vec<Vec<Curve>>,
    seconds: Duration,
}

impl ResultsState {
    /// Checks that the files in the folder are still those of the run.
    ///
    /// # Errors
    /// The first that is not, or cannot be read.
    pub fn check(&self, folder: &Path) -> Result<(), Error> {
        let tables = [
            ("history.csv", Some(self.history)),
            ("path.csv", self.path),
            ("profile.csv", self.profile),
            ("pile.csv", self.pile.as_ref().map(|pile| pile.table)),
            ("points.csv", self.points),
            ("log.jsonl", Some(self.log)),
        ];
        for (name, extent) in tables {
            if let Some(extent) = extent {
                file::check(&folder.join(name), extent)?;
            }
        }
        fields::check(folder, self.fields.as_deref().unwrap_or_default())
    }

    /// The figures of the run.
    pub fn figures(self, wanted: &OutputRequest) -> Figures {
        let mut figures = empty_figures(wanted);
        figures.restore(self.curves);
        figures
    }
}

fn empty_figures(wanted: &OutputRequest) -> Figures {
    let names = wanted.columns().map(str::to_owned).collect();
    Figures::new(&wanted.title, &wanted.figures, names)
}

/// The tables of increments and, where the path of equilibrium is followed, of steps along it.
fn tables_of_increments(
    folder: &Path,
    wanted: &OutputRequest,
    at: Option<&ResultsState>,
) -> Result<(Table, Option<Table>), Error> {
    let columns = |time| {
        let place = ["phase", "increment", time].into_iter();
        place.chain(wanted.columns()).chain(["iterations"])
    };
    let from = at.and_then(|state| state.path);
    let path = || Table::begin(folder.join("path.csv"), columns("load_factor"), from);
    let path = wanted.follows_path.then(path).transpose()?;
    let from = at.map(|state| state.history);
    let history = Table::begin(folder.join("history.csv"), columns("time"), from)?;
    Ok((history, path))
}

/// Ids of the internal variables of all laws that these groups ever carry, each once.
pub(crate) fn internal_variables(
    simulation: &Simulation,
    of: impl Fn(&Group) -> bool,
) -> Vec<String> {
    let groups = simulation.groups();
    let first = groups.iter().map(|group| (group, &group.law));
    let swapped = simulation.swaps().iter().flatten();
    let swapped = swapped.map(|(group, law)| (&groups[*group], law));
    let mut ids: Vec<String> = Vec::new();
    for (_, law) in first.chain(swapped).filter(|(group, _)| of(group)) {
        for variable in &law.built.law.formulation().internal_variables {
            if !ids.contains(&variable.id) {
                ids.push(variable.id.clone());
            }
        }
    }
    ids
}

/// A row of the history, or of the path: `at` is the time, or the load factor.
fn history_row<'a>(
    place: &'a Place,
    at: f64,
    probes: &'a [Option<f64>],
    iterations: usize,
) -> impl Iterator<Item = Cell<'a>> {
    [
        Cell::Text(&place.phase),
        Cell::Count(place.increment),
        Cell::Number(Some(at)),
    ]
    .into_iter()
    .chain(probes.iter().copied().map(Cell::Number))
    .chain([Cell::Count(iterations)])
}

impl Recorder {
    /// Creates the folder and its files, and removes those of an earlier run.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn create(
        folder: &Path,
        wanted: OutputRequest,
        about: &About,
        simulation: &Simulation,
    ) -> Result<Self, Error> {
        std::fs::create_dir_all(folder).map_err(|error| Error::unwritable(folder, error))?;
        let log = LogFile::begin(folder)?;
        leftovers::remove(folder)?;
        Self::begin(folder, wanted, about, simulation, log, None)
    }

    /// Takes over the results that an interrupted run of the same case left in the folder, as
    /// they were at its last checkpoint; what it wrote after that is forgotten.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn resume(
        folder: &Path,
        wanted: OutputRequest,
        about: &About,
        simulation: &Simulation,
        state: ResultsState,
    ) -> Result<Self, Error> {
        let log = LogFile::begin_again(folder)?;
        // Nothing is cut to its length before all are known to be good.
        state.check(folder)?;
        let log = log.go_on(state.log)?;
        Self::begin(folder, wanted, about, simulation, log, Some(state))
    }

    fn begin(
        folder: &Path,
        mut wanted: OutputRequest,
        about: &About,
        simulation: &Simulation,
        log: LogFile,
        state: Option<ResultsState>,
    ) -> Result<Self, Error> {
        wanted.probes.narrow(simulation);
        let settings = wanted.output;
        let at = state.as_ref();
        let (history, path) = tables_of_increments(folder, &wanted, at)?;
        let from = at.and_then(|state| state.profile);
        let profile = Profile::begin(folder, settings.profile, simulation, from)?;
        let from = at.and_then(|state| state.points);
        let points = Points::begin(folder, settings.points, simulation, from)?;
        let looked_at = wanted.looks_at(simulation);
        let summary = Progress::new(about, &wanted, simulation);
        let figures = empty_figures(&wanted);
        let from = at.and_then(|state| state.pile.as_ref());
        let pile = wanted.pile;
        let pile = pile.map(|pile| PileRecord::begin(pile, folder, simulation, from));
        let mut results = Self {
            history,
            path,
            profile,
            pile: pile.transpose()?,
            points,
            fields: Fields::create(folder, settings, simulation),
            log,
            summary,
            figures,
            folder: folder.to_owned(),
            settings,
            looked_at,
            probes: wanted.probes,
            seconds: Duration::ZERO,
        };
        if let Some(state) = state {
            results.restore(state);
        }
        let running = Running {
            head: results.summary.head(),
            status: RUNNING,
        };
        summary::write(folder, running)?;
        Ok(results)
    }

    /// What the tables of an interrupted run do not hold.
    fn restore(&mut self, state: ResultsState) {
        self.summary.course = state.course;
        self.figures.restore(state.curves);
        self.seconds = state.seconds;
        if let (Some(fields), Some(written)) = (&mut self.fields, state.fields) {
            fields.written = written;
        }
    }

    /// How far the results have come, after waiting until they are on the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn state(&self) -> Result<ResultsState, Error> {
        let path = self.path.as_ref().map(Table::sync);
        let profile = self.profile.as_ref().map(|profile| profile.table.sync());
        let points = self.points.as_ref().map(|points| points.table.sync());
        let pile = self.pile.as_ref().map(PileRecord::kept);
        Ok(ResultsState {
            history: self.history.sync()?,
            path: path.transpose()?,
            profile: profile.transpose()?,
            pile: pile.transpose()?,
            points: points.transpose()?,
            log: self.log.sync()?,
            fields: self.fields.as_ref().map(|fields| fields.written.clone()),
            course: self.summary.course.clone(),
            curves: self.figures.curves(),
            seconds: self.seconds,
        })
    }

    /// Logs the iterations of an attempt.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn iterations(
        &mut self,
        place: &Place,
        lambda: f64,
        iterations: &[Iteration],
    ) -> Result<(), Error> {
        self.log.iterations(place, lambda, iterations)
    }

    /// Logs a cut-back.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn cut_back(
        &mut self,
        place: &Place,
        lambda: f64,
        step: f64,
        reason: &str,
    ) -> Result<(), Error> {
        self.log.cut_back(place, lambda, step, reason)
    }

    /// What the results look at in a state; `None`: all of it.
    pub fn looks_at(
        &self,
        when: simulation::When<'_>,
        groups: &[Group],
    ) -> Option<simulation::Part> {
        let simulation::When::Increment { place, of } = when else {
            return Some(self.looked_at.clone());
        };
        let asks = |when: When| when.includes(place.increment, of);
        let all = (self.fields.is_some() && asks(self.settings.fields))
            || (self.points.is_some() && asks(self.settings.points))
            || self.figures.cuts_at(place, of)
            || place.increment == of;
        if all {
            return None;
        }
        let mut looked_at = self.looked_at.clone();
        if self.profile.is_some() && asks(self.settings.profile) {
            for (looked_at, group) in looked_at.groups.iter_mut().zip(groups) {
                *looked_at |= group.jump_and_traction(0).is_some();
            }
        }
        Some(looked_at)
    }

    /// Writes a step of a run under arc-length control, in an increment that it leads to.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn step(
        &mut self,
        place: &Place,
        load_factor: f64,
        iterations: usize,
        snapshot: &Snapshot<'_>,
    ) -> Result<(), Fault> {
        self.begins(&place.phase, snapshot);
        let (probes, _) = self.values(place, snapshot)?;
        let Some(path) = &mut self.path else {
            return Ok(());
        };
        path.row(history_row(place, load_factor, &probes, iterations));
        Ok(path.flush()?)
    }

    /// A state of this phase is about to be looked at.
    fn begins(&mut self, phase: &str, snapshot: &Snapshot<'_>) {
        if let Some(pile) = &mut self.pile {
            pile.begins(phase, snapshot);
        }
    }

    /// Values of the probes and of the pile, and the pile along its length.
    fn values(
        &self,
        place: &Place,
        snapshot: &Snapshot<'_>,
    ) -> Result<(Vec<Option<f64>>, Option<PileState>), Fault> {
        let (values, pile) = self.values_of(snapshot);
        match self.probes.overflow(&values[..self.probes.names().count()]) {
            None => Ok((values, pile)),
            Some(probe) => Err(Fault::Overflow {
                probe: probe.to_owned(),
                place: place.clone(),
            }),
        }
    }

    fn values_of(&self, snapshot: &Snapshot<'_>) -> (Vec<Option<f64>>, Option<PileState>) {
        let mut values = self.probes.values(snapshot);
        let Some(pile) = &self.pile else {
            return (values, None);
        };
        let state = pile.state(snapshot);
        let of_pile = state.as_ref().map(PileState::values);
        values.extend(of_pile.unwrap_or_default());
        (values, state)
    }

    /// Notes how large what the columns are made of is in a state.
    fn note_sizes(&mut self, snapshot: &Snapshot<'_>) {
        let of = Sizes::of(snapshot);
        let mut sizes = self.probes.sizes(snapshot, &of);
        if self.pile.is_some() {
            sizes.extend(pile::sizes(&of));
        }
        let known = &mut self.summary.course.sizes;
        known.resize(sizes.len(), 0.0);
        for (known, size) in known.iter_mut().zip(sizes) {
            *known = known.max(size);
        }
    }

    /// Notes the last state of equilibrium of a phase that cannot go on, and writes its fields if
    /// there are any. `place` is the increment that it lies in.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn last_equilibrium(
        &mut self,
        place: &Place,
        load_factor: f64,
        time: f64,
        snapshot: &Snapshot<'_>,
    ) -> Result<(), Error> {
        self.begins(&place.phase, snapshot);
        self.summary.course.stopped = Some(Stopped {
            phase: place.phase.clone(),
            load_factor,
            time,
            probes: self.values_of(snapshot).0,
        });
        if let Some(fields) = &mut self.fields
            && fields.last() != Some(time)
        {
            fields.write(time, snapshot)?;
        }
        Ok(())
    }

    /// Writes an increment that reached equilibrium.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn increment(
        &mut self,
        increment: &Increment,
        snapshot: &Snapshot<'_>,
    ) -> Result<(), Fault> {
        let (place, of, time) = (&increment.place, &increment.of, increment.time);
        self.begins(&place.phase, snapshot);
        let (probes, pile) = self.values(place, snapshot)?;
        let start = Instant::now();
        let row = history_row(place, time, &probes, increment.iterations);
        self.history.row(row);
        self.history.flush()?;
        if self.settings.profile.includes(place.increment, *of)
            && let Some(profile) = &mut self.profile
        {
            profile.write(place, snapshot)?;
        }
        if let Some(of_pile) = &mut self.pile {
            of_pile.add(place, pile.as_ref(), snapshot)?;
        }
        if let (Some(of_pile), Some(state)) = (&self.pile, &pile) {
            self.figures.along_pile(place, *of, (state, of_pile.unit()));
        }
        if self.settings.points.includes(place.increment, *of)
            && let Some(points) = &mut self.points
        {
            points.write(place, snapshot)?;
        }
        if self.settings.fields.includes(place.increment, *of)
            && let Some(fields) = &mut self.fields
        {
            fields.write(time, snapshot)?;
        }
        if place.increment == *of {
            self.note_sizes(snapshot);
            if self.settings.mesh_error {
                let found = OfPhase::of(&place.phase, snapshot);
                self.summary.course.mesh_errors.push(found);
            }
        }
        if let Some(warning) = &increment.unreliable {
            self.log.unreliable(place, warning)?;
        }
        self.figures.increment(place, &probes);
        self.figures.cuts(place, *of, snapshot);
        self.summary.last_increment(increment, probes);
        self.seconds += start.elapsed();
        Ok(())
    }

    /// Takes how far from rest the ground was found: in this phase, by this share of its weight.
    pub fn at_rest(&mut self, phase: &str, share: f64) {
        self.summary.course.at_rest = Some((phase.to_owned(), share));
    }

    /// Takes the record of a phase.
    pub fn phase(&mut self, record: PhaseRecord) {
        self.summary.phase(record);
    }

    /// The figures so far.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// At which load of its head the pile found no further equilibrium.
    pub fn plunge(&self, simulation: &Simulation, none: &NoEquilibrium) -> Option<String> {
        self.pile.as_ref()?.plunge(simulation, none)
    }

    /// Resistances of the pile, if there is one.
    pub fn resistances(&self) -> Option<Resistances> {
        self.pile.as_ref().map(PileRecord::resistances)
    }

    /// A warning if much of a pile's settlement is elastic slip of its joints.
    pub fn soft_shaft(&self) -> Option<String> {
        self.pile.as_ref().and_then(PileRecord::soft_shaft)
    }

    /// Largest force out of balance of steps with a pile, as a share of the pile's largest load, in words.
    pub fn out_of_balance(&self) -> Option<String> {
        let phases = &self.summary.course.phases;
        let residual = |name: &str| {
            let mut records = phases.iter().map(|(record, _)| record);
            let record = records.find(|record| record.name == name)?;
            Some(record.residual_force)
        };
        self.pile.as_ref()?.out_of_balance(residual)
    }

    /// The error of the mesh at the end of the last phase, in words, if it was asked for.
    pub fn mesh_error(&self) -> Option<String> {
        self.summary.course.mesh_errors.last().map(OfPhase::words)
    }

    /// Folder of the results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Keeps nothing for a report: this process makes none.
    pub fn makes_no_report(&mut self) {
        self.known();
    }

    /// What a report of these results need not read again.
    pub fn known(&mut self) -> Known {
        Known {
            profile: self.profile.as_mut().and_then(Profile::shown),
        }
    }

    /// Warnings about results that laws call inaccurate, one for each phase that has any.
    pub fn unreliable(&self) -> Vec<String> {
        self.summary.unreliable()
    }

    /// Draws the figures and writes the summary; the run's error, if there is one, and its
    /// warnings go into it.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn finish(
        &mut self,
        groups: &[Group],
        total: Duration,
        warnings: &[String],
        ending: &Ending,
    ) -> Result<(), Error> {
        let drawn = self.figures.draw(&self.folder);
        let mut summary = self
            .summary
            .finish(groups, [total, self.seconds], warnings, ending);
        summary.pile = self.resistances().map(|found| found.summary());
        let of_pile = self.pile.as_ref();
        let cycles = of_pile.map_or(Ok(()), |pile| pile.finish(&self.folder));
        let logged = self.log.end(&ending.status);
        // A log that takes no more must not leave a run that seems to go on.
        summary::write(&self.folder, summary)?;
        logged.and(cycles).and(drawn)
    }
}

/// Why something that happened could not be written.
#[derive(Debug)]
pub enum Fault {
    /// A file.
    File(Error),
    /// The value of a probe is too large for a number.
    Overflow {
        /// The probe.
        probe: String,
        /// Where.
        place: Place,
    },
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::File(error)
    }
}
