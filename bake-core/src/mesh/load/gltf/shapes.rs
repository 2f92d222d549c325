//! The triangles of glTF meshes, without the nodes that pose them.

use std::collections::BTreeSet;
use std::ops::Range;

use gltf_json::Value;
use gltf_json::accessor::{ComponentType, GenericComponentType};
use gltf_json::material::AlphaMode;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::super::strip::strip;
use super::{GltfError, GltfFile};

/// The triangles of a mesh in its own frame.
#[derive(Default)]
pub(super) struct Shape {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// The primitives with triangles, by their index in the mesh, and the positions of each.
    pub primitives: Vec<(usize, Range<usize>)>,
}

/// The properties of the meshes read so far that a bake treats otherwise than a renderer.
#[derive(Default)]
pub(super) struct Notes {
    transparent: BTreeSet<usize>,
    has_morphs: bool,
    /// Accessors whose positions are not within the bounds that they declare.
    out_of_bounds: BTreeSet<usize>,
}

/// The error of bounds that are written with fewer digits than positions, relative to their size.
const BOUNDS_TOLERANCE: f64 = 1e-4;

impl Notes {
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.transparent.is_empty() {
            warnings.push(format!(
                "{} materials are transparent or have holes: they occlude as if they were solid",
                self.transparent.len()
            ));
        }
        if let Some(first) = self.out_of_bounds.first() {
            warnings.push(format!(
                "positions of {} accessors, such as {first}, are not within their own bounds: they \
                 may be damaged",
                self.out_of_bounds.len()
            ));
        }
        if self.has_morphs {
            warnings.push("it has morph targets: the base shape is read".into());
        }
        warnings
    }
}

impl GltfFile {
    /// Returns all triangles of a mesh. Points and lines are left out.
    pub(super) fn shape(&self, mesh: usize, notes: &mut Notes) -> Result<Shape, GltfError> {
        let found = self.root.meshes.get(mesh);
        let primitives = &found.ok_or(GltfError::Missing("mesh", mesh))?.primitives;
        let mut shape = Shape::default();
        for (idx, primitive) in primitives.iter().enumerate() {
            self.note(primitive, notes);
            let first = shape.positions.len();
            self.primitive(mesh, primitive, &mut shape, notes)?;
            if shape.positions.len() > first {
                shape.primitives.push((idx, first..shape.positions.len()));
            }
        }
        Ok(shape)
    }

    fn note(&self, primitive: &Primitive, notes: &mut Notes) {
        let targets = primitive.targets.as_ref();
        notes.has_morphs |= targets.is_some_and(|targets| !targets.is_empty());
        if let Some(idx) = primitive.material.map(|idx| idx.value())
            && let Some(material) = self.root.materials.get(idx)
            && material.alpha_mode != Checked::Valid(AlphaMode::Opaque)
        {
            notes.transparent.insert(idx);
        }
    }

    /// Whether positions are within the bounds that their accessor declares. Bounds of integers are
    /// those of the stored numbers, and are not compared.
    fn are_within_bounds(&self, accessor: usize, positions: &[[f64; 3]]) -> bool {
        let accessor = &self.root.accessors[accessor];
        let is_float = matches!(
            accessor.component_type,
            Checked::Valid(GenericComponentType(ComponentType::F32))
        );
        let numbers = |value: &Option<Value>| -> Option<[f64; 3]> {
            let list = value.as_ref()?.as_array()?.iter().map(Value::as_f64);
            list.collect::<Option<Vec<_>>>()?.try_into().ok()
        };
        let Some((min, max)) = numbers(&accessor.min).zip(numbers(&accessor.max)) else {
            return true;
        };
        let largest = |x: usize| f64::max(min[x].abs(), max[x].abs());
        let tolerance = BOUNDS_TOLERANCE * largest(0).max(largest(1)).max(largest(2));
        let is_within = |p: &[f64; 3]| {
            (0..3).all(|x| (min[x] - tolerance..=max[x] + tolerance).contains(&p[x]))
        };
        !is_float || positions.iter().all(is_within)
    }

    fn primitive(
        &self,
        mesh: usize,
        primitive: &Primitive,
        shape: &mut Shape,
        notes: &mut Notes,
    ) -> Result<(), GltfError> {
        let fault = |reason| GltfError::Primitive { mesh, reason };
        let Checked::Valid(mode) = primitive.mode else {
            return Err(fault("a primitive has an unknown mode"));
        };
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            return Ok(());
        }
        let positions = primitive
            .attributes
            .get(&Checked::Valid(Semantic::Positions));
        let accessor = positions.ok_or(fault("a primitive has no positions"))?;
        let accessor = accessor.value();
        let positions = self.positions(accessor)?;
        if !self.are_within_bounds(accessor, &positions) {
            notes.out_of_bounds.insert(accessor);
        }
        let first = shape.positions.len();
        let count = positions.len();
        if u32::try_from(first + count).is_err() {
            return Err(fault("it has more vertices than can be counted"));
        }
        let mut indices = match primitive.indices {
            Some(idx) => self.indices(idx.value())?,
            None => (0..count as u32).collect(),
        };
        if let Some(&index) = indices.iter().find(|v| **v as usize >= count) {
            return Err(GltfError::Index { mesh, index, count });
        }
        indices.iter_mut().for_each(|v| *v += first as u32);
        shape.positions.extend(positions);
        match mode {
            Mode::TriangleStrip => shape.triangles.extend(strip(&indices)),
            Mode::TriangleFan => {
                let rim = indices.get(1..).unwrap_or_default().windows(2);
                shape
                    .triangles
                    .extend(rim.map(|pair| [indices[0], pair[0], pair[1]]));
            }
            _ => {
                let triangles = indices.chunks_exact(3);
                shape
                    .triangles
                    .extend(triangles.map(|t| [t[0], t[1], t[2]]));
            }
        }
        Ok(())
    }
}
