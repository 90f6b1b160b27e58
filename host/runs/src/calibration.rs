//! Parameters of laws from measured curves: `pilum calibrate`.
//!
//! A calibration names drivers and cases with what was measured in them. The command [`run`] looks
//! for the values whose curves come nearest, by least squares from several starts, and reports how
//! well the tests determine them.

mod coordinates;
mod curve;
mod derivatives;
mod figures;
mod fit;
mod fitted;
mod least_squares;
mod messages;
mod misfit;
mod model;
mod output;
mod parameter_block;
mod problem;
mod profile;
mod propagation;
mod rates;
mod setup;
mod stage;
mod statistics;
mod systematic;

pub use coordinates::Parameter;
pub use curve::Curve;
pub use fitted::{Fitted, FittedCurve};
pub use least_squares::End;
pub use problem::ResidualProblem;
pub use profile::{Profile, Side};
pub use stage::{Group, Landing, Optimum, Stage};
pub use statistics::Covariance;
pub use systematic::{Follow, Systematic};

use crate::Error;
use crate::variants::{folder, keep};
use fit::{Wish, fit};
use fitted::fitted;
use input::Kind;
use input::calibration::{Calibration, StageInput, Variance};
use law::{Opener, Stop, Stopped};
use model::{Model, Subject, Test};
use parameter_block::block;
use propagation::Errors;
use stage::last_stage;
use std::path::{Path, PathBuf};
use text::Spanned;

/// Settings of a calibration.
#[derive(Clone, Debug)]
pub struct Options {
    /// Only this variant.
    pub variant: Option<String>,
    /// Settings over what the file says, `KEY=VALUE`.
    pub settings: Vec<String>,
    /// Folder of the results; `results/calibrate_<name>` if left out.
    pub out: Option<PathBuf>,
    /// Who may want it to stop.
    pub stop: Stop,
    /// Settings for opening libraries of laws.
    pub opener: Opener,
    /// Forgets the results of an earlier call that was ended.
    pub anew: bool,
}

/// Result of a calibration.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its name.
    pub name: String,
    /// Title.
    pub title: String,
    /// The parameters that were looked for.
    pub parameters: Vec<Parameter>,
    /// Their values.
    pub values: Vec<f64>,
    /// For each, the last stage that fitted it, and its place there.
    pub places: Vec<(usize, usize)>,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Tests in the order of the file.
    pub tests: Vec<Fitted>,
    /// Notes about them.
    pub words: Vec<String>,
    /// So many of these, the first, are why values and intervals are not to be believed.
    pub warnings: usize,
    /// The set to paste.
    pub block: String,
    /// Probability with which an interval holds the true value.
    pub confidence: f64,
    /// Whether the noise was given, or only its proportions.
    pub variance: Variance,
    /// Computations of a test in all, those of earlier calls that were ended included.
    pub computations: usize,
}

/// An interval of confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its ends; `None` where absent, or none is known.
    pub ends: [Option<f64>; 2],
    /// Meaning of an end that is `None`.
    pub open: [Open; 2],
    /// From the profile, else from the covariance.
    pub is_of_profile: bool,
}

/// State beyond a side of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Open {
    /// It has an end.
    No,
    /// The tests set no limit.
    Unlimited,
    /// It goes on to this value at least, beyond which tests cannot be computed.
    Barred(f64),
    /// It goes on to this value at least; it was not followed further.
    Unfinished(f64),
}

impl Open {
    /// As tables have it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::No => "limit",
            Self::Unlimited => "none",
            Self::Barred(_) => "barred",
            Self::Unfinished(_) => "unfinished",
        }
    }
}

impl Outcome {
    /// The interval of a parameter; `None` if the tests do not determine it, or it is on a bound.
    pub fn interval(&self, parameter: usize) -> Option<Interval> {
        let (stage, place) = self.places[parameter];
        let stage = &self.stages[stage];
        let p = &self.parameters[parameter];
        if stage.on_bound[place] != [false, false] || !stage.seen[place] {
            return None;
        }
        let profile = stage
            .profiles
            .get(place)
            .filter(|profile| profile.points.len() > 1);
        let Some(profile) = profile else {
            return self.linear_interval(parameter);
        };
        let end = |side: &Side| match side {
            Side::Limit(u) => (Some(p.value(*u)), Open::No),
            Side::Bound | Side::Flat(_) => (None, Open::Unlimited),
            Side::Barred(u) => (None, Open::Barred(p.value(*u))),
            Side::Unfinished(u) => (None, Open::Unfinished(p.value(*u))),
            Side::Unknown => (None, Open::Unfinished(p.value(stage.best[place]))),
        };
        let [below, above] = profile.sides.each_ref().map(end);
        Some(Interval {
            ends: [below.0, above.0],
            open: [below.1, above.1],
            is_of_profile: true,
        })
    }

    /// The interval from the covariance alone.
    pub fn linear_interval(&self, parameter: usize) -> Option<Interval> {
        let (stage, place) = self.places[parameter];
        let stage = &self.stages[stage];
        let p = &self.parameters[parameter];
        let half = stage.quantile * stage.error(place)?;
        let end = |u: f64| half.is_finite().then(|| p.value(u));
        let open = if half.is_finite() {
            Open::No
        } else {
            Open::Unlimited
        };
        Some(Interval {
            ends: [end(stage.best[place] - half), end(stage.best[place] + half)],
            open: [open; 2],
            is_of_profile: false,
        })
    }
}

/// Carries out a calibration, or all its variants, and writes the results. `show` takes the tables,
/// `say` what is being done.
///
/// # Errors
/// Bad input, or a test that cannot be computed with the starting values, before anything is written;
/// stopped; [`text::Error::Unwritable`].
pub fn run(
    path: &Path,
    options: &Options,
    show: &mut dyn FnMut(&str),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let mut all = Calibration::load_with(path, &options.settings)?;
    keep(&mut all, options.variant.as_deref(), |one| {
        one.variant.clone()
    })?;
    for calibration in &all {
        if let Some(name) = &calibration.variant {
            say(&format!("variant {name}"));
        }
        let folder = options.folder(calibration);
        output::refuse_run(&folder)?;
        let was_there = folder.exists();
        let outcome = calibrate(calibration, &folder, options, say).inspect_err(|_| {
            // Nothing was found: a folder that has nothing in it goes.
            if !was_there {
                let _ = std::fs::remove_dir(&folder);
            }
        })?;
        output::write(&outcome, calibration, &folder)?;
        model::forget(&folder);
        show(&outcome.text());
        show(&format!("results in {}", folder.display()));
        show(&format!(
            "report in {}",
            folder.join("report.html").display()
        ));
    }
    Ok(())
}

impl Options {
    /// Folder of one calibration: that of all, or one inside it for each variant.
    fn folder(&self, calibration: &Calibration) -> PathBuf {
        let name = format!("calibrate_{}", calibration.name());
        let variant = calibration.variant.as_deref();
        folder(self.out.as_deref(), &name, variant, self.variant.as_deref())
    }
}

/// Carries out a calibration. `folder` takes what trials of cases leave for a while, and what was computed,
/// from which the same call goes on if this one is stopped or killed.
///
/// # Errors
/// As [`run`].
pub fn calibrate(
    calibration: &Calibration,
    folder: &Path,
    options: &Options,
    say: &mut dyn FnMut(&str),
) -> Result<Outcome, Error> {
    let mut model = Model::new(calibration, &options.opener, folder, &options.stop)?;
    model.keep_in(folder, options.anew)?;
    if model.kept.were_others {
        say(
            "what an earlier call has computed is of other tests, parameters, laws or another version of the program: begun \
             anew",
        );
    } else if model.kept.of_before > 0 {
        say(&format!(
            "{} computations of an earlier call are taken over",
            model.kept.of_before
        ));
    }
    carry_out(calibration, &mut model, say).map_err(|error| match error.kind() {
        Kind::Stopped => Stopped {
            doing: format!(
                "{} computations are kept in {}, and the same command goes on from there",
                model.kept.len(),
                folder.display()
            ),
        }
        .into(),
        Kind::Internal => error,
        _ => {
            model::forget(folder);
            error
        }
    })
}

/// How the search goes: more starts where tests are quick.
fn wish(calibration: &Calibration, model: &Model) -> Wish {
    let file = &calibration.file;
    let starts = file.starts.as_ref().map(|starts| *starts.get_ref());
    let is_case = |test: &Test| matches!(test.subject, Subject::Case(_));
    let is_slow = model.tests.iter().any(is_case);
    Wish {
        starts: starts.unwrap_or(if is_slow { 2 } else { 8 }),
        seed: file.seed,
        variance: file.variance,
        confidence: *file.confidence.get_ref(),
        profiles: file.profiles,
    }
}

/// Results of all stages.
struct Found {
    /// All parameters as the search counts them.
    counted: Vec<f64>,
    stages: Vec<Stage>,
    errors: Errors,
    words: Vec<String>,
}

/// Fits stage after stage.
fn fit_all(
    model: &mut Model,
    groups: &[Group],
    wish: Wish,
    say: &mut dyn FnMut(&str),
) -> Result<Found, Error> {
    let parameters = model.parameters.iter();
    let mut counted: Vec<f64> = parameters.map(|p| p.counted(p.start)).collect();
    let mut words = std::mem::take(&mut model.notes);
    let mut stages = Vec::new();
    let mut errors = Errors::new(model);
    for group in groups {
        let Some(stage) = fit(model, group, &counted, wish, say)? else {
            let message = format!(
                "stage `{}`: with no start can all tests be computed: {}",
                group.name,
                model.first_failure.clone().unwrap_or_default()
            );
            return Err(Error::usage(message));
        };
        for (&parameter, u) in group.parameters.iter().zip(&stage.best) {
            counted[parameter] = *u;
        }
        errors.add(model, &stage, &counted)?;
        let of_stage = messages::of_stage(model, &stage, &counted, wish.variance)?;
        let name = |word: String| match groups.len() {
            1 => word,
            _ => format!("stage `{}`: {word}", group.name),
        };
        words.extend(of_stage.into_iter().map(name));
        stages.push(stage);
    }
    Ok(Found {
        counted,
        stages,
        errors,
        words,
    })
}

fn carry_out(
    calibration: &Calibration,
    model: &mut Model,
    say: &mut dyn FnMut(&str),
) -> Result<Outcome, Error> {
    let file = &calibration.file;
    let wish = wish(calibration, model);
    let groups = groups(calibration, model);
    let Found {
        counted,
        stages,
        errors,
        mut words,
    } = fit_all(model, &groups, wish, say)?;
    let places = 0..model.parameters.len();
    let places = places.map(|parameter| last_stage(&stages, parameter).unwrap_or((0, 0)));
    let places: Vec<(usize, usize)> = places.collect();
    if groups.len() > 1 {
        words.extend(messages::of_stages(model, &stages, &places, &errors));
    }
    let (tests, of_tests) = fitted(model, &stages, &errors, &counted, wish)?;
    // What makes all the rest worth nothing comes first.
    let warnings = of_tests.bad.len();
    words.splice(0..0, of_tests.bad);
    words.extend(of_tests.others);
    let values = model.values(&counted);
    let block = block(calibration, model, &values);
    Ok(Outcome {
        name: calibration.name(),
        title: if file.title.is_empty() {
            calibration.name()
        } else {
            file.title.clone()
        },
        parameters: model.parameters.clone(),
        values,
        places,
        stages,
        tests,
        words,
        warnings,
        block,
        confidence: wish.confidence,
        variance: wish.variance,
        computations: model.kept.len(),
    })
}

/// The stages of the file, or one of all.
fn groups(calibration: &Calibration, model: &Model) -> Vec<Group> {
    let fitted = || (0..model.tests.len()).filter(|&test| !model.tests[test].is_predicted);
    let stages = &calibration.file.stage;
    if stages.is_empty() {
        return vec![Group {
            name: "all".to_owned(),
            parameters: (0..model.parameters.len()).collect(),
            tests: fitted().collect(),
        }];
    }
    let named = |stage: &StageInput| {
        let is_in = |names: &[Spanned<String>], name| names.iter().any(|one| one.get_ref() == name);
        let tests = fitted()
            .filter(|&test| stage.tests.is_empty() || is_in(&stage.tests, &model.tests[test].name));
        let tests: Vec<usize> = tests.collect();
        // How a curve was read is looked for wherever its test is.
        let is_of_stage = |parameter: &usize| {
            let p = &model.parameters[*parameter];
            match p.of_curve {
                Some((test, _)) => tests.contains(&test),
                None => is_in(&stage.free, &p.name),
            }
        };
        let parameters = (0..model.parameters.len()).filter(is_of_stage);
        Group {
            name: stage.name.get_ref().clone(),
            parameters: parameters.collect(),
            tests,
        }
    };
    stages.iter().map(named).collect()
}
