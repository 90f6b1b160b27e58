//! `summary.json`, the record of a run, read back: what it was run with, for whatever compares
//! runs.

use serde_json::{Map, Value};
use std::path::PathBuf;
use text::{Source, base, key};

/// A setting of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunSetting {
    /// Its subject, in words.
    pub(crate) section: String,
    /// Its name there.
    pub(crate) name: String,
    /// Its dotted path in the case file, if it can be set there.
    pub(crate) path: Option<String>,
    /// Its value.
    pub(crate) value: Value,
    /// Its unit, if it has one.
    pub(crate) unit: String,
}

/// What a run was computed with, whether its file reports it or not: defaults too.
pub(crate) fn settings(summary: &Value) -> Vec<RunSetting> {
    let mut settings = Settings(Vec::new());
    settings.add("program", "version", None, &summary["program"]);
    let analysis = &summary["analysis"];
    settings.add("model", "analysis", Some(&["analysis"]), analysis);
    settings.add("model", "nodes", None, &summary["mesh"]["nodes"]);
    settings.add("model", "elements", None, &summary["mesh"]["elements"]);
    for group in list(&summary["groups"]) {
        let id = text(&group["name"]);
        let section = format!("group {id}");
        for name in ["formulation", "elements", "points_per_element", "law"] {
            let path = ["groups", id, name];
            let is_key = ["formulation", "law"].contains(&name);
            let path = is_key.then_some(&path[..]);
            settings.add(&section, &name.replace('_', " "), path, &group[name]);
        }
        for (phase, law) in entries(&group["laws_from_phase"]) {
            let path = ["phase", phase, "laws", id];
            settings.add(
                &section,
                &format!("law from phase {phase}"),
                Some(&path),
                law,
            );
        }
    }
    for (name, law) in entries(&summary["laws"]) {
        settings.law(name, law);
    }
    for phase in list(&summary["phases"]) {
        let section = format!("phase {}", text(&phase["name"]));
        settings.add(&section, "equations", None, &phase["equations"]);
        settings.add(&section, "increments done", None, &phase["increments"]);
    }
    for (name, value) in entries(&summary["solver"]) {
        let path = ["solver", name];
        settings.add("solver", &name.replace('_', " "), Some(&path), value);
    }
    settings.0
}

/// Settings while they are collected.
struct Settings(Vec<RunSetting>);

impl Settings {
    fn add(&mut self, section: &str, name: &str, path: Option<&[&str]>, value: &Value) {
        self.with_unit([section, name], path, value, "");
    }

    fn with_unit(
        &mut self,
        [section, name]: [&str; 2],
        path: Option<&[&str]>,
        value: &Value,
        unit: &str,
    ) {
        if !value.is_null() {
            self.0.push(RunSetting {
                section: section.to_owned(),
                name: name.to_owned(),
                path: path.map(|keys| keys.iter().map(|k| key(k)).collect::<Vec<_>>().join(".")),
                value: value.clone(),
                unit: unit.to_owned(),
            });
        }
    }

    /// Those of a law. The record calls it by its name in the file and its hypothesis.
    fn law(&mut self, name: &str, law: &Value) {
        let section = format!("law {name}");
        let id = name.rsplit_once(" (").map_or(name, |(id, _)| id);
        self.add(&section, "law", Some(&["laws", id, "law"]), &law["law"]);
        self.add(&section, "version", None, &law["version"]);
        for (parameter, value) in entries(&law["parameters"]) {
            let mut described = list(&law["described_parameters"]);
            let described = described.find(|p| text(&p["id"]) == parameter);
            let unit = described.map_or("", |p| text(&p["unit"]));
            let choice = described.map(|p| &p["choice"]).filter(|c| c.is_string());
            let (value, unit) = choice.map_or((value, unit), |choice| (choice, ""));
            let path = ["laws", id, "parameters", parameter];
            self.with_unit([&section, parameter], Some(&path), value, unit);
        }
        for (name, value) in entries(&law["shear_zone"]) {
            let unit = if name == "thickness" { "m" } else { "" };
            let path = ["laws", id, name];
            self.with_unit(
                [&section, &name.replace('_', " ")],
                Some(&path),
                value,
                unit,
            );
        }
        for (variable, value) in entries(&law["initial"]) {
            let path = ["laws", id, "initial", variable];
            self.add(&section, &format!("initial {variable}"), Some(&path), value);
        }
        let digest = text(&law["sha256"]);
        let short = Value::from(digest.get(..12).unwrap_or(digest));
        let path = ["laws", id, "sha256"];
        self.add(&section, "library, SHA-256", Some(&path), &short);
    }
}

/// Content of the files of a run, with its variant and the settings of its command line, by dotted
/// path; nothing, where the record does not have them.
pub(crate) fn settings_of_files(summary: &Value) -> Vec<(String, Value)> {
    let mut source: Option<Source> = None;
    for file in list(&summary["case_files"]) {
        let own = Source::new(text(&file["path"]), text(&file["text"]));
        source = Some(match source {
            None => own,
            Some(base) => own.based_on(&base),
        });
    }
    let settings: Vec<String> = list(&summary["set"]).map(|s| text(s).to_owned()).collect();
    let Some(source) = source.map(|source| source.with_settings(&settings)) else {
        return Vec::new();
    };
    let variant = summary["variant"].as_str();
    let files = base::merged::<Map<String, Value>>(&source).unwrap_or_default();
    let mut files = files.into_iter();
    let Some((_, file)) = files.find(|(name, _)| name.as_deref() == variant) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (name, value) in file {
        // What a run is called is no setting.
        if name != "title" {
            flatten(key(&name), value, &mut found);
        }
    }
    found
}

/// The values below a path: those of tables by key, those of lists of tables by name or position.
fn flatten(path: String, value: Value, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(table) => {
            for (name, value) in table {
                flatten(format!("{path}.{}", key(&name)), value, found);
            }
        }
        Value::Array(entries) if entries.iter().any(Value::is_object) => {
            for (number, entry) in (1..).zip(entries) {
                let name = match text(&entry["name"]) {
                    "" => number.to_string(),
                    name => key(name),
                };
                flatten(format!("{path}.{name}"), entry, found);
            }
        }
        value => found.push((path, value)),
    }
}

/// Names of runs from their folders: as much of the path as distinguishes them.
pub(crate) fn names(folders: &[PathBuf]) -> Vec<String> {
    let last = |folder: &PathBuf| {
        let path = std::path::absolute(folder).ok()?;
        Some(path.file_name()?.to_string_lossy().into_owned())
    };
    let names = folders.iter();
    let names = names.map(|folder| last(folder).unwrap_or_else(|| folder.display().to_string()));
    let mut names: Vec<String> = names.collect();
    for longer in 2..8 {
        let alike: Vec<bool> = names
            .iter()
            .map(|name| names.iter().filter(|other| *other == name).count() > 1)
            .collect();
        let named = names.iter_mut().zip(folders).zip(alike);
        for ((name, folder), _) in named.filter(|(_, alike)| *alike) {
            let path = std::path::absolute(folder).unwrap_or_default();
            let parts: Vec<_> = path.iter().map(std::ffi::OsStr::to_string_lossy).collect();
            *name = parts[parts.len().saturating_sub(longer)..].join("/");
        }
    }
    names
}

/// A text, empty if absent.
pub(crate) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// Entries of an array, none if it is no array.
pub(crate) fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

/// Entries of an object, none if it is no object.
pub(crate) fn entries(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let entries = value.as_object().into_iter().flatten();
    entries.map(|(key, value)| (key.as_str(), value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn settings_of_files_have_dotted_paths() {
        let base = "title = \"a\"\nsolver.max_iterations = 20\n\
                    [[phase]]\nname = \"load\"\nincrements = 2\n\
                    pressure = [{ line = \"top\", value = 1.0 }]\n\
                    [laws.\"my law\".parameters]\nc = 1\n";
        let case = "base = \"base.toml\"\n[[variant]]\nname = \"v\"\n\
                    phase = [{ name = \"load\", increments = 4 }]\n\
                    [[variant]]\nname = \"w\"\n";
        let summary = json!({
            "case_files": [
                { "path": "base.toml", "text": base },
                { "path": "case.toml", "text": case },
            ],
            "variant": "v",
            "set": ["phase.load.pressure.1.value=2.5"],
        });
        let expected = [
            ("solver.max_iterations", json!(20)),
            ("phase.load.name", json!("load")),
            ("phase.load.increments", json!(4)),
            ("phase.load.pressure.1.line", json!("top")),
            ("phase.load.pressure.1.value", json!(2.5)),
            ("laws.\"my law\".parameters.c", json!(1)),
        ];
        let expected = expected.map(|(path, value)| (path.to_owned(), value));
        let mut found = settings_of_files(&summary);
        let mut expected = expected.to_vec();
        found.sort_by(|a, b| a.0.cmp(&b.0));
        expected.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(found, expected);
        assert_eq!(settings_of_files(&json!({})), []);
    }

    #[test]
    fn names_are_as_long_as_they_have_to_be() {
        let folders = ["/r/a/x", "/r/b/x", "/r/y"].map(PathBuf::from);
        assert_eq!(names(&folders), ["a/x", "b/x", "y"]);
    }
}
