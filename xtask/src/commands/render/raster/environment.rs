//! Modes `environment` and `environment-merge` on a GPU: the runtime's environment pass behind its
//! occlusion or merging pass, once for diffuse surfaces and once for each gloss, told apart by a
//! stencil.

use anyhow::Context as _;
use aogrid_baker_gpu::Context;
use aogrid_runtime::{
    EnvironmentFrame, EnvironmentPass, EnvironmentPassDescriptor, EnvironmentTexture, Normals,
    Output, Positions, Reflection, wgpu,
};
use wgpu::{TextureFormat, TextureUsages};

use super::super::casters::Model;
use super::super::environment::{Surroundings, check};
use super::super::{Job, Shaded, glossy};
use super::textures::{attachment, texels, texture, write};
use super::{Picture, within_memory};
use crate::scene::{Camera, Projection};

const LIGHT: TextureFormat = TextureFormat::Rgba32Float;

const STENCIL: TextureFormat = TextureFormat::Stencil8;

/// What the stencil says of a pixel.
const NO_SURFACE: u8 = 0;
const DIFFUSE: u8 = 1;
const FIRST_GLOSSY: u8 = 2;

/// How the picture's surfaces reflect.
struct Materials {
    /// Of each pixel, what the stencil is to hold.
    stencil: Vec<u8>,
    /// Half-angles of lobes in radians: the first one's surfaces are marked with `FIRST_GLOSSY`.
    lobes: Vec<f64>,
}

pub(in super::super) fn shade(
    job: &Job<'_>,
    gpu: &Context,
    model: Model,
) -> anyhow::Result<Shaded> {
    check(job)?;
    within_memory(gpu, || {
        let surroundings = Surroundings::new(job)?;
        let picture = Picture::new(job, gpu, model)?;
        let (encoder, occlusion) = match model {
            Model::Merge => picture.merge()?,
            Model::Occlusion | Model::Cone => {
                picture.multiply(model, Output::TransmittanceAndAxis)?
            }
        };
        let hidden = texels(gpu, encoder, &occlusion)?;
        let light = picture.light(&surroundings, &occlusion)?;
        let pixels = || picture.pixels.iter();
        Ok(Shaded {
            occlusion: pixels().map(|&pixel| 1.0 - hidden[pixel][3]).collect(),
            occlusion_error: None,
            light: Some(pixels().map(|&pixel| rgb(light[pixel])).collect()),
            light_error: None,
        })
    })
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

impl Materials {
    fn new(picture: &Picture<'_>) -> anyhow::Result<Self> {
        let [width, height] = picture.size.map(|n| n as usize);
        let mut stencil = vec![NO_SURFACE; width * height];
        for &pixel in picture.pixels {
            stencil[pixel] = DIFFUSE;
        }
        let mut lobes = vec![];
        for (idx, lobe) in glossy::lobes(picture.job)? {
            let known = lobes.iter().position(|known| *known == lobe.half_angle);
            let kind = known.unwrap_or(lobes.len());
            if known.is_none() {
                lobes.push(lobe.half_angle);
            }
            stencil[picture.pixels[idx]] = u8::try_from(kind + usize::from(FIRST_GLOSSY))
                .ok()
                .with_context(|| {
                    format!(
                        "{}: materials differ in `gloss` in more ways than a stencil can tell \
                         apart: use --backend cpu",
                        picture.job.scene.path.display()
                    )
                })?;
        }
        Ok(Self { stencil, lobes })
    }
}

impl Picture<'_> {
    /// What each pixel reflects if it is white.
    fn light(
        &self,
        surroundings: &Surroundings<'_>,
        occlusion: &wgpu::Texture,
    ) -> anyhow::Result<Vec<[f32; 4]>> {
        let Materials { stencil, lobes } = Materials::new(self)?;
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let camera = self.job.scene.camera.as_ref();
        let frame = EnvironmentFrame {
            clip_from_world: self.clip_from_world()?,
            eye: eye(camera.context("a picture needs a camera")?),
            lobe_half_angle: 0.0,
            environment: surroundings.place,
            map: &EnvironmentTexture::new(device, queue, &surroundings.map, "environment"),
            occlusion: &occlusion.create_view(&Default::default()),
            normals: &self.views.normals,
            positions: Some(&self.views.positions),
        };
        let mut passes = vec![self.reflecting(Reflection::Lambertian, &frame)?];
        for half_angle in lobes {
            let frame = EnvironmentFrame {
                lobe_half_angle: half_angle as f32,
                ..frame
            };
            passes.push(self.reflecting(Reflection::Glossy, &frame)?);
        }
        self.draw(&stencil, &passes)
    }

    fn reflecting(
        &self,
        reflection: Reflection,
        frame: &EnvironmentFrame<'_>,
    ) -> anyhow::Result<EnvironmentPass> {
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let descriptor = EnvironmentPassDescriptor {
            label: format!("{reflection:?}"),
            reflection,
            target: LIGHT,
            blend: None,
            depth_stencil: Some(where_marked()),
            positions: Positions::World,
            normals: Normals::Signed,
        };
        let mut pass = EnvironmentPass::new(device, descriptor)?;
        pass.prepare(device, queue, frame)?;
        Ok(pass)
    }

    /// Each pass where the stencil holds its place in the list and `DIFFUSE`.
    fn draw(&self, stencil: &[u8], passes: &[EnvironmentPass]) -> anyhow::Result<Vec<[f32; 4]>> {
        let gpu = self.gpu;
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_DST;
        let marks = texture(gpu, "materials", self.size, STENCIL, usage);
        write(gpu, &marks, stencil);
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let light = texture(gpu, "light", self.size, LIGHT, usage);
        let [marks, target] = [&marks, &light].map(|t| t.create_view(&Default::default()));
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("light"),
            color_attachments: &[Some(attachment(&target, wgpu::Color::BLACK))],
            // No operations: it is only read.
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &marks,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..Default::default()
        });
        for (mark, pass) in (u32::from(DIFFUSE)..).zip(passes) {
            render_pass.set_stencil_reference(mark);
            pass.draw(&mut render_pass);
        }
        drop(render_pass);
        texels(gpu, encoder, &light)
    }
}

/// Draws where the stencil holds the reference, and leaves it as it is.
fn where_marked() -> wgpu::DepthStencilState {
    let face = wgpu::StencilFaceState {
        compare: wgpu::CompareFunction::Equal,
        ..wgpu::StencilFaceState::IGNORE
    };
    wgpu::DepthStencilState {
        format: STENCIL,
        depth_write_enabled: None,
        depth_compare: None,
        stencil: wgpu::StencilState {
            front: face,
            back: face,
            read_mask: u32::from(u8::MAX),
            write_mask: 0,
        },
        bias: Default::default(),
    }
}

/// Where the viewer is, and 1; or in which direction, and 0.
fn eye(camera: &Camera) -> [f32; 4] {
    let eye = match camera.projection {
        Projection::Perspective { .. } => camera.position.extend(1.0),
        Projection::Orthographic { .. } => (-camera.forward).extend(0.0),
    };
    eye.as_vec4().to_array()
}
