use aogrid_gpu_support::{Gpu, gpu};
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    GBufferError, GridAtlas, GridAtlasError, Mode, Output, PassError, PrepareError, TiledFrame,
    TiledPass, TiledPassDescriptor,
};

use crate::grids::ball;
use crate::many::{ManyOccluders, tiled_descriptor};
use crate::raster::world_and_signed;
use crate::scene::{SIZE, perspective};

#[test]
fn unsuitable_descriptors_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let refusal = |descriptor| TiledPass::new(device, queue, descriptor).unwrap_err();
    let no_axis = TiledPassDescriptor {
        mode: Mode::Occlusion,
        ..tiled_descriptor()
    };
    assert_eq!(refusal(no_axis), PassError::NoAxis);
    for (target, output) in [
        (wgpu::TextureFormat::R16Float, Output::Transmittance),
        (
            wgpu::TextureFormat::Rgba8Unorm,
            Output::TransmittanceAndAxis,
        ),
    ] {
        let descriptor = TiledPassDescriptor {
            target,
            output,
            ..tiled_descriptor()
        };
        assert!(matches!(refusal(descriptor), PassError::Target { .. }));
    }
}

#[test]
fn grids_that_differ_form_no_atlas() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let cones = ball(Encoding::Cone, TexelFormat::F16);
    let bytes = ball(Encoding::Cone, TexelFormat::Unorm8);
    let refusal = |grids: &[_]| GridAtlas::new(device, queue, grids, "balls").unwrap_err();
    assert_eq!(refusal(&[]), GridAtlasError::Empty);
    assert_eq!(refusal(&[&cones, &bytes]), GridAtlasError::Mixed(1));
}

#[test]
fn unsuitable_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let [cones, plain] = [Encoding::Cone, Encoding::Occlusion].map(|encoding| {
        let grid = ball(encoding, TexelFormat::F16);
        GridAtlas::new(device, queue, &[&grid], "ball").unwrap()
    });
    let many = ManyOccluders::new(SIZE, perspective());
    let views = many.views(&gpu);
    let format = tiled_descriptor().target;
    let target = gpu
        .storage_target(SIZE, format)
        .create_view(&Default::default());
    let small = gpu
        .storage_target([16, 16], format)
        .create_view(&Default::default());
    let mut pass = TiledPass::new(device, queue, tiled_descriptor()).unwrap();
    let crowd = vec![many.occluders[0]; TiledPass::MAX_OCCLUDERS + 1];
    let frame = TiledFrame {
        gbuffer: views.gbuffer(perspective(), &world_and_signed()),
        atlas: &cones,
        occluders: &many.occluders[..1],
        target: &target,
    };
    let mut prepare = |frame| pass.prepare(device, queue, &frame);
    assert_eq!(prepare(frame), Ok(()));
    let mut refusal = |changed| prepare(changed).unwrap_err();
    let mut no_normals = frame;
    no_normals.gbuffer.normals = None;
    assert_eq!(refusal(no_normals), GBufferError::Missing("normals").into());
    let occluders = &many.occluders;
    let unknown_grid = TiledFrame { occluders, ..frame };
    assert_eq!(refusal(unknown_grid), PrepareError::NoSuchGrid(1));
    let occluders = &crowd;
    let crowded = TiledFrame { occluders, ..frame };
    assert_eq!(refusal(crowded), PrepareError::TooMany(crowd.len()));
    let atlas = &plain;
    let without_cones = TiledFrame { atlas, ..frame };
    assert_eq!(refusal(without_cones), PrepareError::NoCones(0));
    let target = &small;
    let too_small = TiledFrame { target, ..frame };
    assert_eq!(refusal(too_small), PrepareError::TargetSize);
}
