//! A routine that refuses without saying so: `pilum point` says it.

use super::{driver, place};
use crate::program::NO_EQUILIBRIUM;
use tests::or_skip;

/// The driver goes to a strain of 2e-3 in ten increments.
#[test]
fn a_routine_that_takes_no_notice_is_named() {
    let place = or_skip!(place("silent"));
    for (reach, said) in [
        (
            "0.0",
            Some("in 10 increments, first in segment 1, increment 1 of 10"),
        ),
        (
            "1e-3",
            Some("in 5 increments, first in segment 1, increment 6 of 10"),
        ),
        ("1.0", None),
    ] {
        place.write(
            "driver.toml",
            driver("silent", "", &format!("reach = {reach}")),
        );
        let outcome = place.done(&["point", "driver.toml", "--csv", "out.csv"]);
        let named = outcome.says("law `umat_silent` takes no notice of the strain");
        assert_eq!(named, said.is_some(), "{reach}: {}", outcome.stderr);
        if let Some(said) = said {
            outcome.shows(said);
        }
    }
}

#[test]
fn the_same_where_a_stress_is_asked_for_ends_with_exit_code_2() {
    let place = or_skip!(place("silent"));
    let text = driver("silent", "", "reach = -1.0");
    place.write(
        "driver.toml",
        text.replacen("strain = -2e-3", "stress = -20.0", 1),
    );
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv"])
        .ended(NO_EQUILIBRIUM);
    outcome
        .shows("stress `22` is 0.000000000e0 kPa at best")
        .shows("law `umat_silent` has no stiffness in the initial state");
}
