//! The command line of `bake-surface`.

use std::path::PathBuf;

use anyhow::{bail, ensure};
use aogrid_bake_core::surface::{Directions, SURFACE_RAYS, SurfaceOptions, VertexMean, Weights};
use aogrid_baker_cpu::SurfaceKernel;
use clap::ValueEnum;

use crate::commands::bake::{in_range, named};
use crate::commands::render::positive;

/// Bake accessibility and bent normals onto a model's surface, at its vertices or faces
///
/// Accessibility is the share of the hemisphere over a point that no surface hides, the bent normal the
/// mean of the open directions. A GLB is written as it was, with both as attributes of its vertices; a
/// PLY holds the mesh alone.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model: OBJ, glTF, GLB, STL or PLY, or .gz of them; a GLB where a GLB is to be written
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// The file to write: .glb or .ply
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    /// Place of the values; those of faces need a PLY
    #[arg(long, value_enum, default_value_t = At::Vertices)]
    pub at: At,
    /// Values of a vertex: the mean over its faces by their area, the plain mean, as printed in the
    /// chapter, or from rays of its own along its normal [default: area]
    #[arg(long, value_enum)]
    pub vertices: Option<Vertices>,
    /// Rays a hemisphere, 1 to 65536; on average, if directions are shared
    #[arg(long, default_value = "512", value_parser = rays)]
    pub rays: u32,
    /// Directions of rays: the same for all points, which is the fastest and without noise; random in
    /// equal strata for each point; or random by rejection, as printed in the chapter
    #[arg(long, default_value = "shared", value_parser = named(Directions::ALL, Directions::name, &[]))]
    pub directions: Directions,
    /// Seed of random directions [default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Way to find what is hidden: the faster of the two; an irregular z-buffer, for shared directions
    /// alone; or rays. The values are the same
    #[arg(long, value_enum, default_value_t = Kernel::Auto)]
    pub kernel: Kernel,
    /// Weights of directions: the cosine to the normal, so that accessibility is 1 − AO; or all alike, as
    /// printed in the chapter
    #[arg(long, default_value = "cosine", value_parser = named(Weights::ALL, Weights::name, &[]))]
    pub weights: Weights,
    /// Ignore surfaces that are farther from a point than this, in the model's units [default: unlimited]
    #[arg(long, value_name = "D", value_parser = positive, allow_hyphen_values = true)]
    pub max_distance: Option<f64>,
    /// Distance of points from their faces, in the model's units [default: 0.0001 of the bounding box's
    /// diagonal]
    #[arg(long, value_name = "D", value_parser = positive, allow_hyphen_values = true)]
    pub offset: Option<f64>,
    /// Let an endless ground below the bounding box, across +Y, occlude, too
    #[arg(long)]
    pub ground: bool,
    /// Models that occlude and are not baked, in the same coordinates
    #[arg(long, value_name = "MODEL", num_args = 1..)]
    pub occluders: Vec<PathBuf>,
    /// Multiply the vertices' colors by accessibility, for programs that show nothing else; it darkens
    /// direct light, too
    #[arg(long)]
    pub color: bool,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Report as one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// The examples at the end of `bake-surface --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid bake-surface robot.glb -o robot-ao.glb --ground
  aogrid bake-surface assets/table.obj -o table.ply --color
  aogrid bake-surface assets/table.obj -o faces.ply --at faces --directions rejection --weights uniform";

/// The place of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum At {
    Vertices,
    Faces,
}

/// The source of a vertex's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Vertices {
    Area,
    Plain,
    Own,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kernel {
    Auto,
    Zbuffer,
    Rays,
}

/// The kind of output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OutputKind {
    Glb,
    Ply,
}

fn rays(text: &str) -> Result<u32, String> {
    in_range(text, SURFACE_RAYS)
}

impl Args {
    /// Returns the kind of output by its extension; an error if an option does not fit it.
    pub(super) fn kind(&self) -> anyhow::Result<OutputKind> {
        let shown = self.out.display();
        let ending = self.out.extension().unwrap_or_default();
        let kind = match ending.to_ascii_lowercase().to_str() {
            Some("glb") => OutputKind::Glb,
            Some("ply") => OutputKind::Ply,
            _ => bail!("{shown}: its name must end in .glb or .ply"),
        };
        let faces = self.at == At::Faces;
        ensure!(
            !(faces && kind == OutputKind::Glb),
            "{shown}: a GLB has values at vertices only: leave out --at faces, or name a PLY"
        );
        ensure!(
            !(faces && self.vertices.is_some()),
            "--vertices needs values at vertices: leave out --at faces"
        );
        ensure!(
            !(self.seed.is_some() && self.directions == Directions::Shared),
            "--seed needs random directions: add --directions stratified, or leave it out"
        );
        ensure!(
            !(self.kernel == Kernel::Zbuffer && self.directions != Directions::Shared),
            "--kernel zbuffer needs shared directions: leave out --kernel or --directions"
        );
        Ok(kind)
    }

    /// Returns the options of the bake, without a ground.
    pub(super) fn options(&self) -> SurfaceOptions {
        SurfaceOptions {
            directions: self.directions,
            rays: self.rays,
            seed: self.seed.unwrap_or(0),
            weights: self.weights,
            max_distance: self.max_distance,
            ground: None,
        }
    }

    pub(super) fn kernel(&self) -> Option<SurfaceKernel> {
        match self.kernel {
            Kernel::Auto => None,
            Kernel::Zbuffer => Some(SurfaceKernel::ZBuffer),
            Kernel::Rays => Some(SurfaceKernel::Rays),
        }
    }
}

impl Vertices {
    /// Returns the mean over faces; `None` for rays of its own.
    pub(super) fn mean(self) -> Option<VertexMean> {
        match self {
            Self::Area => Some(VertexMean::Area),
            Self::Plain => Some(VertexMean::Plain),
            Self::Own => None,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Plain => "plain",
            Self::Own => "own",
        }
    }
}
