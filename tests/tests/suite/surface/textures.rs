//! Textures of a real model: the borders of its charts, what dilation reaches, and tangent frames.

use aogrid_bake_core::UNOBSERVED;
use aogrid_bake_core::mesh::MeshFile;
use aogrid_bake_core::surface::{
    SurfaceOptions, SurfaceRecord, TexelPoints, TexelSampling, VertexGroups, default_offset,
    dilate, dot, texel_means, texel_points,
};
use aogrid_baker_cpu::bake_surface;
use aogrid_tests::shared;

/// The texture's side: charts are some dozens of texels wide.
const SIZE: u32 = 256;

/// The mean step from an interior texel down to one on the border, where the surface is flat, and the
/// largest: charts end at creases, too, where accessibility falls by as much within a texel of this size.
const MEAN_STEP: f32 = 0.01;
const MAX_STEP: f32 = 0.15;

/// The least cosine between the faces of texels that are flat together: 1°.
const FLAT: f64 = 0.999_85;

/// The points of spot's charts and their texels.
fn spot() -> Option<(TexelPoints, Vec<Option<SurfaceRecord>>)> {
    let file = MeshFile::read(&shared("data/meshes/spot_tri.obj")?).unwrap();
    let loaded = file.parse_textured().unwrap();
    let (coordinates, normals) = file.obj_attributes().unwrap().unwrap();
    let groups = VertexGroups::new(&loaded.mesh, normals);
    let sampling = TexelSampling {
        size: SIZE,
        per_side: 1,
    };
    let offset = default_offset(&loaded.mesh);
    let points = texel_points(&loaded.mesh, &groups, &coordinates, sampling, offset);
    let options = SurfaceOptions {
        rays: 256,
        ..SurfaceOptions::recommended()
    };
    let bake = bake_surface(&loaded.mesh, &points.points, &options, None, UNOBSERVED).unwrap();
    let texels = texel_means(&points, &bake.records, SIZE);
    Some((points, texels))
}

#[test]
fn charts_have_no_dark_borders() {
    let Some((points, mut texels)) = spot() else {
        return;
    };
    assert!(points.overlaps < 0.01, "{}", points.overlaps);
    let mut faces = vec![None; texels.len()];
    for (texel, point) in points.texels.iter().zip(&points.points) {
        faces[*texel as usize] = Some(point.face);
    }
    let at = |x: i32, y: i32| {
        let is_within = (0..SIZE as i32).contains(&x) && (0..SIZE as i32).contains(&y);
        is_within.then_some((y * SIZE as i32 + x) as usize)
    };
    let (mut n, mut worst, mut sum) = (0, 0.0_f32, 0.0);
    for idx in (0..texels.len()).filter(|idx| texels[*idx].is_some()) {
        let (x, y) = (idx as i32 % SIZE as i32, idx as i32 / SIZE as i32);
        for [dx, dy] in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
            // Nothing on one side, and the interior on the other.
            let outside = at(x + dx, y + dy).is_none_or(|idx| texels[idx].is_none());
            let Some(inner) = at(x - dx, y - dy).filter(|_| outside) else {
                continue;
            };
            let (Some(a), Some(b)) = (&texels[idx], &texels[inner]) else {
                continue;
            };
            let flat = faces[idx]
                .zip(faces[inner])
                .is_some_and(|(a, b)| dot(a, b) > FLAT);
            if flat {
                n += 1;
                worst = worst.max(b.accessibility - a.accessibility);
                sum += b.accessibility - a.accessibility;
            }
        }
    }
    let mean = sum / n as f32;
    println!("{n} border texels, {mean:.4} below the interior, the darkest {worst:.4}");
    assert!(n > 500 && worst <= MAX_STEP, "{n} {worst}");
    assert!(mean.abs() <= MEAN_STEP, "{mean}");
    check_dilation(&mut texels);
}

/// Texels of level 4 that hold some of a chart hold no background, and neither do those of level 3 beside
/// them, which a bilinear look-up takes, too.
fn check_dilation(texels: &mut [Option<SurfaceRecord>]) {
    let charts: Vec<bool> = texels.iter().map(Option::is_some).collect();
    dilate(texels, SIZE, 16);
    let size = SIZE as usize;
    let within = |block: [usize; 2], side: usize, test: &dyn Fn(usize) -> bool| {
        let mut all = (0..side * side).map(|idx| [idx % side, idx / side]);
        all.all(|[x, y]| test((block[1] * side + y) * size + block[0] * side + x))
    };
    let mut n = 0;
    for (side, reach) in [(16, 0), (8, 1)] {
        let blocks = size / side;
        for block in (0..blocks * blocks).map(|idx| [idx % blocks, idx / blocks]) {
            if within(block, side, &|idx| !charts[idx]) {
                continue;
            }
            n += 1;
            for dy in block[1].saturating_sub(reach)..=(block[1] + reach).min(blocks - 1) {
                for dx in block[0].saturating_sub(reach)..=(block[0] + reach).min(blocks - 1) {
                    let is_covered = within([dx, dy], side, &|idx| texels[idx].is_some());
                    assert!(is_covered, "level block {dx}, {dy} of {side}");
                }
            }
        }
    }
    assert!(n > 50, "{n}");
}
