//! `pilum table`: runs side by side as comma-separated values.

use crate::program::{BAD_INPUT, CASE, Place};
use tests::words::rows_of;

fn two_runs() -> Place {
    let place = Place::new();
    let figure = "[[figure]]\nname = \"f\"\nx = \"tau\"\ny = [\"half\"]\n";
    place.write("case.toml", CASE.to_owned() + figure);
    for (name, cohesion, push) in [("a", "5", "1e-5"), ("b", "7.5", "2e-5")] {
        place.done(&[
            "run",
            "case.toml",
            "--out",
            &format!("runs/{name}"),
            "--set",
            &format!("laws.joint.parameters.cohesion={cohesion}"),
            "--set",
            &format!("phase.push.displacement.1.x={push}"),
        ]);
    }
    place
}

#[test]
fn a_row_for_each_run() {
    let place = two_runs();
    let outcome = place.done(&["table", "runs"]);
    let rows: Vec<Vec<&str>> = outcome
        .stdout
        .lines()
        .map(|l| l.split(',').collect())
        .collect();
    assert_eq!(
        rows[0],
        [
            "run",
            "status",
            "laws.joint.parameters.cohesion",
            "phase.push.displacement.1.x",
            "half",
            "settlement",
            "tau"
        ]
    );
    assert_eq!(rows[1][..4], ["a", "done", "5", "1e-5"]);
    assert_eq!(rows[2][..4], ["b", "done", "7.5", "2e-5"]);
    assert_eq!(rows.len(), 3);
    // Last values, to the bit those of the run.
    for (row, folder) in rows[1..].iter().zip(["runs/a", "runs/b"]) {
        let history = std::fs::read_to_string(place.path(folder).join("history.csv")).unwrap();
        let columns: Vec<&str> = history.lines().next().unwrap().split(',').collect();
        let last: Vec<&str> = history.lines().last().unwrap().split(',').collect();
        for (name, value) in rows[0][4..].iter().zip(&row[4..]) {
            let column = columns.iter().position(|column| column == name).unwrap();
            let (value, expected) = (value.parse::<f64>(), last[column].parse::<f64>());
            assert_eq!(
                value.unwrap().to_bits(),
                expected.unwrap().to_bits(),
                "{name}"
            );
        }
    }
    // One of them twice stands there once; a file takes the table.
    place.done(&["table", "runs/a", "runs", "--out", "table.csv"]);
    let written = place.read("table.csv");
    assert_eq!(written, outcome.stdout);
    // Of one run nothing differs.
    let one = place.run(&["table", "runs/b"]);
    assert_eq!(
        one.stdout.lines().next().unwrap(),
        "run,status,half,settlement,tau"
    );
}

#[test]
fn piles_have_their_resistances() {
    let place = Place::new();
    place.write(
        "p/summary.json",
        r#"{"status": "no equilibrium", "probes": {"w": null},
            "pile": {"resistance_davisson": 812.5, "resistance_chin": null, "uplift_davisson": 21.5}}"#,
    );
    let outcome = place.run(&["table", "p"]);
    assert_eq!(
        outcome.stdout,
        "run,status,w,pile.resistance_10_percent_diameter,pile.resistance_davisson,\
         pile.resistance_chin,pile.uplift_10_percent_diameter,pile.uplift_davisson\n\
         p,no equilibrium,,,812.5,,,21.5\n"
    );
}

#[test]
fn folders_without_a_run_are_refused() {
    let place = Place::new();
    place.write("empty/below/readme", "");
    place.write("broken/summary.json", "{\n  \"status\": don\n}");
    place.write("other/summary.json", "{}");
    for [folder, says] in rows_of(
        "
nowhere | cannot read nowhere
empty | cannot read empty/summary.json
empty | there is no run in this folder, nor in those below
broken | broken/summary.json:2:
broken | not written by a run
other | other/summary.json has no `status`
",
    ) {
        let outcome = place.run(&["table", folder]).ended(BAD_INPUT);
        outcome.shows(says);
        assert_eq!(outcome.stdout, "", "{folder}");
    }
}
