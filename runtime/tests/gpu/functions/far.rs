use super::*;
use crate::grids::{RADIUS, ball_in, flattened, length};

/// The threshold of the far field in these tests: it ends some three boxes away.
const THRESHOLD: f32 = 0.02;

/// Returns the transformed instance with a far field and full strength.
fn far() -> Instance {
    Instance {
        far_field: Some(THRESHOLD),
        strength: 1.0,
        ..transformed()
    }
}

/// Returns points up to three boxes away.
fn around() -> Vec<Input> {
    let world = glam::Mat4::from_cols_array_2d(&transformed().world_from_object);
    let center = world.transform_point3(glam::Vec3::from(spec().center()));
    let mut inputs = outside();
    for [p, _] in &mut inputs {
        let from_center = glam::Vec3::new(p[0], p[1], p[2]) - center;
        // Those that lie in the box are spread as well.
        *p = (center + 2.5 * from_center).extend(1.0).to_array();
    }
    inputs
}

#[test]
fn the_far_field_matches_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let table = CpuTexture::transmittance_table();
    for encoding in [Encoding::Moment, Encoding::Cone] {
        let harness = Harness::new(&gpu, flattened(&ball(encoding, TexelFormat::F16)), &far());
        let grid = CpuTexture::of_grid(&harness.grid);
        let inputs = around();
        let occluder = &harness.occluder;
        let worst = harness.max_difference(
            "let t = aogrid_cone(occluder, grid, transmittance, linear_clamp, p, n);
             return vec4f(t, aogrid_occlusion_of_cone(occluder, grid, linear_clamp, p, false), 0, 0);",
            &inputs,
            |p, n| {
                let t = aogrid_cone(occluder, &grid, &table, p, n);
                [t, aogrid_occlusion_of_cone(occluder, &grid, p, false), 0.0, 0.0]
            },
        );
        assert!(worst[0] <= harness.cone_error(), "{encoding:?}: {worst:?}");
        assert!(
            worst[1] <= 2.0 * harness.channel_error(),
            "{encoding:?}: {worst:?}"
        );
        let states = inputs.iter().map(|[p, _]| {
            let lookup = aogrid_lookup(occluder, [p[0], p[1], p[2]]);
            (lookup.is_reached, lookup.distance > 1.0)
        });
        let distant = states.clone().filter(|s| *s == (true, true)).count();
        let beyond = states.filter(|s| !s.0).count();
        assert!(distant > 5000 && beyond > 1000, "{distant} {beyond}");
    }
}

/// A ball in the middle of a cube: the hull's sin²α falls with the distance squared, exactly as the
/// continuation says, and the axis points to the center.
#[test]
fn a_ball_in_the_middle_of_its_box_is_continued_exactly() {
    let spec = aogrid_grid_format::GridSpec::new([32; 3], [0.0; 3], [1.5; 3]).unwrap();
    let grid = ball_in(spec, Encoding::Moment, TexelFormat::F32);
    let instance = Instance {
        far_field: Some(THRESHOLD),
        ..Instance::at(glam::Mat4::IDENTITY.to_cols_array_2d())
    };
    let occluder = AogridOccluder::new(&grid, &instance).unwrap();
    let texture = CpuTexture::of_grid(&grid);
    let mut tested = 0;
    for idx in 0..4000 {
        let direction = spiral(idx);
        let distance = 1.5 + 2.0 * (idx as f32 * 0.618).fract();
        let p = direction.map(|x| distance * x);
        let lookup = aogrid_lookup(&occluder, p);
        let fade_starts = 0.75 * 2.0 / occluder.per_reach[0] * 1.5;
        let in_hull = p.iter().all(|x| x.abs() <= 1.5 * 31.0 / 32.0);
        if in_hull || p.iter().any(|x| x.abs() > fade_starts) {
            continue;
        }
        let cone = aogrid_cone_of(&occluder, texture.sample(lookup.position), lookup);
        let a = cone.fraction * cone.density;
        let sine = RADIUS / distance;
        let truth = (1.0 - (1.0 - sine * sine).sqrt()) / 2.0;
        // Interpolation between cells h = 1/16 of the ball's diameter apart errs by h²/8 of the
        // second derivative, 6a/r², along each of three axes at a distance r above 1.4.
        let h = 3.0 / 32.0;
        let tolerance = 3.0 * h * h / 8.0 * 6.0 * truth / (1.4 * 1.4) + 1e-6;
        assert!((a - truth).abs() <= tolerance, "{p:?}: {a} {truth}");
        let along: f32 = (0..3).map(|x| -cone.axis[x] * direction[x]).sum();
        // Half a cell's turn.
        assert!(
            along > 1.0 - (h / 2.0 / 1.4).powi(2) / 2.0,
            "{p:?}: {along}"
        );
        tested += 1;
    }
    assert!(tested > 1000, "{tested}");
}

/// A ball off the middle: parallax turns the axes, which would otherwise point past it.
#[test]
fn axes_far_away_point_to_the_object_and_not_to_where_it_was_seen_from_the_hull() {
    /// The position of the ball in its box of half-extent 1.5.
    const OFFSET: f32 = 0.5;
    let spec = aogrid_grid_format::GridSpec::new([32; 3], [-OFFSET, 0.0, 0.0], [1.5; 3]).unwrap();
    let grid = ball_in(spec, Encoding::Moment, TexelFormat::F32);
    let instance = Instance {
        far_field: Some(THRESHOLD),
        ..Instance::at(glam::Mat4::IDENTITY.to_cols_array_2d())
    };
    let occluder = AogridOccluder::new(&grid, &instance).unwrap();
    let texture = CpuTexture::of_grid(&grid);
    let (mut worst, mut without) = (0.0_f32, 0.0_f32);
    for idx in 0..4000 {
        let direction = spiral(idx);
        let distance = 1.6 + 3.0 * (idx as f32 * 0.618).fract();
        let p: [f32; 3] = std::array::from_fn(|x| distance * direction[x] + spec.center()[x]);
        let lookup = aogrid_lookup(&occluder, p);
        if !lookup.is_reached || lookup.distance == 1.0 {
            continue;
        }
        let angle = |lookup: AogridLookup| {
            let cone = aogrid_cone_of(&occluder, texture.sample(lookup.position), lookup);
            let along: f32 = (0..3).map(|x| -cone.axis[x] * p[x] / length(p)).sum();
            along.clamp(-1.0, 1.0).acos()
        };
        worst = worst.max(angle(lookup));
        // The same without parallax: at the hull.
        without = without.max(angle(AogridLookup {
            distance: 1.0,
            ..lookup
        }));
    }
    // From the hull at h, the ball is at |h − b| instead of |h|: the turn is right but for that
    // ratio, which is off by up to OFFSET/1.5 where the hull is nearest; the angle between the two
    // directions is at most as large, and the product of both is a ninth.
    assert!(worst <= (OFFSET / 1.5).powi(2) + 0.05, "{worst}");
    assert!(without > 1.5 * worst, "{without} {worst}");
}

#[test]
fn an_object_looks_itself_up_a_quarter_of_a_cell_along_its_normal() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu, ball(Encoding::Moment, TexelFormat::F16), &far());
    let occluder = &harness.occluder;
    let cells = |p: [f32; 3]| -> [f32; 3] {
        let at = aogrid_grid_position(occluder, p);
        std::array::from_fn(|x| at[x] * spec().resolution()[x] as f32)
    };
    let inputs = outside();
    for [p, n] in inputs.iter().take(3000) {
        let [p, n] = [p, n].map(|&[x, y, z, _]| [x, y, z]);
        let moved = aogrid_lookup_on_itself(occluder, p, n);
        if moved.distance > 1.0 {
            continue;
        }
        let at = moved.position;
        let from = cells(p);
        let moved: [f32; 3] =
            std::array::from_fn(|x| at[x] * spec().resolution()[x] as f32 - from[x]);
        // Positions up to 24 cells are rounded.
        assert!((length(moved) - 0.25).abs() < 2e-5, "{moved:?}");
    }
    let worst = harness.max_difference(
        "let lookup = aogrid_lookup_on_itself(occluder, p, n);
         return vec4f(lookup.position, lookup.distance);",
        &inputs,
        |p, n| {
            let lookup = aogrid_lookup_on_itself(occluder, p, n);
            let [x, y, z] = lookup.position;
            [x, y, z, lookup.distance]
        },
    );
    // The distance from the center is rounded; beside the hull's edges the position turns by it.
    assert!(worst.iter().all(|w| *w <= 4.0 * ROUNDING), "{worst:?}");
    // The papers' encodings look up the receiver itself.
    let plain = AogridOccluder::new(&ball(Encoding::Cone, TexelFormat::F16), &far()).unwrap();
    for [p, n] in inputs.iter().take(100) {
        let [p, n] = [p, n].map(|&[x, y, z, _]| [x, y, z]);
        assert_eq!(
            aogrid_lookup_on_itself(&plain, p, n),
            aogrid_lookup(&plain, p)
        );
    }
}
