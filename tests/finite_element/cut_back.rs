//! Cut-backs and limit loads.
//!
//! Goal        smaller steps do not change the result. A load beyond the limit ends with an error and with all
//!             results up to there.
//! Geometry    the strip footing; the thick cylinder.
//! Boundary    as there; the cylinder under pressure from inside.
//! Law         mohr_coulomb.
//! Asserts     equal limits with and without cut-backs; reports of steps against runs with other steps; error, exit
//!             code, history, summary.

use crate::footing::{FRICTION, Footing, push, text};
use crate::setup::{Results, assert_close, fail, run};
use crate::thick_cylinder;
use input::case::CaseFile;
use input::{Case, Kind};
use mechanics::Simulation;
use tests::case::table;
use text::{Source, parse};

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
    cut.ends_at("settlement", footing.settlement, 1e-15, 1.0);
    assert_eq!(cut.history("pressure").len(), 3);
    let summary = cut.summary();
    let recorded = summary["phases"][0]["cut_backs"].as_u64().unwrap();
    assert_eq!(recorded as usize, cut.observer.cut_backs);
    assert_eq!(cut.events("cut_back").len(), cut.observer.cut_backs);
}

/// Displacements and nodal forces at the end of a case that starts from nothing.
fn end_of(text: &str) -> [Vec<f64>; 2] {
    let source = Source::new("case.toml", text.to_owned());
    let file: CaseFile = parse(&source).unwrap();
    let case = Case {
        source,
        file,
        variant: None,
        opener: law::Opener::default(),
    };
    let mut simulation = Simulation::new(case.pose().unwrap().problem).unwrap();
    while simulation.step().unwrap().is_some() {}
    let state = simulation.snapshot();
    [state.displacement.to_vec(), state.reaction.to_vec()]
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Where iterations choose the steps, the run says how much results depend on them: of the first step after a
/// cut-back in which something flows what whole and half increments of that length make.
#[test]
fn what_is_said_of_a_step_after_a_cut_back_is_what_half_increments_make() {
    let footing = Footing {
        n: 4,
        increments: 3,
        ..FRICTION
    };
    let cut = run(&(text(footing) + "[solver]\nmax_iterations = 6\n"));
    let said = cut.observer.warnings.iter();
    let said = said.filter(|warning| warning.contains("results depend on the step size"));
    assert_eq!(said.count(), 1, "{:?}", cut.observer.warnings);
    // In the first step that is left nothing flows; the second one is spoken of.
    let iterations = cut.events("iteration");
    let ends = iterations.iter().map(|event| event["load_factor"].as_f64());
    let mut ends: Vec<f64> = ends.map(Option::unwrap).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let at = |load_factor: f64| load_factor * footing.settlement;
    let first = text(Footing {
        increments: 1,
        settlement: at(ends[0]),
        ..footing
    });
    let before = end_of(&first);
    let [whole, halves] = [1, 2].map(|increments| {
        let y = -at(ends[1]);
        let next = format!(
            "[[phase]]\nname = \"next\"\nincrements = {increments}\n\
             displacement = [{{ line = \"strip\", y = {y:?} }}]\n"
        );
        end_of(&(first.clone() + &next))
    });
    let recorded = &cut.summary()["phases"][0]["cut_back_in_halves"];
    for (number, of) in ["displacements", "forces"].into_iter().enumerate() {
        let from_whole = |other: &[Vec<f64>; 2]| distance(&other[number], &whole[number]);
        let apart = from_whole(&halves) / from_whole(&before);
        assert!(apart > 1e-4, "{of}: {apart}");
        assert_close(of, recorded[of].as_f64().unwrap(), apart, 1e-4, apart);
    }
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
