//! The CPU twin of `environment.wgsl`: the same functions under the same names, in single floats.
//!
//! # Theory
//!
//! A diffuse receiver gets B − AO · A of an environment (RR-5779, 5.3): B the mean radiance of its
//! hemisphere, A that of what its occluders hide, both weighted by the cosine to the normal, so
//! that a constant sky leaves (1 − AO) · B. What is printed is B − A: zero under a constant sky. A
//! glossy receiver gets B − k · A: B the mean radiance of a lobe around the mirrored direction, k the
//! share of the lobe that is hidden, A the mean radiance of that.
//!
//! What the occluders add up to has AO and an axis d, the normalised sum of all (AO/2) d′. The
//! printed cone covers AO/2 around d, which is a cone of that AO where d is 60° from the normal and
//! not elsewhere. Ours has the a of AO = 4a(1 − a) cos β, which holds for every cone above the
//! horizon. Its directions do not count alike: the higher, the more. The mean of ω (n·ω) over the cone
//! points along 3c(1 + c)(d·n) d + (1 − c)(2 + c) n, with c = 1 − 2a, and there A is looked up, with
//! the weights that the map's levels have within a cone. Against ray tracing that
//! leaves about a third of the error of looking around d (`docs/runtime.md`).
//!
//! Several occluders around a receiver are no cone. Their sum of (AO/2) d′ is shorter than AO/2, and
//! what is hidden is taken to be spread over as wide a cone as that tells, thinly: the floor between
//! two objects does not mirror one in the middle. AO has a cosine in it, so that the sum is their
//! cosine-weighted mean already: c is that of the a that they cover, not of the cone that they are
//! spread over.
//!
//! For a lobe no cosine counts. What it shares with the occluded cone is looked up where it is, in
//! the middle of the lens, and the lobe itself as far as it is above the horizon: a lobe that is
//! hidden whole is black.

use aogrid_tables::merge;
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3};

use crate::EnvironmentMap;
use crate::shading::aogrid_inverse_length;
use crate::wgsl::{
    AOGRID_AXIS_GUARD, AOGRID_ENVIRONMENT_HEIGHT, AOGRID_ENVIRONMENT_LAST_LEVEL,
    AOGRID_FRACTION_GUARD, AOGRID_PI,
};

/// How a scene stands in its environment: the struct of the same name in the WGSL library, 64 bytes,
/// for a uniform buffer.
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

/// Which axis of the world is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// +y, as in the map.
    Y,
    /// +z: the world's −y is the map's +z.
    Z,
}

impl AogridEnvironment {
    /// The map upright in the world, turned about the up axis by `yaw` radians, counter-clockwise
    /// seen from above.
    pub fn new(up: Up, yaw: f32) -> Self {
        let stand = match up {
            Up::Y => Mat3::IDENTITY,
            Up::Z => Mat3::from_cols(Vec3::X, -Vec3::Z, Vec3::Y),
        };
        let map_from_world = Mat3::from_rotation_y(-yaw) * stand;
        Self::from_rotation(map_from_world.transpose().to_cols_array_2d())
    }

    /// The rows of a rotation that takes world axes to the map's.
    pub fn from_rotation(map_from_world: [[f32; 3]; 3]) -> Self {
        let [map_x, map_y, map_z] = map_from_world.map(|[x, y, z]| [x, y, z, 0.0]);
        Self {
            map_x,
            map_y,
            map_z,
            scale: [1.0, 1.0, 1.0, 0.0],
        }
    }

    /// The same, the map's radiance multiplied by a colour.
    pub fn scaled(self, [r, g, b]: [f32; 3]) -> Self {
        Self {
            scale: [r, g, b, 0.0],
            ..self
        }
    }
}

/// Directions around a unit axis that cover a fraction of the sphere, up to half of it; of them so
/// many are meant, everywhere alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AogridCone {
    /// Of length 1.
    pub axis: [f32; 3],
    /// 0..=½.
    pub fraction: f32,
    /// 0..=1; 1 where all of its directions are meant.
    pub density: f32,
}

impl AogridCone {
    /// All directions of a cone.
    pub fn new(axis: [f32; 3], fraction: f32) -> Self {
        Self {
            axis,
            fraction,
            density: 1.0,
        }
    }
}

// ---- One call per pixel ------------------------------------------------------------------------

/// What a white diffuse surface reflects: the mean radiance of its hemisphere, less AO times that of
/// the occluded cone. `hidden`: what the occluders add up to, the sum of all (AO/2) d′ and the
/// product of all 1 − AO.
pub fn aogrid_lambertian(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    hidden: [f32; 4],
    normal: [f32; 3],
) -> [f32; 3] {
    let all = aogrid_irradiance(environment, map, normal);
    let cone = aogrid_cosine_weighted_cone(&aogrid_occluded_cone(hidden, normal), normal);
    let lost = aogrid_cone_radiance(environment, map, &cone);
    less(all, 1.0 - hidden[3], lost)
}

/// What a glossy surface reflects: the mean radiance of a lobe, a cone of `lobe_fraction` about the
/// mirrored direction in so far as it is above the surface, less the hidden share of the lobe times
/// the mean radiance there.
pub fn aogrid_glossy(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    hidden: [f32; 4],
    normal: [f32; 3],
    mirrored: [f32; 3],
    lobe_fraction: f32,
) -> [f32; 3] {
    let whole = AogridCone::new(mirrored, lobe_fraction);
    let lobe = aogrid_shared_cone(&whole, &AogridCone::new(normal, 0.5));
    let lost_cone = aogrid_shared_cone(&whole, &aogrid_occluded_cone(hidden, normal));
    let covered = lost_cone.fraction / lobe.fraction.max(AOGRID_FRACTION_GUARD);
    let share = lost_cone.density * covered.clamp(0.0, 1.0);
    let all = aogrid_cone_radiance(environment, map, &lobe);
    let lost = aogrid_cone_radiance(environment, map, &lost_cone);
    less(all, share, lost)
}

/// The direction in which a surface mirrors a viewer: `eye` is a place and 1, or a direction
/// towards the viewer and 0.
pub fn aogrid_mirrored(eye: [f32; 4], position: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let [x, y, z, w] = eye;
    let towards = Vec3::new(x, y, z) - w * Vec3::from(position);
    let view = towards * aogrid_inverse_length(towards.to_array());
    let normal = Vec3::from(normal);
    (2.0 * view.dot(normal) * normal - view).to_array()
}

// ---- Cones -------------------------------------------------------------------------------------

/// The cone that a pixel's occluders hide, as the receiver sees it. The sum of (AO/2) d′ is as long
/// as AO/2 for occluders in one direction, and shorter for several around: the cone is then as wide
/// as makes the mean of its directions shorter by that, and as much less dense.
pub fn aogrid_occluded_cone(hidden: [f32; 4], normal: [f32; 3]) -> AogridCone {
    let [x, y, z, transmittance] = hidden;
    let sum = Vec3::new(x, y, z);
    let axis = match sum.length_squared() > AOGRID_AXIS_GUARD {
        true => sum * aogrid_inverse_length(sum.to_array()),
        false => normal.into(),
    };
    let occlusion = 1.0 - transmittance;
    let together = 2.0 * sum.length() / occlusion.max(AOGRID_FRACTION_GUARD);
    let fraction = aogrid_occluded_fraction(occlusion, axis.dot(normal.into()));
    let wide = (1.0 - together.clamp(0.0, 1.0) * (1.0 - fraction)).min(0.5);
    AogridCone {
        axis: axis.to_array(),
        fraction: wide,
        density: fraction / wide.max(AOGRID_FRACTION_GUARD),
    }
}

/// The fraction of a cone that hides so much, its axis at `cos_beta` to the normal:
/// AO = 4a(1 − a) cos β, exactly so for a cone above the horizon.
pub fn aogrid_occluded_fraction(occlusion: f32, cos_beta: f32) -> f32 {
    let of_overhead = (occlusion / cos_beta.max(AOGRID_FRACTION_GUARD)).clamp(0.0, 1.0);
    0.5 - 0.5 * (1.0 - of_overhead).sqrt()
}

/// A cone as a diffuse receiver weighs it: around the mean of its directions, each counted by its
/// cosine to the normal. Only what it covers is weighed so: where it is spread over several
/// occluders, their sum of (AO/2) d′ has counted each by its cosine already.
pub fn aogrid_cosine_weighted_cone(cone: &AogridCone, normal: [f32; 3]) -> AogridCone {
    let (axis, normal) = (Vec3::from(cone.axis), Vec3::from(normal));
    let c = 1.0 - 2.0 * cone.fraction * cone.density;
    let along = 3.0 * c * (1.0 + c) * axis.dot(normal).max(AOGRID_FRACTION_GUARD);
    let sum = along * axis + (1.0 - c) * (2.0 + c) * normal;
    AogridCone {
        axis: (sum * aogrid_inverse_length(sum.to_array())).to_array(),
        ..*cone
    }
}

/// What two cones share, as a cone: with the fraction that they share, around its middle. That lies
/// on the arc between the axes. Halfway along what both cover of the arc it does only for
/// cones of one size; of a small cone that a larger one cuts, the less is cut off the nearer it
/// is to the small one's axis: by the fourth root of what is cut off, within 0.02 of its radius.
pub fn aogrid_shared_cone(first: &AogridCone, second: &AogridCone) -> AogridCone {
    let (axis, other) = (Vec3::from(first.axis), Vec3::from(second.axis));
    let cos_gamma = axis.dot(other);
    let across = other - cos_gamma * axis;
    let gamma = across.length().atan2(cos_gamma);
    let a = [first.fraction, second.fraction];
    let alpha = a.map(aogrid_half_angle);
    let fraction = aogrid_shared_fraction(a, alpha, gamma);
    let halfway = 0.5 * ((-alpha[0]).max(gamma - alpha[1]) + alpha[0].min(gamma + alpha[1]));
    let smaller = if a[0] <= a[1] { 0.0 } else { gamma };
    let cut_off = (1.0 - fraction / a[0].min(a[1]).max(AOGRID_FRACTION_GUARD)).clamp(0.0, 1.0);
    let middle: f32 = smaller + (halfway - smaller) * cut_off.sqrt().sqrt();
    let towards = across * aogrid_inverse_length(across.to_array());
    AogridCone {
        axis: (middle.cos() * axis + middle.sin() * towards).to_array(),
        fraction,
        density: first.density * second.density,
    }
}

/// The half-angle of a cone.
pub fn aogrid_half_angle(fraction: f32) -> f32 {
    2.0 * fraction.sqrt().atan2((1.0 - fraction).sqrt())
}

/// The fraction of the sphere inside two cones of at most half of it, their axes gamma apart. The
/// WGSL computes it from the half-angles as well, which the tables' own function does not need.
pub fn aogrid_shared_fraction(a: [f32; 2], _alpha: [f32; 2], gamma: f32) -> f32 {
    merge::intersection(a[0], a[1], gamma)
}

// ---- Radiance ----------------------------------------------------------------------------------

/// The irradiance over π: the mean radiance of a hemisphere, weighted by the cosine.
pub fn aogrid_irradiance(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    normal: [f32; 3],
) -> [f32; 3] {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, normal));
    let radiance = aogrid_environment_at(map, at, AOGRID_ENVIRONMENT_LAST_LEVEL);
    scaled(environment, radiance)
}

/// The mean radiance of a cone, weighted by the cosine to its axis. Cones of less than level 0's
/// fraction count as that.
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

/// A direction in the map's axes.
pub fn aogrid_map_direction(environment: &AogridEnvironment, direction: [f32; 3]) -> [f32; 3] {
    let rows = [environment.map_x, environment.map_y, environment.map_z];
    rows.map(|[x, y, z, _]| Vec3::new(x, y, z).dot(direction.into()))
}

/// Where a direction of any length lies in a latitude-longitude map: turns from the left edge, and
/// half turns from the north pole.
pub fn aogrid_environment_coordinate([x, y, z]: [f32; 3]) -> [f32; 2] {
    let azimuth = x.atan2(z);
    let colatitude = (x * x + z * z).sqrt().atan2(y);
    [azimuth * (-0.5 / AOGRID_PI) + 0.5, colatitude / AOGRID_PI]
}

/// The level of the map whose cones cover this fraction; between two, by its logarithm.
pub fn aogrid_environment_level(fraction: f32) -> f32 {
    let doubled = (2.0 * fraction).max(AOGRID_FRACTION_GUARD);
    let level = AOGRID_ENVIRONMENT_LAST_LEVEL + 0.5 * doubled.log2();
    level.clamp(0.0, AOGRID_ENVIRONMENT_LAST_LEVEL)
}

/// A level of the map: its rows lie on colatitudes from pole to pole.
pub fn aogrid_environment_at(map: &EnvironmentMap, [u, v]: [f32; 2], level: f32) -> [f32; 3] {
    let row = level.exp2() / AOGRID_ENVIRONMENT_HEIGHT;
    map.sample([u, v * (1.0 - row) + 0.5 * row], level as usize)
}

/// What is left of some radiance without a share of another; none is negative.
fn less(all: [f32; 3], share: f32, lost: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (all[c] - share * lost[c]).max(0.0))
}

fn scaled(environment: &AogridEnvironment, radiance: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| radiance[c] * environment.scale[c])
}
