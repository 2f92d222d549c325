//! Targets smaller than the G-buffer: which of its texels a pixel stands for.

use glam::Mat4;

/// The resolution of a volume pass's target, relative to its G-buffer. Pixel (x, y) of the target is the
/// receiver of the G-buffer's texel (d x, d y), d being 1, 2 or 4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VolumeResolution {
    /// A pixel for each texel.
    #[default]
    Full,
    /// A pixel for every second texel in each direction.
    Half,
    /// A pixel for every fourth texel in each direction.
    Quarter,
}

impl VolumeResolution {
    /// Returns the distance of a target's pixels in the G-buffer's texels: 1, 2 or 4.
    pub fn divisor(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }

    /// Returns the size of the target for a G-buffer of this size.
    pub fn target_size(self, gbuffer: [u32; 2]) -> [u32; 2] {
        gbuffer.map(|side| side.div_ceil(self.divisor()))
    }

    /// Returns the matrix of the target's clip space whose pixels have their centers where the G-buffer
    /// has those of its texels.
    pub(super) fn clip_from_world(
        self,
        clip_from_world: [[f32; 4]; 4],
        gbuffer: [u32; 2],
    ) -> [[f32; 4]; 4] {
        if self == Self::Full {
            return clip_from_world;
        }
        let divisor = self.divisor() as f32;
        let target = self.target_size(gbuffer);
        // A texel's center x is that of the pixel (x - 1/2)/d + 1/2.
        let [[of_x, to_x], [of_y, to_y]] = [0, 1].map(|axis| {
            let [from, to] = [gbuffer[axis], target[axis]].map(|side| side as f32);
            let scale = from / (divisor * to);
            [scale, scale + (1.0 - divisor.recip()) / to - 1.0]
        });
        let mut reduced = Mat4::IDENTITY;
        reduced.x_axis.x = of_x;
        reduced.y_axis.y = of_y;
        // Rows count downwards.
        reduced.w_axis.x = to_x;
        reduced.w_axis.y = -to_y;
        (reduced * Mat4::from_cols_array_2d(&clip_from_world)).to_cols_array_2d()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_centered_on_the_texels_that_they_stand_for() {
        /// A few roundings of numbers up to 1, over the width of a pixel.
        const TOLERANCE: f32 = 1e-6;
        let identity = Mat4::IDENTITY.to_cols_array_2d();
        for resolution in [
            VolumeResolution::Full,
            VolumeResolution::Half,
            VolumeResolution::Quarter,
        ] {
            for size in [[64, 48], [65, 47], [3, 2]] {
                let target = resolution.target_size(size);
                let clip = resolution.clip_from_world(identity, size);
                let clip = Mat4::from_cols_array_2d(&clip);
                for pixel in [[0, 0], [target[0] - 1, target[1] - 1]] {
                    let texel = pixel.map(|at| at * resolution.divisor());
                    assert!(
                        (0..2).all(|axis| texel[axis] < size[axis]),
                        "{texel:?} {size:?}"
                    );
                    let ndc = |at: [u32; 2], size: [u32; 2]| {
                        let [x, y] = [0, 1].map(|i| (at[i] as f32 + 0.5) / size[i] as f32);
                        glam::Vec3::new(2.0 * x - 1.0, 1.0 - 2.0 * y, 0.5)
                    };
                    let found = clip.project_point3(ndc(texel, size));
                    let off = (found - ndc(pixel, target)).abs().max_element();
                    assert!(off <= TOLERANCE, "{resolution:?} {size:?} {pixel:?}: {off}");
                }
            }
        }
    }
}
