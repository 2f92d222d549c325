//! The CPU twin of `environment.wgsl`: the same functions under the same names, in single floats.
//!
//! # Theory
//!
//! A diffuse receiver reflects B − AO · A of an environment (RR-5779, 5.3): B is the mean radiance
//! of its hemisphere and A that of the occluded directions, both weighted by the cosine to the
//! normal, so that a constant sky leaves (1 − AO) · B. The paper prints B − A, which is zero under
//! a constant sky. A glossy receiver reflects B − k · A: B is the mean radiance of a lobe around
//! the mirror direction, k the occluded share of the lobe, and A the mean radiance of that share.
//!
//! The accumulated occluders have an AO and an axis d, the normalized sum of all (AO/2) d′. The
//! paper's cone covers AO/2 around d, which has that AO only where d is 60° from the normal. Ours
//! has the fraction a with AO = 4a(1 − a) cos β, which holds for every cone above the horizon. Its
//! directions are weighted by the cosine to the normal: the mean of ω (n·ω) over the cone points
//! along 3c(1 + c)(d·n) d + (1 − c)(2 + c) n, with c = 1 − 2a. A is looked up in that direction,
//! with the weights that the map's levels have within a cone. Compared with ray tracing, this
//! leaves about a third of the error of a look-up around d (`docs/runtime.md`).
//!
//! Several occluders are not one cone: |Σ (AO/2) d′| < AO/2. We widen the cone until its mean
//! direction is as short and lower its density accordingly, so that a floor between two objects
//! does not reflect a phantom object in the middle. AO already contains a cosine, so the sum is the
//! cosine-weighted mean of the occluders: c belongs to the fraction a that they cover, not to the
//! wider cone over which they are spread.
//!
//! A lobe has no cosine weight. Its intersection with the occluded cone is looked up at the middle
//! of that lens, and the lobe itself only as far as it lies above the horizon: a completely
//! occluded lobe is black.

use aogrid_tables::merge;
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3};

use crate::EnvironmentMap;
use crate::shading::{AogridCone, aogrid_inverse_length};
use crate::wgsl::{
    AOGRID_AXIS_EPSILON, AOGRID_ENVIRONMENT_HEIGHT, AOGRID_ENVIRONMENT_LAST_LEVEL,
    AOGRID_FRACTION_EPSILON, AOGRID_PI,
};

/// The orientation and scale of an environment map: the struct of the same name in the WGSL
/// library, 64 bytes, for a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AogridEnvironment {
    /// First row of map_from_world, a rotation; the fourth number is not used.
    pub map_x: [f32; 4],
    /// Second row.
    pub map_y: [f32; 4],
    /// Third row.
    pub map_z: [f32; 4],
    /// Multiplies the map's radiance: red, green, blue; the fourth number is not used.
    pub scale: [f32; 4],
}

/// The axis of the world that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// The axis +y, as in the map.
    Y,
    /// The axis +z: the world's −y is the map's +z.
    Z,
}

impl AogridEnvironment {
    /// Places the map upright in the world, rotated about the up axis by `yaw` radians,
    /// counter-clockwise as seen from above.
    pub fn new(up: Up, yaw: f32) -> Self {
        let upright = match up {
            Up::Y => Mat3::IDENTITY,
            Up::Z => Mat3::from_cols(Vec3::X, -Vec3::Z, Vec3::Y),
        };
        let map_from_world = Mat3::from_rotation_y(-yaw) * upright;
        Self::from_rotation(map_from_world.transpose().to_cols_array_2d())
    }

    /// Places the map by the rows of a rotation from world axes to the map's axes.
    pub fn from_rotation(map_from_world: [[f32; 3]; 3]) -> Self {
        let [map_x, map_y, map_z] = map_from_world.map(|[x, y, z]| [x, y, z, 0.0]);
        Self {
            map_x,
            map_y,
            map_z,
            scale: [1.0, 1.0, 1.0, 0.0],
        }
    }

    /// Returns the same placement, with the map's radiance multiplied by a color.
    pub fn scaled(self, [r, g, b]: [f32; 3]) -> Self {
        Self {
            scale: [r, g, b, 0.0],
            ..self
        }
    }
}

// ---- One call per pixel ------------------------------------------------------------------------

/// The light that a white diffuse surface reflects: the mean radiance of its hemisphere, less AO
/// times that of the occluded cone. `accumulated`: the sum of all (AO/2) d′ and the product of all
/// 1 − AO.
pub fn aogrid_lambertian(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    accumulated: [f32; 4],
    normal: [f32; 3],
) -> [f32; 3] {
    let unoccluded = aogrid_irradiance(environment, map, normal);
    let cone = aogrid_cosine_weighted_cone(&aogrid_occluded_cone(accumulated, normal), normal);
    let blocked = aogrid_cone_radiance(environment, map, &cone);
    subtract_clamped(unoccluded, 1.0 - accumulated[3], blocked)
}

/// The light that a glossy surface reflects: the mean radiance of a lobe, less the occluded share
/// of the lobe times the mean radiance of that share. The lobe is a cone of `lobe_fraction` around
/// the mirror direction, as far as it lies above the surface.
pub fn aogrid_glossy(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    accumulated: [f32; 4],
    normal: [f32; 3],
    mirrored: [f32; 3],
    lobe_fraction: f32,
) -> [f32; 3] {
    let full_lobe = AogridCone::new(mirrored, lobe_fraction);
    let lobe = aogrid_shared_cone(&full_lobe, &AogridCone::new(normal, 0.5));
    let blocked_cone = aogrid_shared_cone(&full_lobe, &aogrid_occluded_cone(accumulated, normal));
    let covered = blocked_cone.fraction / lobe.fraction.max(AOGRID_FRACTION_EPSILON);
    let share = blocked_cone.density * covered.clamp(0.0, 1.0);
    let unoccluded = aogrid_cone_radiance(environment, map, &lobe);
    let blocked = aogrid_cone_radiance(environment, map, &blocked_cone);
    subtract_clamped(unoccluded, share, blocked)
}

/// The direction in which a surface mirrors a viewer: `eye` is a position and 1, or a direction
/// towards the viewer and 0.
pub fn aogrid_mirrored(eye: [f32; 4], position: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let [x, y, z, w] = eye;
    let towards = Vec3::new(x, y, z) - w * Vec3::from(position);
    let view = towards * aogrid_inverse_length(towards.to_array());
    let normal = Vec3::from(normal);
    (2.0 * view.dot(normal) * normal - view).to_array()
}

// ---- Cones -------------------------------------------------------------------------------------

/// The cone that a pixel's occluders block, as seen by the receiver. The sum of all (AO/2) d′ has
/// the length AO/2 for occluders in one direction and is shorter for occluders in several. The cone
/// is then widened until the mean of its directions is shorter by the same factor, and its density
/// lowered accordingly.
pub fn aogrid_occluded_cone(accumulated: [f32; 4], normal: [f32; 3]) -> AogridCone {
    let [x, y, z, transmittance] = accumulated;
    let sum = Vec3::new(x, y, z);
    let axis = match sum.length_squared() > AOGRID_AXIS_EPSILON {
        true => sum * aogrid_inverse_length(sum.to_array()),
        false => normal.into(),
    };
    let occlusion = 1.0 - transmittance;
    let alignment = 2.0 * sum.length() / occlusion.max(AOGRID_FRACTION_EPSILON);
    let fraction = aogrid_occluded_fraction(occlusion, axis.dot(normal.into()));
    let widened = (1.0 - alignment.clamp(0.0, 1.0) * (1.0 - fraction)).min(0.5);
    AogridCone {
        axis: axis.to_array(),
        fraction: widened,
        density: fraction / widened.max(AOGRID_FRACTION_EPSILON),
    }
}

/// The fraction a of a cone with this AO and its axis at `cos_beta` to the normal: AO = 4a(1 − a)
/// cos β, exact for a cone above the horizon.
pub fn aogrid_occluded_fraction(occlusion: f32, cos_beta: f32) -> f32 {
    let sin_alpha_squared = (occlusion / cos_beta.max(AOGRID_FRACTION_EPSILON)).clamp(0.0, 1.0);
    0.5 - 0.5 * (1.0 - sin_alpha_squared).sqrt()
}

/// The cone as a diffuse receiver weights it: around the mean of its directions, each weighted by
/// its cosine to the normal. The weights are those of the fraction that it covers: if it is spread
/// over several occluders, their sum of (AO/2) d′ already contains the cosine of each.
pub fn aogrid_cosine_weighted_cone(cone: &AogridCone, normal: [f32; 3]) -> AogridCone {
    let (axis, normal) = (Vec3::from(cone.axis), Vec3::from(normal));
    let c = 1.0 - 2.0 * cone.fraction * cone.density;
    let along = 3.0 * c * (1.0 + c) * axis.dot(normal).max(AOGRID_FRACTION_EPSILON);
    let sum = along * axis + (1.0 - c) * (2.0 + c) * normal;
    AogridCone {
        axis: (sum * aogrid_inverse_length(sum.to_array())).to_array(),
        ..*cone
    }
}

/// The intersection of two cones, as a cone of the shared fraction around the middle of the lens.
/// The middle lies on the arc between the axes. For cones of one size it is halfway along the part
/// of the arc that both cover. If a larger cone cuts a smaller one, it is nearer to the smaller
/// one's axis the less is cut off: we interpolate by the fourth root of the fraction cut off, which
/// is within 0.02 of the smaller cone's radius.
pub fn aogrid_shared_cone(first: &AogridCone, second: &AogridCone) -> AogridCone {
    let (axis, other) = (Vec3::from(first.axis), Vec3::from(second.axis));
    let cos_gamma = axis.dot(other);
    let across = other - cos_gamma * axis;
    let gamma = across.length().atan2(cos_gamma);
    let a = [first.fraction, second.fraction];
    let alpha = a.map(aogrid_half_angle);
    let fraction = aogrid_shared_fraction(a, alpha, gamma);
    // Positions on the arc, as angles from the first axis.
    let halfway = 0.5 * ((-alpha[0]).max(gamma - alpha[1]) + alpha[0].min(gamma + alpha[1]));
    let smaller_center = if a[0] <= a[1] { 0.0 } else { gamma };
    let fraction_cut_off =
        (1.0 - fraction / a[0].min(a[1]).max(AOGRID_FRACTION_EPSILON)).clamp(0.0, 1.0);
    let middle: f32 = smaller_center + (halfway - smaller_center) * fraction_cut_off.sqrt().sqrt();
    let towards = across * aogrid_inverse_length(across.to_array());
    AogridCone {
        axis: (middle.cos() * axis + middle.sin() * towards).to_array(),
        fraction,
        density: first.density * second.density,
    }
}

/// The half-angle of a cone of this fraction.
pub fn aogrid_half_angle(fraction: f32) -> f32 {
    2.0 * fraction.sqrt().atan2((1.0 - fraction).sqrt())
}

/// The fraction of the sphere inside two cones, each of at most a hemisphere, with axes gamma
/// apart. The WGSL also uses the half-angles, which the tables' own function does not need.
pub fn aogrid_shared_fraction(a: [f32; 2], _alpha: [f32; 2], gamma: f32) -> f32 {
    merge::intersection(a[0], a[1], gamma)
}

// ---- Radiance ----------------------------------------------------------------------------------

/// The irradiance divided by π: the mean radiance of a hemisphere, weighted by the cosine.
pub fn aogrid_irradiance(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    normal: [f32; 3],
) -> [f32; 3] {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, normal));
    let radiance = aogrid_environment_at(map, at, AOGRID_ENVIRONMENT_LAST_LEVEL);
    scaled(environment, radiance)
}

/// The mean radiance of a cone, weighted by the cosine to its axis. Cones narrower than those of
/// level 0 use level 0.
pub fn aogrid_cone_radiance(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    cone: &AogridCone,
) -> [f32; 3] {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, cone.axis));
    let level = aogrid_environment_level(cone.fraction);
    let below = level.floor().min(AOGRID_ENVIRONMENT_LAST_LEVEL - 1.0);
    let narrow = aogrid_environment_at(map, at, below);
    let wide = aogrid_environment_at(map, at, below + 1.0);
    let mixed = std::array::from_fn(|c| narrow[c] + (wide[c] - narrow[c]) * (level - below));
    scaled(environment, mixed)
}

/// Rotates a world direction into the map's axes.
pub fn aogrid_map_direction(environment: &AogridEnvironment, direction: [f32; 3]) -> [f32; 3] {
    let rows = [environment.map_x, environment.map_y, environment.map_z];
    rows.map(|[x, y, z, _]| Vec3::new(x, y, z).dot(direction.into()))
}

/// The latitude-longitude coordinates of a direction of any length: turns from the left edge, and
/// half turns from the north pole.
pub fn aogrid_environment_coordinate([x, y, z]: [f32; 3]) -> [f32; 2] {
    let azimuth = x.atan2(z);
    let colatitude = (x * x + z * z).sqrt().atan2(y);
    [azimuth * (-0.5 / AOGRID_PI) + 0.5, colatitude / AOGRID_PI]
}

/// The level of the map whose cones cover this fraction, interpolated by its logarithm.
pub fn aogrid_environment_level(fraction: f32) -> f32 {
    let doubled = (2.0 * fraction).max(AOGRID_FRACTION_EPSILON);
    let level = AOGRID_ENVIRONMENT_LAST_LEVEL + 0.5 * doubled.log2();
    level.clamp(0.0, AOGRID_ENVIRONMENT_LAST_LEVEL)
}

/// Samples a level of the map, whose rows lie on colatitudes from pole to pole.
pub fn aogrid_environment_at(map: &EnvironmentMap, [u, v]: [f32; 2], level: f32) -> [f32; 3] {
    let row = level.exp2() / AOGRID_ENVIRONMENT_HEIGHT;
    map.sample([u, v * (1.0 - row) + 0.5 * row], level as usize)
}

/// Subtracts a share of one radiance from another and clamps the result to zero.
pub(crate) fn subtract_clamped(unoccluded: [f32; 3], share: f32, blocked: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (unoccluded[c] - share * blocked[c]).max(0.0))
}

fn scaled(environment: &AogridEnvironment, radiance: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| radiance[c] * environment.scale[c])
}
