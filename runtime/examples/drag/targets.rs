//! The textures of the window's size.

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
    receivers: Receivers::None,
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
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let view = |format| texture(device, size, format, usage).create_view(&Default::default());
        Self {
            light: view(LIGHT),
            positions: view(POSITIONS),
            normals: view(NORMALS),
            ids: view(IDS),
            depth: view(DEPTH),
            darkened: view(DARKENED),
            blended: view(BLENDED),
            stored: texture(
                device,
                size,
                STORED,
                wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
            )
            .create_view(&Default::default()),
        }
    }
}

impl Targets {
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

pub fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// Returns a color attachment of a render pass.
pub fn attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load,
            store: wgpu::StoreOp::Store,
        },
    })
}
