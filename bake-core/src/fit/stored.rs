//! The values of a texel of the moment encoding.

use crate::Moments;

/// The values that a texel of the moment encoding stores: v and √a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stored(pub [f64; 4]);

impl Stored {
    pub(super) fn of(moments: &Moments) -> Self {
        let [x, y, z] = moments.normalized_moment().map(f64::from);
        Self([x, y, z, f64::from(moments.a).sqrt()])
    }

    /// Returns `[x, y, z, a]`.
    pub(super) fn cell(self) -> [f32; 4] {
        let [x, y, z, root] = self.0;
        [x as f32, y as f32, z as f32, (root * root) as f32]
    }

    /// Returns the nearest values in range: |v| ≤ 1, √a in 0..=1.
    pub(super) fn clamped(self) -> Self {
        let [x, y, z, root] = self.0;
        let length = (x * x + y * y + z * z).sqrt().max(1.0);
        Self([x / length, y / length, z / length, root.clamp(0.0, 1.0)])
    }
}
