//! `bench`: how long the stages of a bake take, in one process, warm.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use aogrid_bake_core::{BakeOptions, Kernel, Placement, mesh, post};
use aogrid_baker_cpu::Sweeper;
use aogrid_baker_gpu::{self as gpu, Choice};
use aogrid_grid_format::{Method, Source};
use serde::Serialize;

use super::bake::{SamplingArgs, use_threads};
use crate::backend::{Asked, Backend, By, Seen};
use crate::console::Console;
use crate::interrupt;

/// Time the stages of a bake: medians over repeats after one warm-up, in one process
///
/// Kernels and backends take turns and get a row each; --kernel and --backend name one to
/// measure alone. With --adapter and without --backend an adapter is measured beside the CPU.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Wavefront OBJ files
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Measure the CPU's sweep with each set of instructions that this machine has and it knows
    #[arg(long)]
    instructions: bool,
    /// Measure only these rows, as in cpu:rays,gpu:sweep [default: every kernel on every backend]
    #[arg(long, value_delimiter = ',', value_parser = row_name, value_name = "BACKEND:KERNEL", conflicts_with = "kernel")]
    only: Vec<(On, Kernel)>,
    /// How often to measure
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum On {
    Cpu,
    Gpu,
}

fn row_name(text: &str) -> Result<(On, Kernel), String> {
    let wrong = || format!("`{text}` is not one of cpu:sweep, cpu:rays, gpu:sweep, gpu:rays");
    let (backend, kernel) = text.split_once(':').ok_or_else(wrong)?;
    let on = match backend {
        "cpu" => On::Cpu,
        "gpu" => On::Gpu,
        _ => return Err(wrong()),
    };
    let kernel = [Kernel::Sweep, Kernel::Rays]
        .into_iter()
        .find(|k| k.name() == kernel);
    Ok((on, kernel.ok_or_else(wrong)?))
}

#[derive(Serialize)]
struct Report {
    models: Vec<Model>,
}

#[derive(Serialize)]
struct Model {
    file: PathBuf,
    triangles: usize,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    method: &'static str,
    kernel: &'static str,
    /// Of the CPU's sweep, where they are compared.
    instructions: Option<&'static str>,
    backend: &'static str,
    adapter: Option<String>,
    threads: usize,
    /// Everything between the loaded mesh and the first direction.
    prepare_s: f64,
    visibility_s: f64,
    post_s: f64,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.sampling.threads)?;
    interrupt::listen();
    let models = args.models.iter().map(|path| measure(path, args, console));
    let report = Report {
        models: models.collect::<anyhow::Result<_>>()?,
    };
    if args.json {
        return console.json(&report);
    }
    console.result("triangles  prepare ms  visibility ms  post ms  threads  kernel  on    file");
    for model in &report.models {
        for row in &model.rows {
            let on = row.adapter.as_deref().or(row.instructions);
            console.result(&format!(
                "{:9}  {:10.2}  {:13.2}  {:7.2}  {:7}  {:6}  {:4}  {}",
                model.triangles,
                1e3 * row.prepare_s,
                1e3 * row.visibility_s,
                1e3 * row.post_s,
                row.threads,
                row.kernel,
                on.unwrap_or(row.backend),
                model.file.display()
            ));
        }
    }
    Ok(())
}

fn measure(path: &Path, args: &Args, console: &Console) -> anyhow::Result<Model> {
    let shown = || path.display().to_string();
    let loaded = mesh::load(path).with_context(shown)?;
    let placement = Placement {
        resolution: args.sampling.resolution,
        ..Placement::default()
    };
    let mut options = BakeOptions::recommended();
    if let Some(size) = args.sampling.face_size {
        options.method = Method::Faces { size };
    }
    let spec = placement.place(&loaded.mesh.bounds()).with_context(shown)?;
    let bar = console.progress(&shown());
    let mut bakers: Vec<_> = backends(args)?
        .into_iter()
        .map(|(backend, instructions)| (backend, instructions, None, Vec::new()))
        .collect();
    // The first repeat warms up and is not counted. Kernels take turns, so that a machine that
    // slows down slows all of them.
    for repeat in 0..=args.repeat {
        for (backend, _, by, samples) in &mut bakers {
            let observer = |progress| bar.observe(progress);
            let seen = backend.bake(&loaded.mesh, spec, &options, &observer);
            let Seen {
                raw,
                by: found,
                prepare_s,
                visibility_s,
                ..
            } = seen.with_context(shown)?;
            *by = Some(found);
            let start = Instant::now();
            post::finish(raw, &placement, &options, Source::from(&loaded)).with_context(shown)?;
            if repeat > 0 {
                samples.push([prepare_s, visibility_s, start.elapsed().as_secs_f64()]);
            }
        }
    }
    let rows = bakers
        .into_iter()
        .filter_map(|(_, instructions, by, samples)| Some(row(by?, instructions, &samples)));
    Ok(Model {
        file: path.to_owned(),
        triangles: loaded.mesh.triangles().len(),
        rows: rows.collect(),
    })
}

/// What is measured: each kernel on each backend that is asked for and there, and the names of
/// instructions that are compared.
fn backends(args: &Args) -> anyhow::Result<Vec<(Backend, Option<&'static str>)>> {
    let asked = args.sampling.backend().unwrap_or_else(|usage| usage.exit());
    let with_cpu = !matches!(asked, Asked::Gpu(_));
    let choice = match asked {
        Asked::Cpu => None,
        Asked::Gpu(choice) => Some(choice),
        Asked::Named(name) => Some(Choice::Named(name)),
        // Without a real GPU there are only the CPU's rows.
        Asked::Auto => gpu::Context::new(&Choice::Real)
            .is_ok()
            .then_some(Choice::Real),
    };
    let kernels = match args.sampling.kernel() {
        Some(one) => vec![one],
        None => vec![Kernel::Sweep, Kernel::Rays],
    };
    let each = |on: On, asked: Asked| {
        let is_wanted = |k: &&Kernel| args.only.is_empty() || args.only.contains(&(on, **k));
        let backend = move |&kernel| (Backend::new(asked.clone(), Some(kernel)), None);
        kernels
            .iter()
            .filter(is_wanted)
            .map(backend)
            .collect::<Vec<_>>()
    };
    let mut all = Vec::new();
    if with_cpu && args.instructions && kernels.contains(&Kernel::Sweep) {
        let sets = Sweeper::instruction_sets().into_iter();
        all.extend(sets.map(|set| (Backend::sweep_with(set), Some(set))));
    } else if with_cpu {
        all.extend(each(On::Cpu, Asked::Cpu));
    }
    if let Some(choice) = choice {
        all.extend(each(On::Gpu, Asked::Gpu(choice)));
    }
    if all.is_empty() {
        bail!("there is nothing to measure: name an adapter, or another row");
    }
    Ok(all)
}

/// The medians of what was measured: prepare, visibility, post.
fn row(by: By, instructions: Option<&'static str>, samples: &[[f64; 3]]) -> Row {
    let [prepare_s, visibility_s, post_s] =
        [0, 1, 2].map(|stage| median(samples.iter().map(|sample| sample[stage]).collect()));
    Row {
        method: "faces",
        kernel: by.kernel.name(),
        instructions,
        backend: by.backend(),
        adapter: by.adapter,
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
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![7.0]), 7.0);
    }
}
