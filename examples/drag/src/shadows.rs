//! The use of aogrid: its passes, one for each shading method, and the grids.

use std::error::Error;

use aogrid_gpu_support::{attachment, read_only_depth};
use aogrid_grid_format::Grid;
use aogrid_runtime::{
    Combine, Frame, GBufferFormat, GBufferViews, GridAtlas, GridTexture, Instance, MergePass,
    MergePassDescriptor, Mode, OcclusionPass, OcclusionPassDescriptor, Output, TiledFrame,
    TiledPass, TiledPassDescriptor,
};

/// The method by which pixels are darkened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    None,
    /// Scalar occlusion, which ignores normals, multiplied by the raster pass.
    Occlusion,
    /// Cones, by the raster passes.
    Cone(Combine),
    /// Cones, by the tiled passes.
    Tiled(Combine),
}

/// The textures of the passes. The G-buffer has object ids.
pub struct View<'a> {
    pub gbuffer: GBufferViews<'a>,
    pub depth: &'a wgpu::TextureView,
    /// The target of scalar occlusion.
    pub darkened: &'a wgpu::TextureView,
    /// The target of cones multiplied by raster.
    pub blended: &'a wgpu::TextureView,
    /// The target of the tiled passes.
    pub stored: &'a wgpu::TextureView,
}

pub const DARKENED: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
pub const BLENDED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
pub const STORED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The result of a shading method for each pixel.
pub struct ShadowResult {
    /// The texture that holds 1 − AO, and a mask of its channel.
    pub transmittance: (wgpu::TextureView, [f32; 4]),
    /// The sum of all (AO/2) d′, and 1 − AO; unoccluded if the method has no axes.
    pub sum: wgpu::TextureView,
    /// Whether `sum` holds the occlusion.
    pub has_axes: bool,
}

/// The mask of a texture's first channel.
const RED_CHANNEL: [f32; 4] = [1.0, 0.0, 0.0, 0.0];
/// The mask of a texture's last channel.
pub const ALPHA_CHANNEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

pub struct Shadows {
    occlusion: OcclusionPass,
    multiply: OcclusionPass,
    merge: MergePass,
    mean: MergePass,
    tiled_multiply: TiledPass,
    tiled_merge: TiledPass,
    tiled_mean: TiledPass,
    grids: Vec<GridTexture>,
    atlas: GridAtlas,
}

impl Shadows {
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        grids: &[Grid],
        gbuffer: GBufferFormat,
    ) -> Result<Self, Box<dyn Error>> {
        let by_raster = |mode, output, target| {
            let descriptor = OcclusionPassDescriptor {
                label: format!("{mode:?}"),
                mode,
                output,
                target,
                gbuffer,
                front_face: wgpu::FrontFace::Ccw,
            };
            OcclusionPass::new(device, queue, descriptor)
        };
        let in_tiles = |combine| {
            let descriptor = TiledPassDescriptor {
                label: format!("{combine:?} in tiles"),
                mode: Mode::Cone,
                combine,
                output: Output::TransmittanceAndAxis,
                target: STORED,
                gbuffer,
            };
            TiledPass::new(device, queue, descriptor)
        };
        let in_pair = |mean| {
            let descriptor = MergePassDescriptor {
                label: if mean { "Mean" } else { "Merge" }.into(),
                format: wgpu::TextureFormat::Rgba16Float,
                mean,
                gbuffer,
                front_face: wgpu::FrontFace::Ccw,
            };
            MergePass::new(device, queue, descriptor)
        };
        let texture = |grid| GridTexture::new(device, queue, grid, "grid");
        Ok(Self {
            occlusion: by_raster(Mode::Occlusion, Output::Transmittance, DARKENED)?,
            multiply: by_raster(Mode::Cone, Output::TransmittanceAndAxis, BLENDED)?,
            merge: in_pair(false)?,
            mean: in_pair(true)?,
            tiled_multiply: in_tiles(Combine::Multiply)?,
            tiled_merge: in_tiles(Combine::Merge)?,
            tiled_mean: in_tiles(Combine::Mean)?,
            grids: grids.iter().map(texture).collect::<Result<_, _>>()?,
            atlas: GridAtlas::new(device, queue, &grids.iter().collect::<Vec<_>>(), "grids")?,
        })
    }

    /// Sets the inputs of a frame. `world_from_objects` has one transform for each grid.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shading: Shading,
        view: &View<'_>,
        world_from_objects: &[[[f32; 4]; 4]],
    ) -> Result<(), Box<dyn Error>> {
        let instances = || {
            (0..)
                .zip(world_from_objects)
                .map(|(object_id, world_from_object)| Instance {
                    object_id,
                    ..Instance::at(*world_from_object)
                })
        };
        let by_raster: Vec<_> = self.grids.iter().zip(instances()).collect();
        let in_tiles: Vec<_> = instances().enumerate().collect();
        let frame = Frame {
            gbuffer: view.gbuffer,
            occluders: &by_raster,
        };
        let tiled = TiledFrame {
            gbuffer: view.gbuffer,
            atlas: &self.atlas,
            occluders: &in_tiles,
            target: view.stored,
        };
        match shading {
            Shading::None => {}
            Shading::Occlusion => self.occlusion.prepare(device, queue, &frame)?,
            Shading::Cone(Combine::Multiply) => self.multiply.prepare(device, queue, &frame)?,
            Shading::Cone(Combine::Merge) => self.merge.prepare(device, queue, &frame)?,
            Shading::Cone(Combine::Mean) => self.mean.prepare(device, queue, &frame)?,
            Shading::Tiled(Combine::Multiply) => {
                self.tiled_multiply.prepare(device, queue, &tiled)?;
            }
            Shading::Tiled(Combine::Merge) => self.tiled_merge.prepare(device, queue, &tiled)?,
            Shading::Tiled(Combine::Mean) => self.tiled_mean.prepare(device, queue, &tiled)?,
        }
        Ok(())
    }

    /// Records the prepared pass and returns its result.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        shading: Shading,
        view: &View<'_>,
    ) -> ShadowResult {
        let with_axes = |sum: &wgpu::TextureView| ShadowResult {
            transmittance: (sum.clone(), ALPHA_CHANNEL),
            sum: sum.clone(),
            has_axes: true,
        };
        let tiled = match shading {
            Shading::Tiled(Combine::Multiply) => &self.tiled_multiply,
            Shading::Tiled(Combine::Merge) => &self.tiled_merge,
            Shading::Tiled(Combine::Mean) => &self.tiled_mean,
            Shading::Cone(Combine::Merge | Combine::Mean) => {
                let is_mean = shading == Shading::Cone(Combine::Mean);
                let pass = if is_mean { &self.mean } else { &self.merge };
                pass.record(encoder, Some(view.depth));
                return with_axes(pass.result().unwrap_or(view.blended));
            }
            Shading::None | Shading::Cone(Combine::Multiply) => {
                let drawn = (shading != Shading::None).then_some(&self.multiply);
                multiply_by_raster(encoder, view, view.blended, UNOCCLUDED, drawn);
                return with_axes(view.blended);
            }
            Shading::Occlusion => {
                multiply_by_raster(encoder, view, view.blended, UNOCCLUDED, None);
                let clear = self.occlusion.clear_color();
                multiply_by_raster(encoder, view, view.darkened, clear, Some(&self.occlusion));
                return ShadowResult {
                    transmittance: (view.darkened.clone(), RED_CHANNEL),
                    sum: view.blended.clone(),
                    has_axes: false,
                };
            }
        };
        tiled.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
        with_axes(view.stored)
    }
}

/// The clear color of an unoccluded pixel: no axis, and a transmittance of 1.
const UNOCCLUDED: wgpu::Color = wgpu::Color::BLACK;

/// Clears a target and multiplies a pass into it, if there is one.
fn multiply_by_raster(
    encoder: &mut wgpu::CommandEncoder,
    view: &View<'_>,
    target: &wgpu::TextureView,
    clear: wgpu::Color,
    drawn: Option<&OcclusionPass>,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("occlusion"),
        color_attachments: &[attachment(target, wgpu::LoadOp::Clear(clear))],
        depth_stencil_attachment: Some(read_only_depth(view.depth)),
        ..Default::default()
    });
    if let Some(drawn) = drawn {
        drawn.draw(&mut pass);
    }
}
