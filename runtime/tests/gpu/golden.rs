use std::path::{Path, PathBuf};

use aogrid_gpu_support::gpu;
use aogrid_runtime::{GBufferFormat, Mode, OcclusionPassDescriptor, Receivers};
use image::GrayImage;

use crate::raster::{Scene, descriptor, faded, world_and_signed};
use crate::scene::{SIZE, orthographic, perspective};

/// The largest allowed difference, in levels of 255. Rounding to bytes gives half a level on either
/// side; transmittances add none, since they agree to 1e-5 wherever they are computed.
const MAX_LEVEL_DIFFERENCE: u8 = 1;

/// The largest size of a golden image file, in bytes: larger ones do not belong in the repository.
const MAX_BYTES: u64 = 8 << 10;

fn golden_path(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gpu/golden");
    folder.join(format!("{name}.png"))
}

fn picture(transmittances: &[f32]) -> GrayImage {
    let bytes = transmittances.iter().map(|t| (t * 255.0).round() as u8);
    GrayImage::from_raw(SIZE[0], SIZE[1], bytes.collect()).unwrap()
}

/// Compares an image with its golden image; if they differ, saves the new one in a temporary file
/// for inspection.
fn compare(name: &str, found: &[f32]) {
    let found = picture(found);
    let path = golden_path(name);
    let golden = image::open(&path).map(|golden| golden.into_luma8());
    let same = golden.as_ref().is_ok_and(|golden| {
        let pairs = golden.iter().zip(found.iter());
        golden.dimensions() == found.dimensions()
            && pairs.fold(0, |w, (a, b)| a.abs_diff(*b).max(w)) <= MAX_LEVEL_DIFFERENCE
    });
    if !same {
        let aside = std::env::temp_dir().join(format!("aogrid-{name}.png"));
        found.save(&aside).unwrap();
        panic!(
            "{} differs from the rendered image {}; look at that, and copy it there if it is right",
            path.display(),
            aside.display()
        );
    }
    let bytes = std::fs::metadata(&path).unwrap().len();
    assert!(bytes <= MAX_BYTES, "{name}: {bytes} bytes");
}

#[test]
fn images_match_the_golden_images() {
    let gpu = gpu();
    for (name, mode, camera) in [
        ("cone", Mode::Cone, perspective()),
        ("occlusion", Mode::Occlusion, perspective()),
        ("orthographic", Mode::Cone, orthographic()),
    ] {
        let mut scene = Scene::new(camera, faded());
        scene.instances[0].object_id = 3;
        compare(name, &scene.twin_image(mode));
        if let Some(gpu) = &gpu {
            let descriptor = OcclusionPassDescriptor {
                mode,
                gbuffer: GBufferFormat {
                    receivers: Receivers::Ids,
                    ..world_and_signed()
                },
                ..descriptor()
            };
            compare(name, &scene.transmittances(gpu, descriptor));
        }
    }
}
