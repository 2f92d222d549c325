//! Measures the volume pass on a skinned model over a floor: the prisms that a pixel is covered by; the
//! time of a covered pixel with and without a depth test, relative to that of a grid's cone; and time and
//! error of smaller targets. Prints three tables.
//!
//! ```sh
//! AOGRID_SHARED=../shared cargo bench -p aogrid-runtime --bench volumes
//! ```
//!
//! The model is `data/meshes/Fox_skinned.glb` in the folder that `AOGRID_SHARED` names. The methods
//! alternate within each round, and medians are compared, so that other load on the machine slows all of
//! them alike.

mod passes;
mod picture;

use std::path::PathBuf;

use aogrid_gpu_support::{Gpu, gpu_with};
use aogrid_runtime::VolumeResolution::{self, Full, Half, Quarter};

use passes::{Prepared, Textures};
use picture::Picture;

#[path = "../../tests/gpu/grids.rs"]
#[allow(dead_code, reason = "the tests need more of it")]
mod grids;

const SIZE: [u32; 2] = [512, 384];

/// The model's height, and the extents relative to it.
const HEIGHT: f32 = 79.0;
const EXTENTS: [f32; 4] = [0.1, 0.25, 0.5, 1.0];

/// Measured rounds, after one that warms up; medians are reported.
const ROUNDS: usize = 7;

fn main() {
    let Some(folder) = std::env::var_os("AOGRID_SHARED").map(PathBuf::from) else {
        println!("AOGRID_SHARED names no folder with data/meshes/Fox_skinned.glb");
        return;
    };
    let features = wgpu::Features::FLOAT32_BLENDABLE | wgpu::Features::PIPELINE_STATISTICS_QUERY;
    let Some(gpu) = gpu_with(features) else {
        return;
    };
    let picture = Picture::new(&folder.join("data/meshes/Fox_skinned.glb"));
    println!("prisms a pixel whose ends are behind it");
    println!("extent    floor    model      all");
    for extent in EXTENTS {
        let prisms = picture.prisms(extent * HEIGHT);
        let mean = |chosen: &dyn Fn(bool) -> bool| {
            let counts = prisms.iter().zip(&picture.is_floor);
            let counts = counts.filter(|(_, is_floor)| chosen(**is_floor));
            let (sum, count) = counts.fold((0, 0), |(sum, n), (c, _)| (sum + c, n + 1));
            f64::from(sum) / f64::from(count)
        };
        let [floor, model, all] = [mean(&|floor| floor), mean(&|floor| !floor), mean(&|_| true)];
        println!("{extent:>6} {floor:>8.1} {model:>8.1} {all:>8.1}");
    }
    let textures = Textures::new(&gpu, &picture);
    depth_tests(&gpu, &picture, &textures);
    resolutions(&gpu, &picture, &textures);
}

/// Prints the milliseconds and fragments of each extent, and a fragment's time relative to a cone's.
fn depth_tests(gpu: &Gpu, picture: &Picture, textures: &Textures) {
    let kinds = EXTENTS.map(|extent| [(extent, false), (extent, true)]);
    let kinds = kinds.concat();
    let of = |(extent, is_tested): &(f32, bool)| {
        Prepared::volumes(gpu, picture, textures, extent * HEIGHT, (Full, *is_tested))
    };
    let mut passes: Vec<Prepared> = kinds.iter().map(of).collect();
    passes.push(Prepared::cones(gpu, picture, textures));
    let times = medians(gpu, &passes);
    let fragments: Vec<u64> = passes.iter().map(|pass| pass.fragments(gpu)).collect();
    let per_fragment = |idx: usize| times[idx] / fragments[idx] as f64;
    println!("\nextent   depth test        ms   fragments   a pixel   a fragment, in cones");
    for (idx, (extent, is_tested)) in kinds.iter().enumerate() {
        println!(
            "{extent:>6} {is_tested:>12} {:>9.1} {:>11} {:>9.1} {:>22.2}",
            times[idx],
            fragments[idx],
            fragments[idx] as f64 / picture.points.len() as f64,
            per_fragment(idx) / per_fragment(kinds.len())
        );
    }
}

/// Prints the time and error of smaller targets, relative to the full resolution.
fn resolutions(gpu: &Gpu, picture: &Picture, textures: &Textures) {
    println!("\nextent   resolution    time      rmse");
    for extent in EXTENTS {
        let of = |resolution: VolumeResolution| {
            Prepared::volumes(gpu, picture, textures, extent * HEIGHT, (resolution, true))
        };
        let resolutions = [Full, Half, Quarter];
        let passes = resolutions.map(of);
        let times = medians(gpu, &passes);
        let full = passes[0].sums(gpu);
        for ((pass, resolution), time) in passes.iter().zip(resolutions).zip(&times) {
            let sums = pass.sums(gpu);
            let squares = sums.iter().zip(&full).map(|(a, b)| {
                let [a, b] = [a, b].map(|sum| f64::from(sum.min(1.0)));
                (a - b).powi(2)
            });
            let rmse = (squares.sum::<f64>() / full.len() as f64).sqrt();
            let name = format!("{resolution:?}");
            println!(
                "{extent:>6} {name:>12} {:>7.2} {rmse:>9.4}",
                time / times[0]
            );
        }
    }
}

/// Returns the median milliseconds of passes, which take turns.
fn medians(gpu: &Gpu, passes: &[Prepared]) -> Vec<f64> {
    let mut all = vec![vec![]; passes.len()];
    for round in 0..=ROUNDS {
        for (pass, times) in passes.iter().zip(&mut all) {
            let time = pass.time(gpu);
            if round > 0 {
                times.push(time);
            }
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    };
    all.into_iter().map(median).collect()
}
