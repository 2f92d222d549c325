//! GLB output: the model's own file with new attributes.

use std::fs;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use aogrid_bake_core::glb::GlbError;
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile, PosedPrimitive};
use aogrid_bake_core::surface::glb::{GlbTexture, GlbValues, add_texture_to_glb, add_to_glb};
use aogrid_bake_core::surface::{SurfaceRecord, normalized};

/// Reads the model's file again, as bytes.
pub(super) fn read(path: &Path, loaded: &LoadedMesh) -> anyhow::Result<Vec<u8>> {
    let shown = path.display();
    let bytes = fs::read(path).with_context(|| format!("{shown}: cannot read the file"))?;
    // Refuses what is no GLB with a buffer of its own.
    match add_to_glb(&bytes, &[], "null") {
        Err(error @ GlbError::NotGlb) => bail!("{shown}: {error}, or name a PLY to write"),
        result => result.with_context(|| shown.to_string())?,
    };
    ensure!(
        !loaded.primitives.is_empty(),
        "{shown}: it has no primitives"
    );
    Ok(bytes)
}

/// Returns the file with the values of its vertices.
pub(super) fn write(
    source: &[u8],
    file: &MeshFile,
    primitives: &[&PosedPrimitive],
    values: &[SurfaceRecord],
    color: bool,
    record: &str,
) -> anyhow::Result<Vec<u8>> {
    let primitives = primitives.iter();
    let of_primitives = primitives.map(|primitive| values_of(file, primitive, values, color));
    let values: anyhow::Result<Vec<_>> = of_primitives.collect();
    Ok(add_to_glb(source, &values?, record)?)
}

/// Returns the file with a picture as the occlusion texture of its materials.
pub(super) fn write_texture(
    source: &[u8],
    loaded: &LoadedMesh,
    png: &[u8],
    set: u32,
    record: &str,
) -> anyhow::Result<Vec<u8>> {
    let texture = GlbTexture { png, set };
    Ok(add_texture_to_glb(
        source,
        &loaded.primitives,
        texture,
        record,
    )?)
}

fn values_of<'a>(
    file: &MeshFile,
    primitive: &'a PosedPrimitive,
    values: &[SurfaceRecord],
    color: bool,
) -> anyhow::Result<GlbValues<'a>> {
    let values = &values[primitive.vertices.clone()];
    let own = |record: &SurfaceRecord| {
        let own = primitive.pose.own_normal(record.bent_normal.map(f64::from));
        // A node that scales an axis to nothing has no normals along it.
        normalized(own).map_or(record.bent_normal, |v| v.map(|v| v as f32))
    };
    let accessibility: Vec<f32> = values.iter().map(|record| record.accessibility).collect();
    let colors = if color {
        let old = file.colors(primitive)?;
        let old = old.unwrap_or_else(|| vec![[1.0; 4]; accessibility.len()]);
        let pairs = old.iter().zip(&accessibility);
        let darkened = pairs.map(|([r, g, b, alpha], a)| [r * a, g * a, b * a, *alpha]);
        Some(darkened.collect())
    } else {
        None
    };
    Ok(GlbValues {
        primitive,
        bent_normals: values.iter().map(own).collect(),
        accessibility,
        colors,
    })
}
