//! The reader of Wavefront OBJ files.

mod corners;
mod lines;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::ops::Range;

use super::parts::unique_names;
use super::polygon::Triangulator;
use super::{Parsed, UNNAMED};
use corners::Attributes;
use lines::{Kind, Line, Lines, Unknown};

use crate::mesh::{MeshError, Part, TriangleMesh};

/// The reason that a text is not an OBJ mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A `v` line does not have three finite coordinates.
    #[error("line {0}: a vertex needs three finite numbers")]
    Vertex(usize),
    /// An `f` line contains something other than indices.
    #[error("line {0}: a face contains something that is not a vertex index")]
    Face(usize),
    /// An `f` line refers to a vertex that does not exist.
    #[error("line {line}: a face refers to vertex {index}; {}", existing(*.count))]
    Index {
        /// The line number.
        line: usize,
        /// The index as written: 1 is the first vertex, −1 the last one before the face.
        index: i64,
        /// The number of vertices that the face can refer to.
        count: usize,
    },
    /// A corner of a face has no texture coordinates, where a texture is asked for.
    #[error(
        "line {0}: a corner of a face has no texture coordinates: unwrap the model, or bake vertices"
    )]
    NoCoordinates(usize),
    /// The file starts with a byte order mark of UTF-16.
    #[error("the text is encoded as UTF-16: save it as UTF-8")]
    Utf16,
    /// The file can be parsed, but its triangles are not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Describes which indices exist, for an error.
fn existing(count: usize) -> String {
    match count {
        0 => "there are no vertices".into(),
        1 => "only 1, or -1, exists".into(),
        _ => format!("1 to {count} and -{count} to -1 exist"),
    }
}

/// Reads the triangles of an OBJ file. Polygons are triangulated, concave ones included; each object
/// becomes a part, or each of its groups where it has several; points, lines, normals, texture
/// coordinates and materials are ignored.
///
/// # Errors
///
/// A line is malformed (the error names the first one), or the file has no faces.
pub fn read_obj(file: &[u8]) -> Result<TriangleMesh, ObjError> {
    Ok(parse(file)?.mesh)
}

/// Reads a file like [`read_obj`], with warnings.
pub(super) fn parse(file: &[u8]) -> Result<Parsed, ObjError> {
    let reader = Reader::default();
    Ok(read(file, Lines::new(file), reader)?.0)
}

/// A file whose vertices have one position, one pair of texture coordinates and one normal each.
pub(super) struct Textured {
    pub parsed: Parsed,
    /// The texture coordinates of each vertex, v downward.
    pub coordinates: Vec<[f32; 2]>,
    /// The normals of each vertex; zero for those without one. `None` if no face has normals.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Reads a file with its texture coordinates and normals.
pub(super) fn parse_textured(file: &[u8]) -> Result<Textured, ObjError> {
    let reader = Reader {
        attributes: Some(Attributes::default()),
        ..Reader::default()
    };
    let (parsed, attributes) = read(file, Lines::with_attributes(file), reader)?;
    let (coordinates, normals) = attributes.unwrap_or_default().of_vertices();
    Ok(Textured {
        parsed,
        coordinates,
        normals,
    })
}

fn read(
    file: &[u8],
    mut lines: Lines<'_>,
    mut reader: Reader,
) -> Result<(Parsed, Option<Attributes>), ObjError> {
    if file.starts_with(b"\xFF\xFE") || file.starts_with(b"\xFE\xFF") {
        return Err(ObjError::Utf16);
    }
    for line in lines.by_ref() {
        reader.line(&line)?;
    }
    reader.finish(lines.unknown())
}

/// The content of a file so far.
#[derive(Default)]
struct Reader {
    positions: Vec<[f64; 3]>,
    /// The polygons' corners, as indices into `positions`.
    corners: Vec<u32>,
    polygons: Vec<Polygon>,
    /// The parts by the number of their object and their group's name.
    parts: HashMap<(usize, Vec<u8>), u32>,
    /// The object's number and the group's name of each part.
    part_names: Vec<(usize, Vec<u8>)>,
    /// The names of all objects; the first one holds what comes before any object.
    objects: Vec<Vec<u8>>,
    group: Vec<u8>,
    /// The other attributes of corners, if they are read.
    attributes: Option<Attributes>,
}

/// A polygon in the order of the file.
struct Polygon {
    corners: Range<usize>,
    part: u32,
    line: usize,
}

impl Reader {
    fn line(&mut self, line: &Line<'_>) -> Result<(), ObjError> {
        let name = || line.words.first().map_or(vec![], |name| name.to_vec());
        match line.kind {
            Kind::Vertex => {
                let position = vertex(&line.words).ok_or(ObjError::Vertex(line.number))?;
                self.positions.push(position);
            }
            Kind::Face => self.face(line)?,
            Kind::Coordinates | Kind::Normal => {
                if let Some(attributes) = &mut self.attributes {
                    attributes.line(line);
                }
            }
            Kind::Object => {
                if self.objects.is_empty() {
                    self.objects.push(vec![]);
                }
                self.objects.push(name());
                self.group.clear();
            }
            Kind::Group => self.group = name(),
        }
        Ok(())
    }

    fn face(&mut self, line: &Line<'_>) -> Result<(), ObjError> {
        let first = self.corners.len();
        let count = self.positions.len();
        for word in &line.words {
            let index: i64 =
                parse_number(position_index(word)).ok_or(ObjError::Face(line.number))?;
            let from_zero = match index {
                1.. => index - 1,
                _ => index + count as i64,
            };
            let corner = u32::try_from(from_zero).ok().filter(|_| index != 0);
            let line = line.number;
            self.corners
                .push(corner.ok_or(ObjError::Index { line, index, count })?);
            if let Some(attributes) = &mut self.attributes {
                attributes.corner(word);
            }
        }
        let object = self.objects.len().saturating_sub(1);
        let key = (object, self.group.clone());
        let next = self.part_names.len() as u32;
        let part = *self.parts.entry(key).or_insert_with_key(|key| {
            self.part_names.push(key.clone());
            next
        });
        self.polygons.push(Polygon {
            corners: first..self.corners.len(),
            part,
            line: line.number,
        });
        Ok(())
    }

    /// Checks the faces and cuts them into triangles, part by part.
    fn finish(
        mut self,
        unknown: Option<Unknown<'_>>,
    ) -> Result<(Parsed, Option<Attributes>), ObjError> {
        self.check_indices()?;
        if let Some(attributes) = &mut self.attributes {
            let line_of = |corner: usize| {
                let polygon = self.polygons.partition_point(|p| p.corners.end <= corner);
                self.polygons[polygon].line
            };
            attributes.split(&mut self.positions, &mut self.corners, line_of)?;
        }
        // The sort is stable: faces of a part that is resumed keep their order.
        self.polygons.sort_by_key(|polygon| polygon.part);
        let mut triangulator = Triangulator::new();
        let mut triangles = Vec::with_capacity(self.polygons.len());
        let mut parts: Vec<(u32, Range<usize>)> = Vec::new();
        for polygon in &self.polygons {
            let start = triangles.len();
            let corners = &self.corners[polygon.corners.clone()];
            let cut = triangulator.triangulate(corners.iter().map(|v| self.positions[*v as usize]));
            triangles.extend(cut.map(|t| t.map(|corner| corners[corner as usize])));
            match parts.last_mut() {
                Some((part, range)) if *part == polygon.part => range.end = triangles.len(),
                _ => parts.push((polygon.part, start..triangles.len())),
            }
        }
        parts.retain(|(_, range)| !range.is_empty());
        let parts = self.named(&parts);
        let mesh = TriangleMesh::from_f64(&self.positions, triangles, parts)?;
        let mut warnings = triangulator.warnings();
        warnings.extend(unknown.map(unknown_warning));
        Ok((Parsed::new(mesh, warnings), self.attributes))
    }

    /// Faces may come before their vertices, so that the largest index is known only at the end.
    fn check_indices(&self) -> Result<(), ObjError> {
        let count = self.positions.len();
        for polygon in &self.polygons {
            let corners = &self.corners[polygon.corners.clone()];
            if let Some(&corner) = corners.iter().find(|c| **c as usize >= count) {
                return Err(ObjError::Index {
                    line: polygon.line,
                    index: i64::from(corner) + 1,
                    count,
                });
            }
        }
        Ok(())
    }

    /// Returns the parts with their names: that of the object, if it is one part, else the object's
    /// and the group's.
    fn named(&self, parts: &[(u32, Range<usize>)]) -> Vec<Part> {
        let mut parts_of = HashMap::new();
        for (part, _) in parts {
            *parts_of
                .entry(self.part_names[*part as usize].0)
                .or_insert(0) += 1;
        }
        let named = parts.iter().map(|(part, triangles)| {
            let (object, group) = &self.part_names[*part as usize];
            let text = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
            let object_name = self.objects.get(*object).map_or(&[][..], |name| name);
            let name = match (object_name, &group[..]) {
                ([], []) => UNNAMED.to_owned(),
                ([], group) => text(group),
                (object, []) => text(object),
                (name, _) if parts_of[object] == 1 => text(name),
                (name, group) => format!("{}/{}", text(name), text(group)),
            };
            Part {
                name,
                triangles: triangles.clone(),
            }
        });
        let mut named: Vec<Part> = named.collect();
        unique_names(&mut named);
        named
    }
}

fn unknown_warning(Unknown { count, first }: Unknown<'_>) -> String {
    let (line, keyword) = first;
    // The keyword of a file that is no text may be long.
    let keyword: String = String::from_utf8_lossy(keyword).chars().take(20).collect();
    let keyword = keyword.escape_debug();
    format!(
        "{count} lines are left out, because their keyword is unknown; the first is line {line} \
         (`{keyword}`)"
    )
}

/// Returns the position of a `v` line with exactly three words, all finite single floats.
fn vertex(words: &[&[u8]]) -> Option<[f64; 3]> {
    let number = |word: &[u8]| {
        let value: f64 = parse_number(word)?;
        (value as f32).is_finite().then_some(value)
    };
    let [x, y, z] = words[..] else { return None };
    Some([number(x)?, number(y)?, number(z)?])
}

/// Returns the position index of a face corner: `7` for `7`, `7/1`, `7//3` and `7/1/3`. A word
/// without one is returned unchanged, and will be rejected.
fn position_index(word: &[u8]) -> &[u8] {
    match word.iter().position(|&b| b == b'/') {
        Some(0) | None => word,
        Some(end) => &word[..end],
    }
}

fn parse_number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
