//! Libraries that are opened, and the findings about them before.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, CASE, DONE, PLUGIN_TROUBLE, Place};
use crate::troubled;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};

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
    let outcome = Place::new().run_case(pinned(&right.to_uppercase()));
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);

    let wrong = right.replacen(&right[..1], if &right[..1] == "0" { "1" } else { "0" }, 1);
    let place = Place::new();
    let outcome = place.run_case(pinned(&wrong));
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    for text in [
        "law `elastic`: library",
        &format!("found SHA-256 {right}"),
        &format!("expected {wrong}"),
        "`sha256` at case.toml:29:10",
    ] {
        assert!(outcome.says(text), "{text:?}\n{}", outcome.stderr);
    }
    assert_eq!(place.contents(), ["case.toml"]);

    let outcome = Place::new().run_case(pinned("0123"));
    assert_eq!(outcome.code, Some(BAD_INPUT), "{}", outcome.stderr);
    assert!(outcome.says("expected 64 hexadecimal digits"));
    assert!(outcome.says("case.toml:29:10"), "{}", outcome.stderr);
}

#[test]
fn a_lock_beside_a_case_is_honoured() {
    let place = Place::new();
    place.write("case.toml", CASE);
    let outcome = place.run(&["lock", "case.toml"]);
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    let lock = std::fs::read_to_string(place.path("case.lock")).unwrap();
    for law in ["elastic", "coulomb_joint"] {
        let library = shipped(law);
        let name = library.file_name().unwrap().to_str().unwrap();
        let entry = format!(
            "[[law]]\nid = \"{law}\"\nversion = \"0.1.0\"\nlibrary = \"{name}\"\nsha256 = \"{}\"\n",
            sha256(&library)
        );
        assert!(lock.contains(&entry), "{entry}\nis not in\n{lock}");
    }
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);

    let right = sha256(&shipped("elastic"));
    place.write("case.lock", lock.replace(&right, &"0".repeat(64)));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(outcome.says("`sha256` at case.lock:"), "{}", outcome.stderr);
    assert!(
        outcome.says("needed by case.toml:28:7"),
        "{}",
        outcome.stderr
    );

    // A law that came later.
    let (_, rest) = lock.split_once("[[law]]").unwrap();
    let (_, last) = rest.split_once("[[law]]").unwrap();
    place.write("case.lock", format!("version = 1\n[[law]]{last}"));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(outcome.says("is not in case.lock"), "{}", outcome.stderr);

    place.write("case.lock", "version = 2\n");
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_eq!(outcome.code, Some(BAD_INPUT), "{}", outcome.stderr);
    assert!(outcome.says("a lock of version 2"), "{}", outcome.stderr);
}

#[test]
fn a_driver_has_a_lock_too() {
    let Some(place) = troubled::place("") else {
        return;
    };
    place.write(
        "driver.toml",
        troubled::driver("cut").replace("limit = 1.0e-3", "limit = 1.0"),
    );
    assert_eq!(place.run(&["lock", "driver.toml"]).code, Some(DONE));
    let point = ["point", "driver.toml", "--csv", "out.csv"];
    assert_eq!(place.run(&point).code, Some(DONE));
    // The library changes: a byte more.
    let library = place.path(&troubled::library());
    let mut bytes = std::fs::read(&library).unwrap();
    bytes.push(0);
    std::fs::write(&library, bytes).unwrap();
    let outcome = place.run(&point);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(outcome.says("driver.lock"), "{}", outcome.stderr);
    assert_eq!(place.run(&["lock", "driver.toml"]).code, Some(DONE));
    assert_eq!(place.run(&point).code, Some(DONE));
}

#[test]
fn a_library_that_crashes_does_so_in_a_child() {
    for (define, says) in [
        (
            "TROUBLE_AT_ENTRY",
            "signal 11 (segmentation fault), while opening it",
        ),
        (
            "TROUBLE_FROM_START=ABORT",
            "signal 6 (aborted), while calling law `troubled` under interface_2d",
        ),
        (
            "TROUBLE_FROM_START=EXIT",
            "exit code 0, while calling law `troubled`",
        ),
    ] {
        let Some(place) = troubled::place(define) else {
            return;
        };
        place.write("driver.toml", troubled::driver("cut"));
        let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
        assert_eq!(
            outcome.code,
            Some(PLUGIN_TROUBLE),
            "{define}: {}",
            outcome.stderr
        );
        assert!(outcome.says(says), "{define}: {}", outcome.stderr);
        assert!(outcome.says(&troubled::library()), "{}", outcome.stderr);
    }
}

#[test]
#[cfg(unix)]
fn without_a_probe_a_library_that_crashes_is_named() {
    let Some(place) = troubled::place("TROUBLE_AT_ENTRY") else {
        return;
    };
    place.write("driver.toml", troubled::driver("cut"));
    let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv", "--no-probe"]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(outcome.says(&troubled::library()), "{}", outcome.stderr);
}

#[test]
#[cfg(unix)]
fn libraries_that_everybody_may_change_are_refused() {
    use std::os::unix::fs::PermissionsExt;
    let Some(place) = troubled::place("") else {
        return;
    };
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
            assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
            let says = format!("(mode {mode:o})");
            assert!(
                outcome.says("can be changed by every user"),
                "{}",
                outcome.stderr
            );
            assert!(outcome.says(&says), "{}", outcome.stderr);
        } else {
            assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
        }
        set(usual);
    }
}

/// The library would crash if anything of it ran.
#[test]
fn inspection_runs_nothing() {
    let Some(place) = troubled::place("TROUBLE_AT_ENTRY") else {
        return;
    };
    let library = troubled::library();
    let outcome = place.run(&["inspect", &library, "--json"]);
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
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
    assert!(outcome.stdout.contains("laws          troubled 1.0\n"));

    place.write("text", "no library");
    let outcome = place.run(&["inspect", "text"]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(outcome.says("text is no library"), "{}", outcome.stderr);
    assert_eq!(place.run(&["inspect", "missing"]).code, Some(BAD_INPUT));
}
