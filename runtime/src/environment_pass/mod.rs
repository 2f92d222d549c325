//! The environment pass: environment light less the part that occluders block, over a G-buffer
//! (RR-5779, 5.3).

mod pipeline;

use bytemuck::{Pod, Zeroable};

use crate::gbuffer::{GBufferError, GBufferFormat, GBufferViews, Positions, placeholder};
use crate::occluder::world_from_clip;
use crate::{AogridEnvironment, EnvironmentTexture};

/// The inputs and outputs of an [`EnvironmentPass`]. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct EnvironmentPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The reflection model of the surfaces.
    pub reflection: Reflection,
    /// The target's format, which must hold radiance.
    pub target: wgpu::TextureFormat,
    /// The blending of the light, whose alpha is 1, with the target; none to replace the target.
    pub blend: Option<wgpu::BlendState>,
    /// A depth and stencil test, for example against a stencil that marks some materials; none if
    /// there is no such attachment. The triangle has depth 0.
    pub depth_stencil: Option<wgpu::DepthStencilState>,
    /// The contents of the G-buffer, of which the pass reads normals and, for glossy surfaces,
    /// positions.
    pub gbuffer: GBufferFormat,
}

/// The reflection model of the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflection {
    /// Diffuse reflection of the whole hemisphere.
    Lambertian,
    /// Glossy reflection of a cone around the mirror direction.
    Glossy,
}

/// The G-buffer, viewer and environment of one frame.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentFrame<'a> {
    /// The camera, which is read if positions are depths, and the G-buffer's textures.
    pub gbuffer: GBufferViews<'a>,
    /// The viewer's position and 1, or for an orthographic camera a direction towards the viewer
    /// and 0. Read if surfaces are glossy.
    pub eye: [f32; 4],
    /// The half-angle of the glossy lobe's cone, in radians, above 0 and up to π/2. Below 5.1
    /// degrees the lobe is as blurred as at 5.1.
    pub lobe_half_angle: f32,
    /// The orientation and scale of the environment.
    pub environment: AogridEnvironment,
    /// The prefiltered environment.
    pub map: &'a EnvironmentTexture,
    /// The output of an [`OcclusionPass`](crate::OcclusionPass) with
    /// [`Output::TransmittanceAndAxis`](crate::Output::TransmittanceAndAxis), or of a merging pass:
    /// the sum of all (AO/2) d′ in xyz, 1 − AO in w.
    pub occlusion: &'a wgpu::TextureView,
}

/// The reasons why a pass cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentPassError {
    /// The target's format cannot hold or blend the output.
    #[error(
        "{format:?} cannot be the target: it must take floats as a render attachment{need} on this device"
    )]
    Target {
        /// The target's format.
        format: wgpu::TextureFormat,
        /// The missing capability.
        need: &'static str,
    },
}

/// The reasons why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentFrameError {
    /// The pass cannot read the G-buffer.
    #[error(transparent)]
    GBuffer(#[from] GBufferError),
    /// The half-angle of the lobe is outside its range.
    #[error("the lobe's half-angle of {0} is not above 0 and at most π/2")]
    Lobe(f32),
}

/// The environment pass. Create it once, prepare it once a frame, draw it in your own render pass:
/// it creates no device, submits nothing and never waits. It needs no features, and WebGPU's
/// default limits suffice.
///
/// It writes every pixel that passes its tests, whatever the pixel shows: for pixels without a
/// surface, draw the sky afterwards or mask with a stencil.
#[derive(Debug)]
pub struct EnvironmentPass {
    descriptor: EnvironmentPassDescriptor,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    frame_buffer: wgpu::Buffer,
    /// A placeholder for positions that the pass does not read.
    positions_placeholder: wgpu::TextureView,
    group: Option<(BoundResources, wgpu::BindGroup)>,
}

/// The resources of a bind group.
#[derive(Debug, PartialEq)]
struct BoundResources {
    views: [wgpu::TextureView; 4],
    sampler: wgpu::Sampler,
}

/// The uniforms of one frame: `Frame` in the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Uniforms {
    world_from_clip: [[f32; 4]; 4],
    environment: AogridEnvironment,
    eye: [f32; 4],
    lobe: [f32; 4],
}

impl EnvironmentPass {
    /// Compiles the pipeline.
    ///
    /// # Errors
    ///
    /// If the device cannot write or blend the target.
    pub fn new(
        device: &wgpu::Device,
        descriptor: EnvironmentPassDescriptor,
    ) -> Result<Self, EnvironmentPassError> {
        pipeline::check(device, &descriptor)?;
        let layout = pipeline::layout(device);
        Ok(Self {
            pipeline: pipeline::new(device, &layout, &descriptor),
            frame_buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("aogrid environment frame"),
                size: size_of::<Uniforms>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            positions_placeholder: placeholder(device, wgpu::TextureFormat::Rgba8Unorm),
            group: None,
            layout,
            descriptor,
        })
    }

    /// Writes the frame that [`EnvironmentPass::draw`] will read. The writes take effect with the
    /// queue's next submission; the last call before a submission counts.
    ///
    /// # Errors
    ///
    /// If the frame cannot be drawn; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &EnvironmentFrame<'_>,
    ) -> Result<(), EnvironmentFrameError> {
        let resources = self.resources(frame)?;
        let uniforms = self.uniforms(frame)?;
        queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniforms));
        if self
            .group
            .as_ref()
            .is_none_or(|(previous, _)| *previous != resources)
        {
            let group = self.bind(device, &resources);
            self.group = Some((resources, group));
        }
        Ok(())
    }

    /// Draws over the whole target, the only color attachment of the render pass.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some((_, group)) = &self.group else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn resources(
        &self,
        frame: &EnvironmentFrame<'_>,
    ) -> Result<BoundResources, EnvironmentFrameError> {
        let positions = match self.descriptor.reflection {
            Reflection::Lambertian => &self.positions_placeholder,
            Reflection::Glossy => frame.gbuffer.positions,
        };
        let normals = frame.gbuffer.normals;
        let normals = normals.ok_or(GBufferError::Missing("normals"))?;
        let views = [positions, normals, frame.occlusion, frame.map.view()];
        Ok(BoundResources {
            views: views.map(Clone::clone),
            sampler: frame.map.sampler().clone(),
        })
    }

    fn uniforms(&self, frame: &EnvironmentFrame<'_>) -> Result<Uniforms, EnvironmentFrameError> {
        let is_glossy = self.descriptor.reflection == Reflection::Glossy;
        let from_depth = is_glossy && self.descriptor.gbuffer.positions == Positions::Depth;
        let half_angle = frame.lobe_half_angle;
        if is_glossy && !(half_angle > 0.0 && half_angle <= std::f32::consts::FRAC_PI_2) {
            return Err(EnvironmentFrameError::Lobe(half_angle));
        }
        let world_from_clip = match from_depth {
            true => {
                world_from_clip(frame.gbuffer.clip_from_world).map_err(|_| GBufferError::Camera)?
            }
            false => [[0.0; 4]; 4],
        };
        Ok(Uniforms {
            world_from_clip,
            environment: frame.environment,
            eye: frame.eye,
            lobe: [0.5 * (1.0 - half_angle.cos()), 0.0, 0.0, 0.0],
        })
    }

    fn bind(&self, device: &wgpu::Device, resources: &BoundResources) -> wgpu::BindGroup {
        let [positions, normals, occlusion, map] = resources
            .views
            .each_ref()
            .map(wgpu::BindingResource::TextureView);
        let resources = [
            self.frame_buffer.as_entire_binding(),
            positions,
            normals,
            occlusion,
            map,
            wgpu::BindingResource::Sampler(&resources.sampler),
        ];
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("aogrid environment"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}
