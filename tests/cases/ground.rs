//! Piles and footings in real ground: bored, textbook, pulled, cycled and pushed-in piles; circular footings.
//!
//! Goal      what an engineer reads off: settlements, shares, bearing capacity factors.
//! Geometry, boundary, laws: the READMEs of the cases.
//! Asserts   two meshes against each other; hand calculations; factors of the literature.

use crate::variant::{Run, finished};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;
use tests::case::{column, run_text};
use tests::tolerance::close;
use tests::tolerance::near;
use tests::words::edited;

/// Settlement of the head at the end of a phase, mm.
fn settlement(run: &Run, phase: &str) -> f64 {
    1e3 * run.end(phase, "settlement")
}

fn bored(file: &str) -> Arc<Run> {
    finished(file, "")
}

#[test]
fn a_bored_pile_settles_alike_on_two_meshes() {
    let (grid, gmsh) = (bored("bored_pile"), bored("bored_pile/gmsh.toml"));
    for run in [&grid, &gmsh] {
        let rest = run.summary["phases"][0]["out_of_balance"].as_f64().unwrap();
        assert!(
            rest < 6e-4,
            "{rest}: what the pile's column weighs too little"
        );
        assert!(settlement(run, "ground").abs() < 0.02, "nothing moves");
        let left = settlement(run, "unloading") / settlement(run, "load test");
        assert!((0.7..0.9).contains(&left), "{left}");
    }
    let resistance = |run: &Run| {
        let value = &run.summary["pile"]["resistance_10_percent_diameter"];
        value.as_f64().unwrap()
    };
    let [q, r] = [&grid, &gmsh].map(|run| resistance(run));
    assert!(
        (q / r - 1.0).abs() < 0.02,
        "{q} kN on the grid, {r} kN on triangles"
    );
    let [a, b] = [&grid, &gmsh].map(|run| settlement(run, "load test"));
    assert!(
        (a / b - 1.0).abs() < 0.04,
        "{a} mm on the grid, {b} mm on triangles"
    );
}

/// The bored pile on 8 × 15 elements, pushed to 0.1 D in this many increments.
fn pushed(control: &str, increments: u32) -> (usize, f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/bored_pile/case.toml");
    let mut text = std::fs::read_to_string(path).unwrap();
    let unloading = text.find("[[phase]]\nname = \"unloading\"").unwrap();
    let solver = text.find("[solver]").unwrap();
    text.replace_range(unloading..solver, "");
    let edits = format!(
        r#"n = 2, to = 0.5 => n = 1, to = 0.5
n = 5, to = 1.5 => n = 3, to = 1.5
n = 10, to = 25.0 => n = 4, to = 25.0
n = 8, to = -17.0 => n = 3, to = -17.0
n = 8, to = -15.0 => n = 3, to = -15.0
n = 20, to = -5.0 => n = 6, to = -5.0
n = 8, to = 0.0 => n = 3, to = 0.0
rigid = ["head"]\nforce = [{{ line = "head", z = -7500.0 }}] => displacement = [{{ line = "head", z = -0.1 }}]
[8, 16, 24, 30] => [1]
increments = 30 => increments = {increments}
[solver] => [solver]\ncontrol = "{control}""#
    );
    let text = edited(&text, &edits.lines().collect::<Vec<_>>());
    let folder = TempDir::new().unwrap();
    let run = run_text(&text, folder.path()).unwrap_or_else(|error| panic!("{error}"));
    let load = column(&folder.path().join("history.csv"), "pile_head_load");
    (run.cut_backs, *load.last().unwrap())
}

/// If joints slide and ground yields all around, the tangent of an iterate is singular though the step has an
/// equilibrium. Viscous control passes it without a cut-back, in ten increments for the same load.
#[test]
fn viscous_control_leaves_singular_tangents_behind() {
    let (_, by_load) = pushed("load", 10);
    let (cut_backs, by_viscous_control) = pushed("viscous", 10);
    assert_eq!(cut_backs, 0);
    near(by_viscous_control / by_load, 1.0, 0.02);
    assert_eq!(pushed("viscous", 3).0, 0);
}

#[test]
fn a_textbook_pile_carries_what_the_alpha_method_gives_on_its_shaft() {
    let run = finished("textbook_pile", "");
    let (head, base) = (
        run.probe("load test", "head"),
        run.probe("load test", "base"),
    );
    // The pile's own weight comes down with the head load; the base has the overburden.
    let area = PI / 4.0;
    let weight = 24.0 * 8.0 * area;
    let overburden = 16.0 * 8.0 * area;
    let by_hand = 0.8 * 40.0 * PI * 8.0;
    // Pushed farther the clay leaves the joint above the toe.
    for (increment, most) in [(20, 0.01), (60, 0.02)] {
        let shaft = head[increment - 1] + weight - base[increment - 1];
        near(shaft / by_hand, 1.0, most);
    }
    let net = |increment: usize| base[increment - 1] - overburden;
    assert!((225.0..250.0).contains(&net(20)), "at 0.1 D: {}", net(20));
    assert!((280.0..320.0).contains(&net(60)), "at 0.3 D: {}", net(60));
}

/// The table of its README: triangles carry more at the singular toe, and lose a piece of the joint above it.
#[test]
fn on_triangles_a_textbook_pile_carries_more_at_its_base_and_less_on_its_shaft() {
    let [quads, triangles] =
        ["textbook_pile", "textbook_pile/triangles.toml"].map(|case| finished(case, ""));
    let at = |run: &Run, quantity: &str| run.probe("load test", quantity)[19];
    let net = |run: &Run| at(run, "base") - 16.0 * 8.0 * PI / 4.0;
    let shaft = |run: &Run| at(run, "head") + 24.0 * 8.0 * PI / 4.0 - at(run, "base");
    assert!((net(&triangles) - 249.0).abs() < 0.5, "{}", net(&triangles));
    let share = net(&triangles) / net(&quads) - 1.0;
    assert!((0.05..0.07).contains(&share), "{share}");
    let lost = shaft(&quads) - shaft(&triangles);
    assert!((lost - 18.5).abs() < 0.5, "{lost}");
}

#[test]
fn a_pile_that_is_pulled_leaves_its_base() {
    let run = finished("tension_pile", "");
    let (up, left) = (settlement(&run, "load test"), settlement(&run, "unloading"));
    assert!(up < -2.0, "{up} mm");
    assert!(left.abs() < 0.2 * up.abs(), "{left} of {up} mm");
    // c / tan φ of the joint is all the tension it has.
    let most = 5.0 / 20.0_f64.to_radians().tan();
    let normal = run.end("load test", "base_normal");
    assert!(normal <= most * (1.0 + 1e-6), "{normal} kPa");
}

#[test]
fn ten_load_cycles_shake_down() {
    let run = finished("cyclic_head_load", "");
    let course = run.probe("unloading", "settlement");
    // Up within 4 increments, down within 4.
    let tops: Vec<f64> = (0..10).map(|cycle| course[8 * cycle + 3]).collect();
    assert!(tops.windows(2).all(|pair| pair[1] > pair[0]), "{tops:?}");
    assert!(tops[9] / tops[1] - 1.0 < 0.02, "{tops:?}");
    assert!(tops[9] - tops[8] < tops[1] - tops[0], "{tops:?}");
}

#[test]
fn a_pile_that_was_pushed_in_settles_less() {
    let without = finished("residual_stress", "without");
    let pushed = finished("residual_stress", "pushed_in_before");
    let (first, second) = (
        settlement(&without, "load test"),
        settlement(&pushed, "second test"),
    );
    assert!(second < 0.6 * first, "{second} of {first} mm");
    let raised = finished("residual_stress", "given_profiles");
    assert!(settlement(&raised, "load test") < first);
}

#[test]
fn circular_footings_bear_what_the_literature_says() {
    let pressure = |variant: &str| finished("footing", variant).end("load", "force") / PI;
    let tan = 30.0_f64.to_radians().tan();
    // Cox, Eason & Hopkins 1961; Eason & Shield 1960; N_q = 1 + N_c tan φ; Martin 2005.
    let n_c = 49.3;
    let factors = [
        ("n_c_smooth", pressure("n_c_smooth") / 10.0, 5.69, 0.03),
        ("n_c_rough", pressure("n_c_rough") / 10.0, 6.05, 0.03),
        ("n_c_phi", pressure("n_c_phi") / 10.0, n_c, 0.03),
        ("n_q", pressure("n_q") / 10.0, 1.0 + n_c * tan, 0.03),
    ];
    for (variant, found, known, most) in factors {
        let error = found / known - 1.0;
        assert!(
            error < most && error > -0.01,
            "{variant}: {found}, literature {known}"
        );
    }
    // Martin 2005. The stress vanishes at the edge, where the mechanism starts: slow, and from above.
    for (variant, known, most) in [("n_gamma_smooth", 7.1, 0.06), ("n_gamma_rough", 15.5, 0.11)] {
        let n_gamma = |variant: &str| pressure(variant) / 20.0;
        let [coarse, fine] = [format!("{variant}_coarse"), variant.to_owned()].map(|v| n_gamma(&v));
        let [of_coarse, of_fine] = [coarse, fine].map(|n| n / known - 1.0);
        assert!((0.0..most).contains(&of_fine), "{variant}: {fine}, {known}");
        assert!(
            of_fine < 0.5 * of_coarse,
            "{variant}: {coarse}, then {fine}"
        );
        let extrapolated = 2.0 * fine - coarse;
        close(variant, extrapolated / known, 1.0, 0.05);
    }
}
