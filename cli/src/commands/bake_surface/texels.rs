//! Texture output: accessibility and bent normals of texels, as PNG or EXR.

use std::io::Cursor;

use anyhow::{Context, bail, ensure};
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile};
use aogrid_bake_core::surface::{
    MAX_TEXEL_SAMPLES, SurfaceRecord, TangentFrames, TexelPoints, TexelSampling, VertexGroups,
    dilate, normalized, texel_means, texel_points,
};
use image::{GrayImage, ImageFormat, Luma, Rgb, RgbImage};

use super::Bake;
use super::args::{Args, Convention, OutputKind, Space};
use super::report::Report;

/// A baked texture.
pub(super) struct Texture {
    size: u32,
    space: Space,
    texels: Vec<Option<SurfaceRecord>>,
}

/// The texture coordinates of a model's vertices.
pub(super) struct Unwrapped {
    coordinates: Vec<[f32; 2]>,
    /// The normals of an OBJ file.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Returns the texture coordinates of a model that was parsed for textures.
pub(super) fn unwrapped(
    args: &Args,
    file: &MeshFile,
    loaded: &LoadedMesh,
) -> anyhow::Result<Unwrapped> {
    let shown = args.model.display();
    let set = args.uv.unwrap_or(0);
    if let Some((coordinates, normals)) =
        file.obj_attributes().with_context(|| shown.to_string())?
    {
        ensure!(
            set == 0,
            "{shown}: an OBJ file has one set of texture coordinates: leave out --uv"
        );
        return Ok(Unwrapped {
            coordinates,
            normals,
        });
    }
    let coordinates = file.texture_coordinates(loaded, set);
    let Some(coordinates) = coordinates.with_context(|| shown.to_string())? else {
        bail!(
            "{shown}: texture coordinates are read of glTF and OBJ files: save it as one of these"
        );
    };
    Ok(Unwrapped {
        coordinates,
        normals: None,
    })
}

/// Returns the texture of a model.
pub(super) fn bake(
    bake: &Bake<'_>,
    file: &MeshFile,
    groups: &VertexGroups,
    unwrapped: &Unwrapped,
) -> anyhow::Result<(Texture, Report)> {
    let args = bake.args;
    let sampling = sampling(args)?;
    let loaded = bake.loaded;
    let shown = args.model.display();
    let coordinates = &unwrapped.coordinates;
    let mut points = texel_points(&loaded.mesh, groups, coordinates, sampling, bake.offset);
    warn(bake, &points);
    ensure!(
        !points.points.is_empty(),
        "{shown}: its texture coordinates cover no texel: unwrap it, or name another set with --uv"
    );
    let mut report = Report::texels(&points);
    let moved = bake.project(&mut points.points, &mut report)?;
    points.retain(&moved);
    let mut records = bake.bake(&points.points, &mut report)?.records;
    to_space(bake, file, groups, coordinates, &points, &mut records)?;
    let mut texels = texel_means(&points, &records, sampling.size);
    dilate(&mut texels, sampling.size, args.dilate.unwrap_or(16));
    let texture = Texture {
        size: sampling.size,
        space: args.space(),
        texels,
    };
    Ok((texture, report))
}

/// Returns the samples that a texture is asked for.
pub(super) fn sampling(args: &Args) -> anyhow::Result<TexelSampling> {
    let sampling = TexelSampling {
        size: args.size.unwrap_or(1024),
        per_side: args.samples.map_or(2, |samples| samples.isqrt()),
    };
    let n = (sampling.size * sampling.per_side) as usize;
    ensure!(
        n * n <= MAX_TEXEL_SAMPLES,
        "{} × {} texels of {} samples are too many: choose a smaller --size, or fewer --samples",
        sampling.size,
        sampling.size,
        sampling.per_side.pow(2)
    );
    Ok(sampling)
}

/// Turns the bent normals of all points into the frame that is asked for.
fn to_space(
    bake: &Bake<'_>,
    file: &MeshFile,
    groups: &VertexGroups,
    coordinates: &[[f32; 2]],
    points: &TexelPoints,
    records: &mut [SurfaceRecord],
) -> anyhow::Result<()> {
    let (args, loaded) = (bake.args, bake.loaded);
    let frames = match (args.space(), file.tangents(loaded)?) {
        (Space::Object, _) => None,
        (Space::Tangent, Some(given)) => Some(TangentFrames::given(&loaded.mesh, groups, &given)),
        (Space::Tangent, None) => Some(TangentFrames::generated(&loaded.mesh, groups, coordinates)),
    };
    for (idx, record) in records.iter_mut().enumerate() {
        let bent = record.bent_normal.map(f64::from);
        let mut bent = match &frames {
            Some(frames) => frames.encode(points, idx, bent),
            None => object_space(loaded, points.triangles[idx], bent),
        };
        if args.convention == Some(Convention::Dx) {
            bent[1] = -bent[1];
        }
        record.bent_normal = normalized(bent)
            .unwrap_or([0.0, 0.0, 1.0])
            .map(|v| v as f32);
    }
    Ok(())
}

/// Returns a direction in the frame of the mesh that a triangle belongs to.
fn object_space(loaded: &LoadedMesh, triangle: u32, direction: [f64; 3]) -> [f64; 3] {
    let vertex = loaded.mesh.triangles()[triangle as usize][0] as usize;
    let idx = loaded
        .primitives
        .partition_point(|p| p.vertices.end <= vertex);
    loaded.primitives[idx].pose.own_normal(direction)
}

/// Warns of texture coordinates that cannot give a good texture.
fn warn(bake: &Bake<'_>, points: &TexelPoints) {
    let shown = bake.args.model.display();
    let part = |triangle: u32| {
        let parts = bake.loaded.mesh.parts().iter();
        let mut of = parts.filter(|part| part.triangles.contains(&(triangle as usize)));
        of.next().map_or("", |part| part.name.as_str())
    };
    if let Some([a, b]) = points.first_overlap {
        let (part_a, part_b) = (part(a), part(b));
        bake.console.warning(&format!(
            "{shown}: charts overlap at {:.2} % of what they cover, first triangle {a} of `{part_a}` and \
             {b} of `{part_b}`: they share values; unwrap it without overlaps, or name another set with --uv",
            100.0 * points.overlaps
        ));
    }
    if points.outside > 0 {
        bake.console.warning(&format!(
            "{shown}: {} triangles have texture coordinates outside 0..1, where nothing is baked",
            points.outside
        ));
    }
}

impl Texture {
    /// Returns the file of the output, and that of bent normals if they have their own.
    pub(super) fn encode(&self, args: &Args, kind: OutputKind) -> anyhow::Result<[Vec<u8>; 2]> {
        if kind == OutputKind::Exr {
            return Ok([self.exr()?, vec![]]);
        }
        let bent = match args.bent_normals {
            Some(_) => self.bent_png()?,
            None => vec![],
        };
        Ok([self.png()?, bent])
    }

    /// Accessibility in gray; white where no chart is.
    fn png(&self) -> anyhow::Result<Vec<u8>> {
        let gray = |x, y| {
            let texel = &self.texels[(y * self.size + x) as usize];
            let open = texel.map_or(1.0, |record| record.accessibility);
            Luma([(open * 255.0).round() as u8])
        };
        let image = GrayImage::from_fn(self.size, self.size, gray);
        let mut png = Cursor::new(Vec::new());
        image
            .write_to(&mut png, ImageFormat::Png)
            .context("cannot encode the picture")?;
        Ok(png.into_inner())
    }

    /// Returns the bent normal of a texel; that of an open plane where no chart is.
    fn bent(&self, texel: &Option<SurfaceRecord>) -> [f32; 3] {
        match (texel, self.space) {
            (Some(record), _) => record.bent_normal,
            (None, Space::Tangent) => [0.0, 0.0, 1.0],
            (None, Space::Object) => [0.0; 3],
        }
    }

    fn bent_png(&self) -> anyhow::Result<Vec<u8>> {
        let color = |x, y| {
            let bent = self.bent(&self.texels[(y * self.size + x) as usize]);
            Rgb(bent.map(|v| ((v + 1.0) * 127.5).round() as u8))
        };
        let image = RgbImage::from_fn(self.size, self.size, color);
        let mut png = Cursor::new(Vec::new());
        image
            .write_to(&mut png, ImageFormat::Png)
            .context("cannot encode the picture")?;
        Ok(png.into_inner())
    }

    fn exr(&self) -> anyhow::Result<Vec<u8>> {
        let open = |texel: &Option<SurfaceRecord>| texel.map_or(1.0, |record| record.accessibility);
        let mut channels = vec![aogrid_scene::channel(
            "accessibility",
            self.texels.iter().map(open),
        )];
        for (x, name) in ["bent.X", "bent.Y", "bent.Z"].into_iter().enumerate() {
            let values = self.texels.iter().map(|texel| self.bent(texel)[x]);
            channels.push(aogrid_scene::channel(name, values));
        }
        Ok(aogrid_scene::exr([self.size; 2], channels)?)
    }
}
