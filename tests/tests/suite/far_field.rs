//! The far field of baked objects: no step where it begins and none where it ends.

use aogrid_bake_core::Preset;
use aogrid_bake_core::models::Model;
use aogrid_grid_format::Grid;
use aogrid_runtime::shading::{AogridLookup, aogrid_lookup};
use aogrid_runtime::{AogridOccluder, Instance};
use aogrid_tests::{Random, Shaded, grid};
use glam::{Mat4, Quat, Vec3};

/// The lines through each object.
const LINES: usize = 1000;

/// The largest step in AO. Neighboring positions are 2⁻²³ of some units apart, over which AO changes
/// by less than 1e-6; a few roundings of a and of the axis follow, times T_clip's slope of 4.
const MAX_STEP: f32 = 1e-5;

fn baked(model: Model) -> Grid {
    let preset = Preset::Economy;
    grid(
        &model.mesh(None).unwrap(),
        &preset.placement(),
        &preset.options(),
    )
}

/// Returns two neighboring positions between `from` and `to`, on either side of the change of a
/// look-up's state; none if both ends have the same.
fn change(
    occluder: &AogridOccluder,
    [mut from, mut to]: [Vec3; 2],
    state: impl Fn(AogridLookup) -> bool,
) -> Option<[[f32; 3]; 2]> {
    let at = |p: Vec3| state(aogrid_lookup(occluder, p.to_array()));
    let (first, last) = (at(from), at(to));
    for _ in 0..60 {
        let middle = from.lerp(to, 0.5);
        if at(middle) == first {
            from = middle;
        } else {
            to = middle;
        }
    }
    (first != last).then_some([from.to_array(), to.to_array()])
}

#[test]
fn a_thousand_lines_through_five_objects_have_no_step() {
    let world_from_object = Mat4::from_scale_rotation_translation(
        Vec3::splat(1.7),
        Quat::from_rotation_x(0.4),
        Vec3::new(0.5, -1.0, 2.0),
    );
    let instance = Instance::at(world_from_object.to_cols_array_2d());
    let models = [
        Model::Table,
        Model::Robot,
        Model::SpaceShip,
        Model::LShape,
        Model::Sheet,
    ];
    for model in models {
        let grid = baked(model);
        let shaded = Shaded::new(&grid, &instance);
        let occluder = &shaded.occluder;
        assert!(occluder.fade_scale > 0.0, "{model:?}");
        let center = Vec3::from(occluder.center);
        let half = grid.spec().half_extents();
        let reaches = (0..3).map(|x| half[x] * 2.0 / occluder.per_reach[x]);
        let size = 1.7 * reaches.fold(0.0, f32::max);
        let box_size = 1.7 * half.iter().copied().fold(0.0, f32::max);
        let mut random = Random::new(7);
        let mut vector = || Vec3::from([random.signed(), random.signed(), random.signed()]);
        let (mut worst, mut crossings) = ([0.0_f32; 2], [0; 2]);
        for _ in 0..LINES {
            let from = center + 1.5 * box_size * vector();
            let to = from + 4.0 * size * vector().normalize();
            let n = vector().normalize().to_array();
            let step = |p: [[f32; 3]; 2]| (shaded.cone(p[0], n) - shaded.cone(p[1], n)).abs();
            let edges = [
                change(occluder, [from, to], |l| l.distance > 1.0),
                change(occluder, [from, to], |l| !l.is_reached),
            ];
            for (which, edge) in edges.into_iter().enumerate() {
                if let Some(p) = edge {
                    worst[which] = worst[which].max(step(p));
                    crossings[which] += 1;
                }
            }
        }
        println!("{model:?}: {crossings:?} crossings, steps of at most {worst:?}");
        assert!(
            crossings[0] > 100 && crossings[1] > LINES / 2,
            "{crossings:?}"
        );
        assert!(worst.iter().all(|w| *w <= MAX_STEP), "{model:?}: {worst:?}");
    }
}

/// AO of a receiver that faces the middle of a rectangle with half-extents `a` and `b` at a distance:
/// the form factor of a rectangle and a point on its axis.
fn occlusion_by_a_rectangle([a, b]: [f32; 2], distance: f32) -> f32 {
    let term = |a: f32, b: f32| {
        let root = a.hypot(distance);
        a / root * (b / root).atan()
    };
    2.0 / std::f32::consts::PI * (term(a, b) + term(b, a))
}

#[test]
fn a_wall_hides_more_far_away_than_a_sphere_would() {
    /// The largest error of AO in front of a wall. The law is exact for discs; four numbers fit it to
    /// all directions of a wall of 3 to 2 at once, which leaves 0.08 at its axis.
    const MAX_ERROR: f32 = 0.1;
    /// The least error without flatness at one of the distances.
    const WITHOUT: f32 = 0.3;
    let preset = Preset::Default;
    let wall = Model::Wall.mesh(None).unwrap();
    let grid = grid(&wall, &preset.placement(), &preset.options());
    let instance = Instance::at(Mat4::IDENTITY.to_cols_array_2d());
    let flat = Shaded::new(&grid, &instance);
    let mut spherical = Shaded::new(&grid, &instance);
    spherical.occluder.flatness = [0.0; 4];
    let [a, b, depth] = wall.bounds().half_extents().map(|r| r as f32);
    let reach = 2.0 * grid.spec().half_extents()[2] / flat.occluder.per_reach[2];
    let (mut worst, mut worst_spherical) = (0.0_f32, 0.0_f32);
    for step in 0..20 {
        // From the box to where the far field begins to fade.
        let z = grid.spec().half_extents()[2] * 1.01_f32.powi(step * step);
        if z > 0.75 * reach {
            break;
        }
        let truth = occlusion_by_a_rectangle([a, b], z - depth);
        let [x, y, _] = grid.spec().center();
        let error = |shaded: &Shaded| (shaded.cone([x, y, z], [0.0, 0.0, -1.0]) - truth).abs();
        worst = worst.max(error(&flat));
        worst_spherical = worst_spherical.max(error(&spherical));
    }
    println!("wall: off by {worst}, without flatness by {worst_spherical}");
    assert!(
        worst <= MAX_ERROR && worst_spherical >= WITHOUT,
        "{worst} {worst_spherical}"
    );
}
