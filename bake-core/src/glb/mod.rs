//! GLB files with something added: the file that came in, with what is new spliced in.
//!
//! Nothing is parsed and written anew: what is not edited keeps its bytes, unknown extensions, order of
//! keys and digits included. New bytes follow the old ones in the binary chunk.

mod container;
mod json;
mod splice;

pub(crate) use container::Container;
pub(crate) use json::Edits;
pub(crate) use splice::{Splice, extras};

/// The reason that nothing can be added to a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbError {
    /// The file is no GLB.
    #[error("it is not a GLB: save the model as one GLB, or name a PLY to write")]
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
    /// The file would be larger than a GLB can be.
    #[error("with the values it would be larger than 4 GiB")]
    TooLarge,
}
