//! A block pulled over a softening interface by an elastic rope.
//!
//! Goal        arc-length control: a snap-back under prescribed displacement, a limit load under a prescribed
//!             force.
//! Geometry    a rigid block on a thin layer (`mean`) on a rigid base, a rope of ν = 0 next to it on a layer almost
//!             without stiffness.
//!
//! ```text
//!        100 kPa
//!     ┌───────────┐
//!     │   block   │══════ rope ══════→ u or F      height 0.02, lengths 1 and 1
//!     ╞═══════════╡  interface, t = 0.1 mm
//!     │             base            │
//!     └─────────────────────────────┘
//! ```
//!
//! Boundary    base fixed; a pressure of 100 kPa on the block; the rope's end pulled.
//! Law         mepi_softening with mu_r half of mu_p.
//! Asserts     force by slip against equations (10) and (11), u = slip + F/k, the extremes of u, the limit force;
//!             with condensed and with assembled equations.
//!
//! The rope pulls 10 mm above the interface, so the normal stress varies by some percent along it,
//! about 100 kPa in the mean: forces are compared to 2e-3 of the largest.

use crate::setup::{Results, assert_close, fail, run};
use std::path::Path;
use tests::case::column;
use tests::words::has;

const SIGMA: f64 = 100.0;
const K_T: f64 = 1e5;
/// Height, and stiffness of the soft rope.
const HEIGHT: f64 = 0.02;
const K: f64 = 5e5 * HEIGHT;
/// Parameters of the law.
const T: f64 = 0.002;
const A: f64 = 0.05;
const A_0: f64 = 4.0;
const PEAK: f64 = 1e-3;
const MU_P: f64 = 0.8;
const MU_R: f64 = 0.4;
/// Tolerance of forces, see above.
const UNEVEN: f64 = 2e-3;

fn text(solver: &str, pull: &str) -> String {
    let top = 1e-4 + HEIGHT;
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "base", fixed = ["x", "y"] }}]
[mesh]
origin = [0.0, -0.1]
columns = [{{ n = 1, to = 1.0 }}, {{ n = 1, to = 2.0 }}]
rows = [{{ n = 1, to = 0.0 }}, {{ n = 1, to = 1e-4 }}, {{ n = 1, to = {top:?} }}]
region = [
  {{ group = "rigid" }},
  {{ group = "interface", x = [0.0, 1.0], y = [0.0, 1e-4] }},
  {{ group = "nothing", x = [1.0, 2.0], y = [0.0, 1e-4] }},
  {{ group = "rope", x = [1.0, 2.0], y = [1e-4, {top:?}] }},
]
lines = {{ base = {{ y = -0.1 }}, top = {{ y = {top:?}, x = [0.0, 1.0] }}, end = {{ x = 2.0, y = [1e-4, {top:?}] }} }}
[laws]
rigid = {{ law = "elastic", parameters = {{ young_modulus = 1e10, poisson_ratio = 0.0 }} }}
rope = {{ law = "elastic", parameters = {{ young_modulus = 5e5, poisson_ratio = 0.0 }} }}
nothing = {{ law = "elastic", parameters = {{ young_modulus = 1e-5, poisson_ratio = 0.0 }} }}
[laws.interface]
law = "mepi_softening"
[laws.interface.parameters]
k_n = 2e5
k_t = {K_T:e}
n = 0.0
mu_0 = 0.0
mu_p = {MU_P:?}
mu_r = {MU_R:?}
mu_c0 = 0.67
a = {A:?}
a_0 = {A_0:?}
c_0 = 0.05
u_tp = {PEAK:?}
t = {T:?}
p_0 = 100.0
sigma_ni = 100.0
[groups]
rigid = {{ formulation = "solid", integration = "full", law = "rigid" }}
rope = {{ formulation = "solid", integration = "full", law = "rope" }}
nothing = {{ formulation = "solid", integration = "full", law = "nothing" }}
interface = {{ formulation = "thin_layer", integration = "mean", law = "interface" }}
[[phase]]
name = "press"
increments = 1
pressure = [{{ line = "top", value = {SIGMA:?} }}]
[[phase]]
name = "pull"
reset_displacements = true
{pull}
[solver]
{solver}
[probes]
tau = {{ group = "interface", quantity = "traction_t" }}
slip = {{ group = "interface", quantity = "jump_t" }}
pull = {{ line = "end", quantity = "displacement_x" }}
"#
    )
}

/// Equations (10) and (11), the peak continuous.
fn friction(xi: f64) -> f64 {
    let hardening = |xi: f64| MU_P * xi / (A * T + xi);
    if xi <= PEAK {
        return hardening(xi);
    }
    MU_R + (hardening(PEAK) - MU_R) / (A_0 * (xi - PEAK) / T).cosh()
}

/// Slip and force at a plastic slip.
fn truth(xi: f64) -> [f64; 2] {
    let force = SIGMA * friction(xi);
    [xi + force / K_T, force]
}

/// Force at a slip, the block sliding: slip grows with plastic slip.
fn force_at(slip: f64) -> f64 {
    let (mut from, mut to) = (0.0, slip);
    for _ in 0..100 {
        let middle = 0.5 * (from + to);
        if truth(middle)[0] < slip {
            from = middle;
        } else {
            to = middle;
        }
    }
    truth(from)[1]
}

/// The largest displacement of the rope's end before it goes back, and the smallest after that.
fn turning_points() -> [f64; 2] {
    let pull = |i: u32| {
        let [slip, force] = truth(f64::from(i) * 1e-7);
        slip + force / K
    };
    let turn = (1..100_000).find(|&i| pull(i + 1) < pull(i));
    let turn = turn.expect("the rope is soft enough");
    let least = (turn..100_000).map(pull).fold(f64::INFINITY, f64::min);
    [pull(turn), least]
}

/// For every step in the phase: slip, force, displacement of the rope's end.
fn path(folder: &Path) -> Vec<[f64; 3]> {
    let columns = ["slip", "tau", "pull"].map(|name| column(&folder.join("path.csv"), name));
    (1..columns[0].len())
        .map(|i| [0, 1, 2].map(|c| columns[c][i]))
        .collect()
}

#[test]
fn a_snap_back_is_followed_by_its_arc_length() {
    let [highest, lowest] = turning_points();
    assert!(lowest < 0.85 * highest, "{highest} {lowest}");
    let largest = SIGMA * friction(PEAK);
    for equations in ["condensed", "sparse"] {
        let solver = format!("control = \"arc_length\"\nequations = \"{equations}\"");
        let pull = "increments = 40\ndisplacement = [{ line = \"end\", x = 0.02 }]";
        let finished = run(&text(&solver, pull));
        let path = path(finished.folder());
        for &[slip, force, end] in &path {
            let what = format!("{equations}, at {slip:.3e}");
            assert_close(&what, force, force_at(slip), UNEVEN, largest);
            assert_close(&what, end, slip + force / K, UNEVEN / 4.0, highest);
        }
        let pulls = || path.iter().map(|step| step[2]);
        let back = pulls().zip(pulls().skip(1)).filter(|(a, b)| b < a).count();
        assert!(back >= 4, "{equations}: {back} steps back");
        let turn = pulls().zip(pulls().skip(1)).find(|(a, b)| b < a);
        let (turn, _) = turn.expect("a step back");
        let least = pulls().skip_while(|u| *u < turn).fold(turn, f64::min);
        // The path's own steps are coarse: its turning points lie between them.
        assert_close("turns back", turn, highest, 0.03, highest);
        assert_close("turns on", least, lowest, 0.03, lowest);
        assert!(least > 0.999 * lowest, "{least} is not beyond {lowest}");
        // Increments are reached as if nothing had been.
        let reached = finished.in_phase("pull", "pull");
        assert_eq!(reached.len(), 40, "{equations}");
        for (i, end) in reached.iter().enumerate() {
            assert_close("increment", *end, 5e-4 * (i + 1) as f64, 1e-12, 1.0);
        }
        let warned = finished
            .observer
            .warnings
            .iter()
            .any(|w| w.contains("path.csv"));
        assert!(warned, "{:?}", finished.observer.warnings);
        let phases = &finished.summary()["phases"];
        assert!(
            phases[1]["arc_length_steps"].as_u64() >= Some(8),
            "{phases}"
        );
    }
}

#[test]
fn no_increments_and_no_method_leap_over_it() {
    let [highest, lowest] = turning_points();
    let largest = SIGMA * friction(PEAK);
    for (increments, method) in [
        (5, "newton"),
        (10, "newton"),
        (80, "newton"),
        (40, "quasi_newton"),
        (40, "initial_stress"),
    ] {
        let solver = format!("control = \"arc_length\"\nmethod = \"{method}\"");
        let pull =
            format!("increments = {increments}\ndisplacement = [{{ line = \"end\", x = 0.02 }}]");
        let finished = run(&text(&solver, &pull));
        let path = path(finished.folder());
        let what = format!("{increments} increments, {method}");
        for &[slip, force, _] in &path {
            assert_close(&what, force, force_at(slip), UNEVEN, largest);
        }
        let turn = path.windows(2).position(|pair| pair[1][2] < pair[0][2]);
        let turn = turn.unwrap_or_else(|| panic!("{what}: no step back"));
        let least = path[turn..].iter().map(|step| step[2]);
        let least = least.fold(highest, f64::min);
        assert_close(&what, least, lowest, 0.05, lowest);
    }
}

#[test]
fn a_force_beyond_the_limit_stops_with_the_limit_in_words() {
    let limit = SIGMA * friction(PEAK);
    let asked = 1.1 * limit;
    let pull = format!(
        "increments = 20\npressure = [{{ line = \"end\", value = {:e} }}]",
        -asked / HEIGHT
    );
    let failed = fail(&text("control = \"arc_length\"", &pull));
    let message = failed.error.to_string();
    let said = message.split("the load does not rise beyond ").nth(1);
    let said = said.unwrap_or_else(|| panic!("{message}"));
    let highest: f64 = said.split(' ').next().expect("a number").parse().unwrap();
    assert_close("limit", highest, limit / asked, 5e-3, 1.0);
    let path = path(failed.folder());
    for &[slip, force, _] in &path {
        assert_close("softening", force, force_at(slip), UNEVEN, limit);
    }
    let [_, residual, _] = path[path.len() - 1];
    assert_close("residual force", residual, SIGMA * MU_R, UNEVEN, limit);
    // The last equilibrium is in the summary, beyond the last whole increment.
    let stopped = &failed.summary()["stopped_at"];
    let load_factor = stopped["load_factor"].as_f64();
    assert_close("load", load_factor.unwrap(), residual / asked, 1e-3, 1.0);
    assert_eq!(stopped["probes"]["tau"].as_f64(), Some(residual));
}

/// It takes over where the load may not be halved any more, however early that is.
#[test]
fn the_arc_length_takes_over_at_the_last_halving() {
    for halvings in [0, 1] {
        let solver = format!("control = \"arc_length\"\nmax_halvings = {halvings}");
        let pull = "increments = 40\ndisplacement = [{ line = \"end\", x = 0.02 }]";
        let finished = run(&text(&solver, pull));
        let steps = finished.summary()["phases"][1]["arc_length_steps"].as_u64();
        assert!(steps >= Some(8), "{halvings}: {steps:?}");
    }
}

/// Ground whose weightless stress does not go with its water, next to a joint that softens: the path goes back and on
/// back. It went to −34.6 of the phase in 500 steps.
#[test]
fn a_path_that_runs_backwards_is_recognised() {
    let text = r#"
analysis = "axisymmetric"
supports = [{ line = "axis", fixed = ["x"] }, { line = "bottom", fixed = ["x", "y"] }, { line = "far", fixed = ["x"] }]
water = { level = -0.2186 }
[mesh]
origin = [0.0, -4.31501]
columns = [{ n = 1, to = 1.00032 }, { n = 2, to = 7.15826, ratio = 1.42 }]
rows = [{ n = 4, to = -2.66602 }, { n = 3, to = 0.0 }]
region = [{ group = "soil" }, { group = "pile", x = [0.0, 1.00032], y = [-2.66602, 0.0] }]
[mesh.lines]
axis = { x = 0.0 }
far = { x = 7.15826 }
bottom = { y = -4.31501 }
surface = { y = 0.0, x = [1.00032, 7.15826] }
head = { y = 0.0, x = [0.0, 1.00032] }
shaft = { x = 1.00032, y = [-2.66602, 0.0] }
[laws]
steel = { law = "elastic", parameters = { young_modulus = 30e6, poisson_ratio = 0.2 } }
[laws.soil]
law = "mohr_coulomb"
parameters = { young_modulus = 13792, poisson_ratio = 0.411, cohesion = 0.0, friction_angle = 37.55, dilatancy_angle = 0 }
[laws.joint]
law = "mepi_softening"
[laws.joint.parameters]
k_n = 86e3
k_t = 37e3
n = 0.55
t = 0.002
p_0 = 100.0
sigma_ni = 100.0
mu_0 = 0.0
mu_p = 0.78
mu_c0 = 0.67
a = 0.00045
c_0 = 0.05
mu_r = 0.6
a_0 = 4.0
u_tp = 0.0014
[groups]
soil = { formulation = "solid", law = "soil", initial_stress = { 11 = -1.0, 22 = -1.0, 33 = -1.0 } }
pile = { formulation = "solid", law = "steel", initial_stress = { 11 = -1.0, 22 = -1.0, 33 = -1.0 } }
shaft = { formulation = "zero_thickness", line = "shaft", law = "joint" }
[[phase]]
name = "p1"
increments = 1
pressure = [{ line = "surface", value = 1.0 }, { line = "head", value = 1.0 }]
[solver]
control = "arc_length"
"#;
    let failed = fail(text);
    assert_eq!(failed.error.exit_code(), 2);
    let said = failed.error.to_string();
    has(&said, "the path of equilibrium runs backwards");
    let help = failed.error.help().unwrap();
    has(&help, "`control = \"viscous\"` were not tried");
}
