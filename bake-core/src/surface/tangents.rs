//! Tangent frames: those of the file, or as MikkTSpace makes them (Mikkelsen, *Simulation of Wrinkled
//! Surfaces Revisited*, 2008), which engines agree on.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};

use super::texels::face_normal;
use super::vector::{cross, dot, plus};
use super::{TexelPoints, VertexGroups};
use crate::TriangleMesh;

/// The tangent frames of all triangles' corners: x along u, y against v (up in the picture, as OpenGL
/// and glTF have it), z along the normal.
#[derive(Clone, Debug)]
pub struct TangentFrames {
    /// Tangents, and in the fourth number the sign of the bitangent, sign · normal × tangent.
    tangents: Vec<[[f32; 4]; 3]>,
    normals: Vec<[[f32; 3]; 3]>,
}

/// The tangent of a corner that has none: its triangle has no area in the texture.
const NO_TANGENT: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

impl TangentFrames {
    /// Returns the frames with the tangents that a file gives its vertices.
    pub fn given(mesh: &TriangleMesh, groups: &VertexGroups, tangents: &[[f32; 4]]) -> Self {
        let of_vertex = |vertex: u32| tangents[vertex as usize];
        Self {
            tangents: mesh.triangles().iter().map(|t| t.map(of_vertex)).collect(),
            normals: normals(mesh, groups),
        }
    }

    /// Returns the frames of MikkTSpace for texture coordinates with v downward.
    pub fn generated(mesh: &TriangleMesh, groups: &VertexGroups, coordinates: &[[f32; 2]]) -> Self {
        let mut generator = Generator {
            mesh,
            coordinates,
            frames: Self {
                tangents: vec![[NO_TANGENT; 3]; mesh.triangles().len()],
                normals: normals(mesh, groups),
            },
        };
        // It fails for meshes without triangles alone, which are none.
        let _ = generate_tangents(&mut generator);
        generator.frames
    }

    /// Returns the direction of a point in its tangent frame, of any length: a shader that adds up the
    /// interpolated tangent, bitangent and normal by it gets a vector along `direction`.
    pub fn encode(&self, points: &TexelPoints, idx: usize, direction: [f64; 3]) -> [f64; 3] {
        let triangle = points.triangles[idx] as usize;
        let weights = points.weights[idx].map(f64::from);
        let (mut tangent, mut normal, mut sign) = ([0.0; 3], [0.0; 3], 0.0);
        for (corner, weight) in weights.into_iter().enumerate() {
            let [x, y, z, w] = self.tangents[triangle][corner].map(f64::from);
            tangent = plus(tangent, weight, [x, y, z]);
            normal = plus(
                normal,
                weight,
                self.normals[triangle][corner].map(f64::from),
            );
            sign += weight * w;
        }
        let bitangent = cross(normal, tangent).map(|v| v * sign.signum());
        // The inverse by cofactors; its determinant is above zero times the sign.
        let columns = [
            cross(bitangent, normal),
            cross(normal, tangent),
            cross(tangent, bitangent),
        ];
        let det = dot(tangent, columns[0]);
        columns.map(|column| dot(column, direction) * det.signum())
    }
}

/// Returns the normals of all triangles' corners, which the axes of texels are interpolated from.
fn normals(mesh: &TriangleMesh, groups: &VertexGroups) -> Vec<[[f32; 3]; 3]> {
    let of_triangle = |(idx, triangle): (u32, &[u32; 3])| {
        let face = face_normal(mesh, idx).unwrap_or([0.0, 1.0, 0.0]);
        triangle.map(|v| {
            let normal = groups.normal(v as usize).unwrap_or(face);
            normal.map(|v| v as f32)
        })
    };
    (0..).zip(mesh.triangles()).map(of_triangle).collect()
}

/// The mesh as MikkTSpace reads it.
struct Generator<'a> {
    mesh: &'a TriangleMesh,
    coordinates: &'a [[f32; 2]],
    frames: TangentFrames,
}

impl Generator<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles()[face][corner] as usize
    }
}

impl Geometry for Generator<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles().len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions()[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.frames.normals[face][corner]
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let [u, v] = self.coordinates[self.vertex(face, corner)];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map_or(NO_TANGENT, |space| space.tangent_encoded());
        self.frames.tangents[face][corner] = tangent;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Part;
    use crate::surface::{TexelSampling, normalized, texel_points};

    /// Two squares, whose textures are mirror images of each other.
    #[test]
    fn directions_come_back_through_the_frames_also_in_mirrored_charts() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let at = |x: f32| positions.map(|[u, v]| [u + x, v, 0.3 * u * v]);
        let positions_all = [at(0.0), at(2.0)].concat();
        let chart = |flip: f32, x: f32| positions.map(|[u, v]| [x + flip * 0.4 * u, 0.9 - 0.8 * v]);
        let coordinates = [chart(1.0, 0.05), chart(-1.0, 0.95)].concat();
        let whole = Part {
            name: "two".into(),
            triangles: 0..4,
        };
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let mesh = TriangleMesh::new(positions_all, triangles, vec![whole]).unwrap();
        let groups = VertexGroups::new(&mesh, Some(vec![[0.1, -0.2, 1.0]; 8]));
        let sampling = TexelSampling {
            size: 16,
            per_side: 1,
        };
        let points = texel_points(&mesh, &groups, &coordinates, sampling, 0.0);
        let frames = TangentFrames::generated(&mesh, &groups, &coordinates);
        let right = normalized([1.0, 0.0, 0.1]).unwrap();
        for (idx, &texel) in points.texels.iter().enumerate() {
            let [x, y, z] = normalized(frames.encode(&points, idx, right)).unwrap();
            // The texture's x runs along the square's, or against it where it is mirrored.
            let along = if texel % 16 < 8 { x } else { -x };
            assert!(along > 0.7, "{along}");
            // Up in the square is up in the picture.
            let up = normalized(frames.encode(&points, idx, [0.0, 1.0, 0.0])).unwrap();
            assert!(up[1] > 0.7, "{up:?}");
            // Decoded as a shader does it.
            let triangle = points.triangles[idx] as usize;
            let (mut t, mut n) = ([0.0; 3], [0.0; 3]);
            let mut sign = 0.0;
            for corner in 0..3 {
                let weight = f64::from(points.weights[idx][corner]);
                let [a, b, c, w] = frames.tangents[triangle][corner].map(f64::from);
                t = plus(t, weight, [a, b, c]);
                n = plus(n, weight, frames.normals[triangle][corner].map(f64::from));
                sign += weight * w;
            }
            let b = cross(n, t).map(|v| v * sign);
            let sum = plus(plus(t.map(|v| v * x), y, b), z, n);
            let decoded = normalized(sum).unwrap();
            assert!(dot(decoded, right) > 1.0 - 1e-9, "{decoded:?}");
        }
    }
}
