//! Primitives compressed by Draco.
//!
//! Takes each primitive that names a stream and gives it new accessors, which read the numbers that the crate `draco-core` decodes. Numbers
//! have the type that the primitive's accessor names; a primitive's triangles become a list.
//! Source: `KHR_draco_mesh_compression`, Khronos Group; Draco bitstream 2.2.

use draco_core::geometry_attribute::PointAttribute;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Buffer, Index, Root};
use resample_core::narrow;
use serde_json::Value;

use crate::input::files::excerpt;
use crate::input::gltf::compressed::room::{Room, index_of, range};

/// Unpacks the primitives of all meshes that have the extension `name`.
pub(super) fn unpack_primitives(
    name: &str,
    root: &mut Root,
    buffers: &mut Vec<Vec<u8>>,
    room: &mut Room,
) -> Result<(), String> {
    let mut meshes = std::mem::take(&mut root.meshes);
    for (mesh, json) in meshes.iter_mut().enumerate() {
        for (number, primitive) in json.primitives.iter_mut().enumerate() {
            let extensions = primitive.extensions.as_ref();
            let Some(value) = extensions.and_then(|all| all.others.get(name)).cloned() else {
                continue;
            };
            unpack(primitive, &value, root, buffers, room).map_err(|what| {
                format!("mesh {mesh}, primitive {number}: its Draco stream: {what}")
            })?;
        }
    }
    root.meshes = meshes;
    Ok(())
}

fn unpack(
    primitive: &mut Primitive,
    value: &Value,
    root: &mut Root,
    buffers: &mut Vec<Vec<u8>>,
    room: &mut Room,
) -> Result<(), String> {
    let Checked::Valid(Mode::Triangles | Mode::TriangleStrip) = primitive.mode else {
        return Err("only triangles and strips of them are compressed so".into());
    };
    let view = value.get("bufferView").and_then(Value::as_u64);
    let view = view
        .and_then(|view| root.buffer_views.get(narrow::count(view)))
        .ok_or("its buffer view does not exist")?;
    let start = view.byte_offset.unwrap_or_default().0;
    let place = (view.buffer.value() as u64, start, view.byte_length.0);
    let mesh = decoded(range(buffers, place)?, room)?;
    let mut parts = Parts {
        root,
        buffers,
        room,
    };
    let points = mesh.num_points();
    let ids = value.get("attributes").and_then(Value::as_object);
    for (name, id) in ids.into_iter().flatten() {
        let located = |what: String| format!("{}: {what}", excerpt(name));
        let semantic: Checked<gltf::json::mesh::Semantic> =
            serde_json::from_value(Value::String(name.clone()))
                .map_err(|e| located(e.to_string()))?;
        let Some(index) = primitive.attributes.get_mut(&semantic) else {
            continue;
        };
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute =
            attribute.ok_or_else(|| located("the stream does not have this attribute".into()))?;
        *index = parts
            .with_numbers(index.value(), attribute, points)
            .map_err(located)?;
    }
    if primitive.indices.is_some() {
        let corners = mesh.faces().iter().flatten().map(|corner| corner.0);
        primitive.indices = Some(parts.with_corners(corners.collect())?);
        primitive.mode = Checked::Valid(Mode::Triangles);
    }
    Ok(())
}

/// The mesh of a stream.
fn decoded(stream: &[u8], room: &mut Room) -> Result<Mesh, String> {
    let most = room.gate.most_unpacked(room.file_bytes);
    let limits = DecodeLimits::default()
        .with_max_faces(most / 12)
        .with_max_decoded_bytes(most);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
    MeshDecoder::new()
        .decode(&mut buffer, &mut mesh)
        .map_err(|error| error.to_string())?;
    Ok(mesh)
}

/// The lists of a document that new accessors are added to.
struct Parts<'a, 'b> {
    root: &'a mut Root,
    buffers: &'a mut Vec<Vec<u8>>,
    room: &'a mut Room<'b>,
}

impl Parts<'_, '_> {
    /// An accessor as `index`, over the numbers of an attribute.
    fn with_numbers(
        &mut self,
        index: usize,
        attribute: &PointAttribute,
        points: usize,
    ) -> Result<Index<Accessor>, String> {
        let accessor = self.root.accessors.get(index);
        let accessor = accessor.ok_or_else(|| format!("accessor {index} does not exist"))?;
        let (Checked::Valid(shape), Checked::Valid(component)) =
            (accessor.type_, accessor.component_type)
        else {
            return Err(format!("accessor {index} has an unknown type"));
        };
        let width = shape.multiplicity();
        if width != usize::from(attribute.num_components()) {
            return Err(format!(
                "{} numbers a vertex, but accessor {index} has {width}",
                attribute.num_components()
            ));
        }
        let is_whole = component.0 != ComponentType::F32;
        if is_whole != attribute.data_type().is_integral() {
            return Err(format!(
                "{:?}, but accessor {index} has {:?}",
                attribute.data_type(),
                component.0
            ));
        }
        self.room.ask(points.saturating_mul(width * 4))?;
        // Whole numbers that meshes have are below 2^24, which a float holds.
        let numbers = attribute.read_f32s(points, width);
        let bytes = numbers.iter().flat_map(|&number| {
            let (bytes, size) = match component.0 {
                ComponentType::F32 => (number.to_le_bytes(), 4),
                ComponentType::I8 | ComponentType::U8 => (low_bytes(number), 1),
                ComponentType::I16 | ComponentType::U16 => (low_bytes(number), 2),
                ComponentType::U32 => (low_bytes(number), 4),
            };
            bytes.into_iter().take(size)
        });
        let (bytes, mut accessor) = (bytes.collect(), accessor.clone());
        accessor.sparse = None;
        self.push(accessor, points, bytes)
    }

    fn with_corners(&mut self, corners: Vec<u32>) -> Result<Index<Accessor>, String> {
        self.room.ask(corners.len().saturating_mul(4))?;
        let component = GenericComponentType(ComponentType::U32);
        let accessor = Accessor {
            buffer_view: None,
            byte_offset: None,
            count: USize64(0),
            component_type: Checked::Valid(component),
            extensions: None,
            extras: gltf::json::Extras::default(),
            type_: Checked::Valid(gltf::json::accessor::Type::Scalar),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        };
        let bytes = corners.iter().flat_map(|corner| corner.to_le_bytes());
        self.push(accessor, corners.len(), bytes.collect())
    }

    /// Adds an accessor over bytes of its own.
    fn push(
        &mut self,
        accessor: Accessor,
        count: usize,
        bytes: Vec<u8>,
    ) -> Result<Index<Accessor>, String> {
        let byte_length = USize64(bytes.len() as u64);
        self.root.buffer_views.push(View {
            buffer: Index::<Buffer>::new(index_of(self.buffers.len())?),
            byte_length,
            byte_offset: None,
            byte_stride: None,
            name: None,
            target: None,
            extensions: None,
            extras: gltf::json::Extras::default(),
        });
        self.buffers.push(bytes);
        let view = index_of(self.root.buffer_views.len() - 1)?;
        self.root.accessors.push(Accessor {
            buffer_view: Some(Index::new(view)),
            byte_offset: None,
            count: USize64(count as u64),
            ..accessor
        });
        Ok(Index::new(index_of(self.root.accessors.len() - 1)?))
    }
}

/// The bytes of a whole number, the lowest first.
fn low_bytes(number: f32) -> [u8; 4] {
    let [a, b, c, d, ..] = narrow::floor(number.into()).to_le_bytes();
    [a, b, c, d]
}
