//! One occluder: a grid and the transform of its object.

#[cfg(test)]
mod tests;

use aogrid_grid_format::{ChannelRange, Encoding, Grid, GridSpec};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, Vec3};

use crate::AOGRID_NO_OBJECT;
use crate::grid_facts::GridFacts;

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
    /// Whether cones widen where the axes of neighboring cells disagree, as beside thin walls, also
    /// for a grid of [`Encoding::Cone`]. Those of [`Encoding::Moment`] always do. Costs nothing.
    pub soft_cones: bool,
    /// The AO at which the far field ends, 0..=1: beyond its box the object occludes like a sphere
    /// that fades with distance, up to where it would occlude a facing receiver less than this.
    /// `Some(0.0)` ends the occlusion at the box, as in the papers. `None` leaves the choice to the
    /// grid: [`Instance::FAR_FIELD`] for [`Encoding::Moment`], none for the papers' encodings. A
    /// grid whose outer cells are all open, as after a boundary treatment, has no far field.
    pub far_field: Option<f32>,
}

impl Instance {
    /// The threshold of the far field for grids that have one by default.
    pub const FAR_FIELD: f32 = 0.035;

    /// An instance of full strength that shades every receiver.
    pub fn at(world_from_object: [[f32; 4]; 4]) -> Self {
        Self {
            world_from_object,
            strength: 1.0,
            layers: u32::MAX,
            object_id: AOGRID_NO_OBJECT,
            excluded: [AOGRID_NO_OBJECT; 4],
            soft_cones: false,
            far_field: None,
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
    /// The threshold of the far field is outside 0..=1.
    #[error("the far field's threshold {0} is not in 0..=1")]
    FarField(f32),
}

/// The shader data of an occluder: the struct of the same name in the WGSL library, 208 bytes, for
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
    /// The length that axes have at least: 0 for soft cones, 1 for hard ones.
    pub min_axis_length: f32,
    /// The factors of a position relative to the box's center, in \[−½,½\]³, that reach 1 at the hull
    /// of the outer cells' centers; without a far field, at the box.
    pub per_hull: [f32; 3],
    /// 4, which turns distances from ¾ to 1 of the reach into a fade; 0 without a far field.
    pub fade_scale: f32,
    /// The factors of the same position that reach 1 where the effect ends.
    pub per_reach: [f32; 3],
    /// a is α times α, or times this if it is larger: 0 if the grid stores √a, 1 if it stores a.
    pub min_factor: f32,
    /// The box's center in world space.
    pub center: [f32; 3],
    pub(crate) unused_0: u32,
    /// The cells along each axis over the distance along its normal, in cells, at which a receiver on
    /// the occluder itself looks up the grid.
    pub per_step: [f32; 3],
    pub(crate) unused_1: u32,
    /// The object's flatness tells how fast its far field falls: 0 like a sphere's, 1 like a disc's
    /// that faces the receiver. It is the last number plus the others times the squares of the point on
    /// the hull.
    pub flatness: [f32; 4],
}

impl AogridOccluder {
    /// Builds an occluder from a grid and an instance. It searches the grid's outer cells, so that
    /// [`GridTexture::occluder`](crate::GridTexture::occluder) is faster each frame.
    ///
    /// # Errors
    ///
    /// If the transform is not affine, finite and invertible, or the strength or the threshold of
    /// the far field is outside 0..=1.
    pub fn new(grid: &Grid, instance: &Instance) -> Result<Self, InstanceError> {
        Self::of(&GridFacts::of(grid), instance)
    }

    pub(crate) fn of(facts: &GridFacts, instance: &Instance) -> Result<Self, InstanceError> {
        /// The shortest self offset in cells, in place of none: below the rounding of positions.
        const MIN_SELF_OFFSET: f32 = 1e-12;
        let GridFacts { spec, format, .. } = facts;
        let (reach, growth) = (reach(facts, instance), growth(facts, instance));
        let is_moment = facts.encoding == Encoding::Moment;
        let flag = |yes: bool| f32::from(u8::from(yes));
        let world_from_object = validated_transform(instance)?;
        let center = world_from_object
            .transform_point3(box_center(spec))
            .as_vec3();
        if !center.is_finite() {
            return Err(InstanceError::NotFinite);
        }
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
            min_axis_length: flag(!(is_moment || instance.soft_cones)),
            per_hull: (2.0 * reach.unwrap_or(DVec3::ONE) / growth)
                .as_vec3()
                .to_array(),
            fade_scale: if reach.is_some() { 4.0 } else { 0.0 },
            per_reach: (2.0 / growth).as_vec3().to_array(),
            min_factor: flag(!is_moment),
            center: center.to_array(),
            unused_0: 0,
            per_step: spec
                .resolution()
                .map(|n| n as f32 / facts.self_offset.max(MIN_SELF_OFFSET)),
            unused_1: 0,
            flatness: facts.flatness,
        })
    }
}

/// The distance from the box's center at which an occluder's far field ends along each axis, in
/// half-extents of the hull of the outer cells' centers; none without a far field.
fn reach(facts: &GridFacts, instance: &Instance) -> Option<DVec3> {
    /// The shortest reach. The far field fades over its last quarter, which must not begin within
    /// the hull.
    const MIN_REACH: f64 = 4.0 / 3.0;
    let by_default = match facts.encoding {
        Encoding::Moment => Instance::FAR_FIELD,
        Encoding::Cone | Encoding::Occlusion => 0.0,
    };
    let threshold = f64::from(instance.far_field.unwrap_or(by_default));
    let has_far_field = threshold > 0.0 && facts.distant_occlusion != [0.0; 3];
    has_far_field.then(|| {
        let squared = DVec3::from(facts.distant_occlusion) / threshold;
        squared.map(f64::sqrt).max(DVec3::splat(MIN_REACH))
    })
}

/// The size of the box in which an occluder has an effect, relative to its grid's box.
fn growth(facts: &GridFacts, instance: &Instance) -> DVec3 {
    let cells = glam::UVec3::from(facts.spec.resolution()).as_dvec3();
    match reach(facts, instance) {
        Some(reach) => reach * (cells - 1.0) / cells,
        None => DVec3::ONE,
    }
}

/// The map from \[0,1\]³ to the clip-space box that a raster pass draws, in columns: the box in which
/// the occluder has an effect. It is slightly enlarged, and mirrored if the instance is a reflection, so that its faces always have
/// the same winding.
pub(crate) fn clip_from_box(
    clip_from_world: [[f32; 4]; 4],
    facts: &GridFacts,
    instance: &Instance,
) -> Result<[[f32; 4]; 4], InstanceError> {
    /// The factor that enlarges the box, so that every pixel whose receiver is inside is covered
    /// despite the rasterizer's rounding.
    const GROWTH: f64 = 1.001;
    let world_from_object = validated_transform(instance)?;
    let mirrored = world_from_object.determinant() < 0.0;
    let mut size = GROWTH * growth(facts, instance);
    size.x = if mirrored { -size.x } else { size.x };
    let grow = DMat4::from_translation(DVec3::splat(0.5))
        * DMat4::from_scale(size)
        * DMat4::from_translation(DVec3::splat(-0.5));
    let clip_from_world = dmat4(clip_from_world);
    let clip_from_box = clip_from_world * world_from_object * object_from_grid(&facts.spec) * grow;
    finite(clip_from_box).map(|m| m.as_mat4().to_cols_array_2d())
}

/// The map from clip space to world space, in columns.
pub(crate) fn world_from_clip(
    clip_from_world: [[f32; 4]; 4],
) -> Result<[[f32; 4]; 4], InstanceError> {
    let inverse = dmat4(clip_from_world).inverse();
    finite(inverse).map(|m| m.as_mat4().to_cols_array_2d())
}

/// Returns the rows of a transform, and whether it is a reflection, if it and the strength are valid.
pub(crate) fn world_from_object(
    columns: [[f32; 4]; 4],
    strength: f32,
) -> Result<([[f32; 4]; 3], bool), InstanceError> {
    let instance = Instance {
        strength,
        ..Instance::at(columns)
    };
    let m = validated_transform(&instance)?;
    Ok((rows(m)?, m.determinant() < 0.0))
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
    match instance.far_field {
        Some(t) if !(0.0..=1.0).contains(&t) => return Err(InstanceError::FarField(t)),
        _ => {}
    }
    Ok(m)
}

/// Returns the center of the grid's box in object space.
fn box_center(spec: &GridSpec) -> DVec3 {
    DVec3::from(spec.origin()) + Vec3::from(spec.center()).as_dvec3()
}

fn object_from_grid(spec: &GridSpec) -> DMat4 {
    let half_extents = Vec3::from(spec.half_extents()).as_dvec3();
    DMat4::from_translation(box_center(spec) - half_extents) * DMat4::from_scale(2.0 * half_extents)
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
