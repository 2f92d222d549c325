//! Tests of prepared meshes.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::mesh::{MeshReport, Part};
use crate::models::Model;
use crate::{BakeOptions, Placement, Plan, PlanError};

fn prepared(mesh: &TriangleMesh) -> PreparedMesh {
    let spec = Placement::paper().place(&mesh.bounds()).unwrap();
    PreparedMesh::new(mesh, spec, [3.1e-4, -1.7e-4, 4.3e-4]).unwrap()
}

/// Returns the mesh with a separate vertex for every corner.
fn split(mesh: &TriangleMesh) -> TriangleMesh {
    let positions: Vec<_> = mesh.corners().flatten().collect();
    let n = mesh.triangles().len();
    let triangles = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let whole = Part {
        name: "split".into(),
        triangles: 0..n,
    };
    TriangleMesh::new(positions, triangles.collect(), vec![whole]).unwrap()
}

#[test]
fn closed_meshes_have_no_boundary_edges_with_and_without_shared_vertices() {
    for sample in Model::CLOSED {
        let mesh = sample.mesh(None).unwrap();
        let whole = prepared(&mesh);
        assert!(whole.boundary_edges().is_empty(), "{sample:?}");
        assert_eq!(2 * whole.edges().len(), 3 * whole.triangles().len());
        let split = prepared(&split(&mesh));
        assert!(split.boundary_edges().is_empty(), "{sample:?}");
        assert_eq!(split.vertices().len(), whole.vertices().len());
    }
}

#[test]
fn triangles_with_coincident_corners_are_left_out() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [1e-9, 0.0, 0.0]];
    let whole = Part {
        name: "points".into(),
        triangles: 0..2,
    };
    // The last vertex snaps to the first.
    let mesh = TriangleMesh::new(points, vec![[0, 1, 2], [0, 3, 2]], vec![whole]).unwrap();
    assert_eq!(MeshReport::new(&mesh).degenerate, 0);
    let prepared = prepared(&mesh);
    assert_eq!(prepared.triangles(), [[0, 1, 2]]);
    assert_eq!(
        (prepared.vertices().len(), prepared.boundary_edges().len()),
        (3, 3)
    );
}

/// A triangle that is repeated 33,333 times took a minute to sweep.
#[test]
fn repeated_triangles_are_one() {
    let mesh = Model::Box.mesh(None).unwrap();
    let whole = prepared(&mesh);
    let mut triangles = mesh.triangles().to_vec();
    let [a, b, c] = triangles[5];
    triangles.extend([[b, a, c], [b, c, a]].repeat(1000));
    let part = Part {
        name: "repeated".into(),
        triangles: 0..triangles.len(),
    };
    let repeated = TriangleMesh::new(mesh.positions().to_vec(), triangles, vec![part]).unwrap();
    let repeated = prepared(&repeated);
    assert_eq!(repeated.triangles(), whole.triangles());
    assert_eq!(repeated.edges(), whole.edges());
    assert!(repeated.boundary_edges().is_empty());
}

#[test]
fn unused_vertices_may_be_nan() {
    let points = vec![[f32::NAN; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
    let whole = Part {
        name: "points".into(),
        triangles: 0..1,
    };
    let mesh = TriangleMesh::new(points, vec![[1, 2, 3]], vec![whole]).unwrap();
    assert_eq!(prepared(&mesh).triangles().len(), 1);
}

#[test]
fn normals_are_exact() {
    let mesh = prepared(&Model::Box.mesh(None).unwrap());
    for &triangle in mesh.triangles() {
        let normal = mesh.normal(triangle);
        assert_eq!(normal.iter().filter(|v| **v != 0).count(), 1, "{normal:?}");
    }
}

#[test]
fn a_reposed_mesh_is_the_one_prepared_anew() {
    let mesh = Model::Robot.mesh(None).unwrap();
    let bent = |[x, y, z]: [f32; 3]| [x + 0.1 * y * y, 0.9 * y, z - 0.2 * x * y];
    for mesh in [mesh.clone(), split(&mesh)] {
        let positions = mesh.positions().iter().map(|&p| bent(p)).collect();
        let triangles = mesh.triangles().to_vec();
        let posed = TriangleMesh::new(positions, triangles, mesh.parts().to_vec()).unwrap();
        let spec = Placement::paper().place(&posed.bounds()).unwrap();
        let expected = prepared(&posed);
        let mut reposed = prepared(&mesh);
        assert!(
            reposed
                .repose(&posed, spec, [3.1e-4, -1.7e-4, 4.3e-4])
                .unwrap()
        );
        assert_eq!(reposed.vertices(), expected.vertices());
        assert_eq!(reposed.triangles(), expected.triangles());
        assert_eq!(reposed.edges(), expected.edges());
        assert_eq!(reposed.bounds(), expected.bounds());
        assert_eq!(reposed.lattice(), expected.lattice());
        assert_eq!(reposed.spec(), expected.spec());
    }
}

#[test]
fn merged_vertices_that_come_apart_are_prepared_anew() {
    let mesh = split(&Model::Box.mesh(None).unwrap());
    let offset = [3.1e-4, -1.7e-4, 4.3e-4];
    let mut prepared = prepared(&mesh);
    let before = prepared.vertices().to_vec();
    let mut positions = mesh.positions().to_vec();
    positions[4][1] += 0.01;
    let triangles = mesh.triangles().to_vec();
    let torn = TriangleMesh::new(positions, triangles, mesh.parts().to_vec()).unwrap();
    let spec = Placement::paper().place(&torn.bounds()).unwrap();
    assert_eq!(prepared.repose(&torn, spec, offset), Ok(false));
    let other = Model::Robot.mesh(None).unwrap();
    assert_eq!(prepared.repose(&other, spec, offset), Ok(false));
    assert_eq!(prepared.vertices(), before);
}

/// Each call of the observer may end the preparation, and the plan does not take that for a reason to
/// cast rays.
#[test]
fn preparation_can_be_cancelled_before_each_stage() {
    let mesh = Model::Torus.mesh(None).unwrap();
    let spec = Placement::paper().place(&mesh.bounds()).unwrap();
    let prepare = |max_calls: usize| {
        let calls = AtomicUsize::new(0);
        let observer = |progress: Progress| {
            assert_eq!((progress.done, progress.total), (0, spec.cell_count()));
            match calls.fetch_add(1, Ordering::Relaxed) < max_calls {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        };
        let plan = Plan::observed(&mesh, spec, &BakeOptions::paper(), None, &observer);
        (plan.map(|_| ()), calls.into_inner())
    };
    let (finished, n_stages) = prepare(usize::MAX);
    assert_eq!((finished, n_stages), (Ok(()), 4));
    for max_calls in 0..n_stages {
        let cancelled = (Err(PlanError::Cancelled), max_calls + 1);
        assert_eq!(prepare(max_calls), cancelled);
    }
}
