use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::*;
use crate::AogridCone;
use crate::environment::{
    AogridEnvironment, aogrid_cone_radiance, aogrid_environment_at, aogrid_environment_coordinate,
    aogrid_environment_level, aogrid_irradiance,
};
use crate::{Up, wgsl};

/// The relative precision of half floats: eleven binary digits.
const HALF_PRECISION: f32 = 1.0 / 2048.0;

const LEVELS: std::ops::Range<usize> = 0..EnvironmentMap::LEVELS;

/// A map that samples a function of direction at the texel centers.
fn map_of([width, height]: [usize; 2], radiance: impl Fn(DVec3) -> [f32; 3]) -> EnvironmentMap {
    let texels: Vec<_> = (0..width * height)
        .map(|idx| {
            let (u, v) = (idx % width, idx / width);
            let phi = TAU * (0.5 - (u as f64 + 0.5) / width as f64);
            let theta = PI * (v as f64 + 0.5) / height as f64;
            radiance(towards(theta, phi))
        })
        .collect();
    EnvironmentMap::new([width, height], &texels).unwrap()
}

/// The direction at a colatitude and an azimuth from +z towards +x.
fn towards(theta: f64, phi: f64) -> DVec3 {
    let (sin, cos) = phi.sin_cos();
    DVec3::new(theta.sin() * sin, theta.cos(), theta.sin() * cos)
}

/// Directions with incommensurable heights and azimuths, and the axes.
fn directions() -> Vec<DVec3> {
    let spiral = |idx: u32| {
        let height = 1.0 - 2.0 * (f64::from(idx) * 0.754_877_666).fract();
        towards(height.acos(), 2.399_963_23 * f64::from(idx))
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let signed = axes.into_iter().flat_map(|axis| [axis, -axis]);
    (0..500).map(spiral).chain(signed).collect()
}

fn cone(axis: DVec3, fraction: f32) -> AogridCone {
    AogridCone::new(axis.as_vec3().to_array(), fraction)
}

#[test]
fn a_constant_sky_is_constant_in_every_cone() {
    for size in [[1, 1], [7, 3], [1500, 700]] {
        let map = map_of(size, |_| [0.3, 1.0, 700.0]);
        let environment = AogridEnvironment::new(Up::Y, 0.3);
        for direction in directions() {
            for fraction in [0.0, 1e-3, 0.01, 0.1, 0.3, 0.5] {
                let cone = cone(direction, fraction);
                let found = aogrid_cone_radiance(&environment, &map, &cone);
                for (found, sky) in found.into_iter().zip([0.3, 1.0, 700.0]) {
                    assert!(
                        (found / sky - 1.0).abs() <= HALF_PRECISION,
                        "{size:?}: {found} {sky}"
                    );
                }
            }
        }
    }
}

/// The radiance of uneven texels, one of them a small sun.
fn uneven(texel: usize) -> [f32; 3] {
    let hashed = |salt: usize| ((texel * 7 + salt) * 2_654_435_761 % 1000) as f32 / 1000.0;
    match texel {
        77 => [40.0, 30.0, 20.0],
        _ => [hashed(1), hashed(2).powi(3), hashed(3)],
    }
}

/// The mean over a cone by independent sample points: equal areas of the disk into which the cone's
/// directions project along its axis, which is the weighting by the cosine.
fn brute_force([width, height]: [usize; 2], axis: DVec3, fraction: f32) -> DVec3 {
    const RINGS: usize = 384;
    const SPOKES: usize = 1024;
    let cos_alpha = 1.0 - 2.0 * f64::from(fraction);
    let sin_alpha = (1.0 - cos_alpha * cos_alpha).sqrt();
    let (u, v) = axis.any_orthonormal_pair();
    let mut sum = DVec3::ZERO;
    for ring in 0..RINGS {
        let r = sin_alpha * ((ring as f64 + 0.5) / RINGS as f64).sqrt();
        for spoke in 0..SPOKES {
            let (sin, cos) = (TAU * (spoke as f64 + 0.5) / SPOKES as f64).sin_cos();
            let d = r * cos * u + r * sin * v + (1.0 - r * r).max(0.0).sqrt() * axis;
            let x = (0.5 - d.x.atan2(d.z) / TAU) * width as f64;
            let y = d.y.clamp(-1.0, 1.0).acos() / PI * height as f64;
            let texel = (y as usize).min(height - 1) * width + (x as usize).min(width - 1);
            sum += DVec3::from(uneven(texel).map(f64::from));
        }
    }
    sum / (RINGS * SPOKES) as f64
}

/// The quadrature error, relative to the brightest radiance, 40: both quadratures resolve the sun's
/// edges to a few of their cells, and the cone is some hundred cells wide.
const QUADRATURE: f64 = 40.0 * 2e-4;

#[test]
fn cones_match_a_brute_force_integration() {
    let size = [24, 12];
    let texels: Vec<_> = (0..size[0] * size[1]).map(uneven).collect();
    let map = EnvironmentMap::new(size, &texels).unwrap();
    let mut worst = 0.0_f64;
    for level in LEVELS {
        let [width, height] = EnvironmentMap::level_size(level);
        // Both poles, the sun's row (3 of 12), columns next to the seam, and others.
        for (x, row) in [
            (0, 0.0),
            (0, 0.29),
            (5, 0.29),
            (3, 0.3),
            (0, 0.55),
            (7, 0.9),
            (2, 1.0),
        ] {
            let (x, y) = (x * width / 8, (row * (height - 1) as f64) as usize);
            let phi = TAU * (0.5 - (x as f64 + 0.5) / width as f64);
            let axis = towards(PI * y as f64 / (height - 1) as f64, phi);
            let expected = brute_force(size, axis, EnvironmentMap::fraction(level));
            let found = map.levels[level].texels[y * width + x];
            for c in 0..3 {
                let found = f64::from(f16::from_bits(found[c]).to_f32());
                let off = (found - expected[c]).abs();
                worst = worst.max(off);
                let tolerance = QUADRATURE + f64::from(HALF_PRECISION) * expected[c];
                assert!(off < tolerance, "level {level} {x} {y}: {found} {expected}");
            }
        }
    }
    println!("off by at most {worst}");
}

/// A radiance that is linear in direction has known means: the cosine-weighted mean of ω over a
/// cone is ⅔ (1 + c + c²)/(1 + c) along its axis, where c is the cosine of the half-angle.
#[test]
fn linear_radiance_has_its_exact_mean_in_every_cone() {
    let slope = DVec3::new(0.3, -0.5, 0.2);
    let radiance = |d: DVec3| (1.0 + slope.dot(d)) as f32;
    let map = map_of([512, 256], |d| [radiance(d); 3]);
    let (mut between, mut at_levels) = (0.0_f64, 0.0_f64);
    for step in 0..=32 {
        let fraction = 0.5 * 4.0_f32.powf(-f64::from(step) as f32 / 8.0);
        let c = 1.0 - 2.0 * f64::from(fraction);
        let length = 2.0 / 3.0 * (1.0 + c + c * c) / (1.0 + c);
        for direction in directions() {
            let environment = AogridEnvironment::new(Up::Y, 0.0);
            let found = aogrid_cone_radiance(&environment, &map, &cone(direction, fraction));
            let off = (f64::from(found[0]) - 1.0 - length * slope.dot(direction)).abs();
            match step % 8 {
                0 => at_levels = at_levels.max(off),
                _ => between = between.max(off),
            }
        }
    }
    println!("off by at most {at_levels} at levels, {between} between them");
    // Linear filtering over a texel of h = 11.25° (level 4) errs by h²/8 of the second derivative.
    let filter = (PI / 16.0_f64).powi(2) / 8.0 * slope.length() + f64::from(HALF_PRECISION) * 1.7;
    assert!(at_levels < filter, "{at_levels}");
    // Linear interpolation in log a between levels 3 and 4 misses the mean's length by up to
    // 0.0095, at a = 0.35.
    assert!(between < filter + 0.0095 * slope.length(), "{between}");
}

#[test]
fn the_map_follows_yaw_and_up_axis() {
    // A bright half-space towards the map's +x.
    let map = map_of([256, 128], |d| [f32::from(u8::from(d.x > 0.0)), 0.0, 0.0]);
    let seen = |environment: &AogridEnvironment, direction: Vec3| {
        aogrid_irradiance(environment, &map, direction.to_array())[0]
    };
    let quarter = std::f32::consts::FRAC_PI_2;
    for (environment, towards) in [
        (AogridEnvironment::new(Up::Y, 0.0), Vec3::X),
        // Counter-clockwise from above: x goes to −z.
        (AogridEnvironment::new(Up::Y, quarter), -Vec3::Z),
        (AogridEnvironment::new(Up::Z, 0.0), Vec3::X),
        (AogridEnvironment::new(Up::Z, quarter), Vec3::Y),
    ] {
        assert!(seen(&environment, towards) > 0.99);
        assert!(seen(&environment, -towards) < 0.01);
    }
    let scaled = AogridEnvironment::new(Up::Y, 0.0).scaled([0.5, 1.0, 1.0]);
    assert!((seen(&scaled, Vec3::X) - 0.5).abs() < 0.01);
}

#[test]
fn the_map_is_continuous_at_the_seam_and_the_poles() {
    let size = [24, 12];
    let texels: Vec<_> = (0..size[0] * size[1]).map(uneven).collect();
    let map = EnvironmentMap::new(size, &texels).unwrap();
    // Pairs of directions across the seam at −z, and all around each pole.
    let step = 1e-6_f64;
    let pairs = (1..40).map(|row| PI * f64::from(row) / 40.0);
    let seam = pairs.map(|theta| [towards(theta, PI - step), towards(theta, PI + step)]);
    let around = (0..16).flat_map(|turn| {
        [0.0, PI].map(|pole| {
            let theta: f64 = if pole == 0.0 { step } else { PI - step };
            [towards(theta, f64::from(turn)), towards(pole, 0.0)]
        })
    });
    for [a, b] in seam.chain(around) {
        for level in LEVELS {
            let [a, b] = [a, b].map(|direction| {
                let at = aogrid_environment_coordinate(direction.as_vec3().to_array());
                aogrid_environment_at(&map, at, level as f32)
            });
            // Level 0 rises from 0 to 40 over a cone's 10° at most, and by half of that again
            // because of its texels: 40 per tenth of a radian. The rounding of a direction doubles
            // that.
            for c in 0..3 {
                assert!(
                    (a[c] - b[c]).abs() < 40.0 / 0.1 * 4e-6,
                    "{level}: {a:?} {b:?}"
                );
            }
        }
    }
}

#[test]
fn shader_levels_match_map_levels() {
    for level in LEVELS {
        let fraction = EnvironmentMap::fraction(level);
        assert!((aogrid_environment_level(fraction) - level as f32).abs() < 1e-6);
    }
    assert_eq!(aogrid_environment_level(0.0), 0.0);
    assert_eq!(EnvironmentMap::level_size(4), [32, 16]);
    assert_eq!(wgsl::AOGRID_ENVIRONMENT_LAST_LEVEL, 4.0);
}

#[test]
fn large_images_are_averaged_by_solid_angle() {
    let coarse: Vec<_> = (0..1024 * 512).map(|idx| uneven(idx % 5001)).collect();
    // The upper row of each pair of finer rows holds the light of both.
    let cosine = |row: usize| (PI * row as f64 / 1024.0).cos();
    let fine: Vec<_> = (0..2048 * 1024)
        .map(|idx| {
            let (row, texel) = (idx / 4096, coarse[idx / 4096 * 1024 + idx % 2048 / 2]);
            let [top, middle, bottom] = [0, 1, 2].map(|edge| cosine(2 * row + edge));
            match idx / 2048 % 2 {
                0 => texel.map(|v| v * ((top - bottom) / (top - middle)) as f32),
                _ => [0.0; 3],
            }
        })
        .collect();
    let coarse = EnvironmentMap::new([1024, 512], &coarse).unwrap();
    let fine = EnvironmentMap::new([2048, 1024], &fine).unwrap();
    for level in LEVELS {
        let pairs = coarse.levels[level]
            .texels
            .iter()
            .zip(&fine.levels[level].texels);
        for (a, b) in pairs {
            let [a, b] = [a, b].map(|t| f16::from_bits(t[0]).to_f32());
            assert!(
                (a - b).abs() <= 2.0 * HALF_PRECISION * a,
                "{level}: {a} {b}"
            );
        }
    }
}

#[test]
fn invalid_radiance_is_clamped_or_refused() {
    let negative = EnvironmentMap::new([2, 1], &[[-3.0, 1.0, 2.0]; 2]).unwrap();
    assert_eq!(negative.sample([0.3, 0.5], 2), [0.0, 1.0, 2.0]);
    let refusal = |size, texels: &[[f32; 3]]| EnvironmentMap::new(size, texels).unwrap_err();
    assert!(matches!(
        refusal([0, 0], &[]),
        EnvironmentMapError::Size { .. }
    ));
    assert!(matches!(
        refusal([3, 1], &[[0.0; 3]]),
        EnvironmentMapError::Size { .. }
    ));
    assert!(matches!(
        refusal([usize::MAX, 3], &[[0.0; 3]]),
        EnvironmentMapError::Size { .. }
    ));
    let odd = [[0.0; 3], [0.0, f32::NAN, 0.0]];
    assert_eq!(refusal([2, 1], &odd), EnvironmentMapError::NotFinite(1));
    let bright = refusal([1, 1], &[[1e9; 3]]);
    assert!(
        matches!(bright, EnvironmentMapError::TooBright(_)),
        "{bright}"
    );
}
