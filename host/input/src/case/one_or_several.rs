//! Keys that take one of something, or a list.

use super::MeasuredInput;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};
use std::borrow::Cow;
use std::fmt;
use text::Spanned;

/// Names of groups: one, or a list.
#[derive(Clone, Debug)]
pub struct GroupNames(pub Vec<Spanned<String>>);

impl<'de> Deserialize<'de> for GroupNames {
    fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> de::Visitor<'de> for OneOrSeveral {
            type Value = Vec<Spanned<String>>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a group, or a list such as [\"shaft_clay\", \"shaft_sand\"]",
                )
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
                Ok(vec![Spanned::new(0..0, name.to_owned())])
            }

            fn visit_seq<S: de::SeqAccess<'de>>(self, names: S) -> Result<Self::Value, S::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(names))
            }
        }
        struct Names(Vec<Spanned<String>>);
        impl<'de> Deserialize<'de> for Names {
            fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
                input.deserialize_any(OneOrSeveral).map(Self)
            }
        }
        let names = Spanned::<Names>::deserialize(input)?;
        let span = names.span();
        let placed = |name: Spanned<String>| match name.span() {
            // One name alone stands where the value does.
            at if at.is_empty() => Spanned::new(span.clone(), name.into_inner()),
            _ => name,
        };
        Ok(Self(names.into_inner().0.into_iter().map(placed).collect()))
    }
}

impl JsonSchema for GroupNames {
    fn schema_name() -> Cow<'static, str> {
        "GroupNames".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [
            { "type": "string" },
            { "type": "array", "items": { "type": "string" }, "minItems": 1 },
        ] })
    }
}

/// Measured points of a figure: one table of them, or several.
#[derive(Clone, Debug)]
pub struct MeasuredTables(pub Vec<MeasuredInput>);

impl<'de> Deserialize<'de> for MeasuredTables {
    fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> de::Visitor<'de> for OneOrSeveral {
            type Value = MeasuredTables;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table such as { file = \"test.csv\", x = \"w\", y = \"load\" }, or a list of them")
            }

            fn visit_map<M: de::MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
                let table = de::value::MapAccessDeserializer::new(map);
                Ok(MeasuredTables(vec![MeasuredInput::deserialize(table)?]))
            }

            fn visit_seq<S: de::SeqAccess<'de>>(self, tables: S) -> Result<Self::Value, S::Error> {
                let tables = de::value::SeqAccessDeserializer::new(tables);
                Ok(MeasuredTables(Vec::deserialize(tables)?))
            }
        }
        input.deserialize_any(OneOrSeveral)
    }
}

impl JsonSchema for MeasuredTables {
    fn schema_name() -> Cow<'static, str> {
        "MeasuredTables".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<MeasuredInput>();
        json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
    }
}
