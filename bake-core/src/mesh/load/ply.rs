//! The reader of PLY files.

use std::io::BufRead;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::polygon::Triangulator;
use super::strip::strip;
use super::{Parsed, UNNAMED};
use crate::mesh::{MeshError, Part, TriangleMesh};

/// The reason that bytes are not a PLY mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlyError {
    /// The header or an element is malformed.
    #[error("{}{reason}", at_line(*.line))]
    Syntax {
        /// The line number, where the parser has one.
        line: Option<usize>,
        /// The parser's reason.
        reason: String,
    },
    /// The file declares more elements than it has bytes for.
    #[error("it declares {count} elements `{name}`, more than {length} bytes can hold")]
    Count {
        /// The element's name.
        name: String,
        /// The declared number.
        count: usize,
        /// The length of the file in bytes.
        length: usize,
    },
    /// There are no vertices with x, y and z.
    #[error("it has no element `vertex` with properties x, y and z")]
    NoVertices,
    /// A coordinate is missing or not finite.
    #[error("vertex {0} needs three finite coordinates")]
    Vertex(usize),
    /// A face refers to a vertex that does not exist.
    #[error("face {face} refers to vertex {index}, but there are {count}, from 0")]
    Index {
        /// The face's index.
        face: usize,
        /// The vertex index as written.
        index: i64,
        /// The number of vertices.
        count: usize,
    },
    /// The file can be parsed, but its triangles are not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

fn at_line(line: Option<usize>) -> String {
    line.map_or(String::new(), |line| format!("line {line}: "))
}

impl From<ParseError> for PlyError {
    fn from(error: ParseError) -> Self {
        let text = error.to_string();
        // The parser's further lines repeat the text, which may be long.
        let first = text.lines().next().unwrap_or_default();
        let reason = match error.line() {
            Some(line) => first.trim_start_matches(&format!("Line {line}: ")),
            None => first,
        };
        Self::Syntax {
            line: error.line(),
            reason: reason.to_lowercase(),
        }
    }
}

/// Reads the polygons and triangle strips of a PLY file as one part.
pub(super) fn parse(file: &[u8]) -> Result<Parsed, PlyError> {
    let mut reader = Reader::new(file);
    let header = Parser::<Vertex>::new().read_header(&mut reader)?;
    let mut positions = None;
    let mut polygons = Vec::new();
    let mut strips = Vec::new();
    for element in header.elements.values() {
        if element.count > max_count(element, &header, file.len()) {
            return Err(PlyError::Count {
                name: element.name.clone(),
                count: element.count,
                length: file.len(),
            });
        }
        match element.name.as_str() {
            "vertex" => {
                let vertices: Vec<Vertex> = elements(&mut reader, element, &header)?;
                positions = Some(vertices.into_iter().map(|v| v.0).collect::<Vec<_>>());
            }
            "face" => polygons = elements::<Corners, _>(&mut reader, element, &header)?,
            "tristrips" => strips = elements::<Corners, _>(&mut reader, element, &header)?,
            _ => drop(elements::<Ignored, _>(&mut reader, element, &header)?),
        }
    }
    let positions = positions.ok_or(PlyError::NoVertices)?;
    let finite = |p: &[f64; 3]| p.iter().all(|v| v.is_finite());
    if let Some(idx) = positions.iter().position(|p| !finite(p)) {
        return Err(PlyError::Vertex(idx));
    }
    let parsed = triangulated(&positions, &polygons, &strips)?;
    let is_single = header.elements.get("vertex").is_some_and(|vertex| {
        let mut coordinates = ["x", "y", "z"]
            .iter()
            .filter_map(|x| vertex.properties.get(*x));
        coordinates.any(|x| x.data_type == PropertyType::Scalar(ScalarType::Float))
    });
    Ok(match is_single {
        true => parsed.with_rounding_of(&positions),
        false => parsed,
    })
}

fn triangulated(
    positions: &[[f64; 3]],
    polygons: &[Corners],
    strips: &[Corners],
) -> Result<Parsed, PlyError> {
    let index = |face: usize, index: i64| match u32::try_from(index) {
        Ok(corner) if (corner as usize) < positions.len() => Ok(corner),
        _ => Err(PlyError::Index {
            face,
            index,
            count: positions.len(),
        }),
    };
    let mut triangulator = Triangulator::new();
    let mut triangles = Vec::with_capacity(polygons.len());
    for (face, polygon) in polygons.iter().enumerate() {
        let corners = polygon.0.iter().map(|&v| index(face, v));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        let cut = triangulator.triangulate(corners.iter().map(|&v| positions[v as usize]));
        triangles.extend(cut.map(|t| t.map(|corner| corners[corner as usize])));
    }
    // A strip ends at −1.
    let strips = strips.iter().flat_map(|strip| strip.0.split(|&v| v == -1));
    for (face, vertices) in strips.enumerate() {
        let vertices = vertices.iter().map(|&v| index(face, v));
        triangles.extend(strip(&vertices.collect::<Result<Vec<_>, _>>()?));
    }
    let whole = Part {
        name: UNNAMED.to_owned(),
        triangles: 0..triangles.len(),
    };
    let mesh = TriangleMesh::from_f64(positions, triangles, vec![whole])?;
    Ok(Parsed::new(mesh, triangulator.warnings()))
}

/// Returns an upper bound of an element's count: the length of the file, which holds at least a byte
/// of each, by the smallest size of one.
fn max_count(element: &ElementDef, header: &Header, length: usize) -> usize {
    let size = |property: &PropertyType| match property {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => bytes(scalar),
    };
    match header.encoding {
        Encoding::Ascii => length,
        _ => {
            let sizes = element.properties.values().map(|p| size(&p.data_type));
            length.checked_div(sizes.sum()).unwrap_or(0)
        }
    }
}

fn bytes(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

fn elements<E: PropertyAccess, T: BufRead>(
    reader: &mut Reader<T>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, PlyError> {
    Ok(Parser::new().read_payload_for_element(reader, element, header)?)
}

/// A vertex's position; NaN where a coordinate is missing.
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        let value = match value {
            Property::Double(value) => Some(value),
            // All other scalars are exact in single floats, but for large integers.
            Property::Int(value) => Some(value.into()),
            Property::UInt(value) => Some(value.into()),
            other => other.to_f32_lossy().map(f64::from),
        };
        match value {
            Some(value) => {
                self.0[axis] = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }
}

/// The vertex indices of a face or strip.
struct Corners(Vec<i64>);

impl PropertyAccess for Corners {
    fn new() -> Self {
        Self(vec![])
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match value {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that a mesh does not need.
struct Ignored;

impl PropertyAccess for Ignored {
    fn new() -> Self {
        Self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 4\nproperty double x\nproperty float y\n\
        property short z\nproperty uchar red\nelement face 1\nproperty list uchar int \
        vertex_indices\nend_header\n";

    fn ascii(vertices: &str, faces: &str) -> Vec<u8> {
        format!("ply\nformat ascii 1.0\ncomment x\n{HEADER}{vertices}{faces}").into_bytes()
    }

    const VERTICES: &str = "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n";

    fn binary(big_endian: bool) -> Vec<u8> {
        let name = if big_endian { "big" } else { "little" };
        let mut file = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
        macro_rules! push {
            ($value:expr) => {
                file.extend(match big_endian {
                    true => $value.to_be_bytes(),
                    false => $value.to_le_bytes(),
                })
            };
        }
        for (x, y) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
            push!(f64::from(x));
            push!(y as f32);
            push!(0_i16);
            file.push(9);
        }
        file.push(4);
        for corner in 0..4_i32 {
            push!(corner);
        }
        file
    }

    #[test]
    fn all_encodings_give_the_same_mesh() {
        let square = parse(&ascii(VERTICES, "4 0 1 2 3\n")).unwrap().mesh;
        assert_eq!(square.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(square.bounds().max, [1.0, 1.0, 0.0]);
        for big_endian in [false, true] {
            assert_eq!(parse(&binary(big_endian)).unwrap().mesh, square);
        }
    }

    #[test]
    fn double_coordinates_keep_their_precision() {
        let far = VERTICES
            .replace("\n1 ", "\n4500000.25 ")
            .replace("0 0 0", "4500000 0 0");
        let far = far.replace("\n0 1", "\n4500000 1");
        let mesh = parse(&ascii(&far, "4 0 1 2 3\n")).unwrap().mesh;
        assert_eq!(mesh.bounds().half_extents(), [0.125, 0.5, 0.0]);
        assert_eq!(mesh.origin()[0], 4_500_000.125);
    }

    #[test]
    fn strips_end_at_minus_one() {
        let header = HEADER
            .replace("face", "tristrips")
            .replace("list uchar", "list int");
        let file = format!("ply\nformat ascii 1.0\n{header}{VERTICES}8 0 1 3 2 -1 0 1 2\n");
        let mesh = parse(file.as_bytes()).unwrap().mesh;
        assert_eq!(mesh.triangles(), [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
    }

    #[test]
    fn broken_files_are_refused_in_one_line() {
        let error = |file: &[u8]| {
            let error = parse(file).err().unwrap();
            assert!(!error.to_string().contains('\n'), "{error}");
            error
        };
        let index = PlyError::Index {
            face: 0,
            index: 4,
            count: 4,
        };
        assert_eq!(error(&ascii(VERTICES, "3 0 1 4\n")), index);
        let infinite = VERTICES.replace("1 1 0", "1e999 1 0");
        assert_eq!(error(&ascii(&infinite, "3 0 1 2\n")), PlyError::Vertex(2));
        let word = error(&ascii(VERTICES, "3 0 x 4\n"));
        assert!(matches!(word, PlyError::Syntax { .. }), "{word}");
        let missing = error(&ascii(VERTICES, ""));
        assert!(matches!(missing, PlyError::Syntax { .. }), "{missing}");
        let little = binary(false);
        assert!(matches!(
            error(&little[..little.len() - 1]),
            PlyError::Syntax { .. }
        ));
        let none = b"ply\nformat ascii 1.0\nend_header\n";
        assert_eq!(error(none), PlyError::NoVertices);
        // A count that would take a day to loop over.
        for format in ["ascii", "binary_little_endian"] {
            let many = format!("ply\nformat {format} 1.0\nelement x 99999999999999\nend_header\n");
            assert!(matches!(error(many.as_bytes()), PlyError::Count { .. }));
        }
    }

    #[test]
    fn broken_files_give_a_mesh_or_an_error() {
        for file in [ascii(VERTICES, "4 0 1 2 3\n"), binary(false), binary(true)] {
            super::super::load_all_broken("a.ply", &file);
        }
    }
}
