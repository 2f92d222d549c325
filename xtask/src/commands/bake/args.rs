//! The command line of `bake`, and the options it stands for.

use std::path::PathBuf;

use aogrid_bake_core::{BakeOptions, Extent, Placement};
use aogrid_baker_cpu::Kernel;
use aogrid_baker_gpu::Choice;
use aogrid_grid_format::{
    BoundaryMode, Encoding, FACE_SIZES, Interior, MAX_RESOLUTION, MIN_RESOLUTION, Method,
    RAY_COUNTS, TexelFormat,
};
use clap::ValueEnum;

use crate::backend::Asked;

/// Bake the ambient occlusion around a model into a grid file
///
/// Several models, or one with --parts, go into the folder OUT, one file each, named after
/// model and part. An output that is already what would be baked is left alone.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Wavefront OBJ files
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<PathBuf>,
    /// The grid file to write (*.ao.ktx2), or a folder for several
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// How far the grid reaches: to where the model hides about this share of the sky
    #[arg(long, default_value_t = 0.1, value_parser = positive, conflicts_with = "half_extents", allow_hyphen_values = true)]
    pub epsilon: f32,
    /// Half the grid's size instead, in the model's units, around its bounding box's centre
    #[arg(long, value_name = "X,Y,Z", value_parser = extents, allow_hyphen_values = true)]
    pub half_extents: Option<[f32; 3]>,
    /// How to sample visibility: six cube faces a cell, or random rays (Monte Carlo)
    #[arg(long, value_enum, default_value_t = MethodArg::Faces)]
    pub method: MethodArg,
    /// Rays a cell, 1 to 100000 [with --method rays; default: 256]
    #[arg(long, value_parser = ray_count, conflicts_with = "face_size")]
    pub rays: Option<u32>,
    /// Seed of the rays' directions [with --method rays; default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Ignore what is farther from a cell than this, in the model's units [default: unlimited]
    #[arg(long, value_name = "D", value_parser = positive, allow_hyphen_values = true)]
    pub max_distance: Option<f32>,
    /// What a texel holds: the hidden share of the sky, or that and its average direction
    #[arg(long, value_enum, default_value_t = EncodingArg::Cone)]
    pub encoding: EncodingArg,
    /// How a texel's values are stored
    #[arg(long, value_enum, default_value_t = FormatArg::Unorm8)]
    pub format: FormatArg,
    /// How occlusion fades out at the grid's boundary: as in the journal paper, as in the
    /// research report, or not at all
    #[arg(long, value_enum, default_value_t = BoundaryArg::Jgt)]
    pub boundary: BoundaryArg,
    /// Which cells count as inside the model and take the values around it: those that signed
    /// layers of surface show to be inside, holes or not; only those that see no sky; or none
    #[arg(long, value_enum, default_value_t = InteriorArg::Signed)]
    pub interior: InteriorArg,
    /// Where in a cell its sample lies, in cells from the centre, each within ±0.5
    /// [default: 0.00031,-0.00017,0.00043]
    #[arg(long, value_name = "X,Y,Z", value_parser = offset, allow_hyphen_values = true)]
    pub sample_offset: Option<[f32; 3]>,
    /// Bake each object or group of a model by itself, for animation
    #[arg(long)]
    pub parts: bool,
    /// Bake even what is up to date
    #[arg(long)]
    pub force: bool,
    /// Say what would be baked and where its grid would lie, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Report as one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// What every command that bakes asks for.
#[derive(clap::Args)]
pub(crate) struct SamplingArgs {
    /// Cells along the axes, 8 to 2048 each: one number, or three as in 32x24x32
    #[arg(long, default_value = "32", value_parser = resolution, allow_hyphen_values = true)]
    pub resolution: [u32; 3],
    /// Texels along a cube face's side, 8 to 128 [default: 16]
    #[arg(long, value_parser = face_size)]
    pub face_size: Option<u32>,
    /// How to test the directions of faces: the sweep wherever it can be used and is faster,
    /// else rays; or only one of them. The grid is the same
    #[arg(long, value_enum, default_value_t = KernelArg::Auto)]
    pub kernel: KernelArg,
    /// Where to bake: on a GPU if there is one, else on the CPU; or only on one of them. Software
    /// that plays a GPU counts only where --adapter names it
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
    /// The GPU whose name holds this; see `cargo xtask adapters`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Threads to bake with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum MethodArg {
    Faces,
    Rays,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum KernelArg {
    Auto,
    Sweep,
    Rays,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum BackendArg {
    Auto,
    Cpu,
    Gpu,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum EncodingArg {
    Cone,
    Occlusion,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum FormatArg {
    Unorm8,
    F16,
    F32,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum BoundaryArg {
    Jgt,
    Rr,
    None,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum InteriorArg {
    Signed,
    #[value(alias = "fill")]
    Enclosed,
    Keep,
}

impl SamplingArgs {
    /// The kernel that was asked for; none: the baker's choice.
    pub(crate) fn kernel(&self) -> Option<Kernel> {
        match self.kernel {
            KernelArg::Auto => None,
            KernelArg::Sweep => Some(Kernel::Sweep),
            KernelArg::Rays => Some(Kernel::Rays),
        }
    }

    /// Where to bake; an error where an option would do nothing.
    pub(crate) fn backend(&self) -> Result<Asked, clap::Error> {
        match (self.backend, &self.adapter) {
            (BackendArg::Cpu, Some(_)) => Err(clap::Error::raw(
                clap::error::ErrorKind::ArgumentConflict,
                "--adapter needs --backend gpu or auto\n",
            )),
            (BackendArg::Cpu, None) => Ok(Asked::Cpu),
            (BackendArg::Auto, None) => Ok(Asked::Auto),
            (BackendArg::Gpu, None) => Ok(Asked::Gpu(Choice::Real)),
            (BackendArg::Gpu, Some(name)) => Ok(Asked::Gpu(Choice::Named(name.clone()))),
            (BackendArg::Auto, Some(name)) => Ok(Asked::Named(name.clone())),
        }
    }
}

impl Args {
    /// Where the grid goes.
    pub(crate) fn placement(&self) -> Placement {
        Placement {
            resolution: self.sampling.resolution,
            extent: match self.half_extents {
                Some(given) => Extent::HalfExtents(given),
                None => Extent::Epsilon(self.epsilon),
            },
        }
    }

    /// What is baked; an error where an option would do nothing.
    pub(crate) fn options(&self) -> Result<BakeOptions, clap::Error> {
        let unused = match self.method {
            MethodArg::Faces => [
                ("--rays", self.rays.is_some()),
                ("--seed", self.seed.is_some()),
            ],
            MethodArg::Rays => [
                ("--face-size", self.sampling.face_size.is_some()),
                ("", false),
            ],
        };
        if let Some((name, _)) = unused.iter().find(|(_, given)| *given) {
            let other = match self.method {
                MethodArg::Faces => "rays",
                MethodArg::Rays => "faces",
            };
            let message = format!("{name} needs --method {other}\n");
            return Err(clap::Error::raw(
                clap::error::ErrorKind::ArgumentConflict,
                message,
            ));
        }
        Ok(BakeOptions {
            method: match self.method {
                MethodArg::Faces => Method::Faces {
                    size: self.sampling.face_size.unwrap_or(16),
                },
                MethodArg::Rays => Method::Rays {
                    count: self.rays.unwrap_or(256),
                    seed: self.seed.unwrap_or(0),
                },
            },
            max_distance: self.max_distance,
            sample_offset: self.sample_offset.unwrap_or(BakeOptions::SAMPLE_OFFSET),
            interior: match self.interior {
                InteriorArg::Signed => Interior::Signed,
                InteriorArg::Enclosed => Interior::Enclosed,
                InteriorArg::Keep => Interior::Keep,
            },
            boundary: match self.boundary {
                BoundaryArg::Jgt => BoundaryMode::Jgt,
                BoundaryArg::Rr => BoundaryMode::Rr,
                BoundaryArg::None => BoundaryMode::None,
            },
            encoding: match self.encoding {
                EncodingArg::Cone => Encoding::Cone,
                EncodingArg::Occlusion => Encoding::Occlusion,
            },
            format: match self.format {
                FormatArg::Unorm8 => TexelFormat::Unorm8,
                FormatArg::F16 => TexelFormat::F16,
                FormatArg::F32 => TexelFormat::F32,
            },
        })
    }
}

pub(crate) fn resolution(text: &str) -> Result<[u32; 3], String> {
    let numbers: Vec<u32> = text
        .split(['x', 'X', '×'])
        .map(|n| {
            n.trim()
                .parse()
                .map_err(|_| format!("`{n}` is not a number of cells"))
        })
        .collect::<Result<_, _>>()?;
    let cells = match numbers[..] {
        [n] => [n; 3],
        [x, y, z] => [x, y, z],
        _ => return Err("one number or three are needed, as in 32x24x32".into()),
    };
    match cells
        .iter()
        .find(|n| !(MIN_RESOLUTION..=MAX_RESOLUTION).contains(*n))
    {
        Some(n) => Err(format!("{n} is not in {MIN_RESOLUTION}..={MAX_RESOLUTION}")),
        None => Ok(cells),
    }
}

fn three(text: &str) -> Result<[f32; 3], String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|n| {
            n.trim()
                .parse()
                .map_err(|_| format!("`{n}` is not a number"))
        })
        .collect::<Result<_, _>>()?;
    <[f32; 3]>::try_from(numbers).map_err(|_| "three numbers are needed, as in 1,2,3".into())
}

fn extents(text: &str) -> Result<[f32; 3], String> {
    let numbers = three(text)?;
    match numbers.iter().all(|v| *v > 0.0 && v.is_finite()) {
        true => Ok(numbers),
        false => Err("each must be above zero and finite".into()),
    }
}

fn offset(text: &str) -> Result<[f32; 3], String> {
    let numbers = three(text)?;
    match numbers.iter().all(|v| v.abs() <= 0.5) {
        true => Ok(numbers),
        false => Err("each must be within ±0.5 of a cell".into()),
    }
}

fn positive(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(v) if v > 0.0 && f32::is_finite(v) => Ok(v),
        _ => Err("it must be a number above zero".into()),
    }
}

fn in_range(text: &str, range: std::ops::RangeInclusive<u32>) -> Result<u32, String> {
    match text.parse() {
        Ok(n) if range.contains(&n) => Ok(n),
        _ => Err(format!("it must be a number in {range:?}")),
    }
}

pub(crate) fn face_size(text: &str) -> Result<u32, String> {
    in_range(text, FACE_SIZES)
}

fn ray_count(text: &str) -> Result<u32, String> {
    in_range(text, RAY_COUNTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolutions_are_one_number_or_three() {
        assert_eq!(resolution("24"), Ok([24; 3]));
        assert_eq!(resolution("32x24x8"), Ok([32, 24, 8]));
        for wrong in [
            "",
            "7",
            "32x32",
            "32x32x32x32",
            "32,32,32",
            "-8",
            "4096",
            "32x",
        ] {
            assert!(resolution(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn triples_are_checked() {
        assert_eq!(extents("1, 2.5,3e1"), Ok([1.0, 2.5, 30.0]));
        assert_eq!(offset("-0.5,0,0.25"), Ok([-0.5, 0.0, 0.25]));
        for wrong in ["1,2", "1,2,0", "1,2,-3", "1,2,inf", "1,2,NaN", "a,b,c"] {
            assert!(extents(wrong).is_err(), "{wrong}");
        }
        assert!(offset("0,0,0.6").is_err() && offset("0,NaN,0").is_err());
    }
}
