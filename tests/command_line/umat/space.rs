//! Routines of interfaces with three components, normal first.

use super::{DONE, Place, number, place, rows};
use std::collections::BTreeMap;
use tests::or_skip;
use tests::tolerance::close;
use tests::tolerance::near;

fn driver(hypothesis: &str, segments: &str) -> String {
    format!(
        "law = \"umat_joint_3d\"\nadapter = \"umat\"\nlibrary = \"libjoint_3d.so\"\n\
         hypothesis = \"{hypothesis}\"\n\
         parameters = {{ normal_stiffness = 1e6, shear_stiffness = 1e5, friction = 0.5 }}\n\
         initial = {{ traction = {{ n = -100.0 }} }}\n{segments}"
    )
}

/// Sheared out and back under 100 kPa, along a direction.
fn sheared(
    place: &Place,
    hypothesis: &str,
    along: &[(&str, f64)],
) -> Vec<BTreeMap<String, String>> {
    let segment = |reach: f64| {
        let led = along.iter();
        let led: Vec<String> = led
            .map(|(name, part)| format!("{name} = {{ jump = {:?} }}", reach * part))
            .collect();
        format!(
            "[[segment]]\nincrements = 10\ncontrol = {{ n = {{ traction = -100.0 }}, {} }}\n",
            led.join(", ")
        )
    };
    rows(
        place,
        &driver(hypothesis, &(segment(4e-3) + &segment(-1e-3))),
    )
}

#[test]
fn three_components_come_normal_first() {
    let place = or_skip!(place("joint_3d"));
    let all = sheared(&place, "interface_3d", &[("t", 0.6), ("s", 0.8)]);
    let end = &all[10];
    for (column, expected) in [
        ("traction_n", -100.0),
        ("traction_t", 0.6 * 50.0),
        ("traction_s", 0.8 * 50.0),
        ("plastic_slip", 4e-3 - 50.0 / 1e5),
        // One direct component, two shear components.
        ("ndi", 1.0),
        ("nshr", 2.0),
        ("ntens", 3.0),
    ] {
        let found = number(end, column);
        close(column, found, expected, 1e-9 * expected.abs());
    }
    // Its own tangent: what is led by tractions converges at once.
    let creeping = "[[segment]]\nincrements = 10\n\
                    control = { n = { jump = -2e-4 }, t = { traction = 30.0 }, s = { jump = 3e-3 } }\n";
    let rows = rows(&place, &driver("interface_3d", creeping));
    let most = rows[1..].iter().map(|row| number(row, "iterations"));
    assert!(most.fold(0.0, f64::max) <= 8.0);
    let end = rows.last().unwrap();
    // 300 kPa press, so 150 kPa hold: 30 along t, what is left of them along s.
    let expected = f64::sqrt(150.0 * 150.0 - 30.0 * 30.0);
    let found = number(end, "traction_s");
    near(found, expected, 1e-6 * expected);
}

#[test]
fn space_gives_what_the_plane_gives() {
    let place = or_skip!(place("joint_3d"));
    let plane = sheared(&place, "interface_2d", &[("t", 1.0)]);
    let along = sheared(&place, "interface_3d", &[("t", 1.0), ("s", 0.0)]);
    let askew = sheared(&place, "interface_3d", &[("t", -0.28), ("s", 0.96)]);
    assert_eq!(number(&plane[0], "ntens"), 0.0);
    assert_eq!(number(&plane[1], "ntens"), 2.0);
    for ((plane, along), askew) in plane.iter().zip(&along).zip(&askew) {
        let shear = number(plane, "traction_t");
        let near = |row: &BTreeMap<String, String>, column: &str, expected: f64| {
            let found = number(row, column);
            close(column, found, expected, 1e-9);
        };
        near(along, "traction_t", shear);
        near(along, "traction_s", 0.0);
        near(askew, "traction_t", -0.28 * shear);
        near(askew, "traction_s", 0.96 * shear);
        near(along, "plastic_slip", number(plane, "plastic_slip"));
        near(askew, "plastic_slip", number(plane, "plastic_slip"));
    }
}

#[test]
fn figures_draw_both_slips_and_the_friction_of_both() {
    let place = or_skip!(place("joint_3d"));
    let text = driver(
        "interface_3d",
        "[[segment]]\nincrements = 10\ncontrol = { t = { jump = 3e-3 }, s = { jump = 4e-3 } }\n\
         [[figure]]\nname = \"friction\"\nx = \"u_s\"\ny = [\"mu\"]\n",
    );
    place.write("driver.toml", &text);
    place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    assert!(place.path("friction.svg").is_file());
    // No finite-element formulation takes it.
    let layer = crate::program::CASE
        .replacen("law = \"coulomb_joint\"\n", "law = \"umat_joint_3d\"\nadapter = \"umat\"\n\
                   library = \"libjoint_3d.so\"\nsidecar = \"space.law.toml\"\n", 1)
        .replacen("[laws.joint.parameters]\nnormal_stiffness = 1e6\nshear_stiffness = 4e5\n\
                   cohesion = 10.0\nfriction_angle = 30.0\ndilatancy_angle = 5.0\n",
                  "[laws.joint.parameters]\nnormal_stiffness = 1e6\nshear_stiffness = 4e5\nfriction = 0.5\n", 1);
    let sidecar = place.read("joint_3d.law.toml");
    place.write(
        "space.law.toml",
        sidecar
            .replacen(
                "[\"interface_2d\", \"interface_3d\"]",
                "[\"interface_3d\"]",
                1,
            )
            .replacen("[2, 3]", "[3]", 1),
    );
    let outcome = place.run_case(layer);
    assert_ne!(outcome.code, Some(DONE));
    outcome.shows("interface_3d");
}
