//! The command line of `bake-surface`.

use std::path::PathBuf;

use anyhow::{bail, ensure};
use aogrid_bake_core::surface::{Directions, SURFACE_RAYS, SurfaceOptions, VertexMean, Weights};
use aogrid_baker_cpu::SurfaceKernel;
use clap::ValueEnum;

use crate::commands::bake::{in_range, named};
use crate::commands::render::{BackendArg, positive};

/// Bake accessibility and bent normals onto a model's surface: at vertices, faces or texels
///
/// Accessibility is the share of the hemisphere over a point that no surface hides, the bent normal the
/// mean of the open directions. A GLB is written as it was, with both as attributes of its vertices; a
/// PLY holds the mesh alone; a PNG or EXR is a texture, and so is what --at texels puts into a GLB.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model: OBJ, glTF, GLB, STL or PLY, or .gz of them; a GLB where a GLB is to be written
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// The file to write: .glb, .ply, .png or .exr
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    /// Place of the values; those of faces need a PLY, those of texels a PNG, EXR or GLB, whose
    /// materials get the occlusion texture [default: texels for a PNG or EXR, else vertices]
    #[arg(long, value_enum)]
    pub at: Option<At>,
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
    /// Let faces occlude from their front alone, which they are counterclockwise from
    #[arg(long)]
    pub ignore_backfaces: bool,
    /// Let an endless ground below the bounding box, across +Y, occlude, too
    #[arg(long)]
    pub ground: bool,
    /// Models that occlude and are not baked, in the same coordinates
    #[arg(long, value_name = "MODEL", num_args = 1..)]
    pub occluders: Vec<PathBuf>,
    /// A finer model in the same coordinates: points are moved onto its surface, and it occludes in place
    /// of the model
    #[arg(long, value_name = "MODEL")]
    pub high: Option<PathBuf>,
    /// Distance along normals, outward and inward, within which points are moved onto the finer model, in
    /// the model's units [default: 0.02 of the bounding box's diagonal]
    #[arg(long, value_name = "D", requires = "high", value_parser = positive, allow_hyphen_values = true)]
    pub cage: Option<f64>,
    /// Meshes that several nodes of a GLB pose: a copy for each, because each is occluded differently, or
    /// shared, with the occlusion by itself alone [default: split]
    #[arg(long, value_enum)]
    pub instances: Option<Instances>,
    /// Multiply the vertices' colors by accessibility, for programs that show nothing else; it darkens
    /// direct light, too
    #[arg(long)]
    pub color: bool,
    /// Texels along a texture's side, 1 to 16384 [default: 1024]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub size: Option<u32>,
    /// Set of texture coordinates [default: 0]
    #[arg(long, value_name = "SET")]
    pub uv: Option<u32>,
    /// Samples a texel: 1, 4 or 16 [default: 4]
    #[arg(long, value_parser = samples)]
    pub samples: Option<u32>,
    /// Texels by which charts grow, so that filters see no background [default: 16]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub dilate: Option<u32>,
    /// PNG for the bent normals of texels, beside the PNG or GLB of accessibility; an EXR has both
    #[arg(long, value_name = "PNG")]
    pub bent_normals: Option<PathBuf>,
    /// Frame of a texture's bent normals: the tangents of the file or else of MikkTSpace, or the mesh
    /// [default: tangent]
    #[arg(long, value_enum)]
    pub space: Option<Space>,
    /// Green of a texture's bent normals: up in the picture as in OpenGL, glTF and Godot, or down as in
    /// DirectX [default: gl]
    #[arg(long, value_enum)]
    pub convention: Option<Convention>,
    /// Device that finds what is hidden: the CPU, or a GPU, by rays in shared directions
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
    /// Report as one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// The examples at the end of `bake-surface --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid bake-surface robot.glb -o robot-ao.glb --ground
  aogrid bake-surface robot.glb -o robot-ao.glb --at texels --size 2048
  aogrid bake-surface low.obj -o low-ao.png --high sculpt.obj --bent-normals low-bent.png";

/// The place of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum At {
    Vertices,
    Faces,
    Texels,
}

/// The frame of a texture's bent normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Space {
    Tangent,
    Object,
}

/// The values of a mesh that several nodes pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Instances {
    Split,
    Share,
}

/// The direction of a texture's green.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Convention {
    Gl,
    Dx,
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
    Png,
    Exr,
}

fn samples(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(n @ (1 | 4 | 16)) => Ok(n),
        _ => Err("it must be 1, 4 or 16".into()),
    }
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
            Some("png") => OutputKind::Png,
            Some("exr") => OutputKind::Exr,
            _ => bail!("{shown}: its name must end in .glb, .ply, .png or .exr"),
        };
        self.check_place(kind)?;
        self.check_directions()?;
        Ok(kind)
    }

    /// Checks that the options of places fit the kind of output.
    fn check_place(&self, kind: OutputKind) -> anyhow::Result<()> {
        let shown = self.out.display();
        let at = self.at(kind);
        let is_texture = at == At::Texels;
        ensure!(
            !(at == At::Faces && kind != OutputKind::Ply),
            "{shown}: faces have values in a PLY only: leave out --at faces, or name a PLY"
        );
        ensure!(
            !(is_texture && kind == OutputKind::Ply)
                && (is_texture || matches!(kind, OutputKind::Glb | OutputKind::Ply)),
            "{shown}: texels are written to .png, .exr or .glb, and vertices to .glb or .ply: change --at \
             or the name"
        );
        ensure!(
            at == At::Vertices || self.vertices.is_none(),
            "--vertices needs values at vertices: name a GLB or a PLY, without another --at"
        );
        ensure!(
            self.instances.is_none() || (at == At::Vertices && kind == OutputKind::Glb),
            "--instances is for the vertices of a GLB: leave it out, or name a GLB"
        );
        if let Some(option) = self.texel_options().filter(|_| !is_texture) {
            bail!("{shown}: {option} is for textures: leave it out, or name a PNG or EXR");
        }
        ensure!(
            !(is_texture && self.color),
            "--color is for vertices and faces: leave it out; a texture has accessibility itself"
        );
        ensure!(
            kind != OutputKind::Exr || self.bent_normals.is_none(),
            "--bent-normals goes with a PNG or GLB: leave it out; an EXR has them, too"
        );
        ensure!(
            !(self.space == Some(Space::Object) && self.convention.is_some()),
            "--convention needs --space tangent: leave one of them out"
        );
        Ok(())
    }

    fn check_directions(&self) -> anyhow::Result<()> {
        ensure!(
            !(self.seed.is_some() && self.directions == Directions::Shared),
            "--seed needs random directions: add --directions stratified, or leave it out"
        );
        ensure!(
            !(self.kernel == Kernel::Zbuffer && self.directions != Directions::Shared),
            "--kernel zbuffer needs shared directions: leave out --kernel or --directions"
        );
        let is_for_cpu = [
            (self.kernel == Kernel::Zbuffer, "--kernel zbuffer"),
            (self.directions != Directions::Shared, "--directions"),
            (self.ignore_backfaces, "--ignore-backfaces"),
        ];
        let needs_cpu = is_for_cpu.into_iter().find(|(is_given, _)| *is_given);
        if let (BackendArg::Gpu, Some((_, option))) = (self.backend, needs_cpu) {
            bail!("{option} is for the CPU: leave it out, or --backend gpu");
        }
        Ok(())
    }

    /// Returns the place of the values.
    pub(super) fn at(&self, kind: OutputKind) -> At {
        self.at.unwrap_or(match kind {
            OutputKind::Png | OutputKind::Exr => At::Texels,
            OutputKind::Glb | OutputKind::Ply => At::Vertices,
        })
    }

    /// Returns an option that is for textures alone, if there is one.
    fn texel_options(&self) -> Option<&'static str> {
        let options = [
            (self.size.is_some(), "--size"),
            (self.uv.is_some(), "--uv"),
            (self.samples.is_some(), "--samples"),
            (self.dilate.is_some(), "--dilate"),
            (self.bent_normals.is_some(), "--bent-normals"),
            (self.space.is_some(), "--space"),
            (self.convention.is_some(), "--convention"),
        ];
        let given = options.into_iter().find(|(is_given, _)| *is_given);
        given.map(|(_, name)| name)
    }

    /// Returns the frame of a texture's bent normals.
    pub(super) fn space(&self) -> Space {
        self.space.unwrap_or(Space::Tangent)
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
            ignore_backfaces: self.ignore_backfaces,
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
