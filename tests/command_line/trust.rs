//! Libraries that are opened, and the findings about them before.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, CASE, DONE, PLUGIN_TROUBLE, Place};
use crate::troubled;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use tests::or_skip;
use tests::words::rows_of;

/// Where cargo puts the law libraries.
fn shipped(law: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().unwrap();
    folder.join(format!("{DLL_PREFIX}{law}{DLL_SUFFIX}"))
}

fn sha256(library: &Path) -> String {
    law::hexadecimal_sha256(&std::fs::read(library).unwrap())
}

/// The case with a SHA-256 next to its soil's law.
fn pinned(sha256: &str) -> String {
    let key = format!("law = \"elastic\"\nsha256 = \"{sha256}\"");
    CASE.replacen("law = \"elastic\"", &key, 1)
}

#[test]
fn a_case_runs_only_with_the_library_it_names() {
    let right = sha256(&shipped("elastic"));
    Place::new()
        .run_case(pinned(&right.to_uppercase()))
        .ended(DONE);

    let wrong = right.replacen(&right[..1], if &right[..1] == "0" { "1" } else { "0" }, 1);
    let place = Place::new();
    let outcome = place.run_case(pinned(&wrong)).ended(PLUGIN_TROUBLE);
    outcome
        .shows("law `elastic`: library")
        .shows(format!("found SHA-256 {right}"))
        .shows(format!("expected {wrong}"))
        .shows("`sha256` at case.toml:29:10");
    assert_eq!(place.contents(), ["case.toml"]);

    let outcome = Place::new().run_case(pinned("0123")).ended(BAD_INPUT);
    outcome
        .shows("expected 64 hexadecimal digits")
        .shows("case.toml:29:10");
}

#[test]
fn a_lock_beside_a_case_is_honoured() {
    let place = Place::new();
    place.write("case.toml", CASE);
    place.done(&["lock", "case.toml"]);
    let lock = place.read("case.lock");
    for law in ["elastic", "coulomb_joint"] {
        let library = shipped(law);
        let name = library.file_name().unwrap().to_str().unwrap();
        let entry = format!(
            "[[law]]\nid = \"{law}\"\nversion = \"0.1.0\"\nlibrary = \"{name}\"\nsha256 = \"{}\"\n",
            sha256(&library)
        );
        assert!(lock.contains(&entry), "{entry}\nis not in\n{lock}");
    }
    place.done(&["run", "case.toml", "--out", "out"]);

    let right = sha256(&shipped("elastic"));
    place.write("case.lock", lock.replace(&right, &"0".repeat(64)));
    let outcome = place
        .run(&["run", "case.toml", "--out", "out"])
        .ended(PLUGIN_TROUBLE);
    outcome
        .shows("`sha256` at case.lock:")
        .shows("needed by case.toml:28:7");

    // A law that came later.
    let (_, rest) = lock.split_once("[[law]]").unwrap();
    let (_, last) = rest.split_once("[[law]]").unwrap();
    place.write("case.lock", format!("version = 1\n[[law]]{last}"));
    let outcome = place
        .run(&["run", "case.toml", "--out", "out"])
        .ended(PLUGIN_TROUBLE);
    outcome.shows("is not in case.lock");

    place.write("case.lock", "version = 2\n");
    let outcome = place.refused(&["run", "case.toml", "--out", "out"]);
    outcome.shows("a lock of version 2");
}

#[test]
fn a_driver_has_a_lock_too() {
    let place = or_skip!(troubled::place(""));
    place.write(
        "driver.toml",
        troubled::driver("cut").replace("limit = 1.0e-3", "limit = 1.0"),
    );
    place.done(&["lock", "driver.toml"]);
    let point = ["point", "driver.toml", "--csv", "out.csv"];
    place.done(&point);
    // The library changes: a byte more.
    let library = place.path(&troubled::library());
    let mut bytes = std::fs::read(&library).unwrap();
    bytes.push(0);
    std::fs::write(&library, bytes).unwrap();
    place.run(&point).ended(PLUGIN_TROUBLE).shows("driver.lock");
    place.done(&["lock", "driver.toml"]);
    place.done(&point);
}

#[test]
fn a_library_that_crashes_does_so_in_a_child() {
    for [define, says] in rows_of(
        "
TROUBLE_AT_ENTRY | signal 11 (segmentation fault), while opening it
TROUBLE_FROM_START=ABORT | signal 6 (aborted), while calling law `troubled` under interface_2d
TROUBLE_FROM_START=EXIT | exit code 0, while calling law `troubled`
",
    ) {
        let place = or_skip!(troubled::place(define));
        place.write("driver.toml", troubled::driver("cut"));
        let outcome = place
            .run(&["point", "driver.toml", "--csv", "out.csv"])
            .ended(PLUGIN_TROUBLE);
        outcome.shows(says);
        outcome.shows(troubled::library());
    }
}

#[test]
#[cfg(unix)]
fn without_a_probe_a_library_that_crashes_is_named() {
    let place = or_skip!(troubled::place("TROUBLE_AT_ENTRY"));
    place.write("driver.toml", troubled::driver("cut"));
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv", "--no-probe"])
        .ended(PLUGIN_TROUBLE);
    outcome.shows(troubled::library());
}

#[test]
#[cfg(unix)]
fn libraries_that_everybody_may_change_are_refused() {
    use std::os::unix::fs::PermissionsExt;
    let place = or_skip!(troubled::place(""));
    place.write(
        "driver.toml",
        troubled::driver("cut").replace("limit = 1.0e-3", "limit = 1.0"),
    );
    let library = troubled::library();
    let point = ["point", "driver.toml", "--csv", "out.csv"];
    for (path, mode, usual, refused) in [
        (&*library, 0o666, 0o644, true),
        ("laws", 0o777, 0o755, true),
        // Nobody else can replace a file in a sticky folder.
        ("laws", 0o1777, 0o755, false),
    ] {
        let set = |mode| {
            let permissions = std::fs::Permissions::from_mode(mode);
            std::fs::set_permissions(place.path(path), permissions).unwrap();
        };
        set(mode);
        let outcome = place.run(&point);
        if refused {
            let outcome = outcome.ended(PLUGIN_TROUBLE);
            let says = format!("(mode {mode:o})");
            outcome.shows("can be changed by every user").shows(&says);
        } else {
            outcome.ended(DONE);
        }
        set(usual);
    }
}

/// The library would crash if anything of it ran.
#[test]
fn inspection_runs_nothing() {
    let place = or_skip!(troubled::place("TROUBLE_AT_ENTRY"));
    let library = troubled::library();
    let outcome = place.done(&["inspect", &library, "--json"]);
    let found: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(found["sha256"], sha256(&place.path(&library)));
    assert_eq!(found["architecture"], std::env::consts::ARCH);
    assert_eq!(found["bits"], 64);
    assert_eq!(found["laws"][0]["id"], "troubled");
    assert_eq!(found["laws"][0]["version"], "1.0");
    assert_eq!(found["handshake"]["abi"], serde_json::json!([1, 0]));
    assert_eq!(found["handshake"]["sdk"], "test");
    let has = |list: &str, name: &str| {
        let names = found[list].as_array().unwrap();
        names.iter().any(|entry| entry.as_str() == Some(name))
    };
    assert!(has("exported", "pilum_entry") && has("exported", "pilum_magic"));
    assert!(has("undefined", "abort") && !has("exported", "integrate"));
    assert_eq!(found["remarks"], serde_json::json!([]));

    let outcome = place.run(&["inspect", &library]);
    outcome.prints("laws          troubled 1.0\n");

    place.write("text", "no library");
    let outcome = place.run(&["inspect", "text"]).ended(PLUGIN_TROUBLE);
    outcome.shows("text is no library");
    place.refused(&["inspect", "missing"]);
}
