//! The pages of `host/docs/reference`: keys are written from the schemas, commands from their help,
//! checks from the program's list, all with `PILUM_BLESS=1` and compared otherwise. Every key has an example,
//! and every example of a page is run.

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
    let outcome = pilum(place.path(), arguments);
    assert_eq!(outcome.code, Some(0), "{arguments:?}: {}", outcome.stderr);
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
                return format!("[table]({place})");
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
                // A whole number is a number.
                kinds.retain(|kind| kind != "whole number");
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
            Some("boolean") => "`true`, `false`".to_owned(),
            Some("array") => {
                let of = self.kind(&value["items"], places);
                match value["maxItems"].as_u64() {
                    Some(2) => format!("[{of}, {of}]"),
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

    /// The table of keys of a definition.
    fn table(&self, name: &str, places: &BTreeMap<String, String>) -> String {
        let definition = &self.definitions[name];
        let keys = definition["properties"].as_object().unwrap();
        let required = definition["required"].as_array();
        let mut table = "| key | takes | if left out | |\n|---|---|---|---|\n".to_owned();
        let mut choices = String::new();
        for (key, value) in keys {
            // In axisymmetry, another name for the same.
            let other = match key.as_str() {
                "r" if same(keys.get("x"), keys.get("r")) => continue,
                "z" if same(keys.get("y"), keys.get("z")) => continue,
                "x" if keys.contains_key("r") => Some("r"),
                "y" if keys.contains_key("z") => Some("z"),
                _ => None,
            };
            let other = other
                .map(|other| format!(", `{other}`"))
                .unwrap_or_default();
            let is_required =
                required.is_some_and(|names| names.contains(&Value::from(key.as_str())));
            let default = match value.get("default") {
                _ if is_required => "**required**".to_owned(),
                None | Some(Value::Null | Value::Object(_) | Value::Array(_)) => String::new(),
                Some(Value::String(text)) if text.is_empty() => String::new(),
                Some(value) => format!("`{value}`"),
            };
            let kind = self.kind(value, places);
            writeln!(
                table,
                "| `{key}`{other} | {kind} | {default} | {} |",
                text(value)
            )
            .unwrap();
            for (label, meaning) in self.labels(value) {
                writeln!(choices, "| `{key} = \"{label}\"` | {meaning} |").unwrap();
            }
        }
        if !choices.is_empty() {
            table = format!("{table}\n| value | |\n|---|---|\n{choices}");
        }
        table
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

/// The names of a page's marks `<!-- KIND of NAME: begin -->`, each with its line.
fn marks(text: &str, kind: &str) -> Vec<(usize, String)> {
    let prefix = format!("<!-- {kind} of ");
    let lines = text.lines().enumerate();
    lines
        .filter_map(|(n, line)| {
            let name = line.strip_prefix(&prefix)?.strip_suffix(": begin -->")?;
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
        let name = &mark[begin.len()..mark.len() - ": begin -->".len()];
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
            let name = name.strip_suffix(": begin -->").unwrap();
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
    for (schema, name) in schemas() {
        let text = read(name);
        let mut places = of_cases.clone();
        places.extend(self::places("", &text));
        for table in schema.tables() {
            assert!(places.contains_key(table), "{name} has no keys of {table}");
        }
        bless(
            &page(name),
            &filled(&text, "keys", |of| schema.table(of, &places)),
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
            let outcome = pilum(place.path(), &[command, &[file.as_str()]].concat());
            assert_eq!(
                outcome.code,
                Some(0),
                "{name}, line {}: {}",
                block.line,
                outcome.stderr
            );
            ran += 1;
        }
        assert!(ran > 3, "{name}: {ran}");
    }
}

/// The commands that `pilum help` lists.
fn commands() -> Vec<String> {
    let help = printed(&["--help"]);
    let list = help
        .split("Commands:\n")
        .nth(1)
        .unwrap()
        .split("\n\n")
        .next()
        .unwrap();
    list.lines()
        .filter_map(|line| line.strip_prefix("  "))
        .filter(|line| !line.starts_with(' '))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

#[test]
fn commands_are_those_of_the_program() {
    let path = page("commands.md");
    let text = fs::read_to_string(&path).unwrap();
    let listed: Vec<_> = marks(&text, "help")
        .into_iter()
        .map(|(_, name)| name)
        .collect();
    let mut wanted = vec!["pilum".to_owned()];
    wanted.extend(commands());
    assert_eq!(listed, wanted, "commands of {}", path.display());
    let help = |name: &str| {
        let help = match name {
            "pilum" => printed(&["--help"]),
            name => printed(&["help", name]),
        };
        let lines: Vec<_> = help.lines().map(str::trim_end).collect();
        format!("```text\n{}\n```\n", lines.join("\n").trim_end())
    };
    bless(&path, &filled(&text, "help", help));
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
