//! The reader of Wavefront OBJ files.
//!
//! The tobj crate parses. [`LineReader`] passes it nothing but geometry, and if it rejects a file,
//! this module finds the faulty line.

use tobj::LoadOptions;

use super::obj_lines::{Kind, LineReader, Lines};
use super::polygon::Triangulator;
use super::{MeshError, Part, TriangleMesh};

/// The name of a part without a name in the file.
const UNNAMED: &str = "unnamed";

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
    #[error("line {line}: a face refers to vertex {index}; 1 to {count} and -{count} to -1 exist")]
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
    /// The parser rejected the file for another reason.
    #[error("line {line}: {reason}")]
    Parser {
        /// The line that the parser had reached.
        line: usize,
        /// The parser's message.
        reason: String,
    },
    /// The file can be parsed, but its triangles are not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Reads the triangles of an OBJ file. Polygons are triangulated, concave ones included; each
/// object or group becomes a part; points, lines, normals, texture coordinates and materials are
/// ignored.
///
/// # Errors
///
/// A line is malformed (the error names the first one), or the file has no faces.
pub fn read_obj(file: &[u8]) -> Result<TriangleMesh, ObjError> {
    if file.starts_with(b"\xFF\xFE") || file.starts_with(b"\xFE\xFF") {
        return Err(ObjError::Utf16);
    }
    let options = LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let mut reader = LineReader::new(file);
    let loaded = tobj::load_obj_buf(&mut reader, &options, |_| {
        Err(tobj::LoadError::OpenFileFailed)
    });
    let line = reader.line_number();
    let models = match loaded {
        Ok((models, _materials)) => models,
        Err(error) => {
            let reason = error.to_string();
            return Err(find_error(file).unwrap_or(ObjError::Parser { line, reason }));
        }
    };
    if let Some(line) = reader.not_finite() {
        return Err(ObjError::Vertex(line));
    }
    let (positions, triangles, parts) = assemble(models);
    Ok(TriangleMesh::new(positions, triangles, parts)?)
}

type Assembled = (Vec<[f32; 3]>, Vec<[u32; 3]>, Vec<Part>);

/// Joins the parser's models into one mesh. Models with the same name become one part.
fn assemble(mut models: Vec<tobj::Model>) -> Assembled {
    // A stable sort by the first appearance of the name makes models of a part adjacent.
    let mut names: Vec<String> = Vec::new();
    let mut seen = std::collections::HashMap::new();
    for model in &models {
        seen.entry(model.name.clone()).or_insert_with(|| {
            names.push(model.name.clone());
            names.len()
        });
    }
    models.sort_by_key(|model| seen[&model.name]);

    // Adjacent models with the same name extend the last part; parts without triangles are dropped.
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut parts: Vec<Part> = Vec::new();
    let mut triangulator = Triangulator::new();
    for model in models {
        let start = triangles.len();
        push_model(
            &model.mesh,
            &mut triangulator,
            &mut positions,
            &mut triangles,
        );
        let end = triangles.len();
        let name = match model.name.as_str() {
            "unnamed_object" => UNNAMED,
            name => name,
        };
        match parts.last_mut() {
            Some(part) if part.name == name => part.triangles.end = end,
            _ if start == end => {}
            _ => parts.push(Part {
                name: name.to_owned(),
                triangles: start..end,
            }),
        }
    }
    (positions, triangles, parts)
}

fn push_model(
    mesh: &tobj::Mesh,
    triangulator: &mut Triangulator,
    positions: &mut Vec<[f32; 3]>,
    triangles: &mut Vec<[u32; 3]>,
) {
    let base = positions.len() as u32;
    positions.extend(mesh.positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
    let mut push_polygon = |polygon: &[u32]| {
        let corners = polygon.iter().map(|&v| positions[(base + v) as usize]);
        let cut = triangulator.triangulate(corners);
        // Indices into the polygon become indices into the whole mesh.
        triangles.extend(cut.map(|t| t.map(|corner| base + polygon[corner as usize])));
    };
    if mesh.face_arities.is_empty() {
        mesh.indices.chunks_exact(3).for_each(push_polygon);
        return;
    }
    let mut rest = &mesh.indices[..];
    for &arity in &mesh.face_arities {
        let (polygon, after) = rest.split_at(arity as usize);
        push_polygon(polygon);
        rest = after;
    }
}

/// Returns the first error in the file that this module recognizes, if there is one.
fn find_error(file: &[u8]) -> Option<ObjError> {
    let mut count = 0;
    // Faces may refer to vertices further down, up to the end of their part. So the largest index
    // of a part, with its line, is compared with the number of vertices at the end of the part.
    let mut largest: Option<(i64, usize)> = None;
    let out_of_range = |largest: Option<(i64, usize)>, count: usize| {
        let (index, line) = largest?;
        (index > count as i64).then_some(ObjError::Index { line, index, count })
    };
    for line in Lines::new(file) {
        match line.kind {
            Kind::Vertex if !is_vertex(&line.words) => return Some(ObjError::Vertex(line.number)),
            Kind::Vertex => count += 1,
            Kind::Part => {
                if let Some(error) = out_of_range(largest.take(), count) {
                    return Some(error);
                }
            }
            Kind::Face => {
                for word in &line.words {
                    let Some(index) = parse::<i64>(word) else {
                        return Some(ObjError::Face(line.number));
                    };
                    if index == 0 || index < -(count as i64) {
                        return Some(ObjError::Index {
                            line: line.number,
                            index,
                            count,
                        });
                    }
                    if largest.is_none_or(|(largest, _)| index > largest) {
                        largest = Some((index, line.number));
                    }
                }
            }
        }
    }
    out_of_range(largest, count)
}

fn is_vertex(words: &[&[u8]]) -> bool {
    let finite = |word: &&[u8]| parse::<f32>(word).is_some_and(f32::is_finite);
    words.len() == 3 && words.iter().all(finite)
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(faces: &str) -> Result<TriangleMesh, ObjError> {
        read_obj(format!("{CORNERS}{faces}").as_bytes())
    }

    fn part(name: &str, triangles: std::ops::Range<usize>) -> Part {
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
    fn objects_and_groups_are_parts_by_name() {
        let mesh = read("f 1 2 3\no a\nf 1 2 3 4\ng b\nf 2 3 4\no a\nf 1 3 4\no empty\n").unwrap();
        assert_eq!(
            mesh.parts(),
            [part(UNNAMED, 0..1), part("a", 1..4), part("b", 4..5)]
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
        assert_eq!(error("f 1 2 5\no next\nv 1 1 1\n"), index(5, 5, 4));
        let far = "f 1 2 99999999999999999999";
        assert_eq!(error(far), ObjError::Face(5));
        assert_eq!(error("l 1 2"), ObjError::Mesh(MeshError::Empty));
        assert_eq!(read_obj(b"\xFF\xFEv\0"), Err(ObjError::Utf16));
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        assert!(read("f 1 2 5\nv 7 7 7\n").is_ok());
    }
}
