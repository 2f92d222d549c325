//! Scenes far from zero and with large floors look as they do near zero with small ones (reports 16
//! and 27).

use std::path::Path;

use aogrid_bake_core::UNOBSERVED;
use aogrid_scene::shade::{Mode, ShadeInput, Target};
use aogrid_scene::{GBuffer, LoadOptions, parse};

/// Map coordinates, whose single floats are a thirty-second and a half apart.
const FAR: [f64; 3] = [448_262.5, 312.25, -5_411_932.75];

/// The largest difference in AO: 10⁻⁵ of the few units that are seen, over which AO changes by a few
/// units a unit near the contact.
const TOLERANCE: f32 = 2e-4;

/// The share of receivers whose truth may differ by more, since a ray passes an edge on the other side.
const MAX_SHARE: f64 = 0.02;

/// Returns the AO by truth and by cones of what a camera sees of a box on a floor of a size, all moved by
/// `offset`.
fn seen(floor: f64, offset: [f64; 3]) -> [Vec<f32>; 2] {
    let moved = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|x| v[x] + offset[x]) };
    let text = format!(
        "[camera]\nposition = {:?}\ntarget = {:?}\nvertical_fov = 30\nresolution = [32, 24]\n\
         [truth]\nsamples = 64\n\
         [[mesh]]\nname = 'floor'\nrectangle = [{floor:?}, {floor:?}]\n\
         [[mesh]]\nname = 'box'\nsample = 'box'\n\
         grid = {{ resolution = 16, format = 'f32', fit = false }}\n\
         [[instance]]\nmesh = 'floor'\ntranslate = {:?}\ncasts = false\n\
         [[instance]]\nmesh = 'box'\ntranslate = {:?}\n",
        moved([3.0, 2.5, 3.5]),
        moved([0.0, 0.2, 0.0]),
        moved([0.0; 3]),
        moved([0.0; 3]),
    );
    let scene = parse(Path::new("far.toml"), &text, LoadOptions::default()).unwrap();
    let target = Target::of_picture(GBuffer::trace(&scene, UNOBSERVED).unwrap());
    assert!(target.receivers.len() > 500);
    ["truth", "cone"].map(|name| {
        let mode = Mode::named(name).unwrap();
        mode.shade(&ShadeInput::new(&scene, &target))
            .unwrap()
            .occlusion
    })
}

fn assert_same(near: &[Vec<f32>; 2], other: &[Vec<f32>; 2]) {
    for (near, other) in near.iter().zip(other) {
        assert_eq!(near.len(), other.len());
        let far_off = near
            .iter()
            .zip(other)
            .filter(|(a, b)| (**a - **b).abs() > TOLERANCE);
        let share = far_off.count() as f64 / near.len() as f64;
        println!("share of receivers that differ: {share:.4}");
        assert!(share <= MAX_SHARE, "{share}");
    }
}

#[test]
fn pictures_at_map_coordinates_and_over_large_floors_are_as_near_zero() {
    let near = seen(6.0, [0.0; 3]);
    assert!(near.iter().all(|ao| ao.iter().any(|ao| *ao > 0.3)));
    assert_same(&near, &seen(6.0, FAR));
    let (small, large) = (seen(400.0, [0.0; 3]), seen(200_000.0, [0.0; 3]));
    assert_same(&small, &large);
}
