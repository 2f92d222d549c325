//! The merging raster pass: merges the cones of the occluders one after the other, in a pair of
//! buffers (RR-5779, 5.2.2).

use crate::boxes::{self, BoxPipelineDescriptor, OccluderDraws, ProxyShape, Uniforms};
use crate::frame::{Frame, PrepareError};
use crate::gbuffer::{GBufferBindings, GBufferFormat, GBufferReads};
use crate::occlusion_pass::PassError;
use crate::{tables, wgsl};

/// The inputs and outputs of a [`MergePass`]. Everything here is compiled into its pipelines.
#[derive(Clone, Debug)]
pub struct MergePassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The buffers' format: `Rgba16Float` or `Rgba32Float`.
    pub format: wgpu::TextureFormat,
    /// Whether the mean of merging and multiplying is taken, see
    /// [`Combine::Mean`](crate::Combine::Mean).
    pub mean: bool,
    /// The contents of the G-buffer.
    pub gbuffer: GBufferFormat,
    /// The winding of faces seen from outside in your right-handed pipelines; `Ccw` unless your
    /// projection mirrors the image.
    pub front_face: wgpu::FrontFace,
}

/// The merging raster pass, for grids with cones. Create it once, prepare it once a frame, record
/// it into your own encoder: it creates no device, submits nothing and never waits.
///
/// A shader cannot read its own render target, so there are two buffers. Each occluder reads one
/// and writes the other, within its box; the output of its predecessor is copied over in the same
/// render pass. The cost is one render pass and two draws of a box per occluder.
///
/// It needs no features beyond those of an f32 grid; WebGPU's default limits suffice.
#[derive(Debug)]
pub struct MergePass {
    descriptor: MergePassDescriptor,
    merge: wgpu::RenderPipeline,
    copy: wgpu::RenderPipeline,
    bindings: GBufferBindings,
    draws: OccluderDraws,
    pair_layout: wgpu::BindGroupLayout,
    overlap_table: wgpu::TextureView,
    pair: Option<[PairBuffer; 2]>,
}

/// One buffer of the pair, and the bind group that reads it.
#[derive(Debug)]
struct PairBuffer {
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
}

/// The initial value of both buffers: no occlusion.
const UNOCCLUDED: wgpu::Color = wgpu::Color {
    r: 0.0,
    g: 0.0,
    b: 0.0,
    a: 1.0,
};

impl MergePass {
    /// Compiles the pipelines and uploads the tables.
    ///
    /// # Errors
    ///
    /// If the format cannot hold four signed floats.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: MergePassDescriptor,
    ) -> Result<Self, PassError> {
        use wgpu::TextureFormat::{Rgba16Float, Rgba32Float};
        let format = descriptor.format;
        if ![Rgba16Float, Rgba32Float].contains(&format) {
            let need = " hold four signed floats";
            return Err(PassError::Target { format, need });
        }
        let table = tables::clip_table(device, queue);
        let bindings = GBufferBindings::new(device, descriptor.reads(), table);
        let draws = OccluderDraws::new(device);
        let pair_layout = pair_layout(device);
        let pipeline = |fragment| {
            let [draw, grid] = draws.layouts();
            let box_pipeline = BoxPipelineDescriptor {
                label: &descriptor.label,
                wgsl: wgsl::MERGE_PASS,
                layouts: &[bindings.layout(), draw, grid, &pair_layout],
                shape: ProxyShape::Box,
                fragment,
                constants: &descriptor.constants(),
                target: format.into(),
                depth: descriptor.gbuffer.depth,
                front_face: descriptor.front_face,
            };
            boxes::pipeline(device, &box_pipeline)
        };
        Ok(Self {
            merge: pipeline("merge"),
            copy: pipeline("copy"),
            overlap_table: tables::intersection_table(device, queue),
            pair: None,
            bindings,
            draws,
            pair_layout,
            descriptor,
        })
    }

    /// Writes the frame that [`MergePass::record`] will draw. The writes take effect with the
    /// queue's next submission; the last call before a submission counts. The buffers are recreated
    /// when the size of the positions changes.
    ///
    /// # Errors
    ///
    /// If the frame cannot be drawn; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame<'_>,
    ) -> Result<(), PrepareError> {
        let validated = self.bindings.check(&frame.gbuffer)?;
        frame.require_cones()?;
        let uniforms = Uniforms::new(device, frame)?;
        self.bindings.write(device, queue, validated);
        self.draws.write(device, queue, frame, &uniforms);
        let size = frame.gbuffer.positions.texture().size();
        if self
            .result()
            .is_none_or(|previous| previous.texture().size() != size)
        {
            self.pair = Some([0, 1].map(|_| self.buffer(device, size)));
        }
        Ok(())
    }

    /// Records all prepared occluders, in their order. `depth` is the read-only attachment of the
    /// depth test, if there is one.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, depth: Option<&wgpu::TextureView>) {
        let (Some(pair), Some(frame)) = (&self.pair, self.bindings.group()) else {
            return;
        };
        let count = self.draws.len();
        // Alternates so that the last occluder writes the first buffer, the result.
        let target_idx = |idx: usize| (count - 1 - idx) % 2;
        let clear = wgpu::LoadOp::Clear(UNOCCLUDED);
        // The first occluder reads this buffer; its own render pass clears the one it writes.
        self.begin(encoder, &pair[count % 2].view, clear, None);
        for idx in 0..count {
            let load = if idx == 0 { clear } else { wgpu::LoadOp::Load };
            let mut pass = self.begin(encoder, &pair[target_idx(idx)].view, load, depth);
            pass.set_bind_group(0, frame, &[]);
            pass.set_bind_group(3, &pair[1 - target_idx(idx)].group, &[]);
            // The other buffer misses the previous occluder only within that occluder's box.
            if idx > 0 {
                pass.set_pipeline(&self.copy);
                self.draws.draw(&mut pass, idx - 1);
            }
            pass.set_pipeline(&self.merge);
            self.draws.draw(&mut pass, idx);
        }
    }

    /// The accumulated occluders of each pixel: the transmittance 1 − AO in w, the sum of all
    /// (AO/2) d′, which points towards the occluded directions, in xyz. It has the size of the
    /// position texture; none before the first frame. It may be bound, copied, and rendered to.
    pub fn result(&self) -> Option<&wgpu::TextureView> {
        self.pair.as_ref().map(|[first, _]| &first.view)
    }

    fn begin<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        load: wgpu::LoadOp<wgpu::Color>,
        depth: Option<&wgpu::TextureView>,
    ) -> wgpu::RenderPass<'a> {
        let attachment = wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(&self.descriptor.label),
            color_attachments: &[Some(attachment)],
            // Read only: no operations.
            depth_stencil_attachment: depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }

    fn buffer(&self, device: &wgpu::Device, size: wgpu::Extent3d) -> PairBuffer {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(&self.descriptor.label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.descriptor.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let resources = [&view, &self.overlap_table].map(wgpu::BindingResource::TextureView);
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.descriptor.label),
            layout: &self.pair_layout,
            entries: &entries,
        });
        PairBuffer { view, group }
    }
}

impl MergePassDescriptor {
    /// The values of the `override`s of the WGSL.
    fn constants(&self) -> Vec<(&'static str, f64)> {
        let own = [("takes_mean", f64::from(u8::from(self.mean)))];
        [&self.reads().constants()[..], &own].concat()
    }

    fn reads(&self) -> GBufferReads {
        GBufferReads {
            format: self.gbuffer,
            normals: true,
        }
    }
}

/// The layout of one buffer of the pair and the overlap table of T_merge.
fn pair_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, filterable, view_dimension| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable },
            view_dimension,
            multisampled: false,
        },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid merge"),
        entries: &[
            entry(0, false, wgpu::TextureViewDimension::D2),
            entry(1, true, wgpu::TextureViewDimension::D3),
        ],
    })
}
