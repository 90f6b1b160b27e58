//! The page: tables by the template, everything that is drawn as JSON for the script.

use super::budget::MANY;
use super::comparison::{final_values, settings, subject, varied};
use super::fields::Fields;
use super::law::law;
use super::log::Log;
use super::model::Model;
use super::number_format::display;
use super::pile::Pile;
use super::profile::Profile;
use super::results::{Ending, History, Run};
use super::{filled, internal};
use crate::mesh_error::OfPhase;
use crate::summary::{Figure, Head, Resistances, Section, Summary};
use minijinja::value::Serde;
use minijinja::{Value as Template, context};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
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
const FILES: [(&str, &str); 8] = [
    ("history.csv", "every increment, every probe"),
    ("profile.csv", "values along interfaces"),
    ("pile.csv", "forces, friction and settlement along the pile"),
    (
        "cycles.csv",
        "largest and smallest loads of the pile's cycles",
    ),
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
    figures: Vec<Figure>,
    profile: Option<&'a Profile>,
    pile: Option<&'a Pile>,
    resistances: Option<&'a Resistances>,
    section: Option<&'a Section>,
    fields: Option<&'a Fields>,
    log: &'a Log,
    model: Option<&'a Model>,
    force_tolerance: Option<f64>,
    units: BTreeMap<&'a str, &'a str>,
}

/// The medium of a page.
#[derive(Clone, Copy, Debug)]
pub(super) enum For {
    /// A screen.
    Screen,
    /// Paper: no controls, a block with the title, everything open.
    Paper,
    /// A run that is under way, at this time in seconds since 1970.
    Running(u64),
}

/// The text of the page, for a file in `folder`.
pub(super) fn render(runs: &[Run], folder: &Path, kind: For) -> Result<String, Error> {
    let drawn: Vec<Drawn<'_>> = runs.iter().zip(figures(runs)).map(drawn).collect();
    let data = serde_json::to_string(&drawn).map_err(internal)?;
    let page = page(runs, folder, kind, &data).map_err(internal)?;
    filled(TEMPLATE, page)
}

fn page(runs: &[Run], folder: &Path, kind: For, data: &str) -> serde_json::Result<Template> {
    let now = match kind {
        For::Running(now) => Some(now),
        For::Screen | For::Paper => None,
    };
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
        paper => matches!(kind, For::Paper),
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
fn figures(runs: &[Run]) -> Vec<Vec<Figure>> {
    let mut seen = Vec::new();
    let of_run = |run: &Run| {
        let mut figures = run.summary.head.figures.clone();
        for figure in &mut figures {
            let measured = (figure.name.clone(), figure.measured.clone());
            if seen.contains(&measured) {
                figure.measured = None;
            } else {
                seen.push(measured);
            }
        }
        figures
    };
    runs.iter().map(of_run).collect()
}

fn drawn((run, figures): (&Run, Vec<Figure>)) -> Drawn<'_> {
    let Head {
        analysis, solver, ..
    } = &run.summary.head;
    Drawn {
        name: &run.name,
        axisymmetric: analysis == "axisymmetric",
        history: &run.history,
        figures,
        profile: run.profile.as_ref(),
        pile: run.pile.as_ref(),
        resistances: run.summary.pile.as_ref(),
        section: run.summary.head.pile_section.as_ref(),
        fields: run.fields.as_ref(),
        log: &run.log,
        model: run.model.as_ref(),
        force_tolerance: solver.get("force_tolerance").and_then(Value::as_f64),
        units: run.units(),
    }
}

/// How a run ended, whether that is no success, and why.
fn standing(run: &Run, is_running: bool) -> (String, bool, String) {
    match run.ending() {
        Ending::Unfinished(_) if is_running => ("running".to_owned(), false, String::new()),
        Ending::Done => ("done".to_owned(), false, String::new()),
        Ending::NotRun => ("dry run: nothing computed".to_owned(), false, String::new()),
        Ending::Failed(status, reason) => (status, true, reason),
        Ending::Unfinished(why) => ("unfinished".to_owned(), true, why.to_owned()),
    }
}

fn run_context(run: &Run, folder: &Path, is_running: bool) -> Template {
    let Summary {
        head,
        phases,
        seconds: took,
        ..
    } = &run.summary;
    let (status, failed, reason) = standing(run, is_running);
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
        program => head.program.as_str(),
        facts => facts(&run.summary),
        notes => run.notes.clone(),
        report => [super::FILE, "history.csv"].iter().find_map(|file| {
            let path = run.folder.join(file);
            path.is_file().then(|| link(folder, &path)).flatten()
        }),
        warnings => run.warnings(),
        ends => ends(run),
        mesh_error => run.summary.mesh_error.iter().flatten().map(OfPhase::words).collect::<Vec<_>>(),
        pictures => pictures(run),
        resistances => resistances(&run.summary),
        groups => Template::from(Serde(&head.groups)),
        laws => head.laws.iter().map(law).collect::<Vec<_>>(),
        solver => named_values(&head.solver),
        phases => Template::from(Serde(phases)),
        seconds => seconds(took.total),
        seconds_output => seconds(took.output),
        law_calls => Template::from(Serde(&run.summary.law_calls_by_group)),
        cut_backs => cut_backs(&run.log),
        n_cut_backs => run.log.n_cut_backs,
        case_files => Template::from(Serde(&head.case_files)),
    }
}

/// What the head of the page says of a run.
fn facts(summary: &Summary) -> Vec<String> {
    let head = &summary.head;
    let mut facts = Vec::new();
    facts.extend(
        head.variant
            .iter()
            .map(|variant| format!("variant {variant}")),
    );
    if !head.analysis.is_empty() {
        facts.push(head.analysis.replace('_', " "));
    }
    facts.extend(head.set.iter().map(|set| format!("set {set}")));
    facts.extend(head.mesh.nodes.map(|n| format!("{n} nodes")));
    facts.extend(head.mesh.elements.map(|n| format!("{n} elements")));
    facts.extend(head.accuracy.as_ref().and_then(accuracy));
    facts.extend(seconds(summary.seconds.total).map(|seconds| format!("{seconds} s")));
    if !head.program.is_empty() {
        facts.push(head.program.clone());
    }
    facts
}

/// Whether an accuracy that was asked for is reached.
fn accuracy(chosen: &Value) -> Option<String> {
    #[derive(Deserialize)]
    struct Chosen {
        asked: f64,
        verdict: String,
        reached: Option<f64>,
    }
    let Chosen {
        asked,
        verdict,
        reached,
    } = Chosen::deserialize(chosen).ok()?;
    let estimated = reached.map(|error| format!(", error {error:.1e} estimated"));
    let estimated = estimated.unwrap_or_default();
    Some(format!("accuracy {asked} {verdict}{estimated}"))
}

/// Pictures in the folder that the page does not draw itself, such as figures of cuts: names and
/// data addresses.
fn pictures(run: &Run) -> Vec<(String, String)> {
    let drawn = run.summary.head.figures.iter();
    let drawn: Vec<&str> = drawn.map(|figure| figure.name.as_str()).collect();
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

/// A load with what shaft and base have of it, and the phase.
fn load_in_words(
    load: f64,
    unit: &str,
    [shaft, base]: [Option<f64>; 2],
    phase: Option<&str>,
) -> String {
    let split = shaft.zip(base).map_or_else(String::new, |(shaft, base)| {
        format!(", of it shaft {shaft:.1} and base {base:.1}")
    });
    let phase = phase.map_or_else(String::new, |phase| format!(" (phase {phase})"));
    format!("{load:.1} {unit}{split}{phase}")
}

/// Criteria of a pile's resistance: name, load or why none exists; and what the load test left out of balance.
fn resistances(summary: &Summary) -> Vec<(String, String)> {
    let Some(pile) = &summary.pile else {
        return Vec::new();
    };
    let of = pile
        .diameter
        .map_or_else(String::new, |diameter| format!(", D = {diameter:.4} m"));
    let split = |load: Option<f64>, parts: [Option<f64>; 2], phase: &Option<String>| {
        Some(load_in_words(load?, &pile.unit, parts, phase.as_deref()))
    };
    let of_ten_percent = [
        pile.resistance_10_percent_diameter_shaft,
        pile.resistance_10_percent_diameter_base,
    ];
    let of_davisson = [
        pile.resistance_davisson_shaft,
        pile.resistance_davisson_base,
    ];
    let criteria = [
        (
            format!("at a settlement of D/10{of}"),
            split(
                pile.resistance_10_percent_diameter,
                of_ten_percent,
                &pile.resistance_10_percent_diameter_phase,
            ),
            &pile.resistance_10_percent_diameter_reason,
        ),
        (
            format!("by Davisson{of}"),
            split(
                pile.resistance_davisson,
                of_davisson,
                &pile.resistance_davisson_phase,
            ),
            &pile.resistance_davisson_reason,
        ),
        (
            "by Chin".to_owned(),
            split(pile.resistance_chin, [None; 2], &None).map(|load| {
                format!("{load}, extrapolated: an asymptote that no load reached, no design value")
            }),
            &pile.resistance_chin_reason,
        ),
        (
            format!("uplift at a heave of D/10{of}"),
            split(
                pile.uplift_10_percent_diameter,
                [None; 2],
                &pile.uplift_10_percent_diameter_phase,
            ),
            &None,
        ),
        (
            format!("uplift by Davisson{of}"),
            split(pile.uplift_davisson, [None; 2], &pile.uplift_davisson_phase),
            &None,
        ),
    ];
    let said = |(name, load, why): (String, Option<String>, &Option<String>)| {
        Some((name, load.or_else(|| why.clone())?))
    };
    let mut tests = summary.phases.iter();
    let test = tests.find(|phase| pile.phase.as_ref() == Some(&phase.name));
    let left = test.and_then(|phase| {
        let name = format!("largest force out of balance, phase `{}`", phase.name);
        Some((name, format!("{:.2} {}", phase.residual_force?, pile.unit)))
    });
    criteria.into_iter().filter_map(said).chain(left).collect()
}

/// A name in words.
pub(super) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// Names and values of an object.
fn named_values(object: &Map<String, Value>) -> Vec<(String, String)> {
    let value = |value: &Value| match value {
        Value::Number(number) => number.as_f64().map(display).unwrap_or_default(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        other => other.as_str().unwrap_or_default().to_owned(),
    };
    let entries = object.iter();
    entries.map(|(name, v)| (words(name), value(v))).collect()
}

pub(super) fn seconds(seconds: Option<f64>) -> Option<String> {
    seconds.map(|seconds| format!("{seconds:.3}"))
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
