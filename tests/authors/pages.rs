//! The tutorials and how-to pages of `host/docs` are sessions: what they show is typed, and what they
//! say comes out is compared. A page is one session in one folder, from its top to its bottom, with the program and the
//! page of an unpacked archive, and no repository.
//!
//! - A block of `toml`, `python` or another language whose first line is a comment that is a file
//!   name, `# case.toml`, is that file. `# case.toml, continued` goes on with it.
//! - A `toml` block without a name is a part of a case, driver file or calibration, and follows its schema.
//! - A `diff` block after a line `--- NAME` changes that file.
//! - A `console` block: a line `$ …` is run, the lines below are what it prints, on either stream.
//!   `…` alone stands for lines left out, in a line for anything. Numbers are compared to the digits
//!   shown. A command ends with exit code 0, or with the one that `$ echo $?` shows next.
//! - A `text` block is neither run nor compared.
//!
//! Remarks at the top of a page: `<!-- needs: gfortran -->` skips it if that program is missing.
//! With `<!-- files of: how-to/slice.md -->` the files of that page exist from the start; with `<!--
//! has: tutorial/my_pile.msh -->` this file of the cases does.
//!
//! A picture `![…](…/RUN/NAME.svg)` is `results/RUN/NAME.svg` at the end of the page; `PILUM_BLESS=1` rewrites it.

use crate::compilers::repository;
use crate::program::pilum;
use crate::validator::Validator;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;
use tests::figure::{alike, bless};
use tests::place::Place;
use tests::words::has;

/// A fenced block of a page.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) language: String,
    /// Line of its first line, from 1.
    pub(crate) line: usize,
    pub(crate) text: String,
}

/// The fenced blocks of a page, in order.
pub(crate) fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_open = false;
    for (number, line) in page.lines().enumerate() {
        if let Some(language) = line.strip_prefix("```") {
            if !is_open {
                blocks.push(Block {
                    language: language.to_owned(),
                    line: number + 2,
                    text: String::new(),
                });
            }
            is_open = !is_open;
        } else if is_open {
            let block = blocks.last_mut().unwrap();
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    assert!(!is_open, "a block is not closed");
    blocks
}

/// The number at the start of a text: how long it is, its value, and the unit of its last digit.
fn number(text: &str) -> Option<(usize, f64, f64)> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let mut length = text.len() - text.trim_start_matches(['-', '+', '−']).len();
    let sign = length;
    let whole = digits(&text[length..]);
    length += whole;
    let mut decimals = 0;
    if text[length..].starts_with('.') {
        decimals = digits(&text[length + 1..]);
        if decimals > 0 {
            length += 1 + decimals;
        }
    }
    if whole == 0 || sign > '−'.len_utf8() {
        return None;
    }
    let mut exponent = 0;
    if let Some(rest) = text[length..].strip_prefix('e') {
        let minus = usize::from(rest.starts_with('-'));
        let n = digits(&rest[minus..]);
        if n > 0 {
            exponent = rest[..minus + n].parse().unwrap();
            length += 1 + minus + n;
        }
    }
    let value = text[..length].replace('−', "-").parse().ok()?;
    let is_whole = decimals == 0 && exponent == 0;
    let unit = if is_whole {
        0.0
    } else {
        10_f64.powi(exponent - i32::try_from(decimals).unwrap())
    };
    Some((length, value, unit))
}

/// Whether a line is what a page shows.
fn fits(shown: &str, printed: &str) -> bool {
    let Some(first) = shown.chars().next() else {
        return printed.is_empty();
    };
    if first == '…' {
        let rest = &shown[first.len_utf8()..];
        let mut ends = printed.char_indices().map(|(at, _)| at);
        return ends.any(|at| fits(rest, &printed[at..])) || fits(rest, "");
    }
    if let (Some((n, value, unit)), Some((m, other, _))) = (number(shown), number(printed)) {
        // A last digit may be rounded otherwise elsewhere; of 17 digits the last ones mean nothing.
        let within = (1.001 * unit).max(if unit > 0.0 { 1e-9 * value.abs() } else { 0.0 });
        return (value - other).abs() <= within && fits(&shown[n..], &printed[m..]);
    }
    printed
        .strip_prefix(first)
        .is_some_and(|rest| fits(&shown[first.len_utf8()..], rest))
}

/// Whether lines are what a page shows.
fn all_fit(shown: &[String], printed: &[String]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((first, rest)) if first == "…" => {
            (0..=printed.len()).any(|at| all_fit(rest, &printed[at..]))
        }
        Some((first, rest)) => printed
            .split_first()
            .is_some_and(|(line, others)| fits(first, line) && all_fit(rest, others)),
    }
}

/// Lines with one space for many and none at the end, without empty ones.
fn squeezed<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<String> {
    lines
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .filter(|line| !line.is_empty())
        .collect()
}

/// A page while it is followed.
struct Session<'a> {
    page: &'a str,
    place: Place,
    case: Validator,
    point: Validator,
    calibration: Validator,
    commands: usize,
}

impl Session<'_> {
    /// Does what a block says.
    fn follow(&mut self, block: &Block) {
        let at = format!("{}, line {}", self.page, block.line);
        let first = block.text.lines().next().unwrap_or_default();
        match block.language.as_str() {
            "console" => self.type_in(&at, &block.text),
            "diff" => self.change(&at, &block.text),
            "text" => {}
            "" | "sh" => panic!("{at}: of what kind is this block?"),
            _ => {
                let name = first.trim_start_matches(['#', '/', '!', ' ', '*']);
                let (name, goes_on) = match name.strip_suffix(", continued") {
                    Some(name) => (name, true),
                    None => (name, false),
                };
                let is_name = name.contains('.') && !name.contains([' ', '=', '[']);
                if is_name {
                    let path = self.place.work().join(name);
                    fs::create_dir_all(path.parent().unwrap()).unwrap();
                    let before = if goes_on {
                        fs::read_to_string(&path).unwrap_or_else(|why| panic!("{at}: {why}"))
                    } else {
                        String::new()
                    };
                    fs::write(path, before + &block.text).unwrap();
                } else {
                    assert_eq!(block.language, "toml", "{at}: which file is this?");
                    self.hold_against_schema(&at, &block.text);
                }
            }
        }
    }

    /// A part of a file has no keys that its schema does not know.
    fn hold_against_schema(&self, at: &str, text: &str) {
        let table: toml::Table = toml::from_str(text).unwrap_or_else(|why| panic!("{at}: {why}"));
        let mut value = serde_json::to_value(table).unwrap();
        let table = value.as_object_mut().unwrap();
        table
            .entry("base")
            .or_insert_with(|| Value::from("other.toml"));
        let (cases, points) = (self.case.errors(&value), self.point.errors(&value));
        let is_calibration = self.calibration.errors(&value).is_empty();
        let follows = cases.is_empty() || points.is_empty() || is_calibration;
        assert!(
            follows,
            "{at}: as a case {cases:#?}, as a driver {points:#?}"
        );
    }

    /// Replaces the lines of a file that a `diff` block shows.
    fn change(&self, at: &str, text: &str) {
        let name = text
            .lines()
            .next()
            .and_then(|line| line.strip_prefix("--- "));
        let name = name.unwrap_or_else(|| panic!("{at}: of which file?"));
        let path = self.place.work().join(name);
        let (mut old, mut new) = (String::new(), String::new());
        for line in text.lines().skip(1) {
            let (mark, line) = line.split_at(line.len().min(1));
            if mark != "+" {
                old = old + line + "\n";
            }
            if mark != "-" {
                new = new + line + "\n";
            }
        }
        let whole = fs::read_to_string(&path).unwrap();
        assert_eq!(
            whole.matches(&old).count(),
            1,
            "{at}: these lines, once, in\n{whole}"
        );
        fs::write(path, whole.replacen(&old, &new, 1)).unwrap();
    }

    /// Runs the commands of a block, and compares what they print.
    fn type_in(&mut self, at: &str, text: &str) {
        let mut parts = text.split_inclusive('\n').peekable();
        let mut code = 0;
        while let Some(line) = parts.next() {
            let Some(command) = line.strip_prefix("$ ") else {
                panic!("{at}: {line:?} comes before a command");
            };
            let command = command.trim_end();
            let mut shown = String::new();
            while let Some(line) = parts.next_if(|line| !line.starts_with("$ ")) {
                shown.push_str(line);
            }
            if command == "echo $?" {
                assert_eq!(shown.trim(), code.to_string(), "{at}: exit code");
                code = 0;
                continue;
            }
            assert_eq!(code, 0, "{at}: what comes before `{command}`");
            self.commands += 1;
            let outcome = self.place.shell("", &format!("{{ {command}\n}} 2>&1"));
            code = outcome.code.unwrap();
            let (shown, printed) = (squeezed(shown.lines()), squeezed(outcome.stdout.lines()));
            assert!(
                all_fit(&shown, &printed),
                "{at}: `{command}` shows\n{}\nprints\n{}",
                shown.join("\n"),
                outcome.stdout
            );
        }
        assert_eq!(code, 0, "{at}: the last command");
    }
}

fn validator(kind: &str) -> Validator {
    let place = TempDir::new().unwrap();
    let outcome = pilum(place.path(), &["schema", kind]);
    Validator::new(serde_json::from_str(&outcome.stdout).unwrap())
}

/// What the remarks at the top of a page name.
fn remarks<'a>(page: &'a str, kind: &str) -> impl Iterator<Item = &'a str> {
    let prefix = format!("<!-- {kind}: ");
    let lines = page.lines().take_while(|line| line.starts_with("<!--"));
    lines.filter_map(move |line| line.strip_prefix(&prefix)?.strip_suffix(" -->"))
}

/// Follows a page of `host/docs`; how many commands were typed.
fn follow(name: &str) -> usize {
    let place = Place::new();
    let docs = place.prefix.join("share/doc/pilum/host/docs");
    let read = |name: &str| fs::read_to_string(docs.join(name)).unwrap();
    let text = read(name);
    for program in remarks(&text, "needs") {
        if tests::needs::output(Command::new(program).arg("--version")).is_none() {
            return 0;
        }
    }
    let mut session = Session {
        page: name,
        place,
        case: validator("case"),
        point: validator("point"),
        calibration: validator("calibration"),
        commands: 0,
    };
    let work = session.place.work();
    let cases = session.place.prefix.join("share/pilum/cases");
    for other in remarks(&text, "files of") {
        for block in blocks(&read(other))
            .iter()
            .filter(|block| block.language == "toml")
        {
            session.follow(block);
        }
    }
    for file in remarks(&text, "has") {
        let to = Path::new(file).file_name().unwrap();
        let from = cases.join(file);
        fs::copy(from, work.join(to)).unwrap();
    }
    for block in blocks(&text) {
        session.follow(&block);
    }
    for picture in pictures(&text) {
        let shown = repository("host/docs").join(name).with_file_name(picture);
        let parts: Vec<&str> = picture.rsplitn(3, '/').collect();
        let drawn = work.join("results").join(parts[1]).join(parts[0]);
        let drawn = fs::read_to_string(&drawn).unwrap_or_else(|why| panic!("{picture}: {why}"));
        if bless() {
            fs::write(shown, drawn).unwrap();
        } else {
            let is_drawn = alike(&fs::read_to_string(&shown).unwrap_or_default(), &drawn);
            assert!(is_drawn, "{name}: {picture} is not what its run draws");
        }
    }
    session.commands
}

/// Pictures of a page that a run draws.
fn pictures(page: &str) -> impl Iterator<Item = &str> {
    let after = page.split("![").skip(1);
    let targets = after.filter_map(|text| text.split_once("](")?.1.split_once(')'));
    let targets = targets.map(|(target, _)| target);
    targets.filter(|target| !target.contains("cases/"))
}

#[test]
fn the_tutorial_is_followed() {
    assert!(follow("tutorial.md") >= 10);
}

/// Builds a law with cargo.
#[test]
fn the_tutorial_of_a_law_is_followed() {
    assert!(follow("tutorial-law.md") >= 6);
}

/// One test for each how-to page, so that a failure names it.
macro_rules! how_to {
    ($($test:ident: $page:literal,)*) => {
        $(#[test]
        fn $test() {
            follow(concat!("how-to/", $page, ".md"));
        })*

        #[test]
        fn every_how_to_page_is_followed() {
            let entries = fs::read_dir(repository("host/docs/how-to")).unwrap();
            let pages = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
            let pages: BTreeSet<String> = pages.collect();
            let followed: BTreeSet<String> = [$(concat!($page, ".md").to_owned()),*].into();
            assert_eq!(pages, followed);
        }
    };
}

how_to! {
    how_to_install: "install",
    how_to_lead_a_law_alone: "law-at-a-point",
    how_to_compute_a_slice: "slice",
    how_to_swap_a_law: "swap-a-law",
    how_to_make_a_mesh: "mesh",
    how_to_take_a_mesh_of_gmsh: "gmsh",
    how_to_make_many_runs: "study",
    how_to_resume: "resume",
    how_to_compare_variants: "compare-variants",
    how_to_set_from_the_command_line: "set-from-the-command-line",
    how_to_use_a_umat: "use-a-umat",
    how_to_use_a_udsm: "use-a-udsm",
    how_to_use_an_mfront_behaviour: "use-an-mfront-behaviour",
    how_to_make_an_interface_law: "shear-zone",
    how_to_choose_an_integration: "which-integration",
    how_to_converge: "why-does-it-not-converge",
    how_to_read_results: "read-results",
    how_to_calibrate: "calibrate",
    how_to_choose_an_accuracy: "choose-accuracy",
    how_to_get_forces: "forces",
    how_to_get_a_pile: "pile",
    how_to_compute_a_pile_by_load_transfer: "tz-pile",
    how_to_debug_a_law: "debug-a-law",
    how_to_come_from_other_programs: "coming-from",
    how_to_exchange_cases: "exchange",
}

/// Columns of tables are those that a run writes.
#[test]
fn files_of_results_are_those_described() {
    assert!(follow("reference/results.md") >= 8);
}

/// A page says at its top what it is for and for whom.
#[test]
fn every_page_says_what_it_is_for() {
    let mut pages = Vec::new();
    tests::links::pages(&repository("host/docs"), &mut pages);
    for path in pages {
        let text = fs::read_to_string(&path).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with("<!--"));
        let top = lines.take(10).collect::<Vec<_>>().join("\n");
        let mut paragraphs = top.split("\n\n");
        let title = paragraphs.next().unwrap();
        assert!(title.starts_with("# "), "{}: {title}", path.display());
        let purpose = paragraphs.next().unwrap();
        let says = purpose.starts_with("*For ") && purpose.ends_with('*');
        assert!(says, "{}: no `*For … .*` below its title", path.display());
    }
}

#[test]
fn lines_are_compared_as_a_reader_would() {
    for (shown, printed) in [
        ("a b", "a b"),
        ("in …", "in 3.2 s"),
        ("of …/libmepi.so, x", "of /usr/lib/libmepi.so, x"),
        ("7.002e1", "7.0020753820970725e1"),
        ("70.02", "7.002075e1"),
        ("increment 1/5", "increment 1/5"),
        ("τ − 0.50", "τ − 0.499"),
        ("…", ""),
    ] {
        assert!(fits(shown, printed), "{shown} is not {printed}");
    }
    for (shown, printed) in [
        ("a b", "a c"),
        ("7.002e1", "7.0040753820970725e1"),
        ("increment 1/5", "increment 1/6"),
        ("0.5", "5"),
        ("-1.0", "1.0"),
        ("in …s", "in 3 m"),
        ("a", ""),
    ] {
        assert!(!fits(shown, printed), "{shown} is {printed}");
    }
    let lines = |text: &str| squeezed(text.lines());
    assert!(all_fit(&lines("a\n…\nd\n"), &lines("a\nb\n\nc\nd")));
    assert!(!all_fit(&lines("a\n…\nd\n"), &lines("a\nb\nc\n")));
    assert!(!all_fit(&lines("a\n"), &lines("a\nb\n")));
}

/// A page that is wrong is found out: a number, a line, an exit code.
#[test]
fn mistakes_of_a_page_are_found() {
    let follow = |text: &str| {
        let mut session = Session {
            page: "a page",
            place: Place::new(),
            case: validator("case"),
            point: validator("point"),
            calibration: validator("calibration"),
            commands: 0,
        };
        for block in blocks(text) {
            session.follow(&block);
        }
    };
    follow("```console\n$ printf 'a 1.25\\nb\\n'; false\na 1.3\n…\n$ echo $?\n1\n```\n");
    follow("```toml\n[solver]\nmethod = \"newton\"\n```\n");
    follow(
        "```toml\n# a.toml\nx = 1\n```\n```diff\n--- a.toml\n-x = 1\n+x = 2\n```\n```console\n$ tail -n 1 a.toml\nx = 2\n```\n",
    );
    for text in [
        "```console\n$ echo 1.25\n1.35\n```\n",
        "```console\n$ echo a\nb\n```\n",
        "```console\n$ false\n```\n",
        "```console\n$ true\n$ echo $?\n1\n```\n",
        "```toml\n[solver]\nmetod = \"newton\"\n```\n",
        "```sh\ntrue\n```\n",
    ] {
        assert!(std::panic::catch_unwind(|| follow(text)).is_err(), "{text}");
    }
}

#[test]
fn every_link_leads_somewhere() {
    let (links, broken) = tests::links::followed(&repository(""));
    assert!(links > 100, "{links} links");
    assert!(broken.is_empty(), "{broken:#?}");
}

/// Every file of `host/docs` is reached from its map.
#[test]
fn the_map_names_every_page() {
    let host = repository("host");
    let map = fs::read_to_string(host.join("README.md")).unwrap();
    assert!(map.lines().count() <= 150, "{} lines", map.lines().count());
    let mut pages = Vec::new();
    tests::links::pages(&host.join("docs"), &mut pages);
    for page in pages {
        let page: &Path = page.strip_prefix(&host).unwrap();
        let name = page.to_str().unwrap().to_owned();
        has(&map, format!("({name})"));
    }
}
