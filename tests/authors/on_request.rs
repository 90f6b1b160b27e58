//! Tests that CI leaves out: tests that take minutes are run by `tests/release.sh`, and `CONTRIBUTING.md` says
//! when they were. Everything else runs always, or says what it lacks.

use crate::compilers::repository;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Why a test is left out although nobody has to ask for it: another one starts it.
const FOR_ANOTHER: &str = "work for a child";

/// Every file of Rust in a folder.
fn sources(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|suffix| suffix == "rs") {
            found.push(std::fs::read_to_string(path).unwrap());
        }
    }
}

/// Names of tests that are left out, those that another one starts excepted.
fn left_out(text: &str) -> Vec<String> {
    // In two parts, so that it is not found here.
    text.split(concat!("#[", "ignore"))
        .skip(1)
        .filter(|rest| !rest.starts_with(&format!(" = \"{FOR_ANOTHER}\"]")))
        .map(|rest| {
            let (_, name) = rest.split_once("fn ").unwrap();
            name.split('(').next().unwrap().to_owned()
        })
        .collect()
}

#[test]
fn what_ci_leaves_out_a_release_runs() {
    let mut texts = Vec::new();
    for folder in ["abi", "host", "models", "tests"] {
        sources(&repository(folder), &mut texts);
    }
    let tests: BTreeSet<String> = texts.iter().flat_map(|text| left_out(text)).collect();
    assert!(!tests.is_empty());
    let read = |path: &str| std::fs::read_to_string(repository(path)).unwrap();
    let script = read("tests/release.sh");
    let run: BTreeSet<String> = script
        .lines()
        .filter_map(|line| line.strip_prefix("on_request "))
        .map(|line| line.rsplit([' ', ':']).next().unwrap().to_owned())
        .collect();
    assert_eq!(run, tests, "tests/release.sh against the tests on request");
    let page = read("CONTRIBUTING.md");
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    let listed: BTreeSet<String> = rows
        .filter_map(|row| row.split('`').next()?.rsplit("::").next())
        .map(str::to_owned)
        .collect();
    assert_eq!(
        listed, tests,
        "CONTRIBUTING.md against the tests on request"
    );
}

#[test]
fn tests_left_out_are_found() {
    let mark = concat!("#[", "ignore");
    let text = format!(
        "#[test]\n{mark} = \"{FOR_ANOTHER}\"]\nfn a() {{}}\n#[test]\n{mark}]\nfn b() {{}}\n\
         #[test]\n{mark} = \"minutes\"]\nfn c() {{}}\n"
    );
    assert_eq!(left_out(&text), ["b", "c"]);
}

/// Compilers have their own tests like this one, where they are used.
#[test]
fn a_missing_compiler_is_named() {
    let test = "foreign::an_exception_is_a_defect_of_the_law";
    tests::needs::assert_named(test, "`c++`");
}

#[test]
fn missing_valgrind_is_named() {
    for (variable, passes) in [(None, true), (Some("PILUM_REQUIRE_ALL"), false)] {
        let output = Command::new("/bin/sh")
            .arg(repository("tests/memory.sh"))
            .env("PATH", "")
            .env_remove("CI")
            .env_remove("PILUM_REQUIRE_ALL")
            .envs(variable.map(|name| (name, "1")))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), passes, "{said}");
        assert!(said.contains("valgrind is missing"), "{said}");
    }
}
