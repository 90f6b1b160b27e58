//! Routines that are right and were refused: with their own habits, with much to say, with calls
//! that are never reached, with tangents by rows or of elasticity.

use super::{driver, gfortran, number, place, rows, source};
use crate::program::{BAD_INPUT, DONE, NO_EQUILIBRIUM, Outcome, PLUGIN_TROUBLE, Place};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use tests::case::table;
use tests::or_skip;
use tests::words::rows_of;

/// Runs a driver without looking at how it ends.
fn point(place: &Place, text: &str) -> Outcome {
    place.write("driver.toml", text);
    place.run(&["point", "driver.toml", "--csv", "out.csv"])
}

#[test]
fn copies_may_be_used_up_and_that_is_noted_once() {
    let place = or_skip!(place("habits"));
    let stress = |what: f64| {
        let outcome = point(&place, &driver("habits", "", &format!("what = {what}"))).ended(DONE);
        let rows = table(&place.path("out.csv"));
        let end = rows.last().unwrap();
        let stress = ["11", "22", "33", "12"].map(|c| number(end, &format!("stress_{c}")));
        (stress.map(f64::to_bits), outcome.stderr)
    };
    let (neat, said) = stress(0.0);
    assert!(!said.contains("overwrites"), "{said}");
    for (what, names) in [
        (1.0, "overwrites DSTRAN, which"),
        (
            2.0,
            "overwrites STRAN, TIME, DTIME, TEMP, PREDEF, COORDS, DROT, CELENT, DFGRD1, which",
        ),
    ] {
        for keys in ["", "in_process = true"] {
            let text = driver("habits", keys, &format!("what = {what}"));
            let outcome = point(&place, &text).ended(DONE);
            let said = &outcome.stderr;
            assert_eq!(
                said.matches("law `umat_habits`: the routine").count(),
                1,
                "{said}"
            );
            assert!(said.contains(names), "{names}\n{said}");
        }
        assert_eq!(stress(what).0, neat, "what it leaves there is not used");
    }
    // A run says it, too, and keeps it.
    let case = super::soil_with("habits", "what = 1");
    let outcome = place.done_case(case);
    let warnings = place.summary()["warnings"].to_string();
    assert_eq!(
        warnings.matches("overwrites DSTRAN, which").count(),
        1,
        "{warnings}"
    );
    outcome.shows("warning: law `umat_habits`: the routine overwrites DSTRAN");
}

#[test]
fn time_increments_are_positive_in_every_call() {
    let place = or_skip!(place("habits"));
    // The first call of all, in which nothing moves, is checked too: 0/0 would be refused.
    let all = rows(&place, &driver("habits", "", "what = 3"));
    assert!(all[1..].iter().all(|row| number(row, "dtime") == 1.0));
    let text = super::soil_with("habits", "what = 3");
    // The elastic operator is asked for, and is that of a call without strain.
    for method in ["newton", "initial_stress"] {
        let text = text.replacen("[solver]", &format!("[solver]\nmethod = \"{method}\""), 1);
        place.done_case(text);
    }
}

/// Lines of a text that say this.
fn lines<'a>(text: &'a str, what: &str) -> Vec<&'a str> {
    text.lines().filter(|line| line.contains(what)).collect()
}

#[test]
fn what_is_printed_is_passed_on_and_counted() {
    let place = or_skip!(place("talks"));
    // Little: all of it, and nothing in the table on the standard output.
    place.write("driver.toml", driver("talks", "", "lines = 0"));
    let outcome = place.done(&["point", "driver.toml"]);
    let here = place.path("").canonicalize().unwrap();
    let outdir = format!("law `umat_talks` prints:  OUTDIR IS {}", here.display());
    outcome.shows(outdir.trim_end_matches('/'));
    assert!(!outcome.stdout.contains("OUTDIR"), "{}", outcome.stdout);
    // Much: the first lines, and how many there were. 3 a call, 10 increments and the start.
    let text = driver("talks", "", "lines = 3");
    let outcome = point(&place, &text).ended(DONE);
    assert_eq!(
        lines(&outcome.stderr, "umat_talks` prints: ").len(),
        20,
        "{}",
        outcome.stderr
    );
    let total = lines(&outcome.stderr, "law `umat_talks` printed ");
    let [total] = total[..] else {
        panic!("{}", outcome.stderr)
    };
    let n: usize = total.split_whitespace().nth(3).unwrap().parse().unwrap();
    assert_eq!((n - 1) % 3, 0, "{total}");
    assert!(n > 3 * 11, "{total}");
    assert!(
        total.ends_with("lines, of which the first 20 are shown"),
        "{total}"
    );

    let case = super::soil_with("talks", "lines = 1");
    let outcome = place.done_case(case);
    assert_eq!(lines(&outcome.stderr, "umat_talks` prints: ").len(), 20);
    assert!(!outcome.stdout.contains("LINE"), "{}", outcome.stdout);
}

#[test]
fn scratch_files_are_removed_or_kept() {
    let place = or_skip!(place("talks"));
    let scratch = place.path("scratch");
    std::fs::create_dir(&scratch).unwrap();
    let left = || -> Vec<PathBuf> {
        let entries = std::fs::read_dir(&scratch).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    };
    let run = |keys: &str| {
        place.write("driver.toml", driver("talks", keys, "lines = 0"));
        let arguments = ["point", "driver.toml", "--csv", "out.csv"];
        let outcome = place
            .run_with(&arguments, &[("TMPDIR", scratch.to_str().unwrap())])
            .ended(DONE);
        for name in ["fort.7", "notes.dat"] {
            assert!(!place.path(name).exists(), "{name} beside the driver");
        }
        outcome
    };
    run("");
    assert_eq!(left(), Vec::<PathBuf>::new());
    let outcome = run("scratch = \"keep\"");
    let [folder] = &left()[..] else {
        panic!("{:?}", left())
    };
    let says = format!("scratch files of law `umat_talks` in {}", folder.display());
    outcome.shows(&says);
    // Ten increments and the start, to the last line.
    let text = std::fs::read_to_string(folder.join("worker_1/fort.7")).unwrap();
    assert!(text.lines().count() >= 11, "{text}");
    assert_eq!(
        text.lines().last().unwrap().split_whitespace().last(),
        Some("10")
    );
    assert!(folder.join("worker_1/notes.dat").is_file());
    // The sidecar may say it, for the IncrementalDriver, whose input has no such key.
    std::fs::remove_dir_all(folder).unwrap();
    let sidecar = place.read("talks.law.toml");
    place.write("talks.law.toml", format!("scratch = \"keep\"\n{sidecar}"));
    run("");
    assert_eq!(left().len(), 1);
    std::fs::remove_dir_all(&left()[0]).unwrap();
    run("scratch = \"remove\"");
    assert_eq!(left(), Vec::<PathBuf>::new());
    for [keys, says] in rows_of(
        r#"
in_process = true\nscratch = "keep" | `scratch` needs a worker process
in_process = true\nexternals = "trap" | `externals` needs a worker process
externals = "ignore" | `externals`: there is no `ignore`
"#,
    ) {
        let outcome = point(&place, &driver("talks", keys, "lines = 0")).ended(BAD_INPUT);
        outcome.shows(says);
    }
}

#[test]
fn what_nobody_supplies_is_named_at_once_or_trapped() {
    let place = or_skip!(place("externals"));
    let names = "linked with nor Pilum supply: `getvrm_`, `mutexlock_`.";
    for keys in ["", "in_process = true"] {
        let outcome = point(&place, &driver("externals", keys, "")).ended(PLUGIN_TROUBLE);
        outcome.shows(names).shows("`externals = \"trap\"`");
    }
    let trap = "externals = \"trap\"";
    let bound = ["-shared", "-fPIC", "-Wl,-z,now,-z,relro"];
    for linked_now in [false, true] {
        if linked_now {
            let library = place.path("libexternals.so");
            std::fs::remove_file(&library).unwrap();
            gfortran(&bound, &[source("externals.f")], &library).unwrap();
        }
        for now in [&[][..], &[("LD_BIND_NOW", "1")]] {
            place.write("driver.toml", driver("externals", trap, ""));
            let arguments = ["point", "driver.toml", "--csv", "out.csv"];
            place.run_with(&arguments, now).ended(DONE);
        }
        // One that is called ends the increment and is named.
        let outcome =
            point(&place, &driver("externals", trap, "limit = 1.1e-3")).ended(PLUGIN_TROUBLE);
        outcome
            .shows("segment 1, increment 7 of 10")
            .shows("exit code 71")
            .shows("calls `mutexlock_`, which nobody supplies");
        let outcome = place
            .run(&["replay", "out.failure.toml"])
            .ended(PLUGIN_TROUBLE);
        outcome.prints("as recorded");
    }
}

#[test]
fn no_trap_stands_for_data() {
    let place = or_skip!(place("externals"));
    place.write(
        "data.c",
        "extern double table_[3]; extern void other_(void);\n\
         double read_table(int i) { other_(); return table_[i]; }\n",
    );
    let library = place.path("libexternals.so");
    std::fs::remove_file(&library).unwrap();
    let sources = [source("externals.f"), place.path("data.c")];
    gfortran(&["-shared", "-fPIC"], &sources, &library).unwrap();
    let outcome =
        point(&place, &driver("externals", "externals = \"trap\"", "")).ended(PLUGIN_TROUBLE);
    outcome.shows("no trap can stand for: `table_`");
    let outcome = point(&place, &driver("externals", "", ""));
    outcome
        .shows("`getvrm_`, `mutexlock_`, `other_`")
        .shows("`table_`");
}

#[test]
fn a_tangent_may_stand_row_by_row() {
    let place = or_skip!(place("rows"));
    let text = "law = \"umat_rows\"\nadapter = \"umat\"\nlibrary = \"librows.so\"\n\
        hypothesis = \"plane_strain\"\n\
        [parameters]\nstiffness = 1e4\ncoupling = 8e3\n\
        [[segment]]\nincrements = 3\ncontrol = { 11 = { stress = 30.0 }, \
        22 = { stress = -20.0 }, 12 = { strain = 0.0 } }\n";
    let calls = |rows: &[BTreeMap<String, String>]| -> f64 {
        rows[1..].iter().map(|row| number(row, "iterations")).sum()
    };
    let by_rows = rows(&place, text);
    let end = by_rows.last().unwrap();
    // ε₂₂ = σ₂₂/K, ε₁₁ = (σ₁₁ − C ε₂₂)/K.
    assert!((number(end, "strain_22") + 20.0 / 1e4).abs() < 1e-14);
    assert!((number(end, "strain_11") - (30.0 + 8e3 * 20.0 / 1e4) / 1e4).abs() < 1e-14);
    let sidecar = place.read("rows.law.toml");
    let columns = sidecar.replacen("\"rows\"", "\"columns\"", 1);
    assert_ne!(columns, sidecar);
    place.write("rows.law.toml", columns);
    let by_columns = rows(&place, text);
    let (by_rows, by_columns) = (calls(&by_rows), calls(&by_columns));
    assert!(by_rows <= 6.0, "one correction of a linear law: {by_rows}");
    assert!(by_columns > by_rows, "{by_columns} {by_rows}");
    place.write("rows.law.toml", sidecar.replacen("\"rows\"", "\"c\"", 1));
    let outcome = point(&place, text).ended(BAD_INPUT);
    outcome.shows("`tangent_order`: there is no `c`");
}

/// The cone with elastic tangents, in a soil that flows.
fn flowing(place: &Place, method: &str) -> Outcome {
    let text = super::flowing("elastic_tangent");
    let text = text.replacen("max_iterations = 20", method, 1);
    place.run_case(text)
}

#[test]
fn an_approximate_tangent_is_replaced_by_differences() {
    let place = or_skip!(place("drucker_prager"));
    let sources = ["elastic_tangent.f", "drucker_prager.f"].map(source);
    let library = place.path("libelastic_tangent.so");
    gfortran(&["-shared", "-fPIC"], &sources, &library).unwrap();
    let sidecar = std::fs::read_to_string(source("elastic_tangent.law.toml")).unwrap();
    place.write("elastic_tangent.law.toml", &sidecar);
    let total = |place: &Place| -> u64 {
        let found = place.summary();
        let phases = found["phases"].as_array().unwrap().iter();
        phases
            .map(|phase| phase["iterations"].as_u64().unwrap())
            .sum()
    };
    let outcome = flowing(&place, "").ended(DONE);
    let says = "law `umat_elastic_tangent` declares its tangents approximate: differences of its stresses \
                replace them";
    let said = outcome.stderr.matches(says).count();
    assert_eq!(said, 1, "{}", outcome.stderr);
    let declared = total(&place);
    // Methods that do without exact tangents are left alone.
    let outcome = flowing(&place, "method = \"quasi_newton\"").ended(DONE);
    outcome.hides("differences");
    let quasi = total(&place);
    // Without the word it is noticed.
    place.write(
        "elastic_tangent.law.toml",
        sidecar.replacen("tangent = \"approximate\"", "", 1),
    );
    let outcome = flowing(&place, "").ended(DONE);
    outcome.shows("from here on they are made by differences");
    let noticed = total(&place);
    println!("declared {declared}, noticed {noticed}, quasi-Newton {quasi}");
    assert!(2 * declared < quasi, "{declared} {quasi}");
    assert!(noticed < quasi, "{noticed} {quasi}");
    // With the law's own it fails, and the message says why.
    let outcome = flowing(&place, "tangents = \"law\"").ended(NO_EQUILIBRIUM);
    outcome.shows("the tangent of the law differs");
}

/// That gfortran's own libraries are there is no reason to believe that a name is.
#[test]
fn a_library_that_needs_a_missing_library_is_refused_for_that() {
    let place = or_skip!(place("externals"));
    let needed = place.path("libneeded.so");
    gfortran(&["-shared", "-fPIC"], &[source("joint.f")], &needed).unwrap();
    let library = place.path("libexternals.so");
    std::fs::remove_file(&library).unwrap();
    let here = format!("-L{}", place.path("").display());
    let arguments = ["-shared", "-fPIC", "-Wl,--no-as-needed", &here, "-lneeded"];
    let status = Command::new("gfortran")
        .arg("-o")
        .arg(&library)
        .arg(source("externals.f"))
        .args(arguments)
        .status()
        .unwrap();
    assert!(status.success());
    std::fs::remove_file(needed).unwrap();
    let outcome =
        point(&place, &driver("externals", "externals = \"trap\"", "")).ended(PLUGIN_TROUBLE);
    outcome.shows("libneeded.so");
}
