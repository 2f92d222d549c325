//! Numbers of accessors: interleaved, normalized and sparse ones too.

use gltf_json::Index;
use gltf_json::accessor::{Accessor, ComponentType, Type};
use gltf_json::buffer::View;
use gltf_json::mesh::Semantic;
use gltf_json::validation::Checked;

use super::{GltfError, GltfFile};

/// Maximum number of elements of an accessor without a buffer view. They are all zero and take no
/// byte of the file, which bounds all others.
const MAX_ZEROS: u64 = 1 << 24;

/// The place and type of an accessor's or a sparse part's numbers.
struct Source {
    view: Index<View>,
    offset: u64,
    count: u64,
    component: ComponentType,
    normalized: bool,
}

impl GltfFile {
    /// Returns the positions of an accessor of three-component vectors.
    pub(super) fn positions(&self, idx: usize) -> Result<Vec<[f64; 3]>, GltfError> {
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        if accessor.type_ != Checked::Valid(Type::Vec3) || component == ComponentType::U32 {
            return Err(fault(idx, "its elements are not positions"));
        }
        self.elements(idx, accessor, component)
    }

    /// Returns the elements of an accessor of this type; `meaning` is what they are for.
    pub(super) fn vectors<const N: usize>(
        &self,
        idx: usize,
        type_: Type,
        meaning: &str,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        if accessor.type_ != Checked::Valid(type_) {
            return Err(fault(idx, &format!("its elements are not {meaning}")));
        }
        self.elements(idx, accessor, component)
    }

    /// Returns the numbers of an accessor of vertex indices.
    pub(super) fn indices(&self, idx: usize) -> Result<Vec<u32>, GltfError> {
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        let is_unsigned = matches!(
            component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        );
        if accessor.type_ != Checked::Valid(Type::Scalar) || !is_unsigned || accessor.normalized {
            return Err(fault(idx, "its elements are not vertex indices"));
        }
        let numbers = self.elements::<1>(idx, accessor, component)?;
        Ok(numbers.into_iter().map(|[v]| v as u32).collect())
    }

    /// Returns the normals of a primitive's vertices, if it has any.
    pub(in super::super) fn normals(
        &self,
        mesh: usize,
        primitive: usize,
    ) -> Result<Option<Vec<[f64; 3]>>, GltfError> {
        match self.attribute(mesh, primitive, Semantic::Normals)? {
            Some(idx) => Ok(Some(self.positions(idx)?)),
            None => Ok(None),
        }
    }

    /// Returns the colors of a primitive's vertices, if it has any.
    pub(in super::super) fn colors(
        &self,
        mesh: usize,
        primitive: usize,
    ) -> Result<Option<Vec<[f32; 4]>>, GltfError> {
        let Some(idx) = self.attribute(mesh, primitive, Semantic::Colors(0))? else {
            return Ok(None);
        };
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        let colors = match accessor.type_ {
            Checked::Valid(Type::Vec3) => {
                let colors = self.elements::<3>(idx, accessor, component)?;
                colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
            }
            Checked::Valid(Type::Vec4) => self.elements::<4>(idx, accessor, component)?,
            _ => return Err(fault(idx, "its elements are not colors")),
        };
        Ok(Some(
            colors.into_iter().map(|c| c.map(|v| v as f32)).collect(),
        ))
    }

    /// Returns the tangents of a primitive's vertices, if it has any.
    pub(in super::super) fn tangents(
        &self,
        mesh: usize,
        primitive: usize,
    ) -> Result<Option<Vec<[f64; 4]>>, GltfError> {
        let Some(idx) = self.attribute(mesh, primitive, Semantic::Tangents)? else {
            return Ok(None);
        };
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        match accessor.type_ == Checked::Valid(Type::Vec4) {
            true => Ok(Some(self.elements::<4>(idx, accessor, component)?)),
            false => Err(fault(idx, "its elements are not tangents")),
        }
    }

    /// Returns the attribute of an application's own, `_NAME`, of a primitive's vertices, if it has one:
    /// `N` numbers each.
    pub(in super::super) fn own<const N: usize>(
        &self,
        mesh: usize,
        primitive: usize,
        name: &str,
    ) -> Result<Option<Vec<[f64; N]>>, GltfError> {
        let semantic = Semantic::Extras(name.trim_start_matches('_').to_owned());
        let Some(idx) = self.attribute(mesh, primitive, semantic)? else {
            return Ok(None);
        };
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        let expected = if N == 1 { Type::Scalar } else { Type::Vec3 };
        if accessor.type_ != Checked::Valid(expected) {
            return Err(fault(idx, "its elements are not those of the attribute"));
        }
        Ok(Some(self.elements::<N>(idx, accessor, component)?))
    }

    /// Returns a set of texture coordinates of a primitive's vertices.
    pub(in super::super) fn texture_coordinates(
        &self,
        mesh: usize,
        primitive: usize,
        set: u32,
    ) -> Result<Vec<[f32; 2]>, GltfError> {
        let Some(idx) = self.attribute(mesh, primitive, Semantic::TexCoords(set))? else {
            return Err(GltfError::NoCoordinates {
                mesh,
                primitive,
                set,
            });
        };
        let accessor = self.accessor(idx)?;
        let component = component(idx, accessor)?;
        if accessor.type_ != Checked::Valid(Type::Vec2) {
            return Err(fault(idx, "its elements are not texture coordinates"));
        }
        let coordinates = self.elements::<2>(idx, accessor, component)?;
        Ok(coordinates
            .into_iter()
            .map(|c| c.map(|v| v as f32))
            .collect())
    }

    /// Returns the accessor of an attribute of a primitive that was read before, if it has one: with an
    /// element for each position.
    pub(super) fn attribute(
        &self,
        mesh: usize,
        primitive: usize,
        semantic: Semantic,
    ) -> Result<Option<usize>, GltfError> {
        let attributes = &self.root.meshes[mesh].primitives[primitive].attributes;
        let of = |semantic| {
            attributes
                .get(&Checked::Valid(semantic))
                .map(|idx| idx.value())
        };
        let count = of(Semantic::Positions).and_then(|idx| Some(self.accessor(idx).ok()?.count.0));
        match of(semantic) {
            Some(idx) if Some(self.accessor(idx)?.count.0) == count => Ok(Some(idx)),
            Some(idx) => Err(fault(
                idx,
                "it has not as many elements as there are positions",
            )),
            None => Ok(None),
        }
    }

    fn accessor(&self, idx: usize) -> Result<&Accessor, GltfError> {
        let accessor = self.root.accessors.get(idx);
        accessor.ok_or(GltfError::Missing("accessor", idx))
    }

    fn elements<const N: usize>(
        &self,
        idx: usize,
        accessor: &Accessor,
        component: ComponentType,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let count = accessor.count.0;
        let normalized = accessor.normalized;
        let mut elements = match accessor.buffer_view {
            Some(view) => self.read(
                idx,
                &Source {
                    view,
                    offset: accessor.byte_offset.unwrap_or_default().0,
                    count,
                    component,
                    normalized,
                },
            )?,
            None if count <= MAX_ZEROS => vec![[0.0; N]; count as usize],
            None => return Err(fault(idx, "it has no data")),
        };
        let Some(sparse) = &accessor.sparse else {
            return Ok(elements);
        };
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err(fault(idx, "its sparse indices are of an unknown type"));
        };
        let indices = Source {
            view: sparse.indices.buffer_view,
            offset: sparse.indices.byte_offset.0,
            count: sparse.count.0,
            component: index_type.0,
            normalized: false,
        };
        let values = Source {
            view: sparse.values.buffer_view,
            offset: sparse.values.byte_offset.0,
            component,
            normalized,
            ..indices
        };
        let indices = self.read::<1>(idx, &indices)?;
        for ([index], value) in indices.into_iter().zip(self.read(idx, &values)?) {
            let element = elements.get_mut(index as usize);
            *element.ok_or(fault(idx, "a sparse index is out of range"))? = value;
        }
        Ok(elements)
    }

    fn read<const N: usize>(
        &self,
        idx: usize,
        source: &Source,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let (bytes, stride) = self.view(source.view.value())?;
        let component_size = source.component.size();
        let size = N * component_size;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(fault(idx, "its stride is shorter than an element"));
        }
        // The last element need not be followed by a whole stride.
        let length = source.count.saturating_sub(1).saturating_mul(stride as u64);
        let end = source
            .offset
            .saturating_add(length)
            .saturating_add(size as u64);
        if source.count == 0 || end > bytes.len() as u64 {
            return Err(fault(idx, "it is empty or reaches beyond its buffer view"));
        }
        let elements = bytes[source.offset as usize..].chunks(stride);
        let number = |bytes: &[u8]| number(source.component, source.normalized, bytes);
        let element = |bytes: &[u8]| {
            std::array::from_fn(|c| number(&bytes[c * component_size..(c + 1) * component_size]))
        };
        Ok(elements.take(source.count as usize).map(element).collect())
    }

    /// Returns the bytes and the stride of a buffer view.
    fn view(&self, idx: usize) -> Result<(&[u8], Option<usize>), GltfError> {
        let view = self.root.buffer_views.get(idx);
        let view = view.ok_or(GltfError::Missing("buffer view", idx))?;
        let buffer = self.buffers.get(view.buffer.value());
        let buffer = buffer.ok_or(GltfError::Missing("buffer", view.buffer.value()))?;
        let start = view.byte_offset.unwrap_or_default().0;
        let end = start.saturating_add(view.byte_length.0);
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
        let bytes = range.and_then(|(start, end)| buffer.bytes.get(start..end));
        match bytes {
            Some(bytes) => Ok((bytes, view.byte_stride.map(|stride| stride.0))),
            None => Err(GltfError::Buffer {
                buffer: view.buffer.value(),
                reason: format!("buffer view {idx} reaches beyond it"),
            }),
        }
    }
}

fn fault(accessor: usize, reason: &str) -> GltfError {
    GltfError::Accessor {
        accessor,
        reason: reason.into(),
    }
}

fn component(idx: usize, accessor: &Accessor) -> Result<ComponentType, GltfError> {
    match accessor.component_type {
        Checked::Valid(component) => Ok(component.0),
        Checked::Invalid => Err(fault(idx, "its components are of an unknown type")),
    }
}

/// Decodes a number. Normalized integers are fractions of the largest one (glTF 2.0, 3.6.2.2).
fn number(component: ComponentType, normalized: bool, bytes: &[u8]) -> f64 {
    let (value, largest) = match (component, bytes) {
        (ComponentType::I8, &[a]) => (a.cast_signed().into(), i8::MAX.into()),
        (ComponentType::U8, &[a]) => (a.into(), u8::MAX.into()),
        (ComponentType::I16, &[a, b]) => (i16::from_le_bytes([a, b]).into(), i16::MAX.into()),
        (ComponentType::U16, &[a, b]) => (u16::from_le_bytes([a, b]).into(), u16::MAX.into()),
        (ComponentType::U32, &[a, b, c, d]) => {
            (u32::from_le_bytes([a, b, c, d]).into(), u32::MAX.into())
        }
        (ComponentType::F32, &[a, b, c, d]) => (f32::from_le_bytes([a, b, c, d]).into(), 1.0),
        _ => unreachable!("the slice has the size of its component"),
    };
    match normalized {
        true => f64::max(value / largest, -1.0),
        false => value,
    }
}
