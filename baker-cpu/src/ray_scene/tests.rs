//! Tests against every triangle, one after the other.

use aogrid_bake_core::mesh::Part;
use aogrid_bake_core::models::Model;

use super::traversal::STACK;
use super::*;

/// Returns a generator of numbers in −1..1.
fn random_numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut bits = crate::random::random_bits(seed);
    move || (bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Returns a scene for each SIMD level of this machine.
fn scenes(mesh: &TriangleMesh) -> Vec<RayScene> {
    let levels = Level::available().into_iter();
    levels.map(|level| RayScene::with(mesh, level)).collect()
}

/// Returns a mesh of triangles that share no vertex.
fn soup(triangles: &[[[f32; 3]; 3]]) -> TriangleMesh {
    let indices = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let whole = Part {
        name: "soup".into(),
        triangles: 0..triangles.len(),
    };
    TriangleMesh::new(triangles.concat(), indices.collect(), vec![whole]).unwrap()
}

/// Checks a ray at each SIMD level against every triangle, also up to its hit and to just before it.
/// Returns whether it hits.
fn check(scenes: &[RayScene], origin: [f64; 3], direction: [f64; 3]) -> bool {
    let expected = scenes[0].closest_hit_exhaustive(origin, direction);
    let distance = expected.map_or(1.0, |hit| hit.distance);
    let ends = [f64::INFINITY, distance, distance.next_down(), 0.0];
    let occluded = ends.map(|end| scenes[0].is_occluded_exhaustive(origin, direction, end));
    for scene in scenes {
        let level = scene.level.name();
        assert_eq!(
            scene.closest_hit(origin, direction),
            expected,
            "{level}: {origin:?} {direction:?}"
        );
        let found = ends.map(|end| scene.is_occluded(origin, direction, end));
        assert_eq!(
            found, occluded,
            "{level}: {origin:?} {direction:?} {ends:?}"
        );
    }
    expected.is_some()
}

fn transformed(sample: Model, scale: f32, offset: f32) -> TriangleMesh {
    let mesh = sample.mesh(None).unwrap();
    let transform = |p: &[f32; 3]| p.map(|v| v * scale + offset);
    let positions = mesh.positions().iter().map(transform).collect();
    TriangleMesh::new(positions, mesh.triangles().to_vec(), mesh.parts().to_vec()).unwrap()
}

#[test]
fn the_bvh_agrees_with_every_triangle() {
    let mut next = random_numbers(1);
    let (mut hits, mut rays) = (0, 0);
    // Meshes of ordinary size, far from the origin, tiny and huge.
    for (scale, offset) in [(1.0, 0.0), (1.0, 300.0), (1e-20, 0.0), (1e20, 0.0)] {
        for sample in [Model::Robot, Model::Torus, Model::Table] {
            let scenes = scenes(&transformed(sample, scale, offset));
            let center = scenes[0].center;
            let size = f64::from(scale);
            for distance in [0.5, 3.0, 1e4, 1e8] {
                for _ in 0..400 {
                    let origin: [f64; 3] =
                        std::array::from_fn(|x| center[x] + distance * size * next());
                    // Half of the rays aim at the mesh, which random ones from afar rarely hit.
                    let to: [f64; 3] = std::array::from_fn(|_| size * next());
                    let direction = match next() > 0.0 {
                        true => std::array::from_fn(|x| center[x] + to[x] - origin[x]),
                        false => to,
                    };
                    hits += usize::from(check(&scenes, origin, direction));
                    rays += 1;
                }
            }
        }
    }
    assert!(hits > rays / 10 && hits < rays / 2, "{hits} of {rays}");
}

/// Checks rays that single precision cannot decide: through points of edges and corners, along
/// edges, within the plane of a triangle, and from points of triangles.
#[test]
fn rays_along_edges_are_decided_in_double_precision() {
    let mut next = random_numbers(5);
    let mut hits = 0;
    for sample in [Model::Robot, Model::Torus] {
        let mesh = sample.mesh(None).unwrap();
        let scenes = scenes(&mesh);
        for (idx, t) in mesh.triangles().iter().enumerate().step_by(7) {
            let [a, b, c] = t.map(|v| mesh.positions()[v as usize].map(f64::from));
            let between = |p: [f64; 3], q: [f64; 3], s: f64| -> [f64; 3] {
                std::array::from_fn(|x| p[x] + s * (q[x] - p[x]))
            };
            let from: [f64; 3] = std::array::from_fn(|_| 2.0 * next());
            let inside = between(a, between(b, c, 0.4), 0.3 + 0.2 * next());
            let targets = [a, b, between(a, b, next().abs()), inside];
            for target in targets {
                let towards = std::array::from_fn(|x| target[x] - from[x]);
                hits += usize::from(check(&scenes, from, towards));
                // From the point itself, which is at distance zero.
                check(&scenes, target, towards);
            }
            // Along an edge, and within the plane.
            let edge: [f64; 3] = std::array::from_fn(|x| b[x] - a[x]);
            let behind = between(a, b, -1.0 - idx as f64);
            check(&scenes, behind, edge);
            check(
                &scenes,
                behind,
                std::array::from_fn(|x| inside[x] - behind[x]),
            );
        }
    }
    assert!(hits > 500, "{hits}");
}

/// Checks needles: triangles that are much longer than wide, which few rays decide clearly.
#[test]
fn needles_are_hit_as_in_double_precision() {
    let mut next = random_numbers(6);
    let mut hits = 0;
    for width in [1e-2, 1e-4, 1e-6, 1e-8] {
        let needle = |_| {
            let tip = [(); 3].map(|()| next() as f32);
            let end = [(); 3].map(|()| next() as f32);
            [tip, end, end.map(|v| v + width * next() as f32)]
        };
        let needles: Vec<[[f32; 3]; 3]> = (0..60).map(needle).collect();
        let scenes = scenes(&soup(&needles));
        for needle in &needles {
            let [a, b, c] = needle.map(|p| p.map(f64::from));
            for part in 1..16 {
                let s = f64::from(part) / 16.0;
                let on: [f64; 3] = std::array::from_fn(|x| a[x] + s * ((b[x] + c[x]) / 2.0 - a[x]));
                let from: [f64; 3] = std::array::from_fn(|_| 2.0 * next());
                let direction = std::array::from_fn(|x| on[x] - from[x]);
                hits += usize::from(check(&scenes, from, direction));
            }
        }
    }
    assert!(hits > 1000, "{hits}");
}

/// Checks that the tests above traverse both on a traversal's own stack and beyond it.
#[test]
fn trees_deeper_than_the_stack_are_tested() {
    let waiting = |sample: Model| scenes(&sample.mesh(None).unwrap())[0].tree.max_waiting;
    assert!(waiting(Model::Robot) > STACK, "{}", waiting(Model::Robot));
    let sheet = soup(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
    assert!(scenes(&sheet)[0].tree.max_waiting <= STACK);
}

/// Checks that triangles without an area, which may lie far beyond all others, do no harm.
#[test]
fn far_triangles_without_area_are_harmless() {
    let seen = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for far in [10.0, 1e8, 1e38] {
        let line = [
            [far, 0.0, 0.0],
            [0.0, far, 0.0],
            [far / 2.0, far / 2.0, 0.0],
        ];
        let scenes = scenes(&soup(&[seen, line]));
        assert!(check(&scenes, [0.2, 0.2, 1.0], [0.0, 0.0, -1.0]));
        assert!(!check(&scenes, [0.2, 0.2, 1.0], [0.0, 0.0, 1.0]));
        assert!(!check(&scenes, [1.2, 0.2, 1.0], [0.0, 0.0, -1.0]));
    }
}

/// Checks that equal boxes do not slow the BVH builder down. It merges the best pairs of a
/// pass; if all pairs are equal it may merge one per pass, and 100,000 triangles take minutes.
#[test]
fn equal_triangles_build_as_fast_as_others() {
    let triangle_at = |x: f32| {
        let t = [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 1.0, 0.0]];
        t.map(|p| p.map(|v| v / 1024.0))
    };
    let fence: Vec<_> = (0..100_000_u32).map(|i| triangle_at(i as f32)).collect();
    let copies = vec![triangle_at(0.0); 100_000];
    // One has an area, away from the ray, and encloses them all in its box.
    let mut degenerate = vec![[[1.0; 3]; 3]; 100_000];
    degenerate[0] = [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 2.0, 1.0]];
    for (triangles, occluded) in [(fence, true), (copies, true), (degenerate, false)] {
        let occluder = RayScene::new(&soup(&triangles));
        let origin = [1e-4, 1e-4, 1.0];
        assert_eq!(
            occluder.is_occluded(origin, [0.0, 0.0, -1.0], f64::INFINITY),
            occluded
        );
    }
}

/// Checks directions with a zero component, which cube faces with an odd number of texels per
/// side have.
#[test]
fn the_sign_of_a_zero_in_a_direction_does_not_matter() {
    let occluder = RayScene::new(&Model::Robot.mesh(None).unwrap());
    let mut next = random_numbers(3);
    let mut occluded = 0;
    for _ in 0..200 {
        let origin = [next(), next(), next()];
        for axis in 0..3 {
            let mut direction = std::array::from_fn(|x| occluder.center[x] - origin[x]);
            let hides = [0.0, -0.0].map(|zero| {
                direction[axis] = zero;
                occluder.is_occluded(origin, direction, f64::INFINITY)
            });
            assert_eq!(hides[0], hides[1], "{origin:?} {direction:?}");
            occluded += usize::from(hides[0]);
        }
    }
    assert!(occluded > 20, "{occluded}");
}

#[test]
fn a_sheet_occludes_from_both_sides_at_any_distance() {
    let whole = Part {
        name: "sheet".into(),
        triangles: 0..1,
    };
    let corners = vec![[-1.0, 0.0, -1.0], [3.0, 0.0, -1.0], [-1.0, 0.0, 3.0]];
    let sheet = TriangleMesh::new(corners, vec![[0, 1, 2]], vec![whole]).unwrap();
    let occluder = RayScene::new(&sheet);
    for height in [1.0, 1e-3, 1e-6, 1e-12, 1e-100] {
        for sign in [1.0, -1.0] {
            let origin = [0.0, sign * height, 0.0];
            assert!(
                occluder.is_occluded(origin, [0.0, -sign, 0.0], f64::INFINITY),
                "{height}"
            );
            assert!(!occluder.is_occluded(origin, [0.0, sign, 0.0], f64::INFINITY));
        }
    }
    // A ray that starts on the sheet has no hit at a distance above zero.
    assert!(!occluder.is_occluded([0.0; 3], [0.1, 1.0, 0.2], f64::INFINITY));
}
