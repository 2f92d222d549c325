//! The geometry lines of an OBJ file, in the plain form that every parser reads: positions without
//! weights or colors, faces without texture coordinates or normals.
//!
//! The filter keeps from the parser what we do not use and what could make it fail: missing
//! material files, malformed texture coordinates, vertex colors, weights (which scale positions in
//! some readers and have no meaning for polygons).

use std::io::{self, BufRead, Read};

/// A line of geometry, split into words.
pub(super) struct Line<'a> {
    /// Line number; 1 is the first line of the file.
    pub number: usize,
    pub kind: Kind,
    /// The words after the keyword, without comments.
    pub words: Vec<&'a [u8]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `v`: the first three words are coordinates.
    Vertex,
    /// `f`: the words are position indices alone.
    Face,
    /// `o` or `g`: the words are a name.
    Part,
}

/// The geometry lines of a file.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(file: &'a [u8]) -> Self {
        let rest = file.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(file);
        Self { rest, number: 0 }
    }

    /// Returns the next line of the file without its line ending (LF, CR LF or CR).
    fn next_physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r');
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = match rest {
            [b'\r', b'\n', rest @ ..] | [_, rest @ ..] => rest,
            [] => rest,
        };
        Some(line)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        loop {
            let line = self.next_physical()?;
            let number = self.number;
            let mut words = Vec::with_capacity(4);
            // A logical line may continue over several physical ones.
            let mut continued = push_words(line, &mut words);
            while continued {
                let Some(line) = self.next_physical() else {
                    break;
                };
                continued = push_words(line, &mut words);
            }
            let Some((&keyword, _)) = words.split_first() else {
                continue;
            };
            let kind = match keyword {
                b"v" => Kind::Vertex,
                b"f" => Kind::Face,
                b"o" | b"g" => Kind::Part,
                _ => continue,
            };
            words.remove(0);
            match kind {
                Kind::Vertex => words.truncate(3),
                Kind::Face => words
                    .iter_mut()
                    .for_each(|word| *word = position_index(word)),
                Kind::Part => {}
            }
            return Some(Line {
                number,
                kind,
                words,
            });
        }
    }
}

/// Appends a line's words up to a comment. Returns whether a backslash continues the line.
fn push_words<'a>(line: &'a [u8], words: &mut Vec<&'a [u8]>) -> bool {
    let line = line.trim_ascii();
    if words.is_empty() && line.starts_with(b"#") {
        return false;
    }
    let continued = line.ends_with(b"\\");
    let line = line.strip_suffix(b"\\").unwrap_or(line);
    let split = line.split(|b| b.is_ascii_whitespace() || *b == 0x0B);
    words.extend(
        split
            .filter(|word| !word.is_empty())
            .take_while(|word| !word.starts_with(b"#")),
    );
    continued
}

/// Returns the position index of a face corner: `7` for `7`, `7/1`, `7//3` and `7/1/3`. A word
/// without one is returned unchanged, and will be rejected.
fn position_index(word: &[u8]) -> &[u8] {
    match word.iter().position(|&b| b == b'/') {
        Some(0) | None => word,
        Some(end) => &word[..end],
    }
}

/// Whether a word is a float that is infinite or NaN. Such a word contains letters (`nan`, `inf`,
/// an exponent) or very many digits; most words have neither and are not parsed.
fn is_not_finite(word: &[u8]) -> bool {
    let needs_parsing = word.len() > 38 || word.iter().any(u8::is_ascii_alphabetic);
    let parse = || std::str::from_utf8(word).ok()?.parse::<f32>().ok();
    needs_parsing && parse().is_some_and(|v| !v.is_finite())
}

/// A reader of [`Lines`] in plain form, one line at a time.
pub(super) struct LineReader<'a> {
    lines: Lines<'a>,
    line: Vec<u8>,
    /// Number of bytes of `line` that are consumed.
    position: usize,
    number: usize,
    not_finite: Option<usize>,
}

impl<'a> LineReader<'a> {
    pub(super) fn new(file: &'a [u8]) -> Self {
        Self {
            lines: Lines::new(file),
            line: Vec::new(),
            position: 0,
            number: 0,
            not_finite: None,
        }
    }

    /// Returns the number of the first line so far with a vertex that is not finite, used or not.
    pub(super) fn not_finite(&self) -> Option<usize> {
        self.not_finite
    }

    /// Returns the number in the file of the line that was returned last.
    pub(super) fn line_number(&self) -> usize {
        self.number
    }

    fn write_line(&mut self, line: &Line<'_>) {
        self.number = line.number;
        if line.kind == Kind::Vertex && line.words.iter().any(|word| is_not_finite(word)) {
            self.not_finite.get_or_insert(line.number);
        }
        self.position = 0;
        self.line.clear();
        self.line.push(match line.kind {
            Kind::Vertex => b'v',
            Kind::Face => b'f',
            Kind::Part => b'o',
        });
        for word in &line.words {
            self.line.push(b' ');
            match std::str::from_utf8(word) {
                Ok(_) => self.line.extend(*word),
                // The parser requires UTF-8, but names may have an older encoding.
                Err(_) => self.line.extend(String::from_utf8_lossy(word).bytes()),
            }
        }
        self.line.push(b'\n');
    }
}

impl BufRead for LineReader<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.position == self.line.len()
            && let Some(line) = self.lines.next()
        {
            self.write_line(&line);
        }
        Ok(&self.line[self.position..])
    }

    fn consume(&mut self, amount: usize) {
        self.position += amount;
    }
}

impl Read for LineReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(out)?;
        self.consume(read);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(file: &[u8]) -> String {
        let mut text = String::new();
        LineReader::new(file).read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn only_geometry_is_kept() {
        let file = b"\xEF\xBB\xBF# head \\\nmtllib gone.mtl\nv 1 2 3 0.5 0.5 0.5\n vn nan 0 0\n\
            \tf 1/1/1 2//2  -1 # tail\nusemtl x\nl 1 2\np 1\ns off\ng left arm\no\n";
        assert_eq!(plain(file), "v 1 2 3\nf 1 2 -1\no left arm\no\n");
    }

    #[test]
    fn all_line_endings_and_continuations_are_read() {
        let file = b"v 1 \\\r\n2 3\rv 4 5 6\r\n\r\nf 1 2 \\ \n3";
        assert_eq!(plain(file), "v 1 2 3\nv 4 5 6\nf 1 2 3\n");
        let numbers: Vec<_> = Lines::new(file).map(|line| line.number).collect();
        assert_eq!(numbers, [1, 3, 5]);
        assert_eq!(plain(b"v 1 2 3 \\"), "v 1 2 3\n");
    }

    #[test]
    fn bytes_that_are_not_text_are_tolerated() {
        assert_eq!(plain(b"o caf\xE9\n"), "o caf\u{FFFD}\n");
        assert_eq!(plain(b"\xFF\xFE\0\n"), "");
        assert_eq!(plain(b""), "");
    }
}
