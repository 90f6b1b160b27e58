//! The study file: which keys of a case vary, how, and what of the results counts.

use crate::{Case, Error, schema};
use law::Opener;
use results::study::{Output, Take};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::{Named, Source, suggestion};
use toml::{Spanned, Value};

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
    #[schemars(with = "PathBuf")]
    pub case: Spanned<PathBuf>,
    /// Variant of the case.
    #[schemars(with = "Option<String>")]
    pub variant: Option<Spanned<String>>,
    /// How values are chosen.
    pub method: Method,
    /// Runs of `latin_hypercube` and `sobol`; base points of `saltelli`: k + 2 runs each for k
    /// parameters.
    #[schemars(with = "Option<usize>", extend("minimum" = 1))]
    pub runs: Option<Spanned<usize>>,
    /// Seed of random numbers; default 0. The same seed gives the same runs.
    #[schemars(with = "Option<u64>")]
    pub seed: Option<Spanned<u64>>,
    /// Each run has a report and figures; they can be written later, too.
    #[serde(default)]
    pub reports: bool,
    /// Parameters that vary.
    #[serde(rename = "parameter")]
    #[schemars(with = "Vec<ParameterInput>")]
    pub parameters: Vec<Spanned<ParameterInput>>,
    /// Results that count, by name; default: last values of all probes.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, OutputInput>")]
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
    #[schemars(with = "Option<String>")]
    pub name: Option<Spanned<String>>,
    /// Dotted path in the case file, as of `--set`; or several with the same value.
    #[schemars(with = "Keys")]
    pub key: Spanned<Keys>,
    /// These values.
    #[schemars(with = "Option<Vec<schema::AnyValue>>")]
    pub values: Option<Spanned<Vec<Spanned<Value>>>>,
    /// Between these two, uniform.
    #[schemars(with = "Option<[f64; 2]>")]
    pub uniform: Option<Spanned<[f64; 2]>>,
    /// Between these two, uniform in the logarithm.
    #[schemars(with = "Option<[f64; 2]>")]
    pub log_uniform: Option<Spanned<[f64; 2]>>,
    /// Normal distribution between two bounds.
    #[schemars(with = "Option<NormalInput>")]
    pub normal: Option<Spanned<NormalInput>>,
    /// In a `grid`: number of values, equally probable parts apart, with both ends.
    #[schemars(with = "Option<usize>", extend("minimum" = 1))]
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
    #[schemars(with = "String")]
    pub probe: Spanned<String>,
    /// Which value; default `final`.
    #[schemars(with = "Option<Take>")]
    pub take: Option<Spanned<Take>>,
    /// Its value where another probe first reaches a value, linear between increments.
    pub at: Option<AtInput>,
    /// Only in this phase.
    #[schemars(with = "Option<String>")]
    pub phase: Option<Spanned<String>>,
}

/// Place where a probe has a value.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AtInput {
    /// That probe.
    #[schemars(with = "String")]
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
        let path = if path.is_dir() {
            path.join("study.toml")
        } else {
            path.to_owned()
        };
        Self::of(Source::read(&path)?)
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
        let path = self.source.path();
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let named = if absolute
            .file_name()
            .is_some_and(|name| name == "study.toml")
        {
            absolute.parent().and_then(Path::file_name)
        } else {
            absolute.file_stem()
        };
        named.map_or_else(
            || "study".to_owned(),
            |name| name.to_string_lossy().into_owned(),
        )
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
                    let message = format!("there is no variant `{}`", name.get_ref());
                    let error = self.source.error(name.span(), message);
                    return Err(error.hint(suggestion(name.get_ref(), variants)).into());
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
            let message = format!("there is no {what} `{}`", name.get_ref());
            let error = self.source.error(name.span(), message);
            Err(Error::from(
                error.hint(suggestion(name.get_ref(), names.iter().copied())),
            ))
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
                take: input
                    .take
                    .as_ref()
                    .map_or(Take::Final, |take| *take.get_ref()),
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

/// Whether two values are one: 1 and 1.0 are.
fn is_equal(a: &Value, b: &Value) -> bool {
    let number = |value: &Value| match value {
        Value::Integer(number) => Some(*number as f64),
        Value::Float(number) => Some(*number),
        _ => None,
    };
    match (number(a), number(b)) {
        (Some(a), Some(b)) => a.total_cmp(&b).is_eq(),
        _ => a == b,
    }
}

/// Whether the keys of a parameter differ from those of earlier ones.
fn check_keys(source: &Source, parameter: &Parameter, earlier: &[&str]) -> Result<(), Error> {
    let of =
        |key: &str| -> Vec<String> { key.split('.').map(|part| part.trim().to_owned()).collect() };
    for (number, key) in parameter.keys.iter().enumerate() {
        let own = parameter.keys[..number].iter().map(String::as_str);
        for other in own.chain(earlier.iter().copied()) {
            let (a, b) = (of(key), of(other));
            let message = if a == b {
                format!("`{key}` is the key of two parameters, or twice that of one")
            } else if a.starts_with(&b) {
                format!(
                    "`{key}` is a part of `{other}`, which varies as well: one would undo the other"
                )
            } else if b.starts_with(&a) {
                format!(
                    "`{other}` is a part of `{key}`, and varies as well: one would undo the other"
                )
            } else {
                continue;
            };
            return Err(source.error(parameter.key.clone(), message).into());
        }
    }
    Ok(())
}

/// A value as a setting has it: a text in quotes, a number with all its digits.
fn written(value: &Value) -> String {
    value.to_string()
}

/// How many runs there are, and what chance has to do with it.
fn check_counts(source: &Source, file: &StudyFile) -> Result<(), Error> {
    let method = file.method.name();
    let wrong = |span, message: String| Err(source.error(span, message).into());
    if file.parameters.is_empty() {
        let message = "a study needs a [[parameter]] that varies".to_owned();
        return wrong(0..0, message);
    }
    match &file.runs {
        Some(runs) if !file.method.is_sampled() => {
            let message = format!("`runs`: the values say how many runs a {method} has");
            return wrong(runs.span(), message);
        }
        Some(runs) if !(1..=MOST_RUNS).contains(runs.get_ref()) => {
            let message = format!("`runs`: {}, expected 1 to {MOST_RUNS}", runs.get_ref());
            return wrong(runs.span(), message);
        }
        Some(runs)
            if file.method == Method::Saltelli
                && runs.get_ref() * (file.parameters.len() + 2) > MOST_RUNS =>
        {
            let message = format!(
                "`runs`: {} base points of {} runs each, at most {MOST_RUNS} runs are possible",
                runs.get_ref(),
                file.parameters.len() + 2
            );
            return wrong(runs.span(), message);
        }
        None if file.method.is_sampled() => {
            let message = format!("missing key `runs`: how many points `{method}` has");
            return wrong(0..0, message);
        }
        _ => {}
    }
    match &file.seed {
        Some(seed) if !file.method.is_sampled() => {
            let message = format!("`seed`: nothing is random in a {method}");
            wrong(seed.span(), message)
        }
        _ => Ok(()),
    }
}

/// Definition of the values: its key, its place, the values.
type Given = (&'static str, Range<usize>, Spread);

/// All of them that are given.
fn spreads(source: &Source, input: &ParameterInput) -> Result<Vec<Given>, Error> {
    let wrong = |span: Range<usize>, message: String| Err(source.error(span, message).into());
    let mut spreads: Vec<Given> = Vec::new();
    if let Some(listed) = &input.values {
        if listed.get_ref().is_empty() {
            return wrong(listed.span(), "`values`: there is none".to_owned());
        }
        let listed_values = listed.get_ref().iter().map(|value| value.get_ref().clone());
        spreads.push((
            "values",
            listed.span(),
            Spread::Values(listed_values.collect()),
        ));
    }
    if let Some(range) = &input.uniform {
        let &[from, to] = range.get_ref();
        if from >= to {
            let message = format!("`uniform`: {from} is not below {to}");
            return wrong(range.span(), message);
        }
        spreads.push(("uniform", range.span(), Spread::Uniform([from, to])));
    }
    if let Some(range) = &input.log_uniform {
        let &[from, to] = range.get_ref();
        if from >= to || from <= 0.0 {
            let message = format!(
                "`log_uniform`: expected two numbers above 0, the smaller one first, found {from} and {to}"
            );
            return wrong(range.span(), message);
        }
        spreads.push(("log_uniform", range.span(), Spread::LogUniform([from, to])));
    }
    if let Some(normal) = &input.normal {
        let of = *normal.get_ref();
        if of.deviation <= 0.0 || of.min >= of.max {
            let message = "`normal`: expected a `deviation` above 0, and `min` below `max`";
            return wrong(normal.span(), message.to_owned());
        }
        spreads.push(("normal", normal.span(), Spread::Normal(of)));
    }
    Ok(spreads)
}

/// Whether there are values at all, and in a grid each once; `places` is where they stand.
fn check_values(
    source: &Source,
    (method, is_whole): (Method, bool),
    spread: &Spread,
    places: &[Range<usize>],
) -> Result<(), Error> {
    let wrong =
        |number: usize, message: String| Err(source.error(places[number].clone(), message).into());
    if is_whole
        && let Some([from, to]) = spread.ends()
        && from.ceil() > to.floor()
    {
        let message = format!("`whole`: there is no whole number from {from} to {to}");
        return wrong(0, message);
    }
    if method == Method::Grid
        && let Spread::Values(listed) = spread
    {
        let equal =
            (1..listed.len()).find(|&i| listed[..i].iter().any(|v| is_equal(v, &listed[i])));
        if let Some(i) = equal {
            let message = format!(
                "`values`: {} is there twice: a grid would repeat its runs",
                listed[i]
            );
            return wrong(i, message);
        }
    }
    Ok(())
}

fn parameter(
    source: &Source,
    method: Method,
    input: &Spanned<ParameterInput>,
) -> Result<Parameter, Error> {
    let span = input.span();
    let input = input.get_ref();
    let wrong = |span: Range<usize>, message: String| Err(source.error(span, message).into());
    let key = input.key.span();
    let keys = match input.key.get_ref() {
        Keys::One(key) => vec![key.trim().to_owned()],
        Keys::Several(keys) => keys.iter().map(|key| key.trim().to_owned()).collect(),
    };
    let Some(first) = keys
        .first()
        .filter(|_| keys.iter().all(|key| !key.is_empty()))
    else {
        return wrong(
            key,
            "`key`: expected the dotted path of a key of the case".to_owned(),
        );
    };
    let name = input.name.as_ref().map_or(first, Spanned::get_ref).clone();
    if name.is_empty() || COLUMNS.contains(&name.as_str()) {
        let span = input.name.as_ref().map_or(key, Spanned::span);
        let message = format!(
            "`{name}` is no name for a parameter: the table of runs has a column of this name"
        );
        return wrong(span, message);
    }
    let mut spreads = spreads(source, input)?;
    let mut values: Vec<Range<usize>> = Vec::new();
    if let Some(listed) = &input.values {
        values = listed.get_ref().iter().map(Spanned::span).collect();
    }
    if spreads.len() > 1 {
        let names: Vec<String> = spreads
            .iter()
            .map(|(name, ..)| format!("`{name}`"))
            .collect();
        let message = format!(
            "{} are given: a parameter has one of them",
            names.join(" and ")
        );
        return wrong(spreads[1].1.clone(), message);
    }
    let Some((called, place, spread)) = spreads.pop() else {
        let message = format!(
            "`{name}` has no values: expected `values`, `uniform`, `log_uniform` or `normal`"
        );
        let end = span.start + source.text()[span.clone()].find('\n').unwrap_or(span.len());
        return wrong(span.start..end, message);
    };
    let is_listed = matches!(spread, Spread::Values(_));
    if values.is_empty() {
        values = vec![place.clone()];
    }
    if method == Method::List && !is_listed {
        return wrong(place, format!("`{called}`: a list takes `values`"));
    }
    match &input.levels {
        Some(levels) if method != Method::Grid || is_listed => {
            let message = "`levels` is for distributions in a grid".to_owned();
            return wrong(levels.span(), message);
        }
        Some(levels) if !(1..=MOST_RUNS).contains(levels.get_ref()) => {
            let message = format!("`levels`: {}, expected 1 to {MOST_RUNS}", levels.get_ref());
            return wrong(levels.span(), message);
        }
        None if method == Method::Grid && !is_listed => {
            let message =
                format!("`{called}`: a grid needs `levels`, how many values of it there are");
            return wrong(place, message);
        }
        _ => {}
    }
    if input.whole && is_listed {
        return wrong(
            place,
            "`whole` is for distributions: these are the values".to_owned(),
        );
    }
    check_values(source, (method, input.whole), &spread, &values)?;
    Ok(Parameter {
        name,
        keys,
        spread,
        whole: input.whole,
        levels: input.levels.as_ref().map(|levels| *levels.get_ref()),
        key,
        values,
    })
}
