//! Wavefront OBJ.
//!
//! The tobj crate parses; [`LineReader`] feeds it geometry alone, and when it refuses a file,
//! this module finds the line.

use tobj::LoadOptions;

use super::obj_lines::{Kind, LineReader, Lines};
use super::polygon::Triangulator;
use super::{MeshError, Part, TriangleMesh};

/// The name of a part that the file does not name.
const UNNAMED: &str = "unnamed";

/// Why text is no OBJ mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A `v` line without three finite coordinates.
    #[error("line {0}: a vertex needs three finite numbers")]
    Vertex(usize),
    /// An `f` line with something else than indices.
    #[error("line {0}: a face holds something that is not a vertex index")]
    Face(usize),
    /// An `f` line that names a vertex that the file does not have.
    #[error("line {line}: a face refers to vertex {index}; 1 to {count} and -{count} to -1 exist")]
    Index {
        /// The line.
        line: usize,
        /// The index as written: 1 is the first vertex, −1 the one before the face.
        index: i64,
        /// How many vertices a face there can refer to.
        count: usize,
    },
    /// UTF-16, most likely.
    #[error("it is not plain text but UTF-16: save it as UTF-8")]
    Utf16,
    /// The parser refused it for a reason that is not one of the above.
    #[error("line {line}: {reason}")]
    Parser {
        /// The line that the parser had got to.
        line: usize,
        /// The parser's words.
        reason: String,
    },
    /// It parses, but what it holds is not a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Reads the triangles of an OBJ file: polygons are cut (concave ones properly), each object or
/// group becomes a part, points, lines, normals, texture coordinates and materials are ignored.
///
/// # Errors
///
/// The first line that is wrong, or a file without faces.
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
            return Err(find_fault(file).unwrap_or(ObjError::Parser { line, reason }));
        }
    };
    if let Some(line) = reader.not_finite() {
        return Err(ObjError::Vertex(line));
    }
    let (positions, triangles, parts) = assemble(models);
    Ok(TriangleMesh::new(positions, triangles, parts)?)
}

type Assembled = (Vec<[f32; 3]>, Vec<[u32; 3]>, Vec<Part>);

/// Joins the parser's models into one mesh. Models of the same name are one part.
fn assemble(mut models: Vec<tobj::Model>) -> Assembled {
    // The order of first appearance, kept by a stable sort over it.
    let mut names: Vec<String> = Vec::new();
    let mut seen = std::collections::HashMap::new();
    for model in &models {
        seen.entry(model.name.clone()).or_insert_with(|| {
            names.push(model.name.clone());
            names.len()
        });
    }
    models.sort_by_key(|model| seen[&model.name]);

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
        triangles.extend(cut.map(|t| t.map(|corner| base + polygon[corner as usize])));
    };
    if mesh.face_arities.is_empty() {
        mesh.indices.chunks_exact(3).for_each(push_polygon);
        return;
    }
    let mut rest = &mesh.indices[..];
    for &arity in &mesh.face_arities {
        let (polygon, behind) = rest.split_at(arity as usize);
        push_polygon(polygon);
        rest = behind;
    }
}

/// The first line that makes the file unreadable, if it is one of those we know to look for.
fn find_fault(file: &[u8]) -> Option<ObjError> {
    let mut count = 0;
    // Faces may name vertices further down, up to the end of their part.
    let mut furthest: Option<(i64, usize)> = None;
    let too_far = |furthest: Option<(i64, usize)>, count: usize| {
        let (index, line) = furthest?;
        (index > count as i64).then_some(ObjError::Index { line, index, count })
    };
    for line in Lines::new(file) {
        match line.kind {
            Kind::Vertex if !is_vertex(&line.words) => return Some(ObjError::Vertex(line.number)),
            Kind::Vertex => count += 1,
            Kind::Part => {
                if let Some(fault) = too_far(furthest.take(), count) {
                    return Some(fault);
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
                    if furthest.is_none_or(|(far, _)| index > far) {
                        furthest = Some((index, line.number));
                    }
                }
            }
        }
    }
    too_far(furthest, count)
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
    fn points_lines_and_materials_are_nothing() {
        let mesh =
            read("mtllib no.mtl\nusemtl x\nusemtl y\np 1 2\nl 1 2 3\nf 1\nf 1 2\nf 1 2 3\nf");
        assert_eq!(mesh.unwrap().triangles().len(), 1);
    }

    #[test]
    fn weights_and_colours_do_not_move_vertices() {
        let file = "v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 0\nv 0 2 2 1 0 0\nv 5 5 5 1 2 3 4\nf 1 2 3\nf 1 2 4\nf 1 2 5";
        let mesh = read_obj(file.as_bytes()).unwrap();
        assert_eq!(mesh.bounds().max, [5.0; 3]);
        assert_eq!(mesh.corners().next().unwrap()[1], [2.0, 0.0, 0.0]);
    }

    #[test]
    fn broken_texture_coordinates_do_not_matter() {
        assert!(read("vt x\nvn nan nan nan\nf 1/9/9 2/-7 3//0").is_ok());
    }

    #[test]
    fn faults_name_their_line() {
        let fault = |faces: &str| read(faces).unwrap_err();
        for vertex in [
            "v 1 2",
            "v nan 0 0",
            "v -nan 0 0",
            "v 1e99 0 0",
            "v 1,5 0 0",
        ] {
            // Used or not: a file with such a vertex is broken.
            let file = format!("{vertex}\nf 1 2 5");
            assert_eq!(fault(&file), ObjError::Vertex(5), "{vertex}");
            let unused = format!("{vertex}\nf 1 2 3");
            assert_eq!(fault(&unused), ObjError::Vertex(5), "{vertex}");
        }
        assert_eq!(fault("f 1 2 3\nf 1 2 x"), ObjError::Face(6));
        assert_eq!(fault("f 1 2 3\nf 1 2 /3"), ObjError::Face(6));
        let index = |line, index, count| ObjError::Index { line, index, count };
        assert_eq!(fault("f 1 2 5"), index(5, 5, 4));
        assert_eq!(fault("f 1 2 0"), index(5, 0, 4));
        assert_eq!(fault("\nf 1 2 -5"), index(6, -5, 4));
        assert_eq!(fault("f 1 2 5\no next\nv 1 1 1\n"), index(5, 5, 4));
        let far = "f 1 2 99999999999999999999";
        assert_eq!(fault(far), ObjError::Face(5));
        assert_eq!(fault("l 1 2"), ObjError::Mesh(MeshError::Empty));
        assert_eq!(read_obj(b"\xFF\xFEv\0"), Err(ObjError::Utf16));
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        assert!(read("f 1 2 5\nv 7 7 7\n").is_ok());
    }
}
