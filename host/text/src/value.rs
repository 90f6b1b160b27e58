//! Values of a TOML file as serde takes them, with the place of every misfit.

use crate::misfit::{Kind, LIST, Misfit};
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{
    self, Deserialize, DeserializeSeed, Deserializer, IntoDeserializer, MapAccess, SeqAccess,
    Visitor,
};
use serde::forward_to_deserialize_any;
use serde_spanned::de::{SpannedDeserializer, is_spanned};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeInteger, DeString, DeTable, DeValue};

/// A value with its place.
pub(crate) struct Value<'i> {
    value: DeValue<'i>,
    span: Range<usize>,
}

/// Reads a whole file. A missing key of its root table has no place.
pub(crate) fn read_root<'i, T: Deserialize<'i>>(table: Spanned<DeTable<'i>>) -> Result<T, Misfit> {
    T::deserialize(MapAccessDeserializer::new(Pairs::new(table.into_inner())))
}

impl<'i> Value<'i> {
    pub(crate) fn new(value: Spanned<DeValue<'i>>) -> Self {
        let span = value.span();
        let value = value.into_inner();
        Self { value, span }
    }

    /// Hands the value to serde. The compiler repeats this for every type that is read; [`Self::plain`] exists once.
    fn visit<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        match self.plain(&visitor)? {
            Plain::Text(text) => visitor.visit_string(text),
            Plain::Signed(number) => visitor.visit_i64(number),
            Plain::Unsigned(number) => visitor.visit_u64(number),
            Plain::Number(number) => visitor.visit_f64(number),
            Plain::Truth(value) => visitor.visit_bool(value),
            Plain::List(entries) => visitor.visit_seq(entries),
            Plain::Table(pairs) => visitor.visit_map(pairs),
        }
    }

    fn plain(self, expected: &dyn de::Expected) -> Result<Plain<'i>, Misfit> {
        Ok(match self.value {
            DeValue::String(text) => Plain::Text(text.into_owned()),
            DeValue::Integer(number) => {
                integer(&number).ok_or_else(|| wrong(&DeValue::Integer(number), expected))?
            }
            DeValue::Float(number) => match number.as_str().parse::<f64>() {
                // The infinite ones of TOML have no digits.
                Ok(value) if value.is_infinite() && number.as_str().contains(is_digit) => {
                    return Err(de::Error::custom("floating-point number overflowed"));
                }
                Ok(value) => Plain::Number(value),
                Err(_) => return Err(wrong(&DeValue::Float(number), expected)),
            },
            DeValue::Boolean(value) => Plain::Truth(value),
            // No type here is one.
            DeValue::Datetime(date) => {
                let at = self.span;
                let text = DeValue::String(date.to_string().into());
                let entry = (
                    Spanned::new(at.clone(), "date".into()),
                    Spanned::new(at, text),
                );
                Plain::Table(Pairs::new([entry].into_iter().collect()))
            }
            DeValue::Array(entries) => Plain::List(Entries(entries.into_iter())),
            DeValue::Table(table) => Plain::Table(Pairs::new(table)),
        })
    }

    /// The same where this is asked for.
    fn visit_as<V: Visitor<'i>>(self, asked: &str, visitor: V) -> Result<V::Value, Misfit> {
        let span = self.span.clone();
        if matches!(self.value, DeValue::Datetime(_)) {
            return Err(Misfit::wrong(in_words(&self.value), asked).at(&span));
        }
        self.visit(visitor)
            .map_err(|misfit| misfit.of(&span, asked))
    }
}

fn is_digit(c: char) -> bool {
    c.is_ascii_digit()
}

/// A value of a file as serde knows it.
enum Plain<'i> {
    Text(String),
    Signed(i64),
    Unsigned(u64),
    Number(f64),
    Truth(bool),
    List(Entries<'i>),
    Table(Pairs<'i>),
}

/// A whole number, if it has at most 64 bits.
fn integer<'i>(number: &DeInteger<'_>) -> Option<Plain<'i>> {
    let (digits, radix) = (number.as_str(), number.radix());
    let signed = i64::from_str_radix(digits, radix).map(Plain::Signed);
    let unsigned = || u64::from_str_radix(digits, radix).map(Plain::Unsigned);
    signed.or_else(|_| unsigned()).ok()
}

fn wrong(value: &DeValue<'_>, expected: &dyn de::Expected) -> Misfit {
    Misfit::wrong(in_words(value), expected)
}

/// A value that is no text, in words.
pub(crate) fn in_words(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(number) => format!("the number {}", number.as_str()),
        DeValue::Float(number) => format!("the number {}", number.as_str()),
        DeValue::Boolean(value) => format!("`{value}`"),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::String(_) => "a text".to_owned(),
    }
}

/// Methods that take a value as it is, and say what they have asked for if it is of another type.
macro_rules! as_it_is {
    ($($method:ident => $asked:expr),* $(,)?) => {
        $(fn $method<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
            self.visit_as($asked, visitor)
        })*
    };
}

const COUNT: &str = "a whole number, not negative";
const WHOLE: &str = "a whole number";
const NUMBER: &str = "a number";
const TEXT: &str = "a text in quotes";
const TABLE: &str = "a table";

impl<'i> Deserializer<'i> for Value<'i> {
    type Error = Misfit;

    as_it_is! {
        deserialize_bool => "true or false",
        deserialize_u8 => COUNT,
        deserialize_u16 => COUNT,
        deserialize_u32 => COUNT,
        deserialize_u64 => COUNT,
        deserialize_i8 => WHOLE,
        deserialize_i16 => WHOLE,
        deserialize_i32 => WHOLE,
        deserialize_i64 => WHOLE,
        deserialize_f32 => NUMBER,
        deserialize_f64 => NUMBER,
        deserialize_str => TEXT,
        deserialize_string => TEXT,
        deserialize_map => TABLE,
    }

    forward_to_deserialize_any! {
        <V: Visitor<'i>>
        char bytes byte_buf identifier unit_struct tuple_struct
    }

    fn deserialize_unit<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        match &self.value {
            DeValue::Table(table) if table.is_empty() => visitor.visit_unit(),
            DeValue::Array(entries) if entries.is_empty() => visitor.visit_unit(),
            other => Err(Misfit::wrong(in_words(other), "an empty table").at(&self.span)),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        visitor.visit_unit()
    }

    fn deserialize_any<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let span = self.span.clone();
        self.visit(visitor).map_err(|misfit| misfit.at(&span))
    }

    fn deserialize_option<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let span = self.span.clone();
        visitor.visit_some(self).map_err(|misfit| misfit.at(&span))
    }

    fn deserialize_newtype_struct<V: Visitor<'i>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        let span = self.span.clone();
        let read = visitor.visit_newtype_struct(self);
        read.map_err(|misfit| misfit.at(&span))
    }

    fn deserialize_seq<V: Visitor<'i>>(self, visitor: V) -> Result<V::Value, Misfit> {
        if matches!(self.value, DeValue::Table(_)) {
            return Err(Misfit::new(Kind::TableForList).at(&self.span));
        }
        self.visit_as(LIST, visitor)
    }

    fn deserialize_tuple<V: Visitor<'i>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        self.visit_as(&format!("a list of {length}"), visitor)
    }

    fn deserialize_struct<V: Visitor<'i>>(
        self,
        name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        if is_spanned(name) {
            let span = self.span.clone();
            return visitor.visit_map(SpannedDeserializer::new(self, span));
        }
        self.visit_as(TABLE, visitor)
    }

    fn deserialize_enum<V: Visitor<'i>>(
        self,
        _name: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        let read = match self.value {
            DeValue::String(name) => visitor.visit_enum(StrDeserializer::new(&name)),
            DeValue::Table(table) if table.len() == 1 => {
                let choice = MapAccessDeserializer::new(Pairs::new(table));
                visitor.visit_enum(choice)
            }
            other => Err(Misfit::new(Kind::NoChoice {
                found: in_words(&other),
                known,
            })),
        };
        read.map_err(|misfit| misfit.at(&self.span))
    }
}

impl<'i> IntoDeserializer<'i, Misfit> for Value<'i> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// Entries of a list.
struct Entries<'i>(<DeArray<'i> as IntoIterator>::IntoIter);

impl<'i> SeqAccess<'i> for Entries<'i> {
    type Error = Misfit;

    fn next_element_seed<T: DeserializeSeed<'i>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Misfit> {
        let entry = self.0.next();
        entry
            .map(|entry| seed.deserialize(Value::new(entry)))
            .transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

/// Keys and values of a table.
struct Pairs<'i> {
    rest: <DeTable<'i> as IntoIterator>::IntoIter,
    /// The key that was taken last, with its value.
    taken: Option<(DeString<'i>, Spanned<DeValue<'i>>)>,
}

impl<'i> Pairs<'i> {
    fn new(table: DeTable<'i>) -> Self {
        let rest = table.into_iter();
        Self { rest, taken: None }
    }

    /// Takes the next pair; its key.
    fn next_key(&mut self) -> Option<Value<'i>> {
        let (key, value) = self.rest.next()?;
        self.taken = Some((key.get_ref().clone(), value));
        Some(Value {
            span: key.span(),
            value: DeValue::String(key.into_inner()),
        })
    }

    /// The key that was taken last, and its value.
    fn last(&mut self) -> Result<(DeString<'i>, Value<'i>), Misfit> {
        let taken = self.taken.take();
        let (key, value) = taken.ok_or_else(|| Misfit::new(Kind::Other("no key".to_owned())))?;
        Ok((key, Value::new(value)))
    }
}

impl<'i> MapAccess<'i> for Pairs<'i> {
    type Error = Misfit;

    fn next_key_seed<K: DeserializeSeed<'i>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Misfit> {
        let Some(key) = self.next_key() else {
            return Ok(None);
        };
        let span = key.span.clone();
        let read = seed.deserialize(key);
        read.map(Some).map_err(|misfit| misfit.at(&span))
    }

    fn next_value_seed<T: DeserializeSeed<'i>>(&mut self, seed: T) -> Result<T::Value, Misfit> {
        let (key, value) = self.last()?;
        let span = value.span.clone();
        let read = seed.deserialize(value);
        read.map_err(|misfit| misfit.of_key(&span, &key))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}
