//! The environment pass: what occluders leave of the light from an environment, over a G-buffer
//! (RR-5779, 5.3).

mod pipeline;

use bytemuck::{Pod, Zeroable};

use crate::occluder::world_from_clip;
use crate::{AogridEnvironment, EnvironmentTexture, Normals, Positions};

/// What an [`EnvironmentPass`] reads and writes. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct EnvironmentPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// How surfaces reflect.
    pub reflection: Reflection,
    /// The target's format: one that holds radiance.
    pub target: wgpu::TextureFormat,
    /// How the light, with 1 in alpha, meets what the target holds; none: it replaces it.
    pub blend: Option<wgpu::BlendState>,
    /// A depth and stencil test, for example against a stencil that marks some materials; none:
    /// no such attachment. The triangle has depth 0.
    pub depth_stencil: Option<wgpu::DepthStencilState>,
    /// What the G-buffer's positions are. Diffuse surfaces do not read them.
    pub positions: Positions,
    /// How the G-buffer stores normals.
    pub normals: Normals,
}

/// How surfaces reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflection {
    /// Diffusely: from the whole hemisphere.
    Lambertian,
    /// From a cone around the mirrored direction.
    Glossy,
}

/// One frame's view of the scene and its environment.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentFrame<'a> {
    /// View and projection, in columns; read where positions are depths.
    pub clip_from_world: [[f32; 4]; 4],
    /// Where the viewer is, and 1; or, of an orthographic camera, a direction towards the viewer, and
    /// 0. Read where surfaces are glossy.
    pub eye: [f32; 4],
    /// Half-angle of the glossy lobe's cone, in radians, above 0 and up to π/2. Below 5.1 degrees
    /// the lobe is as blurred as at 5.1.
    pub lobe_half_angle: f32,
    /// How the scene stands in its environment.
    pub environment: AogridEnvironment,
    /// The environment.
    pub map: &'a EnvironmentTexture,
    /// What an [`OcclusionPass`](crate::OcclusionPass) with
    /// [`Output::TransmittanceAndAxis`](crate::Output::TransmittanceAndAxis) left: in xyz the sum of
    /// all (AO/2) d′, in w 1 − AO. What merges cones leaves the same.
    pub occlusion: &'a wgpu::TextureView,
    /// See [`Normals`].
    pub normals: &'a wgpu::TextureView,
    /// See [`Positions`]; none for [`Reflection::Lambertian`].
    pub positions: Option<&'a wgpu::TextureView>,
}

/// Why a pass cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentPassError {
    /// The target cannot hold or blend what is written.
    #[error(
        "{format:?} cannot be the target: it must take floats as a render attachment{need} on this device"
    )]
    Target {
        /// The target's format.
        format: wgpu::TextureFormat,
        /// What else it must do.
        need: &'static str,
    },
}

/// Why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentFrameError {
    /// The camera's matrix has no inverse.
    #[error("clip_from_world cannot be inverted")]
    Camera,
    /// Not the half-angle of a lobe.
    #[error("a lobe's half-angle of {0} is not above 0 and up to π/2")]
    Lobe(f32),
    /// A texture that the pass was made to read.
    #[error("the pass was made to read {0}, which the frame does not bring")]
    Missing(&'static str),
}

/// The pass. Make it once, prepare it once a frame, draw it in a render pass of yours: it
/// creates no device, submits nothing and waits for nothing. No feature, limits of WebGPU's defaults.
///
/// It writes every pixel that its tests let through, whatever the pixel shows: where that is no
/// surface, draw the sky afterwards or mask with a stencil.
#[derive(Debug)]
pub struct EnvironmentPass {
    descriptor: EnvironmentPassDescriptor,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    frame_buffer: wgpu::Buffer,
    /// Stands in for positions that the descriptor leaves out.
    no_positions: wgpu::TextureView,
    group: Option<(Bound, wgpu::BindGroup)>,
}

/// What the bind group was made from.
#[derive(Debug, PartialEq)]
struct Bound {
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
    /// A target that the device cannot write or blend so.
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
            no_positions: pipeline::no_positions(device),
            group: None,
            layout,
            descriptor,
        })
    }

    /// Writes what [`EnvironmentPass::draw`] will read: the writes are made with the queue's next
    /// submission. The last call before a submission counts.
    ///
    /// # Errors
    ///
    /// A frame that cannot be drawn; the last one that could stays.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &EnvironmentFrame<'_>,
    ) -> Result<(), EnvironmentFrameError> {
        let bound = self.bound(frame)?;
        let uniforms = self.uniforms(frame)?;
        queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniforms));
        if self.group.as_ref().is_none_or(|(old, _)| *old != bound) {
            let group = self.bind(device, &bound);
            self.group = Some((bound, group));
        }
        Ok(())
    }

    /// Draws over the whole target, the only colour attachment of the render pass.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some((_, group)) = &self.group else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn bound(&self, frame: &EnvironmentFrame<'_>) -> Result<Bound, EnvironmentFrameError> {
        let positions = match (self.descriptor.reflection, frame.positions) {
            (Reflection::Lambertian, _) => &self.no_positions,
            (Reflection::Glossy, Some(view)) => view,
            (Reflection::Glossy, None) => {
                return Err(EnvironmentFrameError::Missing("positions"));
            }
        };
        let views = [positions, frame.normals, frame.occlusion, frame.map.view()];
        Ok(Bound {
            views: views.map(Clone::clone),
            sampler: frame.map.sampler().clone(),
        })
    }

    fn uniforms(&self, frame: &EnvironmentFrame<'_>) -> Result<Uniforms, EnvironmentFrameError> {
        let is_glossy = self.descriptor.reflection == Reflection::Glossy;
        let from_depth = is_glossy && self.descriptor.positions == Positions::Depth;
        let half_angle = frame.lobe_half_angle;
        if is_glossy && !(half_angle > 0.0 && half_angle <= std::f32::consts::FRAC_PI_2) {
            return Err(EnvironmentFrameError::Lobe(half_angle));
        }
        let world_from_clip = match from_depth {
            true => {
                world_from_clip(frame.clip_from_world).map_err(|_| EnvironmentFrameError::Camera)?
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

    fn bind(&self, device: &wgpu::Device, bound: &Bound) -> wgpu::BindGroup {
        let [positions, normals, occlusion, map] = bound
            .views
            .each_ref()
            .map(wgpu::BindingResource::TextureView);
        let resources = [
            self.frame_buffer.as_entire_binding(),
            positions,
            normals,
            occlusion,
            map,
            wgpu::BindingResource::Sampler(&bound.sampler),
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
