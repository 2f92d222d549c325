use std::path::{Path, PathBuf};

use aogrid_runtime::{Mode, OcclusionPassDescriptor, Receivers};
use image::GrayImage;

use crate::gpu::gpu;
use crate::raster::{Scene, descriptor, faded};
use crate::scene::{SIZE, orthographic, perspective};

/// Levels of 255: half a one from rounding to bytes on either side, and none of it from
/// transmittances, which agree to 1e-5 wherever they are computed.
const LEVELS: u8 = 1;

/// A picture that takes more than this is too large for the repository.
const MOST_BYTES: u64 = 8 << 10;

fn golden(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gpu/golden");
    folder.join(format!("{name}.png"))
}

fn picture(transmittances: &[f32]) -> GrayImage {
    let bytes = transmittances.iter().map(|t| (t * 255.0).round() as u8);
    GrayImage::from_raw(SIZE[0], SIZE[1], bytes.collect()).unwrap()
}

/// Compares with the kept picture; what was found goes to a temporary file, for a look at it.
fn compare(name: &str, found: &[f32]) {
    let found = picture(found);
    let path = golden(name);
    let kept = image::open(&path).map(|kept| kept.into_luma8());
    let same = kept.as_ref().is_ok_and(|kept| {
        let pairs = kept.iter().zip(found.iter());
        kept.dimensions() == found.dimensions()
            && pairs.fold(0, |w, (a, b)| a.abs_diff(*b).max(w)) <= LEVELS
    });
    if !same {
        let aside = std::env::temp_dir().join(format!("aogrid-{name}.png"));
        found.save(&aside).unwrap();
        panic!(
            "{} is not what was drawn: look at {}, and copy it there if it is right",
            path.display(),
            aside.display()
        );
    }
    let bytes = std::fs::metadata(&path).unwrap().len();
    assert!(bytes <= MOST_BYTES, "{name}: {bytes} bytes");
}

#[test]
fn pictures_are_those_that_were_looked_at() {
    let gpu = gpu();
    for (name, mode, camera) in [
        ("cone", Mode::Cone, perspective()),
        ("occlusion", Mode::Occlusion, perspective()),
        ("orthographic", Mode::Cone, orthographic()),
    ] {
        let mut scene = Scene::new(camera, faded());
        scene.instances[0].object_id = 3;
        compare(name, &scene.twin(mode));
        if let Some(gpu) = &gpu {
            let descriptor = OcclusionPassDescriptor {
                mode,
                receivers: Receivers::Ids,
                ..descriptor()
            };
            compare(name, &scene.transmittances(gpu, descriptor));
        }
    }
}
