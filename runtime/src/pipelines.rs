//! Pipelines that depend on the encoding of the grids that they read.

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
