use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    Combine, DepthTest, Frame, GridTexture, Instance, MergePass, MergePassDescriptor, PassError,
    Positions, PrepareError, Receivers,
};

use crate::gpu::{Gpu, gpu, gpu_with};
use crate::grids::ball;
use crate::many::{Many, halves, merge_descriptor, tiled_descriptor, vectors, worst};
use crate::scene::{SIZE, orthographic, perspective, reversed};

/// What one merge may differ by on floats: an angle from its cosine next to 0, √(2ε) for a handful
/// of roundings ε = 1e-6, times 1/π of AO a radian; what axes turn by next to f's jump is less.
pub const PER_MERGE: f32 = 5e-4;

/// One rounding of each of both buffers to a half: below 1, and of axes below 2.
const HALF: f32 = 1.0 / 1024.0;

#[test]
fn images_are_the_twin_s_whatever_the_camera_and_the_number_of_occluders() {
    let Some(gpu) = gpu() else { return };
    for camera in [perspective(), reversed(), orthographic()] {
        for count in [1, 2, 3] {
            let mut many = Many::new(SIZE, camera);
            many.occluders.truncate(count);
            let found = vectors(&many.merge(&gpu, &merge_descriptor()));
            let expected = many.twin(Combine::Merge);
            assert!(worst(&found, &expected) <= count as f32 * PER_MERGE);
        }
    }
}

#[test]
fn one_occluder_merged_is_its_cone_by_raster_in_tiles_and_by_the_twin() {
    let Some(gpu) = gpu() else { return };
    let mut many = Many::new(SIZE, perspective());
    many.occluders.truncate(1);
    let cone = many.twin(Combine::Multiply);
    // 1 + (t - 1), and two orders of the same sums.
    const ROUNDING: f32 = 1e-5;
    assert!(worst(&many.twin(Combine::Merge), &cone) <= ROUNDING);
    let by_raster = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(worst(&by_raster, &cone) <= 20.0 * ROUNDING);
    let in_tiles = vectors(&many.tiled(&gpu, &tiled_descriptor()));
    assert!(worst(&in_tiles, &cone) <= 20.0 * ROUNDING);
}

#[test]
fn no_occluders_hide_nothing() {
    let Some(gpu) = gpu() else { return };
    let mut many = Many::new(SIZE, perspective());
    many.occluders.clear();
    let open = vec![[0.0, 0.0, 0.0, 1.0]; many.buffer.positions.len()];
    assert_eq!(vectors(&many.merge(&gpu, &merge_descriptor())), open);
    assert_eq!(vectors(&many.tiled(&gpu, &tiled_descriptor())), open);
}

#[test]
fn overlapping_shadows_merge_lighter_than_they_multiply() {
    let Some(gpu) = gpu() else { return };
    let mut many = Many::new(SIZE, perspective());
    many.occluders = vec![many.occluders[0]; 3];
    let merged = vectors(&many.merge(&gpu, &merge_descriptor()));
    let multiplied = many.twin(Combine::Multiply);
    let one = Many {
        occluders: vec![many.occluders[0]],
        ..Many::new(SIZE, perspective())
    };
    let one = one.twin(Combine::Merge);
    let mut differences = [0.0_f32; 2];
    for pixel in 0..merged.len() {
        let to_one = (merged[pixel][3] - one[pixel][3]).abs();
        differences[0] = differences[0].max(to_one);
        differences[1] = differences[1].max((multiplied[pixel][3] - one[pixel][3]).abs());
    }
    println!("{differences:?}");
    // Thrice the same cone is that cone but for the table's error on its crease, twice over.
    assert!(differences[0] <= 2.0 * 2.0 * 5.5e-3, "{differences:?}");
    assert!(differences[1] > 0.3);
}

#[test]
fn occluders_merge_in_the_order_of_the_caller() {
    let Some(gpu) = gpu() else { return };
    let mut many = Many::new(SIZE, perspective());
    // Close together, so that all three overlap on the floor.
    for ((_, instance), x) in many.occluders.iter_mut().zip([-0.4, 0.0, 0.5]) {
        let place = glam::Mat4::from_translation(glam::Vec3::new(x, 0.1 * x, -x));
        *instance = Instance::at(place.to_cols_array_2d());
    }
    let forwards = many.twin(Combine::Merge);
    let found = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(worst(&found, &forwards) <= 3.0 * PER_MERGE);
    many.occluders.reverse();
    let backwards = many.twin(Combine::Merge);
    assert!(worst(&backwards, &forwards) > 10.0 * PER_MERGE);
    let found = vectors(&many.merge(&gpu, &merge_descriptor()));
    assert!(worst(&found, &backwards) <= 3.0 * PER_MERGE);
    let found = vectors(&many.tiled(&gpu, &tiled_descriptor()));
    assert!(worst(&found, &backwards) <= 3.0 * PER_MERGE);
}

#[test]
fn ids_layers_strength_and_exclusion_are_the_twin_s() {
    let Some(gpu) = gpu() else { return };
    let mut many = Many::new(SIZE, perspective());
    let plain = many.twin(Combine::Merge);
    many.occluders[1].1.strength = 0.4;
    many.occluders[1].1.layers = 2;
    many.occluders[2].1.excluded[0] = 3;
    many.occluders[2].1.excluded[1] = 2;
    let with_ids = MergePassDescriptor {
        receivers: Receivers::IdsAndLayers,
        ..merge_descriptor()
    };
    let found = vectors(&many.merge(&gpu, &with_ids));
    assert!(worst(&found, &many.twin(Combine::Merge)) <= 3.0 * PER_MERGE);
    assert!(worst(&found, &plain) > 0.1);
}

#[test]
fn a_depth_test_leaves_the_image_as_it_is_and_depths_serve_as_positions() {
    let wanted = wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::DEPTH_CLIP_CONTROL;
    let Some(gpu) = gpu_with(wanted) else { return };
    for (camera, compare) in [
        (perspective(), wgpu::CompareFunction::GreaterEqual),
        (reversed(), wgpu::CompareFunction::LessEqual),
    ] {
        let many = Many::new(SIZE, camera);
        let without = many.merge(&gpu, &merge_descriptor());
        let with = MergePassDescriptor {
            depth: Some(DepthTest {
                format: wgpu::TextureFormat::Depth32Float,
                compare,
            }),
            ..merge_descriptor()
        };
        assert!(many.merge(&gpu, &with) == without);
        let from_depth = MergePassDescriptor {
            positions: Positions::Depth,
            ..merge_descriptor()
        };
        let found = vectors(&many.merge(&gpu, &from_depth));
        // A step of the depth is 2e-5 units here, of which a look-up makes 14 times as much; the
        // angle between the cones turns by a little of that.
        let tolerance = 3.0 * (PER_MERGE + 14.0 * 2e-5);
        assert!(worst(&found, &many.twin(Combine::Merge)) <= tolerance);
    }
}

#[test]
fn halves_hold_what_is_merged() {
    let Some(gpu) = gpu() else { return };
    let many = Many::new(SIZE, perspective());
    let in_halves = MergePassDescriptor {
        format: wgpu::TextureFormat::Rgba16Float,
        ..merge_descriptor()
    };
    let found = halves(&many.merge(&gpu, &in_halves));
    assert!(worst(&found, &many.twin(Combine::Merge)) <= 3.0 * (HALF + PER_MERGE));
}

#[test]
fn what_does_not_fit_is_refused() {
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
    let many = Many::new(SIZE, perspective());
    let views = many.views(&gpu);
    let occluders = [(&grid, many.occluders[0].1)];
    let frame = Frame {
        clip_from_world: perspective().to_cols_array_2d(),
        positions: &views.positions,
        normals: Some(&views.normals),
        receivers: None,
        occluders: &occluders,
    };
    let refusal = pass.prepare(device, queue, &frame).unwrap_err();
    assert_eq!(refusal, PrepareError::Encoding(0));
    // Nothing was prepared: nothing is recorded, and there is no result.
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.record(&mut encoder, None);
    queue.submit([encoder.finish()]);
    assert!(pass.result().is_none());
}
