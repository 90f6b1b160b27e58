//! Laws that keep the contract.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{check, compiled, folder, library_of, pilum, refused};
use std::path::Path;
use tests::or_skip;
use tests::words::rows_of;
use tests::words::words;

/// No check fails; those that say nothing of this law are skipped for its own reason.
pub(crate) fn passes(library: &Path) {
    let report = check(library, &[]);
    let bad: Vec<_> = report
        .checks()
        .iter()
        .filter(|check| !["passed", "skipped"].contains(&check["outcome"].as_str().unwrap()))
        .collect();
    assert!(bad.is_empty(), "{}: {bad:#?}", library.display());
    assert_eq!(report.code, Some(0), "{}", report.stderr);
    for skipped in report.with(&["skipped"]) {
        let why = report.check(&skipped)["details"].as_str().unwrap();
        assert!(!why.contains("needs"), "{skipped}: {why}");
    }
    assert!(report.with(&["passed"]).len() >= 44, "{:#?}", report.json);
}

#[test]
fn laws_of_this_repository_pass() {
    let joints =
        words("coulomb_joint critical_state_joint cyclic_joint hyperbolic_joint mepi tz_curve");
    for law in [joints, words("elastic mohr_coulomb oriented_mohr_coulomb")].concat() {
        passes(&library_of(law));
    }
}

/// What two surfaces make difficult, of both laws; a whole check takes too long.
#[test]
fn hardening_soil_passes_where_surfaces_matter() {
    let ids = words(
        "handshake-is-accepted tangent-matches-differences initial-states-fit response-is-isotropic",
    );
    let only: Vec<&str> = ids.iter().flat_map(|id| ["--only", *id]).collect();
    let report = check(&library_of("hardening_soil"), &only);
    // At 5·10¹⁰ kPa 2·10⁻⁹ of the stiffness is left where the stress does not change: a warning.
    assert_eq!(report.with(&["warning"]), ids[1..2], "{:#}", report.json);
    assert_eq!(
        report.with(&["passed", "warning"]),
        ids,
        "{:#}",
        report.json
    );
}

/// Laws that creep, relax, keep rates, count, or take substeps by a tolerance look faulty but are not.
#[test]
fn unusual_laws_pass() {
    let folder = folder();
    let library = or_skip!(compiled("unusual_laws", folder.path()));
    passes(&library);
}

/// Laws of this repository with what makes them unusual: viscosity, and friction that begins with nothing, so
/// that any shear at first is more than the law carries.
#[test]
fn unusual_parameters_pass() {
    for (law, settings, ids) in [
        (
            "mohr_coulomb",
            "relaxation_time=1",
            &[
                "elastic-operator-is-plausible",
                "response-is-continuous",
                "states-are-carried-on",
            ][..],
        ),
        ("mepi", "mu_0=0", &["initial-states-fit"]),
    ] {
        let only = ids.iter().flat_map(|id| ["--only", *id]);
        let arguments: Vec<&str> = ["--set", settings].into_iter().chain(only).collect();
        let report = check(&library_of(law), &arguments);
        assert_eq!(report.with(&["passed"]), ids, "{law}: {:#}", report.json);
    }
}

#[test]
fn the_report_is_the_same_every_time() {
    let library = library_of("elastic");
    let first = check(&library, &[]);
    assert_eq!(first.stdout, check(&library, &[]).stdout);
    let keys: Vec<&String> = first.json.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["checks", "counts", "library", "seed", "sha256"]);
    for check in first.checks() {
        let keys = check.as_object().unwrap().keys();
        let keys: Vec<&String> = keys.filter(|key| *key != "nearest").collect();
        assert_eq!(keys, ["description", "details", "family", "id", "outcome"]);
    }
    // How near a check has come to its thresholds: less than they are, where it has passed.
    let nearest = &first.check("tangent-matches-differences")["nearest"]["tangent"];
    assert!(
        nearest
            .as_f64()
            .is_some_and(|part| part > 0.0 && part < 1.0),
        "{nearest}"
    );
}

/// Ids are public: files and scripts name them. A change of one needs a change here.
#[test]
fn ids_are_stable() {
    let output = pilum(&["check", "--list", "--json"]);
    assert!(output.status.success());
    let listed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let ids: Vec<&str> = listed
        .as_array()
        .unwrap()
        .iter()
        .map(|check| check["id"].as_str().unwrap())
        .collect();
    assert_eq!(
        ids,
        tests::words::words(
            "
file-is-a-library library-opens handshake-is-accepted entry-is-idempotent exports-are-hidden
manifest-matches description-is-readable description-is-complete units-are-known ranges-are-plausible
create-works wrong-arguments-are-refused bounds-are-kept initial-states-are-written integrate-works
unknown-requests-are-refused missing-tangent-is-refused empty-batch-is-accepted
null-outcomes-are-accepted messages-fit longer-structs-are-accepted shorter-batch-is-refused
writes-stay-inside reads-stay-inside inputs-stay-untouched results-are-finite memory-is-freed repeatable
independent-of-split independent-of-order independent-of-request independent-of-time
independent-of-layout independent-of-thread instances-are-independent independent-of-earlier-calls
independent-of-first-instance independent-of-environment environment-is-left-alone prints-nothing
writes-no-files bad-numbers-are-refused failing-points-stay-alone huge-steps-end-well
tangent-matches-differences rates-match-differences tangent-symmetry-as-declared linearity-as-declared
zero-increment-changes-nothing initial-states-fit hypotheses-agree tangential-axis-is-arbitrary
response-is-isotropic compression-is-negative angles-are-degrees plastic-work-is-not-negative
elastic-operator-is-plausible response-is-continuous states-are-carried-on plastic-variables-rest
parameters-matter units-belong-together results-do-not-blow-up paths-leave-elasticity sidecar-is-read
routine-answers routine-stays-inside routine-is-repeatable routine-does-not-begin-again
routine-stays-at-rest time-as-declared ddsdde-matches-differences routine-agrees-in-the-plane
tangential-directions-are-alike
",
        )
    );
}

#[test]
fn a_law_is_found_by_its_id() {
    let output = pilum(&words(
        "check mepi_softening --only description-is-readable",
    ));
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert!(stdout.contains("mepi_softening 0.1.0"), "{stdout}");
    assert!(output.status.success());
}

#[test]
fn refuses_what_is_not_there() {
    for [arguments, code, says] in rows_of(
        "
check elastik --json | 3 | did you mean `elastic`?
check no/such/library.so --json | 1 | cannot read no/such/library.so
inspect no/such/library.so --json | 1 | cannot read no/such/library.so
check elastic --only=repeatabel | 1 | did you mean `repeatable`?
",
    ) {
        let words = refused(&words(arguments), code.parse().unwrap());
        assert!(words.contains(says), "{arguments}: {words}");
    }
}

#[test]
fn refuses_settings_that_no_law_of_the_library_can_have() {
    // The last: each within its bounds, but not together.
    for [law, settings, says] in rows_of(
        "
elastic | --set young_modulos=1e4 | has a parameter `young_modulos`: did you mean `young_modulus`? There is: poisson_ratio, young_modulus
elastic | --set young_modulus=-1 | --set young_modulus=-1: -1 is outside (0, ∞) kPa
elastic | --set poisson_ratio=NaN | NaN is outside (-1, 0.5)
mepi_softening | --set peak=2 | 2 is outside the choices 0 (continuous), 1 (published)
mepi_softening | --set mu_0=0.5 --set mu_p=0.2 | `mepi` under interface_2d accepts no parameters with these values: PILUM_E_PARAMETER
",
    ) {
        let arguments = format!("check {law} --only=create-works {settings}");
        let words = refused(&words(&arguments), 1);
        assert!(words.contains(says), "{arguments}: {words}");
    }
}
