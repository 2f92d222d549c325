//! Procedural models for experiments, tests and benchmarks. They are right-handed, y up, stand on
//! y = 0 and are one to two units large. Those of [`Model::CLOSED`] enclose volumes, the others
//! have holes or no thickness.

mod builder;
mod closed;
mod open;
mod refine;
mod shapes;

use std::fmt::Write;

use crate::TriangleMesh;
use crate::mesh::Part;

/// A procedural model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// A unit cube.
    Box,
    /// A table: four legs that touch its top.
    Table,
    /// A torus that lies flat.
    Torus,
    /// A slab with a wall at its side, which form an inner edge.
    LShape,
    /// A sphere of radius ½.
    Sphere,
    /// A robot of eleven parts in a walking pose, similar to that of RR-5779, figure 13.
    Robot,
    /// A space ship with hull, wings, fin and engines, about as many triangles as that of RR-5779,
    /// table 1.
    SpaceShip,
    /// A thin wall.
    Wall,
    /// A comb, whose teeth hang down.
    Comb,
    /// Five stairs, solid.
    Stairs,
    /// Two interlocked rings.
    Rings,
    /// A thin rod that lies on the floor.
    Rod,
    /// A unit cube without its bottom.
    OpenBox,
    /// Two overlapping boxes without bottoms.
    OpenBoxes,
    /// A house: walls and a roof without thickness, a door, windows.
    House,
    /// A room: floor and walls that face inward, without a roof.
    Room,
    /// A wavy cloth without thickness.
    Sheet,
    /// The lower half of a hollow sphere without thickness.
    Bowl,
    /// A tree of cards without thickness, as in games.
    CardTree,
    /// A lying pipe without thickness or ends.
    Pipe,
    /// A torus with holes, of which about every fifth triangle is flipped.
    Patchwork,
}

/// The reason that a model cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The requested number of triangles is below the model's minimum.
    #[error("{name} has at least {least} triangles, but {wished} were requested")]
    TooFew {
        /// The model's name.
        name: &'static str,
        /// The minimum number of triangles.
        least: usize,
        /// The requested number of triangles.
        wished: usize,
    },
    /// The requested number of triangles is above [`MAX_TRIANGLES`].
    #[error("{0} triangles are too many, the maximum is {MAX_TRIANGLES}")]
    TooMany(usize),
}

/// The maximum number of triangles of a refined model.
pub const MAX_TRIANGLES: usize = 20_000_000;

impl Model {
    /// Every model.
    pub const ALL: [Self; 21] = [
        Self::Box,
        Self::Table,
        Self::Torus,
        Self::LShape,
        Self::Sphere,
        Self::Robot,
        Self::SpaceShip,
        Self::Wall,
        Self::Comb,
        Self::Stairs,
        Self::Rings,
        Self::Rod,
        Self::OpenBox,
        Self::OpenBoxes,
        Self::House,
        Self::Room,
        Self::Sheet,
        Self::Bowl,
        Self::CardTree,
        Self::Pipe,
        Self::Patchwork,
    ];

    /// The closed models: every edge has an even number of triangles.
    pub const CLOSED: [Self; 12] = [
        Self::Box,
        Self::Table,
        Self::Torus,
        Self::LShape,
        Self::Sphere,
        Self::Robot,
        Self::SpaceShip,
        Self::Wall,
        Self::Comb,
        Self::Stairs,
        Self::Rings,
        Self::Rod,
    ];

    /// Returns the name on command lines and of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Table => "table",
            Self::Torus => "torus",
            Self::LShape => "l-shape",
            Self::Sphere => "sphere",
            Self::Robot => "robot",
            Self::SpaceShip => "space-ship",
            Self::Wall => "wall",
            Self::Comb => "comb",
            Self::Stairs => "stairs",
            Self::Rings => "rings",
            Self::Rod => "rod",
            Self::OpenBox => "open-box",
            Self::OpenBoxes => "open-boxes",
            Self::House => "house",
            Self::Room => "room",
            Self::Sheet => "sheet",
            Self::Bowl => "bowl",
            Self::CardTree => "card-tree",
            Self::Pipe => "pipe",
            Self::Patchwork => "patchwork",
        }
    }

    /// Returns the model with its own number of triangles, or refined to `triangles` or one more.
    /// New vertices of the sphere and the torus lie on the round surface.
    ///
    /// # Errors
    ///
    /// `triangles` is below the model's minimum or above [`MAX_TRIANGLES`].
    pub fn mesh(self, triangles: Option<usize>) -> Result<TriangleMesh, ModelError> {
        let mut model = shapes::build(self, triangles);
        if let Some(requested) = triangles {
            let min = model.triangle_count();
            if requested < min {
                return Err(ModelError::TooFew {
                    name: self.name(),
                    least: min,
                    wished: requested,
                });
            }
            if requested > MAX_TRIANGLES {
                return Err(ModelError::TooMany(requested));
            }
            refine::refine(&mut model, requested, shapes::surface(self));
        }
        Ok(model.finish())
    }
}

/// Returns the mesh as a Wavefront OBJ file, with one object per part and the shortest decimals
/// that read back as the same floats.
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
        for sample in Model::CLOSED {
            let mesh = sample.mesh(None).unwrap();
            let report = MeshReport::new(&mesh);
            // Slab and wall of the L share an edge of four triangles.
            assert_eq!(report.is_closed(), sample != Model::LShape, "{sample:?}");
            assert_eq!(
                (report.boundary_edges, report.degenerate, report.duplicate),
                (0, 0, 0),
                "{sample:?}"
            );
            let lowest = report.bounds.min[1];
            assert!((0.0..0.2).contains(&lowest), "{sample:?}: {lowest}");
            assert!(signed_volume(&mesh) > 0.0, "{sample:?} is inside out");
        }
        assert_eq!(Model::Robot.mesh(None).unwrap().parts().len(), 11);
    }

    /// Returns the enclosed volume, positive if triangles wind counter-clockwise seen from outside.
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
    fn refined_models_have_the_requested_count_and_stay_closed() {
        for sample in Model::CLOSED {
            for requested in [2_500, 10_001] {
                let mesh = sample.mesh(Some(requested)).unwrap();
                assert_eq!(
                    mesh.triangles().len(),
                    requested.next_multiple_of(2),
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
    fn open_models_have_the_expected_holes() {
        for (sample, triangles, boundary_edges) in [
            (Model::OpenBox, 10, 4),
            (Model::OpenBoxes, 20, 8),
            // The door, one side of which is an edge of the floor, and four windows.
            (Model::House, 2 * (12 + 14 + 8 + 8) + 6 + 20 + 30, 6 + 16),
            (Model::Room, 10, 4),
            (Model::Sheet, 512, 64),
            (Model::Bowl, 480, 32),
            (Model::CardTree, 2 * 8, 4 * 8),
            (Model::Pipe, 2 * 24 * 6, 2 * 24),
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
    fn open_models_except_the_room_face_outward() {
        for sample in Model::ALL
            .into_iter()
            .filter(|s| !Model::CLOSED.contains(s))
        {
            if ![Model::Sheet, Model::CardTree, Model::Patchwork].contains(&sample) {
                // Tetrahedra over a hole have no volume if the origin is in the plane of the hole.
                let mesh = sample.mesh(None).unwrap();
                let volume = signed_volume(&mesh);
                assert_eq!(volume > 0.0, sample != Model::Room, "{sample:?}: {volume}");
            }
        }
    }

    #[test]
    fn refinement_keeps_flat_faces_flat_and_round_ones_round() {
        let flat = Model::Box.mesh(Some(1000)).unwrap();
        for p in flat.positions() {
            let on_face = p[0].abs() == 0.5 || p[1] == 0.0 || p[1] == 1.0 || p[2].abs() == 0.5;
            assert!(on_face, "{p:?}");
        }
        for p in Model::Sphere.mesh(Some(5000)).unwrap().positions() {
            let [x, y, z] = [p[0], p[1] - 0.5, p[2]].map(f64::from);
            let radius = (x * x + y * y + z * z).sqrt();
            assert!((radius - 0.5).abs() < 2e-6, "{radius}");
        }
    }

    #[test]
    fn counts_out_of_range_are_refused() {
        let few = Model::Box.mesh(Some(11)).unwrap_err();
        assert_eq!(
            few.to_string(),
            "box has at least 12 triangles, but 11 were requested"
        );
        let many = Model::Box.mesh(Some(MAX_TRIANGLES + 1));
        assert_eq!(many, Err(ModelError::TooMany(MAX_TRIANGLES + 1)));
    }

    #[test]
    fn obj_text_reads_back_as_the_same_mesh() {
        let mesh = Model::Robot.mesh(None).unwrap();
        let read = read_obj(to_obj(&mesh).as_bytes()).unwrap();
        assert_eq!(read.parts(), mesh.parts());
        assert!(read.corners().eq(mesh.corners()));
    }
}
