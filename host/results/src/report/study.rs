//! The report of a study: what its parameters do to what counts, and every curve in the colour of a
//! parameter.

use super::budget::Budget;
use super::number_format::{Short, display, thinned};
use super::page::{STYLE, running};
use super::results::Run;
use super::{Known, filled, internal};
use crate::run_table::shown;
use crate::study::{
    Design, EFFECTS, Effect, History, Output, ParameterRecord, Record, Row, State, Take, effects,
};
use crate::table::comma_separated;
use indexmap::{IndexMap, IndexSet};
use minijinja::value::Serde;
use minijinja::{Value as Template, context};
use serde::Serialize;
use std::path::Path;
use text::Error;
use text::write::replace_whole;

const TEMPLATE: &str = include_str!("study.html");
const SCRIPT: &str = include_str!("script/study.js");
const OWN_STYLE: &str = include_str!("study.css");
/// Numbers of histories that go into the page.
const MOST_NUMBERS: usize = 400_000;
/// Rows of the table of runs, and of those that failed, that the page shows.
const MOST_ROWS: usize = 1000;
const MOST_FAILED: usize = 200;

/// What the script draws.
#[derive(Serialize)]
struct Drawn<'a> {
    parameters: Vec<Varied>,
    outputs: Vec<Counted<'a>>,
    units: IndexMap<String, String>,
    /// The column that the first output is looked up at, that output's, and its phase.
    at: Option<&'a str>,
    first: &'a str,
    phase: Option<&'a str>,
    history: Curves,
}

/// A parameter: its value in every run, of texts the number of the text.
#[derive(Serialize)]
struct Varied {
    name: String,
    numbers: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texts: Option<Vec<String>>,
}

#[derive(Serialize)]
struct Counted<'a> {
    name: &'a str,
    numbers: Vec<Short>,
    effects: Vec<Effect>,
}

/// Histories of all runs, with the columns and phases that any of them has.
#[derive(Default, Serialize)]
struct Curves {
    names: Vec<String>,
    phases: Vec<String>,
    runs: Vec<Curve>,
}

#[derive(Serialize)]
struct Curve {
    /// Number of the row.
    run: usize,
    phase: Vec<usize>,
    values: Vec<Vec<Short>>,
}

/// What the parameters do to each output, by its name.
fn effects_of_all(
    record: &Record,
    design: Design,
    parameters: &[Varied],
    numbers: &[Vec<Option<f64>>],
) -> IndexMap<String, Vec<Effect>> {
    let columns: Vec<Vec<f64>> = parameters.iter().map(|p| p.numbers.clone()).collect();
    let outputs = record.outputs.iter().zip(numbers);
    outputs
        .map(|(output, numbers)| (output.name.clone(), effects(&columns, numbers, design)))
        .collect()
}

/// The text of the page of the study in a folder; while it is carried out with the present time, in seconds
/// since 1970. Its effects go into their table.
pub(super) fn render(folder: &Path, now: Option<u64>) -> Result<String, Error> {
    let record = Record::read(folder)?;
    let rows = record.runs(folder)?;
    let history = |row: &Row| {
        let has_begun = row.standing.state != State::Planned;
        History::read_if(has_begun, &folder.join(&row.folder))
    };
    let histories: Vec<History> = rows.iter().map(history).collect();
    let numbers_of = |output: &Output| -> Vec<Option<f64>> {
        let runs = histories.iter().zip(&rows);
        let number = |(history, row): (&History, &Row)| {
            history.counted(output, row.standing.state == State::Done)
        };
        runs.map(number).collect()
    };
    let numbers: Vec<_> = record.outputs.iter().map(numbers_of).collect();
    let parameters: Vec<Varied> = (0..)
        .zip(&record.parameters)
        .map(|(number, parameter)| varied(number, parameter, &rows))
        .collect();
    let design = design(&record);
    let found = effects_of_all(&record, design, &parameters, &numbers);
    replace_whole(&folder.join(EFFECTS), effects_table(&record, &found)?)?;
    let mut units = units(folder, &rows);
    let of = |output: &Output| Some((output.name.clone(), units.get(&output.probe)?.clone()));
    let of_outputs: Vec<_> = record.outputs.iter().filter_map(of).collect();
    units.extend(of_outputs);
    let (history, left_out) = curves(&histories);
    let first = record.outputs.first();
    let outputs = record.outputs.iter().zip(&numbers);
    let outputs = outputs.map(|(output, numbers)| Counted {
        name: &output.name,
        numbers: numbers.iter().map(|number| Short(*number)).collect(),
        effects: found[&output.name].clone(),
    });
    let drawn = Drawn {
        outputs: outputs.collect(),
        units,
        at: first.and_then(|output| Some(output.at.as_ref()?.0.as_str())),
        first: first.map_or("", |output| &output.probe),
        phase: first.and_then(|output| output.phase.as_deref()),
        history,
        parameters,
    };
    let data = serde_json::to_string(&drawn).map_err(internal)?;
    let of = (&record, design);
    let page = page(of, &rows, &numbers, &drawn, (left_out, now), &data);
    filled(TEMPLATE, page)
}

/// Units of the probes, as the first run that can be read has them.
fn units(folder: &Path, rows: &[Row]) -> IndexMap<String, String> {
    let begun = rows
        .iter()
        .filter(|row| row.standing.state != State::Planned);
    let mut runs = begun.filter_map(|row| {
        let place = folder.join(&row.folder);
        Run::read(
            &row.folder,
            &place,
            Known::default(),
            &Budget::of(rows.len().max(2)),
        )
        .ok()
    });
    let Some(run) = runs.next() else {
        return IndexMap::new();
    };
    let units = run.units().into_iter();
    units
        .map(|(name, unit)| (name.to_owned(), unit.to_owned()))
        .collect()
}

/// `effects.csv`: what each parameter does to each output.
fn effects_table(record: &Record, found: &IndexMap<String, Vec<Effect>>) -> Result<String, Error> {
    let header = [
        "output",
        "parameter",
        "mean_at_lowest",
        "mean_at_highest",
        "share",
        "share_lower",
        "share_upper",
        "total",
        "total_lower",
        "total_upper",
    ];
    let row = |output: &String, effect: &Effect| {
        let ends = [effect.levels.first(), effect.levels.last()];
        let ends = ends.map(|level| level.map(|level| level.mean));
        let bounds =
            |interval: Option<[f64; 2]>| interval.map_or([None; 2], |interval| interval.map(Some));
        let total = effect.total;
        let mut numbers = ends.to_vec();
        numbers.push(effect.share);
        numbers.extend(bounds(effect.interval));
        numbers.push(total.map(|total| total.value));
        numbers.extend(bounds(total.and_then(|total| total.interval)));
        let parameter = record.parameters[effect.parameter].name.clone();
        let mut cells = vec![output.clone(), parameter];
        cells.extend(numbers.into_iter().map(|number| shown(&number.into())));
        cells
    };
    let rows = found.iter();
    let rows = rows.flat_map(|(output, effects)| effects.iter().map(move |e| row(output, e)));
    comma_separated(header, rows)
}

fn varied(number: usize, parameter: &ParameterRecord, rows: &[Row]) -> Varied {
    let values = || rows.iter().map(|row| row.values[number].as_str());
    // `nan` and `inf` are texts, as any other.
    let number = |value: &str| value.parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Option<Vec<f64>> = values().map(number).collect();
    let (numbers, texts) = if let Some(numbers) = numbers {
        (numbers, None)
    } else {
        let texts: IndexSet<&str> = values().collect();
        let number = |value| texts.get_index_of(value).unwrap_or(0) as f64;
        let numbers = values().map(number).collect();
        (
            numbers,
            Some(texts.iter().map(ToString::to_string).collect()),
        )
    };
    Varied {
        name: parameter.name.clone(),
        numbers,
        texts,
    }
}

fn design(record: &Record) -> Design {
    match (record.is_grid, record.is_saltelli) {
        (true, _) => Design::Grid,
        (_, true) => Design::Saltelli,
        _ => Design::Other,
    }
}

/// The curves, and how many rows of the longest are shown if that is not all.
fn curves(histories: &[History]) -> (Curves, Option<usize>) {
    let names: IndexSet<&str> = histories
        .iter()
        .flat_map(|history| history.names.iter().map(String::as_str))
        .filter(|name| *name != "iterations")
        .collect();
    let rows = histories.iter().flat_map(|history| &history.phases);
    let phases: IndexSet<&str> = rows.map(String::as_str).collect();
    let drawn = histories.iter().enumerate();
    let drawn = drawn.filter(|(_, history)| !history.phases.is_empty());
    let n_runs = drawn.clone().count();
    let most = (MOST_NUMBERS / (n_runs * (names.len() + 1)).max(1)).max(8);
    let longest = histories.iter().map(|h| h.phases.len()).max().unwrap_or(0);
    let curve = |(run, history): (usize, &History)| {
        let of = &history.phases;
        // The last row of a phase is where it ends.
        let is_end = |row: usize| of.get(row + 1) != of.get(row);
        let shown = thinned(of.len(), most, is_end);
        Curve {
            run,
            phase: shown
                .iter()
                .filter_map(|&row| phases.get_index_of(of[row].as_str()))
                .collect(),
            values: names
                .iter()
                .map(|name| {
                    let column = history.column(name).unwrap_or_default();
                    shown
                        .iter()
                        .map(|&row| Short(column.get(row).copied().flatten()))
                        .collect()
                })
                .collect(),
        }
    };
    let curves = Curves {
        runs: drawn.map(curve).collect(),
        names: names.iter().map(ToString::to_string).collect(),
        phases: phases.iter().map(ToString::to_string).collect(),
    };
    (curves, (longest > most).then_some(most))
}

fn page(
    (record, design): (&Record, Design),
    rows: &[Row],
    numbers: &[Vec<Option<f64>>],
    drawn: &Drawn<'_>,
    (left_out, now): (Option<usize>, Option<u64>),
    data: &str,
) -> Template {
    let has_failed = |row: &&Row| matches!(row.standing.state, State::Failed(_));
    let failed = || rows.iter().filter(has_failed);
    let outputs = record.outputs.iter().zip(&drawn.outputs).zip(numbers);
    let outputs = outputs.map(|((output, counted), numbers)| {
        output_context(output, counted, (numbers, design), drawn)
    });
    let outputs: Vec<Template> = outputs.collect();
    let row = |(number, row): (usize, &Row)| {
        let of_run = numbers.iter().map(|numbers| numbers[number]);
        let of_run = of_run.map(|value| value.map(display).unwrap_or_default());
        let of_run: Vec<String> = of_run.collect();
        context! { numbers => of_run, ..run_context(row) }
    };
    context! {
        version => env!("CARGO_PKG_VERSION"),
        style => STYLE,
        own_style => OWN_STYLE,
        script => SCRIPT,
        // Nothing in the data can end the script element.
        data => data.replace('<', "\\u003c"),
        running => now.map(running),
        title => record.title.clone(),
        design => record.design.clone(),
        program => record.program.clone(),
        is_saltelli => design == Design::Saltelli,
        n_runs => rows.len(),
        done => rows.iter().filter(|row| row.standing.state == State::Done).count(),
        n_failed => failed().count(),
        failed => failed().take(MOST_FAILED).map(run_context).collect::<Vec<_>>(),
        unfinished => unfinished(rows),
        parameters => Template::from(Serde(&record.parameters)),
        outputs,
        thinned => left_out.map(|most| format!(
            "About {most} rows of each history are shown, evenly spaced, with the last of each phase; history.csv has all."
        )),
        rows => rows.iter().enumerate().take(MOST_ROWS).map(row).collect::<Vec<_>>(),
    }
}

fn run_context(row: &Row) -> Template {
    context! {
        folder => row.folder.clone(),
        state => row.standing.state.word(),
        values => row.values.clone(),
        reason => row.standing.reason.clone(),
    }
}

/// How many runs have not come to an end, by their state.
fn unfinished(rows: &[Row]) -> Vec<String> {
    let mut counts: IndexMap<&str, usize> = IndexMap::new();
    for row in rows.iter().filter(|row| !row.standing.state.is_final()) {
        *counts.entry(row.standing.state.word()).or_default() += 1;
    }
    let line =
        |(word, n): (&str, usize)| format!("{n} run{} {word}", if n == 1 { "" } else { "s" });
    counts.into_iter().map(line).collect()
}

fn output_context(
    output: &Output,
    counted: &Counted<'_>,
    (numbers, design): (&[Option<f64>], Design),
    drawn: &Drawn<'_>,
) -> Template {
    let known: Vec<f64> = numbers.iter().copied().flatten().collect();
    let least = known.iter().copied().reduce(f64::min);
    let range = least
        .zip(known.iter().copied().reduce(f64::max))
        .map(|(least, most)| {
            let mean = known.iter().sum::<f64>() / known.len() as f64;
            let missing = numbers.len() - known.len();
            let missing = match missing {
                0 => String::new(),
                1 => "; 1 run has none that counts".to_owned(),
                n => format!("; {n} runs have none that counts"),
            };
            format!(
                "{} to {}, mean {}{missing}",
                display(least),
                display(most),
                display(mean)
            )
        });
    let effects: Vec<Template> = counted
        .effects
        .iter()
        .map(|effect| {
            let mean = |level: Option<&crate::study::Level>| level.map(|level| display(level.mean));
            context! {
                name => drawn.parameters[effect.parameter].name.clone(),
                low => mean(effect.levels.first()),
                high => mean(effect.levels.last()),
                range => display(effect.range()),
                share => in_percent(effect.share, effect.interval),
                total => in_percent(effect.total.map(|total| total.value), effect.total.and_then(|total| total.interval)),
            }
        })
        .collect();
    context! {
        name => output.name.clone(),
        unit => drawn.units.get(&output.probe).cloned(),
        words => in_words(output),
        range,
        effects,
        levels => levels(design, numbers, drawn.parameters.len()),
    }
}

/// A share with its interval. One whose interval holds 0 is not told from none.
fn in_percent(share: Option<f64>, interval: Option<[f64; 2]>) -> String {
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    match (share, interval) {
        (None, _) => "–".to_owned(),
        (Some(share), None) => format!("{} %", percent(share)),
        (Some(_), Some([low, high])) if low <= 0.0 => {
            format!(
                "not distinguishable from 0 (at most {} %)",
                percent(high.max(0.0))
            )
        }
        (Some(share), Some([low, high])) => {
            format!(
                "{} % ({} to {})",
                percent(share),
                percent(low),
                percent(high)
            )
        }
    }
}

/// Data behind the shares of an output.
fn levels(design: Design, numbers: &[Option<f64>], parameters: usize) -> String {
    let of_scatter = "Kelley's ε², which counts what a parameter does alone and takes off what the scatter of the runs makes \
                      up by chance, with its interval of 95 % (bootstrap).";
    if design == Design::Saltelli {
        let bases = numbers.chunks(parameters + 2);
        let (n, holes) = bases.fold((0, 0), |(n, holes), base| {
            (n + 1, holes + usize::from(base.iter().any(Option::is_none)))
        });
        let left_out = match holes {
            0 => String::new(),
            _ => format!("; {holes} are left out, for a run without a number that counts"),
        };
        return format!(
            "First-order index: the share that a parameter brings alone (Saltelli 2010). Total index: alone and with others \
             (Jansen 1999). Both with intervals of 95 % by drawing from the {n} base points (bootstrap){left_out}."
        );
    }
    if design == Design::Other {
        return format!(
            "The values of a parameter that has more than twelve are divided into levels of as many runs each; the share is \
             {of_scatter}"
        );
    }
    let holes = numbers.iter().filter(|number| number.is_none()).count();
    if holes == 0 {
        return "The share is η², which counts what a parameter does alone.".to_owned();
    }
    format!(
        "The grid has holes, {holes} of {} runs without a number that counts: means at the levels are over different \
         values of the other parameters, so that what these do is in them, too. The share is {of_scatter}",
        numbers.len()
    )
}

fn in_words(output: &Output) -> String {
    let what = match (&output.at, output.take) {
        (Some((other, value)), _) => format!("{} where {other} first is {value}", output.probe),
        (None, Take::Final) => format!("last value of {}", output.probe),
        (None, Take::Max) => format!("largest value of {}", output.probe),
        (None, Take::Min) => format!("smallest value of {}", output.probe),
    };
    match &output.phase {
        Some(phase) => format!("{what}, phase {phase}"),
        None => what,
    }
}
