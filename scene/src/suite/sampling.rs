//! The receivers of an area in a pose.

use aogrid_bake_core::TriangleMesh;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::areas::{Area, BEYOND, PaperGrid};
use super::poses::Pose;
use super::quasi::Quasi;
use super::surface::{Surface, sphere};
use crate::reference::Receiver;

/// The gap between an occluder and what touches it, in its largest half-extent: rays start there.
const GAP: f64 = 1e-4;

/// The same for receivers on the occluder itself; more than the rounding of coordinates to single
/// floats.
const LIFT: f64 = 1e-5;

/// The candidates for one receiver, at the most: an area with fewer than one in as many has fewer
/// receivers.
const MAX_CANDIDATES: usize = 400;

/// The candidates that are tried at once.
const CANDIDATE_CHUNK: usize = 1024;

/// An occluder in a pose, with what tells its areas apart.
pub(super) struct Surroundings<'a> {
    pub mesh: &'a TriangleMesh,
    pub surface: &'a Surface,
    pub grid: &'a PaperGrid,
    pub pose: &'a Pose,
}

/// A plane's rectangle of candidates.
struct Rectangle {
    corner: DVec3,
    sides: [DVec3; 2],
    normal: DVec3,
}

/// A candidate: none if it is not in the area, an error if it is inside the occluder.
type Candidate = Option<Result<Receiver, Inside>>;

/// The reason that a candidate is left out: it is inside the occluder, or sees nothing.
struct Inside;

impl Surroundings<'_> {
    /// Returns `n` receivers in world space, fewer in an area that is hard to meet, and the number
    /// of those left out for being inside the occluder or seeing nothing.
    pub(super) fn receivers(&self, area: Area, n: usize, seed: u64) -> (Vec<Receiver>, usize) {
        let quasi = Quasi::<5>::new(seed.wrapping_mul(31).wrapping_add(area as u64));
        let rectangles = self.rectangles(area);
        let candidate = |idx: usize| match area {
            Area::Itself => Some(self.on_itself(quasi.point(idx))),
            Area::AnyWay => self.any_way(quasi.point(idx)),
            _ => self.on_plane(area, &rectangles[idx % 2], quasi.point(idx)),
        };
        let (mut receivers, mut n_inside) = (vec![], 0);
        let mut next = 0;
        while receivers.len() < n && next < n * MAX_CANDIDATES {
            let chunk = next..next + CANDIDATE_CHUNK;
            let found: Vec<_> = chunk.into_par_iter().map(candidate).collect();
            for candidate in found.into_iter().flatten() {
                match candidate {
                    Ok(receiver) if receivers.len() < n => receivers.push(receiver),
                    Ok(_) => break,
                    Err(Inside) => n_inside += 1,
                }
            }
            next += CANDIDATE_CHUNK;
        }
        (receivers, n_inside)
    }

    /// Returns the part of the floor and of the wall that holds an area.
    fn rectangles(&self, area: Area) -> [Rectangle; 2] {
        let object = self.pose.bounds(self.mesh);
        let near = DVec3::splat(self.grid.near * self.pose.scale());
        let [low, high] = match area {
            Area::Near | Area::Tilted => [object[0] - near, object[1] + near],
            Area::Beyond => self.pose.box_bounds(self.grid, BEYOND),
            _ => self.pose.box_bounds(self.grid, 1.0),
        };
        let gap = GAP * 0.5 * (object[1] - object[0]).max_element();
        let (floor, wall) = (object[0].y - gap, object[1].x + gap);
        let size = high - low;
        [
            Rectangle {
                corner: low.with_y(floor),
                sides: [DVec3::X * size.x, DVec3::Z * size.z],
                normal: DVec3::Y,
            },
            // The wall stands on the floor.
            Rectangle {
                corner: DVec3::new(wall, floor, low.z),
                sides: [DVec3::Y * (high.y - floor), DVec3::Z * size.z],
                normal: DVec3::NEG_X,
            },
        ]
    }

    fn on_plane(&self, area: Area, plane: &Rectangle, [s, t, ..]: [f64; 5]) -> Candidate {
        let position = plane.corner + s * plane.sides[0] + t * plane.sides[1];
        let mut is_there = self.pose.instances.iter().map(|instance| {
            let local = instance.inverse().transform_point3(position);
            let away = self.grid.half_extents_away(local);
            let is_near = || self.surface.closest(local, self.grid.near).is_some();
            match area {
                Area::Near | Area::Tilted => is_near(),
                Area::Rest => away <= 1.0 && !is_near(),
                Area::Beyond => away > 1.0 && away <= BEYOND,
                Area::Stacked => away <= 1.0,
                Area::AnyWay | Area::Itself => false,
            }
        });
        let receiver = Receiver {
            position: position.to_array(),
            normal: plane.normal.to_array(),
        };
        is_there
            .any(|found| found)
            .then(|| self.unless_enclosed(receiver))
    }

    /// Returns a free point near the occluder whose normal is within 90° of the direction to the
    /// closest point.
    fn any_way(&self, [x, y, z, s, t]: [f64; 5]) -> Candidate {
        let bounds = self.mesh.bounds();
        let near = DVec3::splat(self.grid.near);
        let [low, high] = [bounds.min, bounds.max].map(|v| DVec3::from(v.map(f64::from)));
        let (low, high) = (low - near, high + near);
        let local = low + DVec3::new(x, y, z) * (high - low);
        let towards = self.surface.closest(local, self.grid.near)? - local;
        if towards.length() < self.gap() {
            return None;
        }
        if self.surface.is_inside(local) {
            return Some(Err(Inside));
        }
        let normal = sphere([s, t]);
        let normal = if normal.dot(towards) < 0.0 {
            -normal
        } else {
            normal
        };
        Some(Ok(self.world_from_object(local, normal)))
    }

    fn on_itself(&self, [along, s, t, ..]: [f64; 5]) -> Result<Receiver, Inside> {
        let Receiver { position, normal } = self.surface.point([along, s, t]);
        let normal = DVec3::from(normal);
        let lift = LIFT / GAP * self.gap();
        let lifted = DVec3::from(position) + lift * normal;
        self.unless_enclosed(self.world_from_object(lifted, normal))
    }

    /// Returns the receiver unless it sees nothing, as far as the first instance tells.
    fn unless_enclosed(&self, receiver: Receiver) -> Result<Receiver, Inside> {
        let local = self.pose.instances[0].inverse();
        let point = local.transform_point3(receiver.position.into());
        let normal = local.transform_vector3(receiver.normal.into()).normalize();
        match self.surface.is_enclosed(point, normal) {
            true => Err(Inside),
            false => Ok(receiver),
        }
    }

    /// Returns the gap in object units.
    fn gap(&self) -> f64 {
        let [x, y, z] = self.mesh.bounds().half_extents();
        GAP * x.max(y).max(z)
    }

    fn world_from_object(&self, position: DVec3, normal: DVec3) -> Receiver {
        let transform: &DAffine3 = &self.pose.instances[0];
        Receiver {
            position: transform.transform_point3(position).to_array(),
            normal: transform.transform_vector3(normal).normalize().to_array(),
        }
    }
}
