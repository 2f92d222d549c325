//! Errors about scene files with file, line and key.

use std::ops::Range;
use std::path::Path;

use crate::error::SceneError;
use serde::de::DeserializeOwned;
use toml::Spanned;

/// The text of a scene file, to find the lines of errors in.
pub(super) struct SceneText<'a> {
    pub path: &'a Path,
    text: &'a str,
}

/// The field name under which `toml` passes a value's span; it shows up in paths and is removed.
const SPANNED_KEY: &str = ".$__serde_spanned_private_value";

impl<'a> SceneText<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        Self { path, text }
    }

    /// Parses the file's content.
    ///
    /// # Errors
    ///
    /// One line, `file:line: key: message`.
    pub(super) fn parse<T: DeserializeOwned>(&self) -> crate::Result<T> {
        let deserializer =
            toml::Deserializer::parse(self.text).map_err(|error| self.toml_error("", &error))?;
        serde_path_to_error::deserialize(deserializer).map_err(|error| {
            let path = error.path().to_string().replace(SPANNED_KEY, "");
            self.toml_error(if path == "." { "" } else { &path }, error.inner())
        })
    }

    fn toml_error(&self, key: &str, error: &toml::de::Error) -> SceneError {
        // The message may have several lines.
        let message = error.message().lines().collect::<Vec<_>>().join("; ");
        self.error(error.span(), key, &message)
    }

    /// Returns an error about `value`.
    pub(super) fn error_at<T>(&self, value: &Spanned<T>, key: &str, message: &str) -> SceneError {
        self.error(Some(value.span()), key, message)
    }

    fn error(&self, span: Option<Range<usize>>, key: &str, message: &str) -> SceneError {
        let location = match span {
            Some(span) => {
                let before = self.text.get(..span.start).unwrap_or(self.text);
                let line = 1 + before.bytes().filter(|&b| b == b'\n').count();
                format!("{}:{line}", self.path.display())
            }
            None => self.path.display().to_string(),
        };
        match key {
            "" => SceneError::new(format!("{location}: {message}")),
            key => SceneError::new(format!("{location}: {key}: {message}")),
        }
    }
}
