//! What `pilum new-law` refuses.

use crate::program::pilum;
use std::fs;
use tempfile::TempDir;

#[test]
fn refuses_names_that_cannot_be_ids() {
    for (name, language, why) in [
        ("Joint", "c", "a lower-case letter"),
        ("2joint", "c", "a lower-case letter"),
        ("my-joint", "c", "digits and _"),
        ("../joint", "c", "digits and _"),
        ("gelenk_für_alle", "fortran", "digits and _"),
        ("", "c", "a lower-case letter"),
        (&"a".repeat(61), "c", "more than 60 characters"),
        ("match", "rust", "Rust uses this name"),
        ("abi", "rust", "Rust uses this name"),
        ("elastic", "cpp", "there is a law `elastic` already"),
    ] {
        let place = TempDir::new().unwrap();
        let outcome = pilum(place.path(), &["new-law", name, "--language", language]).ended(1);
        outcome.shows(why);
        assert_eq!(outcome.stdout, "");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0, "{name}");
    }
}

#[test]
fn leaves_what_is_there_alone() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("mine"), "mine").unwrap();
    fs::create_dir(place.path().join("slider")).unwrap();
    for arguments in [
        &["new-law", "slider", "--language", "c"][..],
        &["new-law", "slider", "--language", "c", "--out", "mine"],
        &[
            "new-law",
            "slider",
            "--language",
            "c",
            "--out",
            "mine/slider",
        ],
    ] {
        pilum(place.path(), arguments).ended(1);
    }
    let outcome = pilum(place.path(), &["new-law", "slider", "--language", "c"]);
    outcome.shows("slider exists already");
    assert_eq!(
        fs::read_dir(place.path().join("slider")).unwrap().count(),
        0
    );
    let mine = fs::read_to_string(place.path().join("mine")).unwrap();
    assert_eq!(mine, "mine");
}

#[test]
fn lists_the_languages() {
    let place = TempDir::new().unwrap();
    let outcome = pilum(place.path(), &["new-law", "slider", "--language", "cobol"]).ended(1);
    outcome.shows("rust, c, cpp, fortran");
}

#[test]
fn writes_where_it_is_told() {
    let place = TempDir::new().unwrap();
    let arguments = ["new-law", "slider", "--language", "c", "--out", "deep/down"];
    let outcome = pilum(place.path(), &arguments).ended(0);
    outcome.prints("cd deep/down");
    assert!(place.path().join("deep/down/law.c").is_file());
}
