//! Pipelines that depend on the encoding of the grids that they read, and what targets allow.

use aogrid_grid_format::Encoding;

/// Pipelines for grids of each encoding, compiled when first needed.
#[derive(Debug)]
pub(crate) struct PipelinesByEncoding<P>(Vec<(Encoding, P)>);

impl<P> PipelinesByEncoding<P> {
    pub(crate) fn new() -> Self {
        Self(Vec::new())
    }

    /// The pipeline for grids of an encoding; none if it is not compiled.
    pub(crate) fn get(&self, encoding: Encoding) -> Option<&P> {
        let found = self.0.iter().find(|(known, _)| *known == encoding);
        found.map(|(_, pipeline)| pipeline)
    }

    /// Compiles the pipeline for grids of an encoding, unless it is there.
    pub(crate) fn require(&mut self, encoding: Encoding, compile: impl FnOnce() -> P) {
        if self.get(encoding).is_none() {
            self.0.push((encoding, compile()));
        }
    }
}

/// Whether a pass of the device can draw to textures of a format with blending.
pub(crate) fn can_blend(device: &wgpu::Device, format: wgpu::TextureFormat) -> bool {
    let allowed = format.guaranteed_format_features(device.features());
    let blends = allowed
        .flags
        .contains(wgpu::TextureFormatFeatureFlags::BLENDABLE);
    let renders = allowed
        .allowed_usages
        .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
    blends && renders
}
