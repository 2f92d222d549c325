//! The reader of STL files, binary and ASCII.
//!
//! It is our own: libraries read the numbers of ASCII files in single precision, too coarse for a
//! model at map coordinates.

use super::parts::unique_names;
use super::{Parsed, UNNAMED};
use crate::mesh::{MeshError, Part, TriangleMesh};

/// The bytes of a binary file before its triangles: a comment and their count.
const HEADER: usize = 84;

/// The bytes of a triangle in a binary file: its normal, three corners and two bytes of attributes.
const RECORD: usize = 50;

/// The reason that bytes are not an STL mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StlError {
    /// A `vertex` line of an ASCII file does not have three finite coordinates.
    #[error("line {0}: a vertex needs three finite numbers")]
    Vertex(usize),
    /// A facet of an ASCII file does not have three vertices.
    #[error("line {line}: a facet has {corners} vertices, not three")]
    Corners {
        /// The number of the line that ends the facet.
        line: usize,
        /// The number of its vertices.
        corners: usize,
    },
    /// An ASCII file ends within a solid.
    #[error("the file ends before `endsolid`")]
    Unfinished,
    /// The length of a binary file does not match its count of triangles.
    #[error("{count} triangles need {needed} bytes, but the file has {length}")]
    Length {
        /// The count in the header.
        count: u32,
        /// The length that the count asks for, in bytes.
        needed: u64,
        /// The file's length in bytes.
        length: u64,
    },
    /// The file has no whole header.
    #[error("the file is too short: a binary STL file has at least {HEADER} bytes")]
    Header,
    /// The file can be parsed, but its triangles are not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Reads the triangles of an STL file; each solid of an ASCII file becomes a part.
pub(super) fn parse(file: &[u8]) -> Result<Parsed, StlError> {
    let count = file
        .get(HEADER - 4..HEADER)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("the slice has four bytes")));
    let needed = count.map(|count| HEADER as u64 + RECORD as u64 * u64::from(count));
    // Binary files may start with the word, too, and are told by their length.
    let is_binary = needed == Some(file.len() as u64);
    let is_ascii = file.trim_ascii_start().starts_with(b"solid") && !is_binary;
    let solids = match is_ascii {
        true => ascii(file)?,
        false => match count {
            Some(count) => vec![binary(file, count)?],
            None => return Err(StlError::Header),
        },
    };
    let mut positions: Vec<[f64; 3]> = Vec::new();
    let mut parts = Vec::new();
    for solid in solids.into_iter().filter(|solid| !solid.corners.is_empty()) {
        let start = positions.len() / 3;
        positions.extend(solid.corners);
        parts.push(Part {
            name: solid.name,
            triangles: start..positions.len() / 3,
        });
    }
    unique_names(&mut parts);
    let indices: Vec<u32> = (0..positions.len() as u32).collect();
    let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
    let mesh = TriangleMesh::from_f64(&positions, triangles.collect(), parts)?;
    let parsed = Parsed::new(mesh, vec![]);
    Ok(match is_ascii {
        true => parsed,
        false => parsed.with_rounding_of(&positions),
    })
}

/// A named list of corners, three a triangle.
struct Solid {
    name: String,
    corners: Vec<[f64; 3]>,
}

fn binary(file: &[u8], count: u32) -> Result<Solid, StlError> {
    let needed = HEADER as u64 + RECORD as u64 * u64::from(count);
    // Some writers append data of their own.
    if needed > file.len() as u64 {
        return Err(StlError::Length {
            count,
            needed,
            length: file.len() as u64,
        });
    }
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("there are four"));
    let corner =
        |bytes: &[u8]| std::array::from_fn(|x| f64::from(number(&bytes[4 * x..4 * x + 4])));
    let records = file[HEADER..needed as usize].chunks_exact(RECORD);
    Ok(Solid {
        name: UNNAMED.to_owned(),
        corners: records
            .flat_map(|record| record[12..48].chunks_exact(12).map(corner))
            .collect(),
    })
}

fn ascii(file: &[u8]) -> Result<Vec<Solid>, StlError> {
    let mut solids: Vec<Solid> = Vec::new();
    let mut is_open = false;
    for (number, line) in (1..).zip(file.split(|b| *b == b'\n')) {
        let text = String::from_utf8_lossy(line);
        let (keyword, rest) = text
            .trim()
            .split_once(char::is_whitespace)
            .unwrap_or((text.trim(), ""));
        match (keyword, solids.last_mut()) {
            ("solid", _) => {
                let name = match rest.trim() {
                    "" => UNNAMED,
                    name => name,
                };
                solids.push(Solid {
                    name: name.to_owned(),
                    corners: vec![],
                });
                is_open = true;
            }
            ("vertex", Some(solid)) => {
                let corner = vertex(rest).ok_or(StlError::Vertex(number))?;
                solid.corners.push(corner);
            }
            ("endfacet", Some(solid)) => {
                let corners = solid.corners.len() % 3;
                if corners != 0 {
                    return Err(StlError::Corners {
                        line: number,
                        corners,
                    });
                }
            }
            ("endsolid", _) => is_open = false,
            _ => {}
        }
    }
    match is_open {
        true => Err(StlError::Unfinished),
        false => Ok(solids),
    }
}

fn vertex(words: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = words
        .split_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    let numbers = <[f64; 3]>::try_from(numbers?).ok()?;
    numbers.iter().all(|v| v.is_finite()).then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACET: &str = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  \
        vertex 0 1 0.5\n endloop\nendfacet\n";

    fn binary_file(corners: &[[f32; 3]]) -> Vec<u8> {
        let mut file = b"solid, but binary".to_vec();
        file.resize(80, 0);
        file.extend((corners.len() as u32 / 3).to_le_bytes());
        for triangle in corners.chunks_exact(3) {
            file.extend([0; 12]);
            file.extend(triangle.iter().flatten().flat_map(|v| v.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    /// Found by fuzzing: a vertex outside any triangle was beyond single floats, and so infinite.
    #[test]
    fn unused_vertices_are_finite() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [9e99, 0.0, 0.0]];
        let part = Part {
            name: "a".into(),
            triangles: 0..1,
        };
        let mesh = TriangleMesh::from_f64(&corners, vec![[0, 1, 2]], vec![part]).unwrap();
        assert!(mesh.positions().iter().flatten().all(|v| v.is_finite()));
    }

    #[test]
    fn both_forms_give_the_same_triangles() {
        let text = format!("solid a b\n{FACET}endsolid a b\n");
        let ascii = parse(text.as_bytes()).unwrap().mesh;
        assert_eq!(ascii.parts()[0].name, "a b");
        let file = binary_file(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]);
        let binary = parse(&file).unwrap().mesh;
        assert_eq!(ascii.positions(), binary.positions());
        assert_eq!(binary.triangles(), [[0, 1, 2]]);
    }

    #[test]
    fn solids_are_parts() {
        let text =
            format!("solid a\n{FACET}endsolid\nsolid\nendsolid\nsolid a\n{FACET}{FACET}endsolid");
        let mesh = parse(text.as_bytes()).unwrap().mesh;
        let parts: Vec<_> = mesh
            .parts()
            .iter()
            .map(|p| (p.name.as_str(), p.triangles.len()))
            .collect();
        assert_eq!(parts, [("a", 1), ("a~2", 2)]);
    }

    #[test]
    fn broken_files_are_refused() {
        let error = |file: &[u8]| parse(file).err().unwrap();
        assert_eq!(error(b""), StlError::Header);
        assert_eq!(
            error(b"solid a\nendsolid"),
            StlError::Mesh(MeshError::Empty)
        );
        assert_eq!(
            error(format!("solid a\n{FACET}").as_bytes()),
            StlError::Unfinished
        );
        assert_eq!(
            error(b"solid a\nvertex 1 nan 3\nendsolid"),
            StlError::Vertex(2)
        );
        let open = b"solid a\nvertex 1 2 3\nendfacet\nendsolid";
        assert_eq!(
            error(open),
            StlError::Corners {
                line: 3,
                corners: 1
            }
        );
        let whole = binary_file(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]);
        let mut cut = whole[..whole.len() - 1].to_vec();
        cut[..5].copy_from_slice(b"other");
        let length = StlError::Length {
            count: 1,
            needed: 134,
            length: 133,
        };
        assert_eq!(error(&cut), length);
    }

    #[test]
    fn broken_files_give_a_mesh_or_an_error() {
        let file = binary_file(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]);
        super::super::load_all_broken("a.stl", &file);
        let text = format!("solid a\n{FACET}endsolid a\n");
        super::super::load_all_broken("a.stl", text.as_bytes());
    }
}
