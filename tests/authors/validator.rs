//! The part of JSON Schema (2020-12) that the program's schemas use. A keyword that is not known
//! here stops the test: none is passed over.

use serde_json::{Map, Value};

/// A schema.
#[derive(Debug)]
pub(crate) struct Validator(Value);

/// Keywords that demand nothing.
const ANNOTATIONS: [&str; 7] = [
    "$schema",
    "$defs",
    "default",
    "description",
    "format",
    "title",
    // With "if".
    "else",
];

/// The one pattern of the schemas: names of variants and figures.
const NAME: &str = "^[A-Za-z0-9][A-Za-z0-9_.-]*$";

impl Validator {
    pub(crate) fn new(schema: Value) -> Self {
        Self(schema)
    }

    pub(crate) fn is_valid(&self, value: &Value) -> bool {
        self.errors(value).is_empty()
    }

    /// The defect, and its place.
    pub(crate) fn errors(&self, value: &Value) -> Vec<String> {
        let mut errors = Vec::new();
        self.check(&self.0, value, "", &mut errors);
        errors
    }

    fn holds(&self, schema: &Value, value: &Value) -> bool {
        let mut errors = Vec::new();
        self.check(schema, value, "", &mut errors);
        errors.is_empty()
    }

    fn check(&self, schema: &Value, value: &Value, at: &str, errors: &mut Vec<String>) {
        let schema = match schema {
            Value::Bool(true) => return,
            Value::Object(schema) => schema,
            _ => return errors.push(format!("{at}: nothing is allowed here")),
        };
        for (keyword, wanted) in schema {
            if !self.keyword(schema, (keyword, wanted), value, at, errors) {
                errors.push(format!("{at}: {keyword} {wanted} not met by {value}"));
            }
        }
    }

    /// Whether a keyword is met; errors within the value are added where they are.
    fn keyword(
        &self,
        schema: &Map<String, Value>,
        (keyword, wanted): (&str, &Value),
        value: &Value,
        at: &str,
        errors: &mut Vec<String>,
    ) -> bool {
        let any = |schemas: &Value| {
            let schemas = schemas.as_array().unwrap().iter();
            schemas.filter(|schema| self.holds(schema, value)).count()
        };
        let number = |test: fn(f64, f64) -> bool| {
            let value = value.as_f64();
            value.is_none_or(|value| test(value, wanted.as_f64().unwrap()))
        };
        let length = |n: Option<usize>, test: fn(u64, u64) -> bool| {
            n.is_none_or(|n| test(n as u64, wanted.as_u64().unwrap()))
        };
        let (items, table) = (value.as_array(), value.as_object());
        match keyword {
            "$ref" => {
                let name = wanted.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                self.check(&self.0["$defs"][name], value, at, errors);
                true
            }
            "type" => match wanted {
                Value::Array(types) => types.iter().any(|name| is_type(value, name)),
                name => is_type(value, name),
            },
            "const" => value == wanted,
            "enum" => wanted.as_array().unwrap().contains(value),
            "anyOf" => any(wanted) > 0,
            "oneOf" => any(wanted) == 1,
            "if" => {
                let otherwise = schema.get("else");
                self.holds(wanted, value)
                    || otherwise.is_none_or(|schema| self.holds(schema, value))
            }
            "minimum" => number(|value, bound| value >= bound),
            "exclusiveMinimum" => number(|value, bound| value > bound),
            "maximum" => number(|value, bound| value <= bound),
            "minItems" => length(items.map(Vec::len), |n, bound| n >= bound),
            "maxItems" => length(items.map(Vec::len), |n, bound| n <= bound),
            "minProperties" => length(table.map(Map::len), |n, bound| n >= bound),
            "maxProperties" => length(table.map(Map::len), |n, bound| n <= bound),
            "pattern" => {
                assert_eq!(wanted, NAME, "a pattern this validator does not know");
                value.as_str().is_none_or(is_name)
            }
            "required" => {
                let mut names = wanted.as_array().unwrap().iter();
                table.is_none_or(|table| names.all(|n| table.contains_key(n.as_str().unwrap())))
            }
            "items" => {
                for (number, item) in items.into_iter().flatten().enumerate() {
                    self.check(wanted, item, &format!("{at}/{number}"), errors);
                }
                true
            }
            "properties" => {
                for (name, schema) in wanted.as_object().unwrap() {
                    if let Some(value) = value.get(name) {
                        self.check(schema, value, &format!("{at}/{name}"), errors);
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = schema.get("properties");
                for (name, value) in table.into_iter().flatten() {
                    if known.is_none_or(|known| known.get(name).is_none()) {
                        self.check(wanted, value, &format!("{at}/{name}"), errors);
                    }
                }
                true
            }
            annotation => {
                let is_known = ANNOTATIONS.contains(&annotation);
                assert!(
                    is_known,
                    "a keyword this validator does not know: {annotation}"
                );
                true
            }
        }
    }
}

fn is_type(value: &Value, name: &Value) -> bool {
    match name.as_str().unwrap() {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("a type that JSON Schema does not know: {other}"),
    }
}

/// [`NAME`].
fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphanumeric())
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "_.-".contains(c))
}
