//! All that is aogrid's: the passes, one for each way to shade, and the grids.

use std::error::Error;

use aogrid_grid_format::{Encoding, Grid};
use aogrid_runtime::{
    Combine, DepthTest, Frame, GridAtlas, GridTexture, Instance, MergePass, MergePassDescriptor,
    Mode, Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions, Receivers,
    TiledFrame, TiledPass, TiledPassDescriptor,
};

use crate::targets::attachment;

/// How pixels are darkened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    None,
    /// Without regard to normals, multiplied by raster.
    Occlusion,
    /// Cones, by raster.
    Cone(Combine),
    /// Cones, in tiles.
    Tiled(Combine),
}

/// What the passes read: world positions, normals as (n + 1)/2, and objects' ids.
pub struct View<'a> {
    pub clip_from_world: [[f32; 4]; 4],
    pub positions: &'a wgpu::TextureView,
    pub normals: &'a wgpu::TextureView,
    pub ids: &'a wgpu::TextureView,
    pub depth: &'a wgpu::TextureView,
    /// What occlusion alone is multiplied into.
    pub darkened: &'a wgpu::TextureView,
    /// What cones are multiplied into by raster.
    pub blended: &'a wgpu::TextureView,
    /// What tiles are written to.
    pub stored: &'a wgpu::TextureView,
}

pub const DARKENED: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
pub const BLENDED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
pub const STORED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// What a way to shade leaves of each pixel.
pub struct Left {
    /// Where 1 − AO is: a texture, and its channel.
    pub transmittance: (wgpu::TextureView, [f32; 4]),
    /// The sum of all (AO/2) d′, and 1 − AO; nothing hidden, where a way has no axes.
    pub sum: wgpu::TextureView,
    /// Whether `sum` has all that is hidden.
    pub has_axes: bool,
}

/// Channels of a texture.
const FIRST: [f32; 4] = [1.0, 0.0, 0.0, 0.0];
pub const LAST: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

pub struct Shadows {
    occlusion: OcclusionPass,
    multiply: OcclusionPass,
    merge: MergePass,
    tiled_multiply: TiledPass,
    tiled_merge: TiledPass,
    grids: Vec<GridTexture>,
    atlas: GridAtlas,
}

impl Shadows {
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        grids: &[Grid],
        depth: wgpu::TextureFormat,
    ) -> Result<Self, Box<dyn Error>> {
        let depth = Some(DepthTest {
            format: depth,
            compare: wgpu::CompareFunction::GreaterEqual,
        });
        // Cones know a surface of their own object by its normal.
        let by_raster = |mode, receivers, output, target| {
            let descriptor = OcclusionPassDescriptor {
                label: format!("{mode:?}"),
                mode,
                output,
                target,
                positions: Positions::World,
                normals: Normals::Unsigned,
                receivers,
                depth,
                front_face: wgpu::FrontFace::Ccw,
                encoding: Encoding::Cone,
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
                positions: Positions::World,
                normals: Normals::Unsigned,
                receivers: Receivers::None,
                encoding: Encoding::Cone,
            };
            TiledPass::new(device, queue, descriptor)
        };
        let merge = MergePassDescriptor {
            label: "Merge".into(),
            format: wgpu::TextureFormat::Rgba16Float,
            positions: Positions::World,
            normals: Normals::Unsigned,
            receivers: Receivers::None,
            depth,
            front_face: wgpu::FrontFace::Ccw,
        };
        let textures = grids
            .iter()
            .map(|grid| GridTexture::new(device, queue, grid, "grid"));
        Ok(Self {
            occlusion: by_raster(
                Mode::Occlusion,
                Receivers::Ids,
                Output::Transmittance,
                DARKENED,
            )?,
            multiply: by_raster(
                Mode::Cone,
                Receivers::None,
                Output::TransmittanceAndAxis,
                BLENDED,
            )?,
            merge: MergePass::new(device, queue, merge)?,
            tiled_multiply: in_tiles(Combine::Multiply)?,
            tiled_merge: in_tiles(Combine::Merge)?,
            grids: textures.collect::<Result<_, _>>()?,
            atlas: GridAtlas::new(device, queue, &grids.iter().collect::<Vec<_>>(), "grids")?,
        })
    }

    /// Once a frame: what stands where, a grid each.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shading: Shading,
        view: &View<'_>,
        places: &[[[f32; 4]; 4]],
    ) -> Result<(), Box<dyn Error>> {
        let instances = || {
            (0..).zip(places).map(|(object_id, place)| Instance {
                object_id,
                ..Instance::at(*place)
            })
        };
        let by_raster: Vec<_> = self.grids.iter().zip(instances()).collect();
        let in_tiles: Vec<_> = instances().enumerate().collect();
        let frame = Frame {
            clip_from_world: view.clip_from_world,
            positions: view.positions,
            normals: Some(view.normals),
            receivers: Some(view.ids),
            occluders: &by_raster,
        };
        let tiled = TiledFrame {
            clip_from_world: view.clip_from_world,
            positions: view.positions,
            normals: Some(view.normals),
            receivers: None,
            atlas: &self.atlas,
            occluders: &in_tiles,
            target: view.stored,
        };
        match shading {
            Shading::None => {}
            Shading::Occlusion => self.occlusion.prepare(device, queue, &frame)?,
            Shading::Cone(Combine::Multiply) => self.multiply.prepare(device, queue, &frame)?,
            Shading::Cone(Combine::Merge) => self.merge.prepare(device, queue, &frame)?,
            Shading::Tiled(Combine::Multiply) => {
                self.tiled_multiply.prepare(device, queue, &tiled)?;
            }
            Shading::Tiled(Combine::Merge) => self.tiled_merge.prepare(device, queue, &tiled)?,
        }
        Ok(())
    }

    /// Records what was prepared.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        shading: Shading,
        view: &View<'_>,
    ) -> Left {
        let with_axes = |sum: &wgpu::TextureView| Left {
            transmittance: (sum.clone(), LAST),
            sum: sum.clone(),
            has_axes: true,
        };
        let tiled = match shading {
            Shading::Tiled(Combine::Multiply) => &self.tiled_multiply,
            Shading::Tiled(Combine::Merge) => &self.tiled_merge,
            Shading::Cone(Combine::Merge) => {
                self.merge.record(encoder, Some(view.depth));
                return with_axes(self.merge.result().unwrap_or(view.blended));
            }
            Shading::None | Shading::Cone(Combine::Multiply) => {
                let drawn = (shading != Shading::None).then_some(&self.multiply);
                multiply_by_raster(encoder, view, view.blended, OPEN, drawn);
                return with_axes(view.blended);
            }
            Shading::Occlusion => {
                multiply_by_raster(encoder, view, view.blended, OPEN, None);
                let clear = self.occlusion.clear_color();
                multiply_by_raster(encoder, view, view.darkened, clear, Some(&self.occlusion));
                return Left {
                    transmittance: (view.darkened.clone(), FIRST),
                    sum: view.blended.clone(),
                    has_axes: false,
                };
            }
        };
        tiled.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
        with_axes(view.stored)
    }
}

/// No axis, and a transmittance of 1.
const OPEN: wgpu::Color = wgpu::Color::BLACK;

/// What is drawn, none or a pass, into a target that is cleared first.
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
        // No operations: it is only read.
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: view.depth,
            depth_ops: None,
            stencil_ops: None,
        }),
        ..Default::default()
    });
    if let Some(drawn) = drawn {
        drawn.draw(&mut pass);
    }
}
