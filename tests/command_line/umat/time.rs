//! The time that routines are given: of segments, of phases, over cut-backs and checkpoints.
//!
//! The routine is a Maxwell body by backward Euler: with τ the relaxation time, a strain that is held
//! for T in n increments leaves σ₀ (1 + T/(n τ))⁻ⁿ, which tends to σ₀ e^(−T/τ).

use super::{Place, number, place, rows, soil};
use crate::program::edited;
use std::time::{Duration, Instant};
use tests::case::table;
use tests::or_skip;
use tests::tolerance::close;
use tests::tolerance::near;
use tests::words::rows_of;

const TAU: f64 = 1000.0;

/// A squeeze in no time to speak of, then what the second segment says.
fn driver(second: &str) -> String {
    format!(
        "law = \"umat_maxwell\"\nadapter = \"umat\"\nlibrary = \"libmaxwell.so\"\n\
         hypothesis = \"axisymmetric\"\n\
         parameters = {{ young_modulus = 2e4, relaxation_time = {TAU:?}, longest = 1e30 }}\n\
         [[segment]]\nincrements = 1\ntime = 1e-6\ncontrol = {{ 22 = {{ strain = -1e-3 }} }}\n\
         [[segment]]\n{second}\n"
    )
}

/// The stress at the end of 3000 s at the strain of the squeeze.
fn relaxed(place: &Place, increments: usize) -> f64 {
    let text = driver(&format!(
        "increments = {increments}\ntime = 3000.0\ncontrol = {{ 22 = {{ strain = -1e-3 }} }}"
    ));
    number(rows(place, &text).last().unwrap(), "stress_22")
}

#[test]
fn a_strain_that_is_held_relaxes_as_backward_euler_has_it() {
    let place = or_skip!(place("maxwell"));
    let start = -20.0 / (1.0 + 1e-6 / TAU);
    let exact = start * f64::exp(-3.0);
    let mut errors = Vec::new();
    for n in [10, 100, 1000, 2000] {
        let found = relaxed(&place, n);
        let euler = start * (1.0 + 3000.0 / (n as f64 * TAU)).powi(-(n as i32));
        near(found, euler, 1e-9 * euler.abs());
        errors.push((found - exact).abs());
    }
    // Of first order: twice the increments, half the error, with the next term T/(n τ) of it.
    let ratio = errors[3] / errors[2];
    assert!((ratio - 0.5).abs() < 2e-3, "{errors:?}");
    assert!(errors[3] < 2.5e-3 * exact.abs(), "{errors:?}");
}

#[test]
fn a_stress_that_is_held_creeps_in_proportion_to_the_time() {
    let place = or_skip!(place("maxwell"));
    // ε̇ = σ/(E τ): backward Euler is exact, whatever the increments.
    for n in [1, 7] {
        let text = driver(&format!("increments = {n}\ntime = 2500.0\ncontrol = {{}}"));
        let rows = rows(&place, &text);
        let (start, end) = (&rows[1], rows.last().unwrap());
        let stress = number(start, "stress_22");
        let creep = number(end, "strain_22") - number(start, "strain_22");
        let expected = stress / 2e4 * 2500.0 / TAU;
        close(n, creep, expected, 1e-9 * expected.abs());
    }
}

#[test]
fn time_and_dtime_are_those_of_the_segment() {
    let place = or_skip!(place("maxwell"));
    let text = driver("increments = 5\ntime = 3000.0\ncontrol = { 22 = { strain = -1e-3 } }")
        + "[[segment]]\nincrements = 2\ncontrol = { 22 = { strain = 0.0 } }\n";
    let rows = rows(&place, &text);
    // Time at the end; TIME(1), TIME(2) at the start; DTIME. Without `time` an increment takes 1.
    let squeezed = 1e-6;
    let mut expected = vec![[squeezed, 0.0, 0.0, squeezed]];
    for k in 0..5 {
        let start = 600.0 * f64::from(k);
        expected.push([squeezed + start + 600.0, start, squeezed + start, 600.0]);
    }
    let third = squeezed + 3000.0;
    expected.push([third + 1.0, 0.0, third, 1.0]);
    expected.push([third + 2.0, 1.0, third + 1.0, 1.0]);
    assert_eq!(rows.len(), 1 + expected.len());
    assert_eq!(number(&rows[0], "time"), 0.0);
    for (row, expected) in rows[1..].iter().zip(expected) {
        let columns = ["time", "step_time", "total_time", "dtime"];
        for (column, expected) in columns.into_iter().zip(expected) {
            let found = number(row, column);
            close(column, found, expected, 1e-9);
        }
    }
    let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
    let said = "law `umat_maxwell` depends on the time, and segment 3 says none";
    outcome.shows(said);
    // A driver without any has the columns that it always had.
    let start = text.find("time = 1e-6").unwrap();
    let untimed = text[..start].to_owned() + "control = { 22 = { strain = -1e-3 } }\n";
    let rows = super::rows(&place, &untimed);
    assert!(!rows[0].contains_key("time"));
    assert_eq!(number(&rows[1], "dtime"), 1.0);
}

#[test]
fn steps_of_an_increment_share_its_time() {
    let place = or_skip!(place("maxwell"));
    let text = driver("increments = 3\ntime = 3000.0\ncontrol = { 22 = { strain = -1e-3 } }")
        .replacen("longest = 1e30", "longest = 260.0", 1);
    let rows = rows(&place, &text);
    let end = rows.last().unwrap();
    assert!(number(end, "dtime") <= 260.0 && number(end, "iterations") > 3.0);
    let passed = number(end, "passed");
    assert!((passed - 3_000.000_001).abs() < 1e-8, "{passed}");
    // All steps are at least as short, so the result is nearer to the exact one.
    let exact = -20.0 * f64::exp(-3.0);
    let error = |stress: f64| (stress - exact).abs();
    let found = number(end, "stress_22");
    assert!(error(found) < error(relaxed(&place, 9)), "{found}");
    assert!(error(found) > error(relaxed(&place, 100)), "{found}");
}

/// The block without its layer, its top pushed down in 2 s and held for 3000 s.
fn held(parameters: &str, phase: &str) -> String {
    let push: &[&str] = &[
        r#"[[mesh.region]]\ngroup = "layer"\nx = [1.0, 1.01]\n => "#,
        r#"[groups.layer]\nformulation = "thin_layer"\nlaw = "joint"\n => "#,
        "[probes]\n => [probes]\nstress = { group = \"soil\", quantity = \"stress_22\" }\n\
            passed = { group = \"soil\", quantity = \"passed\", reduce = \"max\" }\n\
            step_time = { group = \"soil\", quantity = \"step_time\" }\ntotal_time = { group = \"soil\", \
            quantity = \"total_time\" }\ndtime = { group = \"soil\", quantity = \"dtime\" }\n",
        r#"tau = { group = "layer", quantity = "traction_t" }\nhalf = { combine = { tau = 0.5 } }\n => "#,
        "[[supports]]\nline = \"bottom\"\nfixed = [\"x\", \"y\"]\n => [[supports]]\n\
            line = \"bottom\"\nfixed = [\"y\"]\n[[supports]]\nline = \"left\"\n\
            fixed = [\"x\"]\n[[supports]]\nline = \"right\"\nfixed = [\"x\"]\n",
    ];
    let text = edited(push);
    let (head, rest) = text.split_once("[[phase]]").unwrap();
    let probes = rest.split_once("[probes]").unwrap().1;
    let joint = head.find("[laws.joint]").unwrap();
    let groups = head.find("[groups.soil]").unwrap();
    let head = format!("{}{}", &head[..joint], &head[groups..]);
    let text = format!(
        "{head}[[phase]]\nname = \"push\"\nincrements = 4\ntime = 2.0\n\
         displacement = [{{ line = \"top\", y = -1e-3 }}]\n\n\
         [[phase]]\nname = \"hold\"\n{phase}\n\n[probes]{probes}"
    );
    let law = format!(
        "law = \"umat_maxwell\"\nadapter = \"umat\"\nlibrary = \"libmaxwell.so\"\n\
         parameters = {{ young_modulus = 1e4, poisson_ratio = 0.3, relaxation_time = {TAU:?}{parameters} }}"
    );
    text.replacen(
        "law = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }",
        &law,
        1,
    )
}

/// The vertical stress of the block after `n` increments of the second phase: oedometric, so that a
/// strain increment adds M Δε and every increment divides by its 1 + Δt/τ.
fn in_theory(n: i32, length: f64) -> f64 {
    let modulus = 1e4 * 0.7 / (1.3 * 0.4);
    let pushed = 1.0 + 0.5 / TAU;
    let start: f64 = (1..=4).map(|k| -2.5e-4 * modulus / pushed.powi(k)).sum();
    start * (1.0 + length / f64::from(n.max(1)) / TAU).powi(-n)
}

#[test]
fn a_phase_gives_its_time_to_its_increments() {
    let place = or_skip!(place("maxwell"));
    let outcome = place.done_case(held("", "increments = 6\ntime = 3000.0"));
    outcome.hides("depends on the time");
    let rows = table(&place.path("out/history.csv"));
    assert_eq!(rows.len(), 10);
    let near = |found: f64, expected: f64, what: &str| {
        close(what, found, expected, 1e-8 * expected.abs().max(1e-3));
    };
    for (k, row) in rows[..4].iter().enumerate() {
        let start = 0.5 * k as f64;
        near(number(row, "time"), start + 0.5, "time");
        near(number(row, "step_time"), start, "TIME(1)");
        near(number(row, "dtime"), 0.5, "DTIME");
    }
    near(number(&rows[3], "stress"), in_theory(0, 0.0), "pushed");
    for (k, row) in rows[4..].iter().enumerate() {
        let start = 500.0 * k as f64;
        near(number(row, "time"), 2.0 + start + 500.0, "time");
        near(number(row, "step_time"), start, "TIME(1)");
        near(number(row, "total_time"), 2.0 + start, "TIME(2)");
        near(number(row, "dtime"), 500.0, "DTIME");
    }
    near(number(&rows[9], "stress"), in_theory(6, 3000.0), "held");
    near(number(&rows[9], "passed"), 3002.0, "passed");
}

#[test]
fn a_phase_that_is_cut_shares_its_time() {
    let place = or_skip!(place("maxwell"));
    place.done_case(held(", longest = 130.0", "increments = 6\ntime = 3000.0"));
    let rows = table(&place.path("out/history.csv"));
    let end = rows.last().unwrap();
    let passed = number(end, "passed");
    assert!((passed - 3002.0).abs() < 1e-6, "{passed}");
    assert!(number(end, "dtime") <= 130.0);
    let cut = place.summary()["phases"][1]["cut_backs"].as_u64().unwrap();
    assert!(cut > 0);
    // 500 s in four steps of 125 s, or more that are shorter.
    let (coarse, fine) = (in_theory(24, 3000.0), in_theory(100_000, 3000.0));
    let found = number(end, "stress");
    assert!(
        (found - fine).abs() < 1.0001 * (coarse - fine).abs(),
        "{found} {coarse} {fine}"
    );
}

#[test]
fn a_run_that_is_killed_goes_on_in_time() {
    let place = or_skip!(place("maxwell"));
    let text = held("", "increments = 400\ntime = 3000.0");
    place.write("block.toml", &text);
    let arguments = ["run", "block.toml", "--out", "out", "--checkpoint", "0"];
    let mut child = place.start(&arguments);
    let started = Instant::now();
    let rows_now = || {
        let text = std::fs::read_to_string(place.path("out/history.csv")).unwrap_or_default();
        text.lines().count()
    };
    while rows_now() < 60 && started.elapsed() < Duration::from_mins(1) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(rows_now() < 405, "it was not killed on its way");
    let mut resumed = arguments.to_vec();
    resumed.push("--resume");
    place.done(&resumed);
    let rows = table(&place.path("out/history.csv"));
    assert_eq!(rows.len(), 404);
    let times: Vec<f64> = rows[4..].iter().map(|row| number(row, "time")).collect();
    for (k, time) in (1..).zip(times) {
        let expected = 2.0 + 7.5 * f64::from(k);
        near(time, expected, 1e-9 * expected);
    }
    let found = number(rows.last().unwrap(), "stress");
    let expected = in_theory(400, 3000.0);
    near(found, expected, 1e-8 * expected.abs());
}

#[test]
fn a_phase_without_a_time_is_told_of() {
    let place = or_skip!(place("maxwell"));
    let outcome = place.done_case(held("", "increments = 2"));
    let said = "phase `hold` has no `time`, and law `soil` depends on time: the phase takes 1 unit of time";
    outcome.shows(said).hides("phase `push` has no `time`");
    let rows = table(&place.path("out/history.csv"));
    assert_eq!(number(rows.last().unwrap(), "time"), 3.0);
    // A routine that says nothing of the time is not asked about it.
    let elastic = or_skip!(super::place("elastic"));
    let outcome = elastic.done_case(soil("elastic", ""));
    outcome.hides("depends on the time");
}

#[test]
fn times_that_cannot_be_are_refused_at_their_place() {
    let place = or_skip!(place("maxwell"));
    for [time, said] in rows_of(
        r#"
0.0 | `time` is 0, expected above 0
-3.0 | `time` is -3, expected above 0
nan | `time`: nan is no finite number
1e21 | `time` is 1000000000000000000000, expected above 0 and at most 1e20
"1 h" | `time`: found the text "1 h", expected a number
"#,
    ) {
        place.write(
            "driver.toml",
            driver(&format!("increments = 2\ntime = {time}\ncontrol = {{}}")),
        );
        let outcome = place.refused(&["point", "driver.toml", "--csv", "out.csv"]);
        outcome.shows(said);
        outcome.shows("driver.toml:12:8");
        let outcome = place.refused_case(held("", &format!("increments = 2\ntime = {time}")));
        outcome.shows(said);
        outcome.shows(format!("time = {time}"));
    }
}
