//! `pilum study`: many runs of one case, whatever becomes of the processes that carry them out.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

mod ended;
mod mistakes;

use crate::program::{BAD_INPUT, CASE, DONE, NO_EQUILIBRIUM, Outcome, Place};
use crate::results::sliding;
use crate::troubled;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::process::Child;
use tests::or_skip;
use tests::words::has;
use tests::words::words;

/// Three by two runs.
const STUDY: &str = r#"title = "Strength of the layer"
case = "case.toml"
method = "grid"

[[parameter]]
name = "cohesion"
key = "laws.joint.parameters.cohesion"
values = [2.0, 5.0, 10.0]

[[parameter]]
name = "push"
key = "phase.push.displacement.1.x"
uniform = [1e-5, 2e-5]
levels = 2

[outputs]
tau_max = { probe = "tau", take = "max" }
tau_at = { probe = "tau", at = { probe = "settlement", value = 1.0 } }
first = { probe = "tau", take = "min", phase = "push" }
"#;

fn place(study: &str) -> Place {
    let place = Place::new();
    place.write("case.toml", CASE);
    place.write("study.toml", study);
    place
}

/// The table of a study, as `pilum table` writes it.
fn table(place: &Place) -> String {
    let outcome = place.done(&["table", "out"]);
    outcome.stdout
}

/// A column of a table whose cells have no commas.
fn column<'t>(table: &'t str, name: &str) -> Vec<&'t str> {
    let mut rows = table.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let at = header.iter().position(|cell| *cell == name);
    let at = at.unwrap_or_else(|| panic!("no {name} in {header:?}"));
    rows.map(|row| row[at]).collect()
}

fn study(place: &Place, more: &[&str]) -> Outcome {
    place.run(&[&["study", "study.toml", "--out", "out"], more].concat())
}

#[test]
fn a_grid_is_carried_out_and_a_second_call_has_nothing_to_do() {
    let place = place(STUDY);
    let outcome = study(&place, &["--jobs", "2"]).ended(DONE);
    outcome.prints("6 runs: 6 done\n");
    let runs = place.read("out/runs.csv");
    let header = "index,folder,cohesion,push,tau_max,tau_at,first,state,reason\n";
    assert!(runs.starts_with(header), "{runs}");
    let cells = |name: &str| column(&runs, name);
    assert_eq!(
        cells("cohesion"),
        ["2.0", "2.0", "5.0", "5.0", "10.0", "10.0"]
    );
    let pushes: Vec<f64> = cells("push")
        .iter()
        .map(|cell| cell.parse().unwrap())
        .collect();
    assert_eq!(pushes, [1e-5, 2e-5, 1e-5, 2e-5, 1e-5, 2e-5]);
    assert_eq!(cells("state"), ["done"; 6]);
    // What counts of the results is in it, as `pilum table` has it.
    for output in ["tau_max", "tau_at", "first"] {
        let of_table = table(&place);
        assert_eq!(cells(output), column(&of_table, output));
        assert_eq!(
            cells(output).iter().all(|cell| cell.is_empty()),
            output == "tau_at"
        );
    }
    // A run of the study is the run of the case with these settings.
    let alone = words("run case.toml --out alone --set laws.joint.parameters.cohesion=5.0");
    place
        .run(&[&alone[..], &["--set", "phase.push.displacement.1.x=2e-5"]].concat())
        .ended(DONE);
    let history = |folder: &str| std::fs::read(place.path(folder).join("history.csv")).unwrap();
    assert_eq!(history("alone"), history("out/00004"));
    let table = table(&place);
    assert_eq!(column(&table, "status"), ["done"; 6]);
    let text = String::from_utf8(history("out/00004")).unwrap();
    let taus: Vec<f64> = column(&text, "tau")
        .iter()
        .map(|t| t.parse().unwrap())
        .collect();
    let is = |name: &str, value: f64| {
        let number: f64 = column(&table, name)[3].parse().unwrap();
        assert_eq!(number.to_bits(), value.to_bits(), "{name}");
    };
    is("tau_max", taus.iter().copied().fold(f64::MIN, f64::max));
    is("first", taus[2].min(taus[3]));
    is("tau", taus[3]);
    // A plan is a plan, with the options of the command that is to follow, too.
    let planned = study(&place, &["--plan", "--jobs", "2", "--retry"]).ended(DONE);
    planned.prints("6 runs\ntable in");
    assert_eq!(self::table(&place), table);
    // Nothing is done twice.
    let written = || {
        std::fs::metadata(place.path("out/00004/history.csv"))
            .unwrap()
            .modified()
            .unwrap()
    };
    let before = written();
    let again = study(&place, &[]).ended(DONE);
    has(&again.stderr, "6 of them done already");
    let one = study(&place, &["--run", "4"]);
    one.prints("run 4: done already");
    assert_eq!(written(), before);
    study(&place, &["--run", "4", "--anew"]).ended(DONE);
    assert_ne!(written(), before);
    assert_eq!(self::table(&place), table);
    let report = place.read("out/report.html");
    assert!(report.contains("6 of 6 runs done") && !report.contains("id=\"running\""));
}

#[test]
fn a_longer_study_keeps_the_runs_that_are_done() {
    let list = "case = \"case.toml\"\nmethod = \"list\"\n\
                [[parameter]]\nkey = \"laws.joint.parameters.cohesion\"\nvalues = [2.0, 5.0]\n";
    let place = place(list);
    study(&place, &[]).ended(DONE);
    place.write("study.toml", list.replace("5.0]", "5.0, 7.0]"));
    let longer = study(&place, &[]).ended(DONE);
    has(&longer.stderr, "3 runs, 2 of them done already");
    // Other values, or another case, are another study.
    place.write("study.toml", list.replace("2.0,", "3.0,"));
    for more in [&[][..], &["--plan"], &["--run", "1"]] {
        let other = study(&place, more).ended(BAD_INPUT);
        other.shows("out/00001: it holds a run of another case");
    }
    study(&place, &["--anew"]).ended(DONE);
    assert_eq!(
        column(&table(&place), "laws.joint.parameters.cohesion"),
        ["3.0", "5.0"]
    );
}

#[test]
fn the_table_does_not_depend_on_who_carries_it_out() {
    let sampled = STUDY
        .replace(
            "method = \"grid\"",
            "method = \"latin_hypercube\"\nruns = 7\nseed = 3",
        )
        .replace("levels = 2\n", "");
    let alone = place(&sampled);
    study(&alone, &["--jobs", "1"]).ended(DONE);
    let expected = table(&alone);
    let several = place(&sampled);
    study(&several, &["--jobs", "4", "--threads", "2"]).ended(DONE);
    assert_eq!(table(&several), expected);
    // Processes that know nothing of each other, and no plan.
    let scattered = place(&sampled);
    let mut children: Vec<Child> = (1..=7)
        .map(|run| {
            scattered.start(&[
                "study",
                "study.toml",
                "--out",
                "out",
                "--run",
                &run.to_string(),
            ])
        })
        .collect();
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    assert_eq!(table(&scattered), expected);
    let runs = scattered.read("out/runs.csv");
    assert_eq!(column(&runs, "state"), ["done"; 7]);
    scattered.run(&["report", "out"]).ended(DONE);
    assert!(scattered.path("out/report.html").is_file());
}

/// Chance has the same points at every call; `saltelli` has the runs for indices, which are in `effects.csv`. The
/// stiffness of the layer brings everything, the title nothing.
#[test]
fn saltelli_gives_indices_with_intervals() {
    let study_of = |method: &str| {
        format!(
            "case = \"case.toml\"\nmethod = \"{method}\"\nruns = 8\n\
             [[parameter]]\nname = \"stiffness\"\nkey = \"laws.joint.parameters.shear_stiffness\"\nuniform = [1e5, 4e5]\n\
             [[parameter]]\nname = \"title\"\nkey = \"title\"\nvalues = [\"a\", \"b\"]\n\
             [outputs]\ntau = {{ probe = \"tau\" }}\n"
        )
    };
    let place = place(&study_of("saltelli"));
    let outcome = study(&place, &["--plan"]).ended(DONE);
    outcome.prints("32 runs");
    let plan = std::fs::read(place.path("out/runs.csv")).unwrap();
    study(&place, &["--plan"]).ended(DONE);
    assert_eq!(std::fs::read(place.path("out/runs.csv")).unwrap(), plan);
    study(&place, &[]).ended(DONE);
    let effects = place.read("out/effects.csv");
    assert_eq!(column(&effects, "parameter"), ["stiffness", "title"]);
    let of = |name: &str| -> Vec<f64> {
        let cells = column(&effects, name).into_iter();
        cells.map(|cell| cell.parse().unwrap()).collect()
    };
    let [first, total] = ["share", "total"].map(of);
    assert!(
        (total[0] - 1.0).abs() < 0.5 && total[1].abs() < 1e-12,
        "{total:?}"
    );
    assert!(
        (first[0] - total[0]).abs() < 0.5 && first[1].abs() < 1e-12,
        "{first:?}"
    );
    assert!(of("share_lower")[0] <= first[0] && first[0] <= of("share_upper")[0]);
    let report = place.read("out/report.html");
    for part in [
        "first-order index",
        "total index",
        "not distinguishable from 0 (at most 0.0 %)",
    ] {
        assert!(report.contains(part), "{part}");
    }
    // Eight points without order: what does nothing is not called 0.0 %.
    let other = self::place(&study_of("sobol"));
    study(&other, &[]).ended(DONE);
    let report = other.read("out/report.html");
    has(&report, "not distinguishable from 0 (at most");
    assert!(!report.contains(">0.0 %<"));
    assert!(report.contains("digital shift, seed 0"));
    let runs = other.read("out/runs.csv");
    assert_ne!(column(&runs, "stiffness")[0], "100000.0");
}

/// A block on a joint without dilatancy carries 40 of 100 kPa.
#[test]
fn runs_that_fail_are_rows_with_their_reason() {
    let list = "case = \"case.toml\"\nmethod = \"list\"\n\
                [[parameter]]\nname = \"load\"\nkey = \"phase.push.pressure.1.value\"\n\
                values = [20.0, 100.0, 30.0]\n";
    let place = Place::new();
    place.write("case.toml", sliding());
    place.write("study.toml", list);
    let outcome = study(&place, &[]).ended(DONE);
    outcome.prints("3 runs: 2 done, 1 no equilibrium");
    let table = table(&place);
    assert_eq!(column(&table, "status"), ["done", "no equilibrium", "done"]);
    let reason = table.lines().nth(2).unwrap();
    has(reason, "phase `");
    has(reason, "increment");
    let report = place.read("out/report.html");
    assert!(report.contains("1 run could not come to the end"));
    // Its last value is none of the study's.
    assert!(report.contains("1 run has none that counts"), "{report}");
    // It is left alone, unless it is asked for.
    let left = |more: &[&str]| study(&place, more).stderr;
    assert!(left(&[]).contains("3 of them done already"));
    assert!(left(&["--retry"]).contains("2 of them done already"));
    study(&place, &["--run", "2"]).ended(NO_EQUILIBRIUM);
}

/// Rows that a run has passed count, whatever comes later; a grid with a hole has no η².
#[test]
fn of_a_run_that_fails_counts_what_it_has_passed() {
    let place = Place::new();
    place.write("case.toml", sliding());
    let grid = "case = \"case.toml\"\nmethod = \"grid\"\n\
                [[parameter]]\nname = \"load\"\nkey = \"phase.push.pressure.1.value\"\nvalues = [20.0, 30.0, 100.0]\n\
                [[parameter]]\nname = \"label\"\nkey = \"title\"\nvalues = [\"nan\", \"inf\"]\n\
                [outputs]\nfinal = { probe = \"PROBE\" }\nearly = { probe = \"PROBE\", take = \"max\" }\n";
    let probe = sliding();
    let (_, probes) = probe.split_once("[probes]").unwrap();
    let probe = probes.trim().split([' ', '=', '.']).next().unwrap();
    place.write("study.toml", grid.replace("PROBE", probe));
    study(&place, &[]).ended(DONE);
    let report = place.read("out/report.html");
    has(&report, "The grid has holes, 2 of 6 runs");
    assert!(!report.contains("The share is η²"));
    let (_, data) = report.split_once("id=\"data\">").unwrap();
    let data: serde_json::Value =
        serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
    let final_numbers = data["outputs"][0]["numbers"].as_array().unwrap();
    let there: Vec<bool> = final_numbers.iter().map(|n| !n.is_null()).collect();
    assert_eq!(there, [true, true, true, true, false, false]);
    // Texts that look like numbers that are none.
    assert_eq!(
        data["parameters"][1]["texts"],
        serde_json::json!(["nan", "inf"])
    );
}

/// A run without its results is not done.
#[test]
fn an_emptied_history_is_carried_out_again() {
    let place = place(STUDY);
    study(&place, &[]).ended(DONE);
    let history = place.path("out/00002/history.csv");
    let expected = std::fs::read(&history).unwrap();
    let header = expected.iter().position(|&byte| byte == b'\n').unwrap() + 1;
    for rest in [&[][..], &expected[..header]] {
        std::fs::write(&history, rest).unwrap();
        assert_eq!(column(&table(&place), "status")[1], "lost");
        let again = study(&place, &[]).ended(DONE);
        has(&again.stderr, "6 runs, 5 of them done already");
        assert_eq!(std::fs::read(&history).unwrap(), expected);
    }
}

/// Its library was built once more: a run that is done is not called failed for it, nor begun again.
#[test]
fn a_run_that_is_done_outlives_its_library() {
    let place = place(STUDY);
    let name = format!("{DLL_PREFIX}coulomb_joint{DLL_SUFFIX}");
    let ours = std::env::current_exe().unwrap().with_file_name(&name);
    let library = std::fs::read(ours).unwrap();
    place.write(&format!("laws/{name}"), &library);
    place.write("case.toml", format!("law_path = [\"laws\"]\n{CASE}"));
    study(&place, &["--run", "1"]).ended(DONE);
    let history = std::fs::read(place.path("out/00001/history.csv")).unwrap();
    place.write(
        &format!("laws/{name}"),
        [library.as_slice(), b"\0"].concat(),
    );
    for _ in 0..2 {
        study(&place, &["--run", "1"]).ended(BAD_INPUT);
        assert_eq!(column(&table(&place), "status")[0], "done");
    }
    let kept = std::fs::read(place.path("out/00001/history.csv")).unwrap();
    assert_eq!(kept, history);
}

/// One library next to another: a run that was planned, and not carried out before the library was built once more, is
/// not put next to those of the earlier one.
#[test]
fn a_planned_run_is_refused_beside_runs_of_an_earlier_library() {
    let place = place(STUDY);
    let name = format!("{DLL_PREFIX}coulomb_joint{DLL_SUFFIX}");
    let ours = std::env::current_exe().unwrap().with_file_name(&name);
    let library = std::fs::read(ours).unwrap();
    let build = |more: &[u8]| {
        place.write(&format!("laws/{name}"), [library.as_slice(), more].concat());
    };
    build(b"");
    place.write("case.toml", format!("law_path = [\"laws\"]\n{CASE}"));
    study(&place, &["--run", "1"]).ended(DONE);
    study(&place, &["--run", "3"]).ended(DONE);
    build(b"\0");
    for more in [&["--run", "2"][..], &["--run", "3", "--anew"]] {
        let refused = study(&place, more).ended(BAD_INPUT);
        let says = "out/00001: it holds a run of another case, with other values, libraries";
        refused.shows(says);
    }
    let status = column(&table(&place), "status").join(" ");
    assert_eq!(status, "done planned done planned planned planned");
    // With the earlier one the study goes on; one whose runs are all of the other is of that.
    build(b"");
    study(&place, &["--run", "2"]).ended(DONE);
    study(&place, &["--anew", "--plan"]).ended(DONE);
    study(&place, &["--run", "1"]).ended(DONE);
    build(b"\0");
    study(&place, &["--run", "1", "--anew"]).ended(DONE);
    study(&place, &["--run", "2"]).ended(DONE);
    study(&place, &[]).ended(DONE);
}

/// A law that crashes the process is a row like any other.
#[test]
fn a_law_that_crashes_is_a_row_and_the_others_go_on() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("segfault"));
    place.write(
        "study.toml",
        "case = \"case.toml\"\nmethod = \"list\"\n[[parameter]]\nname = \"limit\"\n\
         key = \"laws.joint.parameters.limit\"\nvalues = [1.0, 1e-6, 1.0]\n",
    );
    study(&place, &[]).ended(DONE);
    let table = table(&place);
    assert_eq!(
        column(&table, "status"),
        ["done", "plugin trouble", "done"],
        "{table}"
    );
}
