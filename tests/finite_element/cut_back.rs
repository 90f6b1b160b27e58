//! Cut-backs, and the end of what can be carried.
//!
//! Goal        smaller steps do not change the result; a load beyond the limit ends with an
//!             error and with all results up to there
//! Geometry    the strip footing; the thick cylinder
//! Boundary    as there; the cylinder under pressure from inside
//! Law         mohr_coulomb
//! Asserts     equal limits with and without cut-backs; error, exit code, history, summary

use crate::footing::{FRICTION, Footing, push, text};
use crate::setup::{Results, assert_close, fail, run};
use crate::thick_cylinder;
use input::Kind;
use tests::case::table;

#[test]
fn cut_backs_end_where_small_increments_end() {
    // Six iterations are too few for a third of the push at a time.
    let footing = Footing { n: 4, ..FRICTION };
    let few = "[solver]\nmax_iterations = 6\n";
    let cut = run(&(text(Footing {
        increments: 3,
        ..footing
    }) + few));
    let small = push(Footing {
        increments: 48,
        ..footing
    });
    assert!(
        cut.observer.cut_backs >= 2,
        "only {} cut-backs",
        cut.observer.cut_backs
    );
    assert_eq!(small.observer.cut_backs, 0);
    let [a, b] = [&cut, &small].map(|finished| finished.last("pressure"));
    // Limits do not depend on the path; what is left is the slow approach to it.
    assert_close("pressure", a, b, 2e-3, b);
    // Prescribed values are met exactly, and there is one row per increment of the file.
    assert_close(
        "settlement",
        cut.last("settlement"),
        footing.settlement,
        1e-15,
        1.0,
    );
    assert_eq!(cut.history("pressure").len(), 3);
    let summary = cut.summary();
    let recorded = summary["phases"][0]["cut_backs"].as_u64().unwrap();
    assert_eq!(recorded as usize, cut.observer.cut_backs);
    assert_eq!(cut.events("cut_back").len(), cut.observer.cut_backs);
}

#[test]
fn a_pressure_beyond_the_limit_ends_in_no_equilibrium() {
    // Limit 50.87 kPa; 80 kPa in 8 increments of 10.
    let law = "ground = { law = \"mohr_coulomb\", parameters = { young_modulus = 30e3, \
               poisson_ratio = 0.3, cohesion = 50.0, friction_angle = 30.0, \
               dilatancy_angle = 10.0 } }";
    let load = "increments = 8\npressure = [{ line = \"inner\", value = 80.0 }]";
    let failed = fail(&thick_cylinder::text(law, 8, "reduced", load, ""));
    assert!(
        failed.error.kind() == Kind::NoEquilibrium,
        "{}",
        failed.error
    );
    assert_eq!(failed.error.exit_code(), 2);
    // Increments 1 to 5 are there and readable, with the closed form's pressure as the force.
    let pressures = failed.history("force");
    assert_eq!(pressures.len(), 5);
    let path = failed.folder().join("history.csv");
    assert_eq!(table(&path).last().unwrap()["increment"], "5");
    let outer = failed.history("outer");
    assert!(outer.windows(2).all(|pair| pair[1] > pair[0]), "{outer:?}");
    let strength = thick_cylinder::Strength::new(50.0, 30.0);
    let radius = strength.radius(outer[4]);
    assert_close("at 50 kPa", strength.pressure(radius), 50.0, 2e-3, 50.0);
    // The message says how far it got: the limit pressure.
    let message = failed.error.to_string();
    let reached = message
        .split("beyond ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let reached: f64 = reached.expect("the place reached").parse().unwrap();
    assert_close(
        "reached",
        10.0 * reached,
        strength.pressure(thick_cylinder::B),
        2e-3,
        50.0,
    );
    let summary = failed.summary();
    assert_eq!(summary["status"], "no equilibrium");
    assert_eq!(summary["last_equilibrium"]["increment"], 5);
    assert!(
        summary["error"]
            .as_str()
            .unwrap()
            .contains("no equilibrium")
    );
    assert!(summary["phases"][0]["cut_backs"].as_u64().unwrap() > 0);
    let last = summary["probes"]["outer"].as_f64().unwrap();
    assert_close("summary and history", last, outer[4], 1e-15, 1.0);
}
