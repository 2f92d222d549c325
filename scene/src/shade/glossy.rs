//! Lobes of the scene's glossy surfaces.

use glam::DVec3;

use super::ShadeInput;
use crate::error::{Result, SceneError, bail};
use crate::reference::{Lobe, Receiver};

/// Returns the index of each glossy receiver and the lobe that the camera sees there.
pub(super) fn lobes(input: &ShadeInput<'_>) -> Result<Vec<(usize, Lobe)>> {
    let pairs = input
        .target
        .receivers
        .iter()
        .zip(&input.target.ids)
        .enumerate();
    let glossy = pairs.filter_map(|(idx, (receiver, &id))| {
        let half_angle = gloss(input, id)?;
        Some(lobe(input, receiver, half_angle).map(|lobe| (idx, lobe)))
    });
    glossy.collect()
}

/// Returns the half-angle of the lobe of an instance's material, if it is glossy.
fn gloss(input: &ShadeInput<'_>, id: u32) -> Option<f64> {
    let instance = input.instances.get(id)?;
    input.scene.materials[instance.material].gloss
}

fn lobe(input: &ShadeInput<'_>, receiver: &Receiver, half_angle: f64) -> Result<Lobe> {
    let shown = || input.scene.path.display().to_string();
    let Some(camera) = &input.scene.camera else {
        bail!(
            "{}: what a glossy surface mirrors depends on the viewer: add a [camera]",
            shown()
        );
    };
    let towards = camera.towards_viewer(DVec3::from(receiver.position));
    let lobe = Lobe::seen_from(towards.to_array(), *receiver, half_angle);
    Some(lobe)
        .filter(|_| towards.dot(receiver.normal.into()) > 0.0)
        .ok_or_else(|| {
            let at = receiver.position;
            SceneError::new(format!(
                "{}: the camera sees the back of the glossy receiver at {at:?}",
                shown()
            ))
        })
}
