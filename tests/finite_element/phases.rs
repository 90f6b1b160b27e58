//! What passes from phase to phase.
//!
//! Goal        stress is carried over a swap of laws, internal variables stay with their law, displacements can be
//!             reset, a support can be released; forces balance throughout.
//! Geometry    a square of 2 × 2 elements; the sliding block; a disc on the axis with a thin layer through it.
//!
//! ```text
//!      ↓ ↓ ↓ p
//!   ┌─────┬─────┐
//!   │     │     │  H = 1
//!   ├─────┼─────┤
//!   │     │     │
//!   └─────┴─────┘
//!    ▵    ▵    ▵
//! ```
//!
//! Boundary    u_y = 0 below, u_x = 0 on the sides unless stated; load or displacement above.
//! Law         elastic, mohr_coulomb; mepi, coulomb_joint.
//! Asserts     stresses, displacements and reactions against closed forms, EQUILIBRIUM.

use crate::setup::{Finished, Lame, Results, assert_close, elastic, run};
use crate::sliding_block::{self, Kind, PRESS, coulomb, hold_top, slide};
use std::f64::consts::PI;
use tests::tolerance::EQUILIBRIUM;

const YOUNG: f64 = 10e3;
const POISSON: f64 = 0.25;

/// A square between smooth walls: one-dimensional compression.
fn square(laws: &str, group: &str, phases: &str) -> Finished {
    run(&format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}]
[mesh]
columns = [{{ n = 2, to = 1.0 }}]
rows = [{{ n = 2, to = 1.0 }}]
region = [{{ group = "ground" }}]
lines = {{ left = {{ x = 0.0 }}, right = {{ x = 1.0 }}, bottom = {{ y = 0.0 }}, top = {{ y = 1.0 }} }}
[laws]
{laws}
[groups.ground]
formulation = "solid"
integration = "full"
{group}
{phases}
[probes]
top = {{ line = "top", quantity = "displacement_y" }}
on_top = {{ line = "top", quantity = "reaction_y" }}
below = {{ line = "bottom", quantity = "reaction_y" }}
on_left = {{ line = "left", quantity = "reaction_x" }}
on_right = {{ line = "right", quantity = "reaction_x" }}
s_11 = {{ group = "ground", quantity = "stress_11" }}
s_22 = {{ group = "ground", quantity = "stress_22" }}
least = {{ group = "ground", quantity = "stress_22", reduce = "min" }}
most = {{ group = "ground", quantity = "stress_22", reduce = "max" }}
"#
    ))
}

fn two_elastic_laws() -> String {
    elastic("soft", YOUNG, POISSON) + &elastic("stiff", 5.0 * YOUNG, 0.1)
}

const LOADED: &str = "[[phase]]\nname = \"load\"\nincrements = 1\n\
                      pressure = [{ line = \"top\", value = 80.0 }]\n";

#[test]
fn stress_is_carried_over_a_swap_of_laws() {
    // Loaded with the soft law, swapped at constant load, loaded further with the stiff one.
    let phases = LOADED.to_owned()
        + "[[phase]]\nname = \"swap\"\nincrements = 2\nlaws = { ground = \"stiff\" }\n\
           [[phase]]\nname = \"more\"\nincrements = 2\n\
           pressure = [{ line = \"top\", value = 200.0 }]\n";
    let finished = square(&two_elastic_laws(), "law = \"soft\"", &phases);
    let [soft, stiff] = [Lame::new(YOUNG, POISSON), Lame::new(5.0 * YOUNG, 0.1)];
    let (before, settled) = (80.0 * soft.lambda / soft.oedometric, 80.0 / soft.oedometric);
    let after = before + 120.0 * stiff.lambda / stiff.oedometric;
    for (phase, vertical, horizontal, settlement) in [
        ("load", 80.0, before, settled),
        ("swap", 80.0, before, settled),
        ("more", 200.0, after, settled + 120.0 / stiff.oedometric),
    ] {
        let end = |probe: &str| finished.end_of(phase, probe);
        assert_close(phase, end("s_22"), -vertical, EQUILIBRIUM, 200.0);
        assert_close(phase, end("s_11"), -horizontal, EQUILIBRIUM, 200.0);
        assert_close(phase, end("top"), -settlement, EQUILIBRIUM, settlement);
    }
    let summary = finished.summary();
    assert!(summary["phases"][1]["out_of_balance"].as_f64().unwrap() < EQUILIBRIUM);
    // Nothing but that a support's reaction is not the pressure beside it.
    let warnings = &finished.observer.warnings;
    let is_of_probe = |warning: &String| warning.starts_with("probe `on_top`");
    assert!(warnings.iter().all(is_of_probe), "{warnings:?}");
}

#[test]
fn a_law_that_cannot_carry_the_stress_gives_it_back_in_equilibrium() {
    // Free sides from the second phase on: 80 kPa is more than 2 c = 60 kPa, so the top must be
    // held. Uniaxial strength is reached, whatever the path.
    let weak = "weak = { law = \"mohr_coulomb\", parameters = { young_modulus = 1e4, \
                poisson_ratio = 0.25, cohesion = 30.0, friction_angle = 0.0, \
                dilatancy_angle = 0.0 } }\n";
    let phases = LOADED.to_owned()
        + "[[phase]]\nname = \"swap\"\nincrements = 4\nlaws = { ground = \"weak\" }\n\
           reset_displacements = true\ndisplacement = [{ line = \"top\", y = 0.0 }]\n\
           free = [{ line = \"right\", components = [\"x\"] }]\n";
    let finished = square(&(two_elastic_laws() + weak), "law = \"soft\"", &phases);
    assert_close("s_22", finished.last("least"), -60.0, EQUILIBRIUM, 60.0);
    assert_close("s_22", finished.last("most"), -60.0, EQUILIBRIUM, 60.0);
    assert_close("s_11", finished.last("s_11"), 0.0, EQUILIBRIUM, 60.0);
    // The pressure of 80 kPa is still there; the hold takes 20 kPa upward off it.
    assert_close("hold", finished.last("on_top"), 20.0, EQUILIBRIUM, 60.0);
    assert_close("below", finished.last("below"), 60.0, EQUILIBRIUM, 60.0);
}

#[test]
fn a_support_is_given_up_in_the_course_of_a_phase() {
    let lame = Lame::new(YOUNG, POISSON);
    // Compressed by 2 mm; then the top is let go, in four increments.
    let phases = "[[phase]]\nname = \"squeeze\"\nincrements = 1\n\
                  displacement = [{ line = \"top\", y = -2e-3 }]\n\
                  [[phase]]\nname = \"let go\"\nincrements = 4\n\
                  free = [{ line = \"top\", components = [\"y\"] }]\n";
    let finished = square(&two_elastic_laws(), "law = \"soft\"", phases);
    let force = 2e-3 * lame.oedometric;
    assert_close(
        "force",
        finished.end_of("squeeze", "on_top"),
        -force,
        EQUILIBRIUM,
        force,
    );
    for (i, (force_left, top)) in (finished.in_phase("let go", "on_top").iter())
        .zip(finished.in_phase("let go", "top"))
        .enumerate()
    {
        let left = 1.0 - 0.25 * (i + 1) as f64;
        assert_close("force left", *force_left, -left * force, EQUILIBRIUM, force);
        assert_close("top", top, -2e-3 * left, EQUILIBRIUM, 2e-3);
    }
    for probe in ["on_top", "below", "on_left", "on_right"] {
        assert_close(probe, finished.last(probe), 0.0, EQUILIBRIUM, force);
    }
    let out_of_balance = finished.summary()["phases"][1]["out_of_balance"]
        .as_f64()
        .unwrap();
    assert!(out_of_balance > 0.1, "{out_of_balance}");
    let warnings = finished.observer.warnings.iter();
    let announced = warnings.filter(|warning| warning.contains("out of balance"));
    assert_eq!(announced.count(), 0, "the phase says itself what it frees");
}

#[test]
fn an_initial_stress_without_load_expands_to_equilibrium() {
    let lame = Lame::new(YOUNG, POISSON);
    let group = "law = \"soft\"\ninitial_stress = { 11 = -40.0, 22 = -70.0, 33 = -50.0 }";
    let phases = "[[phase]]\nname = \"expand\"\nincrements = 2\n";
    let finished = square(&two_elastic_laws(), group, phases);
    let heave = 70.0 / lame.oedometric;
    for (i, part) in [(0, 0.5), (1, 1.0)] {
        let at = |probe: &str| finished.history(probe)[i];
        assert_close("s_22", at("s_22"), -70.0 * (1.0 - part), EQUILIBRIUM, 70.0);
        let lateral = -40.0 + part * 70.0 * lame.lambda / lame.oedometric;
        assert_close("s_11", at("s_11"), lateral, EQUILIBRIUM, 70.0);
        assert_close("top", at("top"), part * heave, EQUILIBRIUM, heave);
    }
}

#[test]
fn displacements_are_reset_and_nothing_else() {
    let phases = LOADED.to_owned()
        + "[[phase]]\nname = \"rest\"\nincrements = 1\nreset_displacements = true\n\
           [[phase]]\nname = \"more\"\nincrements = 1\n\
           pressure = [{ line = \"top\", value = 100.0 }]\n";
    let finished = square(&two_elastic_laws(), "law = \"soft\"", &phases);
    let m = Lame::new(YOUNG, POISSON).oedometric;
    let end = |phase: &str, probe: &str| finished.end_of(phase, probe);
    assert_close("load", end("load", "top"), -80.0 / m, EQUILIBRIUM, 80.0 / m);
    assert_close("rest", end("rest", "top"), 0.0, EQUILIBRIUM, 80.0 / m);
    assert_close("rest", end("rest", "s_22"), -80.0, EQUILIBRIUM, 80.0);
    assert_close("more", end("more", "top"), -20.0 / m, EQUILIBRIUM, 80.0 / m);
    assert_close("more", end("more", "s_22"), -100.0, EQUILIBRIUM, 80.0);
}

#[test]
fn internal_variables_stay_with_their_law() {
    let mepi = |mu_p: f64| {
        format!(
            "law = \"mepi\"\nparameters = {{ k_n = 2e5, k_t = 1e5, n = 0.0, mu_0 = 0.27, \
             mu_p = {mu_p:?}, mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = 0.002, p_0 = 100.0, \
             sigma_ni = 100.0 }}\n"
        )
    };
    let laws = format!(
        "{}[laws.rougher]\n{}[laws.other]\n{}\n",
        mepi(0.7),
        mepi(0.9),
        coulomb(45.0, 0.0)
    );
    let hold = |name: &str, law: &str| {
        format!(
            "[[phase]]\nname = \"{name}\"\nincrements = 1\nlaws = {{ interface = \"{law}\" }}\n"
        )
    };
    let phases = PRESS.to_owned()
        + &hold_top(&slide("slide", 10, 2e-3, "{ line = \"top\", y = 0.0 }"))
        + &hold("same law", "rougher")
        + &hold("another law", "other")
        + &hold("first law again", "rougher");
    for kind in [Kind::Joint("nodes"), Kind::Layer("mean")] {
        let finished = run(&sliding_block::text(kind, &laws, &phases));
        let end = |phase: &str, probe: &str| finished.end_of(phase, probe);
        let slip = end("slide", "plastic_slip");
        assert!(slip > 1e-3, "{kind:?}: {slip}");
        for (phase, expected) in [
            ("same law", slip),
            ("another law", 0.0),
            ("first law again", 0.0),
        ] {
            let what = format!("{kind:?}, {phase}");
            let tolerance = 1e-6;
            if phase == "first law again" {
                // ξ starts from 0, where μ is 0.27: the stress carried in is returned, with slip.
                let stress = end(phase, "tau") / end(phase, "sigma");
                assert!(
                    stress < 0.7 && end(phase, "plastic_slip") < 0.5 * slip,
                    "{what}"
                );
                continue;
            }
            assert_close(&what, end(phase, "plastic_slip"), expected, tolerance, slip);
            // Both surfaces contain the stress, so nothing moves.
            for probe in ["sigma", "tau"] {
                let before = end("slide", probe);
                assert_close(
                    &format!("{what}: {probe}"),
                    end(phase, probe),
                    before,
                    1e-6,
                    100.0,
                );
            }
        }
    }
}

/// A disc on the axis, a stiff pile and a layer between pile and ground, all over its height.
#[test]
fn reactions_balance_loads_over_the_whole_turn() {
    for integration in ["full", "mean"] {
        let text = format!(
            r#"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "wall", fixed = ["r"] }}, {{ line = "bottom", fixed = ["r", "z"] }}]
[mesh]
columns = [{{ n = 1, to = 0.3 }}, {{ n = 1, to = 0.32 }}, {{ n = 3, to = 2.0, ratio = 1.5 }}]
rows = [{{ n = 2, to = 0.5 }}, {{ n = 3, to = 1.5 }}]
region = [{{ group = "ground" }}, {{ group = "layer", r = [0.3, 0.32], z = [0.5, 1.5] }}, {{ group = "pile", r = [0.0, 0.3], z = [0.5, 1.5] }}]
[mesh.lines]
axis = {{ r = 0.0 }}
wall = {{ r = 2.0 }}
bottom = {{ z = 0.0 }}
head = {{ z = 1.5, r = [0.0, 0.3] }}
surface = {{ z = 1.5, r = [0.32, 2.0] }}
toe = {{ z = 0.5, r = [0.0, 0.3] }}
[laws]
{}{}
[laws.layer]
law = "coulomb_joint"
parameters = {{ normal_stiffness = 1e6, shear_stiffness = 3e5, cohesion = 4.0, friction_angle = 25.0, dilatancy_angle = 2.0 }}
[groups]
ground = {{ formulation = "solid", integration = "full", law = "ground" }}
pile = {{ formulation = "solid", integration = "full", law = "pile" }}
layer = {{ formulation = "thin_layer", integration = "{integration}", law = "layer" }}
[[phase]]
name = "load"
increments = 2
pressure = [{{ line = "surface", value = 30.0 }}, {{ line = "head", value = 400.0 }}]
[[phase]]
name = "push"
increments = 5
displacement = [{{ line = "head", z = -0.02 }}]
[probes]
below = {{ line = "bottom", quantity = "reaction_z" }}
head = {{ line = "head", quantity = "reaction_z" }}
wall = {{ line = "wall", quantity = "reaction_z", z = [0.01, 1.6] }}
toe = {{ line = "toe", group = "pile", quantity = "force_z" }}
"#,
            elastic("ground", 20e3, 0.3),
            elastic("pile", 20e6, 0.2)
        );
        let finished = run(&text);
        let surface = 30.0 * PI * (2.0_f64.powi(2) - 0.32_f64.powi(2));
        let head = 400.0 * PI * 0.3_f64.powi(2);
        let scale = surface + head;
        let below = finished.history("below");
        let pushed = finished.history("head");
        let after = |i: usize, applied: f64| {
            let what = format!("{integration}, increment {}", i + 1);
            // On the head, the reaction is what the pressure there does not carry.
            assert_close(&what, below[i] + pushed[i], applied, EQUILIBRIUM, scale);
        };
        after(0, 0.5 * scale);
        after(1, scale);
        (2..7).for_each(|i| after(i, scale));
        assert_close("free head", pushed[1], 0.0, EQUILIBRIUM, scale);
        assert!(
            pushed[6] < -0.1 * scale,
            "the head was hardly pushed: {}",
            pushed[6]
        );
        // Shaft and toe share the load: something, but not all, reaches the toe.
        let (total, toe) = (head - pushed[6], finished.last("toe"));
        assert!(
            toe.abs() > 0.05 * total && toe.abs() < 0.95 * total,
            "{toe} of {total}"
        );
        finished.ends_at("wall", 0.0, EQUILIBRIUM, scale);
    }
}
