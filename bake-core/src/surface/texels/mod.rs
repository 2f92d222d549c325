//! Points of a texture's texels.
//!
//! Sampling is conservative: a sample off the chart whose texel the chart touches is moved to the nearest
//! point *on* the chart. Texel centers off the surface would trace from behind walls, which is why baked
//! textures have dark lines along their seams.

#[cfg(test)]
mod tests;

use super::vector::{cross, normalized, plus};
use super::{SurfacePoint, SurfaceRecord, VertexGroups};
use crate::TriangleMesh;

/// The largest number of samples of a texture: they are held at once.
pub const MAX_TEXEL_SAMPLES: usize = 1 << 24;

/// The distance in texels at which a sample is moved to a chart: the half-diagonal of a texel.
const MAX_MOVE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// The share of a triangle's height by which a sample must be within it to count as overlapping: shared
/// edges do not.
const OVERLAP_MARGIN: f32 = 1e-3;

/// No triangle.
const NONE: u32 = u32::MAX;

/// The samples of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelSampling {
    /// The width and height in texels.
    pub size: u32,
    /// Samples along a texel's side: their squares are 1, 4 or 16 a texel.
    pub per_side: u32,
}

/// The points of a texture.
#[derive(Clone, Debug)]
pub struct TexelPoints {
    /// The points.
    pub points: Vec<SurfacePoint>,
    /// The texel of each point, row by row from v = 0, in order.
    pub texels: Vec<u32>,
    /// The triangle of each point.
    pub triangles: Vec<u32>,
    /// The weights of the triangle's corners at each point, which add up to 1 but for rounding.
    pub weights: Vec<[f32; 3]>,
    /// The share of covered samples that two triangles or more cover.
    pub overlaps: f64,
    /// The first pair of triangles that overlap.
    pub first_overlap: Option<[u32; 2]>,
    /// The number of triangles with coordinates outside 0..1, where the texture ends.
    pub outside: usize,
    /// The number of triangles without an area, on the surface or in the texture.
    pub flat: usize,
}

impl TexelPoints {
    /// Keeps the points whose entry is true.
    ///
    /// # Panics
    ///
    /// If there is not an entry for each point.
    pub fn retain(&mut self, kept: &[bool]) {
        assert_eq!(kept.len(), self.points.len(), "an entry for each point");
        fn filter<T>(list: &mut Vec<T>, kept: &[bool]) {
            let mut kept = kept.iter();
            list.retain(|_| kept.next().is_some_and(|kept| *kept));
        }
        filter(&mut self.points, kept);
        filter(&mut self.texels, kept);
        filter(&mut self.triangles, kept);
        filter(&mut self.weights, kept);
    }
}

/// The squared distances that stand for a sample within one triangle, and within several.
const WITHIN: f32 = -1.0;
const OVERLAPPED: f32 = -2.0;

/// The triangle nearest to a sample.
#[derive(Clone, Copy)]
struct Nearest {
    squared: f32,
    triangle: u32,
}

/// Returns the points of all texels that the mesh's charts touch. `coordinates` has the texture
/// coordinates of each vertex, v downward as in glTF. The axis is the interpolated normal of the file, or
/// else that of the face; positions are `offset` object units along the face's normal.
///
/// # Panics
///
/// If there are not as many coordinates as vertices, or more than [`MAX_TEXEL_SAMPLES`] samples.
pub fn texel_points(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    coordinates: &[[f32; 2]],
    sampling: TexelSampling,
    offset: f64,
) -> TexelPoints {
    let n = (sampling.size * sampling.per_side) as usize;
    assert!(n * n <= MAX_TEXEL_SAMPLES, "{n} samples along a side");
    assert_eq!(coordinates.len(), mesh.positions().len());
    let mut raster = Raster::new(n, MAX_MOVE * sampling.per_side as f32);
    for (idx, triangle) in (0..).zip(mesh.triangles()) {
        let chart = triangle.map(|v| coordinates[v as usize].map(|c| c * n as f32));
        raster.triangle(idx, chart, face_normal(mesh, idx).is_some());
    }
    let mut points = TexelPoints {
        points: vec![],
        texels: vec![],
        triangles: vec![],
        weights: vec![],
        overlaps: raster.overlaps as f64 / raster.covered.max(1) as f64,
        first_overlap: raster.first_overlap,
        outside: raster.outside,
        flat: raster.flat,
    };
    let per_side = sampling.per_side as usize;
    for texel in 0..(sampling.size * sampling.size) as usize {
        let [column, row] = [
            texel % sampling.size as usize,
            texel / sampling.size as usize,
        ];
        for sample in 0..per_side * per_side {
            let x = column * per_side + sample % per_side;
            let y = row * per_side + sample / per_side;
            let triangle = raster.nearest[y * n + x].triangle;
            if triangle == NONE {
                continue;
            }
            let chart = mesh.triangles()[triangle as usize]
                .map(|v| coordinates[v as usize].map(|c| c * n as f32));
            let weights = nearest_weights(chart, center(x, y));
            points
                .points
                .push(point(mesh, groups, triangle, weights, offset));
            points.texels.push(texel as u32);
            points.triangles.push(triangle);
            points.weights.push(weights);
        }
    }
    points
}

fn center(x: usize, y: usize) -> [f32; 2] {
    [x as f32 + 0.5, y as f32 + 0.5]
}

/// Returns the normal of a triangle by its winding, of length 1, if it has an area.
pub(super) fn face_normal(mesh: &TriangleMesh, triangle: u32) -> Option<[f64; 3]> {
    let corner = |v: u32| mesh.positions()[v as usize].map(f64::from);
    let [a, b, c] = mesh.triangles()[triangle as usize].map(corner);
    normalized(cross(plus(b, -1.0, a), plus(c, -1.0, a)))
}

/// Returns the point of a triangle with these weights of its corners.
fn point(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    triangle: u32,
    weights: [f32; 3],
    offset: f64,
) -> SurfacePoint {
    let face = face_normal(mesh, triangle).unwrap_or([0.0, 1.0, 0.0]);
    let (mut position, mut axis) = ([0.0; 3], [0.0; 3]);
    // Weights of single floats do not quite add up to 1, which would move the point.
    let weights = weights.map(f64::from);
    let total: f64 = weights.iter().sum();
    let weights = weights.map(|weight| weight / total);
    for (vertex, weight) in mesh.triangles()[triangle as usize].into_iter().zip(weights) {
        let corner = mesh.positions()[vertex as usize].map(f64::from);
        position = plus(position, weight, corner);
        let normal = groups.normal(vertex as usize).unwrap_or(face);
        axis = plus(axis, weight, normal);
    }
    SurfacePoint {
        position: plus(position, offset, face),
        axis: normalized(axis).unwrap_or(face),
        face,
    }
}

/// The samples of a texture with their nearest triangles.
struct Raster {
    n: usize,
    /// The largest distance of a sample that is moved, in samples.
    reach: f32,
    nearest: Vec<Nearest>,
    covered: usize,
    overlaps: usize,
    first_overlap: Option<[u32; 2]>,
    outside: usize,
    flat: usize,
}

impl Raster {
    fn new(n: usize, reach: f32) -> Self {
        let none = Nearest {
            squared: reach * reach,
            triangle: NONE,
        };
        Self {
            n,
            reach,
            nearest: vec![none; n * n],
            covered: 0,
            overlaps: 0,
            first_overlap: None,
            outside: 0,
            flat: 0,
        }
    }

    /// Adds a triangle, with corners in samples.
    fn triangle(&mut self, idx: u32, chart: [[f32; 2]; 3], has_area: bool) {
        let all = chart.as_flattened();
        let n = self.n as f32;
        self.outside += usize::from(!all.iter().all(|c| (0.0..=n).contains(c)));
        if !has_area || double_area(chart) == 0.0 || !all.iter().all(|c| c.is_finite()) {
            self.flat += 1;
            return;
        }
        let range = |axis: usize| {
            let of = |f: fn(f32, f32) -> f32| f(f(chart[0][axis], chart[1][axis]), chart[2][axis]);
            let first = (of(f32::min) - self.reach).clamp(0.0, n) as usize;
            first..((of(f32::max) + self.reach).clamp(0.0, n) as usize + 1).min(self.n)
        };
        let columns = range(0);
        for y in range(1) {
            for x in columns.clone() {
                self.sample(idx, chart, x, y);
            }
        }
    }

    fn sample(&mut self, idx: u32, chart: [[f32; 2]; 3], x: usize, y: usize) {
        let at = center(x, y);
        let [distance, depth] = distance_and_depth(chart, at);
        let nearest = &mut self.nearest[y * self.n + x];
        if depth > OVERLAP_MARGIN {
            // Nothing is nearer than within; a sample of several triangles is counted once as covered
            // and once as overlapping.
            if nearest.squared >= 0.0 {
                self.covered += 1;
                *nearest = Nearest {
                    squared: WITHIN,
                    triangle: idx,
                };
            } else if nearest.squared == WITHIN {
                self.overlaps += 1;
                self.first_overlap.get_or_insert([nearest.triangle, idx]);
                nearest.squared = OVERLAPPED;
            }
        } else if distance < nearest.squared {
            *nearest = Nearest {
                squared: distance,
                triangle: idx,
            };
        }
    }
}

fn double_area([a, b, c]: [[f32; 2]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Returns the weights of the corners for a point in the plane, below zero for those across an edge.
fn weights(chart: [[f32; 2]; 3], p: [f32; 2]) -> [f32; 3] {
    let [a, b, c] = chart;
    let total = double_area(chart);
    [[p, b, c], [a, p, c], [a, b, p]].map(|part| double_area(part) / total)
}

/// Returns the point of an edge nearest to `p` as a share of the way from `a` to `b`, and its squared
/// distance.
fn nearest_on_edge(a: [f32; 2], b: [f32; 2], p: [f32; 2]) -> [f32; 2] {
    let along = [b[0] - a[0], b[1] - a[1]];
    let to = [p[0] - a[0], p[1] - a[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let share = match squared > 0.0 {
        true => ((to[0] * along[0] + to[1] * along[1]) / squared).clamp(0.0, 1.0),
        false => 0.0,
    };
    let rest = [to[0] - share * along[0], to[1] - share * along[1]];
    [share, rest[0] * rest[0] + rest[1] * rest[1]]
}

/// Returns the squared distance of a point from a triangle, zero within it, and the smallest weight.
fn distance_and_depth(chart: [[f32; 2]; 3], p: [f32; 2]) -> [f32; 2] {
    let [u, v, w] = weights(chart, p);
    let depth = u.min(v).min(w);
    if depth >= 0.0 {
        return [0.0, depth];
    }
    let [a, b, c] = chart;
    let edges = [[a, b], [b, c], [c, a]].map(|[a, b]| nearest_on_edge(a, b, p)[1]);
    [edges[0].min(edges[1]).min(edges[2]), depth]
}

/// Returns the weights of the point of a triangle that is nearest to `p`.
fn nearest_weights(chart: [[f32; 2]; 3], p: [f32; 2]) -> [f32; 3] {
    let within = weights(chart, p);
    if within.iter().all(|w| *w >= 0.0) {
        return within;
    }
    let (mut best, mut found) = (f32::INFINITY, [1.0, 0.0, 0.0]);
    for edge in 0..3 {
        let (a, b) = (edge, (edge + 1) % 3);
        let [share, squared] = nearest_on_edge(chart[a], chart[b], p);
        if squared < best {
            best = squared;
            found = [0.0; 3];
            found[a] = 1.0 - share;
            found[b] = share;
        }
    }
    found
}

/// Returns the record of each texel, the mean of its samples; `None` where no chart is.
pub fn texel_means(
    points: &TexelPoints,
    records: &[SurfaceRecord],
    size: u32,
) -> Vec<Option<SurfaceRecord>> {
    let mut texels = vec![None; (size * size) as usize];
    let mut start = 0;
    for of_texel in points.texels.chunk_by(|a, b| a == b) {
        let samples = &records[start..start + of_texel.len()];
        start += of_texel.len();
        let share = 1.0 / samples.len() as f64;
        let (mut accessibility, mut sum) = (0.0, [0.0; 3]);
        for sample in samples {
            accessibility += share * f64::from(sample.accessibility);
            sum = plus(sum, share, sample.bent_normal.map(f64::from));
        }
        let bent_normal = normalized(sum).map_or(samples[0].bent_normal, |v| v.map(|v| v as f32));
        texels[of_texel[0] as usize] = Some(SurfaceRecord {
            accessibility: accessibility as f32,
            bent_normal,
        });
    }
    texels
}

/// Gives texels up to `distance` texels off the charts, along the axes and diagonals, the record of the
/// nearest texel on one, so that filtering and smaller mip levels see no background.
pub fn dilate(texels: &mut [Option<SurfaceRecord>], size: u32, distance: u32) {
    let size = size as usize;
    // The texel on a chart that each texel has its record from.
    let mut seeds: Vec<_> = (0..texels.len())
        .map(|idx| texels[idx].is_some().then_some(idx))
        .collect();
    for _ in 0..distance {
        let mut found = Vec::new();
        for idx in (0..seeds.len()).filter(|idx| seeds[*idx].is_none()) {
            let near = around(idx, size).filter_map(|near| seeds[near]);
            let nearest = near.min_by_key(|&seed| (squared_distance(idx, seed, size), seed));
            found.extend(nearest.map(|seed| (idx, seed)));
        }
        if found.is_empty() {
            return;
        }
        for (idx, seed) in found {
            seeds[idx] = Some(seed);
            texels[idx] = texels[seed];
        }
    }
}

/// Returns the texels around one.
fn around(idx: usize, size: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (idx % size, idx / size);
    let rows = y.saturating_sub(1)..(y + 2).min(size);
    rows.flat_map(move |row| {
        (x.saturating_sub(1)..(x + 2).min(size)).map(move |column| row * size + column)
    })
}

fn squared_distance(a: usize, b: usize, size: usize) -> usize {
    let along = |p: usize, q: usize| p.abs_diff(q).pow(2);
    along(a % size, b % size) + along(a / size, b / size)
}
