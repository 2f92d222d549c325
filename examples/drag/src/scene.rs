//! The scene: a robot and a table on a floor, and the grids of both objects.

use std::error::Error;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Preset, TriangleMesh, UNOBSERVED};
use aogrid_grid_format::{Grid, Source};
use glam::Vec3;

/// Position, object id and normal; object 0 is the one that moves.
pub type Vertex = [f32; 7];

/// Half the side length of the floor.
pub const FLOOR: f32 = 3.0;

/// The table's position.
pub const TABLE: Vec3 = Vec3::new(1.5, 0.0, -0.9);

/// Returns the vertices of robot, table and floor, and the grids of both objects, which it bakes.
pub fn models() -> Result<(Vec<Vertex>, Vec<Grid>), Box<dyn Error>> {
    let [robot, table] = [Model::Robot, Model::Table].map(|sample| sample.mesh(None));
    let (robot, table) = (robot?, table?);
    let f = FLOOR;
    let corners = [[-f, 0.0, f], [f, 0.0, f], [f, 0.0, -f], [-f, 0.0, -f]];
    let [a, b, c, d] = corners;
    let floor = [[a, b, c], [a, c, d]];
    let moved_table = table
        .corners()
        .map(|corners| corners.map(|p| (Vec3::from(p) + TABLE).to_array()));
    let robot_and_table = robot
        .corners()
        .map(|t| (t, 0))
        .chain(moved_table.map(|t| (t, 1)));
    let all = robot_and_table.chain(floor.map(|t| (t, 2)));
    let all = all
        .flat_map(|(triangle, id)| vertices(triangle, id))
        .collect();
    Ok((
        all,
        vec![bake(&robot, Model::Robot)?, bake(&table, Model::Table)?],
    ))
}

fn bake(mesh: &TriangleMesh, sample: Model) -> Result<Grid, Box<dyn Error>> {
    let (placement, options) = (Preset::Default.placement(), Preset::Default.options());
    let source = Source {
        name: sample.name().into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: mesh.triangles().len() as u64,
    };
    Ok(aogrid_baker_cpu::bake_grid(
        mesh, &placement, &options, source, UNOBSERVED,
    )?)
}

/// Returns a triangle's vertices with its face normal.
fn vertices(triangle: [[f32; 3]; 3], id: u8) -> [Vertex; 3] {
    let [a, b, c] = triangle.map(Vec3::from);
    let n = (b - a).cross(c - a).normalize_or_zero();
    [a, b, c].map(|p| [p.x, p.y, p.z, f32::from(id), n.x, n.y, n.z])
}
