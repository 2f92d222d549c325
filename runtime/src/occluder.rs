//! One occluder: a grid and the transform of its object.

use aogrid_grid_format::{ChannelRange, GridSpec, TexelFormat};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, Vec3};

use crate::AOGRID_NO_OBJECT;

/// An instance of an object: its transform and the receivers that it shades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The map from object space to world space, in columns, as in WGSL and glam. Rotation, uniform
    /// scale, reflection and translation are exact. A non-uniform scale changes solid angles: the
    /// baked values are then an approximation.
    pub world_from_object: [[f32; 4]; 4],
    /// The strength of the occlusion: 0 for none, 1 as baked.
    pub strength: f32,
    /// A mask: the occluder shades receivers that share a bit with it.
    pub layers: u32,
    /// The id of its own pixels in the G-buffer, or [`AOGRID_NO_OBJECT`]. Occlusion-only shading
    /// needs it to shade the object itself.
    pub object_id: u32,
    /// The ids of up to four receivers that it does not shade, for example its own; unused slots
    /// hold [`AOGRID_NO_OBJECT`].
    pub excluded: [u32; 4],
}

impl Instance {
    /// An instance of full strength that shades every receiver.
    pub fn at(world_from_object: [[f32; 4]; 4]) -> Self {
        Self {
            world_from_object,
            strength: 1.0,
            layers: u32::MAX,
            object_id: AOGRID_NO_OBJECT,
            excluded: [AOGRID_NO_OBJECT; 4],
        }
    }
}

/// The reasons why an instance cannot be shaded.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InstanceError {
    /// A number is infinite or NaN, or becomes so.
    #[error("the transform has numbers that are not finite, or too large or too small to invert")]
    NotFinite,
    /// The matrix is a projection instead of an affine transform.
    #[error("the transform's last row is {0:?} instead of [0, 0, 0, 1]: it is not affine")]
    NotAffine([f32; 4]),
    /// The transform flattens the object.
    #[error("the transform cannot be inverted: it scales some direction to zero")]
    Singular,
    /// The strength is outside 0..=1.
    #[error("strength {0} is not in 0..=1")]
    Strength(f32),
}

/// The shader data of an occluder: the struct of the same name in the WGSL library, 128 bytes, for
/// a uniform or storage buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AogridOccluder {
    /// First row of grid_from_world, which maps a world position to \[0,1\]³ of the grid's box.
    pub grid_x: [f32; 4],
    /// Second row.
    pub grid_y: [f32; 4],
    /// Third row.
    pub grid_z: [f32; 4],
    /// First row of the map from a texel's rgb to the cone's axis in world space.
    pub axis_x: [f32; 4],
    /// Second row.
    pub axis_y: [f32; 4],
    /// Third row.
    pub axis_z: [f32; 4],
    /// The ids of receivers that it does not shade.
    pub excluded: [u32; 4],
    /// Its own id.
    pub object_id: u32,
    /// A mask: the occluder shades receivers that share a bit with it.
    pub layers: u32,
    /// 0..=1.
    pub strength: f32,
    /// 1 − strength.
    pub one_minus_strength: f32,
}

impl AogridOccluder {
    /// Builds an occluder from a grid's specification and texel format, and an instance.
    ///
    /// # Errors
    ///
    /// If the transform is not affine, finite and invertible, or the strength is outside 0..=1.
    pub fn new(
        spec: &GridSpec,
        format: TexelFormat,
        instance: &Instance,
    ) -> Result<Self, InstanceError> {
        let world_from_object = validated_transform(instance)?;
        let grid_from_world = (world_from_object * object_from_grid(spec)).inverse();
        let [scale, offset] = format.decoding(ChannelRange::Signed);
        let [grid_x, grid_y, grid_z] = rows(grid_from_world)?;
        let [axis_x, axis_y, axis_z] = rows(axis_from_texel(world_from_object, scale, offset))?;
        Ok(Self {
            grid_x,
            grid_y,
            grid_z,
            axis_x,
            axis_y,
            axis_z,
            excluded: instance.excluded,
            object_id: instance.object_id,
            layers: instance.layers,
            strength: instance.strength,
            one_minus_strength: 1.0 - instance.strength,
        })
    }
}

/// The map from \[0,1\]³ to the clip-space box that a raster pass draws, in columns. The box is
/// slightly enlarged, and mirrored if the instance is a reflection, so that its faces always have
/// the same winding.
pub(crate) fn clip_from_box(
    clip_from_world: [[f32; 4]; 4],
    spec: &GridSpec,
    instance: &Instance,
) -> Result<[[f32; 4]; 4], InstanceError> {
    /// The factor that enlarges the box, so that every pixel whose receiver is inside is covered
    /// despite the rasterizer's rounding.
    const GROWTH: f64 = 1.001;
    let world_from_object = validated_transform(instance)?;
    let mirrored = world_from_object.determinant() < 0.0;
    let size = DVec3::new(if mirrored { -GROWTH } else { GROWTH }, GROWTH, GROWTH);
    let grow = DMat4::from_translation(DVec3::splat(0.5))
        * DMat4::from_scale(size)
        * DMat4::from_translation(DVec3::splat(-0.5));
    let clip_from_world = dmat4(clip_from_world);
    let clip_from_box = clip_from_world * world_from_object * object_from_grid(spec) * grow;
    finite(clip_from_box).map(|m| m.as_mat4().to_cols_array_2d())
}

/// The map from clip space to world space, in columns.
pub(crate) fn world_from_clip(
    clip_from_world: [[f32; 4]; 4],
) -> Result<[[f32; 4]; 4], InstanceError> {
    let inverse = dmat4(clip_from_world).inverse();
    finite(inverse).map(|m| m.as_mat4().to_cols_array_2d())
}

/// Returns the instance's transform, if the instance is valid.
fn validated_transform(instance: &Instance) -> Result<DMat4, InstanceError> {
    let m = finite(dmat4(instance.world_from_object))?;
    let last = m.row(3).as_vec4().to_array();
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(InstanceError::NotAffine(last));
    }
    if m.determinant() == 0.0 {
        return Err(InstanceError::Singular);
    }
    if !(0.0..=1.0).contains(&instance.strength) {
        return Err(InstanceError::Strength(instance.strength));
    }
    Ok(m)
}

fn object_from_grid(spec: &GridSpec) -> DMat4 {
    let center = DVec3::from(spec.origin()) + Vec3::from(spec.center()).as_dvec3();
    let half_extents = Vec3::from(spec.half_extents()).as_dvec3();
    DMat4::from_translation(center - half_extents) * DMat4::from_scale(2.0 * half_extents)
}

/// The map from a texel's rgb to the axis: the decoding, then the instance's linear part divided by
/// its scale. Axes about keep their stored length at any scale, so that one threshold serves all.
fn axis_from_texel(world_from_object: DMat4, scale: f64, offset: f64) -> DMat4 {
    let size = world_from_object.determinant().abs().cbrt();
    let mut linear = world_from_object * (1.0 / size);
    linear.w_axis = glam::DVec4::W;
    linear * DMat4::from_translation(DVec3::splat(offset)) * DMat4::from_scale(DVec3::splat(scale))
}

/// The upper three rows.
fn rows(m: DMat4) -> Result<[[f32; 4]; 3], InstanceError> {
    let m = finite(m)?;
    Ok([0, 1, 2].map(|row| m.row(row).as_vec4().to_array()))
}

/// Returns the matrix, if it is finite in single precision too.
fn finite(m: DMat4) -> Result<DMat4, InstanceError> {
    match m.as_mat4().is_finite() {
        true => Ok(m),
        false => Err(InstanceError::NotFinite),
    }
}

fn dmat4(columns: [[f32; 4]; 4]) -> DMat4 {
    glam::Mat4::from_cols_array_2d(&columns).as_dmat4()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Mat4;

    const IDENTITY: [[f32; 4]; 4] = Mat4::IDENTITY.to_cols_array_2d();

    fn spec() -> GridSpec {
        GridSpec::new([8, 9, 10], [1.0, 2.0, 3.0], [0.5, 1.0, 2.0]).unwrap()
    }

    fn refusal(instance: Instance) -> InstanceError {
        AogridOccluder::new(&spec(), TexelFormat::F32, &instance).unwrap_err()
    }

    #[test]
    fn invalid_transforms_and_strengths_are_refused() {
        let with = |column: usize, row: usize, value: f32| {
            let mut m = IDENTITY;
            m[column][row] = value;
            refusal(Instance::at(m))
        };
        assert_eq!(with(1, 1, 0.0), InstanceError::Singular);
        assert_eq!(with(3, 0, f32::NAN), InstanceError::NotFinite);
        assert_eq!(with(0, 0, 1e-45), InstanceError::NotFinite);
        assert_eq!(
            with(2, 3, -1.0),
            InstanceError::NotAffine([0.0, 0.0, -1.0, 1.0])
        );
        for strength in [-0.1, 1.5, f32::NAN] {
            let instance = Instance {
                strength,
                ..Instance::at(IDENTITY)
            };
            assert!(matches!(refusal(instance), InstanceError::Strength(_)));
        }
    }

    #[test]
    fn unorm8_directions_decode_as_the_format_says() {
        use crate::shading::aogrid_axis;
        let occluder =
            AogridOccluder::new(&spec(), TexelFormat::Unorm8, &Instance::at(IDENTITY)).unwrap();
        for (byte, expected) in [(1_u8, -1.0_f32), (128, 0.0), (255, 1.0)] {
            let t = f32::from(byte) / 255.0;
            let axis = aogrid_axis(&occluder, [t, 128.0 / 255.0, t]);
            // The combined map rounds at the magnitude of 1.
            assert!((axis[0] - expected).abs() < 2e-7 && axis[1].abs() < 2e-7);
            assert_eq!(axis[0], axis[2]);
        }
    }
}
