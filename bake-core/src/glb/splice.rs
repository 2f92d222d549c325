//! Additions to a GLB file, collected and then made at once.

use std::ops::Range;

use super::GlbError;
use super::container::Container;
use super::json::{Edits, Text};

/// A GLB file with the additions so far.
pub(crate) struct Splice<'a> {
    container: Container<'a>,
    /// The JSON as it came in.
    pub text: Text<'a>,
    /// The JSON's outermost object.
    pub root: Range<usize>,
    /// The edits of the JSON, but for what [`finish`](Splice::finish) adds to the outermost object.
    pub edits: Edits,
    bin: Vec<u8>,
    n_views: usize,
    views: Vec<String>,
}

impl<'a> Splice<'a> {
    /// Takes a file apart.
    ///
    /// # Errors
    ///
    /// The file is no GLB with a buffer of its own.
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, GlbError> {
        let container = Container::new(bytes)?;
        // Edits take for granted that the text is valid.
        serde_json::from_slice::<serde_json::Value>(container.json)
            .map_err(|error| GlbError::Json(error.to_string()))?;
        let text = Text(container.json);
        let root = text.root();
        let list = |name: &str| text.member(&root, name).map(|list| text.elements(&list));
        let buffers = list("buffers").unwrap_or_default();
        let is_own = |buffer: &Range<usize>| text.member(buffer, "uri").is_none();
        if buffers.first().is_some_and(|first| !is_own(first))
            || (buffers.is_empty() != container.bin.is_none())
        {
            return Err(GlbError::NoBinary);
        }
        Ok(Self {
            n_views: list("bufferViews").map_or(0, |list| list.len()),
            bin: container.bin.unwrap_or_default().to_vec(),
            container,
            text,
            root,
            edits: Edits::default(),
            views: vec![],
        })
    }

    /// Returns the elements of an array of the outermost object, if it has one of this name.
    pub(crate) fn list(&self, name: &str) -> Option<Vec<Range<usize>>> {
        let list = self.text.member(&self.root, name)?;
        Some(self.text.elements(&list))
    }

    /// Adds bytes to the binary chunk, at a multiple of `align`; returns the index of their buffer view,
    /// which has the members `more`, too.
    pub(crate) fn view(&mut self, bytes: &[u8], align: usize, more: &str) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(align), 0);
        let (offset, length) = (self.bin.len(), bytes.len());
        self.bin.extend(bytes);
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}{more}}}"#
        ));
        self.n_views + self.views.len() - 1
    }

    /// Returns the file with all that was added, and with `lists`, elements for arrays of the outermost
    /// object.
    pub(crate) fn finish(mut self, lists: &[(&str, &[String])]) -> Result<Vec<u8>, GlbError> {
        let views = std::mem::take(&mut self.views);
        let mut new = Vec::new();
        for (name, items) in lists.iter().chain(&[("bufferViews", &views[..])]) {
            match self.text.member(&self.root, name) {
                Some(list) => self.edits.append(&self.text, &list, &items.join(",")),
                None if items.is_empty() => {}
                None => new.push((*name, format!("[{}]", items.join(",")))),
            }
        }
        let length = self.bin.len();
        match self.list("buffers") {
            Some(buffers) if !buffers.is_empty() => {
                let length = [("byteLength", length.to_string())];
                self.edits.set(&self.text, &buffers[0], &length);
            }
            Some(_) => return Err(GlbError::NoBinary),
            None if length == 0 => {}
            None => new.push(("buffers", format!(r#"[{{"byteLength":{length}}}]"#))),
        }
        self.edits.set(&self.text, &self.root, &new);
        let json = self.edits.apply(&self.text, 0..self.text.0.len());
        self.container.with(json, self.bin)
    }
}

/// The member `extras` of `object` with `aogrid` set to `value`: returns the member where there is none
/// yet, else sets it in place, unless the extras are no object.
pub(crate) fn extras(
    text: &Text<'_>,
    edits: &mut Edits,
    object: &Range<usize>,
    value: String,
) -> Option<(&'static str, String)> {
    match text.member(object, "extras") {
        Some(extras) if text.0[extras.start] == b'{' => {
            edits.set(text, &extras, &[("aogrid", value)]);
            None
        }
        Some(_) => None,
        None => Some(("extras", format!(r#"{{"aogrid":{value}}}"#))),
    }
}
