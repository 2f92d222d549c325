//! A triangle: its closest point, and the solid angle that it subtends.

use glam::DVec3;

/// A triangle in double precision.
pub(super) struct Triangle {
    pub corners: [DVec3; 3],
}

impl Triangle {
    pub(super) fn new(corners: [[f32; 3]; 3]) -> Self {
        Self {
            corners: corners.map(|p| DVec3::from(p.map(f64::from))),
        }
    }

    /// Returns the normal by the right-hand rule; its length is twice the area.
    pub(super) fn area_normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Returns the signed solid angle that the triangle subtends at a point.
    pub(super) fn solid_angle(&self, point: DVec3) -> f64 {
        let [a, b, c] = self.corners.map(|p| p - point);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(denominator)
    }

    /// Returns the closest point (Ericson, *Real-Time Collision Detection*, 5.1.5).
    pub(super) fn closest(&self, p: DVec3) -> DVec3 {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return a;
        }
        let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
        if d3 >= 0.0 && d4 <= d3 {
            return b;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return a + d1 / (d1 - d3) * ab;
        }
        let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
        if d6 >= 0.0 && d5 <= d6 {
            return c;
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return a + d2 / (d2 - d6) * ac;
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
        }
        let sum = va + vb + vc;
        a + vb / sum * ab + vc / sum * ac
    }
}
