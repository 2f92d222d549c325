//! The volume pass: draws a prism around each triangle of an object over a G-buffer, and adds the
//! triangle's occlusion to a target (McGuire 2010).

mod draws;
mod pipeline;
mod resolution;
mod upsample;

use crate::AogridVolume;
use crate::gbuffer::placeholder;
use crate::gbuffer::{GBufferBindings, GBufferError, GBufferFormat, GBufferReads, GBufferViews};
use crate::occluder::InstanceError;
use draws::{ObjectDraws, Uniforms};

pub use resolution::VolumeResolution;
pub use upsample::{UpsamplePass, UpsamplePassDescriptor};

/// The inputs and outputs of a [`VolumePass`]. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct VolumePassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The target's format: blendable, with one or more float channels. Every channel receives the sum.
    /// [`VolumePass::target_format`] returns the best one of a device.
    pub target: wgpu::TextureFormat,
    /// The target's resolution relative to the G-buffer. At less than full, an attachment for a depth
    /// test has the target's size and the depths of its texels.
    pub resolution: VolumeResolution,
    /// The contents of the G-buffer.
    pub gbuffer: GBufferFormat,
    /// The winding of faces seen from outside in your right-handed pipelines; `Ccw` unless your
    /// projection mirrors the image.
    pub front_face: wgpu::FrontFace,
}

/// The G-buffer and objects of one frame.
#[derive(Clone, Copy, Debug)]
pub struct VolumeFrame<'a> {
    /// The camera and the G-buffer's textures.
    pub gbuffer: GBufferViews<'a>,
    /// All objects, including those off screen. The order must be the same in each frame for
    /// bit-identical results.
    pub objects: &'a [VolumeObject<'a>],
}

/// An object: its triangles in buffers of your own, which a skinning pass may rewrite each frame.
#[derive(Clone, Copy, Debug)]
pub struct VolumeObject<'a> {
    /// The vertices: `stride` floats each, the first three of which are the position in object space. It
    /// needs the usage `STORAGE`.
    pub positions: &'a wgpu::Buffer,
    /// The number of floats from one vertex to the next, at least 3.
    pub stride: u32,
    /// The triangles: three 32-bit vertex indices each, counter-clockwise as seen from the front. It
    /// needs the usage `STORAGE`. Triangles without area, with a position that is not finite, or with an
    /// index beyond the vertices draw nothing.
    pub indices: &'a wgpu::Buffer,
    /// The number of triangles.
    pub triangles: u32,
    /// The map from object space to world space, in columns.
    pub world_from_object: [[f32; 4]; 4],
    /// The extent, in world units, and the weight of the volumes.
    pub volume: AogridVolume,
    /// The strength of the occlusion, 0..=1.
    pub strength: f32,
    /// A mask: the object shades receivers that share a bit with it.
    pub layers: u32,
    /// The ids of receivers that it does not shade; [`AOGRID_NO_OBJECT`](crate::AOGRID_NO_OBJECT) in
    /// unused slots. It shades itself unless its own id is among them.
    pub excluded: [u32; 4],
}

/// The reasons why a pass cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumePassError {
    /// The target's format cannot add on this device.
    #[error(
        "{0:?} cannot be the target: it must be a float format that blends on this device \
         (VolumePass::target_format returns one)"
    )]
    Target(wgpu::TextureFormat),
    /// The device allows fewer storage buffers than the pass binds.
    #[error("the device allows {0} storage buffers a shader stage, and the volume pass needs 2")]
    StorageBuffers(u32),
}

/// The reasons why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeFrameError {
    /// The pass cannot read the G-buffer.
    #[error(transparent)]
    GBuffer(#[from] GBufferError),
    /// An object's transform or strength is invalid.
    #[error("object {object}: {source}")]
    Object {
        /// Its index in the frame's objects.
        object: usize,
        /// The reason.
        source: InstanceError,
    },
    /// An object's vertices overlap.
    #[error("object {object}: its stride of {stride} floats is less than the 3 of a position")]
    Stride {
        /// Its index in the frame's objects.
        object: usize,
        /// The stride.
        stride: u32,
    },
    /// An object's indices are fewer than its triangles need.
    #[error("object {object}: its {triangles} triangles need more indices than its buffer holds")]
    Indices {
        /// Its index in the frame's objects.
        object: usize,
        /// The number of triangles.
        triangles: u32,
    },
    /// There are more objects than a buffer of the device can hold.
    #[error("{0} objects are more than a buffer of the device can hold")]
    TooMany(usize),
}

/// The volume pass. Create it once, prepare it once a frame, draw it in your own render pass: it creates
/// no device, submits nothing and never waits.
///
/// Clear the target to 0. Afterwards it holds the sum of all occlusion, and 1 − min(1, sum) is what
/// multiplies ambient light. The pass costs the overdraw of the prisms: keep their extent small.
#[derive(Debug)]
pub struct VolumePass {
    pipeline: wgpu::RenderPipeline,
    bindings: GBufferBindings,
    draws: ObjectDraws,
    resolution: VolumeResolution,
}

impl VolumePass {
    /// Compiles the pipeline.
    ///
    /// # Errors
    ///
    /// The device cannot add to the target's format, or allows too few storage buffers.
    pub fn new(
        device: &wgpu::Device,
        descriptor: &VolumePassDescriptor,
    ) -> Result<Self, VolumePassError> {
        pipeline::check(device, descriptor.target)?;
        let reads = GBufferReads {
            format: descriptor.gbuffer,
            normals: true,
        };
        let no_table = placeholder(device, wgpu::TextureFormat::Rgba8Unorm);
        let bindings = GBufferBindings::new(device, reads, no_table);
        let draws = ObjectDraws::new(device);
        Ok(Self {
            pipeline: pipeline::new(device, &bindings, &draws, descriptor, &reads),
            bindings,
            draws,
            resolution: descriptor.resolution,
        })
    }

    /// Returns the best format for the target: 32-bit floats where the device can add to them (feature
    /// `FLOAT32_BLENDABLE`), 16-bit floats elsewhere. In the latter, a surface cut into thousands of
    /// triangles is too light, by .05 of AO for 4,096, since each adds less than a rounding step.
    pub fn target_format(device: &wgpu::Device) -> wgpu::TextureFormat {
        let can_add = device
            .features()
            .contains(wgpu::Features::FLOAT32_BLENDABLE);
        match can_add {
            true => wgpu::TextureFormat::R32Float,
            false => wgpu::TextureFormat::R16Float,
        }
    }

    /// Writes the frame that [`VolumePass::draw`] will draw. The writes take effect with the queue's
    /// next submission; the last call before a submission counts.
    ///
    /// # Errors
    ///
    /// The frame cannot be drawn; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &VolumeFrame<'_>,
    ) -> Result<(), VolumeFrameError> {
        let validated = self.bindings.check(&frame.gbuffer)?;
        let uniforms = Uniforms::new(device, frame, self.resolution)?;
        self.bindings.write(device, queue, validated);
        self.draws.write(device, queue, frame, &uniforms);
        Ok(())
    }

    /// Draws all prepared objects. The render pass has the target as its only color attachment and, if
    /// there is a depth test, a read-only depth attachment.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(frame) = self.bindings.group() else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame, &[]);
        self.draws.draw_all(pass);
    }
}
