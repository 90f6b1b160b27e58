//! Routines that begin again where a phase begins, and those that rightly begin once: `fixtures/umat/begins.f`.

use super::routines::checked;
use super::{DONE, PLUGIN_TROUBLE, place};
use tests::or_skip;
use tests::words::has;

const CHECK: &str = "routine-does-not-begin-again";

#[test]
fn routines_that_begin_again_are_named() {
    let place = or_skip!(place("begins"));
    for (what, expected, said) in [
        (1, "failed", "with KINC = 1 in place of 2 STRESS ["),
        (2, "failed", "with TIME(1) = 0 in place of 1 STRESS ["),
        (3, "warning", "with KSTEP = 1 in place of 2 STRESS ["),
        (4, "warning", "with KINC = 1 in place of 2 STATEV ["),
    ] {
        let set = format!("what={what}");
        let (checks, outcome) = checked(&place, "begins", &["--set", &set]);
        let [found, details] = &checks[CHECK];
        assert_eq!(found, expected, "{what}: {details}");
        assert!(details.contains(said), "{what}: {details}");
        let others = checks.iter().filter(|(id, _)| *id != CHECK);
        for (id, [found, details]) in others {
            // With KSTEP = 1, as in all other checks, this one is elastic.
            let is_elastic = what == 3 && id == "paths-leave-elasticity";
            assert!(
                ["passed", "skipped"].contains(&found.as_str()) || is_elastic,
                "{what}: {id} {found}: {details}"
            );
        }
        let code = if expected == "failed" {
            PLUGIN_TROUBLE
        } else {
            DONE
        };
        outcome.ended(code);
    }
}

/// Actions of a routine in the very first increment, and on DDSDDE alone, change no result.
#[test]
fn routines_that_begin_once_are_not() {
    let place = or_skip!(place("begins"));
    for what in [0, 5, 6, 7] {
        let set = format!("what={what}");
        let (checks, outcome) = checked(&place, "begins", &["--set", &set]);
        outcome.ended(DONE);
        for id in [CHECK, "time-as-declared", "routine-stays-at-rest"] {
            let [found, details] = &checks[id];
            assert_eq!(found, "passed", "{what}: {id}: {details}");
        }
    }
}

/// The same call, made again after another step, shows data kept from call to call.
#[test]
fn a_step_kept_from_the_last_call_is_named() {
    let place = or_skip!(place("begins"));
    let (checks, outcome) = checked(&place, "begins", &["--set", "what=8"]);
    let [found, details] = &checks[CHECK];
    assert_eq!(found, "failed", "{details}");
    let said = "when it is repeated: something is kept from call to call (SAVE, COMMON)";
    assert!(details.contains(said), "{details}");
    outcome.ended(PLUGIN_TROUBLE);
}

/// A routine that depends on the time may depend on that of the step, which is reported all the same.
#[test]
fn the_time_of_a_step_is_asked_for_where_the_time_counts() {
    let place = or_skip!(place("begins"));
    let sidecar = place.read("begins.law.toml");
    place.write(
        "begins.law.toml",
        format!("time_dependent = true\n{sidecar}"),
    );
    let (checks, outcome) = checked(&place, "begins", &["--set", "what=2"]);
    let [found, details] = &checks[CHECK];
    assert_eq!(found, "warning", "{details}");
    has(details, "with TIME(1) = 0 in place of 1 STRESS [");
    outcome.ended(DONE);
}
