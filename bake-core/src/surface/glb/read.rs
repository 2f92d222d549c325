//! The values of a surface bake in a GLB file.

use super::{ACCESSIBILITY, BENT_NORMAL};
use crate::mesh::{GltfError, LoadedMesh, MeshFile};
use crate::surface::SurfaceRecord;

/// Returns the records of all vertices of `loaded`, which was parsed from `file`, in the frame of the
/// whole. `None` unless all primitives have them.
///
/// # Errors
///
/// An accessor is malformed.
pub fn surface_of_glb(
    file: &MeshFile,
    loaded: &LoadedMesh,
) -> Result<Option<Vec<SurfaceRecord>>, GltfError> {
    let Some(values) = file.own_attributes(loaded, [ACCESSIBILITY, BENT_NORMAL])? else {
        return Ok(None);
    };
    let records = values
        .into_iter()
        .map(|(accessibility, bent_normal)| SurfaceRecord {
            accessibility,
            bent_normal,
        });
    Ok(Some(records.collect()))
}
