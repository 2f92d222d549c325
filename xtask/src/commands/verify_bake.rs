//! `verify-bake`: comparison of the sweep's faces with rays, texel by texel.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use aogrid_bake_core::{BakeOptions, FaceBits, Placement, PreparedMesh, RawGrid, mesh};
use aogrid_baker_cpu as cpu;
use aogrid_baker_gpu::{self as gpu, AdapterSelector, Context};

use aogrid::console::Console;
use aogrid::interrupt;
use aogrid::{face_size, resolution, use_threads};
use aogrid_baker_cpu::parity::{MAX_MISMATCH_RATE, Parity};

/// Compare the sweep's faces, texel by texel, with rays cast at the same quantized mesh on the CPU
///
/// They may differ in 8 of 50 million texels, where a ray passes an edge within the resolution of
/// single floats; every differing texel is checked for that. Moments must equal the sums over the
/// texels bit for bit, and so must the faces and moments of all SIMD levels of this machine.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Wavefront OBJ files
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// Cells along the axes, 8 to 2048 each: one number, or three as in 32x24x32
    #[arg(long, default_value = "32", value_parser = resolution, allow_hyphen_values = true)]
    resolution: [u32; 3],
    /// Texels along a cube face's side, 8 to 128
    #[arg(long, default_value_t = 16, value_parser = face_size)]
    face_size: u32,
    /// The GPU whose sweep is compared, by a part of its name [default: the CPU's sweep]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Threads to bake with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// The examples at the end of `verify-bake --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask verify-bake assets/robot.obj
  cargo xtask verify-bake assets/space-ship.obj --resolution 24x16x32 --face-size 8
  cargo xtask verify-bake assets/table.obj --adapter llvmpipe";

/// The sweep that is compared with rays.
enum AnySweeper {
    /// One for each SIMD level, with its name.
    Cpu(Vec<(&'static str, cpu::Sweeper)>),
    Gpu(Box<(gpu::Sweeper, Context)>),
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.threads)?;
    interrupt::listen();
    let mut sweep = match &args.adapter {
        None => {
            let levels = cpu::Sweeper::simd_levels();
            console.note(&format!("at {}", levels.join(", ")));
            let sweeper = |level| Some((level, cpu::Sweeper::with_simd_level(level)?));
            AnySweeper::Cpu(levels.into_iter().filter_map(sweeper).collect())
        }
        Some(name) => {
            let context = Context::new(&AdapterSelector::Named(name.clone()))?;
            console.note(&format!("on {}", context.adapter().name));
            AnySweeper::Gpu(Box::new((gpu::Sweeper::new(&context), context)))
        }
    };
    let (mut texels, mut differing) = (0, 0);
    for path in &args.models {
        let found = compare(path, args, &mut sweep, console);
        let parity = found.with_context(|| path.display().to_string())?;
        console.result(&line(path, &parity));
        if let Some(violation) = parity.fault() {
            bail!("{}: {violation}", path.display());
        }
        texels += parity.texels;
        differing += parity.differences.len();
    }
    let allowed = ((MAX_MISMATCH_RATE * texels as f64) as usize).max(1);
    console.result(&format!(
        "{differing} of {texels} texels differ; {allowed} may"
    ));
    if differing > allowed {
        bail!("more texels differ than are allowed");
    }
    Ok(())
}

fn compare(
    path: &Path,
    args: &Args,
    sweep: &mut AnySweeper,
    console: &Console,
) -> anyhow::Result<Parity> {
    let mesh = mesh::load(path)?.mesh;
    let placement = Placement {
        resolution: args.resolution,
        ..Placement::paper()
    };
    let spec = placement.place(&mesh.bounds())?;
    let prepared = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET)?;
    let bar = console.progress(&path.display().to_string());
    let observer = |progress| bar.observe(progress);
    let size = args.face_size;
    let baked: (RawGrid, FaceBits);
    let parity = match sweep {
        AnySweeper::Cpu(levels) => {
            let [(best, sweeper), others @ ..] = &mut levels[..] else {
                bail!("there is no SIMD level");
            };
            baked = sweeper.bake_with_bits(&prepared, size, &observer)?;
            for (level, sweeper) in others {
                if sweeper.bake_with_bits(&prepared, size, &observer)? != baked {
                    bail!("the bits of {level} differ from those of {best}");
                }
            }
            Parity::new(&prepared, size, baked)
        }
        AnySweeper::Gpu(both) => {
            let (sweeper, context) = &mut **both;
            let uploaded = context.block_on(sweeper.upload(prepared))?;
            let bake = sweeper.bake_with_bits(&uploaded, size, &observer);
            baked = context.block_on(bake)?;
            Parity::new(uploaded.mesh(), size, baked)
        }
    };
    Ok(parity)
}

/// Describes a comparison in one line.
fn line(path: &Path, parity: &Parity) -> String {
    let farthest = parity.grazes.iter().copied().fold(0.0, f64::max);
    let distances = match parity.differences.len() {
        0 => String::new(),
        _ => format!(
            ", each within {farthest:.1e} cells of an edge ({:.1e} may be), {} in a row",
            parity.float_distance,
            parity.longest_run()
        ),
    };
    format!(
        "{}: {} of {} texels differ{distances}; {} are occluded",
        path.display(),
        parity.differences.len(),
        parity.texels,
        parity.occluded
    )
}
