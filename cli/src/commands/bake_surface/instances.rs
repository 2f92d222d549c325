//! Meshes that several nodes of a file pose.

use std::collections::{BTreeMap, BTreeSet};

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{LoadedMesh, Part, PosedPrimitive};
use aogrid_bake_core::surface::{
    SurfaceRecord, VertexGroups, face_centers, vertex_means, vertex_points,
};

use super::Bake;
use super::args::{Args, Instances};

/// Returns the first node of each mesh that several nodes pose, if they share its values.
fn shared(args: &Args, loaded: &LoadedMesh) -> BTreeMap<usize, usize> {
    let mut nodes: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for primitive in &loaded.primitives {
        nodes
            .entry(primitive.mesh)
            .or_default()
            .insert(primitive.node);
    }
    let is_shared = args.instances == Some(Instances::Share);
    let several = nodes
        .into_iter()
        .filter(|(_, nodes)| is_shared && nodes.len() > 1);
    several
        .filter_map(|(mesh, nodes)| Some((mesh, *nodes.first()?)))
        .collect()
}

/// Returns the primitives whose values are written: of shared meshes those of the first node.
pub(super) fn written<'a>(args: &Args, loaded: &'a LoadedMesh) -> Vec<&'a PosedPrimitive> {
    let shared = shared(args, loaded);
    let is_written = |p: &&PosedPrimitive| shared.get(&p.mesh).is_none_or(|node| *node == p.node);
    loaded.primitives.iter().filter(is_written).collect()
}

/// Replaces the values of shared meshes by those of a bake of each alone.
pub(super) fn share(
    bake: &Bake<'_>,
    groups: &VertexGroups,
    records: &mut [SurfaceRecord],
) -> anyhow::Result<()> {
    for (mesh, node) in shared(bake.args, bake.loaded) {
        let primitives = bake.loaded.primitives.iter();
        let own = primitives.filter(|p| (p.mesh, p.node) == (mesh, node));
        let ranges: Vec<_> = own.map(|p| p.vertices.clone()).collect();
        let is_own = |vertex: usize| ranges.iter().any(|range| range.contains(&vertex));
        let triangles = bake.loaded.mesh.triangles().iter();
        let triangles: Vec<_> = triangles
            .filter(|t| is_own(t[0] as usize))
            .copied()
            .collect();
        let whole = Part {
            name: "mesh".into(),
            triangles: 0..triangles.len(),
        };
        // Its coordinates are relative to the origin of the whole, as are those of its points.
        let positions = bake.loaded.mesh.positions().to_vec();
        let Ok(alone) = TriangleMesh::new(positions, triangles, vec![whole]) else {
            // Without an area it has the values of the whole.
            continue;
        };
        let of_alone = vertices_alone(bake, groups, &alone)?;
        for vertex in ranges.into_iter().flatten() {
            records[vertex] = of_alone[vertex];
        }
    }
    Ok(())
}

/// Returns the records of all vertices, with a mesh as its own and only occluder.
fn vertices_alone(
    bake: &Bake<'_>,
    groups: &VertexGroups,
    mesh: &TriangleMesh,
) -> anyhow::Result<Vec<SurfaceRecord>> {
    let options = aogrid_bake_core::surface::SurfaceOptions {
        ground: None,
        ..bake.options
    };
    let bar = bake.console.progress("shared meshes");
    let observe = |progress| bar.observe(progress);
    let kernel = bake.args.kernel();
    let records = |points: &[_]| bake.device.bake(mesh, points, &options, kernel, &observe);
    let faces = face_centers(mesh, bake.offset);
    let values = match bake.vertices().mean() {
        Some(mean) => {
            let of_faces = records(&faces.points)?.records;
            vertex_means(mesh, groups, &faces, &of_faces, mean)
        }
        None => {
            let own = vertex_points(mesh, groups, &faces, bake.offset);
            let of_points = records(&own.points)?.records;
            own.spread(mesh, groups, &of_points)
        }
    };
    Ok(values.records)
}
