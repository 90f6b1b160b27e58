//! Parameters that follow from those of other laws.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{JOINT, Place, edited, refuses};
use serde_json::Value;
use tests::tolerance::close;

/// An upright joint beside ground whose stiffness grows with the height, and what replaces values of the joint.
fn upright(edits: &[&str]) -> String {
    let own: &[&str] = &[
        "middle = { y = 0.5 } => middle = { x = 1.0 }",
        "young_modulus = 1e4 => young_modulus = { z = [[0.0, 1e4], [1.0, 3e4]] }",
    ];
    edited(&[JOINT, own, edits].concat())
}

fn run(text: &str, settings: &[&str]) -> (Value, String) {
    let place = Place::new();
    place.write("case.toml", text);
    let arguments = ["run", "case.toml", "--out", "out"];
    place.done(&[&arguments[..], settings].concat());
    let summary = std::fs::read(place.path("out/summary.json")).unwrap();
    let history = place.read("out/history.csv");
    (serde_json::from_slice(&summary).unwrap(), history)
}

#[test]
fn what_follows_from_the_ground_follows_its_changes() {
    let text = edited(
        &[
            JOINT,
            &[
                r#"normal_stiffness = 1e6 => normal_stiffness = "= 10 * joint.shear_stiffness""#,
                r#"shear_stiffness = 4e5 => shear_stiffness = "= shear_modulus(soil) / 0.01""#,
                r#"friction_angle = 30.0 => friction_angle = "= atan(0.7 * tan(30))""#,
                r#"cohesion = 10.0 => cohesion = "= max(soil.poisson_ratio, 2) * 5""#,
            ],
        ]
        .concat(),
    );
    for (set, young) in [
        (&[][..], 1e4),
        (
            &["--set", "laws.soil.parameters.young_modulus=2e4"][..],
            2e4,
        ),
    ] {
        let (summary, _) = run(&text, set);
        let joint = &summary["laws"]["joint (interface_2d)"];
        let value = |id: &str| joint["parameters"][id].as_f64().unwrap();
        let shear = young / 2.6 / 0.01;
        let friction = (0.7 * 30f64.to_radians().tan()).atan().to_degrees();
        for (id, expected) in [
            ("shear_stiffness", shear),
            ("normal_stiffness", 10.0 * shear),
            ("friction_angle", friction),
            ("cohesion", 10.0),
        ] {
            let found = value(id);
            close(id, found / expected, 1.0, 1e-14);
        }
        let written = &joint["expressions"]["shear_stiffness"]["expression"];
        assert_eq!(written, "= shear_modulus(soil) / 0.01");
    }
}

/// Two elements, their centres at a quarter and three quarters of the height.
#[test]
fn values_over_the_height_count_at_the_element() {
    let (summary, follows) = run(
        &upright(&[r#"shear_stiffness = 4e5 => shear_stiffness = "= 20 * soil.young_modulus""#]),
        &[],
    );
    let range = &summary["laws"]["joint (interface_2d)"]["expressions"]["shear_stiffness"];
    assert_eq!(range["smallest"].as_f64(), Some(3e5));
    assert_eq!(range["largest"].as_f64(), Some(5e5));
    let over = "shear_stiffness = 4e5 => shear_stiffness = { z = [[0.0, 2e5], [1.0, 6e5]] }";
    let follows_in = summary;
    let (summary, given) = run(&upright(&[over]), &[]);
    assert_eq!(follows, given);
    // There is no one value.
    let of = |summary: &Value, id: &str| {
        let joint = &summary["laws"]["joint (interface_2d)"];
        let range = &joint["varying"][id];
        (
            joint["parameters"][id].as_f64(),
            [&range["smallest"], &range["largest"]].map(Value::as_f64),
        )
    };
    assert_eq!(
        of(&follows_in, "shear_stiffness"),
        (None, [Some(3e5), Some(5e5)])
    );
    assert_eq!(
        of(&summary, "shear_stiffness"),
        (None, [Some(2e5), Some(6e5)])
    );
    assert_eq!(of(&summary, "cohesion"), (Some(10.0), [None; 2]));
    let place = Place::new();
    place.done_case(upright(&[over]));
    assert!(place.read("out/report.html").contains("200000 to 600000"));
}

/// Of E(z), at the centre of each element of the joint.
#[test]
fn moduli_are_those_of_the_ground_beside() {
    let text = upright(&[
        r#"shear_stiffness = 4e5 => shear_stiffness = "= oedometric_modulus(soil) * 10""#,
    ]);
    let (summary, _) = run(&text, &[]);
    let range = &summary["laws"]["joint (interface_2d)"]["expressions"]["shear_stiffness"];
    // M = E (1 − ν)/((1 + ν)(1 − 2ν)), ν = 0.3.
    let expected = |young: f64| 10.0 * young * 0.7 / (1.3 * 0.4);
    for (end, young) in [("smallest", 1.5e4), ("largest", 2.5e4)] {
        let found = range[end].as_f64().unwrap();
        assert!((found / expected(young) - 1.0).abs() < 1e-12, "{found}");
    }
}

#[test]
fn refuses_expressions_that_have_no_value() {
    refuses(
        r#"
no such law
  cohesion = 10.0 => cohesion = ^"= 0.7 * clay.cohesion"
  there is no law `clay` under [laws]
  soil
no such parameter
  cohesion = 10.0 => cohesion = ^"= soil.cohesion"
  law `soil` has no parameter `cohesion`
  young_modulus
a choice
  law = "elastic"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 } => law = "mohr_coulomb"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 30.0, dilatancy_angle = 0.0 }
  cohesion = 10.0 => cohesion = ^"= soil.scheme"
  by default, no number
a circle
  cohesion = 10.0 => cohesion = "= joint.friction_angle"
  friction_angle = 30.0 => friction_angle = ^"= 2 * joint.cohesion"
  `joint.cohesion` follows from itself
out of bounds
  cohesion = 10.0 => cohesion = ^"= -soil.poisson_ratio"
  `joint.cohesion`: -0.3 kPa is outside [0, ∞)
no number
  cohesion = 10.0 => cohesion = ^"= sqrt(-1)"
  `joint.cohesion`: the expression gives NaN, no number: `sqrt(-1)` is none
the natural logarithm
  cohesion = 10.0 => cohesion = ^"= ln(2)"
  no function `ln`
  `log`
a name alone
  cohesion = 10.0 => cohesion = ^"= 2 * poisson_ratio"
  `poisson_ratio` lacks its law: `soil.poisson_ratio`
a hyphen
  [laws.soil] => [laws.stiff-soil]
  law = "soil" => law = "stiff-soil"
  cohesion = 10.0 => cohesion = ^"= 2 * stiff-soil.young_modulus"
  did you mean `"stiff-soil".young_modulus`?
no sign of equality
  cohesion = 10.0 => cohesion = ^"2*3"
  expected a number
  an expression begins with `=`
a typographic minus
  cohesion = 10.0 => cohesion = ^"= 3 − 2"
  `−` is a typographic minus: write `-`
not closed
  cohesion = 10.0 => cohesion = ^"= 2 * (1 + 3"
  `joint.cohesion`: the expression ends, expected `)`
an interface has no modulus
  cohesion = 10.0 => cohesion = ^"= shear_modulus(joint)"
  law `joint` is no law of ground here
"#,
    );
}

/// Two blocks on a joint that has a tenth of their cohesion and slides.
const BLOCKS: &str = r#"analysis = "plane_strain"
[mesh]
columns = [{ n = 1, to = 1.0 }]
rows = [{ n = 1, to = 0.5 }, { n = 1, to = 1.0 }]
lines = { bottom = { y = 0.0 }, joint = { y = 0.5 }, top = { y = 1.0 } }
region = [{ group = "blocks" }]
[laws]
block = { law = "mohr_coulomb", parameters = { young_modulus = 1e7, poisson_ratio = 0.2, cohesion = 100.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 1e5, cohesion = "= 0.1 * block.cohesion", friction_angle = 0.0, dilatancy_angle = 0.0 } }
[groups]
blocks = { formulation = "solid", law = "block" }
joint = { formulation = "zero_thickness", line = "joint", law = "joint" }
[[supports]]
line = "bottom"
fixed = ["x", "y"]
[[phase]]
name = "weight"
increments = 1
pressure = [{ line = "top", value = 100.0 }]
[[phase]]
name = "push"
increments = 5
displacement = [{ line = "top", x = 1e-3 }]
[probes]
tau = { group = "joint", quantity = "traction_t" }
u = { line = "top", quantity = "displacement_x" }
"#;

#[test]
fn what_follows_is_varied_by_studies_and_found_by_calibrations() {
    let place = Place::new();
    place.write("case.toml", BLOCKS);
    let study = "title = \"cohesion\"\ncase = \"case.toml\"\nmethod = \"list\"\n\
         [[parameter]]\nkey = \"laws.block.parameters.cohesion\"\nvalues = [100.0, 200.0]\n\
         [outputs]\ntau = { probe = \"tau\" }\n";
    place.write("study.toml", study);
    place.done(&["study", "study.toml", "--out", "study"]);
    let runs = place.read("study/runs.csv");
    let tau = runs.lines().skip(1).map(|line| line.split(',').nth(3));
    let tau: Vec<f64> = tau.map(|tau| tau.unwrap().parse().unwrap()).collect();
    for (tau, tenth) in tau.iter().zip([10.0, 20.0]) {
        assert!((tau - tenth).abs() < 1e-9, "{runs}");
    }
    // A joint that slides at 14.5 kPa.
    place.write("measured.csv", "u,tau\n2e-4,14.5\n6e-4,14.5\n1e-3,14.5\n");
    let calibration = "title = \"cohesion\"\n[free]\ncohesion = { laws = [\"block\"], min = 50.0, max = 300.0 }\n\
         [[test]]\nname = \"push\"\ncase = \"case.toml\"\n[[test.curve]]\nx = \"u\"\ny = \"tau\"\nphase = \"push\"\n\
         measured = { file = \"measured.csv\", x = \"u\", y = \"tau\" }\nnoise = 0.1\n";
    place.write("calibration.toml", calibration);
    let outcome = place.done(&["calibrate", "calibration.toml", "--out", "found"]);
    let found = outcome.stdout;
    assert!(found.contains("cohesion = 145.0\n"), "{found}");
}
