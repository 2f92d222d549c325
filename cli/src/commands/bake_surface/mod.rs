//! `bake-surface`: accessibility and bent normals on a model's surface.

mod args;
mod casters;
mod glb;
mod ply;
mod report;
mod texels;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, ensure};
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile};
use aogrid_bake_core::surface::{
    FaceCenters, SurfaceOptions, SurfacePoint, SurfaceRecord, VertexGroups, default_offset,
    face_centers, vertex_means, vertex_points,
};
use aogrid_baker_cpu::{SurfaceBake, bake_surface};

pub(crate) use args::Args;
use args::{At, OutputKind, Vertices};
use casters::Casters;
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
    let loaded = file.parse().with_context(|| shown.clone())?;
    for warning in &loaded.warnings {
        console.warning(&format!("{shown}: {warning}"));
    }
    // A file that cannot be written to is refused before the bake.
    let source = match kind {
        OutputKind::Glb => Some(glb::read(&args.model, &loaded)?),
        _ => None,
    };
    let normals = file.normals(&loaded).with_context(|| shown.clone())?;
    let groups = VertexGroups::new(&loaded.mesh, normals);
    let bake = Bake::new(args, &loaded, console)?;
    let ([bytes, bent], mut report) = match args.at(kind) {
        At::Texels => {
            let (texture, report) = texels::bake(&bake, &file, &groups)?;
            (texture.encode(args, kind)?, report)
        }
        at => {
            let (values, report) = bake.values(&groups, at)?;
            let bytes = match &source {
                Some(source) => {
                    let record = serde_json::to_string(&bake.record())?;
                    glb::write(source, &file, &loaded, &values, args.color, &record)
                }
                None => Ok(ply::write(&loaded, &values, at, args.color)),
            };
            ([bytes.with_context(|| shown.clone())?, vec![]], report)
        }
    };
    report.outline(&shown, args, &bake);
    output::write(&args.out, &bytes)?;
    if let Some(path) = &args.bent_normals {
        output::write(path, &bent)?;
    }
    report.print(console, args.json)
}

/// Checks that the outputs can be written and are not inputs.
fn check_outputs(args: &Args) -> anyhow::Result<()> {
    let outputs = [Some(&args.out), args.bent_normals.as_ref()];
    for out in outputs.into_iter().flatten() {
        for input in [&args.model].into_iter().chain(&args.occluders) {
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
    options: SurfaceOptions,
    offset: f64,
}

impl<'a> Bake<'a> {
    fn new(args: &'a Args, loaded: &'a LoadedMesh, console: &'a Console) -> anyhow::Result<Self> {
        let casters = Casters::new(&loaded.mesh, &args.occluders, console)?;
        let mut options = args.options();
        if args.ground {
            options.ground = Some(casters.height(&loaded.mesh));
        }
        Ok(Self {
            args,
            loaded,
            console,
            casters,
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
        let faces = face_centers(mesh, self.offset);
        let mut report = Report::new(&faces);
        if at == At::Faces {
            let bake = self.bake(&faces.points, &mut report)?;
            return Ok((of_all_faces(mesh.triangles().len(), &faces, &bake), report));
        }
        let records = match self.vertices().mean() {
            Some(mean) => {
                let bake = self.bake(&faces.points, &mut report)?;
                vertex_means(mesh, groups, &faces, &bake.records, mean)
            }
            None => {
                let own = vertex_points(mesh, groups, &faces, self.offset);
                let bake = self.bake(&own.points, &mut report)?;
                own.spread(mesh, groups, &bake.records)
            }
        };
        report.vertices(&records);
        Ok((records.records, report))
    }

    fn vertices(&self) -> Vertices {
        self.args.vertices.unwrap_or(Vertices::Area)
    }

    fn bake(&self, points: &[SurfacePoint], report: &mut Report) -> anyhow::Result<SurfaceBake> {
        let name = file_name(&self.args.model);
        let bar = self.console.progress(&name);
        let start = Instant::now();
        let points = self.casters.points(points);
        let bake = bake_surface(
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
    fn record(&self) -> serde_json::Value {
        serde_json::json!({
            "weights": self.options.weights.name(),
            "directions": self.options.directions.name(),
            "rays": self.options.rays,
            "seed": self.options.seed,
            "vertices": self.vertices().name(),
            "offset": self.offset,
            "max_distance": self.options.max_distance,
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
