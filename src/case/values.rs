//! The values of a case from the table of its text.
//!
//! What serde makes of a type is built for each kind of map that a reader may hand to it, and each type here is a
//! table of its own. The reader of `toml` has three kinds, of which two never stand in a case; here is one.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, Expected, IntoDeserializer, MapAccess,
    SeqAccess, Unexpected, Visitor,
};
use std::fmt::Display;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeInteger, DeString, DeTable, DeValue};

/// What is wrong with a value, and where in the text. Behind a pointer, as it is part of every result.
#[derive(Debug)]
pub(super) struct Wrong(Box<(String, Option<Range<usize>>)>);

impl Wrong {
    pub fn message(&self) -> &str {
        &self.0.0
    }

    pub fn span(&self) -> Option<Range<usize>> {
        self.0.1.clone()
    }

    /// The same; it is at `span` unless an inner place is known.
    fn at(mut self, span: &Range<usize>) -> Self {
        self.0.1.get_or_insert_with(|| span.clone());
        self
    }
}

impl Display for Wrong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.message())
    }
}

impl std::error::Error for Wrong {}

impl serde::de::Error for Wrong {
    fn custom<T: Display>(message: T) -> Self {
        Self(Box::new((message.to_string(), None)))
    }
}

/// What a table says.
pub(super) fn from_table<T: DeserializeOwned>(table: &Spanned<DeTable<'_>>) -> Result<T, Wrong> {
    // What is wrong with the whole has no place.
    T::deserialize(Value { of: Of::Table(table.get_ref()), span: 0..0 })
}

#[derive(Clone, Copy)]
enum Of<'a> {
    Text(&'a str),
    Integer(i64),
    /// Of more than 63 bits.
    Large(u64),
    Float(f64),
    Boolean(bool),
    List(&'a [Spanned<DeValue<'a>>]),
    Table(&'a DeTable<'a>),
    /// A date, or a number that is too large for any.
    Other(&'static str),
}

/// A value, and where it stands.
struct Value<'a> {
    of: Of<'a>,
    span: Range<usize>,
}

fn integer(written: &DeInteger<'_>) -> Of<'static> {
    let (digits, radix) = (written.as_str(), written.radix());
    let small = i64::from_str_radix(digits, radix).map(Of::Integer);
    let any = small.or_else(|_| u64::from_str_radix(digits, radix).map(Of::Large));
    any.unwrap_or(Of::Other("a whole number of more than 64 bits"))
}

fn float(written: &str) -> Of<'static> {
    match written.parse::<f64>() {
        Ok(x) if x.is_finite() || x.is_nan() || written.contains("inf") => Of::Float(x),
        _ => Of::Other("a number too large for any"),
    }
}

impl<'a> Value<'a> {
    fn of(value: &'a Spanned<DeValue<'a>>) -> Self {
        let of = match value.get_ref() {
            DeValue::String(text) => Of::Text(text),
            DeValue::Integer(written) => integer(written),
            DeValue::Float(written) => float(written.as_str()),
            DeValue::Boolean(yes) => Of::Boolean(*yes),
            DeValue::Datetime(_) => Of::Other("a date"),
            DeValue::Array(items) => Of::List(items),
            DeValue::Table(table) => Of::Table(table),
        };
        Self { of, span: value.span() }
    }

    /// It is not what is expected.
    fn other_than(&self, expected: &dyn Expected) -> Wrong {
        let found = match self.of {
            Of::Text(text) => Unexpected::Str(text),
            Of::Integer(n) => Unexpected::Signed(n),
            Of::Large(n) => Unexpected::Unsigned(n),
            Of::Float(x) => Unexpected::Float(x),
            Of::Boolean(yes) => Unexpected::Bool(yes),
            Of::List(_) => Unexpected::Seq,
            Of::Table(_) => Unexpected::Map,
            Of::Other(what) => Unexpected::Other(what),
        };
        Wrong::invalid_type(found, expected).at(&self.span)
    }

    fn number<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        let read = match self.of {
            Of::Integer(n) => visitor.visit_i64(n),
            Of::Large(n) => visitor.visit_u64(n),
            Of::Float(x) => visitor.visit_f64(x),
            _ => return Err(self.other_than(&visitor)),
        };
        read.map_err(|e: Wrong| e.at(&self.span))
    }

    fn text<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.of {
            Of::Text(text) => visitor.visit_str(text).map_err(|e: Wrong| e.at(&self.span)),
            _ => Err(self.other_than(&visitor)),
        }
    }

    fn list<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.of {
            Of::List(items) => visitor.visit_seq(Items(items.iter())).map_err(|e| e.at(&self.span)),
            _ => Err(self.other_than(&visitor)),
        }
    }

    fn table<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.of {
            Of::Table(table) => {
                let entries = Entries { rest: table.iter(), value: None };
                visitor.visit_map(entries).map_err(|e| e.at(&self.span))
            }
            _ => Err(self.other_than(&visitor)),
        }
    }
}

macro_rules! by {
    ($($kind:ident: $($method:ident)*;)*) => {$($(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
            self.$kind(visitor)
        }
    )*)*};
}

impl<'de> Deserializer<'de> for Value<'_> {
    type Error = Wrong;

    by! {
        number: deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_u128 deserialize_i8
            deserialize_i16 deserialize_i32 deserialize_i64 deserialize_i128 deserialize_f32 deserialize_f64;
        text: deserialize_char deserialize_str deserialize_string deserialize_identifier deserialize_bytes
            deserialize_byte_buf;
        list: deserialize_seq;
        table: deserialize_map;
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.of {
            Of::Text(_) => self.text(visitor),
            Of::Boolean(_) => self.deserialize_bool(visitor),
            Of::List(_) => self.list(visitor),
            Of::Table(_) => self.table(visitor),
            // Nothing that has several forms has this one, and it says so in its own words.
            Of::Other(_) => visitor.visit_unit().map_err(|e: Wrong| e.at(&self.span)),
            Of::Integer(_) | Of::Large(_) | Of::Float(_) => self.number(visitor),
        }
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.of {
            Of::Boolean(yes) => visitor.visit_bool(yes).map_err(|e: Wrong| e.at(&self.span)),
            _ => Err(self.other_than(&visitor)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        visitor.visit_some(self)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        visitor.visit_unit()
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        Err(self.other_than(&visitor))
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &str, visitor: V) -> Result<V::Value, Wrong> {
        Err(self.other_than(&visitor))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &str, visitor: V) -> Result<V::Value, Wrong> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Wrong> {
        self.list(visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &str,
        _: usize,
        visitor: V,
    ) -> Result<V::Value, Wrong> {
        self.list(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(self, _: &str, _: &[&str], visitor: V) -> Result<V::Value, Wrong> {
        self.table(visitor)
    }

    /// One of several names: none of them has values of its own.
    fn deserialize_enum<V: Visitor<'de>>(self, _: &str, _: &[&str], visitor: V) -> Result<V::Value, Wrong> {
        let read = match self.of {
            Of::Text(name) => visitor.visit_enum(IntoDeserializer::<Wrong>::into_deserializer(name)),
            _ => Err(Wrong::custom("expected one of its names in quotes")),
        };
        read.map_err(|e| e.at(&self.span))
    }
}

/// What is left of a list.
struct Items<'a>(std::slice::Iter<'a, Spanned<DeValue<'a>>>);

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = Wrong;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Wrong> {
        self.0.next().map(|item| seeded(seed, item)).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

/// What is left of a table, and the value of the last key.
struct Entries<'a> {
    rest: toml::map::Iter<'a, Spanned<DeString<'a>>, Spanned<DeValue<'a>>>,
    value: Option<&'a Spanned<DeValue<'a>>>,
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = Wrong;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Wrong> {
        let Some((key, value)) = self.rest.next() else { return Ok(None) };
        self.value = Some(value);
        let name = StrDeserializer::new(key.get_ref());
        seed.deserialize(name).map(Some).map_err(|e: Wrong| e.at(&key.span()))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Wrong> {
        let value = self.value.take().ok_or_else(|| Wrong::custom("a value without a key"))?;
        seeded(seed, value)
    }
}

/// What serde says once it has tried all forms of a value knows no place.
fn seeded<'de, T: DeserializeSeed<'de>>(seed: T, value: &Spanned<DeValue<'_>>) -> Result<T::Value, Wrong> {
    seed.deserialize(Value::of(value)).map_err(|e| e.at(&value.span()))
}

#[cfg(test)]
mod tests {
    use super::super::Case;
    use super::super::opening::Rate;
    use super::*;
    use std::collections::BTreeMap;

    fn read<T: DeserializeOwned>(text: &str) -> Result<T, Wrong> {
        from_table(&DeTable::parse(text).unwrap())
    }

    #[test]
    fn a_case_reads_as_by_toml() {
        let text = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -9.81]\n[fluid]\n\
                    [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n[[body]]\nname = 'a'\nshape = 'sphere'\nradius = 0.1\ncenter = [2, 0, 0]\n\
                    density = 500\n[[inflow]]\nname = 'in'\nface = 'x_min'\ndischarge = [[0, 1], [1, 2.5]]\n";
        let (ours, theirs): (Case, Case) = (read(text).unwrap(), toml::from_str(text).unwrap());
        assert_eq!(format!("{ours:?}"), format!("{theirs:?}"));
        type Numbers = BTreeMap<String, f64>;
        let text = "a = 1\nb = 0x1f\nc = -2.5e3\nd = 1_000.5\ne = inf\nf = -inf\ng = 18446744073709551615";
        assert_eq!(read::<Numbers>(text).unwrap(), toml::from_str(text).unwrap());
        let text = "a = [0, 7]\nb = []\nc = [1_0]";
        type Lists = BTreeMap<String, Vec<u32>>;
        assert_eq!(read::<Lists>(text).unwrap(), toml::from_str(text).unwrap());
    }

    #[test]
    fn what_is_wrong_has_its_place() {
        let wrong = |text: &'static str| {
            let wrong = read::<BTreeMap<String, Vec<Rate>>>(text).unwrap_err();
            (wrong.message().to_owned(), &text[wrong.span().unwrap()])
        };
        let rate = "expected a number, or rows of time [s] and value";
        assert_eq!(wrong("a = [1, true]"), (rate.into(), "true"));
        assert_eq!(wrong("a = [1, 1979-05-27]"), (rate.into(), "1979-05-27"));
        assert_eq!(
            wrong("a = 1e999"),
            ("invalid type: a number too large for any, expected a sequence".into(), "1e999")
        );
    }
}
