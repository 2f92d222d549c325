//! A square in a texture.

use super::*;
use crate::mesh::Part;

/// A square of side 1 in two triangles, at a quarter to three quarters of the texture.
fn square(scale: f32) -> (TriangleMesh, Vec<[f32; 2]>) {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let whole = Part {
        name: "square".into(),
        triangles: 0..2,
    };
    let positions = corners.map(|[x, y]| [x, y, 0.0]).to_vec();
    let mesh = TriangleMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]], vec![whole]);
    let coordinates = corners.map(|[u, v]| [0.25 + scale * u, 0.25 + scale * v]);
    (mesh.unwrap(), coordinates.to_vec())
}

fn points(scale: f32, size: u32, per_side: u32) -> TexelPoints {
    let (mesh, coordinates) = square(scale);
    let groups = VertexGroups::new(&mesh, None);
    let sampling = TexelSampling { size, per_side };
    texel_points(&mesh, &groups, &coordinates, sampling, 0.5)
}

#[test]
fn all_points_are_on_the_surface_above_their_texels() {
    for (size, per_side) in [(16, 1), (16, 2), (10, 4)] {
        let found = points(0.5, size, per_side);
        assert_eq!(found.overlaps, 0.0, "{size}");
        assert!(found.points.len() as u32 >= size * size / 4 * per_side * per_side);
        for (point, &texel) in found.points.iter().zip(&found.texels) {
            let [x, y, z] = point.position;
            assert_eq!((z, point.axis), (0.5, [0.0, 0.0, 1.0]));
            // Weights are single floats.
            let on_square = -1e-6..=1.0 + 1e-6;
            assert!(on_square.contains(&x) && on_square.contains(&y));
            // The texel's center in the square, which is half the texture wide.
            let at = |cell: u32| 2.0 * ((f64::from(cell) + 0.5) / f64::from(size) - 0.25);
            let reach = 2.0 * 1.01 / f64::from(size);
            assert!((x - at(texel % size)).abs() < reach, "{x}");
            assert!((y - at(texel / size)).abs() < reach, "{y}");
        }
    }
}

#[test]
fn texels_that_the_chart_touches_are_covered() {
    // 0.25 to 0.75 of 10 texels: 2.5 to 7.5. Texel 2's center is on the border, 7's beyond it by half.
    let found = points(0.5, 10, 1);
    let columns: Vec<_> = found.texels.iter().filter(|t| *t / 10 == 5).collect();
    assert_eq!(columns, [&52, &53, &54, &55, &56, &57]);
    // A chart smaller than a texel between centers still has points.
    assert!(!points(0.02, 10, 1).points.is_empty());
}

#[test]
fn overlaps_and_coordinates_outside_are_counted() {
    assert_eq!(points(0.8, 16, 1).outside, 2);
    let (mesh, mut coordinates) = square(0.5);
    coordinates[3] = coordinates[1];
    let groups = VertexGroups::new(&mesh, None);
    let sampling = TexelSampling {
        size: 16,
        per_side: 1,
    };
    let found = texel_points(&mesh, &groups, &coordinates, sampling, 0.0);
    assert!((0.9..=1.0).contains(&found.overlaps), "{}", found.overlaps);
    assert_eq!(found.first_overlap, Some([0, 1]));
    coordinates[3] = coordinates[0];
    let found = texel_points(&mesh, &groups, &coordinates, sampling, 0.0);
    assert_eq!((found.flat, found.overlaps), (1, 0.0));
}

#[test]
fn dilation_takes_the_nearest_texel() {
    let record = |accessibility| {
        Some(SurfaceRecord {
            accessibility,
            ..SurfaceRecord::open([0.0, 0.0, 1.0])
        })
    };
    let mut texels = vec![None; 64];
    (texels[8 + 1], texels[8 + 6]) = (record(0.25), record(0.75));
    dilate(&mut texels, 8, 2);
    let value = |x: usize, y: usize| texels[8 * y + x].map(|r| r.accessibility);
    assert_eq!(value(3, 3), Some(0.25));
    assert_eq!(value(4, 0), Some(0.75));
    assert_eq!(value(4, 4), None);
    assert_eq!(value(0, 0), Some(0.25));
}

#[test]
fn samples_of_a_texel_are_averaged() {
    let found = points(0.5, 8, 2);
    let records: Vec<_> = (0..found.points.len())
        .map(|idx| SurfaceRecord {
            accessibility: (idx % 4) as f32,
            ..SurfaceRecord::open([0.0, 0.0, 1.0])
        })
        .collect();
    let texels = texel_means(&found, &records, 8);
    let full = texels[3 * 8 + 3].unwrap();
    assert_eq!(full.accessibility, 1.5);
    assert!(texels[0].is_none());
}
