//! The command line of `render`.

use std::path::PathBuf;

use aogrid_baker_gpu::AdapterSelector;
use aogrid_scene::reference::ReferenceOptions;
use aogrid_scene::shade::{self, Mode};
use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::usage::{conflict, usage};

/// Render a scene: a picture as PNG or EXR, or a list of receivers as CSV
///
/// The extension of OUT decides. PNG: 1 − AO as linear gray, or light in sRGB if the scene is lit;
/// several modes side by side, labeled, and with their errors if mode truth is one of them. EXR: float channels AO, AO.stderr and, in a lit scene, R, G, B;
/// of several modes with the mode's name in front. CSV: the list's columns and those of every mode.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The scene file (TOML); docs/scenes.md explains it
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Shading mode; several with commas between
    #[arg(long, value_parser = mode_parser(), required = true, value_delimiter = ',')]
    pub mode: Vec<&'static Mode>,
    /// The file to write: .png, .exr or .csv
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    /// Also write the G-buffer as an EXR file: position, normal, object id
    #[arg(long, value_name = "EXR")]
    pub gbuffer: Option<PathBuf>,
    /// Standard error to reach in mode truth, with as few rays as that takes [default: the
    /// scene's, else 0.002; none with --samples]
    #[arg(long, value_name = "E", value_parser = positive, allow_hyphen_values = true)]
    pub error: Option<f64>,
    /// Rays a receiver for mode truth; with --error the most that one gets [default: the scene's,
    /// else 8192]
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub samples: Option<u32>,
    /// Seed of the random numbers of mode truth [default: the scene's, else 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Maximum distance of occluders in mode truth, in world units [default: the scene's, else
    /// unlimited]
    #[arg(long, value_name = "D", value_parser = positive, allow_hyphen_values = true)]
    pub max_distance: Option<f64>,
    /// Factor for the light of a lit scene's picture [default: the scene's, else 1]
    #[arg(long, value_name = "X", value_parser = positive, allow_hyphen_values = true)]
    pub exposure: Option<f64>,
    /// Keep only the first N of the scene's occluders
    #[arg(long, value_name = "N")]
    pub occluders: Option<usize>,
    /// Device that looks up the grids: the CPU, with the same result on every machine, or the
    /// raster passes of a GPU, which make pictures only
    #[arg(long, value_enum, default_value_t = BackendArg::Cpu)]
    pub backend: BackendArg,
    /// GPU to use, by a part of its name; see `aogrid adapters`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Replace files that exist
    #[arg(long)]
    pub force: bool,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// The examples at the end of `render --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid render scenes/table.toml --mode truth,cone,merge -o table.png
  aogrid render scenes/table.toml --mode cone -o table.exr --gbuffer gbuffer.exr
  aogrid render scenes/box-on-floor.toml --mode truth,cone --samples 1024 -o box.csv";

/// The device that looks up the grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendArg {
    Cpu,
    Gpu,
}

/// The kind of output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputKind {
    Png,
    Exr,
    Csv,
}

impl Args {
    /// Returns the kind of output by its extension; an error if an option does not fit it.
    pub(crate) fn kind(&self) -> anyhow::Result<OutputKind> {
        let shown = self.out.display();
        let ending = self.out.extension().unwrap_or_default();
        let kind = [
            ("png", OutputKind::Png),
            ("exr", OutputKind::Exr),
            ("csv", OutputKind::Csv),
        ]
        .into_iter()
        .find(|(known, _)| ending.eq_ignore_ascii_case(known));
        let Some((_, kind)) = kind else {
            return Err(usage(format!(
                "{shown}: a picture's name ends in .png or .exr, a list's in .csv"
            )));
        };
        let is_on_gpu = self.backend == BackendArg::Gpu;
        let wrong = match kind {
            OutputKind::Csv if self.gbuffer.is_some() => {
                Some("a list of receivers has no G-buffer; leave out --gbuffer")
            }
            OutputKind::Csv if is_on_gpu => {
                Some("a GPU shades pictures only: leave out --backend gpu for a list")
            }
            _ if is_on_gpu && !self.mode.iter().any(|mode| mode.runs_on_gpu()) => {
                Some("rays are traced on the CPU: leave out --backend gpu")
            }
            _ => None,
        };
        if let Some(wrong) = wrong {
            return Err(usage(format!("{shown}: {wrong}")));
        }
        for (idx, mode) in self.mode.iter().enumerate() {
            if self.mode[..idx].iter().any(|m| m.name == mode.name) {
                return Err(usage(format!("mode `{}` is named twice", mode.name)));
            }
        }
        Ok(kind)
    }

    /// Returns the requested GPU, if one is requested.
    pub(crate) fn gpu(&self) -> Result<Option<AdapterSelector>, clap::Error> {
        selected_gpu(self.backend, self.adapter.as_deref())
    }

    /// Overrides the scene's options with those of the command line.
    pub(crate) fn apply_to(&self, options: &mut ReferenceOptions) {
        override_truth(options, self.samples, self.error, self.seed);
        options.max_distance = self.max_distance.or(options.max_distance);
    }
}

/// Returns the GPU that a command line asks for, if it does.
pub(crate) fn selected_gpu(
    backend: BackendArg,
    adapter: Option<&str>,
) -> Result<Option<AdapterSelector>, clap::Error> {
    match (backend, adapter) {
        (BackendArg::Cpu, None) => Ok(None),
        (BackendArg::Cpu, Some(_)) => Err(conflict("--adapter needs --backend gpu")),
        (BackendArg::Gpu, None) => Ok(Some(AdapterSelector::Real)),
        (BackendArg::Gpu, Some(name)) => Ok(Some(AdapterSelector::Named(name.to_owned()))),
    }
}

/// Overrides a scene's rays with those of a command line. Someone who names a number of rays and no
/// error wants them all.
pub(crate) fn override_truth(
    options: &mut ReferenceOptions,
    samples: Option<u32>,
    error: Option<f64>,
    seed: Option<u64>,
) {
    if samples.is_some() || error.is_some() {
        options.error = error;
    }
    options.samples = samples.unwrap_or(options.samples);
    options.seed = seed.unwrap_or(options.seed);
}

/// Returns the parser of modes' names.
pub(crate) fn mode_parser() -> impl TypedValueParser<Value = &'static Mode> {
    let known = shade::ALL.map(|mode| PossibleValue::new(mode.name).help(mode.summary));
    PossibleValuesParser::new(known).map(|name| Mode::named(&name).expect("clap has checked it"))
}

/// Parses a number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if v > 0.0 && f64::is_finite(v) => Ok(v),
        _ => Err("it must be a number above zero".into()),
    }
}
