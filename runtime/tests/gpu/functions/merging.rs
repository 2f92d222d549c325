use aogrid_gpu_support::gpu;
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::CpuTexture;
use aogrid_runtime::shading::*;

use super::harness::{Harness, Input};
use super::{ROUNDING, spiral, transformed};
use crate::grids::ball;

/// The largest slope of the union by the angle between two caps: per radian the lens loses what a
/// rim sweeps, 2 sin α of 4π, and AO is twice that.
const SLOPE_BY_ANGLE: f32 = 1.0 / std::f32::consts::PI;

/// Returns the error of an angle that is computed from its cosine near 0 and π, where a rounding ε
/// is an angle √(2ε), for a few roundings. (WGSL allows an arc cosine 7e-5.)
fn angle_rounding() -> f32 {
    (2.0 * ROUNDING).sqrt()
}

#[test]
fn merged_cones_match_the_cpu_twin_and_are_never_nan() {
    let Some(gpu) = gpu() else { return };
    let overlaps = CpuTexture::intersection_table();
    let harness = Harness::new(&gpu, ball(Encoding::Cone, TexelFormat::F16), &transformed());
    // AO of both cones and the angle between them; every ninth input has no axis at all.
    let n = 17;
    let inputs: Vec<Input> = (0..n * n * n)
        .map(|i| {
            let [first, second, angle] = [i % n, i / n % n, i / (n * n)].map(|k| k as f32 / 16.0);
            let length = f32::from(u8::from(i % 9 != 0));
            let (sin, cos) = (angle * std::f32::consts::PI).sin_cos();
            [
                [0.5 * first, second, 0.0, 0.0],
                [0.5 * sin * length, 0.5 * cos * length, 0.0, 0.0],
            ]
        })
        .collect();
    let cones = |p: [f32; 3], n: [f32; 3]| {
        (
            [0.0, p[0], 0.0, 1.0 - 2.0 * p[0]],
            [n[0] * p[1], n[1] * p[1], 0.0, 1.0 - p[1]],
        )
    };
    let worst = harness.max_difference(
        "let before = vec4f(0.0, p.x, 0.0, 1.0 - 2.0 * p.x);
         let one = vec4f(n.xy * p.y, 0.0, 1.0 - p.y);
         return aogrid_merge(before, one, overlaps, linear_clamp);",
        &inputs,
        |p, n| {
            let (before, one) = cones(p, n);
            aogrid_merge(before, one, &overlaps)
        },
    );
    // Neighboring nodes differ by 1/47 of the fraction, by π/31 of the angle.
    let steps = 2.0 * (2.0 / 47.0 + SLOPE_BY_ANGLE * std::f32::consts::PI / 31.0);
    let tolerance = gpu.weight_error(false) * steps + SLOPE_BY_ANGLE * angle_rounding() + ROUNDING;
    assert!(worst.iter().all(|w| *w <= tolerance), "{worst:?}");

    let mut compared = 0;
    for [p, n] in inputs {
        let (before, one) = cones([p[0], p[1], 0.0], [n[0], n[1], 0.0]);
        let [_, _, _, t] = aogrid_merge(before, one, &overlaps);
        let gamma = match n[0] * n[0] + n[1] * n[1] > 0.0 {
            true => n[0].atan2(n[1]).abs(),
            false => std::f32::consts::FRAC_PI_2,
        };
        if one[3] < 1.0 && before[3] < 1.0 {
            let union = aogrid_tables::merge::closed_form(p[0], 0.5 * p[1], gamma);
            let exact = (1.0 - 2.0 * union).max(0.0);
            assert!(
                // The table's error bound is one of the union, and AO has twice that.
                (t - exact).abs() <= 2.0 * 6.4e-3,
                "{p:?} {gamma} {t} {exact}"
            );
            compared += 1;
        }
    }
    assert!(compared > 4000);
}

#[test]
fn merging_with_an_unoccluded_cone_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    let overlaps = CpuTexture::intersection_table();
    let harness = Harness::new(&gpu, ball(Encoding::Cone, TexelFormat::F16), &transformed());
    for body in [
        "return aogrid_merge(vec4f(0.0, 0.0, 0.0, 1.0), vec4f(p, n.x), overlaps, linear_clamp);",
        "return aogrid_merge(vec4f(p, n.x), vec4f(0.0, 0.0, 0.0, 1.0), overlaps, linear_clamp);",
    ] {
        let inputs: Vec<Input> = (0..=1000)
            .map(|i| {
                let ao = i as f32 / 1000.0;
                let [x, y, z] = spiral(i).map(|d| 0.5 * ao * d);
                [[x, y, z, 0.0], [1.0 - ao, 0.0, 0.0, 0.0]]
            })
            .collect();
        let worst = harness.max_difference(body, &inputs, |p, n| [p[0], p[1], p[2], n[0]]);
        // 1 + (t - 1) rounds at 1; a filter's weight may add a 256th of the first step.
        let tolerance = ROUNDING + gpu.weight_error(false) * 2.0 / 47.0;
        assert!(worst.iter().all(|w| *w <= tolerance), "{worst:?}");
    }
    let open = [0.0, 0.0, 0.0, 1.0];
    assert_eq!(aogrid_merge(open, open, &overlaps), open);
}
