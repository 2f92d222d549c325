//! Several occluders, multiplied, merged and the mean of both, against ray tracing.

use std::path::Path;
use std::sync::Arc;

use aogrid_bake_core::{Preset, UNOBSERVED};
use aogrid_baker_cpu::RayScene;
use aogrid_grid_format::Grid;
use aogrid_runtime::shading::{
    aogrid_cone_with_axis_at, aogrid_lookup, aogrid_mean, aogrid_merge, aogrid_multiply,
};
use aogrid_runtime::{AogridOccluder, CpuTexture, Instance};
use aogrid_scene::reference::{Lighting, Receiver, ReferenceOptions, shade};
use aogrid_scene::{GBuffer, GridSource, Grids, LoadOptions, Scene, load, parse};
use glam::{DVec3, Vec3};

/// The method that combines occluders.
#[derive(Clone, Copy, Debug)]
enum Combine {
    Multiply,
    Merge,
    Mean,
}

/// A scene, its casters' grids, its receivers and their reference AO.
struct Shading {
    scene: Scene,
    casters: Vec<(AogridOccluder, Arc<Grid>, Arc<CpuTexture>)>,
    receivers: Vec<Receiver>,
    truth: Vec<f32>,
    clip: CpuTexture,
    overlaps: CpuTexture,
}

impl Shading {
    /// Bakes the grids of a scene, and traces the reference AO of `receivers`.
    fn new(scene: Scene, receivers: Vec<Receiver>, samples: u32) -> Self {
        let grids = Grids::new().resolve(&scene, UNOBSERVED).unwrap();
        let texture = |grid: &Option<Arc<Grid>>| grid.as_deref().map(CpuTexture::of_grid);
        let textures: Vec<_> = grids.iter().map(|g| texture(g).map(Arc::new)).collect();
        let casters = scene.casters().map(|instance| {
            let grid = grids[instance.mesh].clone().unwrap();
            let world_from_object = glam::DMat4::from(instance.world_from_object).as_mat4();
            let instance_at = Instance::at(world_from_object.to_cols_array_2d());
            let occluder = AogridOccluder::new(&grid, &instance_at).unwrap();
            (occluder, grid, textures[instance.mesh].clone().unwrap())
        });
        let casters = casters.collect();
        let flat = scene.flattened(|instance| instance.casts).unwrap().unwrap();
        let options = ReferenceOptions {
            samples,
            error: None,
            ..scene.truth
        };
        let lighting = Lighting::default();
        let occluder = RayScene::new(&flat);
        let shades = shade(Some(&occluder), &receivers, &lighting, &options, UNOBSERVED).unwrap();
        Self {
            casters,
            truth: shades.iter().map(|s| s.occlusion.mean).collect(),
            receivers,
            scene,
            clip: CpuTexture::clip_table(),
            overlaps: CpuTexture::intersection_table(),
        }
    }

    /// Keeps those of a scene's listed receivers that lie in every caster's grid, as AO is unknown
    /// outside, and more than a cell away from every caster's bounding box, as cells inside an
    /// object copy their neighbors.
    fn of_list(scene: Scene) -> Self {
        let list = scene.receivers.as_ref().unwrap().lifted();
        let all = Self::new(scene, vec![], 2);
        let chosen = |receiver: &Receiver| {
            let p = receiver.position.map(|x| x as f32);
            let mut instances = all.scene.casters();
            all.casters.iter().all(|(occluder, grid, _)| {
                let instance = instances.next().unwrap();
                let bounds = all.scene.meshes[instance.mesh].mesh.bounds();
                let p_object = instance.world_from_object.inverse();
                let p_object = p_object
                    .transform_point3(DVec3::from(receiver.position))
                    .as_vec3();
                let cell = 2.0 * Vec3::from(grid.spec().half_extents())
                    / glam::UVec3::from(grid.spec().resolution()).as_vec3();
                let (low, high) = (Vec3::from(bounds.min), Vec3::from(bounds.max));
                let near = p_object.cmpgt(low - cell).all() && p_object.cmplt(high + cell).all();
                aogrid_lookup(occluder, p).is_reached && !near
            })
        };
        let receivers = list.into_iter().filter(chosen).collect();
        Self::new(all.scene, receivers, 4096)
    }

    /// Returns AO at every receiver, the casters in this order.
    fn occlusion(&self, order: &[usize], combine: Combine) -> Vec<f32> {
        let shade = |receiver: &Receiver| {
            let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
            let left = order.iter().fold([0.0, 0.0, 0.0, 1.0], |before, &idx| {
                let (occluder, _, texture) = &self.casters[idx];
                let lookup = aogrid_lookup(occluder, p);
                if !lookup.is_reached {
                    return before;
                }
                let one = aogrid_cone_with_axis_at(occluder, texture, &self.clip, lookup, n);
                match combine {
                    Combine::Multiply => aogrid_multiply(before, one),
                    Combine::Merge => aogrid_merge(before, one, &self.overlaps),
                    Combine::Mean => aogrid_mean(before, one, &self.overlaps),
                }
            });
            1.0 - left[3]
        };
        self.receivers.iter().map(shade).collect()
    }

    fn in_order(&self) -> Vec<usize> {
        (0..self.casters.len()).collect()
    }

    /// Returns the RMSE of AO, multiplied, merged and the mean of both, in the scene's order, and
    /// prints it.
    fn errors(&self, name: &str) -> [f64; 3] {
        let errors = [Combine::Multiply, Combine::Merge, Combine::Mean]
            .map(|combine| rmse(&self.occlusion(&self.in_order(), combine), &self.truth));
        println!("{name}: multiplied, merged, mean {errors:.4?}");
        errors
    }
}

fn rmse(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    assert!(a.len() > 100, "{} receivers are too few", a.len());
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

fn file(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(name);
    load(&path, LoadOptions::default()).unwrap()
}

/// Receivers on the floor around the boxes.
const FLOOR: &str = "corner = [-2, 0.0001, 2]\nu = [4, 0, 0]\nv = [0, 0, -4]";

/// Receivers on a wall beside the boxes.
const WALL: &str = "corner = [0.8, 0, 0.8]\nu = [0, 2, 0]\nv = [0, 0, -1.6]";

/// Returns unit boxes with grids of the default preset, whose far fields reach all receivers.
fn boxes(instances: &str, receivers: &str) -> Shading {
    let text = format!(
        "[[mesh]]\nname = 'box'\nsample = 'box'\n{instances}\n[receivers]\n{receivers}\ncount = [40, 40]\n"
    );
    Shading::of_list(parse(Path::new("boxes.toml"), &text, LoadOptions::default()).unwrap())
}

#[test]
fn two_overlapping_boxes_merge_three_times_better_than_they_multiply() {
    let shading = Shading::of_list(file("overlapping-boxes.toml"));
    let [multiplied, merged, _] = shading.errors("figure 11");
    assert!(merged <= multiplied / 3.0, "{multiplied} {merged}");
}

#[test]
fn merging_one_occluder_gives_its_cone() {
    let shading = boxes("[[instance]]\nmesh = 'box'", FLOOR);
    let [multiplied, merged] =
        [Combine::Multiply, Combine::Merge].map(|combine| shading.occlusion(&[0], combine));
    // 1 + (t - 1) rounds at 1.
    let worst = multiplied.iter().zip(&merged).map(|(a, b)| (a - b).abs());
    assert!(worst.fold(0.0, f32::max) <= 2e-7);
}

#[test]
fn stacked_boxes_merge_better_and_disjoint_ones_match() {
    let place =
        |y: &str, x: &str| format!("[[instance]]\nmesh = 'box'\ntranslate = [{x}, {y}, 0]\n");
    let stacked = boxes(&(place("0", "0") + &place("1", "0")), WALL).errors("stacked");
    boxes(&(place("0", "-0.5") + &place("0", "0.5")), FLOOR).errors("beside");
    let apart = boxes(&(place("0", "-0.8") + &place("0", "0.8")), FLOOR).errors("apart");
    assert!(stacked[1] < stacked[0], "{stacked:?}");
    // Objects that hide no part of each other: both methods are close.
    assert!((apart[0] - apart[1]).abs() < 0.02, "{apart:?}");
}

/// Returns some permutations of `n` things: each rotation, forwards and backwards.
fn orders(n: usize) -> Vec<Vec<usize>> {
    let rotated = (0..n).map(|first| (0..n).map(|i| (first + i) % n).collect::<Vec<_>>());
    let both = rotated.flat_map(|order| [order.iter().rev().copied().collect(), order]);
    both.collect()
}

#[test]
fn five_boxes_in_any_order_merge_better_than_they_multiply() {
    let mut text = String::new();
    for (x, z, scale, degrees) in [
        (-0.5, 0.2, 0.9, 15),
        (0.1, -0.4, 0.7, 50),
        (0.5, 0.3, 0.8, 70),
        (-0.1, 0.6, 0.6, 30),
        (0.2, 0.1, 1.0, 5),
    ] {
        text += &format!(
            "[[instance]]\nmesh = 'box'\nscale = {scale}\ntranslate = [{x}, 0, {z}]\n\
             rotate = {{ axis = [0, 1, 0], degrees = {degrees} }}\n"
        );
    }
    let shading = boxes(&text, FLOOR);
    let [multiplied, _, _] = shading.errors("five boxes");
    let images: Vec<_> = orders(5)
        .iter()
        .map(|order| shading.occlusion(order, Combine::Merge))
        .collect();
    let errors: Vec<f64> = images
        .iter()
        .map(|image| rmse(image, &shading.truth))
        .collect();
    let best = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let spread = (0..images[0].len()).map(|pixel| {
        let values = images.iter().map(|image| image[pixel]);
        let (low, high) = values.fold((1.0_f32, 0.0_f32), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    });
    let spread = spread.fold(0.0, f32::max);
    println!(
        "five boxes: merged {best:.4} to {worst:.4} over {} orders, one receiver by up to {spread:.3}",
        errors.len()
    );
    assert!(worst < multiplied, "{worst} {multiplied}");
    // The mean is taken occluder by occluder, and hardly differs from that of both results.
    let in_order = shading.in_order();
    let [a, b, mean] = [Combine::Multiply, Combine::Merge, Combine::Mean]
        .map(|combine| shading.occlusion(&in_order, combine));
    let of_both: Vec<f32> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
    let errors = [&mean, &of_both].map(|image| rmse(image, &shading.truth));
    println!(
        "five boxes: mean {:.4}, of both results {:.4}",
        errors[0], errors[1]
    );
    assert!((errors[0] - errors[1]).abs() < 0.001, "{errors:?}");
}

/// Replaces the table by the union in closed form, to measure the error of the table.
#[test]
fn the_merge_table_has_a_small_error() {
    let shading = Shading::of_list(file("overlapping-boxes.toml"));
    let by_table = shading.occlusion(&[0, 1], Combine::Merge);
    let exact = shading.receivers.iter().map(|receiver| {
        let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
        let cones = shading.casters.iter().map(|(occluder, _, texture)| {
            let lookup = aogrid_lookup(occluder, p);
            let one = aogrid_cone_with_axis_at(occluder, texture, &shading.clip, lookup, n);
            (
                1.0 - one[3],
                Vec3::new(one[0], one[1], one[2]).normalize_or_zero(),
            )
        });
        let cones: Vec<_> = cones.collect();
        let gamma = cones[0].1.dot(cones[1].1).clamp(-1.0, 1.0).acos();
        let fractions = [cones[0].0 / 2.0, cones[1].0 / 2.0];
        2.0 * aogrid_tables::merge::closed_form(fractions[0], fractions[1], gamma)
    });
    let exact: Vec<f32> = exact.collect();
    let lost = rmse(&by_table, &exact);
    println!("T_merge as a texture: {lost:.5} of AO");
    // A look-up's typical (rms) error is 2.8e-4, and twice that for AO, as AO is twice a fraction.
    // The factor 4 allows for larger errors near γ = 0.
    assert!(lost <= 4.0 * 2.0 * 2.8e-4, "{lost}");
}

#[test]
fn the_robot_s_parts_match_the_reference_multiplied_and_merged() {
    for preset in [Preset::Paper, Preset::Default] {
        let mut scene = file("robot.toml");
        for mesh in &mut scene.meshes {
            let (placement, options) = (preset.placement(), preset.options());
            mesh.grid = GridSource::Bake(placement, options);
        }
        scene.camera.as_mut().unwrap().resolution = [64, 48];
        let gbuffer = GBuffer::trace(&scene, UNOBSERVED).unwrap();
        let receivers = gbuffer
            .receivers()
            .into_iter()
            .map(|(_, receiver)| receiver);
        let shading = Shading::new(scene, receivers.collect(), 1024);
        let errors = shading.errors(&format!("figure 9, {preset:?}"));
        // Larger errors would be visible to anyone.
        assert!(errors.iter().all(|error| *error < 0.15));
    }
}
