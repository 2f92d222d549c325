//! `bench`: the times of a bake's stages, measured warm in one process.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use aogrid_bake_core::{Algorithm, BakeOptions, Placement, mesh, post, post::Refinements};
use aogrid_baker_cpu::{RayScene, Sweeper};
use aogrid_baker_gpu::{self as gpu, AdapterSelector};
use aogrid_grid_format::{Sampling, Source};
use serde::Serialize;

use aogrid::backend::{Backend, BackendRequest, Provenance, TimedBake};
use aogrid::console::Console;
use aogrid::interrupt;
use aogrid::{SharedArgs, use_threads};

/// Time the stages of a bake: medians over repeats after one warm-up, in one process
///
/// Algorithms and backends take turns and get a row each; --algorithm and --backend select one.
/// With --adapter and without --backend, the adapter is measured beside the CPU.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Wavefront OBJ files
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    #[command(flatten)]
    shared: SharedArgs,
    /// Measure the CPU's sweep at each SIMD level that this machine supports
    #[arg(long)]
    instructions: bool,
    /// Measure only these rows, as in cpu:rays,gpu:sweep [default: every algorithm on every
    /// backend]
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = row_name,
        value_name = "BACKEND:ALGORITHM",
        conflicts_with = "algorithm"
    )]
    only: Vec<(Device, Algorithm)>,
    /// Number of repeats to measure
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `bench --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask bench assets/space-ship.obj --backend cpu --threads 1
  cargo xtask bench assets/space-ship.obj --algorithm sweep --resolution 64 --repeat 9 --json
  cargo xtask bench assets/table.obj --backend cpu --algorithm sweep --instructions";

/// The kind of device that a row is measured on.
#[derive(Clone, Copy, PartialEq)]
enum Device {
    Cpu,
    Gpu,
}

/// Parses a row's name, `BACKEND:ALGORITHM`.
fn row_name(text: &str) -> Result<(Device, Algorithm), String> {
    let wrong = || format!("`{text}` is not one of cpu:sweep, cpu:rays, gpu:sweep, gpu:rays");
    let (backend, algorithm) = text.split_once(':').ok_or_else(wrong)?;
    let device = match backend {
        "cpu" => Device::Cpu,
        "gpu" => Device::Gpu,
        _ => return Err(wrong()),
    };
    let algorithm = [Algorithm::DirectionSweep, Algorithm::RayCasting]
        .into_iter()
        .find(|k| k.name() == algorithm);
    Ok((device, algorithm.ok_or_else(wrong)?))
}

#[derive(Serialize)]
struct Report {
    models: Vec<ModelReport>,
}

#[derive(Serialize)]
struct ModelReport {
    file: PathBuf,
    triangles: usize,
    rows: Vec<RowReport>,
}

#[derive(Serialize)]
struct RowReport {
    sampling: &'static str,
    algorithm: &'static str,
    /// SIMD level of the CPU's sweep or rays.
    instructions: Option<&'static str>,
    backend: &'static str,
    adapter: Option<String>,
    threads: usize,
    /// Seconds between the loaded mesh and the first direction.
    prepare_s: f64,
    visibility_s: f64,
    post_s: f64,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.shared.threads)?;
    interrupt::listen();
    let models = args.models.iter().map(|path| measure(path, args, console));
    let report = Report {
        models: models.collect::<anyhow::Result<_>>()?,
    };
    if args.json {
        return console.json(&report);
    }
    console.result(
        "triangles  prepare ms  visibility ms  post ms  threads  algorithm  on        file",
    );
    for model in &report.models {
        for row in &model.rows {
            let on = row.adapter.as_deref().or(row.instructions);
            console.result(&format!(
                "{:9}  {:10.2}  {:13.2}  {:7.2}  {:7}  {:9}  {:8}  {}",
                model.triangles,
                1e3 * row.prepare_s,
                1e3 * row.visibility_s,
                1e3 * row.post_s,
                row.threads,
                row.algorithm,
                on.unwrap_or(row.backend),
                model.file.display()
            ));
        }
    }
    Ok(())
}

/// Measures all rows of a model.
fn measure(path: &Path, args: &Args, console: &Console) -> anyhow::Result<ModelReport> {
    let shown = || path.display().to_string();
    let loaded = mesh::load(path).with_context(shown)?;
    let placement = Placement {
        resolution: args.shared.resolution.unwrap_or([32; 3]),
        ..Placement::paper()
    };
    let mut options = BakeOptions::paper();
    if let Some(size) = args.shared.face_size {
        options.sampling = Sampling::CubeFaces { size };
    }
    let spec = placement.place(&loaded.mesh.bounds()).with_context(shown)?;
    let bar = console.progress(&shown());
    let mut bakers: Vec<_> = measured_backends(args)?
        .into_iter()
        .map(|(backend, instructions)| (backend, instructions, None, Vec::new()))
        .collect();
    // The first repeat warms up and is not counted. The algorithms take turns, so that a machine
    // that slows down affects all of them.
    for repeat in 0..=args.repeat {
        for (backend, _, provenance, samples) in &mut bakers {
            let observer = |progress| bar.observe(progress);
            let timed = backend.bake(&loaded.mesh, spec, &options, &observer);
            let TimedBake {
                raw,
                provenance: found,
                prepare_s,
                visibility_s,
                ..
            } = timed.with_context(shown)?;
            *provenance = Some(found);
            let start = Instant::now();
            post::finish(
                raw,
                &Refinements::default(),
                &placement,
                &options,
                Source::from(&loaded),
            )
            .with_context(shown)?;
            if repeat > 0 {
                samples.push([prepare_s, visibility_s, start.elapsed().as_secs_f64()]);
            }
        }
    }
    let rows = bakers
        .into_iter()
        .filter_map(|(_, instructions, provenance, samples)| {
            Some(row(provenance?, instructions, &samples))
        });
    Ok(ModelReport {
        file: path.to_owned(),
        triangles: loaded.mesh.triangles().len(),
        rows: rows.collect(),
    })
}

/// Returns the backends to measure, one for each row: each algorithm on each device that is both
/// requested and present, or each SIMD level of the CPU's sweep; with the level of those on the CPU.
fn measured_backends(args: &Args) -> anyhow::Result<Vec<(Backend, Option<&'static str>)>> {
    let request = args.shared.backend()?;
    let with_cpu = !matches!(request, BackendRequest::Gpu(_));
    let choice = match request {
        BackendRequest::Cpu => None,
        BackendRequest::Gpu(choice) => Some(choice),
        BackendRequest::Named(name) => Some(AdapterSelector::Named(name)),
        // A machine without a hardware GPU has only the CPU's rows.
        BackendRequest::Auto => gpu::Context::new(&AdapterSelector::Real)
            .is_ok()
            .then_some(AdapterSelector::Real),
    };
    let algorithms = match args.shared.algorithm() {
        Some(one) => vec![one],
        None => vec![Algorithm::DirectionSweep, Algorithm::RayCasting],
    };
    let each = |device: Device, request: BackendRequest| {
        let is_wanted = |a: &&Algorithm| args.only.is_empty() || args.only.contains(&(device, **a));
        let level = |algorithm| (device == Device::Cpu).then(|| best_level(algorithm));
        let backend = move |&algorithm| {
            let backend = Backend::new(request.clone(), Some(algorithm));
            (backend, level(algorithm))
        };
        algorithms
            .iter()
            .filter(is_wanted)
            .map(backend)
            .collect::<Vec<_>>()
    };
    let mut all = Vec::new();
    if with_cpu && args.instructions && algorithms.contains(&Algorithm::DirectionSweep) {
        let levels = Sweeper::simd_levels().into_iter();
        all.extend(levels.map(|level| (Backend::sweep_at_level(level), Some(level))));
    } else if with_cpu {
        all.extend(each(Device::Cpu, BackendRequest::Cpu));
    }
    if let Some(choice) = choice {
        all.extend(each(Device::Gpu, BackendRequest::Gpu(choice)));
    }
    if all.is_empty() {
        bail!("there is nothing to measure: name an adapter, or another row");
    }
    Ok(all)
}

/// Returns the SIMD level that the CPU uses on this machine.
fn best_level(algorithm: Algorithm) -> &'static str {
    match algorithm {
        Algorithm::DirectionSweep => Sweeper::simd_levels()[0],
        Algorithm::RayCasting => RayScene::simd_levels()[0],
    }
}

/// Returns a row with the medians of the measured times: prepare, visibility, post.
fn row(
    provenance: Provenance,
    instructions: Option<&'static str>,
    samples: &[[f64; 3]],
) -> RowReport {
    let [prepare_s, visibility_s, post_s] =
        [0, 1, 2].map(|stage| median(samples.iter().map(|sample| sample[stage]).collect()));
    RowReport {
        sampling: "faces",
        algorithm: provenance.algorithm.name(),
        instructions,
        backend: provenance.backend(),
        adapter: provenance.adapter,
        threads: rayon::current_num_threads(),
        prepare_s,
        visibility_s,
        post_s,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() % 2 {
        0 => (values[middle - 1] + values[middle]) / 2.0,
        _ => values[middle],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_value_or_the_mean_of_two() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![7.0]), 7.0);
    }
}
