//! Thin layers: what is refused, and the variant with mean strain.
//!
//! Goal        impossible or ambiguous layers are refused with their place; the variant `mean` has no
//!             stiffness-free modes and agrees with `full`.
//! Geometry    a layer element, alone or on a block of ground; the chamber of `cases/chamber_mesh1`.
//!
//! ```text
//!        p
//!   ┌─────────┐
//!  q│  t, L   │q
//!   └─────────┘
//!    ▵       ▵
//! ```
//!
//! Boundary    pressures all round, three supports.
//! Law         coulomb_joint, mepi.
//! Asserts     kind and place of errors; stresses and displacements, EQUILIBRIUM; curves of the chamber within a
//!             stated fraction.

use crate::setup::{Results, assert_close, elastic, fail, run};
use input::Error;
use std::path::Path;
use tests::tolerance::EQUILIBRIUM;
use tests::words::has;

/// One element of length 1 and this thickness.
fn single(thickness: f64, k_n: f64, group: &str) -> String {
    format!(
        r#"
analysis = "plane_strain"
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = {thickness:?} }}]
[[mesh.region]]
group = "layer"
[mesh.lines]
left = {{ x = 0.0 }}
right = {{ x = 1.0 }}
bottom = {{ y = 0.0 }}
top = {{ y = {thickness:?} }}
pin = {{ x = 0.0, y = 0.0 }}
roller = {{ x = 1.0, y = 0.0 }}
corner = {{ x = 1.0, y = {thickness:?} }}
[laws.interface]
law = "coulomb_joint"
parameters = {{ normal_stiffness = {k_n:?}, shear_stiffness = 3e5, cohesion = 1e3, friction_angle = 30.0, dilatancy_angle = 0.0 }}
[groups.layer]
formulation = "thin_layer"
law = "interface"
{group}
[[supports]]
line = "pin"
fixed = ["x", "y"]
[[supports]]
line = "roller"
fixed = ["y"]
[[phase]]
name = "squeeze"
increments = 1
pressure = [
  {{ line = "top", value = 50.0 }},
  {{ line = "bottom", value = 50.0 }},
  {{ line = "left", value = 30.0 }},
  {{ line = "right", value = 30.0 }},
]
[probes]
s_11 = {{ group = "layer", quantity = "stress_11", reduce = "max" }}
s_22 = {{ group = "layer", quantity = "stress_22", reduce = "max" }}
s_12 = {{ group = "layer", quantity = "stress_12", reduce = "max" }}
right = {{ line = "right", quantity = "displacement_x" }}
top = {{ line = "top", quantity = "displacement_y" }}
corner = {{ line = "corner", quantity = "displacement_y" }}
"#
    )
}

/// The text that an input error points at.
fn place<'a>(error: &Error, text: &'a str) -> &'a str {
    let Error::Text(text::Error::Input(input)) = error else {
        panic!("not an input error: {error}")
    };
    assert_eq!(error.exit_code(), 1);
    &text[input.span()]
}

#[test]
fn stiffnesses_that_no_elastic_layer_has_are_refused() {
    // Bound: K_n > 4/3 K_t = 4e5.
    for k_n in [4e5, 3e5] {
        let text = single(0.02, k_n, "");
        let failed = fail(&text);
        assert_eq!(place(&failed.error, &text), "\"interface\"");
        has(failed.error.to_string(), "K_n > 4/3 K_t");
        assert!(
            !failed.folder().join("history.csv").exists(),
            "half-written results"
        );
    }
    run(&single(0.02, 4.001e5, ""));
}

#[test]
fn a_direction_across_that_is_not_clear_must_be_given() {
    for thickness in [0.85, 1.0, 1.2] {
        let text = single(thickness, 1e6, "");
        let failed = fail(&text);
        assert_eq!(place(&failed.error, &text), "layer");
        has(failed.error.to_string(), "across the layer");
        for normal in ["x", "y"] {
            run(&single(thickness, 1e6, &format!("normal = \"{normal}\"")));
        }
    }
    // Clear: the shorter side, whichever it is.
    run(&single(0.79, 1e6, ""));
    run(&single(1.3, 1e6, ""));
}

/// A layer on a block of ground as stiff as the layer, under pressures all round.
fn on_ground(t: f64, k_n: f64, k_t: f64, integration: &str) -> String {
    let (m, g) = (k_n * t, k_t * t);
    let lambda = m - 2.0 * g;
    let poisson = lambda / (2.0 * (lambda + g));
    let ground = elastic("ground", 2.0 * g * (1.0 + poisson), poisson);
    single(t, k_n, &format!("integration = \"{integration}\""))
        .replace("columns", "origin = [0.0, -0.5]\ncolumns")
        .replace("rows = [", "rows = [{ n = 1, to = 0.0 }, ")
        .replace(
            "group = \"layer\"\n[mesh.lines]",
            &format!(
                "group = \"ground\"\n[[mesh.region]]\ngroup = \"layer\"\ny = [0.0, {t:?}]\n\
                 [mesh.lines]"
            ),
        )
        .replace("y = 0.0 }\n", "y = -0.5 }\n")
        .replace(
            "[laws.interface]",
            &format!("[laws]\n{ground}[laws.interface]"),
        )
        .replace(
            "[groups.layer]",
            "[groups.ground]\nformulation = \"solid\"\nintegration = \"full\"\nlaw = \"ground\"\n[groups.layer]",
        )
}

#[test]
fn a_layer_on_ground_has_no_free_modes() {
    // Three supports leave no rigid motion; any other motion without stiffness would make the
    // equations singular, or add to the displacements of uniform stress. M = K_n t, G = K_t t.
    let (t, k_n, k_t) = (0.02, 1e6, 3e5);
    let (m, lambda) = (k_n * t, (k_n - 2.0 * k_t) * t);
    for integration in ["mean", "full", "reduced"] {
        let finished = run(&on_ground(t, k_n, k_t, integration));
        let scale = 50.0;
        assert_close("s_11", finished.last("s_11"), -30.0, EQUILIBRIUM, scale);
        assert_close("s_22", finished.last("s_22"), -50.0, EQUILIBRIUM, scale);
        assert_close("s_12", finished.last("s_12"), 0.0, EQUILIBRIUM, scale);
        let determinant = m * m - lambda * lambda;
        let along = (-30.0 * m + 50.0 * lambda) / determinant;
        let across = (-50.0 * m + 30.0 * lambda) / determinant;
        let scale = scale / m;
        assert_close("right", finished.last("right"), along, EQUILIBRIUM, scale);
        finished.ends_at("top", across * (t + 0.5), EQUILIBRIUM, scale);
        finished.ends_at("corner", across * (t + 0.5), EQUILIBRIUM, scale);
    }
}

#[test]
fn mean_strain_and_full_integration_agree_in_the_chamber() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_mesh1/case.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let [full, mean] = ["full", "mean"].map(|integration| {
        let place = "formulation = \"thin_layer\"\nintegration = \"full\"";
        assert!(text.contains(place), "the case has changed");
        let text = text.replace(
            place,
            &format!("formulation = \"thin_layer\"\nintegration = \"{integration}\""),
        );
        run(&text)
    });
    for finished in [&full, &mean] {
        assert_eq!(finished.observer.cut_backs, 0);
    }
    // Means over points; with 3 × 3 points, those across the layer do not slide all alike, and
    // their mean shear stress stays 2 % below μ σ_n. The mean strain has one point across.
    for (probe, part) in [
        ("sigma_n_shaft", 0.005),
        ("tau_shaft", 0.025),
        ("q_s", 0.025),
        ("q_t", 0.015),
    ] {
        let (a, b) = (full.history(probe), mean.history(probe));
        let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let worst = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
            / largest;
        assert!(worst < part, "{probe}: full and mean differ by {worst:.2e}");
    }
    let slides = mean.last("tau_shaft") / mean.last("sigma_n_shaft");
    assert_close("τ/σ_n of mean strain", slides, 0.7, 0.005, 0.7);
}
