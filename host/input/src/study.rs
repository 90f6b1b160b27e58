//! The study file: which keys of a case vary, how, and what of the results counts.

mod parameters;

use self::parameters::{check_counts, check_keys, parameter};
use crate::spanned::Given;
use crate::{Case, Error, file_in, name_of, schema};
use law::Opener;
use results::study::{Output, Take};
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::{Named, Source, Spanned};
use toml::Value;

/// Most runs of a study: their folders have five digits.
pub const MOST_RUNS: usize = 99_999;
/// Columns that the table of runs has itself.
const COLUMNS: [&str; 4] = ["index", "folder", "state", "reason"];

/// A study file and its text.
#[derive(Clone, Debug)]
pub struct Study {
    /// Text and path, for messages.
    pub source: Source,
    /// Contents.
    pub file: StudyFile,
    /// What varies.
    pub parameters: Vec<Parameter>,
}

/// The keys of a study file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Title.
    #[serde(default)]
    pub title: String,
    /// A case file, or a folder with `case.toml`, relative to this file.
    pub case: Spanned<PathBuf>,
    /// Variant of the case.
    pub variant: Option<Spanned<String>>,
    /// How values are chosen.
    pub method: Method,
    /// Runs of `latin_hypercube` and `sobol`; base points of `saltelli`: k + 2 runs each for k
    /// parameters.
    #[schemars(extend("minimum" = 1))]
    pub runs: Option<Spanned<usize>>,
    /// Seed of random numbers; default 0. The same seed gives the same runs.
    pub seed: Option<Spanned<u64>>,
    /// Each run has a report and figures; they can be written later, too.
    #[serde(default)]
    pub reports: bool,
    /// Parameters that vary.
    #[serde(rename = "parameter")]
    pub parameters: Vec<Spanned<ParameterInput>>,
    /// Results that count, by name; default: last values of all probes.
    #[serde(default)]
    pub outputs: Named<OutputInput>,
}

/// How the values of the runs are chosen.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// All combinations of values; the last parameter varies fastest.
    Grid,
    /// First values of all parameters, then second values, and so on.
    List,
    /// Random points: each parameter has one value in each of n equally probable parts, for n runs.
    LatinHypercube,
    /// Points of Sobol', evenly spread, with a random digital shift; best are 2, 4, 8, … runs.
    Sobol,
    /// Sensitivity indices: two samples of such points and, for each parameter, the first sample with
    /// its values from the second. Best are 2, 4, 8, … base points.
    Saltelli,
}

impl Method {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::List => "list",
            Self::LatinHypercube => "latin_hypercube",
            Self::Sobol => "sobol",
            Self::Saltelli => "saltelli",
        }
    }

    /// Whether it chooses this many points as it is asked for.
    fn is_sampled(self) -> bool {
        matches!(self, Self::LatinHypercube | Self::Sobol | Self::Saltelli)
    }
}

/// One key, or several that have the same value, and what values there are.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParameterInput {
    /// Name in tables and figures; default: the key.
    pub name: Option<Spanned<String>>,
    /// Dotted path in the case file, as of `--set`; or several with the same value.
    pub key: Spanned<Keys>,
    /// These values.
    #[schemars(with = "Option<Vec<schema::AnyValue>>")]
    pub values: Option<Spanned<Vec<Spanned<Value>>>>,
    /// Between these two, uniform.
    pub uniform: Option<Spanned<[f64; 2]>>,
    /// Between these two, uniform in the logarithm.
    pub log_uniform: Option<Spanned<[f64; 2]>>,
    /// Normal distribution between two bounds.
    pub normal: Option<Spanned<NormalInput>>,
    /// In a `grid`: number of values, equally probable parts apart, with both ends.
    #[schemars(extend("minimum" = 1))]
    pub levels: Option<Spanned<usize>>,
    /// Whole numbers only.
    #[serde(default)]
    pub whole: bool,
}

/// One key or several.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a key such as \"laws.sand.parameters.cohesion\", or a list of keys"
)]
pub enum Keys {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

/// A normal distribution, cut off at both ends.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalInput {
    /// Mean before the cut.
    pub mean: f64,
    /// Standard deviation before the cut.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub deviation: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// A number of each run.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputInput {
    /// Probe, or another column of `history.csv`.
    pub probe: Spanned<String>,
    /// Which value; default `final`.
    pub take: Option<Spanned<Take>>,
    /// Its value where another probe first reaches a value, linear between increments.
    pub at: Option<AtInput>,
    /// Only in this phase.
    pub phase: Option<Spanned<String>>,
}

/// Place where a probe has a value.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AtInput {
    /// That probe.
    pub probe: Spanned<String>,
    /// That value.
    pub value: f64,
}

/// What varies.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// What tables call it.
    pub name: String,
    /// The keys that have its value.
    pub keys: Vec<String>,
    /// Its values.
    pub spread: Spread,
    /// Whole numbers only.
    pub whole: bool,
    /// In a grid: values of a distribution.
    pub levels: Option<usize>,
    /// Place of the key in the file.
    key: Range<usize>,
    /// Place of the values.
    values: Vec<Range<usize>>,
}

/// Values, or a distribution of numbers.
#[derive(Clone, Debug)]
pub enum Spread {
    /// These.
    Values(Vec<Value>),
    /// Equally probable.
    Uniform([f64; 2]),
    /// Their logarithms equally probable.
    LogUniform([f64; 2]),
    /// Normal within bounds.
    Normal(NormalInput),
}

impl Spread {
    /// Smallest and largest number of a distribution.
    pub fn ends(&self) -> Option<[f64; 2]> {
        match self {
            Self::Values(_) => None,
            Self::Uniform(ends) | Self::LogUniform(ends) => Some(*ends),
            Self::Normal(normal) => Some([normal.min, normal.max]),
        }
    }
}

impl Study {
    /// Reads a study file, or `study.toml` in a folder.
    ///
    /// # Errors
    /// [`text::Error::Unreadable`], or [`text::Error::Input`] at the place that does not fit.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::of(Source::read(&file_in(path, "study"))?)
    }

    /// Takes the text of a study file.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit.
    pub fn of(source: Source) -> Result<Self, Error> {
        let file: StudyFile = text::parse(&source)?;
        check_counts(&source, &file)?;
        let mut parameters: Vec<Parameter> = Vec::new();
        for input in &file.parameters {
            let parameter = parameter(&source, file.method, input)?;
            let mut others = parameters.iter();
            if let Some(other) = others.find(|other| other.name == parameter.name) {
                let message = format!("two parameters are called `{}`", other.name);
                let span = input.get_ref().name.as_ref().map(Spanned::span);
                let span = span.unwrap_or(parameter.key.clone());
                let error = source.error(span, message);
                return Err(error.hint("`name` gives it another one").into());
            }
            let earlier = parameters.iter().flat_map(|other| &other.keys);
            let earlier: Vec<&str> = earlier.map(String::as_str).collect();
            check_keys(&source, &parameter, &earlier)?;
            parameters.push(parameter);
        }
        let study = Self {
            source,
            file,
            parameters,
        };
        study.check_list()?;
        Ok(study)
    }

    /// Name of the study: its folder if the file is `study.toml`, else the file's stem.
    pub fn name(&self) -> String {
        name_of(self.source.path(), "study")
    }

    /// Whether the numbers of values of a list are one.
    fn check_list(&self) -> Result<(), Error> {
        let mut counts = self.parameters.iter().map(|p| (p, p.values.len()));
        let Some((first, n)) = counts.next().filter(|_| self.file.method == Method::List) else {
            return Ok(());
        };
        match counts.find(|(_, count)| *count != n) {
            None => Ok(()),
            Some((other, count)) => {
                let span = other.values.first().unwrap_or(&other.key).clone();
                let message = format!(
                    "`{}` has {count} values and `{}` {n}: a list takes the first of all, then the second of \
                     all",
                    other.name, first.name
                );
                Err(self.source.error(span, message).into())
            }
        }
    }

    /// Path of the case file or folder.
    pub fn case_path(&self) -> PathBuf {
        let folder = self.source.path().parent().unwrap_or(Path::new("."));
        folder.join(self.file.case.get_ref())
    }

    /// The settings of a run that has these values of the parameters.
    pub fn settings(&self, values: &[Value]) -> Vec<String> {
        let with_values = self.parameters.iter().zip(values);
        let settings = with_values.flat_map(|(parameter, value)| {
            let keys = parameter.keys.iter();
            keys.map(move |key| format!("{key}={}", written(value)))
        });
        settings.collect()
    }

    /// The case with these values of the parameters.
    ///
    /// # Errors
    /// As [`Case::load_with`], what is wrong with a value or key at its place in the study file.
    pub fn case(&self, opener: &Opener, values: &[Value]) -> Result<Case, Error> {
        let settings = self.settings(values);
        let cases = Case::load_with(&self.case_path(), &settings);
        let cases = cases.map_err(|error| match error {
            Error::Text(text::Error::Unreadable { path, source }) => {
                let message = format!("`case`: cannot read {}: {source}", path.display());
                self.source.error(self.file.case.span(), message).into()
            }
            error => self.placed(error, values),
        })?;
        let variants: Vec<&str> = cases.iter().filter_map(|c| c.variant.as_deref()).collect();
        let wanted = self.file.variant.as_ref();
        let chosen = match wanted {
            None if variants.is_empty() => cases.into_iter().next(),
            None => {
                let message = "the case has variants: `variant` names the one that is studied";
                let error = self.source.error(self.file.case.span(), message);
                let hint = format!("there is: {}", variants.join(", "));
                return Err(error.hint(hint).into());
            }
            Some(name) => {
                let is_wanted = |case: &&Case| case.variant.as_ref() == Some(name.get_ref());
                let found = cases.iter().find(is_wanted).cloned();
                if found.is_none() {
                    return Err(self.source.unknown("variant", name, variants).into());
                }
                found
            }
        };
        let case = chosen.ok_or_else(|| Error::internal("a file without a case"))?;
        Ok(case.opened_by(opener))
    }

    /// The error of a case with these values; where it is in a setting, at the place in the study file
    /// that the setting comes from.
    pub fn placed(&self, error: Error, values: &[Value]) -> Error {
        let input = match error {
            Error::Text(text::Error::Input(input)) => input,
            other => return other,
        };
        let found = input.setting().and_then(|(setting, at)| {
            let with_values = self.parameters.iter().zip(values);
            for (parameter, value) in with_values {
                for key in &parameter.keys {
                    if format!("{key}={}", written(value)) == setting {
                        return Some(parameter.place(value, at > key.len()));
                    }
                }
            }
            None
        });
        match found {
            Some(span) => input.moved_to(&self.source, span).into(),
            None => text::Error::Input(input).into(),
        }
    }

    /// The numbers that count, of runs with these columns and phases.
    ///
    /// # Errors
    /// [`text::Error::Input`] at a name that there is not.
    pub fn outputs(&self, columns: &[&str], phases: &[&str]) -> Result<Vec<Output>, Error> {
        let known = |name: &Spanned<String>, names: &[&str], what: &str| {
            if names.contains(&name.get_ref().as_str()) {
                return Ok(name.get_ref().clone());
            }
            let names = names.iter().copied();
            Err(Error::from(self.source.unknown(what, name, names)))
        };
        let mut outputs = Vec::new();
        for (name, input) in &self.file.outputs {
            let input = input.get_ref();
            let at = match (&input.at, &input.take) {
                (Some(_), Some(take)) => {
                    let message = "`take` and `at` are given: a number is one of both";
                    return Err(self.source.error(take.span(), message).into());
                }
                (Some(at), None) => Some((known(&at.probe, columns, "probe")?, at.value)),
                (None, _) => None,
            };
            let phase = input.phase.as_ref();
            outputs.push(Output {
                name: name.get_ref().clone(),
                probe: known(&input.probe, columns, "probe")?,
                take: input.take.value().unwrap_or_default(),
                at,
                phase: phase
                    .map(|phase| known(phase, phases, "phase"))
                    .transpose()?,
            });
        }
        if outputs.is_empty() {
            outputs.extend(columns.iter().map(|column| Output::last(column)));
        }
        Ok(outputs)
    }
}

impl Parameter {
    /// Place of a value, or of the key.
    fn place(&self, value: &Value, is_value: bool) -> Range<usize> {
        if !is_value {
            return self.key.clone();
        }
        let listed = match &self.spread {
            Spread::Values(values) => values.iter().position(|other| other == value),
            _ => None,
        };
        let place = self.values.get(listed.unwrap_or(0));
        place.unwrap_or(&self.key).clone()
    }
}

/// A value as a setting has it: a text in quotes, a number with all its digits.
fn written(value: &Value) -> String {
    value.to_string()
}
