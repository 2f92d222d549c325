//! Lobes of the scene's glossy surfaces.

use anyhow::{Context, bail};
use aogrid_scene::reference::{Lobe, Receiver};
use glam::DVec3;

use super::Job;

/// Returns the index of each glossy receiver and the lobe that the camera sees there.
pub(super) fn lobes(job: &Job<'_>) -> anyhow::Result<Vec<(usize, Lobe)>> {
    let pairs = job.target.receivers.iter().zip(&job.target.ids).enumerate();
    let glossy = pairs.filter_map(|(idx, (receiver, &id))| {
        let half_angle = gloss(job, id)?;
        Some(lobe(job, receiver, half_angle).map(|lobe| (idx, lobe)))
    });
    glossy.collect()
}

/// Returns the half-angle of the lobe of an instance's material, if it is glossy.
fn gloss(job: &Job<'_>, id: u32) -> Option<f64> {
    let instance = job.instances.get(id)?;
    job.scene.materials[instance.material].gloss
}

fn lobe(job: &Job<'_>, receiver: &Receiver, half_angle: f64) -> anyhow::Result<Lobe> {
    let shown = || job.scene.path.display().to_string();
    let Some(camera) = &job.scene.camera else {
        bail!(
            "{}: what a glossy surface mirrors depends on the viewer: add a [camera]",
            shown()
        );
    };
    let towards = camera.towards_viewer(DVec3::from(receiver.position));
    let lobe = Lobe::seen_from(towards.to_array(), *receiver, half_angle);
    Some(lobe)
        .filter(|_| towards.dot(receiver.normal.into()) > 0.0)
        .with_context(|| {
            let at = receiver.position;
            format!(
                "{}: the camera sees the back of the glossy receiver at {at:?}",
                shown()
            )
        })
}
