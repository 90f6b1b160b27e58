//! Reports of very long and of very many runs: they stay of a size that a browser opens, and show
//! what matters.

use crate::browser::selftest;
use crate::folders::{folders, page_of};
use results::report::write;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use tempfile::TempDir;
use tests::or_skip;
use tests::words::has;

const RUNS: usize = 100;
/// Limits of a comparison of many runs.
const MOST_BYTES: usize = 5_000_000;

/// Copies of a run with another friction and, by turns, another method and another last force.
fn many() -> (TempDir, Vec<PathBuf>) {
    let place = tempfile::tempdir().unwrap();
    let layer = &folders().layer;
    let read = |file: &str| std::fs::read_to_string(layer.join(file)).unwrap();
    let (history, summary) = (read("history.csv"), read("summary.json"));
    let mut all = Vec::new();
    for run in 0..RUNS {
        let folder = place.path().join(format!("run_{run:03}"));
        std::fs::create_dir(&folder).unwrap();
        let mut summary: Value = serde_json::from_str(&summary).unwrap();
        let laws = summary["laws"].as_object_mut().unwrap();
        let law = laws.values_mut().next().unwrap();
        law["parameters"]["young_modulus"] = json!(1000.0 * (run + 1) as f64);
        summary["solver"]["method"] = json!(["auto", "newton", "initial_stress"][run % 3]);
        std::fs::write(folder.join("summary.json"), summary.to_string()).unwrap();
        // As long as a run of a thousand increments.
        let mut long = history.clone();
        let last = history.lines().last().unwrap();
        let (phase, rest) = last.split_once(',').unwrap();
        let (_, rest) = rest.split_once(',').unwrap();
        for increment in 100..1000 {
            let _ = writeln!(long, "{phase},{increment},{rest}");
        }
        std::fs::write(folder.join("history.csv"), long).unwrap();
        for file in ["profile.csv", "log.jsonl"] {
            std::fs::copy(layer.join(file), folder.join(file)).unwrap();
        }
        all.push(folder);
    }
    (place, all)
}

fn count(text: &str, what: &str) -> usize {
    text.matches(what).count()
}

#[test]
fn a_hundred_runs_have_a_page_that_can_be_read() {
    let (place, all) = many();
    let out = place.path().join("many.html");
    write(&all, &out).unwrap();
    let page = std::fs::read_to_string(&out).unwrap();
    assert!(page.len() < MOST_BYTES, "{} bytes", page.len());
    let (_, title) = page.split_once("<title>").unwrap();
    let (title, _) = title.split_once("</title>").unwrap();
    assert!(title.starts_with("100 runs of "), "{title}");
    assert!(!title.contains("run_0"), "{title}");

    // Runs by settings that differ and probes.
    let (_, table) = page.split_once("<table class=\"many\">").unwrap();
    let (table, _) = table.split_once("</table>").unwrap();
    let (head, body) = table.split_once("<tbody>").unwrap();
    has(head, "young_modulus");
    has(head, "method");
    assert!(!head.contains("poisson_ratio"), "{head}");
    let probes = {
        let history = std::fs::read_to_string(all[0].join("history.csv")).unwrap();
        history.lines().next().unwrap().split(',').count() - 4
    };
    assert_eq!(count(head, "<th"), 1 + 2 + 2 + probes, "{head}");
    assert_eq!(count(body, "<tr>"), RUNS);

    let outcome = or_skip!(selftest(&out));
    assert!(
        outcome["legend_entries"].as_u64().unwrap() < 10,
        "{outcome:#}"
    );
    let colouring = outcome["colouring"].as_array().unwrap();
    let colours = |by: &Value| {
        let colours = by["colours"].as_array().unwrap().iter();
        let distinct: BTreeSet<&str> = colours.map(|c| c.as_str().unwrap()).collect();
        distinct.len()
    };
    let of = |name: &str| {
        let found = colouring
            .iter()
            .find(|by| by["by"].as_str().unwrap().contains(name));
        found.unwrap_or_else(|| panic!("{colouring:#?}"))
    };
    // Numbers along a scale, of which neighbours may round to one colour; texts apart.
    let modulus = of("young_modulus");
    assert!(colours(modulus) > RUNS / 2, "{modulus:#}");
    has(modulus["key"].as_str().unwrap(), "1000");
    assert_eq!(colours(of("method")), 3);
    assert_eq!(of("method")["key"], "autonewtoninitial_stress");
}

/// Longer than any input may be, with a peak in one row.
#[test]
fn a_very_long_history_has_a_report_with_its_peaks() {
    const ROWS: usize = 200_000;
    let place = tempfile::tempdir().unwrap();
    let mut text = "phase,increment,time,load,iterations\n".to_owned();
    for row in 1..=ROWS {
        let load = if row == 77_777 {
            9.25
        } else {
            (row as f64 / 1e4).sin()
        };
        let _ = writeln!(
            text,
            "push,{row},{:.16e},{load:.60},3",
            row as f64 / ROWS as f64
        );
    }
    assert!(text.len() > 16 << 20, "{} bytes", text.len());
    std::fs::write(place.path().join("history.csv"), &text).unwrap();
    write(&[place.path().to_owned()], place.path()).unwrap();
    let page = page_of(place.path());
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    assert!(page.contains("of 200000 increments, with the extremes of every probe"));
    let (_, data) = page.split_once("id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    let history = &data[0]["history"];
    let increments = history["increment"].as_array().unwrap();
    // As many as the page says a screen can show, give or take the phase's end.
    assert!(
        (2000..=5001).contains(&increments.len()),
        "{}",
        increments.len()
    );
    assert_eq!(increments[0], 1);
    assert_eq!(increments[increments.len() - 1], ROWS);
    let column = history["names"]
        .as_array()
        .unwrap()
        .iter()
        .position(|name| name == "load");
    let loads = history["values"][column.unwrap()].as_array().unwrap();
    let peak = increments
        .iter()
        .position(|increment| *increment == 77_777)
        .unwrap();
    assert_eq!(loads[peak], 9.25);
}
