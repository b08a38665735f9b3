//! Accessors of glTF: vectors in a buffer, checked once and decoded one by one.
//!
//! Source: glTF 2.0, 3.6.2. Limits: no sparse accessors, and none without data.

use super::document::{Accessor, Document};
use crate::input::{Fault, unsupported};
use resample_core::narrow;

/// Types of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::F32 => 4,
        }
    }

    /// The number, and what the largest whole number stands for as a fraction.
    fn decoded(self, bytes: &[u8]) -> (f32, f32) {
        match (self, bytes) {
            (Self::I8, [a, ..]) => (f32::from(a.cast_signed()), 127.0),
            (Self::U8, [a, ..]) => (f32::from(*a), 255.0),
            (Self::I16, [a, b, ..]) => (f32::from(i16::from_le_bytes([*a, *b])), 32_767.0),
            (Self::U16, [a, b, ..]) => (f32::from(u16::from_le_bytes([*a, *b])), 65_535.0),
            (Self::F32, [a, b, c, d, ..]) => (f32::from_le_bytes([*a, *b, *c, *d]), 1.0),
            _ => (f32::NAN, 1.0),
        }
    }
}

/// How whole numbers become components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Integers {
    /// As the accessor says.
    AsMarked,
    /// Always as fractions of the largest.
    Fractions,
}

/// Vectors of `N` components.
pub(super) struct Numbers<'a, const N: usize> {
    /// From the first component of the first vector on.
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    component: Component,
    is_fraction: bool,
}

impl<'a, const N: usize> Numbers<'a, N> {
    /// Those of an accessor; `name` is what it is for.
    pub(super) fn new(
        document: &'a Document,
        (name, index): (&str, usize),
        integers: Integers,
    ) -> Result<Self, Fault> {
        let located = |what: String| Fault::Invalid(format!("accessor {index} ({name}): {what}"));
        let accessor = document.root.accessors.get(index);
        let accessor = accessor.ok_or_else(|| located("it does not exist".to_owned()))?;
        let shape = match N {
            1 => "SCALAR",
            3 => "VEC3",
            _ => "VEC4",
        };
        let component = Component::of(accessor.component_type);
        let Some(component) = component.filter(|_| accessor.shape == shape) else {
            return Err(located(format!(
                "it has type {} of components {}: expected {shape} of f32 (5126), or of 8 or 16 bits (5120 to 5123)",
                accessor.shape, accessor.component_type
            )));
        };
        if accessor.sparse.is_some() || accessor.buffer_view.is_none() {
            return Err(unsupported(format!(
                "accessor {index} ({name}) is sparse or has no data: write all its numbers"
            )));
        }
        let is_whole = component != Component::F32;
        let is_fraction = is_whole && (accessor.normalized || integers == Integers::Fractions);
        let (bytes, stride) =
            stretch(document, accessor, N * component.bytes()).map_err(located)?;
        Ok(Self {
            bytes,
            stride,
            count: narrow::count(accessor.count),
            component,
            is_fraction,
        })
    }

    /// Vectors.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Vector `index`.
    pub(super) fn get(&self, index: usize) -> [f32; N] {
        let vector = &self.bytes[index * self.stride..];
        let size = self.component.bytes();
        std::array::from_fn(|place| {
            let (number, largest) = self.component.decoded(&vector[place * size..]);
            match self.is_fraction {
                true => (number / largest).max(-1.0),
                false => number,
            }
        })
    }
}

/// The bytes of an accessor whose vectors have `size` bytes, and how far they are apart: all of them lie inside.
fn stretch<'a>(
    document: &'a Document,
    accessor: &Accessor,
    size: usize,
) -> Result<(&'a [u8], usize), String> {
    let index = accessor.buffer_view.unwrap_or(usize::MAX);
    let view = document.root.buffer_views.get(index);
    let view = view.ok_or_else(|| format!("buffer view {index} does not exist"))?;
    let buffer = document.buffers.get(view.buffer);
    let buffer = buffer.ok_or_else(|| format!("buffer {} does not exist", view.buffer))?;
    let (start, length) = (view.byte_offset, view.byte_length);
    let end = start.saturating_add(length);
    if end > buffer.len() as u64 {
        let held = buffer.len();
        return Err(format!(
            "buffer view {index} takes {length} bytes from byte {start} of a buffer of {held} bytes"
        ));
    }
    let size = size as u64;
    let stride = view.byte_stride.filter(|stride| *stride > 0);
    let stride = stride.unwrap_or(size);
    if stride < size {
        return Err(format!(
            "vectors of {size} bytes cannot be {stride} bytes apart"
        ));
    }
    let (count, offset) = (accessor.count, accessor.byte_offset);
    let taken = match count {
        0 => Some(0),
        _ => (count - 1)
            .checked_mul(stride)
            .and_then(|bytes| bytes.checked_add(size)),
    };
    let last = taken.and_then(|taken| taken.checked_add(offset));
    if last.is_none_or(|last| last > length) || offset > length {
        return Err(format!(
            "{count} vectors of {size} bytes, {stride} bytes apart from byte {offset} on, do not fit into {length} bytes"
        ));
    }
    // Both ends lie in the buffer, whose length is a usize.
    let bytes = &buffer[narrow::count(start + offset)..narrow::count(end)];
    Ok((bytes, narrow::count(stride)))
}
