//! Rays that count what they hit as the volumes do, in double precision: every triangle by its volume
//! and weight, or the heaviest alone.

use aogrid_runtime::VolumeWeight;
use aogrid_scene::reference::Receiver;
use glam::DVec3;

/// The strata of a receiver's rays along each of two axes.
const STRATA: u32 = 80;

/// Triangles in world space, counter-clockwise from their fronts, and their volumes.
pub(super) struct Weighted {
    pub triangles: Vec<[DVec3; 3]>,
    pub extent: f64,
    pub weight: VolumeWeight,
}

/// A receiver's occlusion by rays.
pub(super) struct Counted {
    /// The sum over all triangles that a ray meets, at most 1 in the mean.
    pub every: f64,
    /// The heaviest triangle of each ray alone.
    pub heaviest: f64,
}

/// A triangle whose volume holds the receiver: the planes through it and the edges, and its weight.
struct Near {
    sides: [DVec3; 3],
    weight: f64,
}

impl Weighted {
    /// Returns what cosine-distributed, stratified rays of a receiver meet.
    pub(super) fn count(&self, receiver: &Receiver) -> Counted {
        let p = DVec3::from(receiver.position);
        let near = self.triangles.iter();
        let near = near.filter_map(|corners| self.near(corners.map(|c| c - p)));
        let near: Vec<Near> = near.collect();
        let normal = DVec3::from(receiver.normal);
        let (x, y) = normal.any_orthonormal_pair();
        let mut random = Sequence(p.to_array().map(f64::to_bits).iter().fold(1, |a, b| a ^ b));
        let (mut every, mut heaviest) = (0.0, 0.0);
        for cell in 0..STRATA * STRATA {
            let u = (f64::from(cell % STRATA) + random.next()) / f64::from(STRATA);
            let v = (f64::from(cell / STRATA) + random.next()) / f64::from(STRATA);
            let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
            let ray = v.sqrt() * (cos * x + sin * y) + (1.0 - v).sqrt() * normal;
            let met = near
                .iter()
                .filter(|t| t.sides.iter().all(|s| s.dot(ray) > 0.0));
            let mut most = 0.0_f64;
            for triangle in met {
                every += triangle.weight;
                most = most.max(triangle.weight);
            }
            heaviest += most;
        }
        let rays = f64::from(STRATA * STRATA);
        Counted {
            every: f64::min(every / rays, 1.0),
            heaviest: heaviest / rays,
        }
    }

    /// Returns a triangle relative to a receiver, if its volume holds the receiver.
    fn near(&self, [a, b, c]: [DVec3; 3]) -> Option<Near> {
        let normal = (b - a).cross(c - a).normalize();
        let height = -a.dot(normal);
        if !(height > 0.0 && height < self.extent) {
            return None;
        }
        let foot = -height * normal;
        let edges = [[a, b], [b, c], [c, a]];
        let beyond = edges.map(|[a, b]| (b - a).cross(normal).normalize().dot(foot - a));
        let apart = edges.map(|[a, b]| {
            let along = b - a;
            let t = ((foot - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (foot - a - t * along).length()
        });
        let distance = match beyond.iter().all(|d| *d <= 0.0) {
            true => 0.0,
            false => apart.into_iter().fold(f64::INFINITY, f64::min),
        };
        let ramp = |d: f64| (1.0 - d / self.extent).clamp(0.0, 1.0);
        let weight = match self.weight {
            VolumeWeight::None => f64::from(u8::from(distance < self.extent)),
            VolumeWeight::Linear { exponent } => {
                ramp(distance) * ramp(height).powf(exponent.into())
            }
            VolumeWeight::Edges { exponent } => {
                beyond.map(ramp).iter().product::<f64>() * ramp(height).powf(exponent.into())
            }
        };
        // The receiver is in front of the plane, so that the front's winding is clockwise from it.
        let sides = [b.cross(a), c.cross(b), a.cross(c)];
        (weight > 0.0).then_some(Near { sides, weight })
    }
}

/// A generator of numbers in [0,1).
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
