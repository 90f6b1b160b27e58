//! The schemas of input files: every committed file follows its own, and mistakes do not.

use crate::compilers::repository;
use crate::program::pilum;
use crate::validator::Validator;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tests::words::rows_of;

fn validator(kind: &str) -> Validator {
    let place = TempDir::new().unwrap();
    let outcome = pilum(place.path(), &["schema", kind]).ended(0);
    let schema: Value = serde_json::from_str(&outcome.stdout).unwrap();
    Validator::new(schema)
}

fn value(text: &str) -> Value {
    let table: toml::Table = toml::from_str(text).unwrap();
    serde_json::to_value(table).unwrap()
}

/// All input files in the repository.
fn inputs(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            inputs(&path, found);
        } else if path.extension().is_some_and(|suffix| suffix == "toml")
            // The sidecar of a library: `pilum check` reads it.
            && !path.to_string_lossy().ends_with(".law.toml")
        {
            found.push(path);
        }
    }
}

#[test]
fn every_committed_file_follows_its_schema() {
    let (case, point, study) = (validator("case"), validator("point"), validator("study"));
    let calibration = validator("calibration");
    let mut files = Vec::new();
    inputs(&repository("cases"), &mut files);
    inputs(
        &repository("host/workshop/src/new_law/interface"),
        &mut files,
    );
    inputs(
        &repository("host/workshop/src/new_law/continuum"),
        &mut files,
    );
    let (mut cases, mut points, mut studies, mut calibrations) = (0, 0, 0, 0);
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let value = value(&text);
        // A driver has a law of its own; what is based on a driver is one.
        let is_point = |value: &Value| value.get("law").is_some() || value.get("segment").is_some();
        let base = value.get("base").and_then(Value::as_str).map(|base| {
            let text = fs::read_to_string(path.parent().unwrap().join(base)).unwrap();
            self::value(&text)
        });
        let is_point = is_point(&value) || base.as_ref().is_some_and(is_point);
        let (validator, count) = if value.get("method").is_some() {
            (&study, &mut studies)
        } else if value.get("free").is_some() {
            (&calibration, &mut calibrations)
        } else if is_point {
            (&point, &mut points)
        } else {
            (&case, &mut cases)
        };
        *count += 1;
        let errors = validator.errors(&value);
        assert!(errors.is_empty(), "{}: {errors:#?}", path.display());
    }
    assert!(
        cases >= 12 && points >= 8 && studies >= 3 && calibrations >= 4,
        "{cases} cases, {points} drivers, {studies} studies, {calibrations} calibrations"
    );
}

const DRIVER: &str = include_str!("../../host/workshop/src/new_law/interface/point.toml");
const CASE: &str = include_str!("../../host/workshop/src/new_law/interface/case.toml");

/// The text with one place changed.
fn changed(text: &str, from: &str, to: &str) -> Value {
    assert!(text.contains(from), "{from:?}");
    value(&text.replacen(from, to, 1))
}

#[test]
fn mistakes_do_not_follow_it() {
    let (case, point) = (validator("case"), validator("point"));
    assert!(case.is_valid(&value(CASE)) && point.is_valid(&value(DRIVER)));
    // Unknown keys, at every level; then what is missing, and what is of another kind.
    for [from, to] in rows_of(
        r#"
title | titel
[mesh]\n | [mesh]\ncolums = 1\n
formulation = "solid" | formulation = "solid"\nintegretion = "full"
increments = 10 | increment = 10
value = 100.0 | valeu = 100.0
analysis = "plane_strain"\n | \n
formulation = "solid"\n | \n
formulation = "solid" | formulation = "solids"
increments = 10 | increments = "ten"
fixed = ["x", "y"] | fixed = ["x", "w"]
"#,
    ) {
        assert!(
            !case.is_valid(&changed(CASE, from, to)),
            "{from:?} to {to:?}"
        );
    }
    for [from, to] in rows_of(
        r#"
hypothesis = "interface_2d" | hypothesis = "interface"
[initial] | [intial]
increments = 20 | increments = 0
t = { jump = 2e-3 } | u = { jump = 2e-3 }
t = { jump = 2e-3 } | t = { slip = 2e-3 }
t = { jump = 2e-3 } | t = { jump = 2e-3, traction = 0 }
t = { jump = 2e-3 } | t = 2e-3
"#,
    ) {
        assert!(
            !point.is_valid(&changed(DRIVER, from, to)),
            "{from:?} to {to:?}"
        );
    }
}

/// Studies have no parts.
#[test]
fn mistakes_in_studies_do_not_follow_it() {
    let study = validator("study");
    let text = include_str!("../../cases/study_parallel/study.toml");
    assert!(study.is_valid(&value(text)));
    for (from, to) in [
        ("title", "titel"),
        ("latin_hypercube", "hypercube"),
        ("case = \"chamber.toml\"\n", ""),
        ("runs = 24", "runs = 0"),
        ("deviation", "sigma"),
        ("take = \"max\"", "take = \"most\""),
    ] {
        assert!(
            !study.is_valid(&changed(text, from, to)),
            "{from:?} to {to:?}"
        );
    }
}

/// With a base or variants a file may be a part, but not any part.
#[test]
fn parts_follow_it_too() {
    let case = validator("case");
    let based = "base = \"other.toml\"\n[[phase]]\nname = \"push\"\nlaws = { joint = \"mepi\" }\n";
    assert!(case.is_valid(&value(based)));
    assert!(!case.is_valid(&changed(based, "laws", "law")));
    assert!(!case.is_valid(&changed(based, "base = \"other.toml\"\n", "")));
    let variants =
        format!("{CASE}\n[[variant]]\nname = \"a\"\nlaws.joint.parameters.friction_angle = 20.0\n");
    assert!(case.is_valid(&value(&variants)));
    assert!(!case.is_valid(&changed(&variants, "name = \"a\"", "nam = \"a\"")));
    assert!(!case.is_valid(&changed(&variants, "name = \"a\"", "name = \"../a\"")));
}

/// Every key says what it is, so that an editor can.
#[test]
fn every_key_has_a_description() {
    fn look(schema: &Value, at: &str, bare: &mut Vec<String>) {
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            for (name, property) in properties {
                let is_component = name.len() <= 2;
                if property.get("description").is_none() && !is_component {
                    bare.push(format!("{at}.{name}"));
                }
            }
        }
        for (name, definition) in schema
            .get("$defs")
            .and_then(Value::as_object)
            .into_iter()
            .flatten()
        {
            look(definition, name, bare);
        }
    }
    let place = TempDir::new().unwrap();
    for kind in ["case", "point", "study"] {
        let text = pilum(place.path(), &["schema", kind]).stdout;
        let mut bare = Vec::new();
        look(&serde_json::from_str(&text).unwrap(), kind, &mut bare);
        assert!(bare.is_empty(), "{bare:?}");
    }
}
