//! Arguments, and files that are not there.

use crate::program::{BAD_INPUT, CASE, DONE, Place};

/// Runs the program with these arguments in a folder with one file, `file`.
fn refused(arguments: &[&str], says: &[&str]) {
    let place = Place::new();
    place.write("file", "");
    let outcome = place.run(arguments).ended(BAD_INPUT);
    for text in says {
        outcome.shows(text);
    }
    assert_eq!(outcome.stdout, "", "{arguments:?}");
    assert_eq!(place.contents(), ["file"], "{arguments:?}");
}

#[test]
fn refuses_arguments_it_does_not_know() {
    refused(&[], &["Usage: pilum [OPTIONS] <COMMAND>"]);
    refused(&["rnu", "file"], &["unrecognized subcommand 'rnu'"]);
    refused(&["run"], &["<CASE>", "Usage: pilum run"]);
    refused(
        &["run", "file", "another"],
        &["unexpected argument 'another'"],
    );
    refused(
        &["run", "file", "--output", "out"],
        &["unexpected argument '--output'"],
    );
    refused(
        &["run", "file", "--out"],
        &["a value is required for '--out"],
    );
}

#[test]
fn names_the_file_it_cannot_read() {
    refused(&["run", "no/such.toml"], &["cannot read no/such.toml"]);
    refused(&["run", "."], &["cannot read ./case.toml"]);
    refused(&["run", "file/case.toml"], &["cannot read file/case.toml"]);
}

#[test]
fn help_and_version_are_no_errors() {
    for (arguments, says) in [
        (vec!["--help"], "Usage: pilum [OPTIONS] <COMMAND>"),
        (vec!["run", "--help"], "Usage: pilum run"),
        (vec!["help", "run"], "Usage: pilum run"),
        (
            vec!["--version"],
            concat!("pilum ", env!("CARGO_PKG_VERSION")),
        ),
    ] {
        let outcome = Place::new().run(&arguments).ended(DONE);
        outcome.prints(says);
        assert_eq!(outcome.stderr, "", "{arguments:?}");
    }
}

#[test]
fn refuses_results_where_none_can_be_written() {
    for out in ["file", "file/results"] {
        let place = Place::new();
        place.write("file", "mine");
        place.write("case.toml", CASE);
        let outcome = place
            .run(&["run", "case.toml", "--out", out])
            .ended(BAD_INPUT);
        outcome.shows(format!("cannot write {out}"));
        assert_eq!(place.contents(), ["case.toml", "file"]);
        assert_eq!(place.read("file"), "mine");
    }
}

#[test]
fn results_go_to_a_folder_named_like_the_case() {
    let place = Place::new();
    place.write("block/case.toml", CASE);
    place.write("other.toml", CASE);
    for (case, results) in [("block", "results/block"), ("other.toml", "results/other")] {
        place.done(&["run", case]);
        assert!(
            place.path(results).join("summary.json").is_file(),
            "{results}"
        );
    }
}
