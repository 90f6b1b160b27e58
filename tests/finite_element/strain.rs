//! Stress-free strains of groups: heat, swelling, shrinkage.
//!
//! Goal        laws see the total strain less the stress-free one; pore water sees the total.
//! Geometry    a block of 2 × 2 elements; a cylinder in a ring.
//!
//! ```text
//!   ┌─────┬─────┐
//!   │     │     │  H = 2
//!   ├─────┼─────┤
//!   │     │     │
//!   └─────┴─────┘
//!    ▵    ▵    ▵
//! ```
//!
//! Boundary    u_y = 0 below, u_x = 0 on the left; others as stated.
//! Law         elastic.
//! Asserts     displacements, stresses and pore pressures against closed forms, EQUILIBRIUM.

use crate::setup::{Finished, Lame, Results, assert_close, elastic, run};
use std::f64::consts::PI;
use tests::tolerance::EQUILIBRIUM;

const YOUNG: f64 = 20e3;
const POISSON: f64 = 0.25;
const STRAIN: f64 = 1e-4;

/// A block 1 m wide and 2 m high with more supports, and its phases.
fn block(analysis: &str, group: &str, supports: &[(&str, &str)], phases: &str) -> Finished {
    let [along, up] = match analysis {
        "axisymmetric" => ["r", "z"],
        _ => ["x", "y"],
    };
    let supports: Vec<String> = [("bottom", up), ("left", along)]
        .iter()
        .chain(supports)
        .map(|(line, axis)| format!("[[supports]]\nline = \"{line}\"\nfixed = [\"{axis}\"]\n"))
        .collect();
    run(&format!(
        r#"
analysis = "{analysis}"
[mesh]
columns = [{{ n = 2, to = 1.0 }}]
rows = [{{ n = 2, to = 2.0 }}]
region = [{{ group = "block" }}]
lines = {{ left = {{ x = 0.0 }}, right = {{ x = 1.0 }}, bottom = {{ y = 0.0 }}, top = {{ y = 2.0 }} }}
[laws]
{}
[groups.block]
formulation = "solid"
law = "block"
{group}
{}
{phases}
[probes]
up = {{ line = "top", quantity = "displacement_y" }}
out = {{ line = "right", quantity = "displacement_x" }}
on_top = {{ line = "top", quantity = "reaction_y" }}
s_11 = {{ group = "block", quantity = "stress_11" }}
s_22 = {{ group = "block", quantity = "stress_22" }}
s_33 = {{ group = "block", quantity = "stress_33" }}
e_22 = {{ group = "block", quantity = "strain_22" }}
e_33 = {{ group = "block", quantity = "strain_33" }}
"#,
        elastic("block", YOUNG, POISSON),
        supports.concat()
    ))
}

const WARM: &str = "[[phase]]\nname = \"warm\"\nincrements = 3\nstrain = { block = 1e-4 }\n";

#[test]
fn a_free_bar_grows_without_stress() {
    let bar = block("axisymmetric", "", &[], WARM);
    let close = |probe: &str, expected: f64, scale: f64| {
        assert_close(probe, bar.last(probe), expected, EQUILIBRIUM, scale);
    };
    close("up", 2.0 * STRAIN, STRAIN);
    close("out", STRAIN, STRAIN);
    close("e_22", STRAIN, STRAIN);
    for stress in ["s_11", "s_22", "s_33"] {
        close(stress, 0.0, YOUNG * STRAIN);
    }
    // In proportion to the phase.
    let all = bar.history("up");
    assert_close("a third", all[0], 2.0 * STRAIN / 3.0, EQUILIBRIUM, STRAIN);
}

#[test]
fn a_bar_held_at_its_ends_carries_e_a_epsilon() {
    let bar = block("axisymmetric", "", &[("top", "z")], WARM);
    let force = YOUNG * PI * STRAIN;
    assert_close("N", bar.last("on_top"), -force, EQUILIBRIUM, force);
    bar.ends_at("out", (1.0 + POISSON) * STRAIN, EQUILIBRIUM, STRAIN);
    assert_close("strain", bar.last("e_22"), 0.0, EQUILIBRIUM, STRAIN);
}

/// σ_z = −E ε; in the plane (1 + ν) ε.
#[test]
fn plane_strain_holds_it_out_of_plane() {
    let plate = block("plane_strain", "", &[], WARM);
    let stress = YOUNG * STRAIN;
    assert_close("σ_z", plate.last("s_33"), -stress, EQUILIBRIUM, stress);
    assert_close("σ_x", plate.last("s_11"), 0.0, EQUILIBRIUM, stress);
    plate.ends_at("up", 2.0 * (1.0 + POISSON) * STRAIN, EQUILIBRIUM, STRAIN);
    assert_close("ε_z", plate.last("e_33"), 0.0, EQUILIBRIUM, STRAIN);
}

/// The total since the start; along one axis, it leaves the others alone.
#[test]
fn it_is_a_total_by_direction_that_stays() {
    let phases = format!(
        "{WARM}[[phase]]\nname = \"rest\"\nincrements = 1\n\
         [[phase]]\nname = \"dry\"\nincrements = 2\nstrain = {{ block = {{ z = -2e-4 }} }}\n"
    );
    let bar = block("axisymmetric", "", &[], &phases);
    assert_close(
        "rest",
        bar.end_of("rest", "up"),
        2.0 * STRAIN,
        EQUILIBRIUM,
        STRAIN,
    );
    assert_close("dry", bar.last("up"), -4.0 * STRAIN, EQUILIBRIUM, STRAIN);
    assert_close("out", bar.last("out"), 0.0, EQUILIBRIUM, STRAIN);
    assert_close("σ_r", bar.last("s_11"), 0.0, EQUILIBRIUM, YOUNG * STRAIN);
}

/// One-dimensional swelling of undrained ground: (M + K_w/n) ε_y = (3λ + 2G) ε, u = −K_w/n ε_y.
#[test]
fn pore_water_sees_the_total() {
    let undrained = 0.49;
    let group = "drainage = \"undrained\"\nundrained_poisson_ratio = 0.49";
    let sides = [("right", "x")];
    let ground = block("plane_strain", group, &sides, WARM);
    let Lame {
        lambda,
        shear,
        oedometric,
    } = Lame::new(YOUNG, POISSON);
    let bulk = lambda + 2.0 / 3.0 * shear;
    let water = 2.0 * shear * (1.0 + undrained) / (3.0 * (1.0 - 2.0 * undrained)) - bulk;
    let up = 3.0 * bulk * STRAIN / (oedometric + water);
    assert_close("up", ground.last("up"), 2.0 * up, EQUILIBRIUM, STRAIN);
    // σ'_y = u = −K_w/n ε_y.
    ground.ends_at("s_22", -water * up, EQUILIBRIUM, YOUNG * STRAIN);
}

/// A warm, stiffer core in a ring, plane strain: with E', ν' of the core the pressure p between them has
/// (1 + ν') ε − p (1 + ν')(1 − 2ν')/E' = p (1 + ν)/E ((1 − 2ν) a² + b²)/(b² − a²). The elements give a ring exactly.
#[test]
fn a_warm_core_presses_on_its_ring() {
    let [a, b]: [f64; 2] = [0.5, 2.0];
    let text = format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "bottom", fixed = ["z"] }}, {{ line = "top", fixed = ["z"] }}]
[mesh]
columns = [{{ n = 2, to = {a} }}, {{ n = 12, to = {b}, ratio = 1.1 }}]
rows = [{{ n = 1, to = 0.5 }}]
region = [{{ group = "ring" }}, {{ group = "core", r = [0.0, {a}] }}]
lines = {{ axis = {{ r = 0.0 }}, bottom = {{ z = 0.0 }}, top = {{ z = 0.5 }} }}
[laws]
{}
[groups]
core = {{ formulation = "solid", law = "stiff" }}
ring = {{ formulation = "solid", law = "block" }}
[[phase]]
name = "warm"
increments = 2
strain = {{ core = 1e-4 }}
[probes]
core = {{ group = "core", quantity = "stress_11" }}
axial = {{ group = "core", quantity = "stress_33" }}
"#,
        elastic("block", YOUNG, POISSON) + &elastic("stiff", 4.0 * YOUNG, 0.1)
    );
    let (nu, ratio) = (POISSON, b * b / (b * b - a * a));
    let of_ring = (1.0 + nu) / YOUNG * ((1.0 - 2.0 * nu) * (ratio - 1.0) + ratio);
    let of_core = 1.1 * 0.8 / (4.0 * YOUNG);
    let pressure = 1.1 * STRAIN / (of_core + of_ring);
    let done = run(&text);
    assert_close("p", done.last("core"), -pressure, EQUILIBRIUM, pressure);
    assert_close("hoop", done.last("axial"), -pressure, EQUILIBRIUM, pressure);
}

/// A group that appears later has no part in what was there before.
#[test]
fn a_group_that_appears_does_not_inherit_it() {
    let text = format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "bottom", fixed = ["z"] }}]
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = 1.0 }}, {{ n = 1, to = 2.0 }}]
region = [{{ group = "block" }}, {{ group = "upper", z = [1.0, 2.0] }}]
lines = {{ axis = {{ r = 0.0 }}, bottom = {{ z = 0.0 }}, top = {{ z = 2.0 }} }}
[laws]
{}
[groups]
block = {{ formulation = "solid", law = "block" }}
upper = {{ formulation = "solid", law = "block", active = false }}
[[phase]]
name = "before"
increments = 1
strain = {{ block = 1e-4, upper = 1e-4 }}
[[phase]]
name = "built"
increments = 1
activate = ["upper"]
[[phase]]
name = "after"
increments = 2
strain = {{ block = 3e-4, upper = 3e-4 }}
[probes]
s_22 = {{ group = "upper", quantity = "stress_22" }}
e_22 = {{ group = "upper", quantity = "strain_22" }}
"#,
        elastic("block", YOUNG, POISSON)
    );
    let done = run(&text);
    assert_close(
        "built",
        done.end_of("built", "e_22"),
        0.0,
        EQUILIBRIUM,
        STRAIN,
    );
    done.ends_at("e_22", 2.0 * STRAIN, EQUILIBRIUM, STRAIN);
    assert_close("σ", done.last("s_22"), 0.0, EQUILIBRIUM, YOUNG * STRAIN);
}

#[test]
fn a_phase_that_changes_nothing_leaves_a_free_block_where_it_is() {
    // Only what rounding leaves of the expansion is out of balance.
    for columns in [2, 6, 8] {
        let (young, strain) = (30e6, -1e-4);
        let finished = run(&format!(
            r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}]
[mesh]
columns = [{{ n = {columns}, to = 2.0 }}]
rows = [{{ n = 4, to = 5.0 }}]
region = [{{ group = "block" }}]
lines.left = {{ x = 0.0 }}
lines.bottom = {{ y = 0.0 }}
lines.top = {{ y = 5.0 }}
[laws]
{}
[groups]
block = {{ formulation = "solid", law = "block" }}
[[phase]]
name = "warm"
increments = 3
strain = {{ block = {strain} }}
[[phase]]
name = "nothing"
increments = 2
[probes]
up = {{ line = "top", quantity = "displacement_y" }}
"#,
            elastic("block", young, POISSON),
        ));
        for up in finished.in_phase("nothing", "up") {
            let expected = 5.0 * strain * (1.0 + POISSON);
            assert_close("up", up, expected, EQUILIBRIUM, expected.abs());
        }
    }
}
