//! Light on a GPU: the runtime's environment pass after its
//! occlusion or merge pass, once for diffuse surfaces and once for each gloss, selected by a
//! stencil.

use aogrid_runtime::{
    EnvironmentFrame, EnvironmentPass, EnvironmentPassDescriptor, EnvironmentTexture, Output,
    Reflection, wgpu,
};
use glam::DVec3;
use wgpu::{TextureFormat, TextureUsages};

use super::super::casters::{GridShading, any_mesh, casters};
use super::super::light::{EnvironmentLight, check};
use super::super::{Gpu, ShadeInput, Shaded, glossy};
use super::textures::{cleared_attachment, create_texture, read_back, upload};
use super::{FORMAT, Picture, catch_out_of_memory};
use crate::error::{Result, SceneError};
use crate::{Camera, Projection};

const LIGHT: TextureFormat = TextureFormat::Rgba32Float;

const STENCIL: TextureFormat = TextureFormat::Stencil8;

/// Stencil values of pixels; the glossy materials count up from [`FIRST_GLOSSY`].
const NO_SURFACE: u8 = 0;
const DIFFUSE: u8 = 1;
const FIRST_GLOSSY: u8 = 2;

/// The kinds of reflection among the picture's surfaces.
struct Materials {
    /// Stencil value of each pixel.
    stencil: Vec<u8>,
    /// Half-angles of lobes in radians; surfaces of the first one are marked with `FIRST_GLOSSY`.
    lobes: Vec<f64>,
}

pub(in super::super) fn shade(
    input: &ShadeInput<'_>,
    gpu: &Gpu<'_>,
    shading: GridShading,
) -> Result<Shaded> {
    check(input)?;
    catch_out_of_memory(gpu, || {
        let environment_light = EnvironmentLight::new(input)?;
        let picture = Picture::new(input, gpu, &casters(input, shading, any_mesh)?)?;
        let (encoder, occlusion) = match shading {
            GridShading::Merge | GridShading::Mean => picture.merge(shading)?,
            GridShading::Occlusion | GridShading::Cone | GridShading::Neighbors => {
                picture.multiply(shading, Output::TransmittanceAndAxis)?
            }
        };
        let accumulated = read_back(gpu, encoder, &occlusion)?;
        let light = picture.light(&environment_light, &occlusion)?;
        let pixels = || picture.pixels.iter();
        Ok(Shaded {
            occlusion: pixels().map(|&pixel| 1.0 - accumulated[pixel][3]).collect(),
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
    fn new(picture: &Picture<'_>) -> Result<Self> {
        let [width, height] = picture.size.map(|n| n as usize);
        let mut stencil = vec![NO_SURFACE; width * height];
        for &pixel in picture.pixels {
            stencil[pixel] = DIFFUSE;
        }
        let mut lobes = vec![];
        for (idx, lobe) in glossy::lobes(picture.input)? {
            let known = lobes.iter().position(|known| *known == lobe.half_angle);
            let kind = known.unwrap_or(lobes.len());
            if known.is_none() {
                lobes.push(lobe.half_angle);
            }
            stencil[picture.pixels[idx]] = u8::try_from(kind + usize::from(FIRST_GLOSSY))
                .ok()
                .ok_or_else(|| {
                    SceneError::new(format!(
                        "{}: materials differ in `gloss` in more ways than a stencil can tell \
                         apart: use --backend cpu",
                        picture.input.scene.path.display()
                    ))
                })?;
        }
        Ok(Self { stencil, lobes })
    }
}

impl Picture<'_> {
    /// Returns the radiance that each pixel reflects if it is white.
    fn light(
        &self,
        environment_light: &EnvironmentLight<'_>,
        occlusion: &wgpu::Texture,
    ) -> Result<Vec<[f32; 4]>> {
        let Materials { stencil, lobes } = Materials::new(self)?;
        let (device, queue) = (self.gpu.device, self.gpu.queue);
        let camera = self.input.scene.camera.as_ref();
        let frame = EnvironmentFrame {
            gbuffer: self.gbuffer()?,
            eye: eye(
                camera.ok_or_else(|| SceneError::new("a picture needs a camera"))?,
                self.input.target.origin,
            ),
            lobe_half_angle: 0.0,
            environment: environment_light.environment,
            map: &EnvironmentTexture::new(device, queue, &environment_light.map, "environment"),
            occlusion: &occlusion.create_view(&Default::default()),
        };
        let mut passes = vec![self.reflection_pass(Reflection::Lambertian, &frame)?];
        for half_angle in lobes {
            let frame = EnvironmentFrame {
                lobe_half_angle: half_angle as f32,
                ..frame
            };
            passes.push(self.reflection_pass(Reflection::Glossy, &frame)?);
        }
        self.draw(&stencil, &passes)
    }

    fn reflection_pass(
        &self,
        reflection: Reflection,
        frame: &EnvironmentFrame<'_>,
    ) -> Result<EnvironmentPass> {
        let (device, queue) = (self.gpu.device, self.gpu.queue);
        let descriptor = EnvironmentPassDescriptor {
            label: format!("{reflection:?}"),
            reflection,
            target: LIGHT,
            blend: None,
            depth_stencil: Some(stencil_equals_reference()),
            gbuffer: FORMAT,
        };
        let mut pass = EnvironmentPass::new(device, descriptor)?;
        pass.prepare(device, queue, frame)?;
        Ok(pass)
    }

    /// Draws each pass where the stencil equals `DIFFUSE` plus the pass's index.
    fn draw(&self, stencil: &[u8], passes: &[EnvironmentPass]) -> Result<Vec<[f32; 4]>> {
        let gpu = self.gpu;
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_DST;
        let marks = create_texture(gpu, "materials", self.size, STENCIL, usage);
        upload(gpu, &marks, stencil);
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let light = create_texture(gpu, "light", self.size, LIGHT, usage);
        let [marks, target] = [&marks, &light].map(|t| t.create_view(&Default::default()));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("light"),
            color_attachments: &[Some(cleared_attachment(&target, wgpu::Color::BLACK))],
            // The stencil is only read.
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
        read_back(gpu, encoder, &light)
    }
}

/// Returns a state that draws where the stencil equals the reference and leaves it unchanged.
fn stencil_equals_reference() -> wgpu::DepthStencilState {
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

/// Returns the viewer in homogeneous coordinates: a position relative to `origin` and 1, or a direction
/// and 0.
fn eye(camera: &Camera, origin: [f64; 3]) -> [f32; 4] {
    let eye = match camera.projection {
        Projection::Perspective { .. } => (camera.position - DVec3::from(origin)).extend(1.0),
        Projection::Orthographic { .. } => (-camera.forward).extend(0.0),
    };
    eye.as_vec4().to_array()
}
