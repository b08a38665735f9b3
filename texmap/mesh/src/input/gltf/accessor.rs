//! Accessors: numbers in buffers, checked before they are read.
//!
//! Takes an accessor's index and what its use allows, gives plain vectors. Type, component type, stride, offsets and
//! the range in the buffer are checked first; then the elements are gathered byte by byte into one packed block, sparse
//! substitutes are laid over it, and the block is decoded. Every element read is counted against a budget, because a
//! small file can ask for the same long buffer many times.
//! Source: glTF 2.0, 3.6.2. Limits: matrices of other than 4 x 4 floats are not read; nothing here needs them.

use std::cell::Cell;

use gltf::json::Root;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

/// Most elements that all reads of a file may give together. The largest scenes that fit into memory have about a
/// hundred million corners.
const MAX_ELEMENTS: u64 = 1 << 27;

/// An accessor without data holds zeros; its count is believed up to this, or up to the bytes of all buffers.
const FREE_ZEROS: u64 = 1 << 16;

/// The numbers of a file.
pub(super) struct Numbers<'a> {
    root: &'a Root,
    buffers: &'a [Vec<u8>],
    elements_left: Cell<u64>,
}

/// The rules of an accessor's use.
#[derive(Clone, Copy)]
pub(super) struct Use {
    /// Its name, for messages.
    pub name: &'static str,
    /// Shapes that are allowed.
    pub shapes: &'static [Type],
    /// Component types that are allowed.
    pub components: &'static [ComponentType],
    /// How integers become numbers.
    pub integers: Integers,
}

/// How integers become numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Integers {
    /// As the accessor says.
    AsMarked,
    /// Always as fractions of the largest one: colours and weights are nothing else.
    Fractions,
}

/// Elements in a row, packed.
struct ElementBytes {
    bytes: Vec<u8>,
    count: usize,
    width: usize,
    component: ComponentType,
    fractions: bool,
}

impl<'a> Numbers<'a> {
    /// The numbers of `root` in its buffers.
    pub(super) fn new(root: &'a Root, buffers: &'a [Vec<u8>]) -> Self {
        Self {
            root,
            buffers,
            elements_left: Cell::new(MAX_ELEMENTS),
        }
    }

    /// Vectors of `N` numbers. Components that the accessor does not have are 1, as alpha.
    pub(super) fn vectors<const N: usize>(
        &self,
        index: usize,
        how: &Use,
    ) -> Result<Vec<[f32; N]>, String> {
        let packed = self.element_bytes(index, how)?;
        let size = bytes_of(packed.component);
        let vector = |element: &[u8]| {
            let mut vector = [1.0; N];
            for (number, bytes) in vector.iter_mut().zip(element.chunks_exact(size)) {
                *number = decoded(bytes, packed.component, packed.fractions);
            }
            vector
        };
        Ok(packed
            .bytes
            .chunks_exact(size * packed.width)
            .map(vector)
            .collect())
    }

    /// Whole numbers, `N` per element: indices and joints.
    pub(super) fn integers<const N: usize>(
        &self,
        index: usize,
        how: &Use,
    ) -> Result<Vec<[u32; N]>, String> {
        let packed = self.element_bytes(index, how)?;
        let size = bytes_of(packed.component);
        let element = |element: &[u8]| {
            let mut numbers = [0; N];
            for (number, bytes) in numbers.iter_mut().zip(element.chunks_exact(size)) {
                *number = little_endian(bytes);
            }
            numbers
        };
        Ok(packed
            .bytes
            .chunks_exact(size * packed.width)
            .map(element)
            .collect())
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize) -> Result<&'a [u8], String> {
        let view = self
            .root
            .buffer_views
            .get(index)
            .ok_or_else(|| format!("buffer view {index} does not exist"))?;
        let buffer = view.buffer.value();
        let bytes = self
            .buffers
            .get(buffer)
            .ok_or_else(|| format!("buffer {buffer} does not exist"))?;
        let start = view.byte_offset.unwrap_or_default().0;
        let range = usize::try_from(start)
            .ok()
            .zip(usize::try_from(start.saturating_add(view.byte_length.0)).ok());
        range.and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| {
            let (length, size) = (view.byte_length.0, bytes.len());
            format!("buffer view {index} takes {length} bytes from byte {start} of a buffer of {size} bytes")
        })
    }

    fn element_bytes(&self, index: usize, how: &Use) -> Result<ElementBytes, String> {
        let accessor = self
            .root
            .accessors
            .get(index)
            .ok_or_else(|| format!("accessor {index} does not exist"))?;
        self.gathered(accessor, how)
            .map_err(|what| format!("accessor {index} ({}): {what}", how.name))
    }

    fn gathered(&self, accessor: &Accessor, how: &Use) -> Result<ElementBytes, String> {
        let (component, width) = checked_type(accessor, how)?;
        let count = self.budgeted(accessor)?;
        let size = bytes_of(component) * width;
        let mut bytes = Vec::new();
        match accessor.buffer_view {
            None => bytes.resize(count * size, 0),
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                let elements = Elements {
                    count,
                    size,
                    stride: self.stride(view.value(), size)?,
                };
                elements.gather(self.view(view.value())?, offset, &mut bytes)?;
            }
        }
        if let Some(sparse) = &accessor.sparse {
            self.substitute(sparse, size, &mut bytes)?;
        }
        let fractions = accessor.normalized || how.integers == Integers::Fractions;
        Ok(ElementBytes {
            bytes,
            count,
            width,
            component,
            fractions,
        })
        .inspect(|packed| {
            assert_eq!(
                packed.bytes.len(),
                packed.count * size,
                "every element was gathered"
            );
        })
    }

    /// The count of an accessor, taken from the budget of all reads.
    fn budgeted(&self, accessor: &Accessor) -> Result<usize, String> {
        let count = accessor.count.0;
        let in_file: u64 = self.buffers.iter().map(|buffer| buffer.len() as u64).sum();
        if accessor.buffer_view.is_none() && count > in_file.max(FREE_ZEROS) {
            return Err(format!(
                "claims {count} elements without data: more than the file can mean"
            ));
        }
        let left = self.elements_left.get().checked_sub(count);
        let left = left
            .ok_or_else(|| format!("the file asks for more than {MAX_ELEMENTS} elements in all"))?;
        self.elements_left.set(left);
        usize::try_from(count).map_err(|_| format!("claims {count} elements"))
    }

    fn stride(&self, view: usize, size: usize) -> Result<usize, String> {
        let stride = self
            .root
            .buffer_views
            .get(view)
            .and_then(|view| view.byte_stride)
            .map(|stride| stride.0);
        match stride {
            Some(stride) if stride != 0 && stride < size => Err(format!(
                "elements of {size} bytes cannot be {stride} bytes apart"
            )),
            Some(stride) if stride != 0 => Ok(stride),
            _ => Ok(size),
        }
    }

    /// Lays the substitutes of a sparse accessor over its elements of `size` bytes.
    fn substitute(
        &self,
        sparse: &gltf::json::accessor::sparse::Sparse,
        size: usize,
        bytes: &mut [u8],
    ) -> Result<(), String> {
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err("sparse indices must be unsigned integers".into());
        };
        let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        if count > bytes.len() / size {
            return Err(format!(
                "{count} sparse substitutes for {} elements",
                bytes.len() / size
            ));
        }
        let index_size = bytes_of(index_type.0);
        let mut places = Vec::new();
        let indices = Elements {
            count,
            size: index_size,
            stride: index_size,
        };
        indices.gather(
            self.view(sparse.indices.buffer_view.value())?,
            sparse.indices.byte_offset.0,
            &mut places,
        )?;
        let mut values = Vec::new();
        let elements = Elements {
            count,
            size,
            stride: size,
        };
        elements.gather(
            self.view(sparse.values.buffer_view.value())?,
            sparse.values.byte_offset.0,
            &mut values,
        )?;
        for (place, value) in places
            .chunks_exact(index_size)
            .zip(values.chunks_exact(size))
        {
            let at = little_endian(place) as usize;
            let element = bytes.chunks_exact_mut(size).nth(at);
            element
                .ok_or_else(|| format!("sparse index {at} is out of range"))?
                .copy_from_slice(value);
        }
        Ok(())
    }
}

/// Where elements lie.
struct Elements {
    count: usize,
    size: usize,
    stride: usize,
}

impl Elements {
    fn gather(&self, view: &[u8], offset: u64, packed: &mut Vec<u8>) -> Result<(), String> {
        let Self {
            count,
            size,
            stride,
        } = *self;
        let last = (count as u64).saturating_sub(1);
        let end = last
            .checked_mul(stride as u64)
            .and_then(|start| start.checked_add(offset)?.checked_add(size as u64));
        if count > 0 && end.is_none_or(|end| end > view.len() as u64) {
            let (have, stride) = (view.len(), self.stride);
            return Err(format!(
                "{count} elements of {size} bytes, {stride} bytes apart from byte {offset} on, do not fit into \
                 {have} bytes"
            ));
        }
        // The check above keeps every sum inside the view, and the room that is asked for real.
        packed.reserve(count * size);
        let start = |at: usize| offset as usize + at * stride;
        (0..count).for_each(|at| packed.extend_from_slice(&view[start(at)..start(at) + size]));
        Ok(())
    }
}

fn checked_type(accessor: &Accessor, how: &Use) -> Result<(ComponentType, usize), String> {
    let (Checked::Valid(shape), Checked::Valid(component)) =
        (accessor.type_, accessor.component_type)
    else {
        return Err("unknown type".into());
    };
    if !how.shapes.contains(&shape) {
        return Err(format!(
            "expected a type of {:?}, found {shape:?}",
            how.shapes
        ));
    }
    if !how.components.contains(&component.0) {
        return Err(format!(
            "expected components of {:?}, found {:?}",
            how.components, component.0
        ));
    }
    Ok((component.0, shape.multiplicity()))
}

fn bytes_of(component: ComponentType) -> usize {
    match component {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

fn little_endian(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |number, &byte| (number << 8) | u32::from(byte))
}

/// A number from its bytes; integers as fractions are those of glTF 2.0, 3.6.2.2.
fn decoded(bytes: &[u8], component: ComponentType, fractions: bool) -> f32 {
    let bits = little_endian(bytes);
    let (number, largest) = match component {
        ComponentType::F32 => return f32::from_bits(bits),
        ComponentType::I8 => (f32::from(bits as u8 as i8), 127.0),
        ComponentType::U8 => (f32::from(bits as u8), 255.0),
        ComponentType::I16 => (f32::from(bits as u16 as i16), 32767.0),
        ComponentType::U16 => (f32::from(bits as u16), 65535.0),
        ComponentType::U32 => (bits as f32, u32::MAX as f32),
    };
    if fractions {
        (number / largest).max(-1.0)
    } else {
        number
    }
}

/// Floats, or integers that stand for fractions.
pub(super) const NUMBERS: &[ComponentType] = &[
    ComponentType::F32,
    ComponentType::I8,
    ComponentType::U8,
    ComponentType::I16,
    ComponentType::U16,
];

/// Positions, plain or quantised (KHR_mesh_quantization).
pub(super) const POSITION: Use = Use {
    name: "POSITION",
    shapes: &[Type::Vec3],
    components: NUMBERS,
    integers: Integers::AsMarked,
};

/// Normals, plain or quantised.
pub(super) const NORMAL: Use = Use {
    name: "NORMAL",
    shapes: &[Type::Vec3],
    components: NUMBERS,
    integers: Integers::Fractions,
};

/// Tangents and the sign of their bitangents.
pub(super) const TANGENT: Use = Use {
    name: "TANGENT",
    shapes: &[Type::Vec4],
    components: NUMBERS,
    integers: Integers::Fractions,
};

/// Texture coordinates.
pub(super) const TEXCOORD: Use = Use {
    name: "TEXCOORD",
    shapes: &[Type::Vec2],
    components: NUMBERS,
    integers: Integers::AsMarked,
};

/// Colours of vertices.
pub(super) const COLOUR: Use = Use {
    name: "COLOR",
    shapes: &[Type::Vec3, Type::Vec4],
    components: &[ComponentType::F32, ComponentType::U8, ComponentType::U16],
    integers: Integers::Fractions,
};

/// Corners of triangles.
pub(super) const INDICES: Use = Use {
    name: "indices",
    shapes: &[Type::Scalar],
    components: &[ComponentType::U8, ComponentType::U16, ComponentType::U32],
    integers: Integers::AsMarked,
};

/// The accessor of an attribute.
pub(super) fn attribute(primitive: &Primitive, semantic: &Semantic) -> Option<usize> {
    primitive
        .attributes
        .get(&key(semantic))
        .map(gltf::json::Index::value)
}

/// Checks that an attribute has one element per position, or none at all.
pub(super) fn same_count(name: &str, count: usize, positions: usize) -> Result<(), String> {
    if count != 0 && count != positions {
        return Err(format!(
            "{name} has {count} elements, POSITION has {positions}"
        ));
    }
    Ok(())
}

/// The key of an attribute in a primitive.
pub(super) fn key(semantic: &Semantic) -> Checked<Semantic> {
    Checked::Valid(semantic.clone())
}
