//! The errors of modes in a scene, by area around its occluders.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Context, Result};
use crate::reference::Receiver;
use crate::shade::{Shaded, Target};
use crate::suite::areas::{BEYOND, PaperGrid};
use crate::suite::surface::Surface;
use crate::suite::{Area, ErrorStats, Sample};
use crate::{Instance, Scene};

/// The errors of a mode.
#[derive(Clone, Debug, Serialize)]
pub struct ModeErrors {
    /// The mode's name.
    pub mode: &'static str,
    /// The errors of all receivers.
    pub all: Option<ErrorStats>,
    /// The errors in each area, in the order of [`Area::ALL`].
    pub areas: [Option<ErrorStats>; Area::ALL.len()],
}

/// Returns the errors of a mode's AO against truth at each receiver, by area; both have an entry for
/// each receiver.
pub fn errors(
    mode: &'static str,
    shaded: &Shaded,
    truth: &Shaded,
    areas: &[Option<Area>],
) -> ModeErrors {
    let standard_errors = truth.occlusion_error.as_deref();
    let sample = |idx: usize| Sample {
        shaded: f64::from(shaded.occlusion[idx]),
        truth: f64::from(truth.occlusion[idx]),
        truth_error: standard_errors.map_or(0.0, |errors| f64::from(errors[idx])),
    };
    let all: Vec<Sample> = (0..areas.len()).map(sample).collect();
    let of_area = |area: Area| {
        let pairs = all.iter().zip(areas);
        let chosen = pairs.filter(|(_, found)| **found == Some(area));
        ErrorStats::of(&chosen.map(|(sample, _)| *sample).collect::<Vec<_>>())
    };
    ModeErrors {
        mode,
        all: ErrorStats::of(&all),
        areas: Area::ALL.map(of_area),
    }
}

/// The distance up to which a plane touches an occluder, in diagonals of a cell.
const TOUCH: f64 = 0.05;

/// The sine of the angle up to which a normal lies along an axis.
const ALONG_AXIS: f64 = 1e-3;

/// An occluder in the scene.
struct Occluder<'a> {
    instance: &'a Instance,
    surface: &'a Surface,
    grid: &'a PaperGrid,
    points: &'a [[f32; 3]],
    object_from_world: DAffine3,
}

/// Returns the area in which each receiver lies, relative to its closest occluder, if it is in any:
/// [`Area::Itself`] on an occluder; near one [`Area::Near`] or [`Area::Tilted`] on a plane that
/// touches it, else [`Area::AnyWay`]; then [`Area::Rest`] and [`Area::Beyond`].
///
/// # Errors
///
/// An occluder cannot be placed in a grid.
pub fn areas(scene: &Scene, target: &Target) -> Result<Vec<Option<Area>>> {
    let used = |idx: usize| scene.casters().any(|instance| instance.mesh == idx);
    let mut geometry = HashMap::new();
    for (idx, mesh) in scene
        .meshes
        .iter()
        .enumerate()
        .filter(|(idx, _)| used(*idx))
    {
        let grid = PaperGrid::around(&mesh.mesh)
            .with_context(|| format!("{}: mesh `{}`", scene.path.display(), mesh.name))?;
        geometry.insert(idx, (Surface::new(&mesh.mesh), grid));
    }
    let occluders: Vec<_> = scene
        .casters()
        .map(|instance| {
            let (surface, grid) = &geometry[&instance.mesh];
            Occluder {
                instance,
                surface,
                grid,
                points: scene.meshes[instance.mesh].mesh.positions(),
                object_from_world: instance.world_from_object.inverse(),
            }
        })
        .collect();
    let pairs = target.receivers.par_iter().zip(&target.ids);
    Ok(pairs
        .map(|(receiver, &id)| area(&occluders, receiver, id))
        .collect())
}

fn area(occluders: &[Occluder<'_>], receiver: &Receiver, id: u32) -> Option<Area> {
    if occluders.iter().any(|occluder| occluder.instance.id == id) {
        return Some(Area::Itself);
    }
    // The occluder that is the fewest diagonals of its cells away, if one is near.
    let near = occluders
        .iter()
        .filter_map(|o| Some((o, o.diagonals_away(receiver)?)));
    let closest = near.min_by(|(_, a), (_, b)| a.total_cmp(b));
    if let Some((occluder, _)) = closest {
        return Some(occluder.contact(receiver));
    }
    let away = occluders.iter().map(|o| {
        let local = o
            .object_from_world
            .transform_point3(receiver.position.into());
        o.grid.half_extents_away(local)
    });
    match away.fold(f64::INFINITY, f64::min) {
        away if away <= 1.0 => Some(Area::Rest),
        away if away <= BEYOND => Some(Area::Beyond),
        _ => None,
    }
}

impl Occluder<'_> {
    /// Returns the distance in diagonals of a cell; `None` above 1.
    fn diagonals_away(&self, receiver: &Receiver) -> Option<f64> {
        let local = self
            .object_from_world
            .transform_point3(receiver.position.into());
        let closest = self.surface.closest(local, self.grid.near)?;
        Some(local.distance(closest) / self.grid.near)
    }

    /// Returns the area of a receiver near the occluder: on what kind of plane it lies.
    fn contact(&self, receiver: &Receiver) -> Area {
        let local = self
            .object_from_world
            .transform_point3(receiver.position.into());
        // A plane's normal n is transformed by the inverse transposed matrix.
        let linear: DMat3 = self.instance.world_from_object.matrix3;
        let normal = (linear.transpose() * DVec3::from(receiver.normal)).normalize();
        let heights = self
            .points
            .iter()
            .map(|p| normal.dot(DVec3::from(p.map(f64::from)) - local));
        let lowest = heights.fold(f64::INFINITY, f64::min);
        if lowest.abs() > TOUCH * self.grid.near {
            return Area::AnyWay;
        }
        let along = normal.abs().max_element();
        match along * along > 1.0 - ALONG_AXIS * ALONG_AXIS {
            true => Area::Near,
            false => Area::Tilted,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{LoadOptions, parse};

    #[test]
    fn receivers_lie_in_the_areas_that_planes_and_distances_tell() {
        let text = "[[mesh]]\nname = 'box'\nsample = 'box'\n\
                    [[mesh]]\nname = 'floor'\nrectangle = [9, 9]\n\
                    [[instance]]\nmesh = 'box'\n[[instance]]\nmesh = 'floor'\n";
        let scene = parse(Path::new("a.toml"), text, LoadOptions::default()).unwrap();
        // The box is a unit cube on the floor, its grid's box 2.784 times as large, a diagonal of
        // the grid's cells 0.151.
        let points = [
            ([0.6, 0.0, 0.0], [0.0, 1.0, 0.0], 2, Some(Area::Near)),
            ([0.5, 0.0, 0.7], [0.0, 1.0, 0.0], 2, Some(Area::Rest)),
            ([1.0, 0.0, 1.5], [0.0, 1.0, 0.0], 2, Some(Area::Beyond)),
            ([1.0, 0.0, 4.5], [0.0, 1.0, 0.0], 2, None),
            ([0.6, 0.5, 0.0], [-1.0, 0.0, 0.0], 0, Some(Area::AnyWay)),
            ([0.5, 0.5, 0.0], [1.0, 0.0, 0.0], 1, Some(Area::Itself)),
        ];
        let target = Target::of_points(
            points
                .iter()
                .map(|&(position, normal, ..)| Receiver { position, normal })
                .collect(),
            points.iter().map(|point| point.2).collect(),
        );
        let expected: Vec<_> = points.iter().map(|point| point.3).collect();
        assert_eq!(areas(&scene, &target).unwrap(), expected);
    }

    #[test]
    fn a_leaning_box_touches_the_floor_on_a_tilted_plane() {
        let text = "[[mesh]]\nname = 'box'\nsample = 'box'\n\
                    [[instance]]\nmesh = 'box'\n\
                    rotate = { axis = [0, 0, 1], degrees = 30 }\ntranslate = [0, 0.25, 0]\n";
        let scene = parse(Path::new("a.toml"), text, LoadOptions::default()).unwrap();
        // The edge at x = -0.5, y = 0 is turned to y = -0.25 and lifted to the floor.
        let receiver = Receiver {
            position: [-0.5, 0.0, 0.1],
            normal: [0.0, 1.0, 0.0],
        };
        let target = Target::of_points(vec![receiver], vec![0]);
        assert_eq!(areas(&scene, &target).unwrap(), [Some(Area::Tilted)]);
    }
}
