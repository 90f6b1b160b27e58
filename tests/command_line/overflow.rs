//! Probes whose numbers are too large: no row says `inf`.

use crate::program::{Place, edited};
use tests::case::{column, table};

/// The bottom carries 10 kN, then 20 kN.
const LOAD: &str = "load = { line = \"bottom\", quantity = \"reaction_y\", scale = 1.5e307 }\n\
                    half =";

#[test]
fn a_probe_that_overflows_ends_the_run_with_the_rows_before() {
    for (probes, name) in [
        (LOAD.to_owned(), "load"),
        // 10 and 20 times 1e300, then 1.5e7 times as much.
        (
            LOAD.replace("1.5e307", "1e300")
                .replace("half =", "sum = { combine = { load = 1.5e7 } }\nhalf ="),
            "sum",
        ),
    ] {
        let place = Place::new();
        let outcome = place.refused_case(edited(&[]).replacen("half =", &probes, 1));
        let said = format!("probe `{name}`: in phase `weight`, increment 2");
        outcome.shows(&said).shows("1.8e308");
        let history = place.path("out/history.csv");
        assert_eq!(table(&history).len(), 1);
        assert!(column(&history, name).iter().all(|value| value.is_finite()));
    }
}

#[test]
fn factors_that_overflow_by_themselves_are_refused_before_anything_is_written() {
    let place = Place::new();
    let product =
        "half = { combine = { tau = 0.5 } } => half = { scale = -1e300, combine = { tau = 1e10 } }";
    let outcome = place.refused_case(edited(&[product]));
    outcome.shows("`scale` × `tau` = -1e300 × 1e10 is too large for a number");
    assert_eq!(place.contents(), ["case.toml"]);
}
