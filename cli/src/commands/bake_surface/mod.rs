//! `bake-surface`: accessibility and bent normals on a model's surface.

mod args;
mod casters;
mod device;
mod glb;
mod instances;
mod ply;
mod report;
mod texels;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, ensure};
use aogrid_bake_core::mesh::PosedPrimitive;
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile};
use aogrid_bake_core::surface::{
    FaceCenters, SurfaceOptions, SurfacePoint, SurfaceRecord, VertexGroups, default_offset,
    face_centers, vertex_means, vertex_points,
};
use aogrid_baker_cpu::{Projection, SurfaceBake};

pub(crate) use args::Args;
use args::{At, OutputKind, Vertices};
use casters::Casters;
use device::Device;
use report::Report;

use crate::commands::bake::use_threads;
use crate::console::Console;
use crate::{interrupt, output};

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let kind = args.kind()?;
    check_outputs(args)?;
    use_threads(args.threads)?;
    interrupt::listen();
    let shown = args.model.display().to_string();
    let file = MeshFile::read(&args.model).with_context(|| shown.clone())?;
    let at = args.at(kind);
    if at == At::Texels {
        // A size that is too large is refused before the model is read.
        texels::sampling(args)?;
    }
    // A texture needs a vertex for each pair of position and texture coordinates.
    let loaded = match at {
        At::Texels => file.parse_textured(),
        At::Vertices | At::Faces => file.parse(),
    };
    let loaded = loaded.with_context(|| shown.clone())?;
    for warning in &loaded.warnings {
        console.warning(&format!("{shown}: {warning}"));
    }
    // A file that cannot be written to is refused before the bake.
    let source = match kind {
        OutputKind::Glb => Some(glb::read(&args.model, &loaded)?),
        _ => None,
    };
    let unwrapped = match at {
        At::Texels => Some(texels::unwrapped(args, &file, &loaded)?),
        At::Vertices | At::Faces => None,
    };
    let normals = match unwrapped
        .as_ref()
        .and_then(|unwrapped| unwrapped.normals.clone())
    {
        Some(normals) => Some(normals),
        None => file.normals(&loaded).with_context(|| shown.clone())?,
    };
    let groups = VertexGroups::new(&loaded.mesh, normals);
    let bake = Bake::new(args, &loaded, console)?;
    let inputs = Inputs {
        file: &file,
        groups: &groups,
        unwrapped: unwrapped.as_ref(),
        source: source.as_deref(),
    };
    let ([bytes, bent], mut report) = outputs(&bake, &inputs, at, kind)?;
    report.outline(&shown, args, &bake);
    output::write(&args.out, &bytes)?;
    if let Some(path) = &args.bent_normals {
        output::write(path, &bent)?;
    }
    report.print(console, args.json)
}

/// The model's file and what was read of it.
struct Inputs<'a> {
    file: &'a MeshFile,
    groups: &'a VertexGroups,
    unwrapped: Option<&'a texels::Unwrapped>,
    /// The bytes of a GLB that is to be written to.
    source: Option<&'a [u8]>,
}

/// Bakes, and returns the bytes of the output and of the bent normals beside it.
fn outputs(
    bake: &Bake<'_>,
    inputs: &Inputs<'_>,
    at: At,
    kind: OutputKind,
) -> anyhow::Result<([Vec<u8>; 2], Report)> {
    let (args, loaded) = (bake.args, bake.loaded);
    let record = serde_json::to_string(&bake.record(at))?;
    let shown = || args.model.display().to_string();
    if let Some(unwrapped) = inputs.unwrapped {
        let (texture, report) = texels::bake(bake, inputs.file, inputs.groups, unwrapped)?;
        let [mut picture, bent] = texture.encode(args, kind)?;
        if let Some(source) = inputs.source {
            let set = args.uv.unwrap_or(0);
            picture =
                glb::write_texture(source, loaded, &picture, set, &record).with_context(shown)?;
        }
        return Ok(([picture, bent], report));
    }
    let (values, report) = bake.values(inputs.groups, at)?;
    let bytes = match inputs.source {
        Some(source) => {
            let primitives = bake.primitives();
            glb::write(
                source,
                inputs.file,
                &primitives,
                &values,
                args.color,
                &record,
            )
            .with_context(shown)?
        }
        None => ply::write(loaded, &values, at, args.color),
    };
    Ok(([bytes, vec![]], report))
}

/// Checks that the outputs can be written and are not inputs.
fn check_outputs(args: &Args) -> anyhow::Result<()> {
    let outputs = [Some(&args.out), args.bent_normals.as_ref()];
    for out in outputs.into_iter().flatten() {
        for input in [&args.model]
            .into_iter()
            .chain(&args.occluders)
            .chain(&args.high)
        {
            output::check_not_input(out, input)?;
        }
        output::check_new(out, args.force)?;
    }
    if let Some(bent) = &args.bent_normals {
        let shown = bent.display();
        ensure!(
            *bent != args.out,
            "{shown}: accessibility goes there; name another file"
        );
    }
    Ok(())
}

/// A bake with all that it needs but the vertices' normals.
struct Bake<'a> {
    args: &'a Args,
    loaded: &'a LoadedMesh,
    console: &'a Console,
    casters: Casters,
    device: Device,
    options: SurfaceOptions,
    offset: f64,
}

impl<'a> Bake<'a> {
    fn new(args: &'a Args, loaded: &'a LoadedMesh, console: &'a Console) -> anyhow::Result<Self> {
        let casters = Casters::new(&loaded.mesh, args, console)?;
        let mut options = args.options();
        if args.ground {
            options.ground = Some(casters.height(&loaded.mesh));
        }
        Ok(Self {
            args,
            loaded,
            console,
            casters,
            device: Device::new(args)?,
            options,
            offset: args.offset.unwrap_or_else(|| default_offset(&loaded.mesh)),
        })
    }

    /// Bakes the values of all vertices, or of all faces.
    fn values(
        &self,
        groups: &VertexGroups,
        at: At,
    ) -> anyhow::Result<(Vec<SurfaceRecord>, Report)> {
        let mesh = &self.loaded.mesh;
        let mut faces = face_centers(mesh, self.offset);
        let mut report = Report::new(&faces);
        if at == At::Faces || self.vertices().mean().is_some() {
            self.project(&mut faces.points, &mut report)?;
        }
        if at == At::Faces {
            let bake = self.bake(&faces.points, &mut report)?;
            return Ok((of_all_faces(mesh.triangles().len(), &faces, &bake), report));
        }
        let mut records = match self.vertices().mean() {
            Some(mean) => {
                let bake = self.bake(&faces.points, &mut report)?;
                vertex_means(mesh, groups, &faces, &bake.records, mean)
            }
            None => {
                let mut own = vertex_points(mesh, groups, &faces, self.offset);
                self.project(&mut own.points, &mut report)?;
                let bake = self.bake(&own.points, &mut report)?;
                own.spread(mesh, groups, &bake.records)
            }
        };
        report.vertices(&records);
        instances::share(self, groups, &mut records.records)?;
        Ok((records.records, report))
    }

    /// Moves points onto the finer model, if there is one. Returns which of them were moved, or all.
    fn project(
        &self,
        points: &mut [SurfacePoint],
        report: &mut Report,
    ) -> anyhow::Result<Vec<bool>> {
        let Some(high) = &self.casters.high else {
            return Ok(vec![true; points.len()]);
        };
        // An offset of 1e-4 of the diagonal, and a cage of 200 times that.
        let cage = self.args.cage;
        let cage = cage.unwrap_or_else(|| 200.0 * default_offset(&self.loaded.mesh));
        let projection = Projection {
            mesh: &high.mesh,
            groups: &high.groups,
            cage,
            offset: self.offset,
        };
        let moved = projection.apply(points, self.loaded.mesh.origin());
        let misses = moved.iter().filter(|is_moved| !**is_moved).count();
        ensure!(
            misses < points.len() || points.is_empty(),
            "{}: no point of {} is within {cage} of it: choose a larger --cage, or put both in one place",
            high.name,
            self.args.model.display()
        );
        report.misses = misses;
        Ok(moved)
    }

    /// Returns the primitives whose values are written.
    fn primitives(&self) -> Vec<&PosedPrimitive> {
        instances::written(self.args, self.loaded)
    }

    fn vertices(&self) -> Vertices {
        self.args.vertices.unwrap_or(Vertices::Area)
    }

    fn bake(&self, points: &[SurfacePoint], report: &mut Report) -> anyhow::Result<SurfaceBake> {
        let name = file_name(&self.args.model);
        let bar = self.console.progress(&name);
        let start = Instant::now();
        let points = self.casters.points(points);
        let bake = self.device.bake(
            &self.casters.mesh,
            &points,
            &self.options,
            self.args.kernel(),
            &|progress| bar.observe(progress),
        );
        let bake = bake.with_context(|| name.clone())?;
        report.baked(&bake, start.elapsed());
        Ok(bake)
    }

    /// Returns the record of a file: all that the values depend on.
    fn record(&self, at: At) -> serde_json::Value {
        let place = match at {
            At::Texels => "texels",
            At::Vertices | At::Faces => self.vertices().name(),
        };
        let high = self.casters.high.as_ref().map(|high| &high.name);
        serde_json::json!({
            "weights": self.options.weights.name(),
            "directions": self.options.directions.name(),
            "rays": self.options.rays,
            "seed": self.options.seed,
            "at": place,
            "high": high,
            "offset": self.offset,
            "max_distance": self.options.max_distance,
            "ignore_backfaces": self.args.ignore_backfaces,
            "ground": self.args.ground,
            "occluders": self.casters.names,
            "source": self.loaded.name,
            "blake3": self.loaded.blake3,
        })
    }
}

/// Returns a record for each triangle; those without an area are open.
fn of_all_faces(n: usize, faces: &FaceCenters, bake: &SurfaceBake) -> Vec<SurfaceRecord> {
    let mut records = vec![SurfaceRecord::open([0.0, 1.0, 0.0]); n];
    for (&triangle, record) in faces.triangles.iter().zip(&bake.records) {
        records[triangle as usize] = *record;
    }
    records
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}
