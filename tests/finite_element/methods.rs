//! Methods of iteration.
//!
//! Goal        all methods reach the same equilibrium, the slower ones with more iterations and fewer matrices.
//!             Counters show that nothing is computed or kept without need.
//! Geometry    the chamber of `cases/chamber_mesh1`; a strip footing.
//! Boundary    as there: the first fifth of the loading; a push beyond first yield.
//! Law         mepi in a thin layer; mohr_coulomb.
//! Asserts     probes within ten times the force tolerance (for each increment so far) of full Newton's;
//!             iterations, factorisations, law calls and bytes of `summary.json`.

use crate::footing::{FRICTION, Footing};
use crate::setup::{Finished, Results, run};
use std::path::Path;
use tests::words::has;

const TOLERANCE: f64 = 1e-9;
const KEPT: [&str; 4] = ["auto", "modified_newton", "initial_stress", "quasi_newton"];

fn chamber(method: &str) -> Finished {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_mesh1/case.toml");
    let text = std::fs::read_to_string(path).unwrap();
    // The head is held while the law is swapped: free, it hangs on the friction that the swap takes away, and there
    // `modified_newton` goes to and fro between two pieces of the law, at corrections four times the tolerance.
    let swap = "laws = { interface = \"mepi\" }";
    let held = format!(
        "{swap}\nreset_displacements = true\ndisplacement = [{{ line = \"pile_head\", z = 0.0 }}]"
    );
    assert_eq!(text.matches(swap).count(), 1);
    let text = text
        .replace(swap, &held)
        .replace("increments = 50", "increments = 10")
        .replace("-0.005", "-0.001")
        .replace("fields = \"phases\"", "");
    run(&with_method(&text, method))
}

fn with_method(text: &str, method: &str) -> String {
    format!("{text}\n[solver]\nmethod = \"{method}\"\nforce_tolerance = {TOLERANCE:e}\n")
}

/// A count of the last phase.
fn count(finished: &Finished, what: &str) -> u64 {
    let summary = finished.summary();
    let phase = summary["phases"].as_array().unwrap().last().unwrap();
    phase[what].as_u64().expect("a count")
}

/// The same curves, and more iterations with fewer matrices.
fn assert_alike(newton: &Finished, other: &Finished, method: &str, probes: &[&str]) {
    assert_eq!(other.observer.cut_backs, 0, "{method}");
    for probe in probes {
        let (expected, found) = (newton.history(probe), other.history(probe));
        let largest = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        assert_eq!(expected.len(), found.len());
        // Every increment adds an error of its own.
        for (i, (expected, found)) in (1_u32..).zip(expected.iter().zip(&found)) {
            assert!(
                (found - expected).abs() <= 10.0 * f64::from(i) * TOLERANCE * largest,
                "{method}, {probe}: {found:e}, expected {expected:e}"
            );
        }
    }
    for what in ["iterations", "factorisations"] {
        let [few, many] = [count(newton, what), count(other, what)];
        let more = what == "iterations";
        assert!((many > few) == more, "{method}, {what}: {few}, {many}");
    }
}

#[test]
fn methods_agree_in_the_chamber() {
    let newton = chamber("newton");
    assert!(newton.end_of("loading", "tau_shaft").abs() > 50.0);
    for method in KEPT {
        let other = chamber(method);
        assert_alike(
            &newton,
            &other,
            method,
            &["q_t", "tau_shaft", "sigma_n_shaft"],
        );
        if method == "initial_stress" {
            // The elastic interface; the linear groups are condensed since the swap, which holds the same nodes.
            assert_eq!(count(&other, "factorisations"), 1);
        }
    }
}

#[test]
fn methods_agree_under_a_footing() {
    let footing = Footing {
        n: 4,
        settlement: 0.05,
        increments: 5,
        ..FRICTION
    };
    let push = |method| run(&with_method(&crate::footing::text(footing), method));
    let newton = push("newton");
    let pressure = newton.history("pressure");
    assert!(
        pressure[4] - pressure[3] < 0.9 * pressure[0],
        "hardly any yield: {pressure:?}"
    );
    for method in KEPT {
        let other = push(method);
        assert_alike(&newton, &other, method, &["pressure"]);
        if method == "initial_stress" {
            assert_eq!(count(&other, "factorisations"), 1);
            let calls = &other.summary()["law_calls"]["ground"];
            let points = 8 * 12 * 4;
            assert_eq!(calls["operators"], points);
            assert!(calls["points"].as_u64().unwrap() > 100 * points, "{calls}");
        }
    }
}

#[test]
fn a_slow_method_that_runs_out_of_iterations_has_not_converged() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_mesh1/case.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let text = with_method(&text, "initial_stress") + "max_iterations = 5\nmax_halvings = 1\n";
    let failed = crate::setup::fail(&text);
    assert_eq!(failed.error.exit_code(), 2);
    has(failed.error.to_string(), "after 5 iterations");
}

#[test]
fn linear_equations_are_factorised_once() {
    let text = crate::footing::text(Footing { n: 4, ..FRICTION });
    let start = text.find("law = \"mohr_coulomb\"").unwrap();
    let end = text.find("[groups]").unwrap();
    let elastic =
        "law = \"elastic\"\nparameters = { young_modulus = 200.0, poisson_ratio = 0.3 }\n";
    let text = format!("{}{elastic}{}", &text[..start], &text[end..]);
    for equations in ["sparse", "condensed"] {
        let finished = run(&format!("{text}\n[solver]\nequations = \"{equations}\"\n"));
        assert_eq!(count(&finished, "increments"), 12);
        assert_eq!(count(&finished, "factorisations"), 1, "{equations}");
    }
}

#[test]
fn nothing_is_computed_or_kept_without_need() {
    let finished = chamber("newton");
    let summary = finished.summary();
    for group in ["sand", "pile", "plate"] {
        assert_eq!(summary["law_calls_by_group"][group], 1, "{group}");
        assert_eq!(summary["operators_by_group"][group], 1, "{group}");
        let bytes = &summary["state_bytes"][group];
        assert_eq!(bytes["internal"], 0, "{group}");
        // One element's, of 3 × 3 points and 4 × 4 numbers.
        assert_eq!(bytes["tangents"], 9 * 16 * 8, "{group}");
    }
    // Laws that are called: those the case names, the interface's being elastic at first.
    let named = |key: &str| -> Vec<String> {
        let laws = summary[key].as_object().unwrap();
        laws.keys().cloned().collect()
    };
    assert_eq!(named("law_calls"), ["mepi", "sand", "steel"]);
    let laws = summary["laws"].as_object().unwrap().values();
    assert!(
        laws.map(|law| &law["law"])
            .all(|id| id == "elastic" || id == "mepi")
    );
    // Tangents are left out where the last iteration is foreseen.
    let calls = &summary["law_calls"]["mepi"];
    let [points, operators] = ["points", "operators"].map(|key| calls[key].as_u64().unwrap());
    assert!(operators < points, "{calls}");
    let fields = std::fs::read_dir(finished.folder()).unwrap();
    let fields = fields.filter(|file| {
        let name = file.as_ref().unwrap().file_name();
        name.to_string_lossy().starts_with("fields")
    });
    assert_eq!(fields.count(), 0);
}
