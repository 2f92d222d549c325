use aogrid_bake_core::mesh;
use aogrid_baker_cpu::RayScene;
use aogrid_tests::{Random, files_with_ending, shared};

/// Random rays from each mesh's box towards it, and as many through points of its edges. Testing
/// every triangle takes 10 ms a ray for the largest mesh.
const RAYS: usize = 8;

/// The tree of rays gives the answers of a test of every triangle, to the bit, on real meshes and at
/// each SIMD level.
#[test]
fn rays_equal_those_against_every_triangle() {
    let Some(folder) = shared("data/meshes") else {
        return;
    };
    let (mut hits, mut checked) = (0, 0);
    for path in files_with_ending(&folder, "") {
        let mesh = mesh::load(&path).unwrap().mesh;
        let levels = RayScene::simd_levels().into_iter();
        let scenes: Vec<_> = levels
            .map(|level| RayScene::with_simd_level(&mesh, level).unwrap())
            .collect();
        let (bounds, mut random) = (mesh.bounds(), Random::new(19));
        let unit = |random: &mut Random| f64::from(random.signed() + 1.0) / 2.0;
        let in_box = |random: &mut Random| -> [f64; 3] {
            std::array::from_fn(|x| {
                let [min, max] = [bounds.min[x], bounds.max[x]].map(f64::from);
                mesh.origin()[x] + min + (max - min) * unit(random)
            })
        };
        for ray in 0..2 * RAYS {
            let from = in_box(&mut random);
            let to = match ray % 2 {
                0 => in_box(&mut random),
                _ => {
                    let n = mesh.triangles().len();
                    let [a, b, _] = mesh.triangles()[(unit(&mut random) * n as f64) as usize]
                        .map(|v| mesh.positions()[v as usize].map(f64::from));
                    let s = unit(&mut random);
                    std::array::from_fn(|x| mesh.origin()[x] + a[x] + s * (b[x] - a[x]))
                }
            };
            let direction = std::array::from_fn(|x| to[x] - from[x]);
            let expected = scenes[0].closest_hit_exhaustive(from, direction);
            for (scene, level) in scenes.iter().zip(RayScene::simd_levels()) {
                let shown = || format!("{} {level} {from:?} {to:?}", path.display());
                assert_eq!(scene.closest_hit(from, direction), expected, "{}", shown());
                let is_occluded = scene.is_occluded(from, direction, f64::INFINITY);
                assert_eq!(is_occluded, expected.is_some(), "{}", shown());
            }
            hits += usize::from(expected.is_some());
            checked += 1;
        }
    }
    assert!(
        checked > 20 * RAYS && hits > checked / 4,
        "{hits} of {checked}"
    );
}
