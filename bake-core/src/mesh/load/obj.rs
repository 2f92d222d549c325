//! The reader of Wavefront OBJ files.

use std::collections::HashMap;
use std::ops::Range;

use super::obj_lines::{Kind, Line, Lines, Unknown};
use super::parts::unique_names;
use super::polygon::Triangulator;
use super::{Parsed, UNNAMED};
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
    if file.starts_with(b"\xFF\xFE") || file.starts_with(b"\xFE\xFF") {
        return Err(ObjError::Utf16);
    }
    let mut lines = Lines::new(file);
    let mut reader = Reader::default();
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
            let index: i64 = parse_number(word).ok_or(ObjError::Face(line.number))?;
            let from_zero = match index {
                1.. => index - 1,
                _ => index + count as i64,
            };
            let corner = u32::try_from(from_zero).ok().filter(|_| index != 0);
            let line = line.number;
            self.corners
                .push(corner.ok_or(ObjError::Index { line, index, count })?);
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
    fn finish(mut self, unknown: Option<Unknown<'_>>) -> Result<Parsed, ObjError> {
        // Faces may come before their vertices, so that the largest index is known only now.
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
        Ok(Parsed::new(mesh, warnings))
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

fn parse_number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(faces: &str) -> Result<TriangleMesh, ObjError> {
        read_obj(format!("{CORNERS}{faces}").as_bytes())
    }

    fn part(name: &str, triangles: Range<usize>) -> Part {
        Part {
            name: name.into(),
            triangles,
        }
    }

    #[test]
    fn negative_indices_count_back_from_the_face() {
        let mesh = read("f -4 -3 -2\nv 9 9 9\nf -5 -3 -2").unwrap();
        let corners: Vec<_> = mesh.corners().collect();
        assert_eq!(corners[0], [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        assert_eq!(corners[1], [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    }

    #[test]
    fn objects_and_their_groups_are_parts() {
        let mesh = read("f 1 2 3\no a\nf 1 2 3 4\ng b\nf 2 3 4\no a\nf 1 3 4\no empty\n").unwrap();
        let expected = [
            part(UNNAMED, 0..1),
            part("a", 1..3),
            part("a/b", 3..4),
            part("a~2", 4..5),
        ];
        assert_eq!(mesh.parts(), expected);
        let resumed = read("g a\nf 1 2 3\ng b\nf 2 3 4\ng a\nf 1 3 4\n").unwrap();
        assert_eq!(resumed.parts(), [part("a", 0..2), part("b", 2..3)]);
    }

    /// Reports 03 and 04: names with `#`, two objects of one name, one group in two objects.
    #[test]
    fn objects_do_not_merge() {
        let names = |text: &str| {
            let mesh = read(text).unwrap();
            let names = mesh.parts().iter().map(|part| part.name.clone());
            names.collect::<Vec<_>>()
        };
        let screws = names("o Screw #6-32\nf 1 2 3\no Screw #8-32\nf 2 3 4\n");
        assert_eq!(screws, ["Screw #6-32", "Screw #8-32"]);
        let wheels = names("o wheel\nf 1 2 3\no wheel\nf 2 3 4\n");
        assert_eq!(wheels, ["wheel", "wheel~2"]);
        let rims = names("o left\ng rim\nf 1 2 3\no right\ng rim\nf 2 3 4\n");
        assert_eq!(rims, ["left", "right"]);
        // An object begins without a group, whatever the one before it had.
        let begun = names("o a\ng x\nf 1 2 3\no b\nf 1 2 3\ng y\nf 2 3 4\n");
        assert_eq!(begun, ["a", "b", "b/y"]);
    }

    /// Reports 01 and 05: every way to write the same square.
    #[test]
    fn comments_marks_and_paths_lose_nothing() {
        let plain = read("f 1 2 3 4\n").unwrap();
        for text in [
            "v 0 0 0 # C:\\\nv 1 0 0\nv 1 1 0 # \\\nv 0 1 0\nf -4 -3 -2 -1",
            "v 0 0 0\nv 1 0 0\n\u{feff}v 1 1 0\nv 0 1 0\nf 1 2 3 4 # \\",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl woods\\oak\\\nf 1 2 3 4",
        ] {
            assert_eq!(read_obj(text.as_bytes()).unwrap(), plain, "{text}");
        }
    }

    #[test]
    fn what_is_not_read_is_reported() {
        let parsed = parse(format!("{CORNERS}f 1 3 2 4\nblob 1\nf 1 2 3").as_bytes()).unwrap();
        assert_eq!(parsed.warnings.len(), 2, "{:?}", parsed.warnings);
        assert!(parsed.warnings[0].starts_with("1 polygons cross"));
        assert!(parsed.warnings[1].ends_with("line 6 (`blob`)"));
        assert!(
            parse(format!("{CORNERS}f 1 2 3").as_bytes())
                .unwrap()
                .warnings
                .is_empty()
        );
    }

    #[test]
    fn points_lines_and_materials_are_ignored() {
        let mesh =
            read("mtllib no.mtl\nusemtl x\nusemtl y\np 1 2\nl 1 2 3\nf 1\nf 1 2\nf 1 2 3\nf");
        assert_eq!(mesh.unwrap().triangles().len(), 1);
    }

    #[test]
    fn weights_and_colors_do_not_move_vertices() {
        let file = "v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 0\nv 0 2 2 1 0 0\nv 5 5 5 1 2 3 4\nf 1 2 3\nf 1 2 4\nf 1 2 5";
        let mesh = read_obj(file.as_bytes()).unwrap();
        assert_eq!(mesh.bounds().max, [5.0; 3]);
        assert_eq!(mesh.corners().next().unwrap()[1], [2.0, 0.0, 0.0]);
    }

    #[test]
    fn malformed_texture_coordinates_are_ignored() {
        assert!(read("vt x\nvn nan nan nan\nf 1/9/9 2/-7 3//0").is_ok());
    }

    #[test]
    fn errors_name_their_line() {
        let error = |faces: &str| read(faces).unwrap_err();
        for vertex in [
            "v 1 2",
            "v nan 0 0",
            "v -nan 0 0",
            "v 1e99 0 0",
            "v 1,5 0 0",
        ] {
            // A malformed vertex is an error even if it is unused.
            let file = format!("{vertex}\nf 1 2 5");
            assert_eq!(error(&file), ObjError::Vertex(5), "{vertex}");
            let unused = format!("{vertex}\nf 1 2 3");
            assert_eq!(error(&unused), ObjError::Vertex(5), "{vertex}");
        }
        assert_eq!(error("f 1 2 3\nf 1 2 x"), ObjError::Face(6));
        assert_eq!(error("f 1 2 3\nf 1 2 /3"), ObjError::Face(6));
        let index = |line, index, count| ObjError::Index { line, index, count };
        assert_eq!(error("f 1 2 5"), index(5, 5, 4));
        assert_eq!(error("f 1 2 0"), index(5, 0, 4));
        assert_eq!(error("\nf 1 2 -5"), index(6, -5, 4));
        assert_eq!(error("f 1 2 6\no next\nv 1 1 1\n"), index(5, 6, 5));
        let none = read_obj(b"f 1 2 3").unwrap_err();
        assert_eq!(
            none.to_string(),
            "line 1: a face refers to vertex 1; there are no vertices"
        );
        let far = "f 1 2 99999999999999999999";
        assert_eq!(error(far), ObjError::Face(5));
        assert_eq!(error("l 1 2"), ObjError::Mesh(MeshError::Empty));
        assert_eq!(read_obj(b"\xFF\xFEv\0"), Err(ObjError::Utf16));
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        assert!(read("f 1 2 5\nv 7 7 7\n").is_ok());
    }

    #[test]
    fn broken_files_give_a_mesh_or_an_error() {
        let text = format!("{CORNERS}o a\ng b\nf 1 2 3 4\nf -1//2 -2/1 \\\n-3\n");
        super::super::load_all_broken("a.obj", text.as_bytes());
    }
}
