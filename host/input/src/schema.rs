//! JSON Schemas of case, driver and study files and calibrations, for editors: derived from the types that read them.
//!
//! `base` and `[[variant]]` are merged before anything is read, so a file with one of them may leave
//! out what the other file says. The top level of a schema therefore admits parts, and demands a
//! complete file only if both are absent.

use crate::calibration::CalibrationFile;
use crate::case::CaseFile;
use crate::driver::DriverFile;
use crate::study::StudyFile;
use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::marker::PhantomData;

/// Kind of file of a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Case files, for `pilum run`.
    Case,
    /// Driver files, for `pilum point`.
    Point,
    /// Study files, for `pilum study`.
    Study,
    /// Calibrations, for `pilum calibrate`.
    Calibration,
}

/// The JSON Schema (2020-12) of a kind of input file.
pub fn of(kind: FileKind) -> Value {
    match kind {
        FileKind::Case => with_bases(complete::<CaseFile>(), "Pilum case file"),
        FileKind::Point => with_bases(complete::<DriverFile>(), "Pilum driver file"),
        FileKind::Study => {
            let mut schema = complete::<StudyFile>().to_value();
            set(&mut schema, "title", json!("Pilum study file"));
            schema
        }
        FileKind::Calibration => with_bases(complete::<CalibrationFile>(), "Pilum calibration"),
    }
}

/// The schema of a file without base or variants.
fn complete<T: JsonSchema>() -> Schema {
    let settings = SchemaSettings::draft2020_12().with_transform(without_null);
    settings.into_generator().into_root_schema_for::<T>()
}

/// TOML has no null: what is optional is left out.
fn without_null(schema: &mut Schema) {
    if let Some(Value::Array(types)) = schema.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [kind] = types.as_slice() {
            let kind = kind.clone();
            schema.insert("type".to_owned(), kind);
        }
    }
    let mut only = None;
    if let Some(Value::Array(choices)) = schema.get_mut("anyOf") {
        choices.retain(|choice| choice.get("type").is_none_or(|kind| kind != "null"));
        if let [choice] = choices.as_slice() {
            only = choice.as_object().cloned();
        }
    }
    if let Some(only) = only {
        schema.remove("anyOf");
        for (key, value) in only {
            schema.ensure_object().entry(key).or_insert(value);
        }
    }
    transform_subschemas(&mut without_null, schema);
}

/// Names of the definitions of parts: those of complete files with this behind.
const PART: &str = "Part";

/// Adds `base` and `variant` to the schema of a complete file.
fn with_bases(complete: Schema, title: &str) -> Value {
    let mut complete = complete.to_value();
    let mut definitions = take(&mut complete, "$defs");
    for (name, definition) in definitions.clone() {
        definitions.insert(name + PART, part_of(definition));
    }
    // What a variant overrides is a part of the file, and has a name.
    let mut variant = part_of(complete.clone());
    let mut name = json!({ "type": "string", "description": "Name of the variant." });
    name["pattern"] = json!("^[A-Za-z0-9][A-Za-z0-9_.-]*$");
    set(&mut variant, "required", json!(["name"]));
    set_property(&mut variant, "name", name);
    let mut file = part_of(complete.clone());
    let base = "A file that this one overrides: tables key by key, named entries by name.";
    let variants = "Keys that override the file's: a case each.";
    set_property(
        &mut file,
        "base",
        json!({ "type": "string", "description": base }),
    );
    set_property(
        &mut file,
        "variant",
        json!({ "type": "array", "description": variants, "items": { "$ref": "#/$defs/Variant" } }),
    );
    take(&mut complete, "$schema");
    definitions.insert("Variant".to_owned(), variant);
    definitions.insert("Complete".to_owned(), complete);
    for (key, value) in [
        (
            "$schema",
            json!("https://json-schema.org/draft/2020-12/schema"),
        ),
        ("title", json!(title)),
        (
            "if",
            json!({ "anyOf": [{ "required": ["base"] }, { "required": ["variant"] }] }),
        ),
        ("else", json!({ "$ref": "#/$defs/Complete" })),
        ("$defs", Value::Object(definitions)),
    ] {
        set(&mut file, key, value);
    }
    file
}

/// The same without anything that must be there, all the way down.
fn part_of(complete: Value) -> Value {
    fn relax(schema: &mut Schema) {
        schema.remove("required");
        if let Some(Value::String(reference)) = schema.get_mut("$ref") {
            reference.push_str(PART);
        }
        transform_subschemas(&mut relax, schema);
    }
    let Ok(mut schema) = Schema::try_from(complete.clone()) else {
        return complete;
    };
    relax.transform(&mut schema);
    schema.remove("$schema");
    schema.to_value()
}

fn set(schema: &mut Value, key: &str, value: Value) {
    if let Some(schema) = schema.as_object_mut() {
        schema.insert(key.to_owned(), value);
    }
}

fn set_property(schema: &mut Value, key: &str, value: Value) {
    if let Some(properties) = schema.get_mut("properties") {
        set(properties, key, value);
    }
}

fn take(schema: &mut Value, key: &str) -> Map<String, Value> {
    match schema.as_object_mut().and_then(|schema| schema.remove(key)) {
        Some(Value::Object(taken)) => taken,
        _ => Map::new(),
    }
}

/// Other names of properties.
fn also<'n>(schema: &mut Schema, names: impl IntoIterator<Item = (&'n str, &'n str)>) {
    let Some(properties) = schema.get_mut("properties").and_then(Value::as_object_mut) else {
        return;
    };
    for (key, other) in names {
        if let Some(property) = properties.get(key).cloned() {
            properties.insert(other.to_owned(), property);
        }
    }
}

/// `r` and `z` as other names of `x` and `y`.
pub(crate) fn radius_and_axis(schema: &mut Schema) {
    also(schema, [("x", "r"), ("y", "z")]);
}

/// `11` as another name of `stress_11`, and so on.
pub(crate) fn components_alone(schema: &mut Schema) {
    let names = ["stress_11", "stress_22", "stress_33", "stress_12"];
    also(schema, names.map(|name| (name, &name["stress_".len()..])));
}

/// `y` as another name of `z`, the height: either of them.
pub(crate) fn height(schema: &mut Schema) {
    also(schema, [("z", "y")]);
    schema.remove("required");
}

/// `r` and `z` as other values of `x` and `y`.
pub(crate) fn radius_and_axis_names(schema: &mut Schema) {
    *schema = json_schema!({
        "type": "string",
        "description": "A coordinate direction.",
        "enum": ["x", "y", "r", "z"],
    });
}

/// Values by component of a gradient or flux, of whatever hypothesis.
pub(crate) struct Components<T>(PhantomData<T>);

impl<T: JsonSchema> JsonSchema for Components<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("ComponentsOf{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = generator.subschema_for::<T>();
        let mut properties = Map::new();
        for hypothesis in abi::Hypothesis::ALL {
            for component in hypothesis.components() {
                properties.insert((*component).to_owned(), value.clone().to_value());
            }
        }
        json_schema!({
            "type": "object",
            "properties": properties,
            "additionalProperties": false,
        })
    }
}

/// The name of a hypothesis.
pub(crate) struct HypothesisName;

impl JsonSchema for HypothesisName {
    fn schema_name() -> Cow<'static, str> {
        "Hypothesis".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "string",
            "enum": abi::Hypothesis::ALL.map(abi::Hypothesis::name),
        })
    }
}

/// Any value that a file may have.
pub(crate) struct AnyValue;

impl JsonSchema for AnyValue {
    fn schema_name() -> Cow<'static, str> {
        "AnyValue".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": ["number", "string", "boolean", "array", "object"],
        })
    }
}
