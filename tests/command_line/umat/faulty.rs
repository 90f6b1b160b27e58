//! Routines that do what they must not, in a run.

use super::{driver, place, rows, soil};
use crate::program::PLUGIN_TROUBLE;
use tests::or_skip;

#[test]
fn a_routine_that_ends_its_process_ends_an_increment() {
    let place = or_skip!(place("stops"));
    for (how, says) in [
        (1, "ended its process: exit code 3"),
        (
            2,
            "called XIT | ended its process: exit code 70 | AT POINT 1 OF UMAT_STO",
        ),
        (3, "crashed: signal 11"),
    ] {
        let parameters = format!("how = {how}\nlimit = 1.1e-3");
        place.write("driver.toml", driver("stops", "", &parameters));
        let outcome = place
            .run(&["point", "driver.toml", "--csv", "out.csv"])
            .ended(PLUGIN_TROUBLE);
        for text in says.split(" | ") {
            outcome.shows(text);
        }
        outcome.shows("segment 1, increment 6 of 10");
        let rows = place.read("out.csv");
        assert_eq!(rows.lines().count(), 7, "{rows}");
        let outcome = place
            .run(&["replay", "out.failure.toml"])
            .ended(PLUGIN_TROUBLE);
        outcome.prints("as recorded");
    }
}

#[test]
fn a_tangent_that_is_left_unset_is_named() {
    let place = or_skip!(place("unset"));
    // Strains alone need no tangent; a stress does.
    let text = driver("unset", "", "");
    assert_eq!(rows(&place, &text).len(), 11);
    place.write(
        "driver.toml",
        text.replacen("11 = { strain = 1e-3 }", "11 = { stress = -10.0 }", 1),
    );
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv"])
        .ended(2);
    outcome.shows("DDSDDE of a UMAT").hides("beyond strength");
    let outcome = place.run(&["check", "libunset.so"]);
    outcome.prints("the routine leaves it unset");
}

#[test]
fn a_routine_without_an_answer_is_the_librarys_fault() {
    let place = or_skip!(place("stops"));
    for (how, says) in [
        (4, "leaves PNEWDT = -1"),
        (5, "leaves PNEWDT = NaN"),
        (6, "leaves STRESS with values that are not finite"),
    ] {
        // In the first call, without any strain, and on the way.
        for (limit, at) in [("-1.0", "initial state"), ("1.1e-3", "increment 6 of 10")] {
            let parameters = format!("how = {how}\nlimit = {limit}");
            place.write("driver.toml", driver("stops", "", &parameters));
            let outcome = place.run(&["point", "driver.toml"]).ended(PLUGIN_TROUBLE);
            outcome.shows(says).shows(at);
        }
        // The first increment of the run makes strains of 0.05 %.
        for limit in ["-1.0", "7e-4"] {
            let parameters = format!("poisson_ratio = 0.3, how = {how}, limit = {limit} }}");
            let case = soil("stops", "").replacen("poisson_ratio = 0.3 }", &parameters, 1);
            place.run_case(case).ended(PLUGIN_TROUBLE).shows(says);
        }
        place
            .run(&["replay", "out/failure.toml"])
            .ended(PLUGIN_TROUBLE);
    }
}

#[test]
fn what_is_overwritten_is_named() {
    let place = or_skip!(place("overwrites"));
    for (what, says) in [
        (1, "overwrites CMNAME, which is an input"),
        (2, "overwrites PROPS, which is an input"),
        (3, "writes beyond the end of STATEV, which has 1 entries"),
        (4, "writes in front of DSTRAN: entry 0 becomes 1e0"),
        (5, "overwrites KINC, which is an input"),
        // Arithmetic on what stands there shows too, even if it changes no number.
        (6, "writes beyond the end of STATEV, which has 1 entries"),
        (7, "writes beyond the end of STATEV, which has 1 entries"),
        (8, "writes beyond the end of STATEV, which has 1 entries"),
    ] {
        place.write(
            "driver.toml",
            driver("overwrites", "", &format!("what = {what}")),
        );
        let outcome = place
            .run(&["point", "driver.toml", "--csv", "out.csv"])
            .ended(PLUGIN_TROUBLE);
        outcome.shows(says);
    }
}
