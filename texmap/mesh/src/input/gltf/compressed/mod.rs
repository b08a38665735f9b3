//! Compressed geometry: unpacked when a document is opened, so that every other part reads plain accessors.
//!
//! Takes a document and its buffers; each view that meshopt compressed then lies in a buffer of its own, and each primitive that
//! Draco compressed has accessors of its own. The decoded size is checked against the memory limit before anything is
//! decoded.
//! Source: `EXT_meshopt_compression`, `KHR_meshopt_compression` and `KHR_draco_mesh_compression`, Khronos Group.

#[cfg(feature = "compressed")]
mod draco;
mod meshopt;
mod room;

use gltf::json::Root;
use gltf::json::validation::USize64;
use resample_io::Gate;
use room::{Room, index_of, range};
use serde_json::Value;

/// The names of meshopt's extensions; the second has later versions of its streams too.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// The name of Draco's extension.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// Decodes compressed buffer views and primitives; `file_bytes` is the size of the file and of its external buffers.
pub(super) fn unpack(
    root: &mut Root,
    buffers: &mut Vec<Vec<u8>>,
    file_bytes: u64,
    gate: &Gate,
) -> Result<(), String> {
    let mut room = Room::new(file_bytes, gate);
    unpack_views(root, buffers, &mut room)?;
    #[cfg(feature = "compressed")]
    draco::unpack_primitives(DRACO, root, buffers, &mut room)?;
    Ok(())
}

/// Returns true for a buffer that only stands where a reader knows no meshopt, and may have no data.
pub(super) fn is_fallback(buffer: &gltf::json::Buffer) -> bool {
    let extensions = buffer.extensions.as_ref();
    let marks = |name| {
        extensions
            .and_then(|all| all.others.get(name))
            .and_then(|value| value.get("fallback"))
    };
    MESHOPT
        .into_iter()
        .filter_map(marks)
        .any(|mark| mark == &Value::Bool(true))
}

/// Unpacks the views that meshopt compressed, each into a buffer of its own.
fn unpack_views(
    root: &mut Root,
    buffers: &mut Vec<Vec<u8>>,
    room: &mut Room,
) -> Result<(), String> {
    for (index, view) in root.buffer_views.iter_mut().enumerate() {
        let extensions = view.extensions.as_ref();
        let found =
            extensions.and_then(|all| MESHOPT.iter().find_map(|name| all.others.get(*name)));
        let Some(value) = found else { continue };
        let unpacked = unpacked_view(value, view.byte_length.0, buffers, room)
            .map_err(|what| format!("buffer view {index}: its meshopt stream: {what}"))?;
        view.buffer = gltf::json::Index::new(index_of(buffers.len())?);
        view.byte_offset = None;
        view.byte_length = USize64(unpacked.len() as u64);
        buffers.push(unpacked);
    }
    Ok(())
}

fn unpacked_view(
    value: &Value,
    promised: u64,
    buffers: &[Vec<u8>],
    room: &mut Room,
) -> Result<Vec<u8>, String> {
    let number = |key: &str| {
        let number = value.get(key).and_then(Value::as_u64);
        number.ok_or_else(|| format!("it has no {key}"))
    };
    let word = |key: &str| value.get(key).and_then(Value::as_str);
    let mode = match word("mode") {
        Some("ATTRIBUTES") => meshopt::Mode::Attributes,
        Some("TRIANGLES") => meshopt::Mode::Triangles,
        Some("INDICES") => meshopt::Mode::Indices,
        _ => return Err("its mode is not ATTRIBUTES, TRIANGLES or INDICES".into()),
    };
    let filter = match word("filter") {
        None | Some("NONE") => meshopt::Filter::None,
        Some("OCTAHEDRAL") => meshopt::Filter::Octahedral,
        Some("QUATERNION") => meshopt::Filter::Quaternion,
        Some("EXPONENTIAL") => meshopt::Filter::Exponential,
        Some("COLOR") => meshopt::Filter::Colour,
        Some(_) => return Err("its filter is unknown".into()),
    };
    let layout = meshopt::Layout {
        mode,
        count: resample_core::narrow::count(number("count")?),
        stride: resample_core::narrow::count(number("byteStride")?),
        filter,
    };
    let bytes = layout.bytes()?;
    if bytes as u64 != promised {
        return Err(format!(
            "{} elements of {} bytes, but the view has {promised} bytes",
            layout.count, layout.stride
        ));
    }
    room.ask(bytes)?;
    let start = value.get("byteOffset").and_then(Value::as_u64).unwrap_or(0);
    let place = (number("buffer")?, start, number("byteLength")?);
    layout.decode(range(buffers, place)?)
}
