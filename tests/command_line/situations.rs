//! Mistakes of an engineer with the pile of the tutorial, and the sentences that they get.
//!
//! Goal        every mistake is named in an engineer's words; no first sentence is longer than 35 words.
//! Set-up      my_pile.toml of the tutorial with one overlay each, `fixtures/situations.toml`.
//! Asserts     exit code and messages. The tutorial's own case gets no warning.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{DONE, Outcome, Place};
use toml::{Table, Value};

/// Longest first sentence of a message, in words.
const LONGEST: usize = 35;

/// The tutorial's case: its blocks in the order of the page.
fn my_pile() -> String {
    let tutorial = concat!(env!("CARGO_MANIFEST_DIR"), "/../host/docs/tutorial.md");
    let page = std::fs::read_to_string(tutorial).unwrap();
    let blocks = page.split("```toml\n").skip(1);
    let blocks = blocks.filter_map(|block| block.split("```").next());
    blocks
        .filter(|block| block.starts_with("# my_pile.toml"))
        .collect()
}

fn tried(overlay: &str, dry: bool) -> Outcome {
    let place = Place::new();
    let mesh = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host/docs/tutorial/my_pile.msh"
    );
    place.write("my_pile.msh", std::fs::read(mesh).unwrap());
    place.write("my_pile.toml", my_pile());
    place.write("case.toml", format!("base = \"my_pile.toml\"\n{overlay}"));
    let arguments = ["run", "case.toml", "--out", "out", "--dry-run"];
    place.run(if dry { &arguments } else { &arguments[..4] })
}

/// First sentences of messages that are longer than they may be.
fn long(outcome: &Outcome) -> Vec<String> {
    let lines = outcome.stderr.lines();
    let messages = lines.filter_map(|line| {
        let kinds = ["error: ", "warning: ", "pile: "];
        kinds.iter().find_map(|kind| line.strip_prefix(kind))
    });
    let first = messages.filter_map(|message| message.split_inclusive(". ").next());
    let long = first.filter(|sentence| sentence.split_whitespace().count() > LONGEST);
    long.map(str::to_owned).collect()
}

#[test]
fn the_case_of_the_tutorial_gets_no_warning() {
    let outcome = tried("", true).ended(DONE);
    assert!(!outcome.stderr.contains("warning"), "{}", outcome.stderr);
}

#[test]
fn mistakes_get_the_sentence_of_the_table() {
    let table = include_str!("fixtures/situations.toml");
    let table: Table = toml::from_str(table).unwrap();
    let situations = table["situation"].as_array().unwrap();
    assert!(situations.len() >= 60, "{}", situations.len());
    let mut wrong = Vec::new();
    for situation in situations {
        let text = |key: &str| situation[key].as_str().unwrap();
        let (name, dry) = (text("name"), situation.get("run").is_none());
        let outcome = tried(text("overlay"), dry);
        let code = outcome.code.map(|code| Value::from(i64::from(code)));
        if code.as_ref() != Some(&situation["code"]) {
            wrong.push(format!("{name}: exit code {code:?}"));
        }
        let both = format!("{}{}", outcome.stderr, outcome.stdout);
        let says = situation["says"].as_array().unwrap().iter();
        let says = says.map(|part| part.as_str().unwrap());
        let missing = says.filter(|part| !both.contains(*part));
        wrong.extend(missing.map(|part| format!("{name}: {part}\n{both}")));
        let long = long(&outcome);
        wrong.extend(long.iter().map(|said| format!("{name}: long: {said}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}
