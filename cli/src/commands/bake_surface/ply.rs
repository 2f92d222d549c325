//! PLY output: the mesh with its values, binary and little-endian.

use std::fmt::Write;

use aogrid_bake_core::mesh::LoadedMesh;
use aogrid_bake_core::surface::SurfaceRecord;

use super::args::At;

/// Returns the file: positions as doubles, in the coordinates of the model's file, and the values of
/// vertices or faces.
pub(super) fn write(loaded: &LoadedMesh, values: &[SurfaceRecord], at: At, color: bool) -> Vec<u8> {
    let mesh = &loaded.mesh;
    let mut bytes = header(loaded, at, color).into_bytes();
    let origin = mesh.origin();
    for (idx, position) in mesh.positions().iter().enumerate() {
        for x in 0..3 {
            let coordinate = f64::from(position[x]) + origin[x];
            bytes.extend(coordinate.to_le_bytes());
        }
        if at == At::Vertices {
            add(&mut bytes, &values[idx], color);
        }
    }
    for (idx, triangle) in mesh.triangles().iter().enumerate() {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
        if at == At::Faces {
            add(&mut bytes, &values[idx], color);
        }
    }
    bytes
}

fn add(bytes: &mut Vec<u8>, record: &SurfaceRecord, color: bool) {
    bytes.extend(record.accessibility.to_le_bytes());
    bytes.extend(record.bent_normal.iter().flat_map(|v| v.to_le_bytes()));
    if color {
        let level = (record.accessibility * 255.0).round() as u8;
        bytes.extend([level; 3]);
    }
}

fn header(loaded: &LoadedMesh, at: At, color: bool) -> String {
    let mut values = String::new();
    for name in ["accessibility", "bent_x", "bent_y", "bent_z"] {
        let _ = writeln!(values, "property float {name}");
    }
    for name in ["red", "green", "blue"].iter().filter(|_| color) {
        let _ = writeln!(values, "property uchar {name}");
    }
    let [of_vertices, of_faces] = match at == At::Faces {
        true => ["", values.as_str()],
        false => [values.as_str(), ""],
    };
    let (n_vertices, n_faces) = (loaded.mesh.positions().len(), loaded.mesh.triangles().len());
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment accessibility and bent normals by aogrid\n\
         element vertex {n_vertices}\nproperty double x\nproperty double y\nproperty double z\n\
         {of_vertices}element face {n_faces}\nproperty list uchar uint vertex_indices\n{of_faces}\
         end_header\n"
    )
}
