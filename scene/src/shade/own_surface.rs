//! The values of surface bakes at receivers: what each object does to itself (GPU Gems, chapter 17).

use std::rc::Rc;

use aogrid_bake_core::mesh::MeshFile;
use aogrid_bake_core::surface::glb::surface_of_glb;
use aogrid_bake_core::surface::{SurfaceOptions, SurfacePoint, SurfaceRecord, default_offset};
use aogrid_bake_core::{Observer, TriangleMesh};
use aogrid_baker_cpu::{RayScene, bake_surface};
use aogrid_runtime::AogridCone;
use aogrid_runtime::surface::aogrid_open_cone;
use glam::DVec3;

use super::ShadeInput;
use crate::error::{Context, Result, bail};
use crate::reference::Receiver;
use crate::{Instance, SurfaceSource};

/// The distance within which a surface in a file is looked for, as a fraction of its diagonal.
const NEAR: f64 = 1e-3;

/// The values of a bake at a receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnSurface {
    pub accessibility: f32,
    /// The bent normal in world space.
    bent_normal: [f32; 3],
}

impl OwnSurface {
    /// Returns the open cone.
    pub(super) fn cone(&self) -> AogridCone {
        aogrid_open_cone(self.accessibility, self.bent_normal)
    }

    /// Returns the values of a receiver that its object does not occlude.
    fn open(receiver: &Receiver) -> Self {
        Self {
            accessibility: 1.0,
            bent_normal: receiver.normal.map(|x| x as f32),
        }
    }
}

/// A surface with values at its vertices.
struct BakedSurface {
    mesh: TriangleMesh,
    rays: RayScene,
    records: Vec<SurfaceRecord>,
}

/// Returns the values of all receivers: open for those that lie on no object, or on one that does not
/// cast on itself. All modes share them.
pub(super) fn own_surfaces(input: &ShadeInput<'_>) -> Result<Rc<Vec<OwnSurface>>> {
    if let Some(known) = &*input.own_surfaces.borrow() {
        return Ok(known.clone());
    }
    let mut values: Vec<_> = input
        .target
        .receivers
        .iter()
        .map(OwnSurface::open)
        .collect();
    let stage = (input.stages)("surfaces");
    for instance in input.scene.casters() {
        let layers = input.instances.layers(instance.id);
        if !instance.casts_on_receiver(instance.id, layers) {
            continue;
        }
        let ids = input.target.ids.iter().enumerate();
        let own: Vec<usize> = ids
            .filter(|(_, id)| **id == instance.id)
            .map(|(idx, _)| idx)
            .collect();
        if own.is_empty() {
            continue;
        }
        let points: Vec<_> = own
            .iter()
            .map(|&idx| object_point(instance, &input.target.receivers[idx]))
            .collect();
        let mesh = &input.scene.meshes[instance.mesh];
        let records = records(&mesh.surface, &mesh.mesh, &points, &*stage)
            .with_context(|| format!("surface of mesh `{}`", mesh.name))
            .with_context(|| input.scene.path.display())?;
        for (idx, record) in own.into_iter().zip(records) {
            values[idx] = in_world(instance, &record);
        }
    }
    let values = Rc::new(values);
    *input.own_surfaces.borrow_mut() = Some(values.clone());
    Ok(values)
}

/// Returns a receiver in the space of its object, absolute.
fn object_point(instance: &Instance, receiver: &Receiver) -> SurfacePoint {
    let to_world = &instance.world_from_object;
    let position = to_world
        .inverse()
        .transform_point3(receiver.position.into());
    // Normals go to the world by the inverse transpose, and back by the transpose.
    let normal = to_world.matrix3.transpose() * DVec3::from(receiver.normal);
    let normal = normal.normalize_or(DVec3::Y).to_array();
    SurfacePoint {
        position: position.to_array(),
        axis: normal,
        face: normal,
    }
}

fn in_world(instance: &Instance, record: &SurfaceRecord) -> OwnSurface {
    let from_object = instance.world_from_object.matrix3.inverse().transpose();
    let bent = DVec3::from(record.bent_normal.map(f64::from));
    let bent = (from_object * bent).normalize_or(DVec3::Y);
    let occlusion = instance.strength * (1.0 - record.accessibility);
    OwnSurface {
        accessibility: (1.0 - occlusion).max(0.0),
        bent_normal: bent.as_vec3().to_array(),
    }
}

/// Returns the records of points in object space.
fn records(
    source: &SurfaceSource,
    mesh: &TriangleMesh,
    points: &[SurfacePoint],
    observer: Observer<'_>,
) -> Result<Vec<SurfaceRecord>> {
    match source {
        SurfaceSource::Bake(options) => bake(mesh, points, options, observer),
        SurfaceSource::File(path) => {
            let surface = BakedSurface::read(path).with_context(|| path.display())?;
            Ok(points.iter().map(|point| surface.at(point)).collect())
        }
    }
}

fn bake(
    mesh: &TriangleMesh,
    points: &[SurfacePoint],
    options: &SurfaceOptions,
    observer: Observer<'_>,
) -> Result<Vec<SurfaceRecord>> {
    let origin = DVec3::from(mesh.origin());
    let relative = |point: &SurfacePoint| SurfacePoint {
        position: (DVec3::from(point.position) - origin).to_array(),
        ..*point
    };
    let points: Vec<_> = points.iter().map(relative).collect();
    Ok(bake_surface(mesh, &points, options, None, observer)?.records)
}

impl BakedSurface {
    fn read(path: &std::path::Path) -> Result<Self> {
        let file = MeshFile::read(path)?;
        let loaded = file.parse()?;
        let Some(records) = surface_of_glb(&file, &loaded)? else {
            bail!("it has no accessibility: make it by `aogrid bake-surface MODEL -o` a GLB");
        };
        Ok(Self {
            rays: RayScene::new(&loaded.mesh),
            mesh: loaded.mesh,
            records,
        })
    }

    /// Returns the values at a point of the surface: between those of the triangle's vertices. Open where
    /// there is no surface.
    fn at(&self, point: &SurfacePoint) -> SurfaceRecord {
        let normal = DVec3::from(point.axis);
        let start = DVec3::from(point.position) + default_offset(&self.mesh) * normal;
        let hit = self.rays.closest_hit(start.into(), (-normal).into());
        let near = NEAR / 1e-4 * default_offset(&self.mesh);
        let Some(hit) = hit.filter(|hit| hit.distance <= near) else {
            return SurfaceRecord::open(point.axis);
        };
        let corners = self.mesh.triangles()[hit.triangle as usize].map(|v| v as usize);
        let origin = DVec3::from(self.mesh.origin());
        let at = start - hit.distance * normal - origin;
        let positions = corners.map(|v| DVec3::from(self.mesh.positions()[v].map(f64::from)));
        let weights = barycentric(positions, at);
        let records = corners.map(|v| &self.records[v]);
        let (mut open, mut bent) = (0.0, DVec3::ZERO);
        for (record, weight) in records.into_iter().zip(weights) {
            open += weight * f64::from(record.accessibility);
            bent += weight * DVec3::from(record.bent_normal.map(f64::from)).normalize_or_zero();
        }
        SurfaceRecord {
            accessibility: open.clamp(0.0, 1.0) as f32,
            bent_normal: bent.normalize_or(normal).as_vec3().to_array(),
        }
    }
}

/// Returns the weights of a triangle's corners at a point of it.
fn barycentric([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let across = (b - a).cross(c - a);
    let area = across.length_squared();
    if area == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let of_b = (p - a).cross(c - a).dot(across) / area;
    let of_c = (b - a).cross(p - a).dot(across) / area;
    [1.0 - of_b - of_c, of_b, of_c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn barycentric_weights_are_those_of_the_corners() {
        let corners = [
            DVec3::X,
            DVec3::new(0.0, 3.0, 1.0),
            DVec3::new(-2.0, 0.0, 5.0),
        ];
        let weights = [0.5, 0.2, 0.3];
        let p = corners.iter().zip(weights).map(|(c, w)| *c * w).sum();
        for (found, expected) in barycentric(corners, p).iter().zip(weights) {
            assert!((found - expected).abs() < 1e-12);
        }
    }
}
