//! The calibration file: which parameters of laws are looked for, and the tests that they are to follow.

use crate::case::MeasuredInput;
use crate::material::ParameterValue;
use crate::{Error, measured};
use results::output_request::Measured;
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::base::{OtherKind, read_kind};
use text::{Named, Source, Spanned};

/// What other files look like among calibrations.
const OTHER: OtherKind = OtherKind {
    keys: &[
        "hypothesis",
        "segment",
        "analysis",
        "mesh",
        "groups",
        "phase",
    ],
    message: "this is a driver or case file; expected a calibration, whose tests name such files",
    command: "pilum point` or `pilum run",
};

/// A calibration and its text.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Text and path, for messages.
    pub source: Source,
    /// Contents.
    pub file: CalibrationFile,
    /// Name of the variant, if the file stands for several calibrations.
    pub variant: Option<String>,
}

/// The keys of a calibration.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Title.
    #[serde(default)]
    pub title: String,
    /// Parameters to be found, by name.
    pub free: Named<FreeInput>,
    /// Parameters with another value than in the files of the tests, by name.
    #[serde(default)]
    pub fixed: Named<FixedInput>,
    /// The tests.
    pub test: Vec<TestInput>,
    /// Groups of parameters, fitted one after the other; default: all at once.
    #[serde(default)]
    pub stage: Vec<StageInput>,
    /// Number of starts of the search: the given one, and others over the ranges; default 8, with cases
    /// 2.
    #[schemars(range(min = 1))]
    pub starts: Option<Spanned<usize>>,
    /// Seed of the starts.
    #[serde(default)]
    pub seed: u64,
    /// Meaning of the `noise` of curves; default `estimated`.
    #[serde(default)]
    pub variance: Variance,
    /// Probability that an interval holds the true value.
    #[serde(default = "confidence")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub confidence: Spanned<f64>,
    /// Compute the profile of each parameter: the best sum of squares for values near the best one.
    #[serde(default = "yes")]
    pub profiles: bool,
    /// Step of differences over a parameter's range, on a logarithmic scale over its value; default
    /// 1e-4, with cases the root of the loosest force tolerance.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.1))]
    pub difference: Option<Spanned<f64>>,
}

fn confidence() -> Spanned<f64> {
    Spanned::new(0..0, 0.95)
}

fn yes() -> bool {
    true
}

/// Scatter of measured values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Variance {
    /// Proportions; the size is estimated from the residuals.
    #[default]
    Estimated,
    /// Standard deviation.
    Given,
}

/// How a parameter is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Its value.
    Linear,
    /// Its logarithm.
    Log,
}

/// A parameter that is looked for.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeInput {
    /// Id of the law's parameter; default: the name.
    pub parameter: Option<Spanned<String>>,
    /// Cases: its tables under `[laws]`; without them it belongs to drivers alone.
    #[serde(default)]
    pub laws: Vec<Spanned<String>>,
    /// Start of the search; default: its value in the first test.
    pub start: Option<Spanned<f64>>,
    /// Least value; default: the law's bound.
    pub min: Option<Spanned<f64>>,
    /// Greatest value; default: the law's bound.
    pub max: Option<Spanned<f64>>,
    /// Scale; default `log` if the law takes only values above 0.
    pub scale: Option<Spanned<Scale>>,
}

/// A parameter that has another value than in the files of the tests.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedInput {
    /// Id of the law's parameter; default: the name.
    pub parameter: Option<Spanned<String>>,
    /// Cases: its tables under `[laws]`; without them it belongs to drivers alone.
    #[serde(default)]
    pub laws: Vec<Spanned<String>>,
    /// Its value.
    pub value: Spanned<ParameterValue>,
}

/// A test: what leads a law or a model, and what was measured.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TestInput {
    /// Name.
    pub name: Spanned<String>,
    /// A driver file, relative to this one.
    pub driver: Option<Spanned<PathBuf>>,
    /// Instead of a driver: a case file or its folder, relative to this one.
    pub case: Option<Spanned<PathBuf>>,
    /// Variant of that file.
    pub variant: Option<Spanned<String>>,
    /// Drivers: the table under `[laws]` of cases that has the same law. Names with this table in `laws`
    /// belong to it; default: to every driver with the parameter.
    pub stands_for: Option<Spanned<String>>,
    /// Predict the test from the others, do not fit it.
    #[serde(default)]
    pub predict: bool,
    /// Factor of its squared residuals. It moves the values found, but is no information: equal weights
    /// change no interval.
    #[serde(default = "weight")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub weight: Spanned<f64>,
    /// Measured curves.
    pub curve: Vec<CurveInput>,
}

fn weight() -> Spanned<f64> {
    Spanned::new(0..0, 1.0)
}

/// A measured curve, and the computed one next to it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveInput {
    /// Computed column that the test imposes: it only grows or only falls.
    pub x: Spanned<String>,
    /// Computed column that is compared.
    pub y: Spanned<String>,
    /// Text of this axis.
    pub x_label: Option<String>,
    /// Text of this axis.
    pub y_label: Option<String>,
    /// Drivers: only this segment.
    #[schemars(range(min = 1))]
    pub segment: Option<Spanned<usize>>,
    /// Cases: the phase; default: the last one.
    pub phase: Option<Spanned<String>>,
    /// Measured points, after their scale in the unit of the computed columns.
    pub measured: Spanned<MeasuredInput>,
    /// Standard deviation of measured values, in the unit of `y`; default 1 % of the largest, without
    /// `relative_noise`.
    #[schemars(range(min = 0))]
    pub noise: Option<Spanned<f64>>,
    /// Part of the noise that grows with the measured value.
    #[schemars(range(min = 0))]
    pub relative_noise: Option<Spanned<f64>>,
    /// Offset of measured `x` (slack, wrong zero), fitted with the parameters; default 0.
    pub offset_x: Option<Spanned<ReadingInput>>,
    /// Factor on measured `x` before the offset, fitted likewise; default 1.
    pub scale_x: Option<Spanned<ReadingInput>>,
    /// Offset of measured `y`, fitted likewise; default 0.
    pub offset_y: Option<Spanned<ReadingInput>>,
    /// Factor on measured `y` before the offset, fitted likewise; default 1.
    pub scale_y: Option<Spanned<ReadingInput>>,
    /// Factor of its squared residuals. It moves the values found, but is no information: equal weights
    /// change no interval.
    #[serde(default = "weight")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub weight: Spanned<f64>,
}

/// How a curve was read, where that is looked for: between which values.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReadingInput {
    /// Least value; above 0 of a scale.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Start of the search; default: nearest to no offset and no scale.
    pub start: Option<f64>,
}

impl CurveInput {
    /// Offsets and scales that may be fitted: key, value if left out, input.
    pub fn readings(&self) -> [(&'static str, f64, Option<&Spanned<ReadingInput>>); 4] {
        [
            ("offset_x", 0.0, self.offset_x.as_ref()),
            ("scale_x", 1.0, self.scale_x.as_ref()),
            ("offset_y", 0.0, self.offset_y.as_ref()),
            ("scale_y", 1.0, self.scale_y.as_ref()),
        ]
    }
}

/// Parameters that are fitted together; those of earlier stages keep what was found, those of later ones
/// their start.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageInput {
    /// Name.
    pub name: Spanned<String>,
    /// The parameters.
    pub free: Vec<Spanned<String>>,
    /// Tests for the fit; default: all that are not predicted.
    #[serde(default)]
    pub tests: Vec<Spanned<String>>,
}

impl Calibration {
    /// Reads a calibration: one, or one for each `[[variant]]`, with settings over what the file says,
    /// `KEY=VALUE`, in every variant.
    ///
    /// # Errors
    /// [`text::Error::Unreadable`]; [`text::Error::Input`] at the place that does not fit.
    pub fn load_with(path: &Path, settings: &[String]) -> Result<Vec<Self>, Error> {
        let source = Source::read(path)?.with_settings(settings);
        let (source, files) = read_kind(source, &OTHER)?;
        let one = |(variant, file)| {
            let calibration = Self {
                source: source.clone(),
                file,
                variant,
            };
            calibration.check()?;
            Ok(calibration)
        };
        files.into_iter().map(one).collect()
    }

    /// Name: the file's stem.
    pub fn name(&self) -> String {
        let stem = self.source.path().file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Place of a file that a key names.
    pub fn path_of(&self, written: &Spanned<PathBuf>) -> PathBuf {
        self.source.file_named(written.get_ref(), &written.span())
    }

    /// The points of a curve.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the key that does not fit.
    pub fn measured(&self, curve: &CurveInput) -> Result<Measured, Error> {
        measured::read(&self.source, curve.measured.get_ref())
    }

    /// An error at a place of the file.
    pub fn error(&self, at: Range<usize>, message: impl Into<String>) -> Error {
        self.source.error(at, message).into()
    }

    /// What can be reported of the file without any other.
    fn check(&self) -> Result<(), Error> {
        let file = &self.file;
        self.check_above(&file.confidence, "confidence", 1.0)?;
        if let Some(step) = &file.difference
            && !(*step.get_ref() > 0.0 && *step.get_ref() <= 0.1)
        {
            let message = format!(
                "`difference` is {}, expected above 0, at most 0.1",
                step.get_ref()
            );
            return Err(self.error(step.span(), message));
        }
        if let Some(starts) = file
            .starts
            .as_ref()
            .filter(|starts| !(1..=1000).contains(starts.get_ref()))
        {
            let message = format!("`starts` is {}, expected 1 to 1000", starts.get_ref());
            return Err(self.error(starts.span(), message));
        }
        if file.free.is_empty() {
            let message = "there is no free parameter: [free] names those that are looked for";
            return Err(self.error(0..0, message));
        }
        self.check_names("test", file.test.iter().map(|test| &test.name))?;
        self.check_names("stage", file.stage.iter().map(|stage| &stage.name))?;
        let fitted = file.test.iter().filter(|test| !test.predict).count();
        if fitted == 0 {
            let message = "there is no test to fit: each has `predict = true`, or there is none";
            return Err(self.error(0..0, message));
        }
        for test in &file.test {
            self.check_test(test)?;
        }
        self.check_stages()
    }

    /// A number above 0 and below another.
    fn check_above(&self, value: &Spanned<f64>, key: &str, most: f64) -> Result<(), Error> {
        let number = *value.get_ref();
        if number > 0.0 && number < most {
            return Ok(());
        }
        let end = if most.is_finite() {
            format!(" and below {most}")
        } else {
            String::new()
        };
        let message = format!("`{key}` is {number}, expected a number above 0{end}");
        Err(self.error(value.span(), message))
    }

    fn check_test(&self, test: &TestInput) -> Result<(), Error> {
        let name = test.name.get_ref();
        match (&test.driver, &test.case) {
            (Some(_), None) | (None, Some(_)) => {}
            (Some(_), Some(case)) => {
                let message = "a test has a `driver` or a `case`, not both";
                return Err(self.error(case.span(), message));
            }
            (None, None) => {
                let message = format!("test `{name}` needs a `driver` or a `case`");
                return Err(self.error(test.name.span(), message));
            }
        }
        self.check_above(&test.weight, "weight", f64::INFINITY)?;
        if test.curve.is_empty() {
            let message = format!("test `{name}` needs a [[test.curve]]");
            return Err(self.error(test.name.span(), message));
        }
        for curve in &test.curve {
            self.check_above(&curve.weight, "weight", f64::INFINITY)?;
            self.check_curve(test, curve)?;
        }
        Ok(())
    }

    fn check_names<'s>(
        &self,
        kind: &str,
        names: impl Iterator<Item = &'s Spanned<String>>,
    ) -> Result<(), Error> {
        let mut seen: Vec<&str> = Vec::new();
        for name in names {
            if name.get_ref().trim().is_empty() {
                return Err(self.error(name.span(), format!("a {kind} needs a name")));
            }
            if seen.contains(&name.get_ref().as_str()) {
                let message = format!("two {kind}s are called `{}`", name.get_ref());
                return Err(self.error(name.span(), message));
            }
            seen.push(name.get_ref());
        }
        Ok(())
    }

    fn check_curve(&self, test: &TestInput, curve: &CurveInput) -> Result<(), Error> {
        for (key, noise) in [
            ("noise", &curve.noise),
            ("relative_noise", &curve.relative_noise),
        ] {
            if let Some(noise) = noise.as_ref().filter(|noise| *noise.get_ref() < 0.0) {
                let message = format!("`{key}` is {}, expected 0 or more", noise.get_ref());
                return Err(self.error(noise.span(), message));
            }
        }
        for (key, _, reading) in curve.readings() {
            let Some(given) = reading else { continue };
            let ReadingInput { min, max, start } = *given.get_ref();
            let is_scale = key.starts_with("scale");
            let message = if test.predict {
                format!("`{key}`: nothing is looked for in a test with `predict = true`")
            } else if !(min.is_finite() && max.is_finite() && min < max) {
                format!("`{key}`: `min` is {min}, expected a number below `max`, {max}")
            } else if is_scale && min <= 0.0 {
                format!("`{key}`: `min` is {min}, expected a number above 0")
            } else if let Some(start) = start.filter(|start| !(min..=max).contains(start)) {
                format!("`{key}`: `start` is {start}, expected {min} to {max}")
            } else {
                continue;
            };
            return Err(self.error(given.span(), message));
        }
        if let (Some(phase), Some(_)) = (&curve.phase, &test.driver) {
            let message = "a driver has no phases; `segment` chooses a part of its path";
            return Err(self.error(phase.span(), message));
        }
        if let (Some(segment), Some(_)) = (&curve.segment, &test.case) {
            let message = "a case has no segments; `phase` chooses a part of it";
            return Err(self.error(segment.span(), message));
        }
        Ok(())
    }

    /// Names in a stage.
    fn check_stage(&self, stage: &StageInput) -> Result<(), Error> {
        let file = &self.file;
        let free: Vec<&str> = file.free.keys().map(|key| key.get_ref().as_str()).collect();
        let tests = file.test.iter().map(|test| test.name.get_ref().as_str());
        let unknown = |kind: &str, name: &Spanned<String>, known: &[&str]| {
            Error::from(self.source.unknown(kind, name, known.iter().copied()))
        };
        if stage.free.is_empty() {
            let message = format!("stage `{}` has no free parameter", stage.name.get_ref());
            return Err(self.error(stage.name.span(), message));
        }
        for name in &stage.free {
            if !free.contains(&name.get_ref().as_str()) {
                return Err(unknown("free parameter", name, &free));
            }
        }
        for name in &stage.tests {
            let mut all = file.test.iter();
            match all.find(|test| test.name.get_ref() == name.get_ref()) {
                None => return Err(unknown("test", name, &tests.collect::<Vec<_>>())),
                Some(test) if test.predict => {
                    let message = format!("test `{}` is predicted, not fitted", name.get_ref());
                    return Err(self.error(name.span(), message));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn check_stages(&self) -> Result<(), Error> {
        let file = &self.file;
        for stage in &file.stage {
            self.check_stage(stage)?;
        }
        if file.stage.is_empty() {
            return Ok(());
        }
        let is_fitted = |name: &Spanned<String>| {
            let mut all = file.stage.iter().flat_map(|stage| &stage.free);
            all.any(|other| other.get_ref() == name.get_ref())
        };
        let is_read = |test: &&TestInput| {
            let mut readings = test.curve.iter().flat_map(CurveInput::readings);
            readings.any(|(.., reading)| reading.is_some())
        };
        let has_stage = |test: &TestInput| {
            let name = test.name.get_ref();
            let takes = |stage: &StageInput| {
                stage.tests.is_empty() || stage.tests.iter().any(|other| other.get_ref() == name)
            };
            file.stage.iter().any(takes)
        };
        if let Some(test) = file
            .test
            .iter()
            .filter(is_read)
            .find(|test| !has_stage(test))
        {
            let name = test.name.get_ref();
            let message =
                format!("test `{name}` is in no stage, which would look for its offset or scale");
            return Err(self.error(test.name.span(), message));
        }
        match file.free.keys().find(|name| !is_fitted(name)) {
            None => Ok(()),
            Some(name) => {
                let message = format!("`{}` is in no stage", name.get_ref());
                Err(self.error(name.span(), message))
            }
        }
    }
}
