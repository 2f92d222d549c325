//! The command line of `bake` and its conversion to bake options.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use aogrid_bake_core::{BakeOptions, Extent, Placement, Preset};
use aogrid_baker_cpu::Algorithm;
use aogrid_baker_gpu::AdapterSelector;
use aogrid_grid_format::{BoundaryMode, Encoding, Interior, Sampling, TexelFormat};
use clap::ValueEnum;

use super::inputs;
use super::values::{
    face_size, half_extents, named, positive, ray_count, resolution, sample_offset, self_offset,
    share,
};
use crate::backend::BackendRequest;
use crate::memory;
use crate::usage::conflict;

/// Bake the ambient occlusion around a model into a grid file
///
/// Several models, those of a folder or one with --parts go into the folder OUT, one file each, named after
/// model and part. An output that is up to date is not baked again.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Models: OBJ, glTF, GLB, STL or PLY files, or .gz of them; folders of them; or patterns with *
    /// and ?
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<PathBuf>,
    /// The grid file to write (*.ao.ktx2), or a folder for several
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    /// Options that belong together, which other options then change: shadows near to ray tracing
    /// in 128 KiB (default), 16 KiB (economy) or 432 KiB (fine), or the method of the papers
    #[arg(long, default_value = "default", value_parser = named(Preset::ALL, Preset::name, &[]))]
    pub preset: Preset,
    #[command(flatten)]
    pub shared: SharedArgs,
    /// Extend the grid to where the model occludes about this share of the sphere [default: 0.8;
    /// paper: 0.1]
    #[arg(long, value_parser = share, conflicts_with = "half_extents", allow_hyphen_values = true)]
    pub epsilon: Option<f32>,
    /// Adjust the box until layers of cells' centers lie just outside the model's bounding box
    /// [default: on; paper: off]
    #[arg(long, value_enum, conflicts_with = "half_extents")]
    pub snap: Option<Switch>,
    /// Half-extents of the grid instead, in the model's units, around its bounding box's center
    #[arg(long, value_name = "X,Y,Z", value_parser = half_extents, allow_hyphen_values = true)]
    pub half_extents: Option<[f32; 3]>,
    /// Directions of a cell: the texels of six cube faces, or random rays (Monte Carlo)
    #[arg(long, alias = "method", value_enum, default_value_t = SamplingArg::Faces)]
    pub sampling: SamplingArg,
    /// Rays a cell, 1 to 100000 [with --sampling monte-carlo; default: 256]
    #[arg(long, value_parser = ray_count, conflicts_with = "face_size")]
    pub rays: Option<u32>,
    /// Seed of the rays' directions [with --sampling monte-carlo; default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Ignore geometry that is farther from a cell than this, in the model's units [default:
    /// unlimited]
    #[arg(long, value_name = "D", value_parser = positive, allow_hyphen_values = true)]
    pub max_distance: Option<f32>,
    /// Content of a texel: the occluded share of the sphere with the first moment of its
    /// directions, with its average direction, or alone [default: moment; paper: cone]
    #[arg(long, value_parser = named(Encoding::ALL, Encoding::name, &[]))]
    pub encoding: Option<Encoding>,
    /// Storage format of a texel's values
    #[arg(long, default_value = "unorm8", value_parser = named(TexelFormat::ALL, TexelFormat::name, &[]))]
    pub format: TexelFormat,
    /// Boundary treatment, which fades occlusion out at the grid's boundary: as in the journal
    /// paper, as in the research report, or none [default: none; paper: jgt]
    #[arg(long, value_parser = named(BoundaryMode::ALL, BoundaryMode::name, &[]))]
    pub boundary: Option<BoundaryMode>,
    /// Cells that count as inside the model and are filled from their neighbors: those inside by
    /// the signed count of surface layers, even if the mesh has holes; only those that see no sky;
    /// or none [default: signed; paper: enclosed]
    #[arg(long, value_parser = named(Interior::ALL, Interior::name, &[("fill", "enclosed")]))]
    pub interior: Option<Interior>,
    /// Fit cells near the surface so that what is interpolated between them is right; bakes a
    /// second, finer grid around the model [default: on where the encoding is moment and the
    /// boundary none; paper: off]
    #[arg(long, value_enum)]
    pub fit: Option<Switch>,
    /// Distance along its normal, in cells, at which the model's own surface looks up the grid, 0
    /// to 2; renderers read it from the file [default: 0.25, 0.5 for sheets; paper: 0]
    #[arg(long, value_name = "CELLS", value_parser = self_offset, allow_hyphen_values = true)]
    pub self_offset: Option<f32>,
    /// Position of a cell's sample, in cells from the center, each within ±0.5; a sample exactly on
    /// a face of the model, as on voxel models with 0,0,0, has no right value
    /// [default: 0.00031,-0.00017,0.00043]
    #[arg(long, value_name = "X,Y,Z", value_parser = sample_offset, allow_hyphen_values = true)]
    pub sample_offset: Option<[f32; 3]>,
    /// Measure the error of shading with the grid against ray tracing, in areas around the model;
    /// takes seconds, and the file holds the result
    #[arg(long)]
    pub check: bool,
    /// Choose the smallest resolution whose RMSE of AO on planes that touch the model is at most
    /// this; implies --check
    #[arg(long, value_name = "E", value_parser = positive, conflicts_with = "resolution", allow_hyphen_values = true)]
    pub max_error: Option<f32>,
    /// Choose the largest resolution whose texels take at most so many bytes; with --max-error, the
    /// limit for its choice
    #[arg(long, value_name = "N", conflicts_with = "resolution")]
    pub max_bytes: Option<u64>,
    /// Bake each part of a model by itself, for animation, and write a scene file that poses them
    #[arg(long)]
    pub parts: bool,
    /// Leave out the part of this name, such as a speck far away; give it again for each
    #[arg(long, value_name = "PART", conflicts_with = "parts")]
    pub without: Vec<String>,
    /// Bake only these of the models, by their numbers from 1, as in 2-5,9
    #[arg(long, value_name = "NUMBERS", value_parser = inputs::item, value_delimiter = ',')]
    pub items: Option<Vec<RangeInclusive<usize>>>,
    /// Bake only one of N shares of the models, from 1, as in 1/4
    #[arg(long, value_name = "I/N", value_parser = inputs::shard)]
    pub shard: Option<(usize, usize)>,
    /// Print the numbers and names of the models, and bake nothing
    #[arg(long, conflicts_with_all = ["dry_run", "json", "depfile", "cache"])]
    pub list: bool,
    /// End at the first model or part that fails, instead of going on with the rest
    #[arg(long)]
    pub fail_fast: bool,
    /// Refuse what needs more memory than this, such as 900M or 2G [default: what is free]
    #[arg(long, value_name = "BYTES", value_parser = memory::bytes)]
    pub max_memory: Option<u64>,
    /// Write the files that each output was made from as a rule of a Makefile, for build systems
    #[arg(long, value_name = "FILE", conflicts_with = "dry_run")]
    pub depfile: Option<PathBuf>,
    /// Keep grids in this folder and take them from there where the same model is baked with the
    /// same options again; runs and machines may share it
    #[arg(long, value_name = "DIR", conflicts_with = "dry_run")]
    pub cache: Option<PathBuf>,
    /// Bake outputs that are up to date, too, and replace files that are no grids
    #[arg(long)]
    pub force: bool,
    /// Print what would be baked with the grid's box, memory and time on the CPU, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Report as one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// The examples at the end of `bake --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid bake assets/table.obj -o table.ao.ktx2 --max-error 0.05
  aogrid bake assets/robot.obj --parts --preset economy -o robot-parts
  aogrid bake assets/box.obj -o mc.ao.ktx2 --sampling monte-carlo --rays 1024 --seed 7";

/// The options that `bake` and `bench` share.
#[derive(clap::Args)]
pub struct SharedArgs {
    /// Cells along the axes, 8 to 2048 each: one number, or three as in 32x24x32 [default: 32]
    #[arg(long, value_parser = resolution, allow_hyphen_values = true)]
    pub resolution: Option<[u32; 3]>,
    /// Texels along a cube face's side, 8 to 128 [default: 16]
    #[arg(long, value_parser = face_size)]
    pub face_size: Option<u32>,
    /// Algorithm that tests the directions of faces: the direction sweep where it is possible and
    /// faster, else ray casting; or always one of them. The grid is the same, except where samples
    /// lie exactly on faces of the model, which the default --sample-offset avoids
    #[arg(long, alias = "kernel", value_enum, default_value_t = AlgorithmArg::Auto)]
    pub algorithm: AlgorithmArg,
    /// Device to bake on: a GPU if there is one, else the CPU; or always one of them. Software
    /// adapters count only if --adapter names them
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
    /// GPU to use, by a part of its name; see `aogrid adapters`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Threads to bake with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// The value of an option that is on or off.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum Switch {
    On,
    Off,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum SamplingArg {
    Faces,
    #[value(alias = "rays")]
    MonteCarlo,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum AlgorithmArg {
    Auto,
    Sweep,
    Rays,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum BackendArg {
    Auto,
    Cpu,
    Gpu,
}

impl SharedArgs {
    /// Returns the requested algorithm; `None` leaves the choice to the baker.
    pub fn algorithm(&self) -> Option<Algorithm> {
        match self.algorithm {
            AlgorithmArg::Auto => None,
            AlgorithmArg::Sweep => Some(Algorithm::DirectionSweep),
            AlgorithmArg::Rays => Some(Algorithm::RayCasting),
        }
    }

    /// Returns the requested device; an error if an option would have no effect.
    pub fn backend(&self) -> Result<BackendRequest, clap::Error> {
        match (self.backend, &self.adapter) {
            (BackendArg::Cpu, Some(_)) => Err(conflict("--adapter needs --backend gpu or auto")),
            (BackendArg::Cpu, None) => Ok(BackendRequest::Cpu),
            (BackendArg::Auto, None) => Ok(BackendRequest::Auto),
            (BackendArg::Gpu, None) => Ok(BackendRequest::Gpu(AdapterSelector::Real)),
            (BackendArg::Gpu, Some(name)) => {
                Ok(BackendRequest::Gpu(AdapterSelector::Named(name.clone())))
            }
            (BackendArg::Auto, Some(name)) => Ok(BackendRequest::Named(name.clone())),
        }
    }
}

impl Args {
    /// Returns the placement of the grid.
    pub(crate) fn placement(&self) -> Placement {
        let preset = self.preset.placement();
        Placement {
            resolution: self.shared.resolution.unwrap_or(preset.resolution),
            extent: match (self.half_extents, self.epsilon) {
                (Some(given), _) => Extent::HalfExtents(given),
                (None, Some(epsilon)) => Extent::Epsilon(epsilon),
                (None, None) => preset.extent,
            },
            snap: self.snap.map_or(preset.snap, |switch| switch == Switch::On),
        }
    }

    /// Returns the bake options; an error if an option would have no effect.
    pub(crate) fn options(&self) -> Result<BakeOptions, clap::Error> {
        let unused = match self.sampling {
            SamplingArg::Faces => [
                ("--rays", self.rays.is_some()),
                ("--seed", self.seed.is_some()),
            ],
            SamplingArg::MonteCarlo => [
                ("--face-size", self.shared.face_size.is_some()),
                ("", false),
            ],
        };
        if let Some((name, _)) = unused.iter().find(|(_, given)| *given) {
            let other = match self.sampling {
                SamplingArg::Faces => "monte-carlo",
                SamplingArg::MonteCarlo => "faces",
            };
            return Err(conflict(format!("{name} needs --sampling {other}")));
        }
        let preset = self.preset.options();
        let encoding = self.encoding.unwrap_or(preset.encoding);
        let boundary = self.boundary.unwrap_or(preset.boundary);
        let can_fit = encoding == Encoding::Moment && boundary == BoundaryMode::None;
        let options = BakeOptions {
            sampling: match self.sampling {
                SamplingArg::Faces => Sampling::CubeFaces {
                    size: self.shared.face_size.unwrap_or(16),
                },
                SamplingArg::MonteCarlo => Sampling::MonteCarlo {
                    count: self.rays.unwrap_or(256),
                    seed: self.seed.unwrap_or(0),
                },
            },
            max_distance: self.max_distance,
            sample_offset: self.sample_offset.unwrap_or(BakeOptions::SAMPLE_OFFSET),
            interior: self.interior.unwrap_or(preset.interior),
            boundary,
            encoding,
            format: self.format,
            fit: match self.fit {
                Some(switch) => switch == Switch::On,
                None => preset.fit && can_fit,
            },
            self_offset: self.self_offset.or(preset.self_offset),
        };
        options.validate().map_err(conflict)?;
        Ok(options)
    }
}
