//! Our own models, made by code: for trying things out, for tests, for benches. Right-handed,
//! y up, standing on y = 0, about one or two units large. Those of [`Sample::CLOSED`] enclose
//! volumes, the others have holes or no thickness.

mod builder;
mod models;
mod open;
mod refine;

use std::fmt::Write;

use crate::TriangleMesh;
use crate::mesh::Part;

/// One of our models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// A unit cube.
    Box,
    /// Four legs and a top, in contact.
    Table,
    /// A ring, lying.
    Torus,
    /// A slab with a wall at its side: an inner edge.
    LShape,
    /// A ball of radius ½.
    Sphere,
    /// Eleven parts in a walking pose, as the robot of RR-5779, figure 13.
    Robot,
    /// Hull, wings, fins and engines, as small as the space ship of RR-5779, table 1.
    SpaceShip,
    /// A unit cube without its bottom.
    OpenBox,
    /// Two boxes without bottoms that overlap.
    OpenBoxes,
    /// Walls and a roof without thickness, a door, windows.
    House,
    /// Floor and walls that face inward, without a roof.
    Room,
    /// A wavy cloth without thickness.
    Sheet,
    /// Half a hollow ball without thickness, open above.
    Bowl,
    /// A torus with holes, whose every fifth triangle is turned over.
    Patchwork,
}

/// Why a model cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Fewer triangles than the model's own.
    #[error("{name} has {least} triangles at least, {wished} were wished for")]
    TooFew {
        /// The model.
        name: &'static str,
        /// Its own count.
        least: usize,
        /// The wish.
        wished: usize,
    },
    /// More triangles than anyone can mean.
    #[error("{0} triangles are more than the {MAX_TRIANGLES} a sample may have")]
    TooMany(usize),
}

/// The most triangles that a sample is refined to.
pub const MAX_TRIANGLES: usize = 20_000_000;

impl Sample {
    /// Every model.
    pub const ALL: [Self; 14] = [
        Self::Box,
        Self::Table,
        Self::Torus,
        Self::LShape,
        Self::Sphere,
        Self::Robot,
        Self::SpaceShip,
        Self::OpenBox,
        Self::OpenBoxes,
        Self::House,
        Self::Room,
        Self::Sheet,
        Self::Bowl,
        Self::Patchwork,
    ];

    /// The models whose every edge has an even number of triangles.
    pub const CLOSED: [Self; 7] = [
        Self::Box,
        Self::Table,
        Self::Torus,
        Self::LShape,
        Self::Sphere,
        Self::Robot,
        Self::SpaceShip,
    ];

    /// The name on command lines and of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Table => "table",
            Self::Torus => "torus",
            Self::LShape => "l-shape",
            Self::Sphere => "sphere",
            Self::Robot => "robot",
            Self::SpaceShip => "space-ship",
            Self::OpenBox => "open-box",
            Self::OpenBoxes => "open-boxes",
            Self::House => "house",
            Self::Room => "room",
            Self::Sheet => "sheet",
            Self::Bowl => "bowl",
            Self::Patchwork => "patchwork",
        }
    }

    /// The model with its own number of triangles, or refined to `triangles` or one more. New vertices of the sphere and the torus lie on the round surface.
    ///
    /// # Errors
    ///
    /// Fewer triangles than the model has, or more than [`MAX_TRIANGLES`].
    pub fn mesh(self, triangles: Option<usize>) -> Result<TriangleMesh, SampleError> {
        let mut model = models::build(self, triangles);
        if let Some(wished) = triangles {
            let least = model.triangle_count();
            if wished < least {
                return Err(SampleError::TooFew {
                    name: self.name(),
                    least,
                    wished,
                });
            }
            if wished > MAX_TRIANGLES {
                return Err(SampleError::TooMany(wished));
            }
            refine::refine(&mut model, wished, models::surface(self));
        }
        Ok(model.finish())
    }
}

/// The mesh as a Wavefront OBJ file, one object a part, shortest decimals that read back as the
/// same floats.
pub fn to_obj(mesh: &TriangleMesh) -> String {
    let mut obj = String::new();
    let mut line = |args: std::fmt::Arguments<'_>| {
        obj.write_fmt(args).expect("a String takes any text");
        obj.push('\n');
    };
    for [x, y, z] in mesh.positions() {
        line(format_args!("v {x} {y} {z}"));
    }
    for Part { name, triangles } in mesh.parts() {
        line(format_args!("o {name}"));
        for [a, b, c] in &mesh.triangles()[triangles.clone()] {
            line(format_args!("f {} {} {}", a + 1, b + 1, c + 1));
        }
    }
    obj
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshReport, read_obj};

    #[test]
    fn closed_models_are_closed_and_stand_on_the_floor() {
        for sample in Sample::CLOSED {
            let mesh = sample.mesh(None).unwrap();
            let report = MeshReport::new(&mesh);
            // Slab and wall of the L have an edge in common.
            assert_eq!(report.is_closed(), sample != Sample::LShape, "{sample:?}");
            assert_eq!(
                (report.boundary_edges, report.degenerate, report.duplicate),
                (0, 0, 0),
                "{sample:?}"
            );
            let lowest = report.bounds.min[1];
            assert!((0.0..0.2).contains(&lowest), "{sample:?}: {lowest}");
            assert!(signed_volume(&mesh) > 0.0, "{sample:?} is inside out");
        }
        assert_eq!(Sample::Robot.mesh(None).unwrap().parts().len(), 11);
    }

    /// Positive where triangles wind counter-clockwise seen from outside.
    fn signed_volume(mesh: &TriangleMesh) -> f64 {
        let volume = |[a, b, c]: [[f32; 3]; 3]| {
            let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        mesh.corners().map(volume).sum()
    }

    #[test]
    fn refined_models_have_the_wished_count_and_stay_closed() {
        for sample in Sample::CLOSED {
            for wished in [2_500, 10_001] {
                let mesh = sample.mesh(Some(wished)).unwrap();
                assert_eq!(
                    mesh.triangles().len(),
                    wished.next_multiple_of(2),
                    "{sample:?}"
                );
                let report = MeshReport::new(&mesh);
                assert_eq!(
                    (report.boundary_edges, report.degenerate),
                    (0, 0),
                    "{sample:?}"
                );
                assert!(signed_volume(&mesh) > 0.0, "{sample:?}");
            }
        }
    }

    #[test]
    fn open_models_have_the_holes_they_should() {
        for (sample, triangles, boundary_edges) in [
            (Sample::OpenBox, 10, 4),
            (Sample::OpenBoxes, 20, 8),
            // The door, of which one side is the floor's, and four windows.
            (
                Sample::House,
                2 * (13 + 14 + 8 + 8) + 6 + 20 + 30,
                6 + 1 + 1 + 16,
            ),
            (Sample::Room, 10, 4),
            (Sample::Sheet, 512, 64),
            (Sample::Bowl, 480, 32),
        ] {
            let report = MeshReport::new(&sample.mesh(None).unwrap());
            let found = (report.triangles, report.boundary_edges);
            assert_eq!(found, (triangles, boundary_edges), "{sample:?}");
            let flaws = (
                report.non_manifold_edges,
                report.degenerate,
                report.duplicate,
            );
            assert_eq!(flaws, (0, 0, 0), "{sample:?}");
            let refined = sample.mesh(Some(4001)).unwrap();
            assert!(
                (4001..=4002).contains(&refined.triangles().len()),
                "{sample:?}"
            );
            let refined = MeshReport::new(&refined);
            assert!(refined.boundary_edges >= boundary_edges && refined.degenerate == 0);
        }
    }

    #[test]
    fn open_models_face_outward_but_for_the_room() {
        for sample in Sample::ALL
            .into_iter()
            .filter(|s| !Sample::CLOSED.contains(s))
        {
            if ![Sample::Sheet, Sample::Patchwork].contains(&sample) {
                // Seen from the middle of its opening's plane a hole adds nothing to the volume.
                let mesh = sample.mesh(None).unwrap();
                let volume = signed_volume(&mesh);
                assert_eq!(volume > 0.0, sample != Sample::Room, "{sample:?}: {volume}");
            }
        }
    }

    #[test]
    fn refinement_keeps_flat_faces_flat_and_round_ones_round() {
        let flat = Sample::Box.mesh(Some(1000)).unwrap();
        for p in flat.positions() {
            let on_face = p[0].abs() == 0.5 || p[1] == 0.0 || p[1] == 1.0 || p[2].abs() == 0.5;
            assert!(on_face, "{p:?}");
        }
        for p in Sample::Sphere.mesh(Some(5000)).unwrap().positions() {
            let [x, y, z] = [p[0], p[1] - 0.5, p[2]].map(f64::from);
            let radius = (x * x + y * y + z * z).sqrt();
            assert!((radius - 0.5).abs() < 2e-6, "{radius}");
        }
    }

    #[test]
    fn counts_out_of_range_are_refused() {
        let few = Sample::Box.mesh(Some(11)).unwrap_err();
        assert_eq!(
            few.to_string(),
            "box has 12 triangles at least, 11 were wished for"
        );
        let many = Sample::Box.mesh(Some(MAX_TRIANGLES + 1));
        assert_eq!(many, Err(SampleError::TooMany(MAX_TRIANGLES + 1)));
    }

    #[test]
    fn obj_text_reads_back_as_the_same_mesh() {
        let mesh = Sample::Robot.mesh(None).unwrap();
        let read = read_obj(to_obj(&mesh).as_bytes()).unwrap();
        assert_eq!(read.parts(), mesh.parts());
        assert!(read.corners().eq(mesh.corners()));
    }
}
