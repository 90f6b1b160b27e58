//! Crates built into the program, and code that may break the rules of memory: licences and sources
//! of all crates as `deny.toml` wants them, and `unsafe` where it may live, counted.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::words::rows_of;

/// Places that may have `unsafe`, and their purpose. A folder has the name of the file it belongs to.
const UNSAFE: &str = "
abi/src/raw.rs | types of C functions
abi/src/access.rs | points, messages and texts in memory of the host
abi/src/export.rs | the entry of a library, written by a macro
abi/src/export | tests of that entry
abi/bridges/src | the same law as UMAT, for MFront, for CalculiX
host/runs/src/memory.rs | the allocator, which ends the program with a message
host/law/src/process/child/copy.rs | the copy of the program that calls laws, made before there is a second thread
host/law/src/library.rs | opening libraries
host/law/src/library | descriptions and calls of laws, foreign routines, memory shared with workers, calls of `pilum check`
tests/fuzz/src/description.rs | descriptions from random bytes
";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All packages that any build of the workspace may need, as cargo tells it.
fn packages() -> Vec<Value> {
    let metadata = |more: &[&str], crates: &str| {
        let arguments = [&["metadata", "--format-version", "1"], more].concat();
        tests::needs::of_cargo(&root(), &arguments, crates)
    };
    // Without a network, those of this platform.
    let platform = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let found = metadata(&["--all-features"], "some crate of another platform")
        .or_else(|| metadata(&["--filter-platform", &platform], "some crate"));
    let Some(found) = found else {
        panic!("`cargo metadata --locked` fails: is Cargo.lock up to date?");
    };
    let mut found: Value = serde_json::from_str(&found).unwrap();
    let Value::Array(packages) = found["packages"].take() else {
        panic!("no packages");
    };
    packages
}

/// Whether an SPDX expression can be met with licences that are allowed.
fn is_met(expression: &str, allowed: &dyn Fn(&str) -> bool) -> bool {
    // `/` is how `OR` was written once. `AND` binds more tightly.
    let text = expression.replace('/', " OR ");
    let text = text.replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = text.split_whitespace().collect();
    let (met, rest) = any(&words, allowed);
    assert!(rest.is_empty(), "`{expression}` is no SPDX expression");
    met
}

fn any<'a, 'b>(words: &'a [&'b str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'b str]) {
    let (mut met, mut rest) = all(words, allowed);
    while let ["OR", after @ ..] = rest {
        let (other, after) = all(after, allowed);
        (met, rest) = (met | other, after);
    }
    (met, rest)
}

fn all<'a, 'b>(words: &'a [&'b str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'b str]) {
    let (mut met, mut rest) = one(words, allowed);
    while let ["AND", after @ ..] = rest {
        let (other, after) = one(after, allowed);
        (met, rest) = (met & other, after);
    }
    (met, rest)
}

fn one<'a, 'b>(words: &'a [&'b str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'b str]) {
    match words {
        ["(", inner @ ..] => match any(inner, allowed) {
            (met, [")", rest @ ..]) => (met, rest),
            (_, rest) => (false, rest),
        },
        [licence, "WITH", exception, rest @ ..] => {
            (allowed(&format!("{licence} WITH {exception}")), rest)
        }
        [licence, rest @ ..] => (allowed(licence), rest),
        [] => (false, words),
    }
}

#[test]
fn licences_and_sources_are_those_of_deny_toml() {
    let rules = std::fs::read_to_string(root().join("deny.toml")).unwrap();
    let rules: toml::Table = rules.parse().unwrap();
    let texts = |value: &toml::Value| -> Vec<String> {
        let entries = value.as_array().unwrap().iter();
        entries
            .map(|text| text.as_str().unwrap().to_owned())
            .collect()
    };
    let licences = texts(&rules["licenses"]["allow"]);
    let exceptions = rules["licenses"]["exceptions"].as_array().unwrap();
    let registries = texts(&rules["sources"]["allow-registry"]);
    let mut wrong = Vec::new();
    let packages = packages();
    for package in &packages {
        let name = package["name"].as_str().unwrap();
        let licence = package["license"].as_str().unwrap_or("none");
        let exception = exceptions
            .iter()
            .find(|e| e["crate"].as_str() == Some(name));
        let exception = exception.map(|e| texts(&e["allow"])).unwrap_or_default();
        let allowed = |one: &str| licences.iter().chain(&exception).any(|other| other == one);
        if !is_met(licence, &allowed) {
            wrong.push(format!("{name}: licence {licence}"));
        }
        // A member of the workspace has no source.
        if let Some(source) = package["source"].as_str() {
            let from = |registry: &String| source == format!("registry+{registry}");
            if !registries.iter().any(from) {
                wrong.push(format!("{name}: source {source}"));
            }
        } else {
            let registered = |d: &&Value| !d["source"].is_null() && d["req"] == "*";
            let dependencies = package["dependencies"].as_array().unwrap();
            let any_version = dependencies.iter().filter(registered);
            wrong.extend(any_version.map(|d| format!("{name}: any version of {}", d["name"])));
        }
    }
    assert!(packages.len() > 100, "only {} packages", packages.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Requirements of `cargo package`: the crates have names of ours, all that a registry asks for, and no part
/// outside their folder.
#[test]
fn crates_can_be_packaged() {
    let output = Command::new(env!("CARGO"))
        .args(["package", "--no-verify", "--allow-dirty", "--offline"])
        .arg("--target-dir")
        .arg(concat!(env!("CARGO_TARGET_TMPDIR"), "/packages"))
        .current_dir(root())
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("warning"), "{said}");
    let packed = said
        .lines()
        .filter_map(|line| line.trim().strip_prefix("Packaging "));
    let packed: Vec<&str> = packed.collect();
    assert!(packed.len() > 15, "{said}");
    for package in packed {
        let (name, rest) = package.split_once(' ').unwrap();
        assert!(name == "pilum" || name.starts_with("pilum-"), "{name}");
        let (_, folder) = rest.split_once('(').unwrap();
        let folder = Path::new(folder.trim_end_matches(')'))
            .canonicalize()
            .unwrap();
        let mut files = Vec::new();
        sources(&folder, &mut files);
        for file in files {
            for inner in included(&std::fs::read_to_string(&file).unwrap()) {
                let path = file.parent().unwrap().join(&inner);
                let is_within = path
                    .canonicalize()
                    .is_ok_and(|path| path.starts_with(&folder));
                assert!(is_within, "{}: {inner} is not in the crate", file.display());
            }
        }
    }
}

/// Paths in `include_str!("…")` and `#[path = "…"]`.
fn included(text: &str) -> Vec<String> {
    let after = ["include_str!(\"", "include_bytes!(\"", "#[path = \""];
    let found = after.iter().flat_map(|start| text.split(start).skip(1));
    found
        .map(|rest| rest.split('"').next().unwrap().to_owned())
        .collect()
}

#[test]
fn what_lies_outside_a_crate_is_found() {
    let text =
        "const A: &str = include_str!(\"../../abi/README.md\");\n#[path = \"a/b.rs\"]\nmod b;";
    assert_eq!(included(text), ["../../abi/README.md", "a/b.rs"]);
}

#[test]
fn expressions_of_licences_are_understood() {
    let mit = |one: &str| one == "MIT";
    for (expression, met) in [
        ("MIT", true),
        ("Apache-2.0/MIT", true),
        ("GPL-3.0-only", false),
        ("GPL-3.0-only OR MIT", true),
        ("GPL-3.0-only AND MIT", false),
        ("(MIT OR Apache-2.0) AND NCSA", false),
        ("MIT WITH LLVM-exception OR MIT", true),
        ("Zlib AND ISC OR MIT", true),
    ] {
        assert_eq!(is_met(expression, &mit), met, "{expression}");
    }
}

/// Rust sources below a folder, but not what cargo has built.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

/// How often code says `unsafe`: blocks, functions, implementations, attributes. Comments and the
/// texts of reasons are no code.
fn count(text: &str) -> usize {
    let code = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(line));
    let in_code = |line: &str| {
        let outside = line.split('"').step_by(2);
        let words = outside.flat_map(|part| part.split(|c: char| !c.is_alphanumeric() && c != '_'));
        words.filter(|word| *word == "unsafe").count()
    };
    code.map(in_code).sum()
}

/// The table between two marks of `tests/README.md`: written with `PILUM_BLESS=1`, else compared.
#[test]
fn unsafe_code_is_confined_and_counted() {
    let root = root();
    let mut found = Vec::new();
    for folder in ["abi", "host", "models", "tests"] {
        sources(&root.join(folder), &mut found);
    }
    let places = rows_of::<2>(UNSAFE);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut elsewhere = Vec::new();
    for path in &found {
        let n = count(&std::fs::read_to_string(path).unwrap());
        let within = |place: &&[&str; 2]| path.starts_with(root.join(place[0]));
        match places.iter().find(within) {
            Some([place, _]) => *counts.entry(place).or_default() += n,
            None if n > 0 => elsewhere.push(format!("{}: {n}", path.display())),
            None => {}
        }
    }
    assert!(
        elsewhere.is_empty(),
        "`unsafe` outside its places: {}",
        elsewhere.join(", ")
    );
    let mut table = "\n| where | what for | `unsafe` |\n|---|---|---|\n".to_owned();
    for [place, purpose] in places {
        let n = counts.get(place).copied().unwrap_or(0);
        writeln!(table, "| `{place}` | {purpose} | {n} |").unwrap();
    }
    writeln!(table, "| all | | {} |", counts.values().sum::<usize>()).unwrap();

    let page = root.join("tests/README.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let (begin, end) = ("<!-- unsafe: begin -->", "<!-- unsafe: end -->");
    let begin = text.find(begin).unwrap() + begin.len();
    let end = text.find(end).unwrap();
    if std::env::var_os("PILUM_BLESS").is_some() {
        let text = format!("{}{table}{}", &text[..begin], &text[end..]);
        std::fs::write(&page, text).unwrap();
    } else {
        assert_eq!(&text[begin..end], table, "PILUM_BLESS=1 writes the table");
    }
}
