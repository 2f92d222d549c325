//! Numbers with ranges that are checked during deserialization, so that errors have a line.

use serde::de::{Deserialize, Deserializer, Error};

/// A number within the range of single floats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Finite(pub f64);

/// A finite number above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Positive(pub f64);

/// A finite number of zero or more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NonNegative(pub f64);

/// A whole number in `LO..=HI`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Whole<const LO: u32, const HI: u32>(pub u32);

/// Three numbers, one an axis; a single number stands for all three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OneOrThree<T>(pub [T; 3]);

/// A point or a direction.
pub(super) type Triple = [Finite; 3];

/// A linear color: red, green, blue, each zero or more.
pub(super) type Color = [NonNegative; 3];

impl Positive {
    pub(super) fn f32(self) -> f32 {
        self.0 as f32
    }
}

pub(super) fn triple(t: Triple) -> [f64; 3] {
    t.map(|v| v.0)
}

pub(super) fn color(c: Color) -> [f32; 3] {
    c.map(|v| v.0 as f32)
}

impl<'de> Deserialize<'de> for Finite {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let v = f64::deserialize(deserializer)?;
        // Meshes and renderers hold single floats.
        match v.abs() <= f64::from(f32::MAX) {
            true => Ok(Self(v)),
            false => Err(D::Error::custom(format!("{v} is not a usable number"))),
        }
    }
}

impl<'de> Deserialize<'de> for Positive {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Finite::deserialize(deserializer)?.0 {
            v if v >= f64::from(f32::MIN_POSITIVE) => Ok(Self(v)),
            v => Err(D::Error::custom(format!("{v} is not above zero"))),
        }
    }
}

impl<'de> Deserialize<'de> for NonNegative {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Finite::deserialize(deserializer)?.0 {
            v if v >= 0.0 => Ok(Self(v)),
            v => Err(D::Error::custom(format!("{v} is below zero"))),
        }
    }
}

impl<'de, const LO: u32, const HI: u32> Deserialize<'de> for Whole<LO, HI> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let v = i64::deserialize(deserializer)?;
        match u32::try_from(v) {
            Ok(n) if (LO..=HI).contains(&n) => Ok(Self(n)),
            _ => Err(D::Error::custom(format!("{v} is not in {LO}..={HI}"))),
        }
    }
}

impl<'de, T: Copy + Deserialize<'de>> Deserialize<'de> for OneOrThree<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<T>(std::marker::PhantomData<T>);
        impl<'de, T: Copy + Deserialize<'de>> serde::de::Visitor<'de> for Visitor<T> {
            type Value = [T; 3];

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("one number, or three in brackets")
            }

            fn visit_i64<E: Error>(self, v: i64) -> Result<[T; 3], E> {
                T::deserialize(serde::de::value::I64Deserializer::new(v)).map(|v| [v; 3])
            }

            fn visit_f64<E: Error>(self, v: f64) -> Result<[T; 3], E> {
                T::deserialize(serde::de::value::F64Deserializer::new(v)).map(|v| [v; 3])
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, seq: A) -> Result<[T; 3], A::Error> {
                <[T; 3]>::deserialize(serde::de::value::SeqAccessDeserializer::new(seq))
            }
        }
        let visitor = Visitor(std::marker::PhantomData);
        deserializer.deserialize_any(visitor).map(OneOrThree)
    }
}
