//! The arithmetic of the closed forms, generic over `f32` and `f64`.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The float types of the closed forms: `f32` and `f64`. The trait is sealed.
pub trait Real: Float {}

impl Real for f32 {}
impl Real for f64 {}

/// The sealing supertrait of [`Real`] in a private module: nobody else can implement it, so that
/// methods can be added.
pub trait Float:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    const ZERO: Self;
    const HALF: Self;
    const ONE: Self;
    const TWO: Self;
    const PI: Self;
    fn lit(x: f64) -> Self;
    fn sqrt(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn atan2(self, x: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;

    /// Returns `self` limited to `low..=high`. NaN becomes `low`, whereas `clamp` would keep it.
    fn within(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

macro_rules! impl_float {
    ($float:ident) => {
        impl Float for $float {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const PI: Self = std::$float::consts::PI;
            fn lit(x: f64) -> Self {
                x as $float
            }
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            fn sin(self) -> Self {
                self.sin()
            }
            fn cos(self) -> Self {
                self.cos()
            }
            fn atan2(self, x: Self) -> Self {
                self.atan2(x)
            }
            fn min(self, other: Self) -> Self {
                self.min(other)
            }
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            fn abs(self) -> Self {
                self.abs()
            }
        }
    };
}

impl_float!(f32);
impl_float!(f64);
