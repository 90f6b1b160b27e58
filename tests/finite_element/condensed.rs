//! Condensed and assembled equations.
//!
//! Goal        condensing the linear groups changes no results; factors are reused.
//! Geometry    the chamber of `cases/chamber_mesh1`, with its thin layer or a zero-thickness joint.
//! Boundary    as there.
//! Law         elastic ground; mepi, coulomb_joint.
//! Asserts     every probe of every increment within 1e-9 of its largest value; factorisations from `summary.json`.

use crate::setup::Results as _;
use input::Case;
use mechanics::equilibrium::Reuse;
use runs::run::{Options, run_reusing};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use tests::case::{Silent, table};
use tests::tolerance::close;
use tests::tolerance::near;

/// The chamber's loading over its first fifth, in variants that differ as given.
fn chamber(case: &str, variants: &str) -> Vec<Case> {
    let folder = tempfile::tempdir().unwrap();
    let base = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../cases")
        .join(case);
    let text = format!(
        "base = \"{}\"\n[output]\nprofile = \"never\"\nfields = \"never\"\n[[phase]]\nname = \"loading\"\n\
         increments = 10\ndisplacement = [{{ line = \"pile_head\", z = -0.001 }}]\n{variants}",
        base.join("case.toml").display()
    );
    let file = folder.path().join("case.toml");
    std::fs::write(&file, text).unwrap();
    Case::load(&file).unwrap()
}

/// Values by column.
type Row = BTreeMap<String, String>;

/// Rows of the history of a run, and its factorisations by phase.
fn run(case: &Case, reuse: &mut Reuse) -> (Vec<Row>, Vec<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let (observer, options) = (&mut Silent::default(), Options::default());
    run_reusing(case, folder.path(), observer, reuse, options).unwrap();
    let text = std::fs::read_to_string(folder.path().join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let phases = summary["phases"].as_array().unwrap().iter();
    let factorisations = phases.map(|phase| phase["factorisations"].as_u64().unwrap());
    let rows = table(&folder.path().join("history.csv"));
    (rows, factorisations.collect())
}

/// Variants of the chamber, each by itself.
fn runs(case: &str, variants: &str) -> Vec<(Vec<Row>, Vec<u64>)> {
    let cases = chamber(case, variants);
    let alone = cases.iter().map(|case| run(case, &mut Reuse::default()));
    alone.collect()
}

#[test]
fn condensing_the_ground_changes_no_answer() {
    for case in ["chamber_mesh1", "chamber_joint"] {
        let variants = "[[variant]]\nname = \"condensed\"\nsolver.equations = \"condensed\"\n\
                        [[variant]]\nname = \"sparse\"\nsolver.equations = \"sparse\"\n\
                        [[variant]]\nname = \"auto\"\n";
        let runs = runs(case, variants);
        let [condensed, sparse, auto] = &runs[..] else {
            panic!("three variants")
        };
        if case == "chamber_mesh1" {
            // In its confinement the interface is linear, but not later: it is factorised beside the ground.
            assert_eq!(condensed.1[0], 2);
        }
        assert_eq!(auto.1, condensed.1, "auto condenses here");
        agree(case, &condensed.0, &sparse.0, 16);
    }
}

/// All probes of this many increments are the same but for 1e-9 of their largest value.
fn agree(case: &str, condensed: &[Row], sparse: &[Row], increments: usize) {
    let probes = condensed[0].keys();
    for probe in probes.filter(|name| !["phase", "iterations"].contains(&name.as_str())) {
        let values = |rows: &[Row]| -> Vec<f64> {
            rows.iter().map(|row| row[probe].parse().unwrap()).collect()
        };
        let (a, b) = (values(condensed), values(sparse));
        assert_eq!((a.len(), b.len()), (increments, increments));
        let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (a, b) in a.iter().zip(&b) {
            close(format_args!("{case}, {probe}"), *a, *b, 1e-9 * largest);
        }
    }
}

/// The chamber with 520 unknowns on the boundary, next to which a factorisation takes longer than many iterations.
const FINE: &str = r#"
[mesh]
columns = [{ n = 6, to = 0.010 }, { n = 1, to = 0.012 }, { n = 24, to = 0.262, ratio = 1.12 }]
rows = [{ n = 2, to = 0.0 }, { n = 16, to = 0.180, ratio = 0.9 }, { n = 64, to = 0.680 }]
[groups.interface]
normal = "x"
"#;

#[test]
fn where_factorising_is_dear_a_matrix_serves_several_increments() {
    let by = |method: &str| {
        let variants = format!("{FINE}[solver]\nmethod = \"{method}\"\n");
        runs("chamber_mesh1", &variants).remove(0)
    };
    let ((slow, few), (newton, many)) = (by("auto"), by("newton"));
    agree("fine", &slow, &newton, 16);
    // Where it is not dear, three of four.
    assert!(3 * few[2] < 2 * many[2], "{few:?} {many:?}");
}

/// A head that is pushed, let go of with a force on it, held across as well, led up and down, and let go of
/// again. Unknowns that are free in some phases are kept with the boundary in all phases.
const BY_TURNS: &str = r#"
[[phase]]
name = "let_go"
increments = 2
free = [{ line = "pile_head", components = ["z"] }]
force = [{ line = "pile_head", z = -0.3 }]
[[phase]]
name = "up_and_down"
increments = 4
displacement = [{ line = "pile_head", r = 0.0, z = -0.0013 }]
course = [[0, 0], [0.5, 1], [1, 0.8]]
[[phase]]
name = "across"
increments = 2
free = [{ line = "pile_head", components = ["z"] }]
force = [{ line = "pile_head", z = -0.5 }]
"#;

#[test]
fn what_is_free_and_held_by_turns_is_condensed_once() {
    for case in ["chamber_mesh1", "chamber_joint"] {
        let variants = format!(
            "{BY_TURNS}[[variant]]\nname = \"condensed\"\nsolver.equations = \"condensed\"\n\
             [[variant]]\nname = \"sparse\"\nsolver.equations = \"sparse\"\n\
             [[variant]]\nname = \"chords\"\nsolver.method = \"initial_stress\"\n"
        );
        let runs = runs(case, &variants);
        agree(case, &runs[0].0, &runs[1].0, 24);
        // The head has moved while it was free.
        let w: Vec<f64> = runs[1]
            .0
            .iter()
            .map(|row| row["w_t"].parse().unwrap())
            .collect();
        assert!(
            (w[17] - w[15]).abs() > 1e-3 && (w[23] - w[21]).abs() > 1e-3,
            "{w:?}"
        );
        // With one matrix a phase for what iterates, that of the ground makes one more in the first.
        assert_eq!(runs[2].1.iter().sum::<u64>(), 7, "{:?}", runs[2].1);
    }
}

#[test]
fn variants_on_one_mesh_share_the_factors_of_the_ground() {
    let variants = "[[variant]]\nname = \"rough\"\n\
                    [[variant]]\nname = \"smooth\"\nlaws.mepi.parameters.mu_p = 0.6\n\
                    [[variant]]\nname = \"soft_ground\"\nlaws.sand.parameters.young_modulus = 30e3\n";
    let mut reuse = Reuse::default();
    let mut nothing = Reuse::default();
    nothing.is_last_run = true;
    let cases = chamber("chamber_mesh1", variants);
    let mut factorised = Vec::new();
    let mut alone = Vec::new();
    let mut together = Vec::new();
    let mut last = Vec::new();
    for case in &cases {
        for (reuse, rows) in [
            (&mut reuse, &mut together),
            (&mut Reuse::default(), &mut alone),
            // Where nothing follows, nothing is kept.
            (&mut nothing, &mut last),
        ] {
            let (history, factorisations) = run(case, reuse);
            rows.push(history);
            factorised.push(factorisations[0]);
        }
    }
    // Each run of its own factorises its ground once: in confinement, swap and loading, though that holds the head,
    // which was free before. The second variant has none to do.
    let [_, _, _, shared, own, own_last, changed, changed_own, _] = factorised[..] else {
        panic!("nine runs")
    };
    assert_eq!(shared + 1, own);
    assert_eq!(own_last, own);
    assert_eq!(changed, changed_own);
    assert!(alone == together, "reuse changes results");
    assert!(alone == last, "what is not kept changes results");
}

#[test]
fn a_phase_whose_interface_iterates_uses_the_factors_of_the_one_before() {
    let variants = "[[variant]]\nname = \"kept\"\nsolver.method = \"initial_stress\"\n";
    let (_, factorisations) = runs("chamber_mesh1", variants).remove(0);
    // Ground and interface; then the interface alone, though the head is held in the last phase.
    assert_eq!(factorisations, [2, 1, 1]);
}

/// Phases on the same unknowns: the linear part of the one before is taken only where nothing in it has changed.
#[test]
fn ground_that_is_another_from_a_phase_on_is_condensed_anew() {
    let variants = "[laws.stiff]\nlaw = \"elastic\"\nparameters = { young_modulus = 68e3, poisson_ratio = 0.3 }\n\
                    [[phase]]\nname = \"on\"\nincrements = 2\n\
                    [[phase]]\nname = \"stiffer\"\nincrements = 2\nlaws = { sand = \"stiff\" }\n\
                    displacement = [{ line = \"pile_head\", z = -0.0012 }]\n\
                    [[variant]]\nname = \"condensed\"\nsolver.equations = \"condensed\"\n\
                    [[variant]]\nname = \"sparse\"\nsolver.equations = \"sparse\"\n";
    let runs = runs("chamber_mesh1", variants);
    let runs: Vec<_> = runs.into_iter().map(|(rows, _)| rows).collect();
    let last = |run: usize| runs[run].last().unwrap()["q_t"].parse::<f64>().unwrap();
    assert!(runs[0].len() == runs[1].len() && runs[0].len() == 20);
    near(last(0), last(1), 1e-9 * last(1).abs());
    // More than the ground as it was.
    let before: f64 = runs[1][17]["q_t"].parse().unwrap();
    assert!(last(1) > 1.01 * before, "{before}, then {}", last(1));
}

/// A column on a linear thin layer with mean strain: its mid-thickness nodes are tied. Beside it one
/// that yields, so that the linear groups are condensed.
const TIED: &str = r#"
analysis = "plane_strain"
supports = [{ line = "base", fixed = ["x", "y"] }]
[mesh]
origin = [0.0, -0.1]
columns = [{ n = 4, to = 1.0 }, { n = 4, to = 2.0 }]
rows = [{ n = 1, to = 0.0 }, { n = 1, to = 1e-2 }, { n = 2, to = 0.2 }]
region = [{ group = "soil" }, { group = "yielding", x = [0.0, 1.0], y = [0.0, 1e-2] }, { group = "layer", x = [1.0, 2.0], y = [0.0, 1e-2] }]
lines = { base = { y = -0.1 }, top = { y = 0.2 }, side = { x = 1.5, y = [0.0, 1e-2] } }
[laws]
soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.2 } }
[laws.yielding]
law = "mohr_coulomb"
parameters = { young_modulus = 1e4, poisson_ratio = 0.2, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 0.0 }
[groups]
soil = { formulation = "solid", integration = "full", law = "soil" }
layer = { formulation = "thin_layer", integration = "mean", law = "soil" }
yielding = { formulation = "thin_layer", integration = "mean", law = "yielding" }
[[phase]]
name = "press"
increments = 5
pressure = [{ line = "top", value = 10.0 }]
[solver]
equations = "EQUATIONS"
[probes]
middle = { line = "side", y = [1e-4, 0.9e-2], quantity = "displacement_y" }
[output]
points = "POINTS"
"#;

#[test]
fn what_is_looked_at_does_not_depend_on_what_is_written() {
    let found = |equations: &str, points: &str| {
        let text = TIED
            .replace("EQUATIONS", equations)
            .replace("POINTS", points);
        crate::setup::run(&text).history("middle")
    };
    let expected = found("sparse", "never");
    for points in ["never", "phases", "increments"] {
        let middle = found("condensed", points);
        assert_eq!(middle.len(), 5);
        for (a, b) in middle.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-9 * b.abs(), "{points}: {a} {b}");
        }
    }
}

/// Linear ground next to ground that yields, which meet in nodes that do not move; a peg is free, then pushed.
const APART: &str = r#"
analysis = "plane_strain"
supports = [{ line = "wall", fixed = ["x", "y"] }]
[mesh]
origin = [0.0, 0.0]
columns = [{ n = 1, to = 1.0 }, { n = 8, to = 3.0 }]
rows = [{ n = 8, to = 1.0 }]
region = [{ group = "soil" }, { group = "yielding", x = [0.0, 1.0], y = [0.0, 1.0] }]
lines = { wall = { x = 1.0, y = [0.0, 1.0] }, peg = { y = 1.0, x = [2.75, 3.0] }, top = { y = 1.0, x = [0.0, 2.0] } }
[laws]
soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.2 } }
[laws.yielding]
law = "mohr_coulomb"
parameters = { young_modulus = 1e4, poisson_ratio = 0.2, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 0.0 }
[groups]
soil = { formulation = "solid", integration = "full", law = "soil" }
yielding = { formulation = "solid", integration = "full", law = "yielding" }
[[phase]]
name = "press"
increments = 2
pressure = [{ line = "top", value = 1.0 }]
[[phase]]
name = "push"
increments = 2
displacement = [{ line = "peg", y = -0.001 }]
[solver]
equations = "EQUATIONS"
[probes]
peg = { line = "peg", quantity = "displacement_y" }
push = { line = "peg", quantity = "reaction_y" }
"#;

#[test]
fn a_boundary_may_have_no_unknowns() {
    let found = |equations: &str| {
        let results = crate::setup::run(&APART.replace("EQUATIONS", equations));
        [results.history("peg"), results.history("push")].concat()
    };
    let expected = found("sparse");
    for equations in ["auto", "condensed"] {
        for (a, b) in found(equations).iter().zip(&expected) {
            assert!((a - b).abs() < 1e-9, "{equations}: {a} {b}");
        }
    }
}

/// Confined ground under the pressure that its initial stress balances, and from then on under a billionth more. All
/// that is linear hangs on nodes that do not move, so nothing but its own forces moves it. That billionth is the force
/// tolerance: noise is far below.
const AT_REST: &str = r#"analysis = "plane_strain"
[mesh]
columns = [{ n = 7, to = 1.0, ratio = 1.3 }]
rows = [{ n = 2, to = 0.3 }, { n = 5, to = 0.9, ratio = 1.2 }, { n = 2, to = 1.1 }]
region = [{ group = "soil" }, { group = "yielding", y = [0.0, 0.3] }]
lines = { left = { x = 0.0 }, right = { x = 1.0 }, base = { y = 0.0 }, seam = { y = 0.3 }, top = { y = 1.1 }, inside = { y = 0.9 } }
[laws]
soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.2 } }
[laws.yielding]
law = "mohr_coulomb"
parameters = { young_modulus = 1e4, poisson_ratio = 0.2, cohesion = 1e3, friction_angle = 30.0, dilatancy_angle = 0.0 }
[groups]
soil = { formulation = "solid", integration = "full", law = "soil", initial_stress = { 11 = -77.7, 22 = -77.7, 33 = -77.7 } }
yielding = { formulation = "solid", integration = "full", law = "yielding", initial_stress = { 11 = -77.7, 22 = -77.7, 33 = -77.7 } }
[[supports]]
line = "left"
fixed = ["x"]
[[supports]]
line = "right"
fixed = ["x"]
[[supports]]
line = "seam"
fixed = ["x", "y"]
[[supports]]
line = "base"
fixed = ["y"]
[[phase]]
name = "rest"
increments = 1
pressure = [{ line = "top", value = 77.7 }]
[[phase]]
name = "more"
increments = 1
pressure = [{ line = "top", value = 77.7000000777 }]
[solver]
equations = "EQUATIONS"
[probes]
top = { line = "top", quantity = "displacement_y" }
inside = { line = "inside", quantity = "displacement_y" }
"#;

#[test]
fn what_rounding_leaves_as_a_phase_begins_moves_no_condensed_ground_and_what_is_more_does() {
    // E (1 − ν)/((1 + ν)(1 − 2ν)), and the share of the pressure that comes.
    let modulus = 1e4 * 0.8 / (1.2 * 0.6);
    let more = 77.700_000_077_7 - 77.7;
    for equations in ["condensed", "sparse"] {
        let results = crate::setup::run(&AT_REST.replace("EQUATIONS", equations));
        for (probe, height) in [("inside", 0.6), ("top", 0.8)] {
            let moved = results.history(probe);
            let [rest, end] = moved[..] else {
                panic!("{moved:?}");
            };
            // Elsewhere rounding moves all nodes: 1e-16 of the stress, over the modulus.
            let least = if equations == "condensed" { 0.0 } else { 1e-16 };
            assert!(rest.abs() <= least, "{equations}, {probe}: {rest:e}");
            // The rounding of the stress is 1e-6 of what comes.
            let expected = -more * height / modulus;
            assert!(
                (end - expected).abs() < 1e-5 * expected.abs(),
                "{equations}, {probe}: {end:e} for {expected:e}"
            );
        }
    }
}
