//! The receivers around an occluder, with their truth.

use std::fmt::Write;

use aogrid_bake_core::{Observer, Progress};
use aogrid_baker_cpu::RayScene;

use super::areas::{Area, PaperGrid};
use super::poses::{Pose, poses};
use super::sampling::Surroundings;
use super::surface::Surface;
use super::{Subject, SuiteOptions, scene_of};
use crate::GridSource;
use crate::error::{Context, Result, SceneError, bail};
use crate::reference::{self, Lighting, Receiver, ReferenceOptions};
use crate::shade::Stages;

/// Counts up with every change of the poses, areas or receivers, so that no file of an earlier
/// suite is taken for one of this.
const VERSION: u32 = 2;

/// The AO from which a receiver counts as enclosed: nobody sees it.
const ENCLOSED: f64 = 0.999;

/// The columns of a file of receivers.
const COLUMNS: [&str; 10] = [
    "pose", "area", "px", "py", "pz", "nx", "ny", "nz", "truth", "stderr",
];

/// An occluder's receivers and their truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    key: String,
    /// The number of candidates for each area that were left out: inside the occluder, or enclosed.
    pub left_out: [usize; Area::ALL.len()],
    pub(super) receivers: Vec<TrueReceiver>,
}

/// A receiver with its truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrueReceiver {
    /// The index of the pose.
    pub pose: usize,
    pub area: Area,
    /// The point in the pose's world.
    pub point: Receiver,
    pub occlusion: f64,
    pub standard_error: f64,
}

impl Truth {
    /// Finds the receivers around an occluder, and traces their truth, on all threads.
    ///
    /// # Errors
    ///
    /// The occluder cannot be placed, or the observer cancelled.
    pub fn trace(subject: &Subject, options: &SuiteOptions, stages: Stages<'_>) -> Result<Self> {
        let surface = Surface::new(&subject.mesh);
        let grid = PaperGrid::around(&subject.mesh)?;
        let mut truth = Self {
            key: key(subject, options),
            left_out: [0; Area::ALL.len()],
            receivers: vec![],
        };
        let poses = poses(&subject.mesh);
        let stage = stages(&format!("truth of {}", subject.name));
        for (idx, pose) in poses.iter().enumerate() {
            let surroundings = Surroundings {
                mesh: &subject.mesh,
                surface: &surface,
                grid: &grid,
                pose,
            };
            let mut found = vec![];
            for &area in pose.areas {
                let shares = poses.iter().filter(|p| p.areas.contains(&area)).count();
                let n = (options.receivers as usize).div_ceil(shares);
                let seed = options.seed.wrapping_add(idx as u64 * 1000);
                let (receivers, n_inside) = surroundings.receivers(area, n, seed);
                truth.left_out[area as usize] += n_inside;
                found.extend(receivers.into_iter().map(|receiver| (area, receiver)));
            }
            let within = |progress: Progress| {
                let total = progress.total.max(1);
                stage(Progress {
                    done: idx * 1000 + 1000 * progress.done / total,
                    total: poses.len() * 1000,
                })
            };
            truth.trace_pose(subject, (idx, pose), &found, options, &within)?;
        }
        Ok(truth)
    }

    fn trace_pose(
        &mut self,
        subject: &Subject,
        (idx, pose): (usize, &Pose),
        found: &[(Area, Receiver)],
        options: &SuiteOptions,
        observer: Observer<'_>,
    ) -> Result<()> {
        // Truth needs no grid.
        let scene = scene_of(subject, pose, &GridSource::File("".into()));
        let mesh = scene.flattened(|instance| instance.casts)?;
        let occluder = mesh.as_ref().map(RayScene::new);
        let points: Vec<_> = found.iter().map(|(_, receiver)| *receiver).collect();
        let traced = ReferenceOptions {
            samples: options.samples,
            seed: options.seed,
            ..ReferenceOptions::recommended()
        };
        let lighting = Lighting::default();
        let shades = reference::shade(occluder.as_ref(), &points, &lighting, &traced, observer)
            .with_context(|| subject.name.clone())?;
        for (&(area, point), shade) in found.iter().zip(shades) {
            let occlusion = f64::from(shade.occlusion.mean);
            if occlusion >= ENCLOSED {
                self.left_out[area as usize] += 1;
                continue;
            }
            self.receivers.push(TrueReceiver {
                pose: idx,
                area,
                point,
                occlusion,
                standard_error: f64::from(shade.occlusion.standard_error),
            });
        }
        Ok(())
    }

    /// Returns the receivers as CSV, with two comments in front: what they were made from, and how
    /// many were left out.
    pub fn to_csv(&self) -> String {
        let mut csv = format!("# {}\n# left out", self.key);
        let mut line = |args: std::fmt::Arguments<'_>| {
            csv.write_fmt(args).expect("a String takes any text");
        };
        self.left_out
            .iter()
            .for_each(|n| line(format_args!(" {n}")));
        line(format_args!("\n{}\n", COLUMNS.join(",")));
        for receiver in &self.receivers {
            let [px, py, pz] = receiver.point.position;
            let [nx, ny, nz] = receiver.point.normal;
            line(format_args!(
                "{},{},{px},{py},{pz},{nx},{ny},{nz},{},{}\n",
                receiver.pose,
                receiver.area.name(),
                receiver.occlusion,
                receiver.standard_error
            ));
        }
        csv
    }

    /// Reads what [`Truth::to_csv`] wrote; `None` if it was made from another occluder or with
    /// other options.
    ///
    /// # Errors
    ///
    /// The text is not such a file, or not complete.
    pub fn from_csv(text: &str, subject: &Subject, options: &SuiteOptions) -> Result<Option<Self>> {
        let mut lines = text.lines();
        let key = key(subject, options);
        if lines.next().and_then(|line| line.strip_prefix("# ")) != Some(key.as_str()) {
            return Ok(None);
        }
        let left_out = lines.next().and_then(|line| {
            let numbers = line.strip_prefix("# left out ")?.split(' ');
            let numbers: Vec<usize> = numbers.map(|n| n.parse().ok()).collect::<Option<_>>()?;
            numbers.try_into().ok()
        });
        let (Some(left_out), Some(_)) = (left_out, lines.next()) else {
            bail!("it is not a file of receivers");
        };
        let receivers = lines.map(|line| {
            receiver(line).ok_or_else(|| SceneError::new(format!("`{line}` is no receiver")))
        });
        Ok(Some(Self {
            key,
            left_out,
            receivers: receivers.collect::<Result<_>>()?,
        }))
    }
}

/// Returns the text that tells files of receivers apart.
fn key(subject: &Subject, options: &SuiteOptions) -> String {
    let SuiteOptions {
        receivers,
        samples,
        seed,
    } = options;
    format!(
        "accuracy suite {VERSION}, {}, {receivers} receivers an area, {samples} rays, seed {seed}",
        subject.source.blake3
    )
}

/// Parses a line of a file of receivers.
fn receiver(line: &str) -> Option<TrueReceiver> {
    let values: [&str; COLUMNS.len()] = line.split(',').collect::<Vec<_>>().try_into().ok()?;
    let area = Area::ALL.into_iter().find(|a| a.name() == values[1])?;
    let numbers = values[2..].iter().map(|v| v.parse().ok());
    let [px, py, pz, nx, ny, nz, occlusion, standard_error] =
        numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()?;
    Some(TrueReceiver {
        pose: values[0].parse().ok()?,
        area,
        point: Receiver {
            position: [px, py, pz],
            normal: [nx, ny, nz],
        },
        occlusion,
        standard_error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::UNOBSERVED;
    use aogrid_bake_core::models::Model;

    #[test]
    fn files_of_receivers_are_read_back_or_known_to_be_of_something_else() {
        let options = SuiteOptions {
            receivers: 8,
            samples: 8,
            seed: 0,
        };
        let subject = Subject::of_model(Model::Table);
        let truth = Truth::trace(&subject, &options, &|_| Box::new(UNOBSERVED)).unwrap();
        assert!(truth.receivers.len() > 30, "{}", truth.receivers.len());
        let csv = truth.to_csv();
        let read = |csv: &str, options| Truth::from_csv(csv, &subject, options);
        assert_eq!(read(&csv, &options).unwrap(), Some(truth));
        let other = SuiteOptions { seed: 1, ..options };
        assert_eq!(read(&csv, &other).unwrap(), None);
        assert!(read(&csv[..csv.len() - 40], &options).is_err());
    }
}
