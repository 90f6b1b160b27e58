//! What helps an author: a path of his own, calls that can be repeated, less to read, a debugger.
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

use crate::program::{
    check, compiled, compiled_with, folder, library_of, pilum, pilum_in, refused,
};
use std::path::Path;
use tests::or_skip;
use tests::words::has;
use tests::words::rows_of;

/// A tangent that is wrong where nobody usually is.
const SOFT: &str = "#define TANGENT(row, column) ((batch->request & PILUM_REQ_TANGENT && \
                    instance->stiffness[0] < 500.0 ? 1.05 : 1.0) * STIFFNESS(row, column))";

/// A driver of the fixture in a folder.
fn driver(folder: &Path, more: &str) -> String {
    let file = folder.join("driver.toml");
    let text = format!(
        "law = \"fixture\"\nlaw_path = [{:?}]\nhypothesis = \"interface_2d\"\n\
         [parameters]\nnormal_stiffness = 100.0\nshear_stiffness = 1e6\n\
         [initial]\ntraction = {{ n = -20.0 }}\n\
         [[segment]]\nincrements = 4\ncontrol = {{ t = {{ jump = 1e-3 }} }}\n{more}",
        folder.display().to_string()
    );
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

/// Random paths stay where the law is usually used; the author's own path is elsewhere.
#[test]
fn a_driver_is_what_the_checks_are_made_with() {
    let folder = folder();
    let library = or_skip!(compiled_with(SOFT, "fixture", folder.path()));
    assert_eq!(check(&library, &[]).code, Some(0));
    let more = "[[segment]]\nincrements = 3\n\
                control = { n = { traction = -40.0 } }\n\
                [[variant]]\nname = \"soft\"\n[[variant]]\nname = \"hard\"\n\
                [variant.parameters]\nnormal_stiffness = 1e6\n";
    let driver = driver(folder.path(), more);
    let report = check(&library, &["--driver", &driver]);
    let id = "tangent-matches-differences";
    assert_eq!(
        report.with(&["failed", "crashed"]),
        [id],
        "{:#}",
        report.json
    );
    let finding = report.check(id);
    let details = finding["details"].as_str().unwrap();
    assert!(details.contains("normal_stiffness = 100"), "{details}");
    let replay = finding["replay"].as_str().unwrap();
    assert!(replay.ends_with(&format!("--driver {driver}")), "{replay}");
    // Two variants of seven increments each, in one batch.
    let repeatable = &report.check("repeatable")["details"];
    assert_eq!(repeatable, "14 points", "{:#}", report.json);
}

#[test]
fn a_driver_that_does_not_fit_is_bad_input() {
    let folder = folder();
    let library = or_skip!(compiled_with("", "fixture", folder.path()));
    let library = library.to_str().unwrap();
    let refused = |library: &str, driver: &str| refused(&["check", library, "--driver", driver], 1);
    assert!(refused(library, "no/such.toml").contains("cannot read no/such.toml"));
    let wrong = driver(folder.path(), "figur = []\n");
    let words = refused(library, &wrong);
    has(&words, "figur");
    has(&words, "driver.toml:12:");
    let right = driver(folder.path(), "");
    let words = refused(library_of("elastic").to_str().unwrap(), &right);
    assert!(words.contains("leads `fixture` of library"), "{words}");
}

/// A call that a check finds wrong is a file, which `replay` reads.
#[test]
fn a_wrong_call_can_be_repeated() {
    let folder = folder();
    let library = or_skip!(compiled("bad_tangent", folder.path()));
    let id = "tangent-matches-differences";
    let report = check(&library, &["--only", id]);
    let capsule = report.check(id)["capsule"].as_str().unwrap();
    let text = std::fs::read_to_string(capsule).unwrap();
    assert!(text.contains(&format!("check = \"{id}\"")), "{text}");
    for more in [&[][..], &["--in-process"]] {
        let output = pilum(&[&["replay", capsule], more].concat());
        let said = String::from_utf8(output.stdout).unwrap();
        // As the check has ended.
        assert_eq!(output.status.code(), Some(3), "{said}");
        for words in [
            "the call succeeds; it is recorded as `ok`",
            // Of the tangent that the law gives, 1 % is too much.
            "at most 9.9e-3 of its largest component off",
            "check `tangent-matches-differences` fails for this increment, as recorded",
        ] {
            assert!(said.contains(words), "{said}");
        }
    }
    // In its place a law without the fault.
    assert!(compiled_with("", "bad_tangent", folder.path()).is_some());
    let output = pilum(&["replay", capsule]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    for words in [
        "this is another library than that of the capsule",
        "check `tangent-matches-differences` finds nothing wrong with this increment alone",
        "the whole check: pilum check ",
    ] {
        assert!(said.contains(words), "{said}");
    }
}

/// Replaying the call of a warning warns too, and neither is an error.
#[test]
fn a_doubtful_call_can_be_repeated() {
    for (fixture, id) in [
        ("bad_jump", "response-is-continuous"),
        ("bad_unit_inside", "units-belong-together"),
        ("bad_engineering_shear", "response-is-isotropic"),
    ] {
        let folder = folder();
        let library = or_skip!(compiled(fixture, folder.path()));
        let report = check(&library, &["--only", id]);
        let capsule = report.check(id)["capsule"].as_str().unwrap();
        let output = pilum(&["replay", capsule]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{said}");
        let words = format!("check `{id}` warns of this increment");
        assert!(said.contains(&words), "{said}");
    }
}

/// The capsule of the one check of a fixture, and what replaying it says.
fn replayed(fixture: &str, id: &str) -> Option<(String, String)> {
    let folder = folder();
    let library = compiled(fixture, folder.path())?;
    let report = check(&library, &["--only", id]);
    let capsule = report.check(id)["capsule"].as_str();
    let capsule = capsule.unwrap_or_else(|| panic!("{fixture}: {:#}", report.json));
    let output = pilum(&["replay", capsule]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3), "{fixture}: {said}");
    Some((std::fs::read_to_string(capsule).unwrap(), said))
}

/// A check that crashes leaves its last call: of one point where that is enough, in the form that it
/// crashes in, of the function that it crashes in.
#[test]
fn a_call_that_crashes_can_be_repeated() {
    for [fixture, id, request, says] in rows_of(
        "
bad_abort | integrate-works | fluxes | the law crashed: signal 6 (aborted)
bad_exit | integrate-works | fluxes | the law ended its process: exit code 0
bad_create_abort | create-works | an instance | the law crashed: signal 6 (aborted)
bad_overread | reads-stay-inside | fluxes | the law crashed: signal 11 (segmentation fault)
bad_long_array | independent-of-split | fluxes | the law crashed: signal 11 (segmentation fault)
",
    ) {
        let (capsule, said) = or_skip!(replayed(fixture, id));
        has(&capsule, format!("request = \"{request}"));
        has(&said, format!("as recorded: `internal`: {says}"));
        let n_points = capsule.matches("[[point]]").count();
        assert_eq!(
            n_points > 0,
            fixture == "bad_long_array",
            "{fixture}: {n_points}"
        );
    }
}

/// Crashes of a library outside the calls of laws: a name, the check that crashes, the phase in its capsule, and the
/// output of replaying it; the definitions of the fixture, with `\n` for the end of a line.
const PHASES: &str = r#"
load_crashes library-opens load the library crashed: signal 11 (segmentation fault)
  __attribute__((constructor)) static void begins(void) { *(volatile int *)16 = 0; }
load_exits library-opens load the library ended its process: exit code 1
  #include <stdlib.h>\n__attribute__((constructor)) static void begins(void) { exit(1); }
load_hangs library-opens load the library does not return
  __attribute__((constructor)) static void begins(void) { for (;;) { __asm__ volatile(""); } }
entry_aborts entry-is-idempotent entry the library crashed: signal 6 (aborted)
  #define IN_ENTRY abort()
entry_exits entry-is-idempotent entry the library ended its process: exit code 0
  #define IN_ENTRY exit(0)
entry_hangs entry-is-idempotent entry the library does not return
  #define IN_ENTRY for (;;) { __asm__ volatile(""); }
description_is_nowhere description-is-readable describe the library crashed: signal 11 (segmentation fault)
  #define IN_ENTRY return (const pilum_plugin *)16
destroy_null create-works destroy_null the library crashed: signal 11 (segmentation fault)
  #define IN_DESTROY ((volatile double *)instance->stiffness)[0] = 0.0
destroy_exits create-works destroy the law ended its process: exit code 3
  #define IN_DESTROY if (instance) exit(3)
destroy_hangs create-works destroy the law does not return
  #define IN_DESTROY while (instance) { __asm__ volatile(""); }
destroy_after_use integrate-works destroy the law crashed: signal 6 (aborted)
  static int used;\n#define IN_INTEGRATE used = 1\n#define IN_DESTROY if (used && instance) abort()
end_aborts library-opens exit the library crashed: signal 6 (aborted)
  #include <stdlib.h>\n__attribute__((destructor)) static void ends(void) { abort(); }
end_exits library-opens exit the library ended its process: exit code 4
  #include <unistd.h>\n__attribute__((destructor)) static void ends(void) { _exit(4); }
"#;

/// What crashes on opening, in `destroy` or at the end of the process can be repeated as calls can.
#[test]
fn a_crash_where_no_law_is_called_can_be_repeated() {
    let rows: Vec<&str> = PHASES.lines().skip(1).collect();
    for row in rows.chunks(2) {
        let words: Vec<&str> = row[0].splitn(4, ' ').collect();
        let [name, id, phase, says] = words[..] else {
            panic!("{row:?}")
        };
        let definitions = &row[1].replace("\\n", "\n");
        let folder = folder();
        let library = or_skip!(compiled_with(definitions, name, folder.path()));
        let report = check(&library, &["--only", id, "--time-limit", "2"]);
        assert_eq!(report.check(id)["outcome"], "crashed", "{name}");
        let capsule = report.check(id)["capsule"].as_str();
        let capsule = capsule.unwrap_or_else(|| panic!("{name}: {:#}", report.json));
        let text = std::fs::read_to_string(capsule).unwrap();
        let is_of_law = text.contains("[probe]");
        let key = if is_of_law { "function" } else { "phase" };
        has(&text, format!("{key} = \"{phase}\""));
        let sha256 = report.json["sha256"].as_str().unwrap();
        has(&text, format!("sha256 = \"{sha256}\""));
        let output = pilum(&["replay", capsule]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(3), "{name}: {said}");
        has(&said, format!("as recorded: `internal`: {says}"));
        has(&said, format!("from check {id}, seed 1"));
        // Mended, it is another library, and nothing fails.
        compiled_with("", name, folder.path()).unwrap();
        let output = pilum(&["replay", capsule]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{name}: {said}");
        let words = if is_of_law {
            "the call succeeds"
        } else {
            "nothing fails; it is recorded as `internal`"
        };
        assert!(said.contains(words), "{name}: {said}");
        assert_eq!(
            said.contains("this is another library than that of the capsule"),
            !is_of_law,
            "{name}: {said}"
        );
    }
}

/// The same of a UMAT, whose library is loaded with its first material.
#[test]
fn a_routine_that_crashes_on_opening_or_at_the_end_can_be_repeated() {
    let umat = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/umat");
    for [attribute, key, says] in rows_of(
        r#"
constructor | function = "create" | the law crashed: signal 6
destructor | phase = "exit" | the library crashed: signal 6
"#,
    ) {
        let folder = folder();
        let source = folder.path().join("rows.c");
        let text = std::fs::read_to_string(umat.join("rows.c")).unwrap();
        let more = format!(
            "\n#include <stdlib.h>\n__attribute__(({attribute})) static void plant(void) {{ abort(); }}\n"
        );
        let visible = "#pragma GCC visibility push(default)\n";
        std::fs::write(&source, format!("{visible}{text}{more}")).unwrap();
        let library = or_skip!(crate::program::compiled_from(&source, &umat, folder.path()));
        let sidecar = library.with_extension("law.toml");
        std::fs::copy(umat.join("rows.law.toml"), sidecar).unwrap();
        let id = "routine-answers";
        let report = check(&library, &["--only", id]);
        let capsule = report.check(id)["capsule"].as_str();
        let capsule = capsule.unwrap_or_else(|| panic!("{attribute}: {:#}", report.json));
        let text = std::fs::read_to_string(capsule).unwrap();
        assert!(text.contains(key), "{attribute}: {text}");
        assert!(text.contains("adapter = \"umat\""), "{attribute}: {text}");
        let output = pilum(&["replay", capsule]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(3), "{attribute}: {said}");
        has(&said, format!("as recorded: `internal`: {says}"));
    }
}

/// The defect of such a capsule is marked in it.
#[test]
fn a_capsule_of_a_library_is_read_with_care() {
    let folder = folder();
    let file = folder.path().join("failure.toml");
    let good = "version = 1\n[library]\npath = \"/no/such.so\"\nsha256 = \"\"\nphase = \"load\"\n\
                [outcome]\nstatus = \"internal\"\nmessage = \"\"\n";
    for (from, to, says) in [
        ("", "", "cannot read /no/such.so"),
        ("version = 1", "version = 2", "1:11"),
        ("load", "lode", "5:9"),
        ("load", "destroy_null", "`law` is missing"),
        ("path", "file", "3:1"),
    ] {
        std::fs::write(&file, good.replacen(from, to, 1)).unwrap();
        let words = refused(&["replay", file.to_str().unwrap()], 1);
        assert!(words.contains(says), "{to:?}: {words}");
    }
}

/// A defect of `init_state` shows again in a replay.
#[test]
fn a_wrong_initial_state_can_be_repeated() {
    for [fixture, id, says] in rows_of(
        "
bad_init_last | initial-states-are-written | `travel` is not written
bad_init_random | repeatable | ; called again: flux
bad_init_split | independent-of-split | ; alone: flux
",
    ) {
        let (capsule, said) = or_skip!(replayed(fixture, id));
        has(&capsule, "request = \"initial state\"");
        assert!(said.contains(says), "{fixture}: {said}");
    }
}

#[test]
fn what_has_passed_need_not_be_read() {
    let folder = folder();
    let library = or_skip!(compiled("bad_print", folder.path()));
    let library = library.to_str().unwrap();
    let all = pilum_in(folder.path(), &["check", library]);
    let failed = pilum_in(folder.path(), &["check", library, "--only-failed"]);
    assert_eq!(all.status.code(), failed.status.code());
    let failed = String::from_utf8(failed.stdout).unwrap();
    assert!(failed.contains("FAILED   prints-nothing"), "{failed}");
    assert!(
        !failed.contains("  passed ") && !failed.contains("  skipped "),
        "{failed}"
    );
    let last = |text: &str| text.lines().last().unwrap().to_owned();
    assert_eq!(last(&failed), last(&String::from_utf8(all.stdout).unwrap()));
}

/// A check in the program's process gives the same as in a separate one, and a law that crashes takes
/// the program along.
#[test]
fn a_check_can_be_run_under_a_debugger() {
    let folder = folder();
    let library = or_skip!(compiled("bad_abort", folder.path()));
    let only = |id: &str| {
        let library = library.to_str().unwrap();
        pilum(&["check", library, "--in-process", "--only", id])
    };
    let passing = only("create-works");
    let said = String::from_utf8(passing.stdout).unwrap();
    assert_eq!(passing.status.code(), Some(0), "{said}");
    assert!(said.contains("passed   create-works"), "{said}");
    assert_eq!(only("integrate-works").status.code(), None);
}

/// The message has the line of the sidecar and the keys that exist; a remark that applies to every
/// hypothesis comes once.
#[test]
fn a_sidecar_that_cannot_be_read_is_told_with_its_line() {
    let umat = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/umat");
    let folder = folder();
    let library = or_skip!(crate::program::compiled_from(
        &umat.join("rows.c"),
        &umat,
        folder.path()
    ));
    let good = std::fs::read_to_string(umat.join("rows.law.toml")).unwrap();
    let sidecar = library.with_extension("law.toml");
    let wrong = format!("{good}\n[[state]]\nid = \"slip\"\n");
    let line = wrong.lines().position(|line| line == "[[state]]").unwrap() + 1;
    std::fs::write(&sidecar, wrong).unwrap();
    let id = "sidecar-is-read";
    let report = check(&library, &["--only", id]);
    let details = report.check(id)["details"].as_str().unwrap();
    has(details, format!("law.toml:{line}: unknown key `state`; "));
    let silent = format!("{good}\n[[internal]]\nid = \"slip\"\nunit = \"-\"\ndoc = \"\"\n");
    std::fs::write(&sidecar, silent).unwrap();
    let id = "description-is-complete";
    let report = check(&library, &["--only", id]);
    let details = report.check(id)["details"].as_str().unwrap();
    let gap = "the doc of internal variable `slip`";
    assert_eq!(details.matches(gap).count(), 1, "{details}");
}

/// A build may replace the program while it runs.
#[cfg(target_os = "linux")]
#[test]
fn a_program_whose_file_is_gone_goes_on() {
    let folder = folder();
    let library = or_skip!(compiled_with(SOFT, "fixture", folder.path()));
    let script = "cp \"$0\" gone && exec 3< gone && rm gone && exec /proc/self/fd/3 check \"$1\" --only repeatable";
    let output = std::process::Command::new("sh")
        .args(["-c", script])
        .arg(tests::place::built_program())
        .arg(&library)
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said} {output:?}");
}

/// A law that has panicked is not called again; what finds it so says that it fails, and does not pass over it.
#[test]
fn a_law_that_gave_up_in_an_earlier_call_fails() {
    const GIVES_UP: &str = "static int gave_up;\n#define IN_INTEGRATE gave_up = 1\n\
                            #define AT_INIT if (gave_up) return PILUM_E_INTERNAL; travel = 0.0";
    let folder = folder();
    let library = or_skip!(compiled_with(GIVES_UP, "fixture", folder.path()));
    let id = "results-are-finite";
    let report = check(&library, &["--only", id]);
    assert_eq!(report.with(&["failed"]), [id], "{:#}", report.json);
    let details = report.check(id)["details"].as_str().unwrap();
    has(details, "`init_state` gave PILUM_E_INTERNAL");
}

/// The report on a law that panicked has its message at that time, and not only that it is not called again.
#[test]
fn the_first_words_of_a_law_that_gives_up_are_kept() {
    // As a law in Rust ends that panics beyond some slip.
    const PANICS: &str = "static int panicked;\n#define AT_START if (panicked) { TELL(PILUM_E_INTERNAL, i); \
                          SAY(\"the law panicked before and is not called again\"); return PILUM_E_INTERNAL; } \
                          if (travel > 1e-4) { panicked = 1; TELL(PILUM_E_INTERNAL, i); \
                          SAY(\"point %d: panicked: index 7 of 5\", (int)i); return PILUM_E_INTERNAL; }";
    let folder = folder();
    let library = or_skip!(compiled_with(PANICS, "fixture", folder.path()));
    let id = "results-are-finite";
    let report = check(&library, &["--only", id]);
    assert_eq!(report.with(&["failed"]), [id], "{:#}", report.json);
    let details = report.check(id)["details"].as_str().unwrap();
    for words in [
        "is not called again",
        "at first it said: point",
        "panicked: index 7 of 5",
    ] {
        assert!(details.contains(words), "{details}");
    }
}
