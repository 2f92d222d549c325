//! Errors of scenes and of the files that they name.

use std::error::Error;
use std::fmt::{self, Display, Formatter};

/// An error about a scene: one line that names the file, for errors in the scene file its line and
/// key, and the remedy. Its source is the cause, which the message does not repeat.
#[derive(Debug)]
pub struct SceneError(Repr);

type Cause = Box<dyn Error + Send + Sync>;

#[derive(Debug)]
enum Repr {
    Message(String, Option<Cause>),
    /// Another error speaks for itself.
    Cause(Cause),
}

/// The result of what reads or makes scenes.
pub type Result<T> = std::result::Result<T, SceneError>;

impl SceneError {
    pub(crate) fn new(message: impl Display) -> Self {
        Self(Repr::Message(message.to_string(), None))
    }
}

impl Display for SceneError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Repr::Message(message, _) => f.write_str(message),
            Repr::Cause(cause) => cause.fmt(f),
        }
    }
}

impl Error for SceneError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match &self.0 {
            Repr::Message(_, cause) => cause.as_ref().map(|cause| &**cause as _),
            Repr::Cause(cause) => cause.source(),
        }
    }
}

/// Lets `?` pass errors on whose messages need no more.
macro_rules! passed_on {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for SceneError {
            fn from(error: $error) -> Self {
                Self(Repr::Cause(error.into()))
            }
        })+
    };
}

passed_on!(
    std::io::Error,
    exr::error::Error,
    image::ImageError,
    aogrid_bake_core::PipelineError,
    aogrid_bake_core::PlacementError,
    aogrid_bake_core::mesh::GltfError,
    aogrid_bake_core::mesh::LoadError,
    aogrid_bake_core::mesh::MeshError,
    aogrid_baker_cpu::BakeError,
    crate::reference::EnvironmentError,
    crate::reference::AreaLightError,
    aogrid_runtime::EnvironmentFrameError,
    aogrid_runtime::EnvironmentPassError,
    aogrid_runtime::GridTextureError,
    aogrid_runtime::InstanceError,
    aogrid_runtime::PassError,
    aogrid_runtime::PrepareError,
    aogrid_runtime::VolumeFrameError,
    aogrid_runtime::VolumePassError,
    aogrid_runtime::wgpu::MapRangeError,
    aogrid_runtime::wgpu::PollError,
);

/// Says what failed, in front of the cause.
pub(crate) trait Context<T> {
    fn context(self, message: impl Display) -> Result<T>;

    fn with_context<D: Display>(self, message: impl FnOnce() -> D) -> Result<T>;
}

impl<T, E: Into<Cause>> Context<T> for std::result::Result<T, E> {
    fn context(self, message: impl Display) -> Result<T> {
        self.with_context(|| message)
    }

    fn with_context<D: Display>(self, message: impl FnOnce() -> D) -> Result<T> {
        self.map_err(|cause| SceneError(Repr::Message(message().to_string(), Some(cause.into()))))
    }
}

/// Returns an error with a formatted message.
macro_rules! bail {
    ($($message:tt)*) => {
        return Err($crate::error::SceneError::new(format!($($message)*)))
    };
}

/// Returns an error with a formatted message unless a condition holds.
macro_rules! ensure {
    ($condition:expr, $($message:tt)*) => {
        if !$condition {
            $crate::error::bail!($($message)*);
        }
    };
}

pub(crate) use {bail, ensure};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_follow_what_failed() {
        let cause: std::result::Result<(), _> = Err(SceneError::new("the cause"));
        let error = cause.context("what failed").unwrap_err();
        assert_eq!(error.to_string(), "what failed");
        assert_eq!(error.source().unwrap().to_string(), "the cause");
    }
}
