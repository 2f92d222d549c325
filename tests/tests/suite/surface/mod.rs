//! Surface bakes: closed forms, meshes, kernels, scenes, textures.

mod closed_forms;
mod kernels;
mod meshes;
mod scenes;
mod textures;

use aogrid_bake_core::surface::{SurfacePoint, SurfaceRecord, cross, dot, normalized};
use aogrid_tests::Random;

/// A rotation, as the images of the axes.
#[derive(Clone, Copy)]
struct Rotation([[f64; 3]; 3]);

impl Rotation {
    fn random(random: &mut Random) -> Self {
        let mut vector = || [(); 3].map(|()| f64::from(random.signed()));
        let x = normalized(vector()).expect("not zero");
        let z = normalized(cross(x, vector())).expect("not parallel");
        Self([x, cross(z, x), z])
    }

    fn apply(&self, v: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|x| (0..3).map(|c| self.0[c][x] * v[c]).sum())
    }

    /// Applies the inverse.
    fn undo(&self, v: [f64; 3]) -> [f64; 3] {
        self.0.map(|axis| dot(axis, v))
    }
}

/// Returns a point whose hemisphere is over its face.
fn point(position: [f64; 3], normal: [f64; 3]) -> SurfacePoint {
    SurfacePoint {
        position,
        axis: normal,
        face: normal,
    }
}

/// Returns the angle between a bent normal and the expected direction, in degrees.
fn degrees(record: &SurfaceRecord, expected: [f64; 3]) -> f64 {
    let bent = record.bent_normal.map(f64::from);
    let across = cross(bent, expected);
    let sine = dot(across, across).sqrt();
    sine.atan2(dot(bent, expected)).to_degrees()
}
