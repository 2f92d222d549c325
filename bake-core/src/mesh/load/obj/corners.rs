//! Texture coordinates and normals of the corners of faces.

use std::collections::HashMap;

use super::lines::{Kind, Line};
use super::{ObjError, parse_number};

/// No index.
const NONE: u32 = u32::MAX;

/// The attributes of corners, and of the vertices that they become.
#[derive(Default)]
pub(super) struct Attributes {
    coordinates: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// The indices of each corner's coordinates and normal.
    corners: Vec<[u32; 2]>,
    /// The same of each vertex, once corners are split into vertices.
    vertices: Vec<[u32; 2]>,
}

impl Attributes {
    /// Adds a line of coordinates or of a normal. A malformed one is zero, so that others keep their
    /// numbers.
    pub(super) fn line(&mut self, line: &Line<'_>) {
        let number = |idx: usize| {
            let word = line.words.get(idx)?;
            parse_number::<f32>(word).filter(|v| v.is_finite())
        };
        let number = |idx| number(idx).unwrap_or(0.0);
        match line.kind {
            // v is upward in OBJ files.
            Kind::Coordinates => self.coordinates.push([number(0), 1.0 - number(1)]),
            _ => self.normals.push([0, 1, 2].map(number)),
        }
    }

    /// Adds a corner, as in `7/1/3`.
    pub(super) fn corner(&mut self, word: &[u8]) {
        let counts = [self.coordinates.len(), self.normals.len()];
        let mut indices = word.split(|b| *b == b'/').skip(1);
        let corner = counts.map(|count| {
            let index = indices.next().and_then(parse_number::<i64>);
            let from_zero = match index {
                None | Some(0) => return NONE,
                Some(index @ 1..) => index - 1,
                Some(index) => index + count as i64,
            };
            u32::try_from(from_zero).unwrap_or(NONE)
        });
        self.corners.push(corner);
    }

    /// Makes a vertex of each position with different attributes. `line_of` returns the line of a corner.
    pub(super) fn split(
        &mut self,
        positions: &mut Vec<[f64; 3]>,
        corners: &mut [u32],
        line_of: impl Fn(usize) -> usize,
    ) -> Result<(), ObjError> {
        let mut known = HashMap::new();
        let mut split = Vec::new();
        for (idx, (corner, &[coordinates, normal])) in
            corners.iter_mut().zip(&self.corners).enumerate()
        {
            if coordinates as usize >= self.coordinates.len() {
                return Err(ObjError::NoCoordinates(line_of(idx)));
            }
            let normal = if (normal as usize) < self.normals.len() {
                normal
            } else {
                NONE
            };
            let next = split.len() as u32;
            let vertex = *known.entry([*corner, coordinates, normal]).or_insert(next);
            if vertex == next {
                split.push(positions[*corner as usize]);
                self.vertices.push([coordinates, normal]);
            }
            *corner = vertex;
        }
        *positions = split;
        Ok(())
    }

    /// Returns the coordinates and the normals of all vertices.
    pub(super) fn of_vertices(self) -> (Vec<[f32; 2]>, Option<Vec<[f32; 3]>>) {
        let coordinates = self
            .vertices
            .iter()
            .map(|[at, _]| self.coordinates[*at as usize]);
        let normal = |idx: u32| self.normals.get(idx as usize).copied().unwrap_or([0.0; 3]);
        let any = self.vertices.iter().any(|[_, normal]| *normal != NONE);
        let normals = any.then(|| self.vertices.iter().map(|[_, at]| normal(*at)).collect());
        (coordinates.collect(), normals)
    }
}
