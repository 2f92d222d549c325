//! Where in a scene file something is: errors name file, line and key.

use std::ops::Range;
use std::path::Path;

use anyhow::anyhow;
use serde::de::DeserializeOwned;
use toml::Spanned;

/// A scene file's text, to find lines in.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    text: &'a str,
}

/// How a value's place gets into paths: `toml` hands it over as a field of this name.
const SPANNED: &str = ".$__serde_spanned_private_value";

impl<'a> Source<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        Self { path, text }
    }

    /// The file's content.
    ///
    /// # Errors
    ///
    /// `file:line: key: what is wrong`.
    pub(super) fn parse<T: DeserializeOwned>(&self) -> anyhow::Result<T> {
        let deserializer =
            toml::Deserializer::parse(self.text).map_err(|error| self.toml_error("", &error))?;
        serde_path_to_error::deserialize(deserializer).map_err(|error| {
            let path = error.path().to_string().replace(SPANNED, "");
            self.toml_error(if path == "." { "" } else { &path }, error.inner())
        })
    }

    fn toml_error(&self, key: &str, error: &toml::de::Error) -> anyhow::Error {
        // Its message can have more lines than one.
        let message = error.message().lines().collect::<Vec<_>>().join("; ");
        self.error(error.span(), key, &message)
    }

    /// An error about the value at a place.
    pub(super) fn at<T>(&self, place: &Spanned<T>, key: &str, message: &str) -> anyhow::Error {
        self.error(Some(place.span()), key, message)
    }

    fn error(&self, span: Option<Range<usize>>, key: &str, message: &str) -> anyhow::Error {
        let place = match span {
            Some(span) => {
                let before = self.text.get(..span.start).unwrap_or(self.text);
                let line = 1 + before.bytes().filter(|&b| b == b'\n').count();
                format!("{}:{line}", self.path.display())
            }
            None => self.path.display().to_string(),
        };
        match key {
            "" => anyhow!("{place}: {message}"),
            key => anyhow!("{place}: {key}: {message}"),
        }
    }
}
