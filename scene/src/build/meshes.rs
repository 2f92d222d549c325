//! The meshes of a scene, and their grids.

use std::path::Path;
use std::sync::Arc;

use aogrid_bake_core::mesh::{
    AnimationTime, GltfError, LoadError, LoadedMesh, MeshFile, Part, PartMesh, Pose,
};
use aogrid_bake_core::models::{Model, to_obj};
use aogrid_bake_core::surface::SurfaceOptions;
use aogrid_bake_core::{BakeOptions, Extent, Placement, Preset, TriangleMesh};
use aogrid_grid_format::{BoundaryMode, Encoding, Sampling, Source as MeshSource};
use toml::Spanned;

use super::{Builder, NamedMesh};
use crate::error::Context;
use crate::paths::resolve;
use crate::schema::{GridFile, MeshFile as MeshEntry, PoseFile};
use crate::values::Whole;
use crate::{GridSource, SceneMesh, SurfaceSource};

/// The origins of what a mesh needs in modes.
struct Made {
    grid: GridSource,
    surface: SurfaceSource,
}

/// A mesh as loaded, posed if the scene says so.
struct Geometry {
    loaded: LoadedMesh,
    /// The same in bind pose, if it is posed.
    bind: Option<LoadedMesh>,
}

impl Builder<'_> {
    pub(super) fn mesh(&mut self, file: Spanned<MeshEntry>) -> crate::Result<()> {
        let span = Spanned::new(file.span(), ());
        let file = file.into_inner();
        if self.named.contains_key(file.name.get_ref()) {
            return Err(self.duplicate_name(&file.name, "mesh"));
        }
        let made = Made {
            grid: self.grid(&file)?,
            surface: self.surface(&file)?,
        };
        let geometry = self.load_mesh(&file, &span)?;
        let loaded = &geometry.loaded;
        let warnings = loaded.warnings.iter();
        let named = warnings.map(|warning| format!("mesh `{}`: {warning}", file.name.get_ref()));
        self.warnings.extend(named);
        let name = file.name.get_ref();
        let first = self.meshes.len();
        if file.parts == Some(true) {
            for idx in 0..loaded.mesh.parts().len() {
                let part = loaded.mesh.parts()[idx].name.clone();
                let of_part = self.part_of(loaded, idx, &span)?;
                let bind = self.bind_part(&geometry, idx, &span)?;
                let name = format!("{name}/{part}");
                // Parts that share a mesh share its grid.
                let source = loaded.mesh.parts()[of_part.same_as].name.clone();
                self.push_mesh(name, &of_part, bind, loaded, Some(source), &made);
            }
        } else if let Some(part) = &file.part {
            let parts = loaded.mesh.parts();
            let Some(idx) = parts.iter().position(|p| p.name == *part.get_ref()) else {
                let names: Vec<_> = parts.iter().map(|p| p.name.as_str()).collect();
                let message = format!("no such part; there are: {}", names.join(", "));
                return Err(self.source.error_at(part, "mesh.part", &message));
            };
            // An instance poses a part that is named; in the model it may have another pose.
            let of_part = PartMesh {
                pose: Pose::IDENTITY,
                ..self.part_of(loaded, idx, &span)?
            };
            let bind = self.bind_part(&geometry, idx, &span)?;
            let part = Some(part.get_ref().clone());
            self.push_mesh(name.clone(), &of_part, bind, loaded, part, &made);
        } else {
            let whole = PartMesh::whole(loaded.mesh.clone());
            let bind = geometry.bind.as_ref().map(|bind| bind.mesh.clone().into());
            self.push_mesh(name.clone(), &whole, bind, loaded, None, &made);
        }
        let named = NamedMesh {
            first,
            count: self.meshes.len() - first,
            is_rectangle: file.rectangle.is_some(),
        };
        self.named.insert(name.clone(), named);
        Ok(())
    }

    fn part_of(
        &self,
        loaded: &LoadedMesh,
        idx: usize,
        span: &Spanned<()>,
    ) -> crate::Result<PartMesh> {
        loaded
            .part(idx)
            .map_err(|e| self.source.error_at(span, "mesh.parts", &e.to_string()))
    }

    /// Returns a part in bind pose, if the mesh is posed.
    fn bind_part(
        &self,
        geometry: &Geometry,
        idx: usize,
        span: &Spanned<()>,
    ) -> crate::Result<Option<Arc<TriangleMesh>>> {
        let bind = geometry.bind.as_ref();
        let part = bind.map(|bind| self.part_of(bind, idx, span)).transpose()?;
        Ok(part.map(|part| part.mesh))
    }

    fn push_mesh(
        &mut self,
        name: String,
        part_mesh: &PartMesh,
        bind: Option<Arc<TriangleMesh>>,
        loaded: &LoadedMesh,
        part: Option<String>,
        made: &Made,
    ) {
        self.meshes.push(SceneMesh {
            name,
            source: MeshSource {
                part,
                triangles: part_mesh.mesh.triangles().len() as u64,
                ..MeshSource::from(loaded)
            },
            mesh: part_mesh.mesh.clone(),
            bind: bind.filter(|bind| *bind != part_mesh.mesh),
            pose: part_mesh.pose,
            grid: made.grid.clone(),
            surface: made.surface.clone(),
        });
    }

    fn load_mesh(&self, file: &MeshEntry, span: &Spanned<()>) -> crate::Result<Geometry> {
        let error = |key: &str, message: &str| self.source.error_at(span, key, message);
        if file.parts.is_some() && file.part.is_some() {
            return Err(error("mesh.part", "`parts` and `part` exclude each other"));
        }
        if file.triangles.is_some() && file.sample.is_none() {
            return Err(error(
                "mesh.triangles",
                "only a built-in `sample` can be refined",
            ));
        }
        if file.pose.is_some() && file.file.is_none() {
            return Err(error("mesh.pose", "only a `file` has animations"));
        }
        let loaded = match (&file.file, &file.sample, file.rectangle) {
            (Some(name), None, None) => {
                let path = resolve(self.source.path, name);
                return self.load_file(&path, file.pose.as_ref(), span);
            }
            (None, Some(name), None) => self.sample(name, file.triangles)?,
            (None, None, Some(size)) => rectangle(size.map(|v| v.f32() / 2.0)),
            _ => {
                let message = "exactly one of `file`, `sample` and `rectangle` is needed";
                return Err(error("mesh", message));
            }
        };
        Ok(Geometry { loaded, bind: None })
    }

    fn load_file(
        &self,
        path: &Path,
        pose: Option<&Spanned<PoseFile>>,
        span: &Spanned<()>,
    ) -> crate::Result<Geometry> {
        let file = self.usable(path, span, MeshFile::read(path))?;
        let in_bind_pose = || self.usable(path, span, file.parse());
        let Some(pose) = pose else {
            let (loaded, bind) = (in_bind_pose()?, None);
            return Ok(Geometry { loaded, bind });
        };
        let error = |message: &str| self.source.error_at(pose, "mesh.pose", message);
        let PoseFile { animation, time } = pose.get_ref();
        if animation.is_none() && time.is_some() {
            return Err(error("a `time` needs an `animation`"));
        }
        let at = AnimationTime {
            animation: animation.as_deref(),
            time: time.map_or(0.0, |time| time.0),
        };
        let loaded = match file.parse_posed(&at) {
            Err(e @ (LoadError::NoPoses | LoadError::Gltf(GltfError::NoAnimation { .. }))) => {
                return Err(error(&format!("{}: {e}", path.display())));
            }
            loaded => self.usable(path, span, loaded)?,
        };
        let bind = Some(in_bind_pose()?);
        Ok(Geometry { loaded, bind })
    }

    /// Returns what was read from a mesh file, or the error with the file's path.
    fn usable<T>(
        &self,
        path: &Path,
        span: &Spanned<()>,
        read: Result<T, LoadError>,
    ) -> crate::Result<T> {
        let error = |message: &str| self.source.error_at(span, "mesh.file", message);
        read.with_context(|| path.display())
            .with_context(|| error("cannot use it").to_string())
    }

    fn sample(
        &self,
        name: &Spanned<String>,
        triangles: Option<Whole<1, 20_000_000>>,
    ) -> crate::Result<LoadedMesh> {
        let Some(sample) = Model::ALL.iter().find(|s| s.name() == name.get_ref()) else {
            let names = Model::ALL.map(Model::name).join(", ");
            let message = format!("no such sample; there are: {names}");
            return Err(self.source.error_at(name, "mesh.sample", &message));
        };
        let mesh = sample
            .mesh(triangles.map(|n| n.0 as usize))
            .map_err(|e| self.source.error_at(name, "mesh.triangles", &e.to_string()))?;
        Ok(loaded_from_memory(mesh, sample.name()))
    }

    fn grid(&self, file: &MeshEntry) -> crate::Result<GridSource> {
        let Some(spanned) = &file.grid else {
            return Ok(GridSource::Bake(
                Preset::Default.placement(),
                Preset::Default.options(),
            ));
        };
        let grid = spanned.get_ref();
        let error = |message: &str| self.source.error_at(spanned, "mesh.grid", message);
        if let Some(name) = &grid.file {
            if !is_only_file(grid) {
                return Err(error(
                    "with `file` there is nothing to bake: leave out the other keys",
                ));
            }
            if file.parts == Some(true) {
                return Err(error(
                    "a file is the grid of one mesh, not of its parts: name a `part`",
                ));
            }
            return Ok(GridSource::File(resolve(self.source.path, name)));
        }
        if grid.snap.is_some() && grid.half_extents.is_some() {
            return Err(error(
                "`snap` needs a box from `epsilon`, not `half_extents`",
            ));
        }
        if grid.epsilon.is_some() && grid.half_extents.is_some() {
            return Err(error("`epsilon` and `half_extents` exclude each other"));
        }
        let placement = placement(grid);
        let options = bake_options(grid).map_err(error)?;
        options.validate().map_err(|e| error(&e.to_string()))?;
        Ok(GridSource::Bake(placement, options))
    }

    fn surface(&self, file: &MeshEntry) -> crate::Result<SurfaceSource> {
        let Some(spanned) = &file.surface else {
            return Ok(SurfaceSource::Bake(SurfaceOptions::recommended()));
        };
        let surface = spanned.get_ref();
        let error = |message: &str| self.source.error_at(spanned, "mesh.surface", message);
        if let Some(name) = &surface.file {
            if surface.rays.is_some() || surface.weights.is_some() {
                return Err(error(
                    "with `file` there is nothing to bake: leave out the other keys",
                ));
            }
            if file.parts == Some(true) || file.part.is_some() {
                return Err(error(
                    "a file has the surface of the whole mesh: leave out `parts` and `part`",
                ));
            }
            return Ok(SurfaceSource::File(resolve(self.source.path, name)));
        }
        let default = SurfaceOptions::recommended();
        Ok(SurfaceSource::Bake(SurfaceOptions {
            rays: surface.rays.map_or(default.rays, |n| n.0),
            weights: surface.weights.map_or(default.weights, Into::into),
            ..default
        }))
    }
}

fn preset(grid: &GridFile) -> Preset {
    grid.preset.map_or(Preset::Default, Into::into)
}

fn placement(grid: &GridFile) -> Placement {
    let default = preset(grid).placement();
    Placement {
        resolution: grid
            .resolution
            .map_or(default.resolution, |cells| cells.0.map(|n| n.0)),
        extent: match (grid.half_extents, grid.epsilon) {
            (Some(given), _) => Extent::HalfExtents(given.map(|v| v.f32())),
            (None, Some(epsilon)) => Extent::Epsilon(epsilon.f32()),
            (None, None) => default.extent,
        },
        snap: grid.snap.unwrap_or(default.snap),
    }
}

fn bake_options(grid: &GridFile) -> Result<BakeOptions, &'static str> {
    let default = preset(grid).options();
    let sampling = match (grid.rays, grid.face_size, grid.seed) {
        (Some(_), Some(_), _) => return Err("`rays` and `face_size` exclude each other"),
        (None, _, Some(_)) => return Err("`seed` needs `rays`"),
        (Some(rays), None, seed) => Sampling::MonteCarlo {
            count: rays.0,
            seed: seed.map_or(0, |n| n.0.into()),
        },
        (None, Some(size), None) => Sampling::CubeFaces { size: size.0 },
        (None, None, None) => default.sampling,
    };
    let offset = grid.sample_offset.map(|v| v.map(|v| v.0 as f32));
    let encoding = grid.encoding.map_or(default.encoding, Into::into);
    let boundary = grid.boundary.map_or(default.boundary, Into::into);
    let can_fit = encoding == Encoding::Moment && boundary == BoundaryMode::None;
    Ok(BakeOptions {
        sampling,
        max_distance: grid.max_distance.map(|d| d.f32()),
        sample_offset: offset.unwrap_or(default.sample_offset),
        interior: grid.interior.map_or(default.interior, Into::into),
        boundary,
        encoding,
        format: grid.format.map_or(default.format, Into::into),
        fit: grid.fit.unwrap_or(default.fit && can_fit),
        self_offset: grid.self_offset.map(|v| v.0 as f32).or(default.self_offset),
    })
}

/// Whether a grid names a file and no option of a bake.
fn is_only_file(grid: &GridFile) -> bool {
    let GridFile {
        file: _,
        preset,
        snap,
        fit,
        self_offset,
        resolution,
        epsilon,
        half_extents,
        face_size,
        rays,
        seed,
        max_distance,
        encoding,
        format,
        boundary,
        interior,
        sample_offset,
    } = grid;
    resolution.is_none()
        && preset.is_none()
        && snap.is_none()
        && fit.is_none()
        && self_offset.is_none()
        && epsilon.is_none()
        && half_extents.is_none()
        && face_size.is_none()
        && rays.is_none()
        && seed.is_none()
        && max_distance.is_none()
        && encoding.is_none()
        && format.is_none()
        && boundary.is_none()
        && interior.is_none()
        && sample_offset.is_none()
}

/// Returns a sheet of these half-extents in the xz-plane, facing +y.
fn rectangle([x, z]: [f32; 2]) -> LoadedMesh {
    let positions = vec![[-x, 0.0, -z], [x, 0.0, -z], [x, 0.0, z], [-x, 0.0, z]];
    let part = Part {
        name: "rectangle".into(),
        triangles: 0..2,
    };
    let triangles = vec![[0, 2, 1], [0, 3, 2]];
    let mesh = TriangleMesh::new(positions, triangles, vec![part]);
    loaded_from_memory(mesh.expect("two triangles are a mesh"), "rectangle")
}

/// Returns a generated mesh as if it had been loaded from an OBJ file.
fn loaded_from_memory(mesh: TriangleMesh, name: &str) -> LoadedMesh {
    let blake3 = blake3::hash(to_obj(&mesh).as_bytes()).to_hex().to_string();
    LoadedMesh::from_mesh(mesh, format!("{name}.obj"), blake3)
}
