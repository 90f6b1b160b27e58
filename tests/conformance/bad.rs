//! Libraries that break the contract on purpose, each in one way.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

mod gallery;

use crate::program::{Report, check, compiled, compiled_with, folder, library_of, pilum, words};
use gallery::{CRASHED, GALLERY, REFUSED, WARNED};
use std::hint::black_box;
use std::path::Path;
use tests::or_skip;
use tests::words::has;
use tests::words::rows_of;
use tests::words::words as listed;

/// The one check that fails is this one, of those that were made, and says how to repeat it.
fn fails(report: &Report, library: &Path, id: &str, outcome: &str) {
    let name = library.display();
    assert_eq!(
        report.with(&["failed", "crashed"]),
        [id],
        "{name}: {:#}",
        report.json
    );
    let check = report.check(id);
    assert_eq!(check["outcome"], outcome, "{name}: {check:#}");
    let replay = check["replay"].as_str().unwrap();
    has(replay, format!("--only {id} --seed 1"));
    assert_eq!(report.code, Some(3), "{name}: {}", report.stderr);
    assert!(report.stderr.contains("error: "), "{}", report.stderr);
}

/// Leads the fixture along a path in the program's own process: it ends by itself, and says why.
fn point_refuses(library: &Path, folder: &Path) {
    let law = library.file_stem().unwrap().to_str().unwrap();
    let id = law.trim_start_matches("lib");
    let named = folder.join(
        library
            .file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .replace(id, "fixture"),
    );
    std::fs::rename(library, &named).unwrap();
    let driver = folder.join("driver.toml");
    let text = format!(
        "law = \"fixture\"\nlaw_path = [{:?}]\nhypothesis = \"interface_2d\"\n\
         [parameters]\nnormal_stiffness = 1e6\nshear_stiffness = 1e6\n\
         [[segment]]\nincrements = 3\ncontrol = {{ n = {{ jump = 1e-3 }}, t = {{ jump = 1e-3 }} }}\n",
        folder.display().to_string()
    );
    std::fs::write(&driver, text).unwrap();
    let output = pilum(&["point", driver.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{id}: {stderr}");
    assert!(stderr.contains("error: "), "{id}: {stderr}");
}

#[test]
fn every_bad_library_fails_the_check_that_names_its_fault() {
    for (fixture, id) in GALLERY {
        let folder = folder();
        let library = or_skip!(compiled(fixture, folder.path()));
        // An endless loop has to be waited for.
        let limit = if fixture == "bad_loop" { "1" } else { "30" };
        let report = check(&library, &["--only", id, "--time-limit", limit]);
        let crashes = listed(CRASHED).contains(&fixture);
        fails(
            &report,
            &library,
            id,
            if crashes { "crashed" } else { "failed" },
        );
        if listed(REFUSED).contains(&fixture) {
            point_refuses(&library, folder.path());
        }
    }
}

#[test]
fn what_may_be_meant_is_a_warning_of_the_check_that_names_it() {
    for (fixture, id) in WARNED {
        let folder = folder();
        let library = or_skip!(compiled(fixture, folder.path()));
        let report = check(&library, &["--only", id]);
        assert_eq!(report.check(id)["outcome"], "warning", "{fixture}");
        assert_eq!(report.code, Some(0), "{fixture}: {}", report.stderr);
    }
}

/// If warnings count, they end the program as failures do, and are named among the failures.
#[test]
fn warnings_count_where_that_is_asked_for() {
    let folder = folder();
    let library = or_skip!(compiled("bad_unit", folder.path()));
    let only = "--only=units-are-known";
    let report = check(&library, &[only, "--strict", "--only-failed"]);
    assert_eq!(report.code, Some(3), "{}", report.stderr);
    let said = words(&report.stderr);
    has(&said, "`--strict` asks for no warnings: units-are-known");
    assert_eq!(report.with(&["warning"]), ["units-are-known"]);
    let good = check(&library_of("elastic"), &["--strict", "--only-failed"]);
    assert_eq!(good.code, Some(0), "{}", good.stderr);
    assert!(good.checks().is_empty(), "{}", good.stdout);
}

/// The effects of an environment variable, and of the instance that came first, are named with both
/// results.
#[test]
fn what_comes_from_outside_of_a_call_is_named() {
    for [fixture, id, says] in rows_of(
        "
bad_environment | independent-of-environment | with another HOME it gives flux [
bad_first_instance | independent-of-first-instance | as the first instance of a process it gives flux [
",
    ) {
        let folder = folder();
        let library = or_skip!(compiled(fixture, folder.path()));
        let report = check(&library, &["--only", id]);
        let details = report.check(id)["details"].as_str().unwrap();
        assert!(details.contains(says), "{details}");
    }
}

/// A law that has the thread that loads it flush subnormal numbers changes nothing for whoever opens it.
#[test]
fn a_library_that_flushes_subnormal_numbers_leaves_the_program_alone() {
    let folder = folder();
    let library = or_skip!(compiled("bad_fast_math", folder.path()));
    law::Opener::default().open(&library).unwrap();
    let subnormal = black_box(f64::MIN_POSITIVE) * black_box(0.5);
    assert_eq!(subnormal.to_bits(), 1 << 51);
    let case = folder.path().join("case.toml");
    let named = folder.path().join("libfixture.so");
    std::fs::rename(&library, named).unwrap();
    std::fs::write(&case, CASE).unwrap();
    let out = folder.path().join("out");
    let outcome = pilum(&[
        "run",
        case.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]);
    let said = words(&String::from_utf8(outcome.stderr).unwrap());
    assert_eq!(outcome.status.code(), Some(0), "{said}");
    assert_eq!(
        said.matches("take numbers below 2.2e-308 for zero").count(),
        1,
        "{said}"
    );
}

/// The gallery and the folder of fixtures are the same.
#[test]
fn every_fixture_is_in_the_gallery() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let mut there: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| name.strip_suffix(".c").map(str::to_owned))
        .filter(|name| name.starts_with("bad_"))
        .collect();
    let failing = GALLERY.map(|(fixture, _)| fixture);
    let mut special = listed(CRASHED).into_iter().chain(listed(REFUSED));
    assert!(special.all(|fixture| failing.contains(&fixture)));
    let mut known = [&failing[..], &WARNED.map(|(fixture, _)| fixture)].concat();
    there.sort();
    known.sort_unstable();
    assert_eq!(there, known);
}

#[test]
fn files_that_are_no_library_are_refused_unopened() {
    let folder = folder();
    let library = folder.path().join("libfixture.so");
    let mut other = std::fs::read(library_of("elastic")).unwrap();
    // `e_machine` of an ELF header: 183 is AArch64, 62 x86-64.
    other[18] = if other[18] == 183 { 62 } else { 183 };
    for bytes in [b"".as_slice(), b"int main(void) { return 0; }\n", &other] {
        std::fs::write(&library, bytes).unwrap();
        fails(
            &check(&library, &[]),
            &library,
            "file-is-a-library",
            "failed",
        );
        let driver = folder.path().join("libfixture.so");
        point_refuses(&driver, folder.path());
    }
}

#[test]
fn a_failure_says_why() {
    // X is said of the status 42.
    const UNKNOWN: &str = "the unknown status 42 (the contract has -6 to 2), without a message";
    let folder = folder();
    for [name, id, definitions, says] in rows_of(
        "
create_unknown | create-works | #define IN_CREATE return 42 | `create` accepted no parameters: X
create_silent | create-works | #define IN_CREATE return PILUM_E_PARAMETER | accepted no parameters: PILUM_E_PARAMETER (-2), without a message
create_nothing | create-works | #define IN_CREATE return PILUM_OK | accepted no parameters: PILUM_OK (0), but no instance is written
integrate_unknown | integrate-works | #define IN_INTEGRATE return 42 | no initial stress was accepted: X
integrate_soft | integrate-works | #define STIFFNESS(row, column) (0.0 * instance->stiffness[row] * (column)) | no initial stress was accepted: the largest entry of the elastic operator is 0
step_unknown | integrate-works | #define AT_END if (increment[1] > 0.0) { TELL(42, i); worst = 42; continue; } | a small step gave X
",
    ) {
        let library = or_skip!(compiled_with(definitions, name, folder.path()));
        let report = check(&library, &["--only", id]);
        fails(&report, &library, id, "failed");
        let details = report.check(id)["details"].as_str().unwrap();
        let says = says.replace('X', UNKNOWN);
        assert!(details.contains(&says), "{name}: {details}");
    }
}

/// Details of the one check of a law with these definitions.
fn details(definitions: &str, name: &str, id: &str) -> Option<String> {
    let folder = folder();
    let library = compiled_with(definitions, name, folder.path())?;
    let report = check(&library, &["--only", id]);
    Some(report.check(id)["details"].as_str().unwrap().to_owned())
}

#[test]
fn a_warning_says_what_was_probably_meant() {
    let fixture = |name: &str| {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(tests.join(format!("fixtures/bad_{name}.c")));
        text.unwrap().replace("#include \"law.h\"\n", "")
    };
    // A law that refuses to start there.
    let starts = |refused: &str| {
        format!(
            "#define AT_INIT if (PILUM_AT(batch->flux0, i, 0) {refused}) {{ \
             TELL(PILUM_E_DOMAIN, i); return PILUM_E_DOMAIN; }}"
        )
    };
    for [name, id, definitions, says] in rows_of(
        r#"
unit | units-are-known | FIXTURE | `kN/m3` of `normal_stiffness`: `kN/m^3`?
rad | ranges-are-plausible | #define UNIT "rad" | `normal_stiffness`: angles are in degrees, `deg`
little | ranges-are-plausible | #define UNIT "deg"\n#define USUAL_LOWER 0.1\n#define USUAL_UPPER 1.5 | the usual range [0.1, 1.5] deg looks like radians
usual_range | ranges-are-plausible | FIXTURE | the usual range [-1000, 1000000000] kPa/m reaches outside the bounds (0, ∞)
radians | parameters-matter | FIXTURE | `angle` of `fixture` is rounded to a whole number
engineering_shear | response-is-isotropic | FIXTURE | the shear modulus is 2.000 times (D11 − D12)/2, where shear strains are γ = 2ε
cache | independent-of-earlier-calls | FIXTURE | `integrate` gives another result after a call that differs in `gradient0` alone
signs | compression-is-negative | STARTS < 0.0 | it starts from a tension of 10 kPa, but not from as much compression
pulled | integrate-works | STARTS <= 0.0 | a tension of 100 kPa is: compression is negative here
"#,
    ) {
        let definitions = match definitions.split_once(' ') {
            None => fixture(name).replace("sin(instance", "floor(instance"),
            Some(("STARTS", refused)) => starts(refused),
            Some(_) => definitions.to_owned(),
        };
        let details = or_skip!(details(&definitions, name, id));
        assert!(details.contains(says), "{name}: {details}");
    }
}

/// A number of 1 kPa in a logarithm: settled by a parameter, or by a sentence that names it, and by no other
/// sentence.
#[test]
fn a_reference_of_one_unit_is_settled_by_a_parameter_or_a_sentence() {
    let logarithm = |reference: &str, more: &str| {
        format!(
            "#define STIFFNESS(row, column) ((row) == (column) ? instance->stiffness[0] : 0.0)\n\
             #define AT_END travel += fabs(increment[0]) * log1p(fabs(end[0]) / {reference});\n{more}"
        )
    };
    let parameter = "#define SECOND {.struct_size = PARAMETER_SIZE, .flags = PILUM_P_OPEN_LOWER, \
                     .id = \"reference\", .symbol = \"p_r\", .unit = \"kPa\", .doc = \"Reference.\", \
                     .default_value = 1.0, .lower = 0.0, .upper = INFINITY, .usual_lower = 0.1, \
                     .usual_upper = 1e3}";
    let id = "units-belong-together";
    for (name, definitions, outcome, says) in [
        (
            "hidden",
            logarithm("1.0", ""),
            "warning",
            "A reference as in ln(p/1 kPa) is best a parameter with a unit and a default; or a sentence of \
             the description names it (`at 1 kPa`).",
        ),
        (
            "other",
            logarithm("1.0", "#define DOC \"Measured at 21 kPa, over 1 m.\""),
            "warning",
            "half the unit of force",
        ),
        (
            "said",
            logarithm("1.0", "#define DOC \"Travel grows with ln(1 + n/1 kPa).\""),
            "passed",
            "another result in other units, as is said of `fixture`: 1 kPa",
        ),
        (
            "given",
            logarithm("instance->stiffness[1]", parameter),
            "passed",
            "increments",
        ),
    ] {
        let folder = folder();
        let library = or_skip!(compiled_with(&definitions, name, folder.path()));
        let report = check(&library, &["--only", id]);
        let finding = report.check(id);
        assert_eq!(finding["outcome"], outcome, "{name}: {finding:#}");
        let details = finding["details"].as_str().unwrap();
        assert!(details.contains(says), "{name}: {details}");
    }
}

#[test]
fn a_wrong_tangent_is_told_by_row_and_column_with_both_values() {
    let folder = folder();
    let tangent = "#define TANGENT(row, column) \
                   (STIFFNESS(row, column) + (row == 1 && column == 0 ? 5e4 : 0.0))";
    let library = or_skip!(compiled_with(tangent, "off_diagonal", folder.path()));
    let id = "tangent-matches-differences";
    let stiff = "normal_stiffness=1e6";
    let report = check(&library, &["--only", id, "--set", stiff]);
    fails(&report, &library, id, "failed");
    let details = report.check(id)["details"].as_str().unwrap();
    let says = "row `t`, column `n` of the tangent is 5.000000e4, differences give 0.000000e0: \
                wrong by ";
    assert!(details.contains(says), "{details}");
}

/// A crash of the library while settings are tried is left to the checks.
#[test]
fn a_library_that_crashes_is_no_bad_setting() {
    let folder = folder();
    let library = or_skip!(compiled("bad_create_abort", folder.path()));
    let more = ["--only=create-works", "--set", "normal_stiffness=1e6"];
    fails(&check(&library, &more), &library, "create-works", "crashed");
}

/// The export macro catches panics; the law is defective all the same.
#[test]
fn panics_are_reported_by_the_function_they_happen_in() {
    let library = library_of("bad_panic");
    for (place, id, says) in [
        ("place=0", "integrate-works", "panicked: in update"),
        ("place=1", "create-works", "panicked in `new`: in new"),
    ] {
        let report = check(&library, &["--set", place]);
        fails(&report, &library, id, "failed");
        let details = report.check(id)["details"].as_str().unwrap();
        assert!(details.contains(says), "{details}");
    }
}

/// A joint of the fixture between two layers of soil.
const CASE: &str = r#"
law_path = ["."]
analysis = "plane_strain"
supports = [{ line = "bottom", fixed = ["x", "y"] }]
[mesh]
columns = [{ n = 1, to = 1.0 }]
rows = [{ n = 2, to = 1.0 }]
region = [{ group = "soil" }]
lines = { bottom = { y = 0.0 }, top = { y = 1.0 }, middle = { y = 0.5 } }
[laws.soil]
law = "elastic"
parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }
[laws.joint]
law = "fixture"
parameters = { normal_stiffness = 1e6, shear_stiffness = 1e5 }
[groups.soil]
formulation = "solid"
integration = "full"
law = "soil"
[groups.joint]
formulation = "zero_thickness"
line = "middle"
law = "joint"
[[phase]]
name = "weight"
increments = 2
pressure = [{ line = "top", value = 10.0 }]
[[phase]]
name = "shear"
increments = 2
displacement = [{ line = "top", x = 1e-4 }]
"#;

/// A run with a law that fails of itself ends as trouble with its library: the host takes one
/// tangent of a linear law for all its points, and no number that is not finite.
#[test]
fn a_run_does_not_believe_whatever_a_law_claims() {
    for (fixture, says) in [
        ("bad_linear", "calls itself linear"),
        ("bad_nan", "claims success with a result that is not finite"),
    ] {
        let folder = folder();
        if compiled(fixture, folder.path()).is_none() {
            return;
        }
        let case = folder.path().join("case.toml");
        std::fs::write(&case, CASE).unwrap();
        let out = folder.path().join("out");
        let outcome = pilum(&[
            "run",
            case.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ]);
        let said = String::from_utf8(outcome.stderr).unwrap();
        assert_eq!(outcome.status.code(), Some(3), "{fixture}: {said}");
        assert!(words(&said).contains(says), "{fixture}: {said}");
    }
}

/// More than is kept of what a process prints: the checks answer all the same.
#[test]
fn what_a_law_prints_hides_nothing() {
    let folder = folder();
    let prints = "#define IN_INTEGRATE static int calls; if (calls++ == 0) \
                  for (int k = 0; k < 1 << 21; k++) putchar(k % 64 ? 'x' : '\\n')";
    let library = or_skip!(compiled_with(prints, "prints_much", folder.path()));
    let only = listed("--only empty-batch-is-accepted --only prints-nothing");
    let report = check(&library, &only);
    assert_eq!(report.with(&["passed"]), ["empty-batch-is-accepted"]);
    fails(&report, &library, "prints-nothing", "failed");
}

#[test]
fn the_command_of_a_failure_repeats_it() {
    let folder = folder();
    let library = or_skip!(compiled("bad_tangent", folder.path()));
    let report = check(&library, &["--seed", "7"]);
    let failure = report.check("tangent-matches-differences");
    let replay = failure["replay"].as_str().unwrap();
    let arguments: Vec<&str> = replay.split(' ').skip(1).collect();
    let again = pilum(&arguments);
    assert_eq!(again.status.code(), Some(3));
    let stdout = String::from_utf8(again.stdout).unwrap();
    has(&stdout, failure["details"].as_str().unwrap());
}
