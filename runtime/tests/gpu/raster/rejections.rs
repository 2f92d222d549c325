use aogrid_gpu_support::{Gpu, gpu};
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    Frame, GBufferError, GBufferViews, GridTexture, Instance, Mode, OcclusionPass,
    OcclusionPassDescriptor, Output, PassError, PrepareError,
};
use glam::Mat4;

use super::descriptor;
use crate::grids::ball;
use crate::scene::{SIZE, perspective};

#[test]
fn unsuitable_descriptors_and_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let refusal = |descriptor| OcclusionPass::new(device, queue, descriptor).unwrap_err();
    let axis = OcclusionPassDescriptor {
        mode: Mode::Occlusion,
        output: Output::TransmittanceAndAxis,
        ..descriptor()
    };
    assert_eq!(refusal(axis), PassError::NoAxis);
    for (target, output) in [
        (wgpu::TextureFormat::R32Uint, Output::Transmittance),
        (
            wgpu::TextureFormat::Rgba8Unorm,
            Output::TransmittanceAndAxis,
        ),
    ] {
        let descriptor = OcclusionPassDescriptor {
            target,
            output,
            ..descriptor()
        };
        assert!(matches!(refusal(descriptor), PassError::Target { .. }));
    }
    let mut pass = OcclusionPass::new(device, queue, descriptor()).unwrap();
    let grid = ball(Encoding::Occlusion, TexelFormat::Unorm8);
    let grid = GridTexture::new(device, queue, &grid, "ball").unwrap();
    let view = gpu.upload(SIZE, wgpu::TextureFormat::R32Float, &[0; 128 * 96 * 4]);
    let occluders = [(&grid, Instance::at(Mat4::IDENTITY.to_cols_array_2d()))];
    let views = GBufferViews {
        clip_from_world: perspective().to_cols_array_2d(),
        positions: &view,
        normals: None,
        receivers: None,
    };
    let mut prepare = |gbuffer| {
        let frame = Frame {
            gbuffer,
            occluders: &occluders,
        };
        pass.prepare(device, queue, &frame).unwrap_err()
    };
    assert_eq!(prepare(views), GBufferError::Missing("normals").into());
    let with_normals = GBufferViews {
        normals: Some(&view),
        ..views
    };
    assert_eq!(prepare(with_normals), PrepareError::NoCones(0));
    let flat = GBufferViews {
        clip_from_world: [[0.0; 4]; 4],
        ..with_normals
    };
    assert_eq!(prepare(flat), GBufferError::Camera.into());
}
