//! Look-ups on a GPU by the runtime's raster passes over the picture's G-buffer.

pub(super) mod environment;
mod textures;
mod volumes;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use aogrid_runtime::{
    AOGRID_NO_OBJECT, Frame, GBufferFormat, GBufferViews, GridTexture, Instance, MergePass,
    MergePassDescriptor, Mode, Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions,
    Receivers, wgpu,
};
use glam::DMat4;
use wgpu::{TextureFormat, TextureUsages};

use self::textures::{Views, cleared_attachment, create_texture, read_back};
use super::casters::{Caster, GridShading, any_mesh, casters, describe};
use super::light::with_light;
use super::{Gpu, ShadeInput, Shaded};
use crate::SceneMesh;
use crate::error::{Context, Result, SceneError, bail, ensure};

pub(super) use volumes::volume_occlusion;

/// A scene's picture and its occluders, on the GPU.
struct Picture<'a> {
    input: &'a ShadeInput<'a>,
    gpu: &'a Gpu<'a>,
    size: [u32; 2],
    /// Pixel of each receiver.
    pixels: &'a [usize],
    views: Views,
    occluders: Vec<(GridTexture, Instance)>,
}

/// Near and far plane of the projection. The values do not matter, since there is no depth test;
/// the matrix must only be invertible.
const CLIP_RANGE: [f64; 2] = [1.0, 2.0];

/// The format of the uploaded G-buffer.
const FORMAT: GBufferFormat = GBufferFormat {
    positions: Positions::World,
    normals: Normals::Signed,
    receivers: Receivers::IdsAndLayers,
    depth: None,
};

pub(super) fn shade(input: &ShadeInput<'_>, gpu: &Gpu<'_>, shading: GridShading) -> Result<Shaded> {
    with_light(input, occlusion(input, gpu, shading, any_mesh)?)
}

/// Returns the AO of the casters of chosen meshes for each receiver.
pub(super) fn occlusion(
    input: &ShadeInput<'_>,
    gpu: &Gpu<'_>,
    shading: GridShading,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<f32>> {
    catch_out_of_memory(gpu, || {
        let picture = Picture::new(input, gpu, &casters(input, shading, chosen)?)?;
        let transmittance = picture.transmittance(shading)?;
        let pixels = picture.pixels.iter();
        Ok(pixels.map(|&pixel| 1.0 - transmittance[pixel]).collect())
    })
}

/// Runs `shade` and turns an out-of-memory condition of the GPU into an error.
fn catch_out_of_memory<T>(gpu: &Gpu<'_>, shade: impl FnOnce() -> Result<T>) -> Result<T> {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let shaded = shade();
    if pollster::block_on(scope.pop()).is_some() {
        bail!(
            "{}: out of memory: make the picture smaller, or use --backend cpu",
            gpu.device.adapter_info().name
        );
    }
    shaded
}

impl<'a> Picture<'a> {
    fn new(input: &'a ShadeInput<'a>, gpu: &'a Gpu<'a>, casters: &[Caster<'_>]) -> Result<Self> {
        let picture = input.target.picture.as_ref();
        let (gbuffer, pixels) =
            picture.ok_or_else(|| SceneError::new("receivers of a list are not in a picture"))?;
        Ok(Self {
            input,
            gpu,
            size: gbuffer.size,
            pixels,
            occluders: occluders(input, gpu, casters)?,
            views: Views::new(input, gpu, gbuffer, pixels),
        })
    }

    /// Returns the transmittance 1 − AO of each pixel.
    fn transmittance(&self, shading: GridShading) -> Result<Vec<f32>> {
        let ((encoder, texture), channel) = match shading {
            GridShading::Merge | GridShading::Mean => (self.merge(shading)?, 3),
            GridShading::Occlusion | GridShading::Cone | GridShading::Neighbors => {
                (self.multiply(shading, Output::Transmittance)?, 0)
            }
        };
        let texels = read_back(self.gpu, encoder, &texture)?;
        Ok(texels.into_iter().map(|texel| texel[channel]).collect())
    }

    /// Records all occluders, multiplied, and returns the commands and their target.
    fn multiply(
        &self,
        shading: GridShading,
        output: Output,
    ) -> Result<(wgpu::CommandEncoder, wgpu::Texture)> {
        let usage = TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::COPY_SRC
            | TextureUsages::TEXTURE_BINDING;
        let format = self.widest_format(output);
        let target = create_texture(self.gpu, "occlusion", self.size, format, usage);
        let view = target.create_view(&Default::default());
        let pass = self.occlusion_pass(shading, output)?;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("occlusion"),
            color_attachments: &[Some(cleared_attachment(&view, pass.clear_color()))],
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        Ok((encoder, target))
    }

    fn occlusion_pass(&self, shading: GridShading, output: Output) -> Result<OcclusionPass> {
        let occluders = self.occluders.iter();
        let occluders: Vec<_> = occluders
            .map(|(grid, instance)| (grid, *instance))
            .collect();
        let descriptor = OcclusionPassDescriptor {
            label: "render".into(),
            mode: match shading {
                GridShading::Occlusion => Mode::Occlusion,
                GridShading::Cone
                | GridShading::Merge
                | GridShading::Mean
                | GridShading::Neighbors => Mode::Cone,
            },
            output,
            target: self.widest_format(output),
            gbuffer: FORMAT,
            front_face: wgpu::FrontFace::Ccw,
        };
        let (device, queue) = (self.gpu.device, self.gpu.queue);
        let mut pass = OcclusionPass::new(device, queue, descriptor)?;
        pass.prepare(device, queue, &self.frame(&occluders)?)?;
        Ok(pass)
    }

    /// Records all occluders, merged or by the mean in the scene's order, and returns the commands and their
    /// target.
    fn merge(&self, shading: GridShading) -> Result<(wgpu::CommandEncoder, wgpu::Texture)> {
        let occluders = self.occluders.iter();
        let occluders: Vec<_> = occluders
            .map(|(grid, instance)| (grid, *instance))
            .collect();
        let descriptor = MergePassDescriptor {
            label: "render".into(),
            format: TextureFormat::Rgba32Float,
            mean: shading == GridShading::Mean,
            gbuffer: FORMAT,
            front_face: wgpu::FrontFace::Ccw,
        };
        let (device, queue) = (self.gpu.device, self.gpu.queue);
        let mut pass = MergePass::new(device, queue, descriptor)?;
        pass.prepare(device, queue, &self.frame(&occluders)?)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        pass.record(&mut encoder, None);
        let result = pass
            .result()
            .ok_or_else(|| SceneError::new("nothing was prepared"))?;
        Ok((encoder, result.texture().clone()))
    }

    fn frame<'b>(&'b self, occluders: &'b [(&'b GridTexture, Instance)]) -> Result<Frame<'b>> {
        Ok(Frame {
            gbuffer: self.gbuffer()?,
            occluders,
        })
    }

    fn gbuffer(&self) -> Result<GBufferViews<'_>> {
        Ok(GBufferViews {
            clip_from_world: self.clip_from_world()?,
            positions: &self.views.positions,
            normals: Some(&self.views.normals),
            receivers: Some(&self.views.receivers),
        })
    }

    fn clip_from_world(&self) -> Result<[[f32; 4]; 4]> {
        let camera = self.input.scene.camera.as_ref();
        let camera = camera.ok_or_else(|| SceneError::new("a picture needs a camera"))?;
        let [near, far] = CLIP_RANGE;
        let world_from_relative = DMat4::from_translation(self.input.target.origin.into());
        let clip_from_world = camera.clip_from_world(near, far) * world_from_relative;
        Ok(clip_from_world.as_mat4().to_cols_array_2d())
    }

    /// Returns the widest format that the device can blend into.
    fn widest_format(&self, output: Output) -> TextureFormat {
        let features = self.gpu.device.features();
        let blends = features.contains(wgpu::Features::FLOAT32_BLENDABLE);
        match (output, blends) {
            (Output::Transmittance, true) => TextureFormat::R32Float,
            (Output::Transmittance, false) => TextureFormat::R16Float,
            (Output::TransmittanceAndAxis, true) => TextureFormat::Rgba32Float,
            (Output::TransmittanceAndAxis, false) => TextureFormat::Rgba16Float,
        }
    }
}

/// Uploads the casters' grids, each once, and returns them with their instances.
fn occluders(
    input: &ShadeInput<'_>,
    gpu: &Gpu<'_>,
    casters: &[Caster<'_>],
) -> Result<Vec<(GridTexture, Instance)>> {
    let mut textures = HashMap::new();
    let mut occluder = |caster: &Caster<'_>| -> Result<_> {
        let texture = match textures.entry(Arc::as_ptr(&caster.grid)) {
            Entry::Occupied(made) => made.into_mut(),
            Entry::Vacant(entry) => {
                let (device, queue) = (gpu.device, gpu.queue);
                let label = &caster.instance.name;
                entry.insert(GridTexture::new(device, queue, &caster.grid, label)?)
            }
        };
        let mut instance = caster.posed;
        instance.excluded = excluded(&caster.excludes())?;
        Ok((texture.clone(), instance))
    };
    casters
        .iter()
        .map(|caster| occluder(caster).with_context(|| describe(input, caster.instance)))
        .collect()
}

/// Returns the ids of the receivers that an instance does not shade.
fn excluded(excludes: &[u32]) -> Result<[u32; 4]> {
    let mut excluded = [AOGRID_NO_OBJECT; 4];
    ensure!(
        excludes.len() <= excluded.len(),
        "it excludes {} receivers, and a GPU's occluder at most {}: use --backend cpu",
        excludes.len(),
        excluded.len()
    );
    excluded[..excludes.len()].copy_from_slice(excludes);
    Ok(excluded)
}
