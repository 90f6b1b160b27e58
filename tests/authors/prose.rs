//! Pages and documentation comments are plain English: the share of sentences with habits of translated
//! English, and of long sentences, stays below a bound.
//!
//! A count shows where to look. The remedy is to rewrite the paragraph, not to swap a word.

use crate::compilers::repository;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of findings in 1000 sentences, of one kind.
const ONE_KIND: f64 = 3.0;
/// The same, of all kinds.
const ALL_KINDS: f64 = 10.0;
/// The same, on the page of the theory.
const IN_THEORY: f64 = 5.0;
/// Words of a long sentence.
const LONG: usize = 35;
/// Largest share of long sentences.
const LONG_SHARE: f64 = 0.015;

struct Sentence {
    place: String,
    text: String,
    words: Vec<String>,
}

struct Kind {
    name: &'static str,
    is_found: fn(&Sentence) -> bool,
}

fn has(sentence: &Sentence, phrases: &[&str]) -> bool {
    let words = sentence.words.join(" ");
    phrases.iter().any(|phrase| {
        words.match_indices(phrase).any(|(at, _)| {
            let end = at + phrase.len();
            (at == 0 || words.as_bytes()[at - 1] == b' ')
                && (end == words.len() || words.as_bytes()[end] == b' ')
        })
    })
}

const KINDS: [Kind; 9] = [
    Kind {
        name: "a clause as the subject (What is ... is ...)",
        is_found: |sentence| {
            let verbs = [
                "is", "are", "has", "have", "stands", "stand", "does", "takes", "costs", "goes",
                "comes",
            ];
            let words = &sentence.words;
            ["what", "who", "whoever", "where", "which"].contains(&words[0].as_str())
                && !sentence.text.contains('?')
                && !(words.len() > 2
                    && ["is", "are"].contains(&words[1].as_str())
                    && words[2] == "the")
                && words[1..].iter().any(|word| verbs.contains(&word.as_str()))
        },
    },
    Kind {
        name: "begins with Of",
        is_found: |sentence| sentence.words[0] == "of" && sentence.words[1] != "course",
    },
    Kind {
        name: "beside (besides, next to, compared with)",
        is_found: |sentence| has(sentence, &["beside"]),
    },
    Kind {
        name: "is none, is not there",
        is_found: |sentence| {
            has(
                sentence,
                &[
                    "is none",
                    "are none",
                    "was none",
                    "has none",
                    "have none",
                    "is not there",
                ],
            )
        },
    },
    Kind {
        name: "so many",
        is_found: |sentence| has(sentence, &["so many", "as many as there are"]),
    },
    Kind {
        name: "is said, is told (is reported, prints)",
        is_found: |sentence| {
            has(
                sentence,
                &[
                    "is said", "are said", "be said", "says so", "is told", "are told",
                ],
            )
        },
    },
    Kind {
        name: "stands in (is in, is documented in)",
        is_found: |sentence| {
            ["in", "at", "on", "there", "beside"].iter().any(|place| {
                has(
                    sentence,
                    &[&format!("stand {place}"), &format!("stands {place}")],
                )
            })
        },
    },
    Kind {
        name: "of its own",
        is_found: |sentence| has(sentence, &["of its own", "of their own"]),
    },
    Kind {
        name: "anew, thereby, whereby, therein, hence",
        is_found: |sentence| {
            has(
                sentence,
                &[
                    "anew", "thereby", "whereby", "therein", "thereof", "whither", "hence",
                ],
            )
        },
    },
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            let is_left_out = ["target", "results", "corpus", "fixtures"].contains(&name);
            if !is_left_out && !name.starts_with('.') {
                files(&path, found);
            }
        } else if matches!(
            path.extension().and_then(|end| end.to_str()),
            Some("md" | "rs")
        ) {
            found.push(path);
        }
    }
}

/// A line of a page or comment without its markers; empty where it is no prose.
fn line_of_prose(line: &str, is_rust: bool, is_code: &mut bool) -> String {
    let trimmed = line.trim();
    let text = if is_rust {
        match trimmed
            .strip_prefix("///")
            .or_else(|| trimmed.strip_prefix("//!"))
        {
            Some(text) => text.trim(),
            None => return String::new(),
        }
    } else {
        trimmed
    };
    if text.starts_with("```") {
        *is_code ^= true;
        return String::new();
    }
    if *is_code || text.starts_with(['|', '#', '<']) || text.starts_with("![") {
        return String::new();
    }
    let number = text.trim_start_matches(|c: char| c.is_ascii_digit());
    let item = ["- ", "* ", "+ "]
        .iter()
        .find_map(|mark| text.strip_prefix(mark));
    item.or_else(|| {
        number
            .strip_prefix(". ")
            .filter(|_| number.len() < text.len())
    })
    .unwrap_or(text)
    .to_owned()
}

/// Text without code and without the targets of links.
fn plain(paragraph: &str) -> String {
    let mut text = String::new();
    for (at, part) in paragraph.split('`').enumerate() {
        text.push_str(if at % 2 == 0 { part } else { "CODE" });
    }
    while let Some(at) = text.find("](") {
        let Some(end) = text[at..].find(')') else {
            break;
        };
        text.replace_range(at..=at + end, "");
        if let Some(open) = text[..at].rfind('[') {
            text.remove(open);
        }
    }
    text
}

fn split(paragraph: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    let mut words = paragraph.split_whitespace().peekable();
    while let Some(word) = words.next() {
        let sentence = sentences.last_mut().unwrap();
        let _ = write!(
            sentence,
            "{}{word}",
            if sentence.is_empty() { "" } else { " " }
        );
        let begins = words
            .peek()
            .is_some_and(|next| next.starts_with(|c: char| c.is_ascii_uppercase() || c == '*'));
        if word.ends_with(['.', '!', '?']) && begins {
            sentences.push(String::new());
        }
    }
    sentences
}

fn words(sentence: &str) -> Vec<String> {
    sentence
        .split(|c: char| !(c.is_ascii_alphabetic() || matches!(c, '\'' | '’' | '-')))
        .filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic()))
        .map(str::to_lowercase)
        .collect()
}

fn sentences(path: &Path, name: &str) -> Vec<Sentence> {
    let text = fs::read_to_string(path).unwrap();
    let is_rust = path.extension().is_some_and(|end| end == "rs");
    let (mut found, mut paragraph, mut start, mut is_code) = (Vec::new(), String::new(), 0, false);
    for (at, line) in text.lines().chain([""]).enumerate() {
        let line = line_of_prose(line, is_rust, &mut is_code);
        if !line.is_empty() {
            start = if paragraph.is_empty() { at + 1 } else { start };
            paragraph = format!("{paragraph} {line}");
            continue;
        }
        for text in split(&plain(&paragraph)) {
            let words = words(&text);
            if words.len() >= 3 {
                found.push(Sentence {
                    place: format!("{name}:{start}"),
                    text,
                    words,
                });
            }
        }
        paragraph.clear();
    }
    found
}

fn tree() -> Vec<Sentence> {
    let root = &repository("");
    let mut paths = Vec::new();
    files(root, &mut paths);
    paths.sort();
    let name = |path: &Path| {
        path.strip_prefix(root)
            .unwrap()
            .to_str()
            .unwrap()
            .replace('\\', "/")
    };
    paths
        .iter()
        .flat_map(|path| sentences(path, &name(path)))
        .collect()
}

/// The findings of a kind, with the first places where they are.
fn report(kind: &str, found: &[&Sentence], of: usize) -> String {
    let mut text = format!("{} of {of} sentences: {kind}\n", found.len());
    for sentence in found.iter().take(40) {
        let _ = writeln!(
            text,
            "  {}: {}",
            sentence.place,
            sentence.text.chars().take(140).collect::<String>()
        );
    }
    text
}

fn share(found: usize, of: usize) -> f64 {
    found as f64 / of as f64
}

#[test]
fn prose_is_plain() {
    let sentences = tree();
    let of = sentences.len();
    assert!(of > 5000, "only {of} sentences were found");
    let (mut all, mut failures) = (0, String::new());
    for kind in &KINDS {
        let found: Vec<&Sentence> = sentences
            .iter()
            .filter(|sentence| (kind.is_found)(sentence))
            .collect();
        all += found.len();
        if 1000.0 * share(found.len(), of) > ONE_KIND {
            failures += &report(kind.name, &found, of);
        }
    }
    let long: Vec<&Sentence> = sentences
        .iter()
        .filter(|sentence| sentence.words.len() > LONG)
        .collect();
    if share(long.len(), of) > LONG_SHARE {
        failures += &report("more than 35 words", &long, of);
    }
    assert!(failures.is_empty(), "{failures}");
    assert!(
        1000.0 * share(all, of) <= ALL_KINDS,
        "{all} findings in {of} sentences"
    );
}

#[test]
fn the_theory_is_short_and_plain() {
    let page = repository("host/docs/THEORY.md");
    assert!(
        fs::metadata(&page).unwrap().len() <= 30_000,
        "at most 30 KB"
    );
    let sentences = sentences(&page, "host/docs/THEORY.md");
    let words: usize = sentences.iter().map(|sentence| sentence.words.len()).sum();
    assert!(
        share(words, sentences.len()) <= 18.0,
        "at most 18 words a sentence"
    );
    let found = |sentence: &&Sentence| KINDS.iter().any(|kind| (kind.is_found)(sentence));
    let found: Vec<&Sentence> = sentences.iter().filter(found).collect();
    let text = report("all kinds", &found, sentences.len());
    assert!(
        1000.0 * share(found.len(), sentences.len()) <= IN_THEORY,
        "{text}"
    );
}

#[test]
fn habits_are_found() {
    let sentence = |text: &str| Sentence {
        place: String::new(),
        text: text.to_owned(),
        words: words(text),
    };
    let found = |text: &str| KINDS.iter().any(|kind| (kind.is_found)(&sentence(text)));
    for text in [
        "What a front leaves to its parent is kept.",
        "Of a symmetric matrix half is read.",
        "It acts beside the stress.",
        "Every such step is said.",
    ] {
        assert!(found(text), "{text}");
    }
    for text in [
        "The parent keeps the Schur complement.",
        "Which is the default?",
        "Of course it does.",
    ] {
        assert!(!found(text), "{text}");
    }
}
