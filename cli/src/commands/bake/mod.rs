//! `bake`: grid files from models.

mod args;
mod check;
mod choose;
mod jobs;
mod model_baker;
mod report;

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use aogrid_bake_core::mesh::MeshFile;

pub(crate) use args::Args;
pub use args::{SharedArgs, face_size, resolution};
use jobs::Jobs;
use model_baker::ModelBaker;
use report::{Outcome, Outputs};

use crate::backend::Backend;
use crate::console::Console;
use crate::interrupt;

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let options = args.options().unwrap_or_else(|usage| usage.exit());
    let request = args.shared.backend().unwrap_or_else(|usage| usage.exit());
    let mut placement = args.placement();
    if let (Some(bytes), None) = (args.max_bytes, args.max_error) {
        placement.resolution = [choose::resolution_within(bytes, &options)?; 3];
        console.note(&format!(
            "chose {} cells an axis: the most whose texels take {bytes} bytes or less",
            placement.resolution[0]
        ));
    }
    // Only a bake tells which resolution an error asks for.
    let force = args.force || args.max_error.is_some();
    use_threads(args.shared.threads)?;
    interrupt::listen();
    let jobs = Jobs::new(args)?;
    let mut backend = Backend::new(request, args.shared.algorithm());
    let mut outputs = Outputs::default();
    for model in &args.models {
        let shown = model.display();
        let loading = Instant::now();
        let file = MeshFile::read(model).with_context(|| shown.to_string())?;
        // A whole model that is up to date need not even be parsed.
        let single = jobs.whole_job(model);
        if let (Some(job), false) = (&single, force)
            && let Some(grid) = jobs::up_to_date(job, &placement, &options, args.check, &file)
        {
            outputs.push(Outcome::up_to_date(job, &grid), console, args.json);
            continue;
        }
        let loaded = file.parse().with_context(|| shown.to_string())?;
        let load_s = loading.elapsed().as_secs_f64();
        let of_model = match single {
            Some(job) => vec![job],
            None => jobs.part_jobs(model, &loaded.mesh)?,
        };
        for job in of_model {
            let current = match force || job.part.is_none() {
                true => None,
                false => jobs::up_to_date(&job, &placement, &options, args.check, &file),
            };
            let outcome = match current {
                Some(grid) => Outcome::up_to_date(&job, &grid),
                None => {
                    let mut baker = ModelBaker {
                        backend: &mut backend,
                        loaded: &loaded,
                        load_s,
                        placement: &placement,
                        options: &options,
                        args,
                        console,
                    };
                    baker.run(&job)?
                }
            };
            outputs.push(outcome, console, args.json);
        }
    }
    outputs.finish(console, args.json)
}

/// Starts the global thread pool with this many threads; all processors if `None`.
pub fn use_threads(threads: Option<u16>) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    pool.build_global().context("cannot start the threads")
}

/// Returns a file's name without folder and extension, for the names of outputs.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
