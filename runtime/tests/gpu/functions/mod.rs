/// The far field, and look-ups of an object on itself.
mod far;
/// The evaluation of single functions.
mod harness;
/// Merging.
mod merging;
/// Soft cones.
mod soft;

use aogrid_gpu_support::gpu;
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{AogridOccluder, CpuTexture, Instance};

use crate::grids::{ball, faded_ball, spec};
use harness::{Harness, Input};

/// Returns a rotated, enlarged and mirrored instance.
fn transformed() -> Instance {
    let world_from_object = glam::Mat4::from_scale_rotation_translation(
        glam::Vec3::new(-1.5, 1.5, 1.5),
        glam::Quat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0),
        glam::Vec3::new(3.0, -2.0, 1.0),
    );
    Instance {
        strength: 0.8,
        ..Instance::at(world_from_object.to_cols_array_2d())
    }
}

/// Returns points inside and around the box of that instance, with normals all over the sphere.
fn dense() -> Vec<Input> {
    let world = glam::Mat4::from_cols_array_2d(&transformed().world_from_object);
    let n = 33_u32;
    let points = (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)]);
    let spec = spec();
    points
        .enumerate()
        .map(|(idx, ijk)| {
            let p = glam::Vec3::from_array(std::array::from_fn(|x| {
                // From 15 % of the box outside one face to as much outside the opposite one.
                let t = 2.6 * ijk[x] as f32 / (n - 1) as f32 - 1.3;
                spec.center()[x] + t * spec.half_extents()[x]
            }));
            let p = world.transform_point3(p);
            let n = spiral(idx);
            [[p.x, p.y, p.z, 1.0], [n[0], n[1], n[2], 0.0]]
        })
        .collect()
}

/// Returns a direction on a spiral whose steps in height and azimuth are incommensurable.
fn spiral(idx: usize) -> [f32; 3] {
    let z = 1.0 - 2.0 * (idx as f32 * 0.754_877_7).fract();
    let (sin, cos) = (idx as f32 * 2.399_963_2).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * cos, r * sin, z]
}

/// Returns arguments a and cos β over their whole ranges, corners included.
fn arguments() -> Vec<Input> {
    let n = 201;
    (0..n * n)
        .map(|i| {
            let [a, c] = [i % n, i / n].map(|k| k as f32 / (n - 1) as f32);
            [[a, 2.0 * c - 1.0, 0.0, 0.0], [0.0; 4]]
        })
        .collect()
}

/// The error of a few roundings of numbers up to 2, in another order or fused.
const ROUNDING: f32 = 2e-6;

/// The largest slope of T_clip along a: AO = 4a(1 − a) for a cone around the normal.
const SLOPE_BY_FRACTION: f32 = 4.0;

/// The largest slope of T_clip along cos β: a half-space's AO is (1 + cos β)/2 and a small cone's
/// 4a cos β, and none is steeper than 1.
const SLOPE_BY_COSINE: f32 = 1.0;

/// The largest step between neighboring cells in any channel of the inputs: from the ball's surface
/// outwards, cells of 0.175 (x) take a from 0.5 to 0.16 and turn d by a third.
const MAX_CELL_STEP: f32 = 0.35;

/// The largest steps between neighboring nodes of T_clip, along a and along cos β.
const MAX_TABLE_STEPS: [f32; 2] = [SLOPE_BY_FRACTION / 63.0, 2.0 * SLOPE_BY_COSINE / 63.0];

impl Harness<'_> {
    /// Returns the error of one channel of a look-up in the grid.
    fn channel_error(&self) -> f32 {
        let eight_bit = self.grid.format() == TexelFormat::Unorm8;
        // Each of the three interpolations may be rounded to the texels' 8 bits.
        let rounding = if eight_bit { 3.0 * 0.5 / 255.0 } else { 0.0 };
        3.0 * self.gpu.weight_error(eight_bit) * MAX_CELL_STEP + rounding + ROUNDING
    }

    /// Returns the error of a look-up in a table whose neighboring nodes differ by at most `steps`.
    fn table_error(&self, steps: [f32; 2]) -> f32 {
        self.gpu.weight_error(false) * (steps[0] + steps[1]) + ROUNDING
    }

    /// Returns the error of a transmittance: of a, of cos β (which has the error of an axis that is
    /// three decoded channels and not much shorter than 1), and of the table.
    fn cone_error(&self) -> f32 {
        let decoded = match self.grid.format() {
            TexelFormat::Unorm8 => 255.0 / 127.0,
            _ => 1.0,
        };
        let of_axis = self.channel_error() * decoded * 3.0_f32.sqrt();
        SLOPE_BY_FRACTION * self.channel_error()
            + SLOPE_BY_COSINE * of_axis
            + self.table_error(MAX_TABLE_STEPS)
    }
}

/// Returns the inputs outside the ball. Inside it axes flip from cell to cell and are meaningless.
fn outside() -> Vec<Input> {
    let object_from_world =
        glam::Mat4::from_cols_array_2d(&transformed().world_from_object).inverse();
    let mut inputs = dense();
    inputs.retain(|[p, _]| {
        let p = object_from_world.transform_point3(glam::Vec3::new(p[0], p[1], p[2]));
        p.length() > crate::grids::RADIUS
    });
    assert!(inputs.len() > 30_000);
    inputs
}

#[test]
fn looked_up_and_clipped_cones_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let table = CpuTexture::transmittance_table();
    for format in TexelFormat::ALL {
        let harness = Harness::new(&gpu, ball(Encoding::Cone, format), &transformed());
        let grid = CpuTexture::of_grid(&harness.grid);
        let worst = harness.max_difference(
            "return vec4f(aogrid_cone(occluder, grid, transmittance, linear_clamp, p, n));",
            &outside(),
            |p, n| [aogrid_cone(&harness.occluder, &grid, &table, p, n); 4],
        );
        assert!(worst[0] <= harness.cone_error(), "{format:?}: {worst:?}");
    }
}

#[test]
fn faded_grids_need_no_box_test_outside_their_box() {
    let Some(gpu) = gpu() else { return };
    let table = CpuTexture::transmittance_table();
    for format in TexelFormat::ALL {
        let harness = Harness::new(&gpu, faded_ball(format), &transformed());
        let grid = CpuTexture::of_grid(&harness.grid);
        let worst = harness.max_difference(
            "return vec4f(aogrid_cone_faded(occluder, grid, transmittance, linear_clamp, p, n));",
            &outside(),
            // The CPU twin tests the box, the shader does not.
            |p, n| [aogrid_cone(&harness.occluder, &grid, &table, p, n); 4],
        );
        assert!(worst[0] <= harness.cone_error(), "{format:?}: {worst:?}");
        let twin = harness.max_difference(
            "return vec4f(aogrid_cone_faded(occluder, grid, transmittance, linear_clamp, p, n));",
            &outside(),
            |p, n| [aogrid_cone_faded(&harness.occluder, &grid, &table, p, n); 4],
        );
        assert!(twin[0] <= harness.cone_error(), "{format:?}: {twin:?}");
    }
}

/// The CPU twin of a function for grids' occlusion alone.
type Twin = fn(&AogridOccluder, &CpuTexture, [f32; 3], bool) -> f32;

#[test]
fn scalar_occlusion_matches_the_cpu_twin_on_others_and_on_itself() {
    let Some(gpu) = gpu() else { return };
    for format in TexelFormat::ALL {
        let twin_of = |encoding: Encoding| -> (&str, Twin) {
            match encoding.has_direction() {
                false => ("aogrid_occlusion", aogrid_occlusion),
                true => ("aogrid_occlusion_of_cone", aogrid_occlusion_of_cone),
            }
        };
        for encoding in Encoding::ALL {
            let (function, twin) = twin_of(encoding);
            let harness = Harness::new(&gpu, ball(encoding, format), &transformed());
            let grid = CpuTexture::of_grid(&harness.grid);
            let call =
                |on_itself| format!("{function}(occluder, grid, linear_clamp, p, {on_itself})");
            let body = format!("return vec4f({}, {}, 0, 0);", call(false), call(true));
            let worst = harness.max_difference(&body, &dense(), |p, _| {
                let t = |on_itself| twin(&harness.occluder, &grid, p, on_itself);
                [t(false), t(true), 0.0, 0.0]
            });
            // AO = 2a.
            let tolerance = 2.0 * harness.channel_error();
            assert!(
                worst.iter().all(|w| *w <= tolerance),
                "{format:?}: {worst:?}"
            );
        }
    }
}

#[test]
fn clipping_matches_the_cpu_twin_by_table_and_in_closed_form() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu, ball(Encoding::Cone, TexelFormat::F16), &transformed());
    let (table, clip_table) = (CpuTexture::transmittance_table(), CpuTexture::clip_table());
    let by_table = harness.max_difference(
        "return vec4f(aogrid_clip_transmittance(transmittance, linear_clamp, p.x, p.y));",
        &arguments(),
        |p, _| [aogrid_clip_transmittance(&table, p[0], p[1]); 4],
    );
    assert!(
        by_table[0] <= harness.table_error(MAX_TABLE_STEPS),
        "{by_table:?}"
    );

    let all = harness.max_difference(
        "return vec4f(aogrid_clip(clip, linear_clamp, p.x, p.y), 0);",
        &arguments(),
        |p, _| {
            let [occlusion, fraction, weight] = aogrid_clip(&clip_table, p[0], p[1]);
            [occlusion, fraction, weight, 0.0]
        },
    );
    // a' changes at most as much as a; f may jump from one node to the next.
    let steps = [MAX_TABLE_STEPS, [1.0 / 63.0; 2], [1.0; 2]];
    for c in 0..3 {
        assert!(all[c] <= harness.table_error(steps[c]), "{all:?}");
    }

    let closed = harness.max_difference(
        "return vec4f(aogrid_clip_transmittance_closed_form(p.x, p.y), 0, 0, 0);",
        &arguments(),
        |p, _| {
            [
                aogrid_clip_transmittance_closed_form(p[0], p[1]),
                0.0,
                0.0,
                0.0,
            ]
        },
    );
    // WGSL allows atan2 an error of 4096 units in the last place of an angle up to π.
    let arc_tangents = 2.0 * 4096.0 * 2.0_f32.powi(-22) / std::f32::consts::PI;
    assert!(closed[0] <= arc_tangents, "{closed:?}");
}

#[test]
fn clipped_axes_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let clip_table = CpuTexture::clip_table();
    for format in TexelFormat::ALL {
        let harness = Harness::new(&gpu, ball(Encoding::Cone, format), &transformed());
        let grid = CpuTexture::of_grid(&harness.grid);
        let worst = harness.max_difference(
            "let lookup = aogrid_lookup(occluder, p);
             return aogrid_cone_with_axis_at(occluder, grid, clip, linear_clamp, lookup, n);",
            &outside(),
            |p, n| {
                let lookup = aogrid_lookup(&harness.occluder, p);
                aogrid_cone_with_axis_at(&harness.occluder, &grid, &clip_table, lookup, n)
            },
        );
        // (AO/2) d' changes with a and cos β no faster than AO does, except next to f's jump.
        let tolerance = harness.cone_error();
        assert!(
            worst.iter().all(|w| *w <= tolerance),
            "{format:?}: {worst:?}"
        );
    }
}

#[test]
fn positions_from_depth_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu, ball(Encoding::Cone, TexelFormat::F16), &transformed());
    let projection = glam::Mat4::from_scale_rotation_translation(
        glam::Vec3::new(0.5, 0.25, 0.125),
        glam::Quat::from_euler(glam::EulerRot::XYZ, 0.1, 0.2, 0.3),
        glam::Vec3::new(1.0, 2.0, 3.0),
    );
    let m = projection.to_cols_array_2d();
    let column = |c: [f32; 4]| format!("vec4f({}, {}, {}, {})", c[0], c[1], c[2], c[3]);
    let columns: Vec<_> = m.map(column).to_vec();
    let body = format!(
        "return vec4f(aogrid_world_position(mat4x4f({}), p.xy, p.z), 1);",
        columns.join(", ")
    );
    let inputs: Vec<Input> = dense();
    let worst = harness.max_difference(&body, &inputs, |p, _| {
        let [x, y, z] = aogrid_world_position(m, [p[0], p[1]], p[2]);
        [x, y, z, 1.0]
    });
    // The sum of four products of numbers up to 8.
    assert!(worst.iter().all(|w| *w <= 8.0 * ROUNDING), "{worst:?}");
}

#[test]
fn layers_and_excluded_ids_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let instance = Instance {
        layers: 0b0110,
        excluded: [7, 9, u32::MAX, u32::MAX],
        ..transformed()
    };
    let harness = Harness::new(&gpu, ball(Encoding::Cone, TexelFormat::F16), &instance);
    let inputs: Vec<Input> = (0..256)
        .map(|i| [[(i % 16) as f32, (i / 16) as f32, 0.0, 0.0], [0.0; 4]])
        .collect();
    let body = "let shades = aogrid_shades(occluder, u32(p.x), u32(p.y));
                return vec4f(select(0.0, 1.0, shades), 0, 0, 0);";
    let worst = harness.max_difference(body, &inputs, |p, _| {
        let shades = aogrid_shades(&harness.occluder, p[0] as u32, p[1] as u32);
        let expected =
            ![7.0, 9.0].contains(&p[0]) && [2, 4, 6].iter().any(|m| p[1] as u32 & 6 == *m);
        assert_eq!(shades, expected);
        [f32::from(u8::from(shades)), 0.0, 0.0, 0.0]
    });
    assert_eq!(worst, [0.0; 4]);
}
