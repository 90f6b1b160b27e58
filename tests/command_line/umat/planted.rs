//! Mistakes of authors in a von Mises routine, `fixtures/umat/planted.f90`: each is called by its name.

use super::routines::checked;
use super::{DONE, PLUGIN_TROUBLE, Place, place};
use crate::program::Outcome;
use std::collections::BTreeMap;
use tests::or_skip;
use tests::words::has;
use tests::words::words;

type Checks = BTreeMap<String, [String; 2]>;

fn planted(place: &Place, what: u32, more: &[&str]) -> (Checks, Outcome) {
    let set = format!("what={what}");
    let mut arguments = vec!["--set", &set];
    arguments.extend(more);
    checked(place, "planted", &arguments)
}

#[test]
fn a_correct_one_passes() {
    let place = or_skip!(place("planted"));
    let (checks, outcome) = planted(&place, 0, &[]);
    outcome.ended(DONE);
    for (id, [found, details]) in &checks {
        let is_well = ["passed", "skipped"].contains(&found.as_str());
        assert!(is_well, "{id} {found}: {details}");
    }
    let [_, details] = &checks["paths-leave-elasticity"];
    assert!(details.contains(" of them inelastic"), "{details}");
}

/// Number of the mistake, check, outcome, and a part of what is said.
const PLANTED: &str = "
1 routine-stays-at-rest failed has left STATEV(1), `plastic_strain`, as it was
1 paths-leave-elasticity passed never changed: `plastic_strain`
2 paths-leave-elasticity warning component `12` of the flux, number 4, stays what it was in all
2 ddsdde-matches-differences warning in this increment: is it returned?
3 routine-stays-at-rest failed STRESS(3), 33, is what elasticity alone gives
4 response-is-isotropic warning the shear modulus is 2.000 times (D11 − D12)/2, where shear strains are γ = 2ε: they are handed over as γ
4 ddsdde-matches-differences warning STRESS changes by twice what DDSDDE says
5 ddsdde-matches-differences warning STRESS changes by half of what DDSDDE says
6 routine-stays-inside failed beyond the end of STATEV, which has 1 entries: entry 41 becomes
7 routine-stays-inside failed in front of STATEV: entry 0 becomes
9 routine-stays-inside failed the routine reads beyond the end of STATEV, which has 1 entries, or in front of DDSDDE
10 time-as-declared warning and STRESS of the next increment changes
11 routine-is-repeatable warning with another NPT: STRESS [
12 paths-leave-elasticity warning the routine asks for a smaller increment, PNEWDT = 0.5
";

#[test]
fn each_mistake_is_called_by_its_name() {
    let place = or_skip!(place("planted"));
    for row in PLANTED.lines().skip(1) {
        let row: Vec<&str> = row.splitn(4, ' ').collect();
        let [what, id, expected, said] = row[..] else {
            panic!("{row:?}")
        };
        let what = what.parse().unwrap();
        let (checks, outcome) = planted(&place, what, &[]);
        let [found, details] = &checks[id];
        assert_eq!(found, expected, "{what}: {id}: {details}");
        assert!(details.contains(said), "{what}: {id}: {details}");
        let fails = checks.values().any(|[found, _]| found == "failed");
        let code = if fails { PLUGIN_TROUBLE } else { DONE };
        assert_eq!(outcome.code, Some(code), "{what}: {}", outcome.stderr);
    }
}

/// A run, too, reports writing beyond an array.
#[test]
fn a_run_tells_what_is_written_beyond_an_array() {
    let place = or_skip!(place("planted"));
    let driver = "law = \"umat_planted\"\nadapter = \"umat\"\nlibrary = \"libplanted.so\"\n\
                  hypothesis = \"plane_strain\"\nparameters = { what = 6 }\n\
                  [[segment]]\nincrements = 10\ncontrol = { 12 = { strain = 1e-2 } }\n";
    place.write("driver.toml", driver);
    let outcome = place.run(&["point", "driver.toml"]).ended(PLUGIN_TROUBLE);
    let said = "beyond the end of STATEV, which has 1 entries: entry 41 becomes";
    outcome.shows(said);
}

/// A STOP far away fails one check, which is shown among those that fail; the others go on nearby.
#[test]
fn a_stop_far_away_is_a_failure_of_one_check() {
    let place = or_skip!(place("planted"));
    let (checks, outcome) = planted(&place, 8, &["--only-failed"]);
    outcome.ended(PLUGIN_TROUBLE);
    // The others warn of it.
    let failing = checks.iter().filter(|(_, [found, _])| found != "warning");
    let ids: Vec<&String> = failing.map(|(id, _)| id).collect();
    assert_eq!(ids, ["routine-stays-inside"], "{checks:?}");
    let [found, details] = &checks["routine-stays-inside"];
    assert_eq!(found, "crashed");
    for said in [
        "far away the process ended",
        "STOP too much",
        "on short paths: ",
    ] {
        assert!(details.contains(said), "{said}: {details}");
    }
    let (checks, _) = planted(&place, 8, &[]);
    let [found, details] = &checks["ddsdde-matches-differences"];
    assert_ne!(found, "skipped", "{details}");
}

/// Parameters that make everything elastic are reported, since all else passes.
#[test]
fn paths_that_never_yield_are_told_of() {
    let place = or_skip!(place("planted"));
    let (checks, outcome) = planted(&place, 3, &["--set", "yield_stress=1e9"]);
    outcome.ended(DONE);
    let [found, details] = &checks["paths-leave-elasticity"];
    assert_eq!(found, "warning", "{details}");
    has(details, "none of the increments leaves elasticity");
}

/// Values that nothing speaks for are named, and are not where they are given.
#[test]
fn parameters_without_a_ground_are_named() {
    let place = or_skip!(place("planted"));
    let path = place.path("planted.law.toml");
    std::fs::remove_file(&path).unwrap();
    place.done(&words("new-sidecar libplanted.so --nprops 5 --nstatv 1"));
    let (checks, _) = checked(&place, "planted", &["--set", "prop_2=0.3"]);
    let [found, details] = &checks["sidecar-is-read"];
    assert_eq!(found, "warning", "{details}");
    has(details, "checked with `prop_1` = 1, `prop_3` = 1");
    // What the guide leaves out of a sidecar is not asked for.
    let [found, details] = &checks["description-is-complete"];
    assert_eq!(found, "passed", "{details}");
    let all = words("prop_1=5e5 prop_2=0.3 prop_3=200 prop_4=600 prop_5=0");
    let all: Vec<&str> = all.iter().flat_map(|set| ["--set", set]).collect();
    let (checks, _) = checked(&place, "planted", &all);
    let [found, details] = &checks["sidecar-is-read"];
    assert_eq!(found, "passed", "{details}");
}

/// A sidecar with too few parameters leaves a routine without the last one, which is read all the same.
#[test]
fn a_parameter_that_the_sidecar_lacks_is_told() {
    let place = or_skip!(place("planted"));
    let path = place.path("planted.law.toml");
    std::fs::remove_file(&path).unwrap();
    let arguments = words("new-sidecar libplanted.so --nprops 3 --nstatv 1");
    place.done(&arguments);
    let all = ["prop_1=5e5", "prop_2=0.3", "prop_3=200"];
    let all: Vec<&str> = all.iter().flat_map(|set| ["--set", set]).collect();
    let (checks, outcome) = checked(&place, "planted", &all);
    outcome.ended(PLUGIN_TROUBLE);
    let [found, details] = &checks["routine-answers"];
    assert_eq!(found, "failed", "{details}");
    let said = "the routine reads beyond the end of PROPS, which has 3 entries";
    assert!(details.contains(said), "{details}");
}

/// A replay has the numbers of the check: it makes the same calls.
#[test]
fn a_replay_has_the_numbers_of_the_check() {
    let place = or_skip!(place("planted"));
    for (what, id) in [
        (1, "routine-stays-at-rest"),
        (4, "response-is-isotropic"),
        (6, "routine-stays-inside"),
    ] {
        let (checks, _) = planted(&place, what, &["--out", "found"]);
        let [_, details] = &checks[id];
        let outcome = place.run(&["replay", &format!("found/{id}.toml")]);
        let all = format!("{}{}", outcome.stdout, outcome.stderr);
        if what == 6 {
            let said = "entry 41 becomes";
            let value = |text: &str| {
                let (_, rest) = text.split_once(said).unwrap();
                rest.split_whitespace().next().unwrap().to_owned()
            };
            assert_eq!(value(&all), value(details), "{all}");
        } else {
            assert!(all.contains("this increment, as recorded"), "{what}: {all}");
        }
    }
}
