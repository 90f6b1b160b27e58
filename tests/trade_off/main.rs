//! The tables and diagrams in `cases/trade_off/` are those that `pilum trade-off` measures. All
//! studies take about two minutes, so the test is asked for by name:
//!
//! ```sh
//! cargo test --release -p tests --test trade_off -- --ignored                  # compares errors
//! PILUM_BLESS=1 cargo test --release -p tests --test trade_off -- --ignored    # rewrites all
//! ```
//!
//! Costs differ from run to run and are never compared.
#![allow(clippy::unwrap_used, reason = "these are tests")]

use runs::trade_off::{Options, run};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tests::case::table;

/// Cases that are studied next to the drivers in the folder.
const CASES: &[&str] = &["chamber_mesh1"];
/// Cases whose interface stiffness is studied.
const JOINTS: &[&str] = &["chamber_joint"];
/// Between these lines of the README stands what was measured.
const MARKS: [&str; 2] = ["<!-- measured -->", "<!-- end of measured -->"];

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases")
}

/// Names of the files in the folder with an ending, without it.
fn stems(ending: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(cases().join("trade_off")).unwrap();
    entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == ending))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect()
}

/// Runs a study; returns its folder and what it says.
fn study(input: &Path, interface_stiffness: bool) -> (TempDir, String) {
    let place = TempDir::new().unwrap();
    let options = Options {
        variant: None,
        settings: Vec::new(),
        out: Some(place.path().to_owned()),
        fine: true,
        thorough: true,
        resume: false,
        most_increments: 1000,
        interface_stiffness,
        stop: law::Stop::never(),
        opener: law::Opener::default(),
    };
    let mut said = String::new();
    run(input, &options, &mut |text| said += text, &mut |_| ()).unwrap();
    (place, said)
}

type Row = BTreeMap<String, String>;

/// The rows worth a line: what nothing beats, the default, and what changes a single setting.
fn worth_a_line(rows: &[Row]) -> Vec<&Row> {
    let is = |row: &Row, mark: &str| row[mark] == "true";
    let wanted =
        |row: &&Row| is(row, "optimal") || is(row, "default") || !row["setting"].contains(", ");
    rows.iter().filter(wanted).collect()
}

/// A study as Markdown.
fn markdown(heading: &str, place: &Path, said: &str) -> String {
    let rows = table(&place.join("trade_off.csv"));
    let mut text = format!("\n### {heading}\n\n![error and cost]({heading}.svg)\n\n");
    let statements = ["reference", "note: ", "default ("];
    for line in said.lines() {
        if statements.iter().any(|start| line.starts_with(start)) {
            let _ = writeln!(text, "- {line}");
        }
    }
    let counts: Vec<&str> = ["iterations", "law_calls"]
        .into_iter()
        .filter(|count| rows[0].contains_key(*count))
        .collect();
    let _ = writeln!(
        text,
        "\n| | setting | error | CPU ms | {} |\n|---|---|---|---|{}",
        counts.join(" | ").replace('_', " "),
        "---|".repeat(counts.len())
    );
    for row in worth_a_line(&rows) {
        if !row["failure"].is_empty() {
            let empty = "|".repeat(2 + counts.len());
            let _ = writeln!(text, "| | {} | failed {empty}", row["setting"]);
            continue;
        }
        let mark = |column: &str, mark: &'static str| if row[column] == "true" { mark } else { "" };
        let cost: f64 = row["cpu_seconds"].parse().unwrap();
        let error: f64 = row["error"].parse().unwrap();
        let counts: Vec<&str> = counts.iter().map(|count| row[*count].as_str()).collect();
        let _ = writeln!(
            text,
            "| {}{}{} | {} | {error:.1e} | {:.3} | {} |",
            mark("default", "&gt;"),
            mark("optimal", "\\*"),
            mark("below_uncertainty", "&lt;"),
            row["setting"],
            1e3 * cost,
            counts.join(" | ")
        );
    }
    text
}

/// Errors in the tables of a README, by heading and setting.
fn errors(text: &str) -> BTreeMap<(String, String), f64> {
    let mut errors = BTreeMap::new();
    let mut heading = "";
    for line in text.lines() {
        heading = line.strip_prefix("### ").unwrap_or(heading);
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if let [_, _, setting, error, ..] = cells.as_slice()
            && let Ok(error) = error.parse()
        {
            errors.insert((heading.to_owned(), (*setting).to_owned()), error);
        }
    }
    errors
}

/// Text before, between and after the marks of the README.
fn readme() -> [String; 3] {
    let text = std::fs::read_to_string(cases().join("trade_off/README.md")).unwrap();
    let (before, rest) = text.split_once(MARKS[0]).unwrap();
    let (measured, after) = rest.split_once(MARKS[1]).unwrap();
    [before, measured, after].map(str::to_owned)
}

#[test]
fn every_study_has_its_diagram_and_its_table() {
    let mut studied = stems("toml");
    studied.extend(CASES.iter().map(|case| (*case).to_owned()));
    assert_eq!(stems("svg"), studied);
    let [_, measured, _] = readme();
    let tables: BTreeSet<String> = errors(&measured).into_keys().map(|key| key.0).collect();
    assert_eq!(tables, studied);
}

#[test]
#[ignore = "runs every study, which takes about two minutes"]
fn the_committed_errors_are_those_that_are_measured() {
    let folder = cases().join("trade_off");
    let bless = std::env::var_os("PILUM_BLESS").is_some_and(|value| value == "1");
    let drivers = stems("toml").into_iter();
    let drivers = drivers.map(|name| (folder.join(format!("{name}.toml")), name));
    let others = CASES
        .iter()
        .map(|name| (cases().join(name), (*name).to_owned()));
    let mut text = String::from("\n");
    for (input, name) in drivers.chain(others) {
        let (place, said) = study(&input, false);
        text += &markdown(&name, place.path(), &said);
        if bless {
            let svg = format!("{name}.svg");
            std::fs::copy(place.path().join("trade_off.svg"), folder.join(svg)).unwrap();
        }
    }
    for name in JOINTS {
        let (_, said) = study(&cases().join(name), true);
        let table = said.split("results in").next().unwrap().trim_end();
        let _ = writeln!(text, "\n### Interface of {name}\n\n```\n{table}\n```");
    }
    let [before, measured, after] = readme();
    if bless {
        let [start, end] = MARKS;
        let whole = format!("{before}{start}{text}{end}{after}");
        std::fs::write(folder.join("README.md"), whole).unwrap();
        return;
    }
    let found = errors(&text);
    let mut compared = 0;
    for (key, committed) in errors(&measured) {
        // What nothing beats depends on costs, so a row may be missing.
        if let Some(found) = found.get(&key) {
            compared += 1;
            // Two digits are printed; below 1e-8 they are those of round-off and tolerances.
            let close = (found - committed).abs() <= 0.06 * committed + 1e-8;
            assert!(close, "{key:?}: {found:e}, committed {committed:e}");
        }
    }
    assert!(compared >= 20, "only {compared} rows in common");
}
