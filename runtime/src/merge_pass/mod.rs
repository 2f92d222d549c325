//! The merging raster pass: occluders one after the other, their cones united in a pair of
//! buffers (RR-5779, 5.2.2).

use aogrid_grid_format::Encoding;

use crate::boxes::{self, BoxPipeline, Boxes, DepthTest, Uniforms};
use crate::frame::{Bindings, Frame, Normals, Positions, PrepareError, Reads, Receivers};
use crate::occlusion_pass::PassError;
use crate::{tables, wgsl};

/// What a [`MergePass`] reads and writes. Everything here is compiled into its pipelines.
#[derive(Clone, Debug)]
pub struct MergePassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The buffers' format: `Rgba16Float` or `Rgba32Float`.
    pub format: wgpu::TextureFormat,
    /// What the G-buffer's positions are.
    pub positions: Positions,
    /// How the G-buffer stores normals.
    pub normals: Normals,
    /// What the G-buffer says of whose pixel it is.
    pub receivers: Receivers,
    /// Skips pixels whose receiver lies behind an occluder's box; none: no depth buffer.
    pub depth: Option<DepthTest>,
    /// The winding of faces seen from outside in your right-handed pipelines; `Ccw` unless your
    /// projection mirrors the picture.
    pub front_face: wgpu::FrontFace,
}

/// The merging raster pass, for grids with cones. Make it once, prepare it once a frame, record it
/// into an encoder of yours: it creates no device, submits nothing and waits for nothing.
///
/// No shader can read what it writes, so there are two buffers. Each occluder reads one and writes
/// the other, within its box; what its predecessor wrote there is copied over in the same render
/// pass. That makes one render pass an occluder, and two draws of its box.
///
/// It needs no feature but what an f32 grid does; limits: those of WebGPU's defaults.
#[derive(Debug)]
pub struct MergePass {
    descriptor: MergePassDescriptor,
    merge: wgpu::RenderPipeline,
    copy: wgpu::RenderPipeline,
    bindings: Bindings,
    boxes: Boxes,
    pair_layout: wgpu::BindGroupLayout,
    shared: wgpu::TextureView,
    pair: Option<[Buffer; 2]>,
}

/// One of both, and the bind group that reads it.
#[derive(Debug)]
struct Buffer {
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
}

/// Nothing is hidden: what both buffers begin with.
const OPEN: wgpu::Color = wgpu::Color {
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
    /// A format that cannot hold four signed floats.
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
        let bindings = Bindings::new(device, descriptor.reads(), table);
        let boxes = Boxes::new(device);
        let pair_layout = pair_layout(device);
        let pipeline = |fragment| {
            let [draw, grid] = boxes.layouts();
            let what = BoxPipeline {
                label: &descriptor.label,
                wgsl: wgsl::MERGE_PASS,
                layouts: &[bindings.layout(), draw, grid, &pair_layout],
                fragment,
                constants: &descriptor.reads().constants(),
                target: format.into(),
                depth: descriptor.depth,
                front_face: descriptor.front_face,
            };
            boxes::pipeline(device, &what)
        };
        Ok(Self {
            merge: pipeline("merge"),
            copy: pipeline("copy"),
            shared: tables::intersection_table(device, queue),
            pair: None,
            bindings,
            boxes,
            pair_layout,
            descriptor,
        })
    }

    /// Writes what [`MergePass::record`] will draw: the writes are made with the queue's next
    /// submission. The last call before a submission counts. A frame whose positions are of another
    /// size than the last one's gets buffers of its own.
    ///
    /// # Errors
    ///
    /// A frame that cannot be drawn; the last one that could stays.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame<'_>,
    ) -> Result<(), PrepareError> {
        let checked = self.bindings.check(&frame.view())?;
        let uniforms = Uniforms::new(device, frame, Encoding::Cone)?;
        self.bindings.write(device, queue, checked);
        self.boxes.write(device, queue, frame, &uniforms);
        let size = frame.positions.texture().size();
        if self.result().is_none_or(|old| old.texture().size() != size) {
            self.pair = Some([0, 1].map(|_| self.buffer(device, size)));
        }
        Ok(())
    }

    /// Records all occluders that were prepared, in their order. `depth`: the attachment, only
    /// read, of the depth test, if there is one.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, depth: Option<&wgpu::TextureView>) {
        let (Some(pair), Some(frame)) = (&self.pair, self.bindings.group()) else {
            return;
        };
        let count = self.boxes.len();
        // The last occluder writes the first buffer.
        let written = |idx: usize| (count - 1 - idx) % 2;
        let clear = wgpu::LoadOp::Clear(OPEN);
        self.begin(encoder, &pair[count % 2].view, clear, None);
        for idx in 0..count {
            let load = if idx == 0 { clear } else { wgpu::LoadOp::Load };
            let mut pass = self.begin(encoder, &pair[written(idx)].view, load, depth);
            pass.set_bind_group(0, frame, &[]);
            pass.set_bind_group(3, &pair[1 - written(idx)].group, &[]);
            if idx > 0 {
                pass.set_pipeline(&self.copy);
                self.boxes.draw(&mut pass, idx - 1);
            }
            pass.set_pipeline(&self.merge);
            self.boxes.draw(&mut pass, idx);
        }
    }

    /// What all occluders left, for each pixel: in w the transmittance 1 − AO, in xyz the sum of
    /// all (AO/2) d′, which points to what is occluded. As large as the positions' texture; none
    /// before the first frame. It may be bound, copied, and rendered to.
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

    fn buffer(&self, device: &wgpu::Device, size: wgpu::Extent3d) -> Buffer {
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
        let resources = [&view, &self.shared].map(wgpu::BindingResource::TextureView);
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.descriptor.label),
            layout: &self.pair_layout,
            entries: &entries,
        });
        Buffer { view, group }
    }
}

impl MergePassDescriptor {
    fn reads(&self) -> Reads {
        Reads {
            positions: self.positions,
            normals: Some(self.normals),
            receivers: self.receivers,
        }
    }
}

/// A buffer and T_merge.
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
