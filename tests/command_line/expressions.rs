//! Parameters that follow from those of other laws.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, DONE, Edit, JOINT, Place, edited, refuses};
use serde_json::Value;

/// An upright joint beside ground whose stiffness grows with the height, and what replaces values of the joint.
fn upright(edits: &[Edit]) -> String {
    let own: &[Edit] = &[
        ("middle = { y = 0.5 }", "middle = { x = 1.0 }"),
        (
            "young_modulus = 1e4",
            "young_modulus = { z = [[0.0, 1e4], [1.0, 3e4]] }",
        ),
    ];
    edited(&[JOINT, own, edits].concat())
}

fn run(text: &str, settings: &[&str]) -> (Value, String) {
    let place = Place::new();
    place.write("case.toml", text);
    let arguments = ["run", "case.toml", "--out", "out"];
    let outcome = place.run(&[&arguments[..], settings].concat());
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    let summary = std::fs::read(place.path("out/summary.json")).unwrap();
    let history = std::fs::read_to_string(place.path("out/history.csv")).unwrap();
    (serde_json::from_slice(&summary).unwrap(), history)
}

#[test]
fn what_follows_from_the_ground_follows_its_changes() {
    let text = edited(
        &[
            JOINT,
            &[
                (
                    "normal_stiffness = 1e6",
                    "normal_stiffness = \"= 10 * joint.shear_stiffness\"",
                ),
                (
                    "shear_stiffness = 4e5",
                    "shear_stiffness = \"= shear_modulus(soil) / 0.01\"",
                ),
                (
                    "friction_angle = 30.0",
                    "friction_angle = \"= atan(0.7 * tan(30))\"",
                ),
                (
                    "cohesion = 10.0",
                    "cohesion = \"= max(soil.poisson_ratio, 2) * 5\"",
                ),
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
            assert!(
                (found / expected - 1.0).abs() < 1e-14,
                "{id}: {found}, {expected}"
            );
        }
        let written = &joint["expressions"]["shear_stiffness"]["expression"];
        assert_eq!(written, "= shear_modulus(soil) / 0.01");
    }
}

/// Two elements, their centres at a quarter and three quarters of the height.
#[test]
fn values_over_the_height_count_at_the_element() {
    let (summary, follows) = run(
        &upright(&[(
            "shear_stiffness = 4e5",
            "shear_stiffness = \"= 20 * soil.young_modulus\"",
        )]),
        &[],
    );
    let range = &summary["laws"]["joint (interface_2d)"]["expressions"]["shear_stiffness"];
    assert_eq!(range["smallest"].as_f64(), Some(3e5));
    assert_eq!(range["largest"].as_f64(), Some(5e5));
    let given = (
        "shear_stiffness = 4e5",
        "shear_stiffness = { z = [[0.0, 2e5], [1.0, 6e5]] }",
    );
    let (_, given) = run(&upright(&[given]), &[]);
    assert_eq!(follows, given);
}

/// Of E(z), at the centre of each element of the joint.
#[test]
fn moduli_are_those_of_the_ground_beside() {
    let text = upright(&[(
        "shear_stiffness = 4e5",
        "shear_stiffness = \"= oedometric_modulus(soil) * 10\"",
    )]);
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
        BAD_INPUT,
        &[
            (
                "no such law",
                &[("cohesion = 10.0", "cohesion = ^\"= 0.7 * clay.cohesion\"")],
                &["there is no law `clay` under [laws]", "soil"],
            ),
            (
                "no such parameter",
                &[("cohesion = 10.0", "cohesion = ^\"= soil.cohesion\"")],
                &["law `soil` has no parameter `cohesion`", "young_modulus"],
            ),
            (
                "a circle",
                &[
                    ("cohesion = 10.0", "cohesion = \"= joint.friction_angle\""),
                    (
                        "friction_angle = 30.0",
                        "friction_angle = ^\"= 2 * joint.cohesion\"",
                    ),
                ],
                &["`joint.cohesion` follows from itself"],
            ),
            (
                "out of bounds",
                &[("cohesion = 10.0", "cohesion = ^\"= -soil.poisson_ratio\"")],
                &["`joint.cohesion`: -0.3 kPa is outside [0, ∞)"],
            ),
            (
                "no number",
                &[("cohesion = 10.0", "cohesion = ^\"= sqrt(-1)\"")],
                &["`joint.cohesion`: the expression gives NaN, no number"],
            ),
            (
                "not closed",
                &[("cohesion = 10.0", "cohesion = ^\"= 2 * (1 + 3\"")],
                &["`joint.cohesion`: the expression ends, expected `)`"],
            ),
            (
                "an interface has no modulus",
                &[("cohesion = 10.0", "cohesion = ^\"= shear_modulus(joint)\"")],
                &["law `joint` is no law of ground here"],
            ),
        ],
    );
}
