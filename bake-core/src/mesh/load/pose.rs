//! Parts in their own frames, and their poses in the whole.

use std::sync::Arc;

use crate::mesh::TriangleMesh;

/// A part in its own frame, and its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PartMesh {
    /// The part's mesh in its own frame.
    pub mesh: Arc<TriangleMesh>,
    /// The pose of the part's frame in the whole.
    pub pose: Pose,
    /// The index of the first part with the same mesh, which one grid serves; its own if there is
    /// none before it.
    pub same_as: usize,
}

impl PartMesh {
    /// Returns a whole mesh as its own only part.
    pub fn whole(mesh: TriangleMesh) -> Self {
        Self {
            mesh: Arc::new(mesh),
            pose: Pose::IDENTITY,
            same_as: 0,
        }
    }
}

/// An affine transform `linear · p + translation`, in object units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The columns of the linear part: the images of the axes.
    pub linear: [[f64; 3]; 3],
    /// The image of the origin.
    pub translation: [f64; 3],
}

/// The deviation from a rotation with a uniform scale at which a pose no longer counts as one,
/// relative to its squared scale: some roundings of the single floats that files hold.
const SIMILARITY_TOLERANCE: f64 = 1e-5;

impl Pose {
    /// The pose that changes nothing.
    pub const IDENTITY: Self = Self {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// Returns the affine part of a matrix of four columns.
    pub(super) fn from_matrix(m: [f64; 16]) -> Self {
        Self {
            linear: [0, 4, 8].map(|c| [m[c], m[c + 1], m[c + 2]]),
            translation: [m[12], m[13], m[14]],
        }
    }

    /// Returns the image of a point.
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let linear = self.vector(p);
        std::array::from_fn(|x| linear[x] + self.translation[x])
    }

    /// Returns the image of a direction along the surface.
    pub(super) fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|x| (0..3).map(|c| self.linear[c][x] * v[c]).sum())
    }

    /// Returns the direction of a normal in the whole, not of length 1: by the cofactors of the linear
    /// part, with which normals stay across the surface, and outside if the pose mirrors.
    pub fn normal(&self, n: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.linear;
        let columns = [cross(b, c), cross(c, a), cross(a, b)];
        let sign = if self.determinant() < 0.0 { -1.0 } else { 1.0 };
        [0, 1, 2].map(|x| sign * (0..3).map(|i| columns[i][x] * n[i]).sum::<f64>())
    }

    /// Returns the direction in the part's own frame whose [normal](Pose::normal) is along `n`, not of
    /// length 1.
    pub fn own_normal(&self, n: [f64; 3]) -> [f64; 3] {
        self.linear.map(|axis| (0..3).map(|x| axis[x] * n[x]).sum())
    }

    /// Returns the pose that applies `first` and then this one.
    pub fn after(&self, first: &Self) -> Self {
        Self {
            linear: first.linear.map(|column| self.vector(column)),
            translation: self.point(first.translation),
        }
    }

    /// Returns the pose that undoes this one; `None` if it scales an axis to nothing.
    pub fn inverse(&self) -> Option<Self> {
        let determinant = self.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return None;
        }
        let [a, b, c] = self.linear;
        let rows = [cross(b, c), cross(c, a), cross(a, b)];
        let linear = Self {
            linear: [0, 1, 2].map(|x| rows.map(|row| row[x] / determinant)),
            translation: [0.0; 3],
        };
        let translation = linear.vector(self.translation).map(|v| -v);
        Some(Self {
            translation,
            ..linear
        })
    }

    /// Returns this pose without its translation, and the translation alone.
    pub(super) fn split(&self) -> [Self; 2] {
        let linear = Self {
            translation: [0.0; 3],
            ..*self
        };
        let translation = Self {
            translation: self.translation,
            ..Self::IDENTITY
        };
        [linear, translation]
    }

    /// Returns an upper bound of the factor by which lengths grow.
    pub(super) fn largest_scale(&self) -> f64 {
        let squares: f64 = self.linear.iter().flatten().map(|v| v * v).sum();
        squares.sqrt()
    }

    /// Returns the determinant of the linear part: below zero for a mirror image.
    pub fn determinant(&self) -> f64 {
        let [a, b, c] = self.linear;
        (0..3)
            .map(|x| {
                let (y, z) = ((x + 1) % 3, (x + 2) % 3);
                a[x] * (b[y] * c[z] - b[z] * c[y])
            })
            .sum()
    }

    /// Whether the linear part is a rotation or reflection with a uniform scale that is not zero, which
    /// a grid can be posed by exactly.
    pub fn is_similarity(&self) -> bool {
        let dot = |i: usize, j: usize| -> f64 {
            let pairs = self.linear[i].iter().zip(&self.linear[j]);
            pairs.map(|(a, b)| a * b).sum()
        };
        let square = dot(0, 0);
        let close =
            |value: f64, expected: f64| (value - expected).abs() <= SIMILARITY_TOLERANCE * square;
        square > 0.0
            && square.is_finite()
            && close(dot(1, 1), square)
            && close(dot(2, 2), square)
            && [(0, 1), (1, 2), (2, 0)]
                .into_iter()
                .all(|(i, j)| close(dot(i, j), 0.0))
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|x| a[(x + 1) % 3] * b[(x + 2) % 3] - a[(x + 2) % 3] * b[(x + 1) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_across_the_surface() {
        let sheared = Pose {
            linear: [[2.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.5, 3.0]],
            ..Pose::IDENTITY
        };
        for pose in [MIRRORED, sheared] {
            let (p, q) = ([1.0, 2.0, 0.0], [0.0, -1.0, 4.0]);
            let normal = pose.normal(cross(p, q));
            for tangent in [p, q] {
                let tangent = pose.vector(tangent);
                let dot: f64 = (0..3).map(|x| normal[x] * tangent[x]).sum();
                assert!(dot.abs() < 1e-12, "{dot}");
            }
            let own = pose.own_normal(normal);
            let across = cross(own, cross(p, q));
            assert!(across.iter().all(|v| v.abs() < 1e-9), "{own:?}");
            let along: f64 = (0..3).map(|x| own[x] * cross(p, q)[x]).sum();
            assert!(along > 0.0);
        }
    }

    /// A quarter turn about z, doubled, mirrored in x, and moved.
    const MIRRORED: Pose = Pose {
        linear: [[0.0, -2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 2.0]],
        translation: [5.0, 0.0, 1.0],
    };

    #[test]
    fn poses_follow_each_other() {
        assert_eq!(MIRRORED.point([1.0, 0.0, 0.0]), [5.0, -2.0, 1.0]);
        let twice = MIRRORED.after(&MIRRORED);
        let p = [1.0, 2.0, 3.0];
        assert_eq!(twice.point(p), MIRRORED.point(MIRRORED.point(p)));
        let back = MIRRORED.inverse().unwrap().after(&MIRRORED);
        let (p, q) = ([1.0, 2.0, 3.0], back.point([1.0, 2.0, 3.0]));
        assert!((0..3).all(|x| (p[x] - q[x]).abs() < 1e-15), "{q:?}");
        let flat = Pose {
            linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]],
            ..MIRRORED
        };
        assert_eq!(flat.inverse(), None);
        let [linear, translation] = MIRRORED.split();
        assert_eq!(translation.after(&linear), MIRRORED);
    }

    #[test]
    fn similarities_are_told_from_shears() {
        assert!(Pose::IDENTITY.is_similarity() && MIRRORED.is_similarity());
        assert_eq!(MIRRORED.determinant(), -8.0);
        let mut other = MIRRORED;
        other.linear[2][2] = 2.1;
        assert!(!other.is_similarity());
        other = MIRRORED;
        other.linear[2][0] = 0.1;
        assert!(!other.is_similarity());
        other.linear = [[0.0; 3]; 3];
        assert!(!other.is_similarity());
    }
}
