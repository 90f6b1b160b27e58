//! What a run was run with, for whatever compares runs.

use crate::summary::{Group, Head, Law, Range, Summary};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use text::{Source, base, key};

/// A setting of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunSetting {
    /// Its subject, in words.
    pub(crate) section: String,
    /// This is a law.
    pub(crate) is_of_law: bool,
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
pub(crate) fn settings(summary: &Summary) -> Vec<RunSetting> {
    let Head {
        program,
        analysis,
        mesh,
        groups,
        laws,
        solver,
        ..
    } = &summary.head;
    let mut settings = Settings(Vec::new());
    settings.add("program", "version", None, said(program));
    settings.add("model", "analysis", Some(&["analysis"]), said(analysis));
    settings.add("model", "nodes", None, json!(mesh.nodes));
    settings.add("model", "elements", None, json!(mesh.elements));
    for group in groups {
        settings.group(group);
    }
    let first = settings.0.len();
    for (name, law) in laws {
        settings.law(name, law);
    }
    let of_laws = settings.0[first..].iter_mut();
    of_laws.for_each(|setting| setting.is_of_law = true);
    for phase in &summary.phases {
        let section = format!("phase {}", phase.name);
        settings.add(&section, "equations", None, json!(phase.equations));
        settings.add(&section, "increments done", None, json!(phase.increments));
    }
    for (name, value) in solver {
        let path = ["solver", name];
        settings.add("solver", &words(name), Some(&path), value.clone());
    }
    settings.0
}

/// A name in words.
fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A text, null if there is none.
fn said(text: &str) -> Value {
    match text {
        "" => Value::Null,
        text => text.into(),
    }
}

/// Settings while they are collected.
struct Settings(Vec<RunSetting>);

impl Settings {
    fn add(&mut self, section: &str, name: &str, path: Option<&[&str]>, value: Value) {
        self.with_unit([section, name], path, value, "");
    }

    fn with_unit(
        &mut self,
        [section, name]: [&str; 2],
        path: Option<&[&str]>,
        value: Value,
        unit: &str,
    ) {
        if !value.is_null() {
            self.0.push(RunSetting {
                section: section.to_owned(),
                is_of_law: false,
                name: name.to_owned(),
                path: path.map(|keys| keys.iter().map(|k| key(k)).collect::<Vec<_>>().join(".")),
                value,
                unit: unit.to_owned(),
            });
        }
    }

    fn group(&mut self, group: &Group) {
        let id = group.name.as_str();
        let section = format!("group {id}");
        let path = |name| ["groups", id, name];
        let formulation = said(&group.formulation);
        self.add(
            &section,
            "formulation",
            Some(&path("formulation")),
            formulation,
        );
        self.add(&section, "elements", None, json!(group.elements));
        let points = group.points_per_element.clone();
        self.add(&section, "points per element", None, points);
        self.add(&section, "law", Some(&path("law")), said(&group.law));
        for (phase, law) in &group.laws_from_phase {
            let path = ["phase", phase, "laws", id];
            let name = format!("law from phase {phase}");
            self.add(&section, &name, Some(&path), json!(law));
        }
    }

    /// Those of a law. The record calls it by its name in the file and its hypothesis.
    fn law(&mut self, name: &str, law: &Law) {
        let section = format!("law {name}");
        let id = name.rsplit_once(" (").map_or(name, |(id, _)| id);
        self.add(&section, "law", Some(&["laws", id, "law"]), said(&law.law));
        self.add(&section, "version", None, said(&law.version));
        for (parameter, value) in &law.parameters {
            let mut described = law.described_parameters.iter();
            let described = described.find(|p| p.id == *parameter);
            let choice = described.and_then(|p| p.choice.as_ref());
            let unit = described.map_or("", |described| described.unit.as_str());
            let (value, unit) = match (choice, law.varying.get(parameter)) {
                (Some(choice), _) => (json!(choice), ""),
                (None, Some(Range { smallest, largest })) => {
                    (json!(format!("{smallest} to {largest}")), unit)
                }
                (None, None) => (json!(value), unit),
            };
            let path = ["laws", id, "parameters", parameter];
            self.with_unit([&section, parameter], Some(&path), value, unit);
        }
        if let Some(zone) = &law.shear_zone {
            let (ratio, thickness) = (json!(zone.lateral_ratio), json!(zone.thickness));
            let path = ["laws", id, "lateral_ratio"];
            self.add(&section, "lateral ratio", Some(&path), ratio);
            let path = ["laws", id, "thickness"];
            self.with_unit([&section, "thickness"], Some(&path), thickness, "m");
        }
        for (variable, value) in &law.initial {
            let path = ["laws", id, "initial", variable];
            let name = format!("initial {variable}");
            self.add(&section, &name, Some(&path), json!(value));
        }
        let digest = law.sha256.as_str();
        let short = json!(digest.get(..12).unwrap_or(digest));
        let path = ["laws", id, "sha256"];
        self.add(&section, "library, SHA-256", Some(&path), short);
    }
}

/// Content of the files of a run, with its variant and the settings of its command line, by dotted
/// path; nothing, where the record does not have them.
pub(crate) fn settings_of_files(head: &Head) -> Vec<(String, Value)> {
    let mut source: Option<Source> = None;
    for file in &head.case_files {
        let own = Source::new(file.path.as_str(), file.text.as_str());
        source = Some(match source {
            None => own,
            Some(base) => own.based_on(&base),
        });
    }
    let Some(source) = source.map(|source| source.with_settings(&head.set)) else {
        return Vec::new();
    };
    let files = base::merged::<Map<String, Value>>(&source).unwrap_or_default();
    let mut files = files.into_iter();
    let Some((_, file)) = files.find(|(name, _)| *name == head.variant) else {
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
                let name = match entry["name"].as_str() {
                    None | Some("") => number.to_string(),
                    Some(name) => key(name),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_files_have_dotted_paths() {
        let base = "title = \"a\"\nsolver.max_iterations = 20\n\
                    [[phase]]\nname = \"load\"\nincrements = 2\n\
                    pressure = [{ line = \"top\", value = 1.0 }]\n\
                    [laws.\"my law\".parameters]\nc = 1\n";
        let case = "base = \"base.toml\"\n[[variant]]\nname = \"v\"\n\
                    phase = [{ name = \"load\", increments = 4 }]\n\
                    [[variant]]\nname = \"w\"\n";
        let head = json!({
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
        let head: Head = serde_json::from_value(head).unwrap();
        let mut found = settings_of_files(&head);
        let mut expected = expected.to_vec();
        found.sort_by(|a, b| a.0.cmp(&b.0));
        expected.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(found, expected);
        assert_eq!(settings_of_files(&Head::default()), []);
    }

    #[test]
    fn names_are_as_long_as_they_have_to_be() {
        let folders = ["/r/a/x", "/r/b/x", "/r/y"].map(PathBuf::from);
        assert_eq!(names(&folders), ["a/x", "b/x", "y"]);
    }
}
