//! Bakes of a mesh that deforms: the same triangles in one pose after another.

use aogrid_bake_core::{
    Algorithm, BakeOptions, Observer, Plan, PreparedMesh, RawGrid, TriangleMesh,
};
use aogrid_grid_format::{GridSpec, Sampling};

use crate::baker::{Baker, sweep};
use crate::error::BakeError;
use crate::sweep::Sweeper;

/// Bakes one pose of a mesh after another. It keeps the merged vertices and the edges of the mesh
/// while its triangles stay the same, so that a new pose costs little more than the sweep.
///
/// Any mesh may follow any other: what cannot be kept is made anew. Results are those of
/// [`bake()`](crate::bake()), but for rays that pass an edge more closely than doubles can resolve
/// where different vertices come to coincide.
///
/// ```
/// use aogrid_bake_core::{Preset, UNOBSERVED, models::Model};
/// # use aogrid_bake_core::TriangleMesh;
/// let preset = Preset::Economy;
/// let mut rebaker = aogrid_baker_cpu::Rebaker::new();
/// let mesh = Model::Robot.mesh(None)?;
/// for stretch in [1.0, 1.1, 1.2] {
///     let positions = mesh.positions().iter().map(|p| [p[0], stretch * p[1], p[2]]);
///     let (triangles, parts) = (mesh.triangles().to_vec(), mesh.parts().to_vec());
///     let pose = TriangleMesh::new(positions.collect(), triangles, parts)?;
///     let spec = preset.placement().place(&pose.bounds())?;
///     let raw = rebaker.bake(&pose, spec, &preset.options(), UNOBSERVED)?;
///     assert_eq!(raw.moments.len(), 16 * 16 * 16);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct Rebaker {
    sweeper: Sweeper,
    kept: Option<Kept>,
}

/// The mesh of the last bake.
struct Kept {
    prepared: PreparedMesh,
    /// The triangles that it was made from.
    triangles: Vec<[u32; 3]>,
}

impl Rebaker {
    /// Returns a rebaker without buffers, for the best SIMD level of this machine.
    pub fn new() -> Self {
        Self::default()
    }

    /// Bakes the moments of every cell of `spec` around a mesh, like [`bake()`](crate::bake()): by
    /// the direction sweep if it supports the bake and is faster, otherwise by ray casting, which
    /// keeps nothing.
    ///
    /// # Errors
    ///
    /// The same as [`bake()`](crate::bake()).
    pub fn bake(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let size = match self.repose(mesh, spec, options) {
            Some(size) => size,
            None => match Plan::observed(mesh, spec, options, None, observer)? {
                Plan::Sweep {
                    mesh: prepared,
                    size,
                } => {
                    self.kept = Some(Kept {
                        prepared: *prepared,
                        triangles: mesh.triangles().to_vec(),
                    });
                    size
                }
                Plan::Rays { .. } => {
                    let mut rays = Baker::new(Some(Algorithm::RayCasting));
                    return rays.prepare(mesh, spec, options)?.bake(observer);
                }
            },
        };
        let kept = self.kept.as_ref().expect("a mesh has been prepared");
        sweep(&mut self.sweeper, &kept.prepared, (size, options), observer)
    }

    /// Moves the kept mesh to a pose, and returns the size of the faces. `None` if that does not do:
    /// a [`Plan`] has to say what does, or why nothing.
    fn repose(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
    ) -> Option<u32> {
        let Sampling::CubeFaces { size } = options.sampling else {
            return None;
        };
        if options.max_distance.is_some() || options.validate().is_err() {
            return None;
        }
        let kept = self.kept.as_mut()?;
        if kept.triangles != mesh.triangles() {
            return None;
        }
        let reposed = kept.prepared.repose(mesh, spec, options.sample_offset);
        matches!(reposed, Ok(true)).then_some(size)
    }
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Placement, UNOBSERVED};

    use super::*;
    use crate::bake;

    /// Returns a mesh with every vertex moved.
    fn posed(mesh: &TriangleMesh, to: impl Fn([f32; 3]) -> [f32; 3]) -> TriangleMesh {
        let positions = mesh.positions().iter().map(|&p| to(p)).collect();
        TriangleMesh::new(positions, mesh.triangles().to_vec(), mesh.parts().to_vec()).unwrap()
    }

    #[test]
    fn poses_and_meshes_in_turn_are_baked_as_alone() {
        let placement = Placement {
            resolution: [12, 9, 10],
            ..Placement::paper()
        };
        let robot = Model::Robot.mesh(None).unwrap();
        let poses = [
            robot.clone(),
            posed(&robot, |[x, y, z]| [x + 0.2 * y, y, z - 0.1 * y * y]),
            Model::Torus.mesh(None).unwrap(),
            posed(&robot, |[x, y, z]| [x, 0.5 * y, z]),
            // Vertices that are at different points of the pose before come to coincide.
            posed(&robot, |[x, y, z]| [x, y.max(0.3), z]),
            robot,
        ];
        let near = BakeOptions {
            max_distance: Some(0.5),
            ..BakeOptions::paper()
        };
        let mut rebaker = Rebaker::new();
        for options in [BakeOptions::paper(), near] {
            for pose in &poses {
                let spec = placement.place(&pose.bounds()).unwrap();
                let expected = bake(pose, spec, &options, UNOBSERVED).unwrap();
                let found = rebaker.bake(pose, spec, &options, UNOBSERVED).unwrap();
                assert!(expected.counts.iter().any(|n| *n > 0));
                assert!(found == expected);
            }
        }
    }

    #[test]
    fn wrong_options_are_refused_before_and_after_a_bake() {
        let mesh = Model::Table.mesh(None).unwrap();
        let spec = Placement::paper().place(&mesh.bounds()).unwrap();
        let wrong = BakeOptions {
            sampling: Sampling::CubeFaces { size: 7 },
            ..BakeOptions::paper()
        };
        let mut rebaker = Rebaker::new();
        for _ in 0..2 {
            assert!(rebaker.bake(&mesh, spec, &wrong, UNOBSERVED).is_err());
            rebaker
                .bake(&mesh, spec, &BakeOptions::paper(), UNOBSERVED)
                .unwrap();
        }
    }
}
