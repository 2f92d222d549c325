//! GLB files with something added: the file that came in, with what is new spliced in.
//!
//! Nothing is parsed and written anew: what is not edited keeps its bytes, unknown extensions, order of
//! keys and digits included. New bytes follow the old ones in the binary chunk.

mod container;
mod json;
mod nodes;
mod occluders;
mod splice;
#[cfg(test)]
mod tests;

pub(crate) use container::Container;
pub(crate) use json::{Edits, Text};
pub use nodes::{Nodes, PosedNode};
pub use occluders::{AttachedGrid, EXTENSION, Occluder, attach, attached};
pub(crate) use splice::{Splice, extras};

/// The reason that nothing can be added to a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbError {
    /// The file is no GLB.
    #[error("it is not a GLB: save the model as one GLB")]
    NotGlb,
    /// The container is malformed.
    #[error("its GLB container is broken")]
    Broken,
    /// The JSON is malformed.
    #[error("its JSON is malformed: {0}")]
    Json(String),
    /// The first buffer is another file or is written in the JSON.
    #[error("its first buffer is not in the GLB itself: save the model as one GLB")]
    NoBinary,
    /// The JSON lacks what the values are for.
    #[error("its JSON has no {0}: was the file changed meanwhile?")]
    Missing(&'static str),
    /// A node cannot pose a grid.
    #[error("node {0} scales an axis to nothing: no grid can be posed by it")]
    Flat(usize),
    /// A node has a grid already.
    #[error("node {0} has a grid already: attach to the model as it was before")]
    Attached(usize),
    /// Two grids are for one node.
    #[error("two grids are for node {0}: leave one out")]
    TwoGrids(usize),
    /// The extension of a node does not name a part of the binary chunk.
    #[error("the grid of node {0} is not in the file's binary chunk: the file is broken")]
    NoGrid(usize),
    /// The file would be larger than a GLB can be.
    #[error("with the values it would be larger than 4 GiB")]
    TooLarge,
}
