//! `pilum point`: a driver file with variants, all of them or one.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{DONE, Outcome, Place};
use tests::case::table;

const DRIVER: &str = r#"law = "coulomb_joint"
hypothesis = "interface_2d"

[parameters]
normal_stiffness = 1e6
shear_stiffness = 1e6
cohesion = 0.0
friction_angle = 45.0
dilatancy_angle = 0.0

[initial]
traction = { n = -100.0 }

[[segment]]
increments = 4
control = { t = { jump = 1.0e-3 }, n = { traction = -100.0 } }

[[variant]]
name = "rough"

[[variant]]
name = "smooth"
parameters.friction_angle = 0.0
"#;

fn point(place: &Place, more: &[&str]) -> Outcome {
    place.write("driver.toml", DRIVER);
    place.run(&[&["point", "driver.toml"], more].concat())
}

/// The last shear traction of a table.
fn shear(place: &Place, file: &str) -> f64 {
    let rows = table(&place.path(file));
    rows.last().unwrap()["traction_t"].parse().unwrap()
}

#[test]
fn runs_all_variants_with_a_table_each() {
    let place = Place::new();
    let outcome = point(&place, &["--csv", "out.csv"]).ended(DONE);
    assert_eq!(outcome.stdout, "");
    assert!((shear(&place, "out_rough.csv") - 100.0).abs() < 1e-9);
    assert!(shear(&place, "out_smooth.csv").abs() < 1e-9);
    for line in ["variant rough: law", "variant smooth: law"] {
        let said = outcome.stderr.lines().any(|said| said.starts_with(line));
        assert!(said, "{line}\n{}", outcome.stderr);
    }
    assert!(outcome.stderr.ends_with("rows in out_smooth.csv\n"));
}

#[test]
fn runs_one_variant() {
    let place = Place::new();
    let outcome = point(&place, &["--variant", "smooth", "--csv", "out.csv"]).ended(DONE);
    assert_eq!(place.contents(), ["driver.toml", "out.csv"]);
    assert!(shear(&place, "out.csv").abs() < 1e-9);
    outcome.shows("variant smooth").hides("variant rough");
}

#[test]
fn one_variant_alone_goes_to_standard_output() {
    let outcome = point(&Place::new(), &["--variant", "rough"]).ended(DONE);
    assert!(outcome.stdout.starts_with("increment,jump_n,jump_t,"));
    assert_eq!(outcome.stdout.lines().count(), 6);
}

#[test]
fn refuses_a_variant_that_there_is_not() {
    for command in ["point", "run"] {
        let place = Place::new();
        let driver = match command {
            "point" => DRIVER.to_owned(),
            _ => format!(
                "{}\n[[variant]]\nname = \"rough\"\n\n[[variant]]\nname = \"smooth\"\n",
                crate::program::CASE
            ),
        };
        place.write("file.toml", driver);
        let outcome = place.refused(&[command, "file.toml", "--variant", "smoth"]);
        outcome
            .shows("there is no variant `smoth`: did you mean `smooth`? There is: rough, smooth");
        assert_eq!(place.contents(), ["file.toml"]);
    }
}
