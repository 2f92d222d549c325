//! The poses of an occluder among receivers.

use aogrid_bake_core::TriangleMesh;
use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::areas::{Area, PaperGrid};

/// An occluder's instances in the world, and the areas whose receivers surround them there. All
/// transforms are similarities, perhaps with a reflection.
pub(super) struct Pose {
    pub name: &'static str,
    pub instances: Vec<DAffine3>,
    pub areas: &'static [Area],
}

const UPRIGHT: &[Area] = &[
    Area::Near,
    Area::AnyWay,
    Area::Rest,
    Area::Beyond,
    Area::Itself,
];
const LEANING: &[Area] = &[
    Area::Tilted,
    Area::AnyWay,
    Area::Rest,
    Area::Beyond,
    Area::Itself,
];

/// The turn of the upper of two stacked occluders, in radians: so far that no face is parallel to
/// one below.
const STACK_TURN: f64 = 0.6;

/// Returns the poses of an occluder.
pub(super) fn poses(mesh: &TriangleMesh) -> Vec<Pose> {
    let pose = |name, linear: DMat3, areas| Pose {
        name,
        instances: vec![DAffine3::from_mat3(linear)],
        areas,
    };
    let turn = |axis: [f64; 3], angle: f64| {
        DMat3::from_quat(DQuat::from_axis_angle(DVec3::from(axis).normalize(), angle))
    };
    let tipped = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
    let mut poses = vec![
        pose("upright", DMat3::IDENTITY, UPRIGHT),
        pose("tipped", tipped, UPRIGHT),
        pose(
            "flipped",
            DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)),
            UPRIGHT,
        ),
        pose("leaning", 0.6 * turn([1.0, 2.0, 3.0], 0.7), LEANING),
        pose("rolled", 1.7 * turn([-2.0, 1.0, 1.5], 2.1), LEANING),
    ];
    let bounds = mesh.bounds();
    let height = f64::from(bounds.max[1]) - f64::from(bounds.min[1]);
    let center = DVec3::from(bounds.center().map(f64::from)).with_y(0.0);
    let turned = DAffine3::from_translation(center + height * DVec3::Y)
        * DAffine3::from_rotation_y(STACK_TURN)
        * DAffine3::from_translation(-center);
    poses.push(Pose {
        name: "stacked",
        instances: vec![DAffine3::IDENTITY, turned],
        areas: &[Area::Stacked],
    });
    poses
}

impl Pose {
    /// Returns the scale of the instances.
    pub(super) fn scale(&self) -> f64 {
        self.instances[0].matrix3.x_axis.length()
    }

    /// Returns the lower and upper corner of all instances of a mesh in the world.
    pub(super) fn bounds(&self, mesh: &TriangleMesh) -> [DVec3; 2] {
        let points = || {
            mesh.corners()
                .flatten()
                .map(|p| DVec3::from(p.map(f64::from)))
        };
        let all = self.instances.iter();
        corners(all.flat_map(|t| points().map(|p| t.transform_point3(p))))
    }

    /// Returns the lower and upper corner, in the world, of the papers' boxes around all instances,
    /// scaled about their centers.
    pub(super) fn box_bounds(&self, grid: &PaperGrid, scale: f64) -> [DVec3; 2] {
        let corner = |bits: usize| {
            let sign = |axis: usize| if bits >> axis & 1 == 1 { scale } else { -scale };
            grid.center + DVec3::new(sign(0), sign(1), sign(2)) * grid.half_extents
        };
        let all = self.instances.iter();
        corners(all.flat_map(|t| (0..8).map(move |bits| t.transform_point3(corner(bits)))))
    }
}

fn corners(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.fold(none, |[low, high], p| [low.min(p), high.max(p)])
}
