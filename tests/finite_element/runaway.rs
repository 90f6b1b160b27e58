//! Iterates that run away along a mechanism.
//!
//! Goal        a runaway iterate is no equilibrium: the run is right, or ends with exit code 2.
//! Geometry    a steel pile next to ground on a fine mesh; a footing on a strongly graded one.
//! Boundary    ground without confinement, integration `reduced`: elements held by almost no stiffness; head or
//!             strip pushed down.
//! Law         mohr_coulomb.
//! Asserts     head load of the pile as with more increments and with full integration (26.6 to 26.9). Pressure
//!             under the footing above N_c = 2 + π by no more than on the meshes of `footing.rs`, and reactions
//!             that balance. Otherwise no equilibrium, and the runaway is named, by every method, condensed or not.

use crate::footing::{self, Footing};
use crate::setup::{Results, fail};
use input::Kind;
use std::f64::consts::PI;
use tests::case::{column, run_text};

const METHODS: [&str; 7] = [
    "",
    "method = \"newton\"",
    "method = \"modified_newton\"",
    "method = \"initial_stress\"",
    "method = \"quasi_newton\"",
    "control = \"arc_length\"",
    "equations = \"sparse\"",
];

/// Runs a case that ends well or without equilibrium; the last values of these probes if it ends
/// well, the message else.
fn outcome<const N: usize>(text: &str, probes: [&str; N]) -> Result<[f64; N], String> {
    let folder = tempfile::tempdir().unwrap();
    match run_text(text, folder.path()) {
        Ok(_) => {
            let history = folder.path().join("history.csv");
            Ok(probes.map(|probe| *column(&history, probe).last().expect("an increment")))
        }
        Err(error) if error.kind() == Kind::NoEquilibrium => Err(error.to_string()),
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// A pile of steel at the axis of a chamber, 0.1 mm in one increment.
fn pile(solver: &str) -> String {
    format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "bottom", fixed = ["x", "y"] }}, {{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}]
[mesh]
origin = [1.0, 0.0]
columns = [{{ n = 2, to = 1.04 }}, {{ n = 1, to = 1.041 }}, {{ n = 2, to = 1.1 }}]
rows = [{{ n = 4, to = 0.05 }}, {{ n = 1, to = 0.051 }}, {{ n = 4, to = 0.1 }}]
region = [{{ group = "ground" }}, {{ group = "pile", x = [1.0, 1.04], y = [0.05, 0.1] }}]
lines = {{ left = {{ x = 1.0 }}, right = {{ x = 1.1 }}, bottom = {{ y = 0.0 }}, head = {{ y = 0.1, x = [1.0, 1.04] }} }}
[laws]
steel = {{ law = "elastic", parameters = {{ young_modulus = 210e6, poisson_ratio = 0.28 }} }}
[laws.ground]
law = "mohr_coulomb"
parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 36.5, dilatancy_angle = 12.0 }}
[groups]
ground = {{ formulation = "solid", law = "ground", integration = "reduced" }}
pile = {{ formulation = "solid", integration = "full", law = "steel" }}
[[phase]]
name = "push"
increments = 1
displacement = [{{ line = "head", y = -1e-4 }}]
[probes]
head = {{ line = "head", quantity = "reaction_z", scale = -1.0 }}
bottom = {{ line = "bottom", quantity = "reaction_z" }}
[solver]
max_halvings = 3
{solver}
"#
    )
}

#[test]
fn a_pile_in_one_increment_carries_what_it_does_in_ten() {
    for method in METHODS {
        match outcome(&pile(method), ["head", "bottom"]) {
            Ok([head, bottom]) => {
                assert!((26.6..26.9).contains(&head), "{method}: {head} kN");
                assert!((head - bottom).abs() < 1e-6 * head, "{method}: {bottom} kN");
            }
            Err(message) => assert!(message.contains("no equilibrium"), "{method}: {message}"),
        }
    }
}

/// Sixteen elements: a block of steel on ground that bears no tension, its side free.
fn block(solver: &str) -> String {
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["x", "y"] }}, {{ line = "left", fixed = ["x"] }}]
[mesh]
origin = [-1.0, -2.0]
columns = [{{ n = 1, to = -0.96 }}, {{ n = 1, to = -0.9 }}]
rows = [{{ n = 4, to = -1.5 }}, {{ n = 4, to = -1.0 }}]
region = [{{ group = "ground" }}, {{ group = "block", x = [-1.0, -0.96], y = [-1.5, -1.0] }}]
lines = {{ left = {{ x = -1.0 }}, bottom = {{ y = -2.0 }}, head = {{ y = -1.0, x = [-1.0, -0.96] }} }}
[laws]
steel = {{ law = "elastic", parameters = {{ young_modulus = 210e6, poisson_ratio = 0.28 }} }}
[laws.ground]
law = "mohr_coulomb"
parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 36.5, dilatancy_angle = 12.0, tensile_strength = 0.0 }}
[groups]
ground = {{ formulation = "solid", law = "ground", integration = "reduced" }}
block = {{ formulation = "solid", integration = "full", law = "steel" }}
[[phase]]
name = "push"
increments = 3
displacement = [{{ line = "head", y = -0.1 }}]
[probes]
head = {{ line = "head", quantity = "reaction_y", scale = -1.0 }}
bottom = {{ line = "bottom", quantity = "reaction_y" }}
[solver]
max_halvings = 3
{solver}
"#
    )
}

#[test]
fn a_block_on_ground_that_flows_away_is_in_no_equilibrium() {
    for method in [
        "",
        "force_tolerance = 1e-12",
        "method = \"modified_newton\"",
    ] {
        match outcome(&block(method), ["head", "bottom"]) {
            Ok([head, bottom]) => assert!(
                (head - bottom).abs() < 1e-6 * head,
                "{method}: {head}, {bottom}"
            ),
            Err(message) => assert!(message.contains("no equilibrium"), "{method}: {message}"),
        }
    }
}

#[test]
fn a_footing_on_a_strongly_graded_mesh_carries_its_limit_load_or_says_that_it_does_not() {
    let graded = |n| {
        footing::text(Footing {
            n,
            increments: 2,
            settlement: 1.0,
            ..footing::TRESCA
        })
        .replace(
            "[probes]",
            "[probes]\nbottom = { line = \"bottom\", quantity = \"reaction_y\" }",
        )
    };
    for by in [200.0, 2000.0] {
        let text = strongly_graded(&graded(3), 3, by);
        match outcome(&text, ["pressure", "bottom"]) {
            Ok([pressure, bottom]) => {
                // The meshes of `footing.rs` are within 10 % of the limit, from above.
                let exact = 2.0 + PI;
                assert!(
                    pressure > 0.99 * exact && pressure < 1.1 * exact,
                    "graded by {by}: {pressure}"
                );
                assert!(
                    (pressure - bottom).abs() < 1e-6 * pressure,
                    "graded by {by}: {bottom}"
                );
            }
            Err(message) => assert!(
                message.contains("no equilibrium"),
                "graded by {by}: {message}"
            ),
        }
    }
}

/// The mesh of a footing with elements that shrink by so much instead of 5.
fn strongly_graded(text: &str, n: usize, by: f64) -> String {
    let ratio = |by: f64| by.powf(-1.0 / n as f64);
    let (mild, strong) = (ratio(5.0), ratio(by));
    let mut text = text.to_owned();
    for (old, new) in [
        (mild, strong),
        ((1.0 / mild).sqrt(), (1.0 / strong).sqrt()),
        (mild.sqrt(), strong.sqrt()),
    ] {
        let [old, new] = [old, new].map(|ratio| format!("ratio = {ratio} "));
        assert_eq!(text.matches(&old).count(), 1, "{old}");
        text = text.replace(&old, &new);
    }
    text
}

#[test]
fn what_ran_away_is_named() {
    // Corrections with a kept matrix, accelerated, leave the model altogether.
    let failed = fail(&block("method = \"quasi_newton\""));
    assert_eq!(failed.error.exit_code(), 2);
    let message = failed.error.to_string();
    assert!(message.contains(" ran away: "), "{message}");
    assert!(message.contains("group `ground`"), "{message}");
}

#[test]
fn both_criteria_are_given_and_the_failed_one_first() {
    let failed = fail(&block("control = \"load\""));
    let message = failed.error.to_string();
    let at = |what: &str| {
        message
            .find(what)
            .unwrap_or_else(|| panic!("{what}: {message}"))
    };
    let residual = at("residual");
    assert!(residual < at("last correction"), "{message}");
    assert!(message.contains("tolerance 1.0e-9") && message.contains("tolerance 1.0e-7"));
}

/// A pile in an elastic ground whose layer slides; with the matrix of a step's start corrections grow tenfold.
const GROWS: &str = r#"
analysis = "axisymmetric"
supports = [{ line = "bottom", fixed = ["x", "y"] }, { line = "far", fixed = ["x"] }, { line = "axis", fixed = ["x"] }]
[mesh]
origin = [0.0, -6.0]
columns = [{ n = 1, to = 0.5 }, { n = 1, to = 0.52 }, { n = 5, to = 5.0, ratio = 1.3 }]
rows = [{ n = 2, to = -2.0 }, { n = 4, to = 0.0 }]
region = [{ group = "ground" }, { group = "pile", x = [0.0, 0.5] }, { group = "shaft", x = [0.5, 0.52] }]
lines = { axis = { x = 0.0 }, far = { x = 5.0 }, bottom = { y = -6.0 }, head = { x = [0.0, 0.5], y = 0.0 } }
[laws]
ground = { law = "elastic", parameters = { young_modulus = 20e3, poisson_ratio = 0.3 } }
concrete = { law = "elastic", parameters = { young_modulus = 30e6, poisson_ratio = 0.2 } }
[laws.shaft]
law = "cyclic_joint"
parameters = { normal_stiffness = 1e6, shear_stiffness = 3e5, peak_friction_angle = 30.0, residual_friction_angle = 22.0, friction_slip = 0.01, contraction_angle = 3.0, contraction_slip = 0.01 }
[groups]
ground = { formulation = "solid", law = "ground", integration = "reduced", unit_weight = 18.0, initial_stress = { k_0 = 0.6 } }
pile = { formulation = "solid", law = "concrete", unit_weight = 18.0, initial_stress = { k_0 = 0.6 } }
[groups.shaft]
formulation = "thin_layer"
law = "ground"
normal = "x"
integration = "reduced"
unit_weight = 18.0
initial_stress = { stress_11 = [[-6.0, -64.8], [0.0, 0.0]], stress_22 = [[-6.0, -108.0], [0.0, 0.0]], stress_33 = [[-6.0, -64.8], [0.0, 0.0]] }
[[phase]]
name = "in place"
increments = 1
laws = { shaft = "shaft" }
[[phase]]
name = "push"
increments = 1
displacement = [{ line = "head", y = -0.01 }]
[solver]
method = "modified_newton"
"#;

/// Corrections that grow until their squares are no numbers end the iterations there: what is reported of them is
/// finite, and how many there were.
#[test]
fn iterations_that_leave_all_numbers_behind_end_there() {
    let failed = fail(GROWS);
    assert_eq!(failed.error.kind(), Kind::NoEquilibrium);
    let log = std::fs::read_to_string(failed.folder().join("log.jsonl")).unwrap();
    let said = |line: &str| line.contains("no equilibrium after");
    let attempts: Vec<&str> = log.lines().filter(|line| said(line)).collect();
    assert!(!log.contains("NaN"), "{log}");
    assert!(!log.contains("last correction inf"), "{log}");
    // 200 iterations are allowed.
    let is_short = |line: &&&str| !line.contains("no equilibrium after 200 iterations");
    let short: Vec<_> = attempts.iter().filter(is_short).collect();
    assert!(!short.is_empty(), "{attempts:?}");
    assert!(short.len() < attempts.len(), "{attempts:?}");
}
