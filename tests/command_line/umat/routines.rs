//! Reports on a routine before it is run in earnest: `inspect`, `new-sidecar`, `laws`, `check`.

mod faults;

use super::{BAD_INPUT, DONE, PLUGIN_TROUBLE, Place, number, place, rows};
use crate::program::Outcome;
use serde_json::Value;
use std::collections::BTreeMap;
use tests::or_skip;
use tests::words::has;
use tests::words::{rows_of, words};

fn json(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.stdout).unwrap()
}

/// The place of a routine whose sidecar is gone.
fn bare(name: &str) -> Option<Place> {
    let place = place(name)?;
    std::fs::remove_file(place.path(&format!("{name}.law.toml"))).unwrap();
    Some(place)
}

#[test]
fn who_supplies_what_a_routine_calls_is_said() {
    let (Some(calls), Some(utilities)) = (place("externals"), place("utilities")) else {
        return;
    };
    let outcome = calls.done(&["inspect", "libexternals.so"]);
    let line = |start: &str| {
        let mut lines = outcome.stdout.lines();
        lines
            .find(|line| line.starts_with(start))
            .unwrap_or_default()
    };
    assert_eq!(line("missing"), "missing       getvrm_, mutexlock_");
    assert_eq!(line("from Pilum"), "");
    outcome.prints("nobody provides 2 of its symbols");
    outcome.prints("`externals = \"trap\"`");
    let found = json(&utilities.run(&["inspect", "libutilities.so", "--json"]));
    let names = |what: &str| -> Vec<&str> {
        found[what]
            .as_array()
            .unwrap()
            .iter()
            .map(|name| name.as_str().unwrap())
            .collect()
    };
    assert!(names("missing").is_empty(), "{found}");
    for name in ["sinv_", "sprind_", "rotsig_"] {
        assert!(names("from_pilum").contains(&name), "{found}");
        assert!(names("undefined").contains(&name), "{found}");
    }
    // What Pilum is said to supply, it does: the routine runs.
    let remarks = found["remarks"].to_string();
    has(&remarks, "with the sidecar utilities.law.toml");
    // A law of the contract lacks nothing.
    let deps = std::env::current_exe()
        .unwrap()
        .parent()
        .unwrap()
        .join("libelastic.so");
    let found = json(&calls.run(&["inspect", deps.to_str().unwrap(), "--json"]));
    assert_eq!(found["missing"], serde_json::json!([]), "{found}");
}

#[test]
fn a_new_sidecar_can_be_used_at_once() {
    let place = or_skip!(bare("elastic"));
    let outcome = place.run(&["inspect", "libelastic.so"]);
    outcome.prints("without a sidecar: `pilum new-sidecar`");
    let driver = "law = \"elastic\"\nadapter = \"umat\"\nlibrary = \"libelastic.so\"\n\
                  hypothesis = \"axisymmetric\"\nparameters = { prop_1 = 2e4, prop_2 = 0.3 }\n\
                  [[segment]]\nincrements = 2\ncontrol = { 22 = { strain = -1e-3 } }\n";
    place.write("driver.toml", driver);
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv"])
        .ended(PLUGIN_TROUBLE);
    let said = "--nprops N --nstatv M` writes one to fill in";
    outcome.shows(said);
    // Nothing is held against a sidecar that is not there.
    let outcome = place.run(&["check", "libelastic.so"]).ended(PLUGIN_TROUBLE);
    let said = "cannot be checked: sidecar-is-read";
    outcome.shows(said).hides("its sidecar says");
    let outcome = place.done(&["new-sidecar", "libelastic.so", "--nprops", "2"]);
    let said = "sidecar in elastic.law.toml: 2 parameters, 0 internal variables";
    assert!(outcome.stdout.starts_with(said), "{}", outcome.stdout);
    let rows = rows(&place, driver);
    let stress = number(rows.last().unwrap(), "stress_22");
    assert!((stress + 20.0).abs() < 1e-9, "{stress}");
    // It is not written over.
    let before = std::fs::read(place.path("elastic.law.toml")).unwrap();
    let outcome = place.refused(&["new-sidecar", "libelastic.so", "--nprops", "3"]);
    outcome.shows("elastic.law.toml is there already");
    assert_eq!(
        std::fs::read(place.path("elastic.law.toml")).unwrap(),
        before
    );
}

#[test]
fn a_new_sidecar_names_as_much_as_it_is_told() {
    let place = or_skip!(bare("joint_3d"));
    let arguments = "new-sidecar libjoint_3d.so --nprops 3 --nstatv 4 --ntens 2,3 --out other.toml";
    place.done(&arguments.split(' ').collect::<Vec<_>>());
    let driver = "law = \"joint_3d\"\nadapter = \"umat\"\nlibrary = \"libjoint_3d.so\"\n\
                  sidecar = \"other.toml\"\nhypothesis = \"interface_3d\"\n\
                  parameters = { prop_1 = 1e6, prop_2 = 1e5, prop_3 = 0.5 }\n\
                  initial = { traction = { n = -100.0 }, internal = { statev_1 = 0.25 } }\n\
                  [[segment]]\nincrements = 1\ncontrol = { s = { jump = 1e-3 } }\n";
    let rows = rows(&place, driver);
    let end = rows.last().unwrap();
    // 50 kPa hold, 0.5 mm of the slip is elastic; the rest adds to what was there. NTENS is the fourth.
    assert!((number(end, "traction_s") - 50.0).abs() < 1e-9);
    assert!((number(end, "statev_1") - 0.2505).abs() < 1e-12);
    assert_eq!(number(end, "statev_4"), 3.0);
}

#[test]
fn what_a_sidecar_cannot_be_for_is_refused() {
    let place = or_skip!(bare("elastic"));
    place.write("libnothing.so", "no library");
    let deps = std::env::current_exe()
        .unwrap()
        .parent()
        .unwrap()
        .join("libcoulomb_joint.so");
    let joint = deps.to_str().unwrap();
    for [arguments, code, said] in rows_of(&format!(
        "
libelastic.so --nprops 2 --ntens 4,5 | 1 | --ntens 5: expected 2, 3, 4 or 6
libelastic.so --nprops many | 1 | invalid value 'many'
libelastic.so --nprops 20000 | 1 | 20000 is not in 0..=10000
libelastic.so | 1 | --nprops
libelastic.so --nprops 2 --symbol sand_ | 3 | has no routine sand_; it exports hooke_, umat_
libelsewhere.so --nprops 2 | 1 | libelsewhere.so
libnothing.so --nprops 2 | 3 | libnothing.so is no library
{joint} --nprops 2 | 3 | has no routine umat_, umat, UMAT, UMAT_
"
    )) {
        let outcome = place.run(&words(&format!("new-sidecar {arguments}")));
        assert_eq!(
            outcome.code,
            code.parse().ok(),
            "{arguments}: {}",
            outcome.stderr
        );
        outcome.shows(said);
    }
    assert_eq!(place.contents(), ["libelastic.so", "libnothing.so"]);
}

#[test]
fn laws_shows_a_routine_with_a_sidecar() {
    let place = or_skip!(place("maxwell"));
    let outcome = place.done(&["laws", "libmaxwell.so"]);
    outcome
        .prints("umat_maxwell: Maxwell body")
        .prints("relaxation_time")
        .prints("default 1000; > 0")
        .prints("depends on the time")
        .prints("adapter = \"umat\"\n  library = \"libmaxwell.so\"");
    // The same by its id, where its folder is looked in, and in the list.
    let folder = place.path("");
    let folder = folder.to_str().unwrap();
    let by_id = place.run(&["laws", "umat_maxwell", "--law-path", folder]);
    has(&by_id.stdout, "umat_maxwell: Maxwell body");
    let list = place.run(&["laws", "--law-path", folder]);
    let line = list
        .stdout
        .lines()
        .find(|line| line.starts_with("umat_maxwell "));
    let line = line.unwrap_or_default();
    has(line, "plane_strain, axisymmetric, 3d, UMAT");
    let page = json(&place.run(&["laws", "libmaxwell.so", "--json"]));
    assert_eq!(page["id"], "umat_maxwell");
    assert_eq!(page["formulations"][0]["time_dependent"], true);
    // A sidecar that is wrong is told of at its place.
    let sidecar = place.read("maxwell.law.toml");
    place.write("maxwell.law.toml", sidecar.replacen("ntens", "n_tens", 1));
    let outcome = place.refused(&["laws", "libmaxwell.so"]);
    outcome.shows("maxwell.law.toml:5:1");
}

/// Outcomes and details of all checks of a routine, and how the program ended.
pub(super) fn checked(
    place: &Place,
    name: &str,
    more: &[&str],
) -> (BTreeMap<String, [String; 2]>, Outcome) {
    let library = format!("lib{name}.so");
    let mut arguments = vec!["check", &library, "--json"];
    arguments.extend(more);
    let outcome = place.run(&arguments);
    let report: Value = serde_json::from_str(&outcome.stdout).unwrap_or(Value::Null);
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let checks = report["checks"].as_array().cloned().unwrap_or_default();
    let checks = checks.iter().map(|check| {
        (
            text(&check["id"]),
            [text(&check["outcome"]), text(&check["details"])],
        )
    });
    (checks.collect(), outcome)
}

/// Routines that do what their sidecars say: nothing fails, and nothing is warned of.
#[test]
fn sound_routines_pass_every_check() {
    for [name, settings] in rows_of(
        "
elastic | young_modulus=1e4
maxwell | -
joint | friction=0.6 shear_stiffness=1e4 normal_stiffness=1e5
joint_3d | friction=0.6 shear_stiffness=1e4 normal_stiffness=1e5
drucker_prager | young_modulus=1e4 alpha=0.3 beta=0.05 k=4
elastic_tangent | young_modulus=1e4 alpha=0.3 beta=0.05 k=4
mohr_coulomb | young_modulus=1e4 cohesion=5 friction_angle=30 dilatancy_angle=5
rows | stiffness=1 coupling=1
doubtful | -
",
    ) {
        let more = words(settings).into_iter().filter(|set| *set != "-");
        let more: Vec<&str> = more.flat_map(|set| ["--set", set]).collect();
        let place = or_skip!(place(name));
        let (checks, outcome) = checked(&place, name, &more);
        assert_eq!(outcome.code, Some(DONE), "{name}: {}", outcome.stderr);
        assert!(checks.len() >= 12, "{name}: {checks:?}");
        for (id, [found, details]) in &checks {
            let is_well = matches!(found.as_str(), "passed" | "skipped");
            // This one does have directions.
            let is_so = name == "rows" && id == "response-is-isotropic";
            assert!(is_well || is_so, "{name}: {id} {found}: {details}");
        }
        for id in [
            "routine-answers",
            "routine-stays-inside",
            "routine-is-repeatable",
        ] {
            assert_eq!(checks[id][0], "passed", "{name}: {id}");
        }
    }
}

/// Where a routine ends its process far away, one check fails; the others go on nearby, and say so.
#[test]
fn a_routine_that_gives_up_far_away_is_checked_nearby() {
    let place = or_skip!(place("stops"));
    let more = ["young_modulus=1e7", "how=2", "limit=0.05"].map(|set| format!("--set={set}"));
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    let (checks, outcome) = checked(&place, "stops", &more);
    outcome.ended(PLUGIN_TROUBLE);
    for id in ["routine-stays-at-rest", "ddsdde-matches-differences"] {
        let [found, details] = &checks[id];
        assert_eq!(found, "warning", "{id}: {details}");
        for said in [
            "far away the process ended as in `routine-stays-inside`",
            "on short paths: ",
        ] {
            assert!(details.contains(said), "{id}: {details}");
        }
    }
    // How it ended is told there.
    let [found, details] = &checks["routine-stays-inside"];
    assert_eq!(found, "crashed", "{details}");
    for said in ["far away the process ended with", "called XIT"] {
        assert!(details.contains(said), "{details}");
    }
}

/// The way a routine ends its process is reported once, with the checks that it ended.
#[test]
fn what_ends_many_checks_is_told_once() {
    let place = or_skip!(place("stops"));
    let more = ["young_modulus=1e7", "how=1", "limit=0.05"].map(|set| format!("--set={set}"));
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    let (checks, outcome) = checked(&place, "stops", &more);
    outcome.ended(PLUGIN_TROUBLE);
    let told = |words: &str| {
        let all = checks.iter();
        all.filter(|(_, [_, details])| details.contains(words))
            .map(|(id, _)| id.as_str())
            .collect::<Vec<_>>()
    };
    let first = "routine-stays-inside";
    assert_eq!(told("exit code 3"), [first], "{checks:?}");
    let others = told(&format!("the process ended as in `{first}`"));
    assert!(others.len() >= 10, "{others:?}");
    for id in others {
        let [_, details] = &checks[first];
        assert!(details.contains(&format!("`{id}`")), "{id}: {details}");
    }
}

/// A defect of a sidecar fails its check, and no other.
#[test]
fn a_wrong_sidecar_is_told_once() {
    let place = or_skip!(place("elastic"));
    let sidecar = place.read("elastic.law.toml");
    place.write(
        "elastic.law.toml",
        sidecar.replacen("ntens = [4, 6]", "ntens = [4, 5]", 1),
    );
    for more in [&[][..], &["--in-process"]] {
        let (checks, outcome) = checked(&place, "elastic", more);
        outcome.ended(PLUGIN_TROUBLE);
        let failed = checks
            .iter()
            .filter(|(_, [outcome, _])| outcome == "failed");
        let failed: Vec<&String> = failed.map(|(id, _)| id).collect();
        assert_eq!(failed, ["sidecar-is-read"], "{checks:?}");
        assert_eq!(checks["units-are-known"][1], "needs `sidecar-is-read`");
    }
}

#[test]
fn checks_and_settings_that_do_not_fit_are_refused() {
    let place = or_skip!(place("elastic"));
    for [more, said] in rows_of(
        "
--set youngs_modulus=1e4 | the sidecar names no parameter `youngs_modulus`: did you mean `young_modulus`?
--set poisson_ratio=0.5 | 0.5 is outside (-1, 0.5)
--only handshake-is-accepted | this check is for libraries of the contract
",
    ) {
        let (_, outcome) = checked(&place, "elastic", &words(more));
        outcome.ended(BAD_INPUT).shows(said);
    }
    let deps = std::env::current_exe()
        .unwrap()
        .parent()
        .unwrap()
        .join("libelastic.so");
    let outcome = place.refused(&["check", deps.to_str().unwrap(), "--only", "routine-answers"]);
    outcome.shows("this check is for UMATs");
    // One of them alone.
    let (checks, outcome) = checked(&place, "elastic", &["--only", "time-as-declared"]);
    outcome.ended(DONE);
    assert_eq!(checks.keys().collect::<Vec<_>>(), ["time-as-declared"]);
}
