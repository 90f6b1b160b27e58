//! How long lists of numbers are written and read: where nobody is to read them, as their bytes in pieces. One by one
//! they cost a tenth of a second for a state of 45 MB, in which nothing else is done.

use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// Numbers of a piece.
const PIECE: usize = 2048;
/// Bytes of a number.
const SIZE: usize = size_of::<f64>();

/// Writes a list.
///
/// # Errors
/// Those of the writer.
pub(crate) fn serialize<S: Serializer>(
    values: &(impl AsRef<[f64]> + ?Sized),
    to: S,
) -> Result<S::Ok, S::Error> {
    if to.is_human_readable() {
        return values.as_ref().serialize(to);
    }
    let pieces = values.as_ref().chunks(PIECE);
    let mut list = to.serialize_seq(Some(pieces.len()))?;
    let mut bytes = Vec::new();
    for piece in pieces {
        put(piece, &mut bytes);
        list.serialize_element(&Written(&bytes))?;
    }
    list.end()
}

/// Reads a list.
///
/// # Errors
/// Those of the reader, or a piece ends within a number.
pub(crate) fn deserialize<'d, D: Deserializer<'d>, T: From<Vec<f64>>>(
    from: D,
) -> Result<T, D::Error> {
    if from.is_human_readable() {
        return Vec::deserialize(from).map(T::from);
    }
    from.deserialize_seq(List(PhantomData))
}

fn put(values: &[f64], bytes: &mut Vec<u8>) {
    bytes.resize(values.len() * SIZE, 0);
    let (places, _) = bytes.as_chunks_mut::<SIZE>();
    for (place, value) in places.iter_mut().zip(values) {
        *place = value.to_le_bytes();
    }
}

/// Appends the numbers; `None` if the bytes end within one.
fn take(bytes: &[u8], values: &mut Vec<f64>) -> Option<()> {
    let (places, rest) = bytes.as_chunks::<SIZE>();
    values.extend(places.iter().map(|&place| f64::from_le_bytes(place)));
    rest.is_empty().then_some(())
}

struct Written<'b>(&'b [u8]);

impl Serialize for Written<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(self.0)
    }
}

struct List<T>(PhantomData<T>);

impl<'d, T: From<Vec<f64>>> Visitor<'d> for List<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("numbers in pieces")
    }

    fn visit_seq<A: SeqAccess<'d>>(self, mut pieces: A) -> Result<T, A::Error> {
        let mut values = Vec::new();
        while let Some(Read(piece)) = pieces.next_element()? {
            values.extend(piece);
        }
        Ok(values.into())
    }
}

/// The numbers of one piece.
struct Read(Vec<f64>);

impl<'d> Deserialize<'d> for Read {
    fn deserialize<D: Deserializer<'d>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_bytes(Piece).map(Self)
    }
}

struct Piece;

impl Visitor<'_> for Piece {
    type Value = Vec<f64>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes of whole numbers")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<f64>, E> {
        let mut values = Vec::with_capacity(bytes.len() / SIZE);
        take(bytes, &mut values).ok_or_else(|| E::invalid_length(bytes.len(), &self))?;
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_as_they_were() {
        let values = [0.0, -0.0, 1.5e-310, f64::NEG_INFINITY, f64::NAN, 0.1];
        let mut bytes = Vec::new();
        put(&[3.0; 9], &mut bytes);
        put(&values, &mut bytes);
        let mut read = Vec::new();
        assert_eq!(take(&bytes, &mut read), Some(()));
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&values));
        assert_eq!(take(&bytes[1..], &mut read), None);
    }
}
