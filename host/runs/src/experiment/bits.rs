//! Numbers by their bits, for `#[serde(with)]`: what is read back is what was written, a NaN included.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers, however deep in lists.
pub(crate) trait Bits {
    /// As they are written.
    type Written: Serialize + DeserializeOwned;

    fn written(&self) -> Self::Written;

    fn read(written: Self::Written) -> Self;
}

impl Bits for f64 {
    type Written = u64;

    fn written(&self) -> u64 {
        self.to_bits()
    }

    fn read(written: u64) -> Self {
        Self::from_bits(written)
    }
}

impl<T: Bits> Bits for Vec<T> {
    type Written = Vec<T::Written>;

    fn written(&self) -> Self::Written {
        self.iter().map(T::written).collect()
    }

    fn read(written: Self::Written) -> Self {
        written.into_iter().map(T::read).collect()
    }
}

impl<T: Bits> Bits for Result<T, String> {
    type Written = Result<T::Written, String>;

    fn written(&self) -> Self::Written {
        self.as_ref().map(T::written).map_err(Clone::clone)
    }

    fn read(written: Self::Written) -> Self {
        written.map(T::read)
    }
}

pub(crate) fn serialize<T: Bits, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.written().serialize(to)
}

pub(crate) fn deserialize<'d, T: Bits, D: Deserializer<'d>>(from: D) -> Result<T, D::Error> {
    T::Written::deserialize(from).map(T::read)
}
