//! Parameters of laws from measured curves: `pilum calibrate`.
//!
//! A calibration names drivers and cases with what was measured in them. [`run`] is the command: it
//! looks for the values whose curves come nearest, by least squares from several starts, and says how
//! well the tests determine them.

mod coordinates;
mod curve;
mod figures;
mod files;
mod fit;
mod least_squares;
mod model;
mod page;
mod rates;
mod statistics;
mod words;

pub use coordinates::Parameter;
pub use curve::Curve;
pub use fit::{Group, Landing, Optimum, Profile, Stage};
pub use least_squares::End;
pub use statistics::Covariance;

use crate::Error;
use crate::variants::keep;
use fit::{Wish, fit};
use input::calibration::{Calibration, Variance};
use input::material::ParameterValue;
use law::{Opener, Stop};
use model::{Model, Subject};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use words::digits;

/// What is asked of a calibration.
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
    /// What libraries of laws are opened with.
    pub opener: Opener,
}

/// What a calibration has found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What it is called.
    pub name: String,
    /// Title.
    pub title: String,
    /// The parameters that were looked for.
    pub parameters: Vec<Parameter>,
    /// Their values.
    pub values: Vec<f64>,
    /// Of each, the last stage that it was fitted in, and its place there.
    pub places: Vec<(usize, usize)>,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Tests in the order of the file.
    pub tests: Vec<Fitted>,
    /// What is to be said of them.
    pub words: Vec<String>,
    /// The set to paste.
    pub block: String,
    /// Probability with which an interval holds the true value.
    pub confidence: f64,
    /// Whether the noise was given, or only its proportions.
    pub variance: Variance,
    /// Computations of a test in all.
    pub computations: usize,
}

/// A test beside its measured points.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Name.
    pub name: String,
    /// It was predicted, not fitted.
    pub is_predicted: bool,
    /// Its derivatives came from the rates of its law, not from differences.
    pub is_by_law: bool,
    /// Its curves.
    pub curves: Vec<FittedCurve>,
}

/// A curve beside its measured points.
#[derive(Clone, Debug)]
pub struct FittedCurve {
    /// What was measured.
    pub curve: Curve,
    /// Computed values at the measured points.
    pub computed: Vec<f64>,
    /// The computed curve.
    pub line: Vec<(f64, f64)>,
    /// Standard deviation of a new measured value at each point: of its noise, and of the computed value
    /// as far as that follows from the parameters' own.
    pub deviations: Vec<f64>,
    /// Root of the mean square of computed less measured values, in the unit of the curve.
    pub rms: f64,
    /// The same of residuals over their noise as given.
    pub relative: f64,
    /// Correlation of neighbouring residuals.
    pub neighbours: f64,
    /// Part of the measured points inside the interval of prediction.
    pub inside: f64,
}

/// An interval of confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its ends; `None` where the tests set no limit.
    pub ends: [Option<f64>; 2],
    /// From the profile, else from the covariance.
    pub is_of_profile: bool,
}

impl Outcome {
    /// The interval of a parameter; `None` if the tests do not determine it, or it is on a bound.
    pub fn interval(&self, parameter: usize) -> Option<Interval> {
        let (stage, place) = self.places[parameter];
        let stage = &self.stages[stage];
        let p = &self.parameters[parameter];
        if stage.on_bound[place] != [false, false] || !stage.is_seen(place, p.counted_range()) {
            return None;
        }
        let profile = stage
            .profiles
            .get(place)
            .filter(|profile| profile.points.len() > 1);
        if let Some(profile) = profile {
            return Some(Interval {
                ends: profile.interval.map(|end| end.map(|u| p.value(u))),
                is_of_profile: true,
            });
        }
        self.linear_interval(parameter)
    }

    /// The interval from the covariance alone.
    pub fn linear_interval(&self, parameter: usize) -> Option<Interval> {
        let (stage, place) = self.places[parameter];
        let stage = &self.stages[stage];
        let p = &self.parameters[parameter];
        let half = stage.quantile * stage.error(place)?;
        let end = |u: f64| half.is_finite().then(|| p.value(u));
        Some(Interval {
            ends: [end(stage.best[place] - half), end(stage.best[place] + half)],
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
        files::refuse_run(&folder)?;
        let was_there = folder.exists();
        let outcome = calibrate(calibration, &folder, options, say).inspect_err(|_| {
            // Nothing was found: a folder that has nothing in it goes.
            if !was_there {
                let _ = std::fs::remove_dir(&folder);
            }
        })?;
        files::write(&outcome, calibration, &folder)?;
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
        let default = || Path::new("results").join(format!("calibrate_{}", calibration.name()));
        let folder = self.out.clone().unwrap_or_else(default);
        match &calibration.variant {
            Some(variant) if self.variant.is_none() => folder.join(variant),
            _ => folder,
        }
    }
}

/// Carries out a calibration; `folder` takes what trials of cases leave for a while.
///
/// # Errors
/// As [`run`].
pub fn calibrate(
    calibration: &Calibration,
    folder: &Path,
    options: &Options,
    say: &mut dyn FnMut(&str),
) -> Result<Outcome, Error> {
    let file = &calibration.file;
    let mut model = Model::new(calibration, &options.opener, folder, &options.stop)?;
    let starts = file.starts.as_ref().map(|starts| *starts.get_ref());
    let is_slow = model
        .tests
        .iter()
        .any(|test| matches!(test.subject, Subject::Case(_)));
    let wish = Wish {
        starts: starts.unwrap_or(if is_slow { 2 } else { 8 }),
        seed: file.seed,
        variance: file.variance,
        confidence: *file.confidence.get_ref(),
        profiles: file.profiles,
    };
    let mut counted: Vec<f64> = model
        .parameters
        .iter()
        .map(|p| p.counted(p.start))
        .collect();
    let mut words = std::mem::take(&mut model.notes);
    let mut stages = Vec::new();
    let groups = groups(calibration, &model);
    for group in &groups {
        let Some(stage) = fit(&mut model, group, &counted, wish, say)? else {
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
        let of_stage = words::of_stage(&mut model, &stage, &counted, wish.variance)?;
        let name = |word: String| match groups.len() {
            1 => word,
            _ => format!("stage `{}`: {word}", group.name),
        };
        words.extend(of_stage.into_iter().map(name));
        stages.push(stage);
    }
    let last = |parameter: usize| {
        let of = |(number, stage): (usize, &Stage)| {
            let place = stage
                .group
                .parameters
                .iter()
                .position(|&p| p == parameter)?;
            Some((number, place))
        };
        stages
            .iter()
            .enumerate()
            .rev()
            .find_map(of)
            .unwrap_or((0, 0))
    };
    let places: Vec<(usize, usize)> = (0..model.parameters.len()).map(last).collect();
    if groups.len() > 1 {
        words.push(
            "an interval holds for the values of the parameters that its stage did not fit; a last stage with all of \
             them gives intervals that hold together"
                .to_owned(),
        );
    }
    let tests = fitted(&mut model, &stages, &counted)?;
    words.extend(misfits(&tests));
    let values: Vec<f64> = model
        .parameters
        .iter()
        .zip(&counted)
        .map(|(p, u)| p.value(*u))
        .collect();
    let block = block(calibration, &model, &values);
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
        block,
        confidence: wish.confidence,
        variance: wish.variance,
        computations: model.computations,
    })
}

/// The stages of the file, or one of all.
fn groups(calibration: &Calibration, model: &Model) -> Vec<Group> {
    let fitted = || {
        let tests = model.tests.iter().enumerate();
        tests
            .filter(|(_, test)| !test.is_predicted)
            .map(|(number, _)| number)
    };
    let stages = &calibration.file.stage;
    if stages.is_empty() {
        return vec![Group {
            name: "all".to_owned(),
            parameters: (0..model.parameters.len()).collect(),
            tests: fitted().collect(),
        }];
    }
    let named = |stage: &input::calibration::StageInput| {
        let is_in = |name: &str| stage.free.iter().any(|free| free.get_ref() == name);
        let has = |&test: &usize| {
            let name = &model.tests[test].name;
            stage.tests.is_empty() || stage.tests.iter().any(|other| other.get_ref() == name)
        };
        let parameters = model.parameters.iter().enumerate();
        Group {
            name: stage.name.get_ref().clone(),
            parameters: parameters
                .filter(|(_, p)| is_in(&p.name))
                .map(|(i, _)| i)
                .collect(),
            tests: fitted().filter(has).collect(),
        }
    };
    stages.iter().map(named).collect()
}

/// All tests with the values found, those that are predicted included.
fn fitted(model: &mut Model, stages: &[Stage], counted: &[f64]) -> Result<Vec<Fitted>, Error> {
    let mut all = Vec::new();
    for number in 0..model.tests.len() {
        let (name, is_predicted) = (
            model.tests[number].name.clone(),
            model.tests[number].is_predicted,
        );
        let rows = match model.computed(number, counted)? {
            Ok(rows) => rows,
            Err(why) => {
                let message =
                    format!("test `{name}` cannot be computed with the values found: {why}");
                return Err(Error::usage(message));
            }
        };
        // The stage that has most to say of it.
        let stage = stages
            .iter()
            .max_by_key(|stage| stage.group.parameters.len());
        let gradients = match stage {
            Some(stage) => model.gradients(number, counted, &stage.group.parameters)?,
            None => Vec::new(),
        };
        let mut curves = Vec::new();
        let mut first = 0;
        for curve in model.tests[number].curves.clone() {
            let n = curve.points.len();
            let (Ok(computed), Ok(line)) = (curve.computed(&rows), curve.line(&rows)) else {
                let message = format!(
                    "test `{name}`: with the values found `{}` ends before the last measured point; `x` is best what \
                     the test imposes",
                    curve.x
                );
                return Err(Error::usage(message));
            };
            let residuals = curve.residuals(&computed);
            let variance = stage.map_or(1.0, |stage| stage.variance);
            let deviation = |i: usize| {
                let gradient: Vec<f64> = gradients.iter().map(|column| column[first + i]).collect();
                let own = stage.map_or(0.0, |stage| stage.covariance.variance_along(&gradient));
                (variance * (own + curve.deviations[i].powi(2))).sqrt()
            };
            let deviations: Vec<f64> = (0..n).map(deviation).collect();
            let quantile = stage.map_or(2.0, |stage| stage.quantile);
            let points = curve.points.iter().zip(&computed).zip(&deviations);
            let inside = points
                .filter(|(((_, y), c), d)| (y - *c).abs() <= quantile * **d)
                .count();
            let squares = |values: &mut dyn Iterator<Item = f64>| {
                (values.map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt()
            };
            let mut differences = curve.points.iter().zip(&computed).map(|((_, y), c)| c - y);
            let rms = squares(&mut differences);
            let factor = curve.weight.sqrt();
            let relative = squares(&mut residuals.iter().map(|r| r / factor));
            curves.push(FittedCurve {
                computed,
                line,
                deviations,
                rms,
                relative,
                neighbours: statistics::of_neighbours(&residuals),
                inside: inside as f64 / n.max(1) as f64,
                curve,
            });
            first += n;
        }
        all.push(Fitted {
            name,
            is_predicted,
            is_by_law: model.tests[number].is_by_law,
            curves,
        });
    }
    Ok(all)
}

/// Neighbouring residuals that go together more than this, on a curve of so many points.
const FOLLOW: f64 = 0.5;
const ENOUGH: usize = 10;

/// Curves whose residuals are no noise.
fn misfits(tests: &[Fitted]) -> Vec<String> {
    let mut words = Vec::new();
    for test in tests.iter().filter(|test| !test.is_predicted) {
        for fitted in &test.curves {
            let rho = fitted.neighbours;
            // So small a residual is the last digit of a measured value.
            let is_exact = fitted.relative < 1e-3;
            if rho > FOLLOW && fitted.curve.points.len() >= ENOUGH && !is_exact {
                let factor = ((1.0 + rho) / (1.0 - rho).max(1e-3)).sqrt();
                words.push(format!(
                    "{}, {}: residuals follow each other (correlation of neighbours {rho:.2}): that is no noise but what \
                     the law does not follow, or points that were measured too densely; the intervals are too narrow, \
                     by a factor of about {factor:.1} as far as this curve counts",
                    test.name, fitted.curve.y
                ));
            }
        }
    }
    words
}

/// The set to paste: into drivers, and into cases.
fn block(calibration: &Calibration, model: &Model, values: &[f64]) -> String {
    let mut of_driver: Vec<(String, String)> = Vec::new();
    let mut of_cases: Vec<(String, Vec<(String, String)>)> = Vec::new();
    let number = |value: f64| {
        let text = digits(value);
        if text.contains(['.', 'e']) {
            text
        } else {
            format!("{text}.0")
        }
    };
    let written = |value: &ParameterValue| match value {
        ParameterValue::Number(value) => Some(number(*value)),
        ParameterValue::Integer(value) => Some(value.to_string()),
        ParameterValue::Label(label) => Some(format!("{label:?}")),
        ParameterValue::Varying(_) => None,
    };
    // What all drivers give alike belongs to the set.
    let drivers: Vec<_> = model
        .tests
        .iter()
        .filter_map(|test| match &test.subject {
            Subject::Driver(driver) => driver.parameters(),
            Subject::Case(_) => None,
        })
        .collect();
    let is_looked_for = |id: &str| {
        let mut targets = model.tests.iter().flat_map(|test| &test.targets);
        targets.any(|(_, table, other)| table.is_none() && other == id)
    };
    for (id, value) in drivers.first().into_iter().flat_map(|table| table.iter()) {
        let is_alike = drivers.iter().all(|table| {
            let mut others = table
                .iter()
                .filter(|(other, _)| other.get_ref() == id.get_ref());
            others.any(|(_, other)| other.get_ref() == value.get_ref())
        });
        if is_alike && !is_looked_for(id.get_ref()) {
            let text = written(value.get_ref());
            of_driver.extend(text.map(|text| (id.get_ref().clone(), text)));
        }
    }
    let mut add = |table: Option<&String>, id: &str, text: String| {
        let entries = match table {
            None => &mut of_driver,
            Some(name) => {
                let known = of_cases.iter().position(|(other, _)| other == name);
                if known.is_none() {
                    of_cases.push((name.clone(), Vec::new()));
                }
                let place = known.unwrap_or(of_cases.len() - 1);
                &mut of_cases[place].1
            }
        };
        if !entries.iter().any(|(other, _)| other == id) {
            entries.push((id.to_owned(), text));
        }
    };
    for (name, input) in &calibration.file.fixed {
        let input = input.get_ref();
        let id = input.parameter.as_ref().unwrap_or(name).get_ref();
        for law in &input.laws {
            if let Some(text) = written(input.value.get_ref()) {
                add(Some(law.get_ref()), id, text);
            }
        }
    }
    for (parameter, table, id) in model.tests.iter().flat_map(|test| &test.targets) {
        add(table.as_ref(), id, number(values[*parameter]));
    }
    let mut text = String::new();
    let mut table = |heading: &str, entries: &[(String, String)]| {
        if !entries.is_empty() {
            let lines: Vec<String> = entries
                .iter()
                .map(|(id, v)| format!("{id} = {v}\n"))
                .collect();
            let gap = if text.is_empty() { "" } else { "\n" };
            let _ = write!(text, "{gap}[{heading}]\n{}", lines.concat());
        }
    };
    table("parameters", &of_driver);
    for (name, entries) in &of_cases {
        table(&format!("laws.{name}.parameters"), entries);
    }
    text
}
