//! The pages of `host/docs/reference`: keys are written from the schemas, commands from their help,
//! checks from the program's list, all with `PILUM_BLESS=1` and compared otherwise. Every key has an example,
//! and every example of a page is run.

mod commands;

use crate::compilers::repository;
use crate::pages::{Block, blocks};
use crate::program::pilum;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tests::links::anchor;

/// What the program puts out.
fn printed(arguments: &[&str]) -> String {
    let place = TempDir::new().unwrap();
    let outcome = pilum(place.path(), arguments).ended(0);
    outcome.stdout
}

fn page(name: &str) -> PathBuf {
    repository("host/docs/reference").join(name)
}

// --- keys ---------------------------------------------------------------------------------------

/// A schema, with the file itself among its definitions.
struct Schema {
    definitions: BTreeMap<String, Value>,
}

impl Schema {
    fn new(kind: &str, root: &str) -> Self {
        let schema: Value = serde_json::from_str(&printed(&["schema", kind])).unwrap();
        let of = schema["$defs"].as_object().unwrap();
        let mut definitions: BTreeMap<String, Value> = of
            .iter()
            // Parts are the same without what is required.
            .filter(|(name, _)| !name.ends_with("Part"))
            .map(|(name, value)| (name.clone(), value.clone()))
            .collect();
        let mut file = schema.clone();
        // A study has neither base nor variants, and is complete as it is.
        if let Some(complete) = definitions.remove("Complete") {
            definitions.remove("Variant");
            file["required"] = complete["required"].clone();
        }
        definitions.insert(root.to_owned(), file);
        Self { definitions }
    }

    /// What a `$ref` names.
    fn named(value: &Value) -> Option<&str> {
        let name = value["$ref"].as_str()?.strip_prefix("#/$defs/").unwrap();
        Some(name.strip_suffix("Part").unwrap_or(name))
    }

    /// Definitions that have keys, each of which wants a table.
    fn tables(&self) -> impl Iterator<Item = &String> {
        let with_keys = self
            .definitions
            .iter()
            .filter(|(_, value)| !value["properties"].is_null());
        with_keys.map(|(name, _)| name)
    }

    /// Labels of a choice, with what they mean.
    fn labels(&self, value: &Value) -> Vec<(String, String)> {
        let Some(value) = Self::named(value).and_then(|name| self.definitions.get(name)) else {
            return Vec::new();
        };
        let label = |choice: &Value| Some((choice["const"].as_str()?.to_owned(), text(choice)));
        let choices = value["oneOf"].as_array().into_iter().flatten();
        choices.filter_map(label).collect()
    }

    /// Values of a key, in words.
    fn kind(&self, value: &Value, places: &BTreeMap<String, String>) -> String {
        if let Some(name) = Self::named(value) {
            if let Some(place) = places.get(name) {
                let what = if name == "Over" {
                    "over the height"
                } else {
                    "table"
                };
                return format!("[{what}]({place})");
            }
            if name == "Variant" {
                return "keys of this file, and `name`".to_owned();
            }
            let definition = &self.definitions[name];
            if let Some(labels) = definition["enum"].as_array() {
                let labels: Vec<_> = labels
                    .iter()
                    .map(|l| format!("`\"{}\"`", l.as_str().unwrap()))
                    .collect();
                return labels.join(", ");
            }
            if let Some(kinds) = definition["anyOf"].as_array() {
                let mut kinds: Vec<_> = kinds.iter().map(|kind| self.kind(kind, places)).collect();
                // A whole number is a number, and values over the height may be points alone.
                kinds.retain(|kind| kind != "whole number");
                if kinds.iter().any(|kind| kind.starts_with("[over")) {
                    kinds.retain(|kind| !kind.starts_with("array"));
                }
                return kinds.join(" or ");
            }
            let labels: Vec<_> = self
                .labels(value)
                .into_iter()
                .map(|(l, _)| format!("`\"{l}\"`"))
                .collect();
            assert!(!labels.is_empty(), "{name} is of no known kind");
            return labels.join(", ");
        }
        match value["type"].as_str() {
            Some("number") => {
                let mut kind = "number".to_owned();
                if let Some(bound) = value["exclusiveMinimum"].as_f64() {
                    write!(kind, " above {bound}").unwrap();
                }
                if let Some(bound) = value["maximum"].as_f64() {
                    write!(kind, ", at most {bound}").unwrap();
                }
                kind
            }
            Some("integer") => match value["minimum"].as_i64() {
                Some(1) => "whole number from 1".to_owned(),
                _ => "whole number".to_owned(),
            },
            Some("string") => "text".to_owned(),
            Some("boolean") => "boolean".to_owned(),
            Some("array") => {
                let of = self.kind(&value["items"], places);
                match (value["maxItems"].as_u64(), of.as_str()) {
                    (Some(2), _) => format!("[{of}, {of}]"),
                    (None, "text" | "whole number") => format!("{of}s"),
                    _ if of.starts_with("[table]") => of.replacen("table", "tables", 1),
                    _ => format!("array: {of}"),
                }
            }
            Some("object") => format!(
                "by name: {}",
                self.kind(&value["additionalProperties"], places)
            ),
            None if value["type"].is_array() => "any value".to_owned(),
            other => panic!("{other:?} in {value}"),
        }
    }

    /// The rows of a definition, each with its key in the schema.
    fn rows(&self, name: &str, places: &BTreeMap<String, String>) -> Vec<(String, Row)> {
        let definition = &self.definitions[name];
        let keys = definition["properties"].as_object().unwrap();
        let required = definition["required"].as_array();
        let mut rows = Vec::new();
        // Choices that the table explains already, by the first key that takes them.
        let mut explained: BTreeMap<&str, &str> = BTreeMap::new();
        for (key, value) in keys {
            // In axisymmetry, another name for the same.
            let other = match key.as_str() {
                "r" if same(keys.get("x"), keys.get("r")) => continue,
                "z" if same(keys.get("y"), keys.get("z")) => continue,
                "x" if same(keys.get("x"), keys.get("r")) => ", `r`",
                "y" if same(keys.get("y"), keys.get("z")) => ", `z`",
                _ => "",
            };
            let (mut takes, mut meaning) = (self.kind(value, places), text(value));
            let labels = self.labels(value);
            match Self::named(value).filter(|_| !labels.is_empty()) {
                Some(choice) if explained.contains_key(choice) => {
                    takes = format!("as `{}`", explained[choice]);
                }
                Some(choice) => {
                    "choice".clone_into(&mut takes);
                    explained.insert(choice, key);
                    for (label, means) in labels {
                        write!(meaning, "<br>`{label}`: {means}").unwrap();
                    }
                }
                None => {}
            }
            let is_required =
                required.is_some_and(|names| names.contains(&Value::from(key.as_str())));
            let is_worth_saying = |default: &&Value| match default {
                Value::Null | Value::Object(_) | Value::Array(_) => false,
                Value::String(text) => !is_required && !text.is_empty(),
                _ => !is_required,
            };
            if let Some(default) = value.get("default").filter(is_worth_saying) {
                write!(takes, " (`{default}`)").unwrap();
            }
            let row = Row {
                keys: format!("`{key}`{other}"),
                is_required,
                takes,
                meaning,
            };
            rows.push((key.clone(), row));
        }
        rows
    }

    /// The table of keys of a definition. `shared`: keys that other pages link to, with their rows and place.
    fn table(
        &self,
        name: &str,
        places: &BTreeMap<String, String>,
        shared: &[(String, Row, &'static str)],
    ) -> String {
        let mut rows: Vec<Row> = Vec::new();
        let mut elsewhere: BTreeMap<&str, Vec<Row>> = BTreeMap::new();
        for (key, row) in self.rows(name, places) {
            let known = shared.iter().find(|(other, there, _)| {
                *other == key && *there == row && !row.is_required && name.ends_with("File")
            });
            match known {
                Some((_, _, place)) => elsewhere.entry(*place).or_default().push(row),
                None => rows.push(row),
            }
        }
        // A row is no longer than a link.
        for alone in elsewhere.values_mut().filter(|rows| rows.len() == 1) {
            rows.append(alone);
        }
        let mut table = "| key | takes | |\n|---|---|---|\n".to_owned();
        let mut merged: Vec<Row> = Vec::new();
        for row in rows {
            match merged.iter_mut().find(|other| other.says_the_same(&row)) {
                Some(other) => write!(other.keys, ", {}", row.keys).unwrap(),
                None => merged.push(row),
            }
        }
        for row in merged {
            let mark = if row.is_required { "**" } else { "" };
            writeln!(
                table,
                "| {mark}{}{mark} | {} | {} |",
                row.keys, row.takes, row.meaning
            )
            .unwrap();
        }
        for (place, rows) in elsewhere.iter().filter(|(_, rows)| !rows.is_empty()) {
            let keys: Vec<_> = rows.iter().map(|row| row.keys.as_str()).collect();
            writeln!(table, "| {} | [as in a case]({place}) | |", keys.join(", ")).unwrap();
        }
        table
    }
}

/// What a table says of keys.
#[derive(PartialEq, Eq)]
struct Row {
    keys: String,
    is_required: bool,
    takes: String,
    meaning: String,
}

impl Row {
    /// Whether it differs from the other in its keys alone.
    fn says_the_same(&self, other: &Self) -> bool {
        (self.is_required, &self.takes, &self.meaning)
            == (other.is_required, &other.takes, &other.meaning)
    }
}

fn same(a: Option<&Value>, b: Option<&Value>) -> bool {
    a.zip(b)
        .is_some_and(|(a, b)| a["description"] == b["description"])
}

/// The description of a key or a choice.
fn text(value: &Value) -> String {
    value["description"]
        .as_str()
        .unwrap_or_default()
        .replace('\n', " ")
}

// --- pages --------------------------------------------------------------------------------------

/// The names of a page's marks `<!-- KIND of NAME -->`, each with its line.
fn marks(text: &str, kind: &str) -> Vec<(usize, String)> {
    let prefix = format!("<!-- {kind} of ");
    let lines = text.lines().enumerate();
    lines
        .filter_map(|(n, line)| {
            let name = line.strip_prefix(&prefix)?.strip_suffix(" -->")?;
            Some((n + 1, name.to_owned()))
        })
        .collect()
}

/// The page with what stands between its marks written again.
fn filled(text: &str, kind: &str, content: impl Fn(&str) -> String) -> String {
    let (mut page, mut rest) = (String::new(), text);
    let begin = format!("<!-- {kind} of ");
    while let Some(at) = rest.find(&begin) {
        let (before, after) = rest.split_at(at);
        let (mark, after) = after.split_once('\n').unwrap();
        let name = &mark[begin.len()..mark.len() - " -->".len()];
        let (_, after) = after.split_once("<!-- end -->").unwrap();
        write!(page, "{before}{mark}\n{}<!-- end -->", content(name)).unwrap();
        rest = after;
    }
    page + rest
}

/// Writes the page, or compares it.
fn bless(path: &Path, text: &str) {
    if std::env::var_os("PILUM_BLESS").is_some() {
        fs::write(path, text).unwrap();
    } else {
        let committed = fs::read_to_string(path).unwrap();
        let differs = committed.lines().zip(text.lines()).find(|(a, b)| a != b);
        assert!(
            committed == text,
            "{} is not what the program says: {differs:?}; rewrite it with\n    \
             PILUM_BLESS=1 cargo test -p tests --release --test authors reference",
            path.display()
        );
    }
}

/// Place of each table: the heading above its mark.
fn places(file: &str, text: &str) -> BTreeMap<String, String> {
    let mut heading = "";
    let mut places = BTreeMap::new();
    for line in text.lines() {
        if line.starts_with('#') {
            heading = line;
        }
        if let Some(name) = line.strip_prefix("<!-- keys of ") {
            let name = name.strip_suffix(" -->").unwrap();
            places.insert(name.to_owned(), format!("{file}#{}", anchor(heading)));
        }
    }
    places
}

/// All schemas, with the page of each.
fn schemas() -> [(Schema, &'static str); 4] {
    [
        (Schema::new("case", "CaseFile"), "case.md"),
        (Schema::new("point", "DriverFile"), "driver.md"),
        (Schema::new("study", "StudyFile"), "study.md"),
        (
            Schema::new("calibration", "CalibrationFile"),
            "calibration.md",
        ),
    ]
}

#[test]
fn keys_are_those_of_the_schemas() {
    let read = |name: &str| fs::read_to_string(page(name)).unwrap();
    let of_cases = places("case.md", &read("case.md"));
    let [(case, _), ..] = schemas();
    let mut of_a_case = Vec::new();
    for (name, place) in [
        ("CaseFile", "case.md#the-file"),
        ("LawInput", "case.md#laws"),
    ] {
        let rows = case.rows(name, &of_cases).into_iter();
        of_a_case.extend(rows.map(|(key, row)| (key, row, place)));
    }
    for (schema, name) in schemas() {
        let text = read(name);
        let mut places = of_cases.clone();
        places.extend(self::places("", &text));
        for table in schema.tables() {
            assert!(places.contains_key(table), "{name} has no keys of {table}");
        }
        let shared = if name == "case.md" {
            &of_a_case[..0]
        } else {
            &of_a_case[..]
        };
        bless(
            &page(name),
            &filled(&text, "keys", |of| schema.table(of, &places, shared)),
        );
    }
}

/// All keys of a value, at any depth.
fn keys(value: &toml::Value, found: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                found.insert(key.clone());
                keys(value, found);
            }
        }
        toml::Value::Array(array) => array.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

/// Whether a row of a table says that a case has this key, too.
fn is_shared(row: &str, key: &str) -> bool {
    row.contains("[as in a case]") && row.contains(&format!("`{key}`"))
}

/// The examples below a table have all of its keys.
#[test]
fn every_key_has_an_example() {
    for (schema, name) in schemas() {
        let text = fs::read_to_string(page(name)).unwrap();
        let examples: Vec<Block> = blocks(&text)
            .into_iter()
            .filter(|b| b.language == "toml")
            .collect();
        let marks = marks(&text, "keys");
        for (number, (line, table)) in marks.iter().enumerate() {
            let end = marks.get(number + 1).map_or(usize::MAX, |(line, _)| *line);
            let mut used = BTreeSet::new();
            for example in examples.iter().filter(|e| (*line..end).contains(&e.line)) {
                let value: toml::Table = toml::from_str(&example.text).unwrap();
                keys(&toml::Value::Table(value), &mut used);
            }
            let known = schema.definitions[table]["properties"].as_object().unwrap();
            let missing: Vec<_> = known
                .keys()
                .filter(|key| !used.contains(*key))
                // Those of a case have their examples there.
                .filter(|key| !text.lines().any(|line| is_shared(line, key)))
                // Another name for x or y.
                .filter(|key| !(["r", "z"].contains(&key.as_str()) && known.contains_key("x")))
                .collect();
            assert!(
                missing.is_empty(),
                "{name}: no example of {missing:?} of {table}"
            );
        }
    }
}

/// Each example is its own file, based on `example.toml` of its page if it has no name.
#[test]
fn every_example_runs() {
    let runs = [
        (&["run"][..], "case.md"),
        (&["point", "--csv", "out.csv"], "driver.md"),
        (&["study", "--anew"], "study.md"),
        (&["calibrate", "--out", "out"], "calibration.md"),
    ];
    for (command, name) in runs {
        let place = TempDir::new().unwrap();
        let text = fs::read_to_string(page(name)).unwrap();
        for table in blocks(&text).iter().filter(|b| b.language == "csv") {
            let name = table.text.lines().next().unwrap();
            let name = name.strip_prefix("# ").unwrap();
            fs::write(place.path().join(name), &table.text).unwrap();
        }
        for mesh in blocks(&text).iter().filter(|b| b.language == "msh") {
            let name = mesh.text.lines().next().unwrap().strip_prefix("# ");
            fs::write(place.path().join(name.unwrap()), &mesh.text).unwrap();
        }
        let mut ran = 0;
        for (number, block) in blocks(&text)
            .iter()
            .filter(|b| b.language == "toml")
            .enumerate()
        {
            // One that has a name is a whole file.
            let first = block.text.lines().next().unwrap();
            let name_of = first
                .strip_prefix("# ")
                .and_then(|name| name.strip_suffix(".toml"));
            let (file, based) = match name_of {
                Some(name) => (format!("{name}.toml"), ""),
                None if name == "study.md" || block.text.contains("base = ") => {
                    (format!("{number}.toml"), "")
                }
                None => (format!("{number}.toml"), "base = \"example.toml\"\n"),
            };
            fs::write(place.path().join(&file), based.to_owned() + &block.text).unwrap();
            // A library of this kind is not there; the keys are held against the schema.
            if block.text.contains("adapter = ") {
                continue;
            }
            // What the studies are of.
            if file == "case.toml" {
                continue;
            }
            // What the tests of a calibration name.
            let is_of_test = ["hypothesis = ", "analysis = "]
                .iter()
                .any(|key| block.text.contains(key));
            if command[0] == "calibrate" && is_of_test {
                continue;
            }
            pilum(place.path(), &[command, &[file.as_str()]].concat()).ended(0);
            ran += 1;
        }
        assert!(ran > 3, "{name}: {ran}");
    }
}

/// The checks, from the program's list.
#[test]
fn checks_are_those_of_the_program() {
    let path = page("checks.md");
    let list = printed(&["check", "--list"]);
    let mut table = "| check | what holds |\n|---|---|\n".to_owned();
    for line in list.lines() {
        match line.strip_prefix("    ") {
            Some(what) => writeln!(table, " {what} |").unwrap(),
            None => write!(table, "| `{line}` |").unwrap(),
        }
    }
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(marks(&text, "list").len(), 1, "{}", path.display());
    bless(&path, &filled(&text, "list", |_| table.clone()));
}
