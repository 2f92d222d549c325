use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Moments, Placement, RawGrid, TriangleMesh};
use aogrid_grid_format::Sampling;
use aogrid_tests::{convex_fraction, exact_options, raw, sphere_fraction};

/// The error bounds of six 16×16 faces against exact solid angles.
struct Tolerance {
    rms: f64,
    max: f64,
}

const SPHERE_TOLERANCE: Tolerance = Tolerance {
    rms: 0.002,
    max: 0.008,
};
const MAX_AXIS_RMS_DEGREES: f64 = 1.0;
const BOX_TOLERANCE: Tolerance = Tolerance {
    rms: 0.004,
    max: 0.015,
};
/// The largest error of a few cells next to the box's corners and edges. Such a cell sees
/// silhouettes along rows of texels on several faces at once, and a row counts either whole or not
/// at all: half a row of 16 texels in the middle of a face is (2/16 · 2/√2 sr)/4π/2 = 0.007 of the
/// sphere, on three faces 0.021.
const MAX_ERROR_AT_BOX_EDGES: f64 = 0.021;
/// The largest share of such cells.
const MAX_SHARE_AT_BOX_EDGES: f64 = 0.002;

/// Returns each cell's sample position in object space, its moments and its count.
fn samples(grid: &RawGrid) -> impl Iterator<Item = ([f64; 3], Moments, u32)> + '_ {
    (0..grid.counts.len()).map(|idx| {
        let cell = grid.spec.cell_at(idx);
        let from_center = grid.spec.sample_from_center(cell, [0.0; 3]);
        let center = grid.spec.center();
        let position = std::array::from_fn(|x| f64::from(center[x]) + from_center[x]);
        (position, grid.moments[idx], grid.counts[idx])
    })
}

struct Errors {
    n: usize,
    rms: f64,
    max: f64,
}

fn errors(differences: impl Iterator<Item = f64>) -> Errors {
    let (mut n, mut squares, mut max) = (0, 0.0, 0.0_f64);
    for difference in differences {
        n += 1;
        squares += difference * difference;
        max = max.max(difference.abs());
    }
    let rms = (squares / n as f64).sqrt();
    Errors { n, rms, max }
}

fn assert_within(found: &Errors, tolerance: &Tolerance) {
    let Errors { n, rms, max } = found;
    println!("rms {rms:.5}, max {max:.5} over {n} cells");
    assert!(
        *rms <= tolerance.rms && *max <= tolerance.max,
        "rms {rms}, max {max}"
    );
}

/// The center and the radius of the sphere model.
const CENTER: [f64; 3] = [0.0, 0.5, 0.0];
const RADIUS: f64 = 0.5;

fn from_center(position: [f64; 3]) -> ([f64; 3], f64) {
    let v: [f64; 3] = std::array::from_fn(|x| position[x] - CENTER[x]);
    (v, v.iter().map(|v| v * v).sum::<f64>().sqrt())
}

#[test]
fn a_ball_occludes_the_solid_angle_of_its_cap() {
    // 20 · 4⁶ triangles: the polyhedron's radius is within 1e-4 of the ball's.
    let ball = Model::Sphere.mesh(Some(81_920)).unwrap();
    assert_ball(&raw(&ball, &Placement::paper(), &exact_options()));
}

/// Asserts the accuracy of any baker's grid of the ball at 32³ cells.
pub(crate) fn assert_ball(grid: &RawGrid) {
    let outside = || samples(grid).filter(|(p, _, _)| from_center(*p).1 > RADIUS);
    let occlusion = errors(outside().map(|(position, found, _)| {
        f64::from(found.a) - sphere_fraction(RADIUS, from_center(position).1)
    }));
    assert!(occlusion.n > 30_000);
    assert_within(&occlusion, &SPHERE_TOLERANCE);

    let axis = errors(outside().map(|(position, found, _)| {
        let (v, distance) = from_center(position);
        let towards = v.map(|v| -v / distance);
        let d = found.axis().map(f64::from);
        let cos: f64 = (0..3).map(|x| towards[x] * d[x]).sum();
        cos.clamp(-1.0, 1.0).acos().to_degrees()
    }));
    println!("axis rms {:.3}°, max {:.3}°", axis.rms, axis.max);
    assert!(axis.rms <= MAX_AXIS_RMS_DEGREES, "{}", axis.rms);

    // Cells inside the ball are fully occluded.
    let inside = samples(grid).filter(|(p, _, _)| from_center(*p).1 < 0.999 * RADIUS);
    for (_, found, count) in inside {
        assert_eq!((count, found.a), (1536, 1.0));
    }
}

/// Whether a point is outside the box model, which has its faces at ±½, 0 and 1.
fn outside_box([x, y, z]: [f64; 3]) -> bool {
    x.abs() > 0.5 || z.abs() > 0.5 || !(0.0..=1.0).contains(&y)
}

#[test]
fn a_box_occludes_the_solid_angles_of_its_faces() {
    let mesh = Model::Box.mesh(None).unwrap();
    assert_box(&mesh, &raw(&mesh, &Placement::paper(), &exact_options()));

    // With rows half as wide every cell is within the tolerance.
    let mut fine = exact_options();
    fine.sampling = Sampling::CubeFaces { size: 32 };
    let placement = Placement {
        resolution: [16; 3],
        ..Placement::paper()
    };
    assert_within(
        &errors(box_errors(&mesh, &raw(&mesh, &placement, &fine)).into_iter()),
        &BOX_TOLERANCE,
    );
}

/// Returns the difference of every cell outside the box to its exact fraction.
fn box_errors(mesh: &TriangleMesh, grid: &RawGrid) -> Vec<f64> {
    let outside = samples(grid).filter(|(position, _, _)| outside_box(*position));
    let off = outside.map(|(p, found, _)| f64::from(found.a) - convex_fraction(mesh, p));
    off.collect()
}

/// Asserts the accuracy of any baker's grid of the box at 32³ cells.
pub(crate) fn assert_box(mesh: &TriangleMesh, grid: &RawGrid) {
    let coarse = box_errors(mesh, grid);
    assert!(coarse.len() > 30_000);
    let beyond = coarse
        .iter()
        .filter(|v| v.abs() > BOX_TOLERANCE.max)
        .count();
    println!(
        "{beyond} of {} cells are off by more than {}",
        coarse.len(),
        BOX_TOLERANCE.max
    );
    assert!(
        beyond as f64 <= MAX_SHARE_AT_BOX_EDGES * coarse.len() as f64,
        "{beyond}"
    );
    let tolerance = Tolerance {
        rms: BOX_TOLERANCE.rms,
        max: MAX_ERROR_AT_BOX_EDGES,
    };
    assert_within(&errors(coarse.into_iter()), &tolerance);
}

/// Returns the error of random rays against exact fractions, in standard deviations of a mean of n
/// yes-or-no outcomes, √(a(1−a)/n).
fn deviations(mesh: &TriangleMesh, exact: impl Fn([f64; 3]) -> f64, n: u32, seed: u64) -> Errors {
    let mut options = exact_options();
    options.sampling = Sampling::MonteCarlo { count: n, seed };
    let placement = Placement {
        resolution: [12; 3],
        ..Placement::paper()
    };
    let grid = raw(mesh, &placement, &options);
    let outside = samples(&grid).filter(|(position, _, _)| outside_box(*position));
    errors(outside.map(|(position, found, _)| {
        let a = exact(position);
        (f64::from(found.a) - a) / (a * (1.0 - a) / f64::from(n)).sqrt()
    }))
}

#[test]
fn random_rays_converge_to_exact_fractions() {
    let mesh = Model::Box.mesh(None).unwrap();
    for (n, seed) in [(256, 0), (256, 1), (4096, 2)] {
        let found = deviations(&mesh, |p| convex_fraction(&mesh, p), n, seed);
        // Among some 1,700 normal deviates, one exceeds 5 in a thousand seeds; their rms is 1
        // within 4/√(2·1700).
        println!("{n} rays: rms {:.3} σ, max {:.2} σ", found.rms, found.max);
        assert!(found.n > 1_600);
        assert!(found.max < 5.0, "{}", found.max);
        assert!((found.rms - 1.0).abs() < 0.07, "{}", found.rms);
    }
}

/// Odd faces have texels exactly along the axes, whose directions hold zeros.
#[test]
fn the_interior_of_a_box_is_enclosed_for_every_face_size() {
    let mesh = Model::Box.mesh(None).unwrap();
    let placement = Placement {
        resolution: [12; 3],
        ..Placement::paper()
    };
    for size in [8, 9, 15, 16, 17] {
        let mut options = exact_options();
        options.sampling = Sampling::CubeFaces { size };
        let grid = raw(&mesh, &placement, &options);
        for (position, found, count) in samples(&grid) {
            let inside = !outside_box(position);
            assert_eq!(
                count == 6 * size * size,
                inside,
                "size {size} at {position:?}"
            );
            assert!(!inside || (found.a, found.m) == (1.0, [0.0; 3]));
        }
    }
}
