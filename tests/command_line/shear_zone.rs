//! Interface laws made from laws of solids, `adapter = "shear_zone"`.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{DONE, JOINT, NO_EQUILIBRIUM, Place, edited};
use crate::umat;
use tests::case::column;
use tests::or_skip;
use tests::tolerance::near;
use tests::words::{self, rows_of};

/// The joint of the case, 1 cm of the soil.
const ZONE: &str = "adapter = \"shear_zone\"\nlaw = \"elastic\"\nthickness = 0.01\n\
                    parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n";
const OWN: &str = "law = \"coulomb_joint\"\n[laws.joint.parameters]\nnormal_stiffness = 1e6\n\
                   shear_stiffness = 4e5\ncohesion = 10.0\nfriction_angle = 30.0\n\
                   dilatancy_angle = 5.0\n";

/// The case with its joint along the middle, of this law.
fn joint(law: &str) -> String {
    let text = edited(JOINT);
    assert!(text.contains(OWN));
    text.replacen(OWN, law, 1)
}

/// Ends of all probes.
fn ends(place: &Place, text: &str, arguments: &[&str]) -> Vec<f64> {
    place.write("case.toml", text);
    let run = ["run", "case.toml", "--out", "out"];
    place.done(&[&run, arguments].concat());
    let end = |name| *column(&place.path("out/history.csv"), name).last().unwrap();
    ["settlement", "tau"].map(end).to_vec()
}

fn assert_same(found: &[f64], expected: &[f64]) {
    for (found, expected) in found.iter().zip(expected) {
        near(*found, *expected, 1e-9 * expected.abs());
    }
}

/// A joint with the stiffness of the zone, (λ + 2G)/d and G/d, and strength without end.
fn equal_joint() -> String {
    let (g, lambda) = (1e4 / 2.6, 1e4 * 0.3 / (1.3 * 0.4));
    joint(&format!(
        "law = \"coulomb_joint\"\n[laws.joint.parameters]\nnormal_stiffness = {:?}\n\
         shear_stiffness = {:?}\ncohesion = 1e9\nfriction_angle = 30.0\ndilatancy_angle = 0.0\n",
        (lambda + 2.0 * g) / 0.01,
        g / 0.01
    ))
}

#[test]
fn an_elastic_zone_is_a_joint_with_its_stiffness() {
    let place = Place::new();
    let expected = ends(&place, &equal_joint(), &[]);
    assert!(expected[1].abs() > 1e-3, "it is sheared: {expected:?}");
    for arguments in [&[][..], &["--isolate"]] {
        assert_same(&ends(&place, &joint(ZONE), arguments), &expected);
    }
    // A law of its own name may fill it; and one of another table, whose values it overrides.
    let named = joint(&ZONE.replace("\"elastic\"", "\"soil\""));
    assert_same(&ends(&place, &named, &[]), &expected);
    let inherited = joint("adapter = \"shear_zone\"\nlaw = \"soil\"\nthickness = 0.01\n");
    assert_same(&ends(&place, &inherited, &[]), &expected);
    let named = joint(ZONE)
        .replace("[laws.joint]", "[laws.elastic]")
        .replacen("law = \"joint\"", "law = \"elastic\"", 1);
    assert_same(&ends(&place, &named, &[]), &expected);
}

#[test]
fn a_umat_fills_a_zone() {
    let place = or_skip!(umat::place("elastic"));
    let expected = ends(&place, &equal_joint(), &[]);
    let table = "adapter = \"shear_zone\"\nlaw = \"clay\"\nthickness = 0.01\n\n[laws.clay]\n\
                 law = \"umat_elastic\"\nadapter = \"umat\"\nlibrary = \"libelastic.so\"\n\
                 parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n";
    let text = joint(table);
    assert_same(&ends(&place, &text, &[]), &expected);
    // The lock of the case holds the routine; the summary says what was filled.
    place.done(&["lock", "case.toml"]);
    assert_same(&ends(&place, &text, &[]), &expected);
    let summary = place.summary();
    let zone = &summary["laws"]["joint (interface_2d)"]["shear_zone"];
    assert_eq!(zone["thickness"].as_f64(), Some(0.01));
    assert_eq!(zone["lateral_ratio"].as_f64(), Some(1.0));
}

/// A driver of a zone that a routine fills which follows no increment above 10⁻⁵ of strain.
const SMALLER: &str = "law = \"soil\"\nadapter = \"shear_zone\"\nthickness = 0.02\n\
                       lateral_ratio = 0.5\nhypothesis = \"interface_2d\"\n\
                       [laws.soil]\nlaw = \"umat_smaller\"\nadapter = \"umat\"\n\
                       library = \"libsmaller.so\"\n\
                       [laws.soil.parameters]\nyoung_modulus = 2e4\npoisson_ratio = 0.3\n\
                       largest = 1e-30\n\
                       [initial]\ntraction = { n = -100.0, t = 0.0 }\n\
                       [[segment]]\nincrements = 1\ncontrol = { t = { jump = 1e-3 } }\n";

#[test]
fn a_failed_call_is_repeated_in_its_zone() {
    let place = or_skip!(umat::place("smaller"));
    place.write("driver.toml", SMALLER);
    place
        .run(&["point", "driver.toml", "--csv", "out.csv"])
        .ended(NO_EQUILIBRIUM);
    let text = place.read("out.failure.toml");
    let capsule: toml::Table = toml::from_str(&text).unwrap();
    let zone = &capsule["law"]["shear_zone"];
    assert_eq!(zone["thickness"].as_float(), Some(0.02));
    assert_eq!(zone["lateral_ratio"].as_float(), Some(0.5));
    let start = &capsule["start"];
    assert_eq!(start["traction"]["n"].as_float(), Some(-100.0));
    assert_eq!(start["internal"]["zone_stress_11"].as_float(), Some(-50.0));
    assert_eq!(start["internal"]["zone_stress_33"].as_float(), Some(-50.0));
    let outcome = place
        .run(&["replay", "out.failure.toml"])
        .ended(NO_EQUILIBRIUM);
    outcome.prints("as recorded: `cut step`");

    // What no zone can be is refused where it stands.
    place.write(
        "flat.toml",
        text.replacen("thickness = 0.02", "thickness = 0.0", 1),
    );
    let outcome = place.refused(&["replay", "flat.toml"]);
    outcome
        .shows("`thickness`: 0 m is outside (0, ∞)")
        .shows("flat.toml");
}

#[test]
fn mistakes_are_said_where_they_are_made() {
    let place = Place::new();
    for [edit, says, more] in rows_of(
        r#"
thickness = 0.01\n =>  | `adapter = "shear_zone"` needs the `thickness` of the zone, m | case.toml
thickness = 0.01 => thickness = 0.0 | `thickness`: 0 m is outside (0, ∞) | case.toml
thickness = 0.01 => thickness = 1e-20 | `thickness`: 1e-20 m is below 1e-9 m | case.toml:
law = "elastic"\nthickness => law = "soul"\nthickness | no library with law `soul` | did you mean `soil`?
adapter = "shear_zone"\nlaw = "elastic"\nthickness = 0.01 => law = "elastic" | `adapter = "shear_zone"` with a `thickness` makes | case.toml
thickness = 0.01 => thickness = 0.01\nlateral_ratio = -1.0 | `lateral_ratio`: -1 is outside [0, ∞) | case.toml
adapter = "shear_zone"\n =>  | `thickness` is for `adapter = "shear_zone"` | case.toml
thickness = 0.01 => thickness = 0.01\nlibrary = "libx.so" | `library` belongs to the law that fills the zone | law = "NAME"
law = "elastic"\nthickness => law = "coulomb_joint"\nthickness | a shear zone is made from a law of solids | interface_2d
law = "elastic"\nthickness => law = "elastik"\nthickness | no library with law `elastik` | case.toml
law = "elastic"\nthickness => law = "soil"\nsha256 = "0000000000000000000000000000000000000000000000000000000000000000"\nthickness | `sha256` belongs to the law that fills the zone | [laws.soil]
poisson_ratio = 0.3 }\n\n[groups.soil] => poisson_ratio = 0.7 }\n\n[groups.soil] | `poisson_ratio`: 0.7 | case.toml
"#,
    ) {
        let outcome = place.run_case(words::edited(&joint(ZONE), &[edit]));
        assert_ne!(outcome.code, Some(DONE), "{edit}");
        for text in [says, more, "case.toml"] {
            outcome.shows(text);
        }
    }
}

#[test]
fn what_cannot_be_a_zone_or_take_one_is_refused() {
    let place = Place::new();
    // A zone of a zone; a solid of a zone.
    let nested = joint(&format!(
        "adapter = \"shear_zone\"\nlaw = \"other\"\nthickness = 0.01\n[laws.other]\n{ZONE}"
    ));
    let outcome = place.refused_case(nested);
    outcome.shows("law `other` is a shear zone itself");
    let solid = joint(ZONE).replacen("law = \"soil\"", "law = \"joint\"", 1);
    let outcome = place.refused_case(solid);
    outcome.shows("law `joint` is a shear zone, made for interface_2d");
    // A driver's table that nothing is made from.
    let unused = SMALLER.replacen(
        "adapter = \"shear_zone\"\nthickness = 0.02\nlateral_ratio = 0.5\n",
        "",
        1,
    );
    place.write("driver.toml", unused);
    let outcome = place.refused(&["point", "driver.toml"]);
    outcome.shows("law `soil` is not used");
}

#[test]
fn thicknesses_that_are_seldom_meant_are_warned_of() {
    let place = Place::new();
    let layer = |thickness: &str| {
        let text = edited(&[]).replacen(OWN, ZONE, 1);
        text.replacen("thickness = 0.01", thickness, 1)
    };
    let about = ["the layer of elements is 0.010000 m thick", "usual range"];
    for (thickness, said) in [
        ("thickness = 0.01", [false, false]),
        ("thickness = 0.02", [true, false]),
        ("thickness = 5.0", [true, true]),
        ("thickness = 5e-5", [true, true]),
    ] {
        let outcome = place.done_case(layer(thickness));
        for (words, said) in about.iter().zip(said) {
            assert_eq!(outcome.says(words), said, "{thickness}: {}", outcome.stderr);
        }
    }
    // At one point there is no layer.
    let zone = "law = \"elastic\"\nadapter = \"shear_zone\"\nhypothesis = \"interface_2d\"\n\
                thickness = 5.0\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n\
                segment = [{ increments = 1, control = { t = { jump = 1e-3 } } }]\n";
    place.write("driver.toml", zone);
    let outcome = place.done(&["point", "driver.toml"]);
    outcome.shows("thickness = 5 m of its shear zone is outside its usual range [1e-4, 0.5]");
}

#[test]
fn what_a_case_gives_to_start_from_is_looked_at_without_stress_too() {
    let place = Place::new();
    let zone = ZONE.replace("\"elastic\"", "\"mohr_coulomb\"").replace(
        "poisson_ratio = 0.3 }",
        "poisson_ratio = 0.3, cohesion = 5.0, friction_angle = 30.0, dilatancy_angle = 0.0 }\n\
         initial = { zone_stress_11 = -500.0 }",
    );
    let outcome = place.done_case(joint(&zone));
    outcome
        .shows("law `joint` takes over group `layer`")
        .shows("where it found none");
    let outcome = place.done_case(joint(&zone.replace("-500.0", "0.0")));
    outcome.hides("takes over");
}

/// At 2e24 kPa a rounding of the strain changes the stress more than its tolerance, which is
/// reported.
#[test]
fn a_stress_that_round_off_keeps_from_its_goal_is_told() {
    let place = Place::new();
    let driver = |young: &str| {
        format!(
            "law = \"mohr_coulomb\"\nhypothesis = \"plane_strain\"\nparameters = {{ young_modulus = {young}, \
             poisson_ratio = 0.3, cohesion = 0.0, friction_angle = 35.0, dilatancy_angle = 0.0 }}\n\
             initial = {{ stress = {{ 11 = -100.0, 22 = -100.0, 33 = -100.0 }} }}\n\
             segment = [{{ increments = 100, control = {{ 12 = {{ strain = 5e-4 }}, 11 = {{ strain = 0.0 }}, \
             33 = {{ strain = 0.0 }} }} }}]\n"
        )
    };
    for (young, said) in [("20e3", false), ("2e24", true)] {
        place.write("driver.toml", driver(young));
        let outcome = place.done(&["point", "driver.toml"]);
        let words = "is so stiff that rounding the strain changes the stress by as much";
        assert_eq!(outcome.says(words), said, "{young}: {}", outcome.stderr);
    }
}

/// A base at its resistance answers to no further movement, but to the way back.
#[test]
fn a_strength_that_is_reached_is_not_called_a_law_that_takes_no_notice() {
    let place = Place::new();
    place.write(
        "driver.toml",
        "law = \"qz_curve\"\nhypothesis = \"interface_2d\"\nparameters = { pressuremeter_modulus = 12e3, \
         diameter = 0.6, soil = \"fine\", base_resistance = 2e3, shear_stiffness = 0.0 }\n\
         segment = [{ increments = 10, control = { n = { jump = -0.5 } } }]\n",
    );
    let outcome = place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    let last = *column(&place.path("out.csv"), "traction_n").last().unwrap();
    assert!((last + 2e3).abs() < 1e-9, "{last}");
    outcome.hides("takes no notice");
}
