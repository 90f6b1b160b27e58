//! The page: tables by the template, everything that is drawn as JSON for the script.

use super::budget::MANY;
use super::comparison::{final_values, settings, subject, varied};
use super::fields::Fields;
use super::log::Log;
use super::model::Model;
use super::number_format::display;
use super::pile::Pile;
use super::profile::Profile;
use super::results::{Ending, History, Run};
use crate::mesh_error::OfPhase;
use crate::summary_reader::{entries, list, text};
use minijinja::value::Serde;
use minijinja::{Environment, Value as Template, context};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use text::Error;

const TEMPLATE: &str = include_str!("page.html");
/// Looks of a page.
pub const STYLE: &str = include_str!("style.css");
/// The parts of the script, one after the other in one scope.
const SCRIPT: [&str; 8] = [
    include_str!("script/basics.js"),
    include_str!("script/chart.js"),
    include_str!("script/curves.js"),
    include_str!("script/pile.js"),
    include_str!("script/profiles.js"),
    include_str!("script/contours.js"),
    include_str!("script/convergence.js"),
    include_str!("script/selftest.js"),
];
/// A page that reloads itself.
const RUNNING: &str = include_str!("running.html");
const UPLOT: &str = include_str!("vendor/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("vendor/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("vendor/LICENSE-uPlot");
/// Number of lines shown of the notes of many runs.
const MOST_NOTES: usize = 50;
/// So many runs are named next to a note.
const NAMED: usize = 4;
/// Larger pictures are not copied into the page, in bytes.
const LARGEST_PICTURE: usize = 200_000;
/// Files of a run that the page links to.
const FILES: [(&str, &str); 7] = [
    ("history.csv", "every increment, every probe"),
    ("profile.csv", "values along interfaces"),
    ("pile.csv", "forces, friction and settlement along the pile"),
    ("points.csv", "values at integration points"),
    ("fields.pvd", "fields, for programs that read VTK files"),
    ("log.jsonl", "every iteration and cut-back"),
    ("summary.json", "versions, settings, costs, final values"),
];

/// What the script draws of a run.
#[derive(Serialize)]
struct Drawn<'a> {
    name: &'a str,
    axisymmetric: bool,
    history: &'a History,
    figures: Value,
    profile: Option<&'a Profile>,
    pile: Option<&'a Pile>,
    resistances: &'a Value,
    fields: Option<&'a Fields>,
    log: &'a Log,
    model: Option<&'a Model>,
    force_tolerance: Option<f64>,
    units: BTreeMap<&'a str, &'a str>,
}

/// The text of the page, for a file in `folder`; of a run that is under way with the present time, in
/// seconds since 1970.
pub(super) fn render(runs: &[Run], folder: &Path, now: Option<u64>) -> Result<String, Error> {
    let internal = |why: String| Error::Internal(format!("report: {why}"));
    let drawn: Vec<Drawn<'_>> = runs.iter().zip(figures(runs)).map(drawn).collect();
    let data = serde_json::to_string(&drawn).map_err(|error| internal(error.to_string()))?;
    let page = page(runs, folder, now, &data).map_err(|error| internal(error.to_string()))?;
    let mut environment = Environment::new();
    environment
        .add_template("report.html", TEMPLATE)
        .and_then(|()| environment.get_template("report.html"))
        .and_then(|template| template.render(page))
        .map_err(|error| internal(format!("{error:#}")))
}

fn page(runs: &[Run], folder: &Path, now: Option<u64>, data: &str) -> serde_json::Result<Template> {
    let is_comparison = runs.len() > 1;
    let is_many = runs.len() > MANY;
    let title = if is_many {
        subject(runs)
    } else if is_comparison {
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        format!("Comparison: {}", names.join(", "))
    } else {
        runs.first().map_or("", Run::title).to_owned()
    };
    let settings = settings(runs);
    let varied = if is_many {
        serde_json::to_string(&varied(&settings))?
    } else {
        String::new()
    };
    // Nothing in the data can end the script element.
    let safe = |json: &str| json.replace('<', "\\u003c");
    Ok(context! {
        title,
        running => now.map(running),
        is_comparison,
        is_many,
        varied => safe(&varied),
        notes => if is_many { common_notes(runs) } else { Vec::new() },
        runs => runs.iter().map(|run| run_context(run, folder, now.is_some())).collect::<Vec<_>>(),
        final_values => Template::from(Serde(final_values(runs))),
        n_differing => settings.iter().filter(|setting| setting.differs).count(),
        settings => Template::from(Serde(settings)),
        model => Template::from(Serde(runs.iter().find_map(|run| run.model.as_ref()))),
        has_pile => runs.iter().any(|run| run.pile.is_some()),
        has_profiles => runs.iter().any(|run| run.profile.is_some()),
        has_fields => runs.iter().any(|run| run.fields.is_some()),
        version => env!("CARGO_PKG_VERSION"),
        style => format!("{UPLOT_STYLE}\n{STYLE}"),
        licence => UPLOT_LICENCE,
        uplot => without_first_comment(UPLOT),
        script => SCRIPT.concat(),
        data => safe(data),
    })
}

/// Additional content of a page of a run in progress.
pub(super) fn running(now: u64) -> String {
    RUNNING.replace("NOW", &now.to_string())
}

/// Notes about many runs: every line once, with its runs.
fn common_notes(runs: &[Run]) -> Vec<String> {
    let mut notes: Vec<(String, Vec<&str>)> = Vec::new();
    for run in runs {
        let of_run = run.warnings().into_iter().chain(run.notes.iter().cloned());
        for note in of_run {
            match notes.iter_mut().find(|(known, _)| *known == note) {
                Some((_, names)) => names.push(&run.name),
                None => notes.push((note, vec![&run.name])),
            }
        }
    }
    let left_out = notes.len().saturating_sub(MOST_NOTES);
    let line = |(note, names): &(String, Vec<&str>)| match names.len() {
        n if n == runs.len() => format!("all runs: {note}"),
        n if n > NAMED => format!(
            "{} and {} more: {note}",
            names[..NAMED].join(", "),
            n - NAMED
        ),
        _ => format!("{}: {note}", names.join(", ")),
    };
    let mut lines: Vec<String> = notes.iter().take(MOST_NOTES).map(line).collect();
    if left_out > 0 {
        lines.push(format!(
            "{left_out} more notes are in the runs' own reports"
        ));
    }
    lines
}

/// The figures of every run. Points that were measured for several runs are there once.
fn figures(runs: &[Run]) -> Vec<Value> {
    let mut seen: Vec<(&str, &Value)> = Vec::new();
    let mut all = Vec::new();
    for run in runs {
        let mut figures = run.summary["figures"].clone();
        let own = figures.as_array_mut().into_iter().flatten();
        for (figure, written) in own.zip(list(&run.summary["figures"])) {
            let measured = (text(&written["name"]), &written["measured"]);
            if seen.contains(&measured) {
                figure["measured"] = Value::Null;
            } else {
                seen.push(measured);
            }
        }
        all.push(figures);
    }
    all
}

fn drawn((run, figures): (&Run, Value)) -> Drawn<'_> {
    Drawn {
        name: &run.name,
        axisymmetric: text(&run.summary["analysis"]) == "axisymmetric",
        history: &run.history,
        figures,
        profile: run.profile.as_ref(),
        pile: run.pile.as_ref(),
        resistances: &run.summary["pile"],
        fields: run.fields.as_ref(),
        log: &run.log,
        model: run.model.as_ref(),
        force_tolerance: run.summary["solver"]["force_tolerance"].as_f64(),
        units: run.units(),
    }
}

fn run_context(run: &Run, folder: &Path, is_running: bool) -> Template {
    let summary = &run.summary;
    let (status, failed, reason) = match run.ending() {
        Ending::Unfinished(_) if is_running => ("running".to_owned(), false, String::new()),
        Ending::Done => ("done".to_owned(), false, String::new()),
        Ending::NotRun => ("dry run: nothing computed".to_owned(), false, String::new()),
        Ending::Failed(status, reason) => (status, true, reason),
        Ending::Unfinished(why) => ("unfinished".to_owned(), true, why.to_owned()),
    };
    let last = run
        .history
        .ends
        .last()
        .map(|end| format!("phase {}, increment {}", end.phase, end.increment));
    let files: Vec<(&str, &str, String)> = FILES
        .iter()
        .filter(|(file, _)| run.folder.join(file).is_file())
        .filter_map(|(file, what)| Some((*file, *what, link(folder, &run.folder.join(file))?)))
        .collect();
    context! {
        name => run.name.as_str(),
        title => run.title(),
        status, failed, reason, last, files,
        program => text(&summary["program"]),
        facts => facts(summary),
        notes => run.notes.clone(),
        report => [super::FILE, "history.csv"].iter().find_map(|file| {
            let path = run.folder.join(file);
            path.is_file().then(|| link(folder, &path)).flatten()
        }),
        warnings => run.warnings(),
        ends => ends(run),
        mesh_error => mesh_error(&summary["mesh_error"]),
        pictures => pictures(run),
        resistances => resistances(&summary["pile"]),
        groups => list(&summary["groups"]).map(group).collect::<Vec<_>>(),
        laws => entries(&summary["laws"]).map(law).collect::<Vec<_>>(),
        solver => named_values(&summary["solver"]),
        phases => list(&summary["phases"]).map(phase).collect::<Vec<_>>(),
        seconds => seconds(&summary["seconds"]["total"]),
        seconds_output => seconds(&summary["seconds"]["output"]),
        law_calls => named_values(&summary["law_calls_by_group"]),
        cut_backs => cut_backs(&run.log),
        n_cut_backs => run.log.n_cut_backs,
        case_files => list(&summary["case_files"])
            .map(|file| (text(&file["path"]).to_owned(), text(&file["text"]).to_owned()))
            .collect::<Vec<_>>(),
    }
}

/// What the head of the page says of a run.
fn facts(summary: &Value) -> Vec<String> {
    let mut facts = Vec::new();
    match text(&summary["variant"]) {
        "" => (),
        variant => facts.push(format!("variant {variant}")),
    }
    match text(&summary["analysis"]) {
        "" => (),
        analysis => facts.push(analysis.replace('_', " ")),
    }
    facts.extend(list(&summary["set"]).map(|set| format!("set {}", text(set))));
    let count = |value: &Value, what: &str| value.as_u64().map(|n| format!("{n} {what}"));
    facts.extend(count(&summary["mesh"]["nodes"], "nodes"));
    facts.extend(count(&summary["mesh"]["elements"], "elements"));
    facts.extend(accuracy(&summary["accuracy"]));
    facts.extend(seconds(&summary["seconds"]["total"]).map(|seconds| format!("{seconds} s")));
    match text(&summary["program"]) {
        "" => (),
        program => facts.push(program.to_owned()),
    }
    facts
}

/// Whether an accuracy that was asked for is reached.
fn accuracy(chosen: &Value) -> Option<String> {
    let (asked, verdict) = (chosen["asked"].as_f64()?, text(&chosen["verdict"]));
    let estimated = chosen["reached"].as_f64();
    let estimated = estimated.map(|error| format!(", error {error:.1e} estimated"));
    let estimated = estimated.unwrap_or_default();
    Some(format!("accuracy {asked} {verdict}{estimated}"))
}

/// Pictures in the folder that the page does not draw itself, such as figures of cuts: names and
/// data addresses.
fn pictures(run: &Run) -> Vec<(String, String)> {
    let drawn: Vec<&str> = list(&run.summary["figures"])
        .map(|figure| text(&figure["name"]))
        .collect();
    let Ok(entries) = std::fs::read_dir(&run.folder) else {
        return Vec::new();
    };
    let mut pictures: Vec<(String, String)> = entries
        .flatten()
        .filter_map(|entry| {
            let path = entry.path();
            let name = path.file_stem()?.to_str()?.to_owned();
            if path.extension()? != "svg" || drawn.contains(&name.as_str()) {
                return None;
            }
            let picture = std::fs::read(&path).ok()?;
            let small = picture.len() <= LARGEST_PICTURE;
            small.then(|| (name, format!("data:image/svg+xml,{}", escaped(&picture))))
        })
        .collect();
    pictures.sort();
    pictures
}

/// Names of the phases and, by probe, name, unit and values at their ends.
fn ends(run: &Run) -> Template {
    let units = run.units();
    let history = &run.history;
    let columns = history.names.iter().enumerate();
    let probes: Vec<_> = columns
        .filter(|(_, name)| history.probes().any(|probe| probe == *name))
        .map(|(column, name)| {
            let values: Vec<String> = history
                .ends
                .iter()
                .map(|end| end.values[column].map(display).unwrap_or_default())
                .collect();
            (
                name.clone(),
                units.get(name.as_str()).map(ToString::to_string),
                values,
            )
        })
        .collect();
    let phases: Vec<String> = history
        .ends
        .iter()
        .map(|end| format!("{}, increment {}", end.phase, end.increment))
        .collect();
    context! { phases, probes }
}

/// The error of the mesh at the end of each phase, in words.
fn mesh_error(of_phases: &Value) -> Vec<String> {
    let of_phase = |found: &Value| OfPhase::deserialize(found).ok();
    let found = list(of_phases).filter_map(of_phase);
    found.map(|found| found.words()).collect()
}

/// Criteria of a pile's resistance: name, load or why none exists. Empty without a pile.
fn resistances(pile: &Value) -> Vec<(&'static str, String)> {
    let criteria = [
        (
            "at a settlement of 10 % of the diameter",
            "resistance_10_percent_diameter",
        ),
        ("of it shaft", "shaft_at_10_percent_diameter"),
        ("of it base", "base_at_10_percent_diameter"),
        ("by Davisson", "resistance_davisson"),
        ("by Chin", "resistance_chin"),
    ];
    let criteria = criteria.into_iter().filter_map(|(name, key)| {
        let unit = text(&pile["unit"]);
        let load = pile[key].as_f64().map(|load| format!("{load:.1} {unit}"));
        let why = text(&pile[format!("{key}_reason")]);
        let said = load.or_else(|| (!why.is_empty()).then(|| why.to_owned()))?;
        Some((name, said))
    });
    criteria.collect()
}

fn group(group: &Value) -> Template {
    let swaps: Vec<String> = entries(&group["laws_from_phase"])
        .map(|(phase, law)| format!("{} from phase {phase}", text(law)))
        .collect();
    context! {
        name => text(&group["name"]),
        formulation => text(&group["formulation"]).replace('_', " "),
        elements => group["elements"].as_u64(),
        points => match &group["points_per_element"] {
            Value::String(several) => several.clone(),
            one => one.to_string(),
        },
        law => text(&group["law"]),
        swaps => swaps.join(", "),
    }
}

fn law((name, law): (&str, &Value)) -> Template {
    let number = |value: &Value| value.as_f64().map(display).unwrap_or_default();
    let described = list(&law["described_parameters"]).map(|p| {
        context! {
            id => text(&p["id"]),
            symbol => text(&p["symbol"]),
            unit => text(&p["unit"]),
            value => p["choice"].as_str().map_or_else(|| number(&p["value"]), str::to_owned),
            by_default => p["by_default"].as_bool(),
            bounds => text(&p["bounds"]),
            doc => text(&p["doc"]),
        }
    });
    let mut parameters: Vec<Template> = described.collect();
    if parameters.is_empty() {
        let plain = |(id, value)| context! { id, value => number(value) };
        parameters = entries(&law["parameters"]).map(plain).collect();
    }
    let variables = list(&law["internal_variables"]).map(|v| {
        context! {
            id => text(&v["id"]),
            symbol => text(&v["symbol"]),
            unit => text(&v["unit"]),
            doc => text(&v["doc"]),
        }
    });
    context! {
        name,
        parameters,
        variables => variables.collect::<Vec<_>>(),
        id => text(&law["law"]),
        called => text(&law["name"]),
        doc => text(&law["doc"]),
        references => text(&law["references"]),
        version => text(&law["version"]),
        sha256 => text(&law["sha256"]),
    }
}

/// Names and values of an object.
fn named_values(object: &Value) -> Vec<(String, String)> {
    let value = |value: &Value| match value {
        Value::Number(number) => number.as_f64().map(display).unwrap_or_default(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        other => text(other).to_owned(),
    };
    entries(object)
        .map(|(name, v)| (name.replace('_', " "), value(v)))
        .collect()
}

fn phase(phase: &Value) -> Template {
    let count = |key: &str| phase[key].as_u64();
    context! {
        name => text(&phase["name"]),
        equations => count("equations"),
        increments => count("increments"),
        iterations => count("iterations"),
        cut_backs => count("cut_backs"),
        unreliable => count("unreliable_steps"),
        factorisations => count("factorisations"),
        laws => seconds(&phase["seconds"]["laws_and_forces"]),
        assembly => seconds(&phase["seconds"]["assembly"]),
        solution => seconds(&phase["seconds"]["equations"]),
    }
}

fn seconds(value: &Value) -> Option<String> {
    value.as_f64().map(|seconds| format!("{seconds:.3}"))
}

fn cut_backs(log: &Log) -> Vec<Template> {
    let number = |value: Option<f64>| value.map(display);
    log.first_cut_backs
        .iter()
        .map(|c| {
            context! {
                phase => c.phase.as_str(),
                increment => c.increment,
                load_factor => number(c.load_factor.0),
                next_step => number(c.next_step.0),
                reason => c.reason.as_str(),
            }
        })
        .collect()
}

/// The vendored script without the comment that names its address.
fn without_first_comment(script: &str) -> &str {
    script.split_once("*/").map_or(script, |(_, rest)| rest)
}

/// A file seen from a folder, as an address. `None` if they have nothing in common.
fn link(from: &Path, to: &Path) -> Option<String> {
    let (from, to) = (from.canonicalize().ok()?, to.canonicalize().ok()?);
    let common = from
        .iter()
        .zip(to.iter())
        .take_while(|(a, b)| a == b)
        .count();
    if common == 0 {
        return None;
    }
    let up = from.iter().skip(common).map(|_| "..");
    let path: PathBuf = up
        .map(AsRef::as_ref)
        .chain(to.iter().skip(common))
        .collect();
    let parts: Vec<String> = path
        .iter()
        .map(|part| escaped(part.to_string_lossy().as_bytes()))
        .collect();
    Some(parts.join("/"))
}

/// Bytes as a part of an address.
fn escaped(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, &byte| {
        if byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) {
            text.push(char::from(byte));
        } else {
            let _ = write!(text, "%{byte:02X}");
        }
        text
    })
}
