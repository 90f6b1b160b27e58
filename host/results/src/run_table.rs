//! A table of runs, one row each: how they ended, the settings in which they differ, and the last
//! values of their probes. For a study: its parameters, its outputs, and every run.

use crate::study::{self, History, State};
use crate::summary::{
    FILE_NAME, RUNNING, Resistances, Summary, names, settings, settings_of_files,
};
use crate::table::comma_separated;
use indexmap::{IndexMap, IndexSet};
use serde_json::{Value, json};
use std::io;
use std::path::{Path, PathBuf};
use text::Error;

/// Columns of the resistances of piles.
const OF_PILE: [&str; 5] = [
    "pile.resistance_10_percent_diameter",
    "pile.resistance_davisson",
    "pile.resistance_chin",
    "pile.uplift_10_percent_diameter",
    "pile.uplift_davisson",
];

/// A run, read back.
struct Run {
    summary: Summary,
    /// Its settings, as texts, by dotted path.
    settings: IndexMap<String, String>,
}

/// The table of all runs in some folders, as comma-separated values. A folder is that of a run, or
/// has folders of runs below.
///
/// # Errors
/// [`Error::Unreadable`] if there is no run in a folder; [`Error::Input`] if its summary is not one
/// that a run has written.
pub fn of(folders: &[PathBuf]) -> Result<String, Error> {
    if folders.iter().any(|folder| study::is_study(folder)) {
        let [folder] = folders else {
            let message = "one of these folders is that of a study, which has a table of its own: name it alone";
            return Err(Error::Usage(message.to_owned()));
        };
        return of_study(folder);
    }
    let mut found = Vec::new();
    for folder in folders {
        let before = found.len();
        find(folder, &mut found)?;
        if found.len() == before {
            let why = "there is no run in this folder, nor in those below";
            let why = io::Error::new(io::ErrorKind::NotFound, why);
            return Err(Error::unreadable(&folder.join(FILE_NAME), why));
        }
    }
    let mut seen = IndexSet::new();
    found.retain(|folder| seen.insert(folder.canonicalize().unwrap_or_else(|_| folder.clone())));
    let runs = found
        .iter()
        .map(|folder| Ok(Run::of(Summary::read(folder)?)));
    let runs = runs.collect::<Result<Vec<Run>, Error>>()?;
    written(&names(&found), &runs)
}

/// Columns of the resistances of piles, where a run has one.
fn columns_of_pile<'s>(
    mut summaries: impl Iterator<Item = &'s Summary>,
) -> &'static [&'static str] {
    if summaries.any(|summary| summary.pile.is_some()) {
        &OF_PILE
    } else {
        &[]
    }
}

/// The cells of these columns.
fn cells_of_pile(pile: Option<&Resistances>, columns: &[&str]) -> Vec<String> {
    let loads = |pile: &Resistances| {
        [
            pile.resistance_10_percent_diameter,
            pile.resistance_davisson,
            pile.resistance_chin,
            pile.uplift_10_percent_diameter,
            pile.uplift_davisson,
        ]
    };
    let loads = pile.map_or([None; OF_PILE.len()], loads);
    let loads = loads.into_iter().take(columns.len());
    loads.map(|load| shown(&json!(load))).collect()
}

/// The table of a study: all runs, whatever their outcome, with parameters, outputs, and the reason
/// of a missing output.
fn of_study(folder: &Path) -> Result<String, Error> {
    let record = study::Record::read(folder)?;
    let rows = record.runs(folder)?;
    let mut runs = Vec::new();
    for row in &rows {
        let place = folder.join(&row.folder);
        // Of an earlier study there may be more.
        let has_results = row.standing.state != State::Planned && place.join(FILE_NAME).is_file();
        let summary = if has_results {
            // Of many runs only what the table has is kept.
            let Summary { probes, pile, .. } = Summary::read(&place)?;
            Summary {
                pile,
                probes,
                ..Summary::default()
            }
        } else {
            Summary::default()
        };
        runs.push((row, summary, History::read_if(has_results, &place)));
    }
    let summaries = || runs.iter().map(|(_, summary, _)| summary);
    let outputs = record.outputs.iter();
    let counted: IndexSet<&str> = outputs.map(|output| output.name.as_str()).collect();
    let probes: IndexSet<&str> = summaries()
        .flat_map(|summary| summary.probes.keys().map(String::as_str))
        .filter(|name| !counted.contains(name))
        .collect();
    let of_pile = columns_of_pile(summaries());
    let parameters = record.parameters.iter();
    let parameters = parameters.map(|parameter| parameter.name.as_str());
    let header = ["run", "status"].into_iter().chain(parameters);
    let header = header.chain(counted).chain(probes.iter().copied());
    let header = header.chain(of_pile.iter().copied()).chain(["reason"]);
    let body = runs.iter().map(|(row, summary, history)| {
        let mut cells = vec![row.folder.clone(), row.standing.state.word().to_owned()];
        cells.extend(row.values.iter().cloned());
        let outputs = record.outputs.iter().map(|output| history.output(output));
        cells.extend(outputs.map(|value| shown(&json!(value))));
        cells.extend(
            probes
                .iter()
                .map(|probe| shown(&json!(summary.probes.get(*probe)))),
        );
        cells.extend(cells_of_pile(summary.pile.as_ref(), of_pile));
        cells.push(row.standing.reason.clone());
        cells
    });
    comma_separated(header, body)
}

/// The folders of runs at or below this one, in the order of their names.
fn find(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), Error> {
    if folder.join(FILE_NAME).exists() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let wrong = |why| Error::unreadable(folder, why);
    let mut below = Vec::new();
    for entry in folder.read_dir().map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        // A link may lead back up; what begins with a dot is of a study under way.
        let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
        if entry.file_type().map_err(wrong)?.is_dir() && !is_hidden {
            below.push(entry.path());
        }
    }
    below.sort();
    below.iter().try_for_each(|folder| find(folder, found))
}

impl Run {
    fn of(summary: Summary) -> Self {
        // What a run was computed with counts more than what its file says of it.
        let of_files = settings_of_files(&summary.head).into_iter();
        let of_run = settings(&summary).into_iter();
        let of_run = of_run.filter_map(|setting| Some((setting.path?, setting.value)));
        let settings = of_files.chain(of_run).map(|(path, v)| (path, shown(&v)));
        Self {
            settings: settings.collect(),
            summary,
        }
    }

    /// Whether it has the law that a path below `laws` is about: then there is its `law` as well.
    fn has_law(&self, path: &str) -> bool {
        let ids = self
            .settings
            .keys()
            .filter_map(|key| key.strip_suffix("law"));
        let mut tables = ids.filter(|table| table.starts_with("laws.") && table.ends_with('.'));
        tables.any(|table| path.starts_with(table))
    }

    /// How it ended.
    fn status(&self) -> &str {
        match self.summary.ending.status.as_str() {
            RUNNING => "unfinished",
            status => status,
        }
    }
}

/// The paths of settings in which runs differ, in the order in which they first appear; those of a law
/// in which the runs that have this law differ.
fn differing(runs: &[Run]) -> Vec<&str> {
    let paths: IndexSet<&str> = runs
        .iter()
        .flat_map(|run| run.settings.keys().map(String::as_str))
        .collect();
    let differs = |path: &&str| {
        let is_of_law = path.starts_with("laws.");
        // A law that is not given a variable to start from gives it itself.
        let is_initial = path.contains(".initial.");
        let counts = |run: &&Run| {
            run.settings.contains_key(*path) || !is_of_law || is_initial && run.has_law(path)
        };
        let mut values = runs
            .iter()
            .filter(counts)
            .map(|run| run.settings.get(*path));
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    paths.into_iter().filter(differs).collect()
}

fn written(names: &[String], runs: &[Run]) -> Result<String, Error> {
    let settings = differing(runs);
    let probes = runs.iter().flat_map(|run| run.summary.probes.keys());
    let probes: IndexSet<&str> = probes.map(String::as_str).collect();
    let of_pile = columns_of_pile(runs.iter().map(|run| &run.summary));
    let header = ["run", "status"].iter().chain(&settings).chain(&probes);
    let header = header.chain(of_pile);
    let body = names.iter().zip(runs).map(|(name, run)| {
        let mut row = vec![name.clone(), run.status().to_owned()];
        let of_settings = settings.iter().map(|path| run.settings.get(*path));
        row.extend(of_settings.map(|value| value.cloned().unwrap_or_default()));
        let last = &run.summary.probes;
        row.extend(probes.iter().map(|probe| shown(&json!(last.get(*probe)))));
        row.extend(cells_of_pile(run.summary.pile.as_ref(), of_pile));
        row
    });
    comma_separated(header, body)
}

/// A value in a cell; nothing, where absent. A number has all its digits.
pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Number(number) => match number.as_f64() {
            Some(value) if value == 0.0 || (1e-4..1e7).contains(&value.abs()) => value.to_string(),
            Some(value) => format!("{value:e}"),
            None => number.to_string(),
        },
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(summary: Value) -> Run {
        Run::of(serde_json::from_value(summary).unwrap())
    }

    #[test]
    fn a_row_has_what_differs_and_what_came_out() {
        let with = |c: f64, status: &str, pile: Value| {
            run(json!({
                "status": status,
                "case_files": [{
                    "path": "case.toml",
                    "text": "[[phase]]\nname = \"load\"\nincrements = 2\n",
                }],
                "set": [format!("phase.1.increments={c}")],
                "laws": { "soil (solid_2d)": { "law": "l", "parameters": { "c": c, "d": 1.0 } } },
                "probes": { "w": 0.1 + c, "n": null },
                "pile": pile,
            }))
        };
        let reached = json!({ "resistance_davisson": 1234.5, "resistance_chin": null, "uplift_davisson": 7.5 });
        let runs = [
            with(2.0, "done", reached),
            with(3.0, "running", Value::Null),
        ];
        let names = ["a", "b, c"].map(str::to_owned);
        let expected = "\
            run,status,phase.load.increments,laws.soil.parameters.c,n,w,\
            pile.resistance_10_percent_diameter,pile.resistance_davisson,pile.resistance_chin,\
            pile.uplift_10_percent_diameter,pile.uplift_davisson\n\
            a,done,2,2,,2.1,,1234.5,,,7.5\n\
            \"b, c\",unfinished,3,3,,3.1,,,,,\n";
        assert_eq!(written(&names, &runs).unwrap(), expected);
    }

    #[test]
    fn a_law_that_only_one_run_has_takes_no_columns() {
        let with = |law: &str, c: f64| {
            let mut laws = json!({ "soil (solid_2d)": { "law": "l", "parameters": { "c": c } } });
            let joint = json!({ "law": "j", "sha256": law, "parameters": { "k": 1.0 } });
            laws[format!("{law} (interface_2d)")] = joint;
            run(json!({
                "status": "done",
                "laws": laws,
                "case_files": [{
                    "path": "case.toml",
                    "text": format!("[groups.shaft]\nlaw = \"{law}\"\n"),
                }],
            }))
        };
        let runs = [with("smooth", 1.0), with("rough", 2.0)];
        let names = ["a", "b"].map(str::to_owned);
        let expected = "\
            run,status,groups.shaft.law,laws.soil.parameters.c\n\
            a,done,smooth,1\n\
            b,done,rough,2\n";
        assert_eq!(written(&names, &runs).unwrap(), expected);
    }

    #[test]
    fn runs_alike_have_no_settings() {
        let alike = || run(json!({ "status": "done", "analysis": "axisymmetric" }));
        let names = ["a", "b"].map(str::to_owned);
        let table = written(&names, &[alike(), alike()]).unwrap();
        assert_eq!(table, "run,status\na,done\nb,done\n");
    }

    #[test]
    fn numbers_have_all_their_digits() {
        assert_eq!(shown(&json!(1.0 / 3.0)), "0.3333333333333333");
        assert_eq!(shown(&json!(2.1e8)), "2.1e8");
        assert_eq!(shown(&json!(20)), "20");
        assert_eq!(shown(&json!([1, 2])), "[1,2]");
    }

    #[test]
    fn parameters_over_the_height_differ_by_their_ranges() {
        let with = |smallest: f64| {
            let c = json!({ "smallest": smallest, "largest": 30.0 });
            let law = json!({ "law": "l", "parameters": { "c": null }, "varying": { "c": c } });
            run(json!({ "status": "done", "laws": { "a (interface_2d)": law } }))
        };
        let names = ["a", "b"].map(str::to_owned);
        let table = written(&names, &[with(10.0), with(20.0)]).unwrap();
        let expected = "run,status,laws.a.parameters.c\na,done,10 to 30\nb,done,20 to 30\n";
        assert_eq!(table, expected);
    }

    /// A key that only one file gives counts as different; a law that one run lacks is no column.
    #[test]
    fn what_a_law_is_made_and_started_with_differs() {
        let with = |zone: Value, initial: Value| {
            let law = json!({
                "law": "l", "parameters": { "c": 1.0 }, "shear_zone": zone, "initial": initial,
            });
            run(json!({ "status": "done", "laws": { "a (interface_2d)": law } }))
        };
        let zone = |ratio: f64| json!({ "thickness": 0.005, "lateral_ratio": ratio });
        let runs = [
            with(zone(1.0), json!({})),
            with(zone(0.5), json!({ "zone_stress_11": -40.0 })),
            run(json!({ "status": "done", "laws": { "other (solid_2d)": { "law": "m" } } })),
        ];
        let expected = ["laws.a.lateral_ratio", "laws.a.initial.zone_stress_11"];
        assert_eq!(differing(&runs), expected);
    }
}
