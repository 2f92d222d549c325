use aogrid_gpu_support::{Gpu, gpu, gpu_with};
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    Combine, DepthTest, Frame, GBufferFormat, GridTexture, Instance, MergePass,
    MergePassDescriptor, PassError, Positions, PrepareError, Receivers, TiledPassDescriptor,
};

use crate::grids::ball;
use crate::many::{
    ManyOccluders, halves, max_difference, merge_descriptor, tiled_descriptor, vectors,
};
use crate::raster::world_and_signed;
use crate::scene::{SIZE, orthographic, perspective, reversed};

/// The error of one merge on floats: an angle computed from its cosine near 0, √(2ε) for a few
/// roundings ε = 1e-6, times 1/π of AO per radian. Axes next to f's jump turn by less.
pub const ERROR_PER_MERGE: f32 = 5e-4;

/// The rounding to half floats, of values below 1 and axes below 2, once in each of two buffers.
const HALF_ROUNDING: f32 = 1.0 / 1024.0;

#[test]
fn images_match_the_cpu_twin_for_every_camera_and_number_of_occluders() {
    let Some(gpu) = gpu() else { return };
    for camera in [perspective(), reversed(), orthographic()] {
        for count in [1, 2, 3] {
            let mut many = ManyOccluders::new(SIZE, camera);
            many.occluders.truncate(count);
            let found = vectors(&many.merge(&gpu, &merge_descriptor()));
            let expected = many.twin_image(Combine::Merge);
            assert!(max_difference(&found, &expected) <= count as f32 * ERROR_PER_MERGE);
        }
    }
}

#[test]
fn merging_one_occluder_gives_its_cone_by_raster_in_tiles_and_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    many.occluders.truncate(1);
    let cone = many.twin_image(Combine::Multiply);
    // 1 + (t - 1) rounds, and the same sums are in two orders.
    const ROUNDING: f32 = 1e-5;
    assert!(max_difference(&many.twin_image(Combine::Merge), &cone) <= ROUNDING);
    let by_raster = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(max_difference(&by_raster, &cone) <= 20.0 * ROUNDING);
    let in_tiles = vectors(&many.tiled(&gpu, &tiled_descriptor()));
    assert!(max_difference(&in_tiles, &cone) <= 20.0 * ROUNDING);
}

#[test]
fn without_occluders_every_pixel_is_unoccluded() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    many.occluders.clear();
    let open = vec![[0.0, 0.0, 0.0, 1.0]; many.buffer.positions.len()];
    assert_eq!(vectors(&many.merge(&gpu, &merge_descriptor())), open);
    assert_eq!(vectors(&many.tiled(&gpu, &tiled_descriptor())), open);
}

#[test]
fn overlapping_shadows_merge_lighter_than_they_multiply() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    many.occluders = vec![many.occluders[0]; 3];
    let merged = vectors(&many.merge(&gpu, &merge_descriptor()));
    let multiplied = many.twin_image(Combine::Multiply);
    let one = ManyOccluders {
        occluders: vec![many.occluders[0]],
        ..ManyOccluders::new(SIZE, perspective())
    };
    let one = one.twin_image(Combine::Merge);
    let mut differences = [0.0_f32; 2];
    for pixel in 0..merged.len() {
        let to_one = (merged[pixel][3] - one[pixel][3]).abs();
        differences[0] = differences[0].max(to_one);
        differences[1] = differences[1].max((multiplied[pixel][3] - one[pixel][3]).abs());
    }
    println!("{differences:?}");
    // Merging the same cone three times gives that cone, except for the table's error on its
    // crease, twice over.
    assert!(differences[0] <= 2.0 * 2.0 * 5.5e-3, "{differences:?}");
    assert!(differences[1] > 0.3);
}

#[test]
fn occluders_merge_in_the_order_of_the_caller() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    // Close together, so that all three overlap on the floor.
    for ((_, instance), x) in many.occluders.iter_mut().zip([-0.4, 0.0, 0.5]) {
        let world_from_object = glam::Mat4::from_translation(glam::Vec3::new(x, 0.1 * x, -x));
        *instance = Instance::at(world_from_object.to_cols_array_2d());
    }
    let forwards = many.twin_image(Combine::Merge);
    let found = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(max_difference(&found, &forwards) <= 3.0 * ERROR_PER_MERGE);
    many.occluders.reverse();
    let backwards = many.twin_image(Combine::Merge);
    assert!(max_difference(&backwards, &forwards) > 10.0 * ERROR_PER_MERGE);
    let found = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(max_difference(&found, &backwards) <= 3.0 * ERROR_PER_MERGE);
    let found = vectors(&many.tiled(&gpu, &tiled_descriptor()));
    assert!(max_difference(&found, &backwards) <= 3.0 * ERROR_PER_MERGE);
}

#[test]
fn ids_layers_strength_and_exclusion_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    let plain = many.twin_image(Combine::Merge);
    many.occluders[1].1.strength = 0.4;
    many.occluders[1].1.layers = 2;
    many.occluders[2].1.excluded[0] = 3;
    many.occluders[2].1.excluded[1] = 2;
    let with_ids = MergePassDescriptor {
        gbuffer: GBufferFormat {
            receivers: Receivers::IdsAndLayers,
            ..world_and_signed()
        },
        ..merge_descriptor()
    };
    let found = vectors(&many.merge(&gpu, &with_ids));
    assert!(max_difference(&found, &many.twin_image(Combine::Merge)) <= 3.0 * ERROR_PER_MERGE);
    assert!(max_difference(&found, &plain) > 0.1);
}

#[test]
fn a_depth_test_does_not_change_the_image_and_depths_serve_as_positions() {
    let wanted = wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::DEPTH_CLIP_CONTROL;
    let Some(gpu) = gpu_with(wanted) else { return };
    for (camera, compare) in [
        (perspective(), wgpu::CompareFunction::GreaterEqual),
        (reversed(), wgpu::CompareFunction::LessEqual),
    ] {
        let many = ManyOccluders::new(SIZE, camera);
        let without = many.merge(&gpu, &merge_descriptor());
        let with = MergePassDescriptor {
            gbuffer: GBufferFormat {
                depth: Some(DepthTest {
                    format: wgpu::TextureFormat::Depth32Float,
                    compare,
                }),
                ..world_and_signed()
            },
            ..merge_descriptor()
        };
        assert!(many.merge(&gpu, &with) == without);
        let from_depth = MergePassDescriptor {
            gbuffer: GBufferFormat {
                positions: Positions::Depth,
                ..world_and_signed()
            },
            ..merge_descriptor()
        };
        let found = vectors(&many.merge(&gpu, &from_depth));
        // A depth step is 2e-5 units here, which a look-up multiplies by 14; the angle between the
        // cones turns by a little of that.
        let tolerance = 3.0 * (ERROR_PER_MERGE + 14.0 * 2e-5);
        assert!(max_difference(&found, &many.twin_image(Combine::Merge)) <= tolerance);
    }
}

#[test]
fn half_float_targets_hold_merged_occlusion() {
    let Some(gpu) = gpu() else { return };
    let many = ManyOccluders::new(SIZE, perspective());
    let in_halves = MergePassDescriptor {
        format: wgpu::TextureFormat::Rgba16Float,
        ..merge_descriptor()
    };
    let found = halves(&many.merge(&gpu, &in_halves));
    assert!(
        max_difference(&found, &many.twin_image(Combine::Merge))
            <= 3.0 * (HALF_ROUNDING + ERROR_PER_MERGE)
    );
}

#[test]
fn unsuitable_descriptors_and_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let narrow = MergePassDescriptor {
        format: wgpu::TextureFormat::Rgba8Unorm,
        ..merge_descriptor()
    };
    let refusal = MergePass::new(device, queue, narrow).unwrap_err();
    assert!(matches!(refusal, PassError::Target { .. }));
    assert!(refusal.to_string().contains("four signed floats"));
    let mut pass = MergePass::new(device, queue, merge_descriptor()).unwrap();
    let grid = ball(Encoding::Occlusion, TexelFormat::Unorm8);
    let grid = GridTexture::new(device, queue, &grid, "ball").unwrap();
    let many = ManyOccluders::new(SIZE, perspective());
    let views = many.views(&gpu);
    let occluders = [(&grid, many.occluders[0].1)];
    let frame = Frame {
        gbuffer: views.gbuffer(perspective(), &world_and_signed()),
        occluders: &occluders,
    };
    let refusal = pass.prepare(device, queue, &frame).unwrap_err();
    assert_eq!(refusal, PrepareError::NoCones(0));
    // Nothing was prepared: nothing is recorded, and there is no result.
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.record(&mut encoder, None);
    queue.submit([encoder.finish()]);
    assert!(pass.result().is_none());
}

/// The far field, look-ups of the ball on itself, and all three ways to combine, by raster and in
/// tiles.
#[test]
fn far_fields_and_objects_on_themselves_match_the_cpu_twin_in_every_pass() {
    let Some(gpu) = gpu() else { return };
    let gbuffer = GBufferFormat {
        receivers: Receivers::Ids,
        ..world_and_signed()
    };
    for camera in [perspective(), reversed(), orthographic()] {
        let many = ManyOccluders::with_far_fields(SIZE, camera);
        for combine in [Combine::Multiply, Combine::Merge, Combine::Mean] {
            let tolerance = 3.0 * ERROR_PER_MERGE;
            let expected = many.twin_image(combine);
            let descriptor = TiledPassDescriptor {
                combine,
                gbuffer,
                ..tiled_descriptor()
            };
            let found = vectors(&many.tiled(&gpu, &descriptor));
            assert!(
                max_difference(&found, &expected) <= tolerance,
                "{combine:?}"
            );
            if combine != Combine::Multiply {
                let descriptor = MergePassDescriptor {
                    gbuffer,
                    mean: combine == Combine::Mean,
                    ..merge_descriptor()
                };
                let found = vectors(&many.merge(&gpu, &descriptor));
                assert!(
                    max_difference(&found, &expected) <= tolerance,
                    "{combine:?}"
                );
            }
        }
        // The far field matters in the picture, and so do look-ups on itself.
        let mut plain = ManyOccluders::with_far_fields(SIZE, camera);
        let far = plain.twin_image(Combine::Merge);
        let differ = |many: &ManyOccluders| {
            let pairs = far.iter().zip(many.twin_image(Combine::Merge));
            pairs.filter(|(a, b)| (a[3] - b[3]).abs() > 0.005).count()
        };
        plain.occluders[1].1.object_id = 19;
        let on_itself = differ(&plain);
        assert!(on_itself > 100, "{on_itself}");
        plain = ManyOccluders::with_far_fields(SIZE, camera);
        for (_, instance) in &mut plain.occluders {
            instance.far_field = Some(0.0);
        }
        assert!(differ(&plain) > 200);
    }
}
