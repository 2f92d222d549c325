//! The G-buffer: the one description of it that all passes share, and the bind group with which
//! their shaders read it.

mod bindings;

pub(crate) use bindings::{GBufferBindings, GBufferReads};

/// The contents of the G-buffer's position texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// World positions in xyz of a float texture.
    World,
    /// Values of a depth buffer, as bound for reading, or in x of a float texture. Any projection
    /// is allowed, reversed or not, with wgpu's depth range 0..1 over the whole target.
    Depth,
}

/// The encoding of the G-buffer's normals, which have unit length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// The normal n itself.
    Signed,
    /// The value (n + 1)/2, as in unorm formats.
    Unsigned,
}

/// The information in the G-buffer about the object that a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receivers {
    /// No information: every occluder shades every pixel, and none recognizes its own pixels.
    None,
    /// The object's id in x of an unsigned integer texture.
    Ids,
    /// The object's id in x and its layers, a mask, in y.
    IdsAndLayers,
}

/// The depth test against the back faces of the boxes. It only saves work: the image is the same
/// with and without it. The attachment is read-only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthTest {
    /// The depth attachment's format.
    pub format: wgpu::TextureFormat,
    /// The comparison that passes back faces behind the stored depth: `GreaterEqual` if depth grows
    /// away from the viewer, `LessEqual` if it is reversed.
    pub compare: wgpu::CompareFunction,
}

/// The contents of a renderer's G-buffer. Passes compile it into their pipelines; one description
/// serves all of them, and each reads the part that it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GBufferFormat {
    /// The contents of the position texture.
    pub positions: Positions,
    /// The encoding of the normals.
    pub normals: Normals,
    /// The information about the object that a pixel shows.
    pub receivers: Receivers,
    /// The depth test with which the raster passes skip pixels whose receiver lies behind an
    /// occluder's box; none if there is no depth buffer. The other passes ignore it.
    pub depth: Option<DepthTest>,
}

/// The camera and the G-buffer's textures in one frame.
#[derive(Clone, Copy, Debug)]
pub struct GBufferViews<'a> {
    /// The view and projection matrix, in columns: perspective or orthographic, depth 0..1.
    pub clip_from_world: [[f32; 4]; 4],
    /// See [`Positions`].
    pub positions: &'a wgpu::TextureView,
    /// See [`Normals`]; none for [`Mode::Occlusion`](crate::Mode::Occlusion).
    pub normals: Option<&'a wgpu::TextureView>,
    /// See [`Receivers`]; none for [`Receivers::None`].
    pub receivers: Option<&'a wgpu::TextureView>,
}

/// The reasons why a pass cannot read a frame's G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GBufferError {
    /// The camera's matrix has no inverse.
    #[error("clip_from_world cannot be inverted")]
    Camera,
    /// A texture that the pass reads is missing from the frame.
    #[error("the pass was created to read {0}, which are missing from the frame")]
    Missing(&'static str),
}

impl GBufferFormat {
    /// The `override`s with which every pass decodes positions and normals.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 3] {
        let [scale, offset] = match self.normals {
            Normals::Signed => [1.0, 0.0],
            Normals::Unsigned => [2.0, -1.0],
        };
        let are_depths = self.positions == Positions::Depth;
        [
            ("positions_are_depths", f64::from(u8::from(are_depths))),
            ("normal_scale", scale),
            ("normal_offset", offset),
        ]
    }
}

/// A texture of one texel, for a binding that no shader reads.
pub(crate) fn placeholder(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("aogrid placeholder"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("aogrid placeholder"),
        ..Default::default()
    })
}
