//! A ray in single precision, for the tree, and the bounds of its rounding errors.

/// The distance from the center, in radii of the mesh, beyond which a ray is started closer to the
/// mesh, and the distance at which it is started then.
const MAX_START: f64 = 2.0;
const START: f64 = 1.25;

/// The maximum distance of a hit from the start of a ray, in radii of the mesh: the ray starts at
/// most two radii away from the center. A little more excludes nothing by rounding.
const MAX_REACH: f64 = 4.0;

/// The relative rounding error of single precision.
const EPSILON: f64 = 0.5 * f32::EPSILON as f64;

/// The relative error of a few roundings in double precision.
const DOUBLE_ROUNDING: f64 = 8.0 * 0.5 * f64::EPSILON;

/// A ray as the tree's boxes and triangles see it: in single precision, and started near the mesh.
///
/// # The error bounds
///
/// Boxes are padded by more than all rounding errors. Triangles are tested as in
/// [`Ray`](crate::triangle::Ray), and whoever tests them also computes bounds of the errors, so that
/// only certain answers count. With ε = 2⁻²⁴, corners up to A and a start up to B from the center:
///
/// - a coordinate across the ray, c − s·w − k, has an error of at most δ + ε|x|, where δ = (6A + 2B)ε
///   are six roundings of numbers up to A (c, w, s, s·w, and the difference, up to 2A) and one of k,
///   up to 2B. A coordinate along the ray has fewer.
/// - An area u = x·y' − y·x' of coordinates up to m has at most E = 4mδ + 8εm² + 2δ².
/// - T = s·Σ uᵢwᵢ, with |wᵢ| up to W and areas of one sign within E, so that Σ|uᵢ| ≤ |det| + 6E, has
///   at most |s|·(12E·(W + δ) + (|det| + 6E)(δ + 8εW)). The factor 12 instead of 3 also covers a
///   wrong sign of det.
///
/// The factors in the code are a little larger, for products of errors and the rounding of the
/// bounds.
pub(super) struct PackedRay {
    /// The inverse of the direction.
    pub inverse: [f32; 3],
    /// The start, divided by the direction.
    pub start_by_direction: [f32; 3],
    /// The index of each axis' nearer planes in a node. The others are three further or before.
    pub near: [usize; 3],
    pub far: [usize; 3],
    /// The distance from the start up to which boxes count.
    pub t_max: f32,
    pub axes: [usize; 3],
    pub shear: [f32; 2],
    /// The start, sheared: along the major axis, then across the ray.
    pub start: [f32; 3],
    /// The inverse of the direction's largest component.
    pub scale: f32,
    /// The distance from the ray's origin to its start.
    skipped: f64,
    /// The distances from the start at which a hit may lie: from −`before` to `after`. No hit is
    /// further from the start than the mesh.
    pub before: f32,
    pub after: f32,
    pub errors: ErrorBounds,
}

/// The error bounds of [`PackedRay`] as polynomials. Pairs are a constant and a factor.
pub(super) struct ErrorBounds {
    /// E = `area` + m · (`area_by_size[0]` + `area_by_size[1]` · m).
    pub area: f32,
    pub area_by_size: [f32; 2],
    /// The error of T: E · (`t_by_area[0]` + `t_by_area[1]` · W)
    /// + |det| · (`t_by_det[0]` + `t_by_det[1]` · W).
    pub t_by_area: [f32; 2],
    pub t_by_det: [f32; 2],
}

/// The error of det: [`DET_BY_AREA`] · E + [`DET_BY_DET`] · |det|.
pub(super) const DET_BY_AREA: f32 = 3.1;
pub(super) const DET_BY_DET: f32 = 4.0 * EPSILON as f32;

impl ErrorBounds {
    /// Returns the bounds for the error δ of a coordinate and the factor s of T.
    #[inline(always)]
    fn new(delta: f64, scale: f64) -> Self {
        let (delta, scale, epsilon) = (delta as f32, scale.abs() as f32, EPSILON as f32);
        Self {
            area: 3.0 * delta * delta,
            area_by_size: [4.1 * delta, 9.0 * epsilon],
            t_by_area: [19.0 * scale * delta, 13.0 * scale],
            t_by_det: [1.1 * scale * delta, 9.0 * scale * epsilon],
        }
    }

    /// Returns E of one triangle, whose corners are up to m across the ray.
    #[inline(always)]
    pub(super) fn of_areas(&self, m: f32) -> f32 {
        self.area + m * (self.area_by_size[0] + self.area_by_size[1] * m)
    }

    /// Returns the errors of T and of det of one triangle, for E and corners up to W along the ray.
    #[inline(always)]
    pub(super) fn of_distance(&self, e: f32, det: f32, w: f32) -> [f32; 2] {
        let t = e * (self.t_by_area[0] + self.t_by_area[1] * w)
            + det * (self.t_by_det[0] + self.t_by_det[1] * w);
        [t, DET_BY_AREA * e + DET_BY_DET * det]
    }
}

/// The size of a mesh around its center.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    /// The largest magnitude of a coordinate.
    pub reach: f64,
    /// The largest padding of a box.
    pub padding: f64,
}

impl Extent {
    fn radius(self) -> f64 {
        3.0_f64.sqrt() * self.reach
    }
}

impl PackedRay {
    /// Returns a ray and the distance from its origin to its start.
    #[inline(always)]
    pub(super) fn new(exact: &crate::triangle::Ray, unit: [f64; 3], extent: Extent) -> Self {
        let origin = exact.origin;
        let squared = origin[0] * origin[0] + origin[1] * origin[1] + origin[2] * origin[2];
        let radius = extent.radius();
        let skipped = match squared > MAX_START * MAX_START * radius * radius {
            true => squared.sqrt() - START * radius,
            false => 0.0,
        };
        // No closures here: they would not be compiled for the SIMD level.
        let start = [
            origin[0] + skipped * unit[0],
            origin[1] + skipped * unit[1],
            origin[2] + skipped * unit[2],
        ];
        let inverse = [
            safe_inverse(unit[0] as f32),
            safe_inverse(unit[1] as f32),
            safe_inverse(unit[2] as f32),
        ];
        let behind = [
            3 * usize::from(inverse[0] < 0.0),
            3 * usize::from(inverse[1] < 0.0),
            3 * usize::from(inverse[2] < 0.0),
        ];
        let [major, across_u, across_v] = exact.axes;
        let (w, u, v) = (start[major], start[across_u], start[across_v]);
        let [shear_u, shear_v] = exact.shear;
        let start_max = start[0].abs().max(start[1].abs()).max(start[2].abs());
        let after = (exact.t_max - skipped).min(MAX_REACH * radius);
        let delta = (6.0 * extent.reach + 2.0 * start_max) * EPSILON
            + DOUBLE_ROUNDING * (skipped + start_max + extent.reach);
        Self {
            inverse,
            start_by_direction: [
                start[0] as f32 * inverse[0],
                start[1] as f32 * inverse[1],
                start[2] as f32 * inverse[2],
            ],
            near: [behind[0], 1 + behind[1], 2 + behind[2]],
            far: [3 - behind[0], 4 - behind[1], 5 - behind[2]],
            t_max: (after + extent.padding) as f32,
            axes: exact.axes,
            shear: [shear_u as f32, shear_v as f32],
            start: [w as f32, (u - shear_u * w) as f32, (v - shear_v * w) as f32],
            scale: exact.scale as f32,
            skipped,
            before: skipped.min(MAX_REACH * radius) as f32,
            after: after as f32,
            errors: ErrorBounds::new(delta, exact.scale),
        }
    }

    /// Ends the ray at a distance from its origin.
    pub(super) fn shorten(&mut self, distance: f64, extent: Extent) {
        let after = distance - self.skipped;
        self.after = (after + extent.padding) as f32;
        self.t_max = self.after;
    }
}

/// Returns 1/x, or a large number of x's sign if x is so small that a ray moves by less than a
/// rounding error along its axis.
#[inline(always)]
fn safe_inverse(x: f32) -> f32 {
    match x.abs() <= f32::EPSILON {
        true => (1.0 / f32::EPSILON).copysign(x),
        false => 1.0 / x,
    }
}
