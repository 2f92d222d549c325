//! The accuracy suite: how far shading is from the truth around many occluders.
//!
//! Each occluder ([`Subject`]) stands in several poses among receivers: points of a floor, a wall,
//! tilted planes, free points and points of its own, by [`Area`]. [`Truth::trace`] finds them and
//! their AO by rays through the BVH, which does not depend on any grid and may be kept in a file.
//! [`judge`] bakes the grids of the [`ROWS`], shades the receivers with each, and compares. The
//! tables give the RMSE and p95 of each row and area; [`summarize`] averages over occluders.
//!
//! Receivers are quasi-random by area (or volume), from a seed. Those inside the occluder, and
//! those that turn out to see nothing, are left out and counted.

pub(crate) mod areas;
mod poses;
mod quasi;
mod rows;
mod sampling;
mod stats;
pub(crate) mod surface;
mod tree;
mod triangle;
mod truth;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use aogrid_bake_core::models::{Model, to_obj};
use aogrid_bake_core::surface::SurfaceOptions;
use aogrid_bake_core::{Progress, TriangleMesh, mesh};
use aogrid_grid_format::{Grid, Source};
use glam::DVec3;
use serde::Serialize;

use crate::error::{Context, Result, bail};
use crate::reference::ReferenceOptions;
use crate::shade::{Mode, ShadeInput, Stages, Target};
use crate::{
    GridSource, Instance, Material, Scene, SceneMesh, SurfaceSource, VolumeSettings, paths,
};

pub use areas::Area;
use poses::{Pose, poses};
pub use rows::{ROWS, Row};
pub use stats::{ErrorStats, Sample};
pub use truth::Truth;

/// The options of the suite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuiteOptions {
    /// The number of receivers in each area of an occluder, over all its poses.
    pub receivers: u32,
    /// The minimum number of rays for the truth of a receiver.
    pub samples: u32,
    /// The seed of the receivers and of the rays.
    pub seed: u64,
}

impl SuiteOptions {
    /// Returns 360 receivers an area and 4,096 rays a receiver.
    pub fn recommended() -> Self {
        Self {
            receivers: 360,
            samples: 4096,
            seed: 0,
        }
    }
}

/// An occluder that is judged.
pub struct Subject {
    /// The name in tables and of files.
    pub name: String,
    mesh: TriangleMesh,
    source: Source,
}

/// Our own shapes among the subjects.
const OWN: [Model; 17] = [
    Model::Box,
    Model::Sphere,
    Model::Torus,
    Model::Table,
    Model::LShape,
    Model::Robot,
    Model::SpaceShip,
    Model::Wall,
    Model::Comb,
    Model::Stairs,
    Model::Rings,
    Model::Rod,
    Model::OpenBox,
    Model::Sheet,
    Model::Bowl,
    Model::CardTree,
    Model::Pipe,
];

/// The real meshes among the subjects, which the project does not ship.
const DATA: [&str; 15] = [
    "cloth_sheet",
    "suzanne",
    "rabbit_parts",
    "spider_groups",
    "quadknot_vcol",
    "spot_tri",
    "teapot",
    "legocar",
    "chair_messy",
    "fandisk",
    "robot_kuka_iiwa",
    "bunny_16k_nonmanifold",
    "stanford_bunny_69k",
    "sponza_dabrovic",
    "stanford_dragon_202k",
];

impl Subject {
    /// Returns our own shapes.
    pub fn own() -> Vec<Self> {
        OWN.map(Self::of_model).into()
    }

    /// Returns a mesh as an occluder.
    pub fn new(name: &str, mesh: TriangleMesh, source: Source) -> Self {
        Self {
            name: name.to_owned(),
            mesh,
            source,
        }
    }

    /// Returns one of our own shapes.
    pub fn of_model(model: Model) -> Self {
        let mesh = model.mesh(None).expect("every model has a form of its own");
        Self {
            name: model.name().to_owned(),
            source: Source {
                name: format!("{}.obj", model.name()),
                part: None,
                blake3: blake3::hash(to_obj(&mesh).as_bytes()).to_hex().to_string(),
                triangles: mesh.triangles().len() as u64,
            },
            mesh,
        }
    }

    /// Returns the real meshes of the suite that are in the data folder.
    pub fn data_files() -> Vec<PathBuf> {
        let files = DATA.map(|name| {
            let name = format!("$AOGRID_SHARED/data/meshes/{name}.obj");
            paths::resolve(Path::new(""), &name)
        });
        files.into_iter().filter(|path| path.exists()).collect()
    }

    /// Reads the mesh in the file at `path`.
    ///
    /// # Errors
    ///
    /// The file is not a mesh: the message names it.
    pub fn load(path: &Path) -> Result<Self> {
        let loaded = mesh::load(path).with_context(|| path.display().to_string())?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Self {
            name: name.into_owned(),
            source: Source::from(&loaded),
            mesh: loaded.mesh,
        })
    }
}

/// The judgment of an occluder.
#[derive(Clone, Debug, Serialize)]
pub struct SubjectReport {
    /// The occluder's name.
    pub name: String,
    /// The number of its triangles.
    pub triangles: usize,
    /// The number of receivers of each area that were left out, in the order of [`Area::ALL`].
    pub left_out: [usize; Area::ALL.len()],
    /// The judgment of each row.
    pub rows: Vec<RowReport>,
}

/// The judgment of a row.
#[derive(Clone, Debug, Serialize)]
pub struct RowReport {
    /// The row's name.
    pub name: &'static str,
    /// The errors in each area, in the order of [`Area::ALL`]; none where there are no receivers.
    pub areas: [Option<ErrorStats>; Area::ALL.len()],
}

/// The errors of a row in an area over all occluders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The root mean square of the occluders' RMSE.
    pub rmse: f64,
    /// The mean of their p95.
    pub p95: f64,
    /// The mean of their bias.
    pub bias: f64,
}

/// Bakes the grids of some rows for an occluder, shades its receivers, and compares.
///
/// # Errors
///
/// A grid cannot be baked, or the observer cancelled.
pub fn judge(
    subject: &Subject,
    truth: &Truth,
    rows: &[Row],
    stages: Stages<'_>,
) -> Result<SubjectReport> {
    let stage = stages(&format!("rows of {}", subject.name));
    let mut reports = vec![];
    for (idx, row) in rows.iter().enumerate() {
        let progress = Progress {
            done: idx,
            total: rows.len(),
        };
        if let ControlFlow::Break(()) = stage(progress) {
            bail!("the judging was cancelled");
        }
        let grid = row.bake(subject, &|_| stage(progress))?;
        reports.push(RowReport {
            name: row.name,
            areas: judge_grid(subject, truth, row.mode(), grid)?,
        });
    }
    Ok(SubjectReport {
        name: subject.name.clone(),
        triangles: subject.mesh.triangles().len(),
        left_out: truth.left_out,
        rows: reports,
    })
}

/// Returns the errors of a mode with one grid around an occluder, in each area, in the order of
/// [`Area::ALL`].
///
/// # Errors
///
/// The mode does not support the grid's encoding.
pub fn judge_grid(
    subject: &Subject,
    truth: &Truth,
    mode: &Mode,
    grid: Grid,
) -> Result<[Option<ErrorStats>; Area::ALL.len()]> {
    let grid = &GridSource::Given(Arc::new(grid));
    let mut samples: [Vec<Sample>; Area::ALL.len()] = Default::default();
    for (idx, pose) in poses(&subject.mesh).iter().enumerate() {
        let scene = scene_of(subject, pose, grid);
        let receivers: Vec<_> = truth.receivers.iter().filter(|r| r.pose == idx).collect();
        let target = Target::of_points(
            receivers.iter().map(|r| r.point).collect(),
            receivers
                .iter()
                .map(|r| u32::from(r.area == Area::Itself))
                .collect(),
        );
        let shaded = mode.shade(&ShadeInput::new(&scene, &target))?;
        for (receiver, shaded) in receivers.into_iter().zip(shaded.occlusion) {
            samples[receiver.area as usize].push(Sample {
                shaded: f64::from(shaded),
                truth: receiver.occlusion,
                truth_error: receiver.standard_error,
            });
        }
    }
    Ok(samples.map(|samples| ErrorStats::of(&samples)))
}

/// Returns the errors of every row in every area over all occluders.
pub fn summarize(subjects: &[SubjectReport]) -> Vec<[Option<Summary>; Area::ALL.len()]> {
    let n_rows = subjects.first().map_or(0, |subject| subject.rows.len());
    let summary = |row: usize, area: usize| {
        let all = subjects.iter().map(|subject| subject.rows[row].areas[area]);
        let all: Vec<ErrorStats> = all.flatten().collect();
        let n = all.len() as f64;
        let mean = |value: fn(&ErrorStats) -> f64| all.iter().map(value).sum::<f64>() / n;
        (!all.is_empty()).then(|| Summary {
            rmse: mean(|stats| stats.rmse.powi(2)).sqrt(),
            p95: mean(|stats| stats.p95),
            bias: mean(|stats| stats.bias),
        })
    };
    (0..n_rows)
        .map(|row| std::array::from_fn(|area| summary(row, area)))
        .collect()
}

/// Returns the scene of an occluder in a pose, whose instances have the ids 1, 2, ….
fn scene_of(subject: &Subject, pose: &Pose, grid: &GridSource) -> Scene {
    let instances = pose.instances.iter().enumerate();
    let instances = instances.map(|(idx, &world_from_object)| Instance {
        name: subject.name.clone(),
        id: idx as u32 + 1,
        mesh: 0,
        world_from_object,
        is_similarity: true,
        casts: true,
        strength: 1.0,
        far_field: None,
        layers: 1,
        casts_on: u32::MAX,
        excludes: vec![],
        material: 0,
    });
    Scene {
        path: format!("{}, {}", subject.name, pose.name).into(),
        up: DVec3::Y,
        camera: None,
        receivers: None,
        instances: instances.collect(),
        meshes: vec![SceneMesh {
            bind: None,
            name: subject.name.clone(),
            mesh: Arc::new(subject.mesh.clone()),
            pose: mesh::Pose::IDENTITY,
            source: subject.source.clone(),
            grid: grid.clone(),
            surface: SurfaceSource::Bake(SurfaceOptions::recommended()),
        }],
        materials: vec![Material {
            name: "white".to_owned(),
            albedo: [1.0; 3],
            gloss: None,
        }],
        ambient: [0.0; 3],
        area_light: None,
        environment: None,
        truth: ReferenceOptions::recommended(),
        volumes: VolumeSettings::default(),
        exposure: 1.0,
        shows_light: false,
        warnings: vec![],
    }
}
