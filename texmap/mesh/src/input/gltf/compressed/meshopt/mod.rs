//! Buffer views compressed by meshopt: attributes, triangles and indices, and the filters behind them.
//!
//! Takes the bytes of a view, the number and the size of its elements, gives the elements one after another. A stream ends
//! exactly where its elements do; one that is longer or shorter is refused.
//! Source: `EXT_meshopt_compression` (versions 0 of attributes) and `KHR_meshopt_compression` (version 1, and colours), Khronos
//! Group.

mod attributes;
mod filters;
mod indices;

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
    /// Refuses what no stream has, before memory is taken. Gives the bytes that the elements take.
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

/// The bytes of a stream, taken from its front.
struct Stream<'a> {
    left: &'a [u8],
}

impl<'a> Stream<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (front, left) = self.left.split_at_checked(count).ok_or("it is cut")?;
        self.left = left;
        Ok(front)
    }

    fn byte(&mut self) -> Result<u8, String> {
        self.take(1).map(|bytes| bytes[0])
    }

    /// A number in groups of 7 bits, the lowest first.
    fn number(&mut self) -> Result<u32, String> {
        let mut number = 0;
        // Five groups hold 32 bits.
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("a number is longer than 32 bits".into())
    }

    fn check_end(&self) -> Result<(), String> {
        match self.left.len() {
            0 => Ok(()),
            left => Err(format!("{left} bytes are left at its end")),
        }
    }
}

/// A difference whose sign is its lowest bit.
fn signed(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
mod tests;
