//! The textures of the window's size.

use aogrid_gpu_support::Gpu;
use aogrid_runtime::{DepthTest, GBufferFormat, GBufferViews, Normals, Positions, Receivers};

use crate::shadows::{BLENDED, DARKENED, STORED};

pub const POSITIONS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
pub const NORMALS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The description of the G-buffer for the passes that cones are shaded with, which need no ids.
pub const GBUFFER: GBufferFormat = GBufferFormat {
    positions: Positions::World,
    normals: Normals::Unsigned,
    receivers: Receivers::Ids,
    depth: Some(DepthTest {
        format: DEPTH,
        compare: wgpu::CompareFunction::GreaterEqual,
    }),
};

pub struct Targets {
    pub positions: wgpu::TextureView,
    pub normals: wgpu::TextureView,
    pub ids: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    pub darkened: wgpu::TextureView,
    pub blended: wgpu::TextureView,
    pub stored: wgpu::TextureView,
    /// Ambient light, with an alpha of 1.
    pub light: wgpu::TextureView,
}

impl Targets {
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
        let target = |format| view(gpu.target(size, format));
        Self {
            light: target(LIGHT),
            positions: target(POSITIONS),
            normals: target(NORMALS),
            ids: target(IDS),
            depth: view(gpu.target_depth(size, DEPTH)),
            darkened: target(DARKENED),
            blended: target(BLENDED),
            stored: view(gpu.storage_target(size, STORED)),
        }
    }

    /// Returns the G-buffer, drawn with this camera.
    pub fn gbuffer(&self, clip_from_world: [[f32; 4]; 4]) -> GBufferViews<'_> {
        GBufferViews {
            clip_from_world,
            positions: &self.positions,
            normals: Some(&self.normals),
            receivers: Some(&self.ids),
        }
    }
}
