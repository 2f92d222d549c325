//! Edits of JSON text in place: all that is not edited keeps its bytes.
//!
//! The text is valid JSON (a parser has read it); these functions only find where its values are.

use std::ops::Range;

/// Values of a text, by their bytes.
pub(crate) struct Text<'a>(pub &'a [u8]);

impl Text<'_> {
    /// Returns the index of the first byte from `at` that is no space.
    fn skip_space(&self, mut at: usize) -> usize {
        while self.0.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        at
    }

    /// Returns the end of the string that begins at `at`.
    fn string_end(&self, at: usize) -> usize {
        let mut end = at + 1;
        while end < self.0.len() && self.0[end] != b'"' {
            end += if self.0[end] == b'\\' { 2 } else { 1 };
        }
        (end + 1).min(self.0.len())
    }

    /// Returns the end of the value that begins at `at`.
    fn value_end(&self, at: usize) -> usize {
        match self.0.get(at) {
            Some(b'"') => self.string_end(at),
            Some(b'{' | b'[') => {
                let (mut depth, mut end) = (0_usize, at);
                while end < self.0.len() {
                    match self.0[end] {
                        b'"' => {
                            end = self.string_end(end);
                            continue;
                        }
                        b'{' | b'[' => depth += 1,
                        b'}' | b']' => depth -= 1,
                        _ => {}
                    }
                    end += 1;
                    if depth == 0 {
                        break;
                    }
                }
                end
            }
            _ => {
                let ends =
                    |byte: &u8| matches!(byte, b',' | b'}' | b']') || byte.is_ascii_whitespace();
                let rest = &self.0[at.min(self.0.len())..];
                at + rest.iter().position(ends).unwrap_or(rest.len())
            }
        }
    }

    /// Returns the whole text's value.
    pub(crate) fn root(&self) -> Range<usize> {
        let start = self.skip_space(0);
        start..self.value_end(start)
    }

    /// Returns the values of an array, or the values of an object with the strings of their keys.
    fn children(&self, parent: &Range<usize>) -> Vec<(Option<Range<usize>>, Range<usize>)> {
        let mut children = Vec::new();
        let is_object = match self.0[parent.start] {
            b'{' => true,
            b'[' => false,
            _ => return children,
        };
        let mut at = self.skip_space(parent.start + 1);
        while at + 1 < parent.end {
            let key = is_object.then(|| at..self.string_end(at));
            if let Some(key) = &key {
                // A colon follows, between spaces.
                at = self.skip_space(self.skip_space(key.end) + 1);
            }
            let value = at..self.value_end(at);
            at = self.skip_space(value.end);
            if self.0.get(at) == Some(&b',') {
                at = self.skip_space(at + 1);
            }
            children.push((key, value));
        }
        children
    }

    /// Returns the elements of an array.
    pub(crate) fn elements(&self, array: &Range<usize>) -> Vec<Range<usize>> {
        let children = self.children(array).into_iter();
        children.map(|(_, value)| value).collect()
    }

    /// Returns the value of an object's key: the last, if it has several, as parsers do.
    pub(crate) fn member(&self, object: &Range<usize>, name: &str) -> Option<Range<usize>> {
        let is_named = |key: &Range<usize>| {
            let key = serde_json::from_slice::<String>(&self.0[key.clone()]);
            key.is_ok_and(|key| key == name)
        };
        let children = self.children(object).into_iter().rev();
        children
            .filter(|(key, _)| key.as_ref().is_some_and(is_named))
            .map(|(_, value)| value)
            .next()
    }

    /// Whether an array or object has nothing in it.
    fn is_empty(&self, parent: &Range<usize>) -> bool {
        self.skip_space(parent.start + 1) + 1 >= parent.end
    }
}

/// Replacements of parts of a text.
#[derive(Default)]
pub(crate) struct Edits(Vec<(Range<usize>, String)>);

impl Edits {
    pub(crate) fn replace(&mut self, range: Range<usize>, text: impl Into<String>) {
        self.0.push((range, text.into()));
    }

    /// Adds `items`, separated by commas, at the end of an array, or members at that of an object.
    pub(crate) fn append(&mut self, text: &Text<'_>, parent: &Range<usize>, items: &str) {
        if items.is_empty() {
            return;
        }
        let comma = if text.is_empty(parent) { "" } else { "," };
        let end = parent.end - 1;
        self.0.push((end..end, format!("{comma}{items}")));
    }

    /// Sets a member of an object.
    pub(crate) fn set(
        &mut self,
        text: &Text<'_>,
        object: &Range<usize>,
        members: &[(&str, String)],
    ) {
        let mut new = Vec::new();
        for (name, value) in members {
            match text.member(object, name) {
                Some(old) => self.replace(old, value.as_str()),
                None => new.push(format!("\"{name}\":{value}")),
            }
        }
        self.append(text, object, &new.join(","));
    }

    /// Adds the edits of another.
    pub(crate) fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }

    /// Returns the edited part of a text. Edits outside `range` are not made.
    pub(crate) fn apply(&self, text: &Text<'_>, range: Range<usize>) -> Vec<u8> {
        let within =
            |edit: &&(Range<usize>, String)| edit.0.start >= range.start && edit.0.end <= range.end;
        let mut edits: Vec<_> = self.0.iter().filter(within).collect();
        // Stable: insertions at one byte keep their order.
        edits.sort_by_key(|(at, _)| at.start);
        let mut out = Vec::new();
        let mut done = range.start;
        for (at, new) in edits {
            out.extend_from_slice(&text.0[done..at.start]);
            out.extend_from_slice(new.as_bytes());
            done = at.end;
        }
        out.extend_from_slice(&text.0[done..range.end]);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#" { "a" : [1, {"b": "x,]\"}"} ,[ ]], "c":{ }, "a\u0062": -2.5e3 } "#;

    #[test]
    fn values_are_found_where_they_are() {
        let text = Text(TEXT.as_bytes());
        let root = text.root();
        let of = |range: Range<usize>| &TEXT[range];
        let a = text.member(&root, "a").unwrap();
        let elements = text.elements(&a);
        assert_eq!(elements.len(), 3);
        assert_eq!(of(elements[0].clone()), "1");
        assert_eq!(of(text.member(&elements[1], "b").unwrap()), r#""x,]\"}""#);
        assert!(text.elements(&elements[2]).is_empty());
        assert_eq!(of(text.member(&root, "ab").unwrap()), "-2.5e3");
        assert_eq!(text.member(&root, "d"), None);
    }

    #[test]
    fn edits_leave_the_rest_alone() {
        let text = Text(TEXT.as_bytes());
        let root = text.root();
        let mut edits = Edits::default();
        let a = text.member(&root, "a").unwrap();
        edits.append(&text, &a, "7,8");
        edits.set(
            &text,
            &text.member(&root, "c").unwrap(),
            &[("d", "9".into())],
        );
        edits.set(&text, &root, &[("ab", "0".into()), ("e", "[]".into())]);
        let edited = edits.apply(&text, 0..TEXT.len());
        assert_eq!(
            String::from_utf8(edited).unwrap(),
            r#" { "a" : [1, {"b": "x,]\"}"} ,[ ],7,8], "c":{ "d":9}, "a\u0062": 0 ,"e":[]} "#
        );
        let element = text.elements(&a)[1].clone();
        assert_eq!(edits.apply(&text, element), br#"{"b": "x,]\"}"}"#);
    }
}
