//! The objects, the floor and the glass.

use std::error::Error;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Preset, UNOBSERVED};
use aogrid_grid_format::{Grid, Source};
use aogrid_runtime::Instance;
use glam::{Mat4, Vec3};

/// Position and normal.
pub type Vertex = [[f32; 3]; 2];

/// The grids, the instances with the index of their grid, and all opaque triangles in world space.
pub type Models = (Vec<Grid>, Vec<(usize, Instance)>, Vec<Vertex>);

/// Returns a ring of objects on a floor, with their baked grids.
pub fn models() -> Result<Models, Box<dyn Error>> {
    const COUNT: usize = 16;
    let meshes = [Model::Torus.mesh(None)?, Model::Table.mesh(None)?];
    let mut grids = vec![];
    for mesh in &meshes {
        let (placement, options) = (Preset::Default.placement(), Preset::Default.options());
        let source = Source {
            name: "sample".into(),
            part: None,
            blake3: "0".repeat(64),
            triangles: mesh.triangles().len() as u64,
        };
        grids.push(aogrid_baker_cpu::bake_grid(
            mesh, &placement, &options, source, UNOBSERVED,
        )?);
    }
    let (mut occluders, mut vertices) = (vec![], vec![]);
    vertices.extend(quad(
        [
            Vec3::new(-4.0, 0.0, 4.0),
            Vec3::new(4.0, 0.0, 4.0),
            Vec3::new(4.0, 0.0, -4.0),
        ],
        Vec3::Y,
    ));
    for i in 0..COUNT {
        let angle = i as f32 / COUNT as f32 * std::f32::consts::TAU;
        let ring = if i % 2 == 0 { 1.45 } else { 0.8 };
        let at = Vec3::new(ring * angle.cos(), 0.0, ring * angle.sin());
        let world_from_object = Mat4::from_translation(at)
            * Mat4::from_rotation_y(angle)
            * Mat4::from_scale(Vec3::splat(0.32));
        occluders.push((i % 2, Instance::at(world_from_object.to_cols_array_2d())));
        for corners in meshes[i % 2].corners() {
            let [a, b, c] = corners.map(|p| world_from_object.transform_point3(p.into()));
            let n = (b - a).cross(c - a).normalize_or_zero();
            vertices.extend([a, b, c].map(|p| [p.to_array(), n.to_array()]));
        }
    }
    Ok((grids, occluders, vertices))
}

/// Returns a pane across the ring that faces +z.
pub fn pane() -> [Vertex; 6] {
    let [left, right, bottom, top, z] = [-1.1, 1.1, 0.02, 0.7, 0.54];
    let corners = [
        Vec3::new(left, bottom, z),
        Vec3::new(right, bottom, z),
        Vec3::new(right, top, z),
    ];
    quad(corners, Vec3::Z)
}

/// Returns the triangles of a parallelogram, given three of its corners.
fn quad([a, b, c]: [Vec3; 3], normal: Vec3) -> [Vertex; 6] {
    let d = a + c - b;
    [a, b, c, a, c, d].map(|p| [p.to_array(), normal.to_array()])
}
