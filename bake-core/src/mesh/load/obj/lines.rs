//! The lines of an OBJ file that have geometry or name it, split into words.

/// A line of geometry or a name.
pub(super) struct Line<'a> {
    /// Line number; 1 is the first line of the file.
    pub number: usize,
    pub kind: Kind,
    /// The words after the keyword: without comments, or a name as a single word.
    pub words: Vec<&'a [u8]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `v`: the first three words are coordinates. Weights and colors are cut off: some readers
    /// scale positions by weights, which have no meaning for polygons.
    Vertex,
    /// `f`: the words are indices of positions, coordinates and normals.
    Face,
    /// `vt`, if attributes are read.
    Coordinates,
    /// `vn`, if attributes are read.
    Normal,
    /// `o`: a new object.
    Object,
    /// `g`: a group of the object.
    Group,
}

/// Keywords of what a bake does not need: vertex attributes, points and lines, materials, display
/// and the parameters of free-form geometry. Free-form geometry itself is not among them, so that it
/// is reported.
const IGNORED: &[&[u8]] = &[
    b"vt",
    b"vn",
    b"vp",
    b"p",
    b"l",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
];

/// Keywords before names or paths, which may end in a backslash or contain `#`.
const NAMING: &[&[u8]] = &[
    b"o",
    b"g",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"shadow_obj",
];

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// The geometry lines of a file.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    unknown: Option<Unknown<'a>>,
    /// Whether lines of texture coordinates and normals are read.
    attributes: bool,
}

/// Lines that no OBJ reader knows.
#[derive(Clone, Copy)]
pub(super) struct Unknown<'a> {
    pub count: usize,
    /// The number and the keyword of the first one.
    pub first: (usize, &'a [u8]),
}

impl<'a> Lines<'a> {
    pub(super) fn new(file: &'a [u8]) -> Self {
        Self {
            rest: file,
            number: 0,
            unknown: None,
            attributes: false,
        }
    }

    /// Returns the lines with those of texture coordinates and normals.
    pub(super) fn with_attributes(file: &'a [u8]) -> Self {
        Self {
            attributes: true,
            ..Self::new(file)
        }
    }

    /// Returns the lines so far whose keyword is unknown.
    pub(super) fn unknown(&self) -> Option<Unknown<'a>> {
        self.unknown
    }

    /// Returns the next line of the file without its line ending (LF, CR LF or CR) and without the
    /// byte order mark that a file may have, or each of several files that were joined.
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
        let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line);
        Some(line.trim_ascii())
    }

    /// Returns the words of a logical line, which may continue over several physical ones.
    fn words(&mut self, line: &'a [u8]) -> Vec<&'a [u8]> {
        let mut words = Vec::with_capacity(4);
        let mut continued = push_words(line, &mut words);
        while continued {
            let Some(line) = self.next_physical() else {
                break;
            };
            continued = push_words(line, &mut words);
        }
        words
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        loop {
            let line = self.next_physical()?;
            let number = self.number;
            let end = line.iter().position(|b| is_space(*b)).unwrap_or(line.len());
            let (keyword, rest) = line.split_at(end);
            if NAMING.contains(&keyword) {
                let name = rest.trim_ascii();
                let kind = match keyword {
                    b"o" => Kind::Object,
                    b"g" => Kind::Group,
                    _ => continue,
                };
                let words = if name.is_empty() { vec![] } else { vec![name] };
                return Some(Line {
                    number,
                    kind,
                    words,
                });
            }
            let mut words = self.words(line);
            let Some((&keyword, _)) = words.split_first() else {
                continue;
            };
            let kind = match keyword {
                b"v" => Kind::Vertex,
                b"f" => Kind::Face,
                b"vt" if self.attributes => Kind::Coordinates,
                b"vn" if self.attributes => Kind::Normal,
                _ => {
                    self.count_unknown(number, keyword);
                    continue;
                }
            };
            words.remove(0);
            if kind == Kind::Vertex {
                words.truncate(3);
            }
            return Some(Line {
                number,
                kind,
                words,
            });
        }
    }
}

impl<'a> Lines<'a> {
    fn count_unknown(&mut self, number: usize, keyword: &'a [u8]) {
        if IGNORED.contains(&keyword) {
            return;
        }
        let first = (number, keyword);
        self.unknown
            .get_or_insert(Unknown { count: 0, first })
            .count += 1;
    }
}

fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == 0x0B
}

/// Appends a line's words up to a comment. Returns whether a backslash continues the line. A comment
/// ends with its own line, whatever its last character is.
fn push_words<'a>(line: &'a [u8], words: &mut Vec<&'a [u8]>) -> bool {
    for word in line.split(|b| is_space(*b)).filter(|word| !word.is_empty()) {
        if word.starts_with(b"#") {
            return false;
        }
        words.push(word);
    }
    if let Some(last) = words.last_mut()
        && line.ends_with(b"\\")
    {
        *last = &last[..last.len() - 1];
        if last.is_empty() {
            words.pop();
        }
        return true;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns each line's number, kind and words.
    fn lines(file: &[u8]) -> Vec<(usize, Kind, String)> {
        let text = |line: Line<'_>| {
            let words = line.words.join(&b' ');
            let text = String::from_utf8_lossy(&words).into_owned();
            (line.number, line.kind, text)
        };
        Lines::new(file).map(text).collect()
    }

    fn line(number: usize, kind: Kind, words: &str) -> (usize, Kind, String) {
        (number, kind, words.into())
    }

    #[test]
    fn only_geometry_is_kept() {
        let file = b"\xEF\xBB\xBF# head \\\nmtllib gone.mtl\nv 1 2 3 0.5 0.5 0.5\n vn nan 0 0\n\
            \tf 1/1/1 2//2  -1 # tail\nusemtl x\nl 1 2\np 1\ns off\ng left arm\no\n";
        let expected = [
            line(3, Kind::Vertex, "1 2 3"),
            line(5, Kind::Face, "1/1/1 2//2 -1"),
            line(10, Kind::Group, "left arm"),
            line(11, Kind::Object, ""),
        ];
        assert_eq!(lines(file), expected);
    }

    #[test]
    fn all_line_endings_and_continuations_are_read() {
        let file = b"v 1 \\\r\n2 3\rv 4 5 6\r\n\r\nf 1 2\\ \n3";
        let expected = [
            line(1, Kind::Vertex, "1 2 3"),
            line(3, Kind::Vertex, "4 5 6"),
            line(5, Kind::Face, "1 2 3"),
        ];
        assert_eq!(lines(file)[..2], expected[..2]);
        // A backslash continues a line even without a space before it, as in the C language.
        assert_eq!(lines(file)[2], expected[2]);
        assert_eq!(lines(b"v 1 2 3 \\"), [line(1, Kind::Vertex, "1 2 3")]);
    }

    /// Report 01: a comment that ends in a backslash, behind a vertex or a face.
    #[test]
    fn a_comment_does_not_continue() {
        let file = b"v 1 2 3 # C:\\tmp\\\nv 4 5 6\nf 1 2 3 # \\\nf 1 2 4";
        let kinds: Vec<_> = lines(file).into_iter().map(|(n, ..)| n).collect();
        assert_eq!(kinds, [1, 2, 3, 4]);
    }

    /// Report 01: `usemtl woods\oak\`, a path as some exporters write.
    #[test]
    fn a_backslash_ends_a_name() {
        let file = b"usemtl woods\\oak\\\nf 1 2 3\no C:\\\nf 1 2 4";
        let expected = [
            line(2, Kind::Face, "1 2 3"),
            line(3, Kind::Object, "C:\\"),
            line(4, Kind::Face, "1 2 4"),
        ];
        assert_eq!(lines(file), expected);
    }

    /// Report 03: `#` within names.
    #[test]
    fn names_keep_number_signs() {
        let expected = [line(1, Kind::Object, "Screw #6-32")];
        assert_eq!(lines(b"o Screw #6-32"), expected);
    }

    /// Report 05: two files, each with a byte order mark, joined.
    #[test]
    fn a_byte_order_mark_may_be_anywhere() {
        let file = b"\xEF\xBB\xBFv 1 2 3\n\xEF\xBB\xBFv 4 5 6\n";
        assert_eq!(lines(file).len(), 2);
    }

    #[test]
    fn unknown_keywords_are_counted() {
        let mut lines = Lines::new(b"v 1 2 3\nvn 0 0 1\nvertex 1 2 3\nsurf 0 1\n");
        assert_eq!(lines.by_ref().count(), 1);
        let unknown = lines.unknown().unwrap();
        assert_eq!((unknown.count, unknown.first), (2, (3, &b"vertex"[..])));
    }

    #[test]
    fn bytes_that_are_not_text_are_tolerated() {
        let expected = [line(1, Kind::Object, "caf\u{FFFD}")];
        assert_eq!(lines(b"o caf\xE9\n"), expected);
        assert!(lines(b"\xFF\xFE\0\n").is_empty());
        assert!(lines(b"").is_empty());
    }
}
