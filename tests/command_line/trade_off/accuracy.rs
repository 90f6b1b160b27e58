//! `accuracy` in a case file.

use super::{COLUMN, HARDENING, Row, history, number, studied};
use crate::program::{NO_EQUILIBRIUM, Outcome, Place, edited, refuses};
use crate::troubled;
use tests::or_skip;

#[test]
fn refuses_accuracies_that_are_none() {
    refuses(
        r#"
zero
  analysis => accuracy = ^0.0\nanalysis
  `accuracy`: 0.0 is outside (0, 0.5]
more than a half
  analysis => accuracy = ^0.6\nanalysis
  `accuracy`: 0.6 is outside (0, 0.5]
negative
  analysis => accuracy = ^-0.01\nanalysis
  `accuracy`: -0.01 is outside (0, 0.5]
a text
  analysis => accuracy = ^"high"\nanalysis
  `accuracy`: found the text "high", expected a number
the mesh as a part of nothing
  analysis => accuracy_with_mesh = ^true\nanalysis
  `accuracy_with_mesh` counts the error of the mesh as part of `accuracy`, and there is none
  `accuracy = 0.02`
"#,
    );
}

#[test]
fn an_accuracy_that_was_asked_for_is_reached() {
    let place = Place::new();
    let asked = 0.01;
    let text = edited(HARDENING).replacen("analysis", "accuracy = 0.01\nanalysis", 1);
    place.done_case(text);
    let summary = place.summary();
    let chosen = &summary["accuracy"];
    assert_eq!(chosen["asked"], 0.01);
    assert_eq!(chosen["is_reached"], true);
    assert!(chosen["reached"].as_f64().unwrap() <= asked);
    let n = chosen["increments"][1][1].as_u64().unwrap() as usize;
    let run = history(&place, "out", n);

    // Independent of the study: 32 times the increments chosen, tight tolerances.
    let finer = 32 * n;
    let mut fine = edited(HARDENING);
    let solver = "[solver]\nforce_tolerance = 1e-11\ndisplacement_tolerance = 1e-9\n";
    fine = fine.replacen("[solver]\n", solver, 1);
    fine = fine.replacen("increments = 8", &format!("increments = {finer}"), 1);
    place.write("fine.toml", fine);
    place.done(&["run", "fine.toml", "--out", "fine"]);
    let fine = history(&place, "fine", finer);
    for probe in ["settlement", "tau"] {
        let largest = fine
            .iter()
            .map(|r| number(r, probe).abs())
            .fold(0.0, f64::max);
        for (i, row) in run.iter().enumerate() {
            let expected = number(&fine[32 * (i + 1) - 1], probe);
            let error = (number(row, probe) - expected).abs() / largest;
            assert!(error <= asked, "{probe}, increment {}: {error}", i + 1);
        }
    }
}

/// A case whose layer softens along its path, explicitly, and refuses increments of less time than it is
/// compiled with: of 8 s in 8 increments.
fn softening(first: &str) -> String {
    // Four, so that each phase has three different ones among a quarter, half and all of them.
    let edits = format!(
        r"limit = 1.0e-6 => limit = 1.0
analysis => {first}\nanalysis
increments = 2\npressure => increments = 4\ntime = 100.0\npressure
increments = 2\ndisplacement => increments = 8\ntime = 8.0\ndisplacement"
    );
    tests::words::edited(&troubled::case("cut"), &edits.lines().collect::<Vec<_>>())
}

/// The outcome of the study for an error of 1e-5 where more increments than some find no equilibrium, and
/// what the summary says of it.
fn refused(least_time: &'static str) -> Option<(Place, Outcome, serde_json::Value)> {
    let place = troubled::place(least_time)?;
    let (outcome, chosen) = studied(&place, softening("accuracy = 1e-5"));
    Some((place, outcome, chosen))
}

#[test]
fn finer_trials_that_fail_leave_the_best_one_with_its_error() {
    // A quarter, half and all of the increments tell the error of the last.
    let (place, outcome, chosen) = or_skip!(refused("LEAST_TIME=0.75"));
    outcome.shows("warning: the accuracy is not reached: error");
    outcome.shows("(accuracy.csv has why): increments × 2; increments × 4;");
    outcome.shows("run 4 failed: phase `push`");
    assert_eq!(chosen["verdict"], "not reached");
    let report = place.read("out/report.html");
    assert!(report.contains("accuracy 0.00001 not reached, error "));
    assert_eq!(chosen["is_reached"], false);
    assert_eq!(chosen["increments"][1][1], 8);
    let failed = chosen["failed"].as_array().unwrap();
    assert_eq!(failed[0]["setting"], "increments × 2");
    assert!(
        failed[0]["reason"]
            .as_str()
            .unwrap()
            .contains("too little time passes")
    );
    let run = history(&place, "out", 8);

    // Truth: 128 times as many increments of a law that refuses none.
    let place = or_skip!(troubled::place("LEAST_TIME=1e-9"));
    let finer = softening("").replacen("increments = 8", "increments = 1024", 1);
    place.done_case(finer);
    let fine = history(&place, "out", 1024);
    let error = |probe: &str| {
        let of = |rows: &[Row]| -> Vec<f64> { rows.iter().map(|r| number(r, probe)).collect() };
        let (run, fine) = (of(&run), of(&fine));
        let largest = fine.iter().copied().map(f64::abs).fold(0.0, f64::max);
        let errors = run.iter().zip(fine.iter().skip(127).step_by(128));
        let errors = errors.map(|(a, b)| (a - b).abs() / largest);
        errors.fold(0.0, f64::max)
    };
    let error = error("settlement").max(error("tau"));
    let estimated = chosen["reached"].as_f64().unwrap();
    // First order: what is estimated is the error but for what is left at 128 times the increments, and
    // differences at fewer rows.
    assert!((estimated / error - 1.0).abs() < 0.2, "{estimated} {error}");
}

#[test]
fn an_accuracy_that_too_few_trials_tell_is_not_known() {
    let (place, outcome, chosen) = or_skip!(refused("LEAST_TIME=1.5"));
    outcome.shows("warning: it is not known whether the accuracy is reached");
    outcome.shows("differ by");
    assert_eq!(chosen["verdict"], "not known");
    assert!(chosen["reached"].is_null());
    assert!(chosen["difference"].as_f64().unwrap() > 1e-5);
    assert_eq!(history(&place, "out", 4).len(), 4);

    let (place, outcome, chosen) = or_skip!(refused("LEAST_TIME=3.0"));
    outcome.shows("a single run came to its end");
    assert_eq!(chosen["verdict"], "not known");
    assert!(chosen["difference"].is_null());
    assert_eq!(history(&place, "out", 2).len(), 2);

    // Nothing is known where no trial comes to its end.
    let place = or_skip!(troubled::place("LEAST_TIME=5.0"));
    place
        .run_case(softening("accuracy = 1e-5"))
        .ended(NO_EQUILIBRIUM);
}

#[test]
fn an_accuracy_with_the_mesh_is_reached_on_a_finer_one() {
    let place = Place::new();
    let asked = "accuracy = 0.1\naccuracy_with_mesh = true\nanalysis";
    let (outcome, chosen) = studied(&place, edited(HARDENING).replacen("analysis", asked, 1));
    assert_eq!(chosen["verdict"], "reached", "{}", outcome.stderr);
    let reached = chosen["reached"].as_f64().unwrap();
    let parts = [&chosen["without_mesh"], &chosen["mesh"]["error"]];
    let sum: f64 = parts.iter().map(|part| part.as_f64().unwrap()).sum();
    assert!(reached <= 0.1 && (sum - reached).abs() < 1e-12, "{chosen}");
    assert!(
        chosen["mesh"]["divided_by"].as_u64().unwrap() > 1,
        "{chosen}"
    );
    let n = chosen["increments"][1][1].as_u64().unwrap() as usize;
    let run = history(&place, "out", n);

    // Independent of the study: sixteen times as many elements each way, but across the layer, in 128
    // increments.
    let mut fine = edited(HARDENING);
    for (from, to) in [
        ("{ n = 1, to = 1.0 }", "{ n = 16, to = 1.0 }"),
        ("{ n = 1, to = 2.0 }", "{ n = 16, to = 2.0 }"),
        ("rows = [{ n = 2", "rows = [{ n = 32"),
        ("increments = 8", "increments = 128"),
    ] {
        assert!(fine.contains(from), "{from}");
        fine = fine.replacen(from, to, 1);
    }
    place.done_case(&fine);
    let fine = history(&place, "out", 128);
    place.done_case(edited(HARDENING));
    let file = history(&place, "out", 8);
    let error = |rows: &[Row], probe: &str| {
        let every = fine.len() / rows.len();
        let exact: Vec<f64> = fine.iter().map(|row| number(row, probe)).collect();
        let largest = exact.iter().copied().map(f64::abs).fold(0.0, f64::max);
        let errors = rows.iter().zip(exact.chunks(every));
        let errors = errors.map(|(row, exact)| (number(row, probe) - exact[every - 1]).abs());
        errors.fold(0.0, f64::max) / largest
    };
    for probe in ["settlement", "tau"] {
        assert!(error(&run, probe) <= 0.1, "{probe}: {}", error(&run, probe));
    }
    // The file's own mesh does not do.
    assert!(error(&file, "tau") > 0.1, "{}", error(&file, "tau"));
}

#[test]
fn the_error_of_a_mesh_that_no_finer_one_tells_is_not_known() {
    let place = Place::new();
    // The middle of an element is a point of the law, and none of four smaller ones.
    let probe = r#"[probes] => [probes]\nmiddle = { group = "soil", quantity = "stress_22", x = [0.499, 0.501], y = [0.249, 0.251] }"#;
    let text = edited(&[
        "analysis => accuracy = 0.1\naccuracy_with_mesh = true\nanalysis",
        probe,
    ]);
    let (outcome, chosen) = studied(&place, text);
    assert_eq!(chosen["verdict"], "not known", "{}", outcome.stderr);
    assert!(
        chosen["mesh"]["error"].is_null() && chosen["reached"].is_null(),
        "{chosen}"
    );
    assert!(chosen["without_mesh"].as_f64().unwrap() <= 0.05, "{chosen}");
    outcome.shows("error of the mesh: none, there is no finer mesh to tell it; mesh / 2 failed");
    let failed = chosen["failed"].as_array().unwrap();
    assert!(
        failed
            .iter()
            .any(|f| f["setting"].as_str().unwrap().contains("mesh / 2")),
        "{chosen}"
    );
}

/// The largest stress below a stiff punch, which has no bound at its edge.
#[test]
fn meshes_that_diverge_have_no_error() {
    let place = Place::new();
    let text = COLUMN
        .replace(
            "accuracy = 0.01",
            "accuracy = 0.02\naccuracy_with_mesh = true",
        )
        .replace(
            "columns = [{ n = 2, to = 1.0 }]",
            "columns = [{ n = 1, to = 1.0 }, { n = 1, to = 2.0 }]",
        )
        .replace("top = { y = 1.0 }", "top = { y = 1.0, x = [0.0, 1.0] }")
        .replace(
            "pressure = [{ line = \"top\", value = 77.7 }]",
            "displacement = [{ line = \"top\", x = 0.0, y = -0.01 }]",
        );
    let (probes, _) = text.split_once("[probes]").unwrap();
    let text = format!(
        "{probes}[probes]\nedge = {{ group = \"soil\", quantity = \"stress_22\", reduce = \"min\" }}\n"
    );
    let (outcome, chosen) = studied(&place, text);
    assert_eq!(chosen["verdict"], "not known", "{}", outcome.stderr);
    assert!(
        chosen["mesh"]["error"].is_null() && chosen["mesh"]["worst"] == "edge",
        "{chosen}"
    );
    outcome.shows("the results do not converge under refinement");
    outcome.shows("the runs differ most in `edge`");
}
