//! No decision of the program depends on a sentence: it reads no message, ours or another crate's, to find out what
//! happened. Errors and warnings are told apart as data, by their kind, code or field.

use crate::compilers::repository;
use std::fs;
use std::path::{Path, PathBuf};
use tests::words::words;

/// Methods that look into a text.
const LOOKS: &str = "contains starts_with ends_with strip_prefix strip_suffix split_once find eq";

/// Names of messages, as variables, fields and methods have them.
const MESSAGES: &str = "description error help hint message reason refusal said says sentence stderr warning warnings what why words";

/// Files that may, with the reason.
const ALLOWED: [(&str, &str); 1] = [(
    "host/workshop/src/replay/probed.rs",
    "compares what a replay in a child process printed, which has no other way out of it",
)];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            if !["target", "tests", "benches"].contains(&name) && !name.starts_with('.') {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|kind| kind == "rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// Production code, chains of calls on one line each: without unit tests and comments.
fn production(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or(text);
    let lines = code.lines().map(str::trim);
    let lines = lines.filter(|line| !line.starts_with("//"));
    lines.collect::<Vec<_>>().join("\n").replace("\n.", ".")
}

/// The names in the chain of fields and calls that ends here.
fn chain(before: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_alphanumeric() || "_.()?&*".contains(c);
    let start = before.trim_end_matches(is_part).len();
    let names = before[start..].split(|c: char| !(c.is_alphanumeric() || c == '_'));
    names.filter(|name| !name.is_empty())
}

/// Lines that look for words in a message.
fn decisions(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut look = |at: usize| {
        if chain(&code[..at]).any(|name| words(MESSAGES).contains(&name)) {
            let start = code[..at].rfind('\n').map_or(0, |end| end + 1);
            found.extend(code[start..].lines().next());
        }
    };
    for method in words(LOOKS) {
        for (at, _) in code.match_indices(&format!(".{method}(\"")) {
            look(at);
        }
    }
    // A single word is a code.
    for (at, compared) in code
        .match_indices(" == \"")
        .chain(code.match_indices(" != \""))
    {
        let word = code[at + compared.len()..].split('"').next();
        if word.is_some_and(|word| word.contains(' ')) {
            look(at);
        }
    }
    found
}

#[test]
fn no_decision_depends_on_a_sentence() {
    let mut files = Vec::new();
    for folder in ["abi", "host", "models"] {
        sources(&repository(folder), &mut files);
    }
    files.sort();
    let mut found = Vec::new();
    for file in &files {
        let name = file.strip_prefix(repository("")).unwrap();
        let name = name.to_str().unwrap().replace('\\', "/");
        if ALLOWED.iter().any(|(allowed, _)| *allowed == name) {
            continue;
        }
        let code = production(&fs::read_to_string(file).unwrap());
        found.extend(
            decisions(&code)
                .iter()
                .map(|line| format!("{name}: {line}")),
        );
    }
    assert!(
        found.is_empty(),
        "these look for words in a message; make it data (a kind, a code, a field), or allow the file with a reason:\n{}",
        found.join("\n")
    );
}

#[test]
fn looks_into_messages_are_found() {
    let found = |code: &str| decisions(&production(code)).len();
    assert_eq!(found("if error.to_string().contains(\"twice\") {"), 1);
    assert_eq!(
        found("let rest = error\n    .message()\n    .trim()\n    .strip_prefix(\"unknown \")?;"),
        1
    );
    assert_eq!(
        found("why.starts_with(\"there is\") || self.hint == \"leave it\""),
        2
    );
    assert_eq!(
        found("name.starts_with(\"lib\") && path.ends_with(\".so\") && what == \"doc\""),
        0
    );
    assert_eq!(
        found("// error.contains(\"x\")\n#[cfg(test)]\nmod tests {\n why.contains(\"y\");"),
        0
    );
}
