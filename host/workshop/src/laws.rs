//! What `pilum laws` prints: the laws found, and a page about one of them, as text or as JSON.

use crate::Error;
use abi::Hypothesis;
use law::foreign::{self, Foreign};
use law::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, LoadedLaw, Opener, Origin,
    ParameterDescription, SearchPath, Tangent, hypothesis_named,
};
use serde::Serialize;
use std::env::consts::DLL_SUFFIX;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use text::Source;

/// What laws of each route into the program mean by their numbers. The adapters translate; who writes or reads such a
/// routine needs them.
const CONVENTIONS: &str = include_str!("laws/conventions.txt");
/// Longest line of a page.
const WIDTH: usize = 100;

/// A law as `--json` gives it. Bounds that are infinite are null.
#[derive(Debug, Serialize)]
struct Record<'a> {
    #[serde(flatten)]
    description: &'a LawDescription,
    library: &'a Path,
    sha256: &'a str,
}

impl<'a> Record<'a> {
    fn new(law: &'a LoadedLaw) -> Self {
        Self {
            description: law.description(),
            library: law.library().path(),
            sha256: law.library().sha256(),
        }
    }
}

fn json(value: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(value)
        .map(|text| text + "\n")
        .map_err(|error| Error::internal(error.to_string()))
}

/// One line for every law found, and the conventions of every route by which laws come in; a
/// library that claims a law and cannot be used is reported to be so.
pub fn list(search: &SearchPath) -> String {
    let mut text = String::new();
    for (library, read) in sidecars(search) {
        let _ = match read {
            Ok(law) => {
                let hypotheses = law.hypotheses();
                writeln!(
                    text,
                    "{:24}  {:48}  {hypotheses}, UMAT {}",
                    law.id,
                    law.name,
                    library.display()
                )
            }
            Err(error) => writeln!(text, "{:24}  cannot be used: {error}", library.display()),
        };
    }
    for (id, library) in search.installed() {
        let line = match search.law(&id) {
            Ok(law) => {
                let description = law.description();
                format!("{:48}  {}", description.name, description.hypotheses())
            }
            Err(error) => format!("cannot be used, {}: {error}", library.display()),
        };
        let _ = writeln!(text, "{id:24}  {line}");
    }
    if text.is_empty() {
        text.push_str("no law library in:\n");
        for place in search.places() {
            let _ = writeln!(text, "  {}", place.folder.display());
        }
    }
    text.push('\n');
    text.push_str(CONVENTIONS);
    text
}

/// A folder that laws are looked for in, as `--json` gives it.
#[derive(Debug, Serialize)]
struct PlaceRecord<'a> {
    folder: &'a Path,
    why: &'static str,
    exists: bool,
    laws: Vec<String>,
}

fn folders(search: &SearchPath) -> impl Iterator<Item = (Origin, PlaceRecord<'_>)> {
    let found = search.libraries().into_iter();
    found.map(|(place, libraries)| {
        let folder = PlaceRecord {
            folder: &place.folder,
            why: place.origin.words(),
            exists: place.folder.is_dir(),
            laws: libraries.into_iter().flat_map(|(_, laws)| laws).collect(),
        };
        (place.origin, folder)
    })
}

/// The folders that laws are looked for in, in order: each with why, and the laws that it has.
pub fn places(search: &SearchPath) -> String {
    let mut text = "Laws are looked for in these folders, in this order:\n".to_owned();
    for (origin, found) in folders(search) {
        let laws = match origin {
            _ if !found.exists => "there is no such folder".to_owned(),
            _ if !found.laws.is_empty() => found.laws.join(" "),
            Origin::Parts => "nothing that is not above".to_owned(),
            _ => "no law".to_owned(),
        };
        let (folder, why) = (found.folder.display(), found.why);
        let _ = writeln!(text, "\n{folder}\n  {why}: {laws}");
    }
    text.push_str(
        "\nMore folders: `law_path` in a case or driver file and --law-path here, which come first, and \
         PILUM_LAW_PATH.\nThe folder that one works in is not looked in.\n",
    );
    text
}

/// The same, as a JSON array.
///
/// # Errors
/// [`text::Error::Internal`] only.
pub fn places_json(search: &SearchPath) -> Result<String, Error> {
    let folders = folders(search).map(|(_, folder)| folder);
    json(&folders.collect::<Vec<_>>())
}

/// User subroutines of Abaqus in the folders of a search that have a sidecar. Nothing of them runs.
fn sidecars(search: &SearchPath) -> Vec<(PathBuf, Result<LawDescription, law::Error>)> {
    let mut found = Vec::new();
    for place in search.places() {
        let entries = std::fs::read_dir(&place.folder)
            .into_iter()
            .flatten()
            .flatten();
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        paths.sort();
        for path in paths {
            if path.to_string_lossy().ends_with(DLL_SUFFIX)
                && let Some(sidecar) = foreign::sidecar_of(&path)
            {
                let read = Source::read(&sidecar).map_err(law::Error::from);
                found.push((path, read.and_then(|source| foreign::sidecar(&source))));
            }
        }
    }
    found
}

/// The law of a name: an id, or the path of a user subroutine of Abaqus.
///
/// # Errors
/// It is missing, or it cannot be used.
pub fn find(search: &SearchPath, opener: &Opener, name: &str) -> Result<LoadedLaw, Error> {
    let path = Path::new(name);
    let umat = if path.components().count() > 1 || name.ends_with(DLL_SUFFIX) {
        if !law::inspect::inspect(path)?.is_umat() {
            let message =
                format!("{name} is no UMAT; of other libraries, `laws` takes the id of a law");
            return Err(Error::usage(message));
        }
        Some(path.to_owned())
    } else {
        let is_it =
            |law: &Result<LawDescription, law::Error>| law.as_ref().is_ok_and(|law| law.id == name);
        let mut all = sidecars(search).into_iter();
        all.find(|(_, law)| is_it(law)).map(|(library, _)| library)
    };
    let Some(library) = umat else {
        return Ok(search.law(name)?);
    };
    let library = opener.open_foreign(&Foreign::umat(&library), |_| Ok(()))?;
    let mut laws = library.laws().map(|law| law.id.clone());
    let law = laws.next().and_then(|id| library.law(&id));
    law.ok_or_else(|| Error::internal("a UMAT without a law".to_owned()))
}

/// Everything about every law found, as a JSON array.
///
/// # Errors
/// A library that claims a law cannot be used.
pub fn list_json(search: &SearchPath) -> Result<String, Error> {
    let laws = search
        .installed()
        .keys()
        .map(|id| search.law(id))
        .collect::<Result<Vec<_>, _>>()?;
    json(&laws.iter().map(Record::new).collect::<Vec<_>>())
}

/// Everything about a law, as a JSON object.
///
/// # Errors
/// [`text::Error::Internal`] only.
pub fn page_json(law: &LoadedLaw) -> Result<String, Error> {
    json(&Record::new(law))
}

/// Everything a user needs to know of a law.
pub fn page(law: &LoadedLaw) -> String {
    let description = law.description();
    let mut text = format!("{}: {}\n\n", description.id, description.name);
    if !description.doc.is_empty() {
        wrap(&mut text, "", &description.doc);
    }
    let facts = [
        ("references", &description.references),
        ("version", &description.version),
        ("authors", &description.author),
        ("licence", &description.licence),
        ("library", &law.library().path().display().to_string()),
        ("sha256", &law.library().sha256().to_owned()),
    ];
    text.push('\n');
    for (name, value) in facts {
        let _ = writeln!(text, "{name:12}{value}");
    }

    text.push_str("\nHypotheses\n");
    for formulation in &description.formulations {
        formulation_line(&mut text, formulation);
    }

    text.push_str("\nParameters\n");
    if description.parameters.is_empty() {
        text.push_str("  none\n");
    }
    for parameter in &description.parameters {
        parameter_lines(&mut text, parameter);
    }

    internal_variables(&mut text, &description.formulations);
    text.push_str("\nIn a case file\n");
    example(&mut text, law);
    text.push_str(
        "\nUnits kN, m, kPa; angles in degrees. Tension and opening are positive, shear strains are \
         γ = 2ε,\nthe jump is that of the plus side less that of the minus side, normal first.\n",
    );
    text
}

fn formulation_line(text: &mut String, formulation: &FormulationDescription) {
    let hypothesis = hypothesis_named(formulation.hypothesis);
    let components = hypothesis.map_or(String::new(), |h| h.components().join(" "));
    let pair = if hypothesis.is_some_and(Hypothesis::is_interface) {
        "jump (m) to traction (kPa)"
    } else {
        "strain to stress (kPa)"
    };
    let symmetric = if formulation.symmetric {
        "symmetric"
    } else {
        "unsymmetric"
    };
    let linear = if formulation.linear { ", linear" } else { "" };
    let tangent = match formulation.tangent {
        Tangent::Consistent => format!("tangent {symmetric}{linear}"),
        Tangent::Approximate => format!("tangent {symmetric}, approximate"),
        Tangent::None => "no tangent but the elastic operator".to_owned(),
    };
    let time = if formulation.time_dependent {
        "; depends on the time"
    } else {
        ""
    };
    let rates = if formulation.rates { "; rates" } else { "" };
    let axes = if formulation.local_axes {
        "; axes of the layer: 1 along it, 2 across it"
    } else {
        ""
    };
    let _ = writeln!(
        text,
        "  {:14}{pair}, components {components}; {tangent}{time}{rates}{axes}",
        formulation.hypothesis
    );
}

fn parameter_lines(text: &mut String, p: &ParameterDescription) {
    let default = match (default_of(p), p.optional) {
        (Some(default), _) => format!("default {default}"),
        (None, true) => "may be left out".to_owned(),
        (None, false) => "required".to_owned(),
    };
    let _ = writeln!(
        text,
        "  {:21} {:9} {:11} {default}; {}",
        p.id,
        p.symbol,
        p.unit,
        range(p)
    );
    wrap(text, "      ", &p.doc);
}

/// The default as a file would say it.
fn default_of(p: &ParameterDescription) -> Option<String> {
    let value = p.default?;
    Some(match p.choices.get(value as usize) {
        Some(label) => format!("\"{label}\""),
        None => number(value),
    })
}

/// Admissible and usual values.
fn range(p: &ParameterDescription) -> String {
    if !p.choices.is_empty() {
        return format!("one of \"{}\"", p.choices.join("\", \""));
    }
    let mut text = interval(p.bounds);
    if p.usual.lower > f64::NEG_INFINITY || p.usual.upper < f64::INFINITY {
        let _ = write!(text, ", usually {}", interval(p.usual));
    }
    text
}

/// An interval in words: `> 0`, `0 to 90`, `from 0 to below 90`.
fn interval(bounds: Bounds) -> String {
    let Bounds {
        lower,
        open_lower,
        upper,
        open_upper,
    } = bounds;
    let (least, most) = (number(lower), number(upper));
    let from = if open_lower { ">" } else { "≥" };
    let to = if open_upper { "<" } else { "≤" };
    match (lower > f64::NEG_INFINITY, upper < f64::INFINITY) {
        (false, false) => "any number".to_owned(),
        (true, false) => format!("{from} {least}"),
        (false, true) => format!("{to} {most}"),
        (true, true) if open_lower || open_upper => format!("{from} {least} and {to} {most}"),
        (true, true) => format!("{least} to {most}"),
    }
}

/// A number as short as a file would have it.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Once if all formulations have the same.
fn internal_variables(text: &mut String, formulations: &[FormulationDescription]) {
    let ids = |f: &FormulationDescription| -> Vec<String> {
        f.internal_variables.iter().map(|v| v.id.clone()).collect()
    };
    let alike = formulations
        .windows(2)
        .all(|pair| ids(&pair[0]) == ids(&pair[1]));
    let shown = if alike { 1 } else { formulations.len() };
    for formulation in formulations.iter().take(shown) {
        text.push_str("\nInternal variables");
        if !alike {
            let _ = write!(text, ", {}", formulation.hypothesis);
        }
        text.push('\n');
        if formulation.internal_variables.is_empty() {
            text.push_str("  none\n");
        }
        for variable in &formulation.internal_variables {
            variable_lines(text, variable);
        }
    }
}

fn variable_lines(text: &mut String, v: &InternalVariable) {
    let output_only = if v.output_only { "; output only" } else { "" };
    let _ = writeln!(
        text,
        "  {:21} {:9} {:11} starts at {}{output_only}",
        v.id,
        v.symbol,
        v.unit,
        number(v.initial_value)
    );
    wrap(text, "      ", &v.doc);
}

/// What to write for the law, defaults as comments.
fn example(text: &mut String, law: &LoadedLaw) {
    let description = law.description();
    let id = &description.id;
    let _ = writeln!(text, "  [laws.NAME]\n  law = \"{id}\"");
    if let Some(foreign) = law.library().foreign() {
        let adapter = foreign.adapter.name();
        let library = toml::Value::from(foreign.library.to_string_lossy().as_ref());
        let _ = writeln!(text, "  adapter = \"{adapter}\"\n  library = {library}");
    }
    if !description.parameters.is_empty() {
        text.push_str("  [laws.NAME.parameters]\n");
    }
    for p in &description.parameters {
        let unit = if p.unit == "-" {
            String::new()
        } else {
            format!("{}, ", p.unit)
        };
        let given = match default_of(p) {
            Some(default) => format!("# {} = {default}", p.id),
            None if p.optional => format!("# {} =", p.id),
            None => format!("{} = ", p.id),
        };
        let _ = writeln!(text, "  {given:40}# {unit}{}", range(p));
    }
}

/// Appends a text in lines of at most [`WIDTH`] characters.
fn wrap(text: &mut String, indent: &str, words: &str) {
    let mut length = 0;
    for word in words.split_whitespace() {
        let n = word.chars().count();
        if length > 0 && length + 1 + n > WIDTH {
            text.push('\n');
            length = 0;
        }
        if length == 0 {
            text.push_str(indent);
            length = indent.len();
        } else {
            text.push(' ');
            length += 1;
        }
        text.push_str(word);
        length += n;
    }
    text.push('\n');
}
