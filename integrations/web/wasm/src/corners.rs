//! Corners of triangles with normals for display: smooth over what is about flat, sharp at creases.

use std::collections::HashMap;

use aogrid_bake_core::TriangleMesh;
use glam::Vec3;

/// The cosine of the largest angle between faces that share a smooth normal: 40 degrees.
const CREASE_COSINE: f32 = 0.766;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// The position, relative to the mesh's origin.
    pub position: [f32; 3],
    /// The unit normal; zero for a triangle without an area.
    pub normal: [f32; 3],
}

/// Returns three corners for each triangle.
pub fn of(mesh: &TriangleMesh) -> Vec<Corner> {
    let positions = mesh.positions();
    let faces: Vec<_> = mesh.triangles().iter().collect();
    let normals: Vec<Vec3> = mesh.corners().map(area_normal).collect();
    let mut faces_at: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    for (face, corners) in (0..).zip(&faces) {
        for &vertex in *corners {
            faces_at
                .entry(key(positions[vertex as usize]))
                .or_default()
                .push(face);
        }
    }
    let mut all = Vec::with_capacity(3 * faces.len());
    for (face, corners) in faces.iter().enumerate() {
        for &vertex in *corners {
            let position = positions[vertex as usize];
            let own = normals[face].normalize_or_zero();
            let is_smooth = |other: &&u32| {
                own.dot(normals[**other as usize].normalize_or_zero()) > CREASE_COSINE
            };
            let around = faces_at[&key(position)].iter().filter(is_smooth);
            let sum: Vec3 = around.map(|&other| normals[other as usize]).sum();
            all.push(Corner {
                position,
                normal: sum.try_normalize().unwrap_or(own).to_array(),
            });
        }
    }
    all
}

/// Returns the normal of a triangle with twice its area as its length.
fn area_normal([a, b, c]: [[f32; 3]; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(Vec3::from);
    (b - a).cross(c - a)
}

/// Returns what is equal for equal positions; both zeros are.
fn key(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}
