//! The triangles of occluders in world space.

use glam::DVec3;

use super::ShadeInput;
use crate::error::{Result, bail};
use crate::{Instance, SceneMesh};

/// A triangle in world space, its front counter-clockwise.
pub(super) struct Triangle<'a> {
    pub corners: [DVec3; 3],
    pub instance: &'a Instance,
}

/// Returns the corners of the triangles' bounding box.
pub(super) fn bounds(triangles: &[Triangle<'_>]) -> [DVec3; 2] {
    let corners = || triangles.iter().flat_map(|t| t.corners);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    [low, corners().fold(DVec3::NEG_INFINITY, DVec3::max)]
}

/// Returns the triangles of the casters of chosen meshes.
pub(super) fn triangles<'a>(
    input: &ShadeInput<'a>,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<Triangle<'a>>> {
    let scene = input.scene;
    let mut triangles = Vec::new();
    for instance in scene.casters() {
        let mesh = &scene.meshes[instance.mesh];
        if !chosen(mesh) {
            continue;
        }
        let mesh = &mesh.mesh;
        let origin = DVec3::from_array(mesh.origin());
        let world: Vec<DVec3> = mesh
            .positions()
            .iter()
            .map(|p| origin + DVec3::from_array(p.map(f64::from)))
            .map(|p| instance.world_from_object.transform_point3(p))
            .collect();
        let is_mirrored = instance.world_from_object.matrix3.determinant() < 0.0;
        triangles.extend(mesh.triangles().iter().map(|&[a, b, c]| {
            let order = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let corners = order.map(|v| world[v as usize]);
            Triangle { corners, instance }
        }));
    }
    if u32::try_from(triangles.len()).is_err() {
        bail!(
            "{}: more triangles than can be counted",
            scene.path.display()
        );
    }
    Ok(triangles)
}
