//! Modes `occlusion`, `cone` and `merge` on a GPU: the runtime's raster passes over the picture's
//! G-buffer.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use anyhow::{Context as _, bail, ensure};
use aogrid_baker_gpu::Context;
use aogrid_grid_format::Encoding;
use aogrid_runtime::{
    AOGRID_NO_OBJECT, Frame, GridTexture, Instance, MergePass, MergePassDescriptor, Mode, Normals,
    OcclusionPass, OcclusionPassDescriptor, Output, Positions, Receivers, wgpu,
};
use wgpu::{TextureFormat, TextureUsages};

use super::casters::{self, Caster, Model, as_instance, casters, layers, place};
use super::{Job, Shaded};
use crate::scene::GBuffer;

/// The picture as textures.
struct Views {
    positions: wgpu::TextureView,
    normals: wgpu::TextureView,
    receivers: wgpu::TextureView,
}

/// Its inverse must exist, and that is all: nothing is tested against depths.
const NEAR_AND_FAR: [f64; 2] = [1.0, 2.0];

pub(super) fn shade(job: &Job<'_>, gpu: &Context, model: Model) -> anyhow::Result<Shaded> {
    let scope = gpu
        .device()
        .push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let shaded = draw_picture(job, gpu, model);
    if pollster::block_on(scope.pop()).is_some() {
        bail!(
            "{}: out of memory: make the picture smaller, or use --backend cpu",
            gpu.adapter().name
        );
    }
    shaded
}

fn draw_picture(job: &Job<'_>, gpu: &Context, model: Model) -> anyhow::Result<Shaded> {
    let (gbuffer, pixels) = job
        .target
        .picture
        .as_ref()
        .context("receivers of a list are not in a picture")?;
    let casters = casters(job, model)?;
    let occluders = occluders(job, gpu, &casters)?;
    let views = views(job, gpu, gbuffer, pixels);
    let transmittance = match model {
        Model::Merge => merge(job, gpu, &views, &occluders)?,
        Model::Occlusion | Model::Cone => {
            let passes = passes(job, gpu, model, &views, &occluders)?;
            draw(gpu, gbuffer.size, &passes)?
        }
    };
    let occlusion = pixels.iter().map(|&pixel| 1.0 - transmittance[pixel]);
    casters::shaded(job, occlusion.collect())
}

/// Grids may differ in what they hold. Multiplication commutes: a pass for each kind.
fn passes(
    job: &Job<'_>,
    gpu: &Context,
    model: Model,
    views: &Views,
    occluders: &[(GridTexture, Instance)],
) -> anyhow::Result<Vec<OcclusionPass>> {
    let mut passes = vec![];
    for encoding in [Encoding::Cone, Encoding::Occlusion] {
        let occluders = occluders.iter().map(|(grid, instance)| (grid, *instance));
        let occluders: Vec<_> = occluders
            .filter(|(grid, _)| grid.encoding() == encoding)
            .collect();
        if !occluders.is_empty() {
            passes.push(pass(job, gpu, model, encoding, views, &occluders)?);
        }
    }
    Ok(passes)
}

/// The transmittance of every pixel, cones united in the scene's order.
fn merge(
    job: &Job<'_>,
    gpu: &Context,
    views: &Views,
    occluders: &[(GridTexture, Instance)],
) -> anyhow::Result<Vec<f32>> {
    let occluders = occluders.iter().map(|(grid, instance)| (grid, *instance));
    let occluders: Vec<_> = occluders.collect();
    let descriptor = MergePassDescriptor {
        label: "render".into(),
        format: TextureFormat::Rgba32Float,
        positions: Positions::World,
        normals: Normals::Signed,
        receivers: Receivers::IdsAndLayers,
        depth: None,
        front_face: wgpu::FrontFace::Ccw,
    };
    let mut pass = MergePass::new(gpu.device(), gpu.queue(), descriptor)?;
    pass.prepare(
        gpu.device(),
        gpu.queue(),
        &frame(clip_from_world(job)?, views, &occluders),
    )?;
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    pass.record(&mut encoder, None);
    let result = pass.result().context("nothing was prepared")?;
    let rows = read_back(gpu, encoder, result.texture())?;
    let texels = rows.iter().flat_map(|row| row.chunks_exact(16));
    Ok(texels
        .map(|texel| f32::from_le_bytes([texel[12], texel[13], texel[14], texel[15]]))
        .collect())
}

fn occluders(
    job: &Job<'_>,
    gpu: &Context,
    casters: &[Caster<'_>],
) -> anyhow::Result<Vec<(GridTexture, Instance)>> {
    let mut textures = HashMap::new();
    let mut occluder = |caster: &Caster<'_>| {
        let texture = match textures.entry(Arc::as_ptr(&caster.grid)) {
            Entry::Occupied(made) => made.into_mut(),
            Entry::Vacant(entry) => {
                let (device, queue) = (gpu.device(), gpu.queue());
                let label = &caster.instance.name;
                entry.insert(GridTexture::new(device, queue, &caster.grid, label)?)
            }
        };
        let mut instance = as_instance(caster.instance);
        let excludes = &caster.instance.excludes;
        ensure!(
            excludes.len() <= instance.excluded.len(),
            "it excludes {} receivers, and a GPU's occluder at most {}: use --backend cpu",
            excludes.len(),
            instance.excluded.len()
        );
        instance.excluded[..excludes.len()].copy_from_slice(excludes);
        Ok((texture.clone(), instance))
    };
    casters
        .iter()
        .map(|caster| occluder(caster).with_context(|| place(job, caster.instance)))
        .collect()
}

/// What the twin reads, too: receivers are where rays would start.
fn views(job: &Job<'_>, gpu: &Context, gbuffer: &GBuffer, pixels: &[usize]) -> Views {
    let layers = layers(job);
    // NaN is in no box.
    let mut positions = vec![[f32::NAN; 4]; gbuffer.ids.len()];
    let mut normals = vec![[0.0; 4]; gbuffer.ids.len()];
    let mut receivers = vec![[AOGRID_NO_OBJECT, 0]; gbuffer.ids.len()];
    for (idx, &pixel) in pixels.iter().enumerate() {
        let receiver = &job.target.receivers[idx];
        let id = job.target.ids[idx];
        let xyz0 = |[x, y, z]: [f64; 3]| [x as f32, y as f32, z as f32, 0.0];
        positions[pixel] = xyz0(receiver.position);
        normals[pixel] = xyz0(receiver.normal);
        receivers[pixel] = [id, layers(id)];
    }
    let view = |label, format, texels: &[u8]| {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let texture = texture(gpu, label, gbuffer.size, format, usage);
        let [width, height] = gbuffer.size;
        let layout = wgpu::TexelCopyBufferLayout {
            bytes_per_row: Some(texels.len() as u32 / height),
            ..Default::default()
        };
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        gpu.queue()
            .write_texture(texture.as_image_copy(), texels, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    };
    let floats = TextureFormat::Rgba32Float;
    Views {
        positions: view("positions", floats, bytemuck::cast_slice(&positions)),
        normals: view("normals", floats, bytemuck::cast_slice(&normals)),
        receivers: view(
            "receivers",
            TextureFormat::Rg32Uint,
            bytemuck::cast_slice(&receivers),
        ),
    }
}

fn pass(
    job: &Job<'_>,
    gpu: &Context,
    model: Model,
    encoding: Encoding,
    views: &Views,
    occluders: &[(&GridTexture, Instance)],
) -> anyhow::Result<OcclusionPass> {
    let descriptor = OcclusionPassDescriptor {
        label: "render".into(),
        mode: match model {
            Model::Occlusion => Mode::Occlusion,
            Model::Cone | Model::Merge => Mode::Cone,
        },
        output: Output::Transmittance,
        target: target_format(gpu),
        positions: Positions::World,
        normals: Normals::Signed,
        receivers: Receivers::IdsAndLayers,
        depth: None,
        front_face: wgpu::FrontFace::Ccw,
        encoding,
    };
    let mut pass = OcclusionPass::new(gpu.device(), gpu.queue(), descriptor)?;
    let frame = frame(clip_from_world(job)?, views, occluders);
    pass.prepare(gpu.device(), gpu.queue(), &frame)?;
    Ok(pass)
}

fn clip_from_world(job: &Job<'_>) -> anyhow::Result<[[f32; 4]; 4]> {
    let camera = job.scene.camera.as_ref();
    let camera = camera.context("a picture needs a camera")?;
    let [near, far] = NEAR_AND_FAR;
    let clip_from_world = camera.clip_from_world(near, far).as_mat4();
    Ok(clip_from_world.to_cols_array_2d())
}

fn frame<'a>(
    clip_from_world: [[f32; 4]; 4],
    views: &'a Views,
    occluders: &'a [(&'a GridTexture, Instance)],
) -> Frame<'a> {
    Frame {
        clip_from_world,
        positions: &views.positions,
        normals: Some(&views.normals),
        receivers: Some(&views.receivers),
        occluders,
    }
}

/// The widest that the device can multiply into.
fn target_format(gpu: &Context) -> TextureFormat {
    let features = gpu.device().features();
    match features.contains(wgpu::Features::FLOAT32_BLENDABLE) {
        true => TextureFormat::R32Float,
        false => TextureFormat::R16Float,
    }
}

/// The transmittance of every pixel.
fn draw(gpu: &Context, size: [u32; 2], passes: &[OcclusionPass]) -> anyhow::Result<Vec<f32>> {
    let format = target_format(gpu);
    let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    let target = texture(gpu, "transmittance", size, format, usage);
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    let view = target.create_view(&Default::default());
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("render"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    passes.iter().for_each(|pass| pass.draw(&mut render_pass));
    drop(render_pass);
    let rows = read_back(gpu, encoder, &target)?;
    let texel = format.block_copy_size(None).unwrap_or(4) as usize;
    Ok(rows
        .iter()
        .flat_map(|row| row.chunks_exact(texel))
        .map(|texel| match *texel {
            [a, b] => half::f16::from_le_bytes([a, b]).to_f32(),
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            _ => unreachable!("texels of 16 or 32 bits"),
        })
        .collect())
}

/// Submits what was recorded and copies a texture out, row by row.
fn read_back(
    gpu: &Context,
    mut encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
) -> anyhow::Result<Vec<Vec<u8>>> {
    let (size, format) = (texture.size(), texture.format());
    let row = size.width * format.block_copy_size(None).unwrap_or(4);
    let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(stride) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let info = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            bytes_per_row: Some(stride),
            ..Default::default()
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), info, size);
    gpu.queue().submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device().poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.get_mapped_range(..)?;
    let rows = bytes.chunks_exact(stride as usize);
    Ok(rows.map(|bytes| bytes[..row as usize].to_vec()).collect())
}

fn texture(
    gpu: &Context,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
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
