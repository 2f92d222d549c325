//! The z-buffer against rays: the same records, bit by bit.

use aogrid_bake_core::mesh;
use aogrid_bake_core::models::Model;
use aogrid_bake_core::surface::{
    Directions, SurfaceOptions, SurfacePoint, default_offset, face_centers, normalized,
};
use aogrid_bake_core::{TriangleMesh, UNOBSERVED};
use aogrid_baker_cpu::{BakeError, SurfaceKernel, bake_surface};
use aogrid_tests::{Random, mesh_of, shared};

use super::point;

fn few_rays() -> SurfaceOptions {
    SurfaceOptions {
        rays: 24,
        ..SurfaceOptions::recommended()
    }
}

/// Asserts that both kernels agree; returns the share of occluded points.
fn assert_equal(mesh: &TriangleMesh, points: &[SurfacePoint], options: &SurfaceOptions) -> f64 {
    let [z_buffer, rays] = SurfaceKernel::ALL.map(|kernel| {
        bake_surface(mesh, points, options, Some(kernel), UNOBSERVED).expect("it is not cancelled")
    });
    assert_eq!(z_buffer.rays, rays.rays);
    let pairs = z_buffer.records.iter().zip(&rays.records);
    let different: Vec<_> = pairs.enumerate().filter(|(_, (a, b))| a != b).collect();
    assert!(
        different.is_empty(),
        "{} of {}, such as {:?}",
        different.len(),
        points.len(),
        different[0]
    );
    let occluded = rays.records.iter().filter(|r| r.accessibility < 1.0);
    occluded.count() as f64 / points.len() as f64
}

fn assert_equal_on_faces(mesh: &TriangleMesh, options: &SurfaceOptions) {
    let points = face_centers(mesh, default_offset(mesh)).points;
    assert_equal(mesh, &points, options);
}

#[test]
fn models_of_all_kinds() {
    for model in [Model::Robot, Model::Comb, Model::OpenBoxes, Model::CardTree] {
        assert_equal_on_faces(&model.mesh(None).unwrap(), &few_rays());
    }
}

#[test]
fn real_meshes() {
    for name in [
        "spot_tri.obj",
        "suzanne.obj",
        "chair_messy.obj",
        "alien_parts.glb",
    ] {
        let Some(path) = shared(&format!("data/meshes/{name}")) else {
            return;
        };
        assert_equal_on_faces(&mesh::load(&path).unwrap().mesh, &few_rays());
    }
}

/// Random triangles, needles among them, of sizes from a thousandth of the box to all of it.
fn soup(random: &mut Random, n: usize) -> TriangleMesh {
    let mut triangle = |idx: usize| {
        let center = [(); 3].map(|()| random.signed());
        let size = [1e-3, 0.03, 0.3, 1.0][idx % 4];
        let along = [(); 3].map(|()| size * random.signed());
        let thin = if idx.is_multiple_of(3) { 1e-5 } else { 1.0 };
        let across = [(); 3].map(|()| thin * size * random.signed());
        let plus = |v: [f32; 3]| [0, 1, 2].map(|x| center[x] + v[x]);
        [center, plus(along), plus(across)]
    };
    mesh_of(&(0..n).map(&mut triangle).collect::<Vec<_>>())
}

/// Points within a soup, below its faces' planes and beside them, with axes of their own; with and
/// without a maximum distance.
#[test]
fn soups_and_needles() {
    let mut random = Random::new(20);
    let mesh = soup(&mut random, 600);
    let mut vector = || [(); 3].map(|()| f64::from(random.signed()));
    let points: Vec<_> = (0..3000)
        .map(|_| SurfacePoint {
            axis: normalized(vector()).unwrap(),
            face: normalized(vector()).unwrap(),
            position: vector(),
        })
        .collect();
    for (max_distance, ignore_backfaces) in [(None, false), (Some(0.25), false), (None, true)] {
        let options = SurfaceOptions {
            max_distance,
            ignore_backfaces,
            ..few_rays()
        };
        let share = assert_equal(&mesh, &points, &options);
        assert!(share > 0.5, "{share}");
    }
}

/// A ceiling that faces up is not there from below, but for one that has another behind it.
#[test]
fn backs_of_faces_can_be_ignored() {
    let [a, b, c] = [[-9.0, 1.0, -9.0], [9.0, 1.0, -9.0], [0.0, 1.0, 20.0]];
    let (up, down) = ([a, c, b], [a, b, c]);
    let floor = [point([0.0, 0.0, 0.0], [0.0, 1.0, 0.0])];
    let mean = |triangles: &[[[f32; 3]; 3]], kernel| {
        let options = SurfaceOptions {
            ignore_backfaces: true,
            ..few_rays()
        };
        let mesh = mesh_of(triangles);
        let bake = bake_surface(&mesh, &floor, &options, Some(kernel), UNOBSERVED).unwrap();
        bake.records[0].accessibility
    };
    for kernel in SurfaceKernel::ALL {
        assert_eq!(mean(&[up], kernel), 1.0, "{kernel:?}");
        assert!(mean(&[down], kernel) < 0.2, "{kernel:?}");
        assert_eq!(
            mean(&[up, down], kernel),
            mean(&[down], kernel),
            "{kernel:?}"
        );
        assert_eq!(
            mean(&[down, up], kernel),
            mean(&[down], kernel),
            "{kernel:?}"
        );
    }
}

/// Points exactly on edges, on corners and in planes, where nothing but the exact test decides.
#[test]
fn points_on_edges_and_corners() {
    let mesh = soup(&mut Random::new(7), 300);
    let on_edges = mesh.corners().flat_map(|[a, b, c]| {
        let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
        let between = |s: f64| [0, 1, 2].map(|x| a[x] + s * (b[x] - a[x]));
        let inside = [0, 1, 2].map(|x| (a[x] + b[x] + c[x]) / 3.0);
        [a, b, between(0.5), between(0.37), inside]
    });
    let up = [0.0, 0.6, 0.8];
    let points: Vec<_> = on_edges.map(|p| point(p, up)).collect();
    assert_equal(&mesh, &points, &few_rays());
}

/// A box and points straight below its edges, along the first shared direction.
#[test]
fn directions_through_edges() {
    let mesh = Model::Box.mesh(None).unwrap();
    let options = SurfaceOptions {
        rays: 1,
        ..few_rays()
    };
    let [direction] = aogrid_bake_core::surface::shared_directions(1)[..] else {
        panic!("there is one");
    };
    let mut points = Vec::new();
    for [a, b, _] in mesh.corners() {
        for s in 0..=16 {
            for ulps in -2..=2 {
                let s = f64::from(s) / 16.0;
                let on_edge = |x: usize| f64::from(a[x]) + s * f64::from(b[x] - a[x]);
                let shift = f64::from(ulps) * 2.0_f64.powi(-52);
                let position = [0, 1, 2].map(|x| on_edge(x) - 2.0 * direction[x] + shift);
                points.push(point(position, direction));
            }
        }
    }
    let share = assert_equal(&mesh, &points, &options);
    assert!((0.1..0.999).contains(&share), "{share}");
}

#[test]
fn only_shared_directions_have_a_z_buffer() {
    let mesh = Model::Box.mesh(None).unwrap();
    let options = SurfaceOptions {
        directions: Directions::Stratified,
        ..few_rays()
    };
    let kernel = Some(SurfaceKernel::ZBuffer);
    let error = bake_surface(&mesh, &[], &options, kernel, UNOBSERVED).unwrap_err();
    assert_eq!(error, BakeError::NotShared);
}
