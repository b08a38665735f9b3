//! Buffer views compressed by meshopt: attributes, triangles and indices, and the filters behind them.
//!
//! Takes the bytes of a view, the number and the size of its elements, gives the elements one after another. A stream ends
//! exactly where its elements do; one that is longer or shorter is refused.
//! Source: `EXT_meshopt_compression` (versions 0 of attributes) and `KHR_meshopt_compression` (version 1, and colours), Khronos
//! Group.

mod attributes;
mod filters;
mod indices;
mod stream;

pub(super) use filters::Filter;

/// The kind of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Elements of any bytes, each near to that before it.
    Attributes,
    /// Corners of triangles.
    Triangles,
    /// Indices in any order.
    Indices,
}

/// How a view is compressed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub mode: Mode,
    /// Number of elements.
    pub count: usize,
    /// Size of an element, bytes.
    pub stride: usize,
    pub filter: Filter,
}

impl Layout {
    /// The size of the decoded elements, bytes. An error for a layout that the format does not allow; nothing is allocated yet.
    pub(super) fn bytes(&self) -> Result<usize, String> {
        let Self { count, stride, .. } = *self;
        match self.mode {
            // The largest element is the format's limit.
            Mode::Attributes if stride == 0 || !stride.is_multiple_of(4) || stride > 256 => Err(
                format!("elements of {stride} bytes, expected a multiple of 4 up to 256"),
            ),
            Mode::Triangles | Mode::Indices if stride != 2 && stride != 4 => {
                Err(format!("indices of {stride} bytes, expected 2 or 4"))
            }
            Mode::Triangles if !count.is_multiple_of(3) => {
                Err(format!("{count} corners are no triangles"))
            }
            Mode::Triangles | Mode::Indices if self.filter != Filter::None => {
                Err("indices have no filter".into())
            }
            _ => count
                .checked_mul(stride)
                .ok_or_else(|| format!("claims {count} elements")),
        }
    }

    /// The elements of a stream.
    pub(super) fn decode(&self, stream: &[u8]) -> Result<Vec<u8>, String> {
        let bytes = self.bytes()?;
        let Self { count, stride, .. } = *self;
        let mut elements = match self.mode {
            Mode::Attributes => attributes::decode(stream, count, stride),
            Mode::Triangles => indices::triangles(stream, count).map(|list| packed(&list, stride)),
            Mode::Indices => indices::sequence(stream, count).map(|list| packed(&list, stride)),
        }?;
        assert_eq!(elements.len(), bytes, "every element was decoded");
        self.filter.apply(&mut elements, stride)?;
        Ok(elements)
    }
}

/// Indices of 2 or 4 bytes; higher bits than they have are dropped, as the format says.
fn packed(indices: &[u32], stride: usize) -> Vec<u8> {
    let bytes = indices.iter().flat_map(|index| {
        let [a, b, c, d] = index.to_le_bytes();
        [a, b, c, d].into_iter().take(stride)
    });
    bytes.collect()
}

#[cfg(test)]
mod tests;
