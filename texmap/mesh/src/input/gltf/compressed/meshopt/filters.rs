//! Filters: elements that were stored in fewer or other bits than accessors read.
//!
//! Takes the decoded elements and turns them in place into what accessors read.
//! Source: `KHR_meshopt_compression`, "Filters".

use resample_core::narrow::{self, index32};

/// How elements were stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    None,
    /// Unit vectors on an octahedron.
    Octahedral,
    /// Unit quaternions without their largest component.
    Quaternion,
    /// Floats of an exponent and a mantissa.
    Exponential,
    /// Colours as lightness and two differences.
    Colour,
}

impl Filter {
    /// Turns elements of `stride` bytes into what accessors read.
    pub(super) fn apply(self, elements: &mut [u8], stride: usize) -> Result<(), String> {
        let undo: fn(Vector) -> [f64; 4] = match (self, stride) {
            (Self::None, _) => return Ok(()),
            (Self::Exponential, _) => {
                elements.as_chunks_mut().0.iter_mut().for_each(float);
                return Ok(());
            }
            (Self::Octahedral, 4 | 8) => octahedral,
            (Self::Quaternion, 8) => quaternion,
            (Self::Colour, 4 | 8) => colour,
            _ => return Err(format!("its filter is not for elements of {stride} bytes")),
        };
        for element in elements.chunks_exact_mut(stride) {
            let vector = Vector::new(element);
            vector.replaced(undo(vector), element);
        }
        Ok(())
    }
}

/// Four whole numbers of 1 or 2 bytes each.
#[derive(Clone, Copy)]
struct Vector {
    signed: [i32; 4],
    unsigned: [i32; 4],
    bits: u32,
}

impl Vector {
    fn new(element: &[u8]) -> Self {
        let bits = 2 * index32(element.len());
        let mut unsigned = [0; 4];
        for (number, bytes) in unsigned
            .iter_mut()
            .zip(element.chunks_exact(element.len() / 4))
        {
            let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
            *number = i32::from(u16::from_le_bytes([byte(0), byte(1)]));
        }
        let sign = |number: i32| (number << (32 - bits)) >> (32 - bits);
        Self {
            signed: unsigned.map(sign),
            unsigned,
            bits,
        }
    }

    /// The largest number with a sign.
    fn most(&self) -> f64 {
        f64::from((1 << (self.bits - 1)) - 1)
    }

    /// Writes the whole numbers next to `numbers` into an element of the same size.
    fn replaced(&self, numbers: [f64; 4], element: &mut [u8]) {
        let bytes = element.len() / 4;
        for (number, to) in numbers.iter().zip(element.chunks_exact_mut(bytes)) {
            let whole = narrow::floor(number.round()).to_le_bytes();
            to.copy_from_slice(&whole[..bytes]);
        }
    }
}

/// A unit vector of two coordinates on an octahedron, in units of the third number.
fn octahedral(vector: Vector) -> [f64; 4] {
    let [x, y, one, w] = vector.signed.map(f64::from);
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded over the upper one.
    let fold = (-z).max(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = vector.most() / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale, w]
}

/// A unit quaternion of three components; the fourth number has their unit, and which one was left out.
fn quaternion(vector: Vector) -> [f64; 4] {
    let last = vector.signed[3];
    let scale = std::f64::consts::FRAC_1_SQRT_2 / f64::from(last | 3);
    let [x, y, z, _] = vector.signed.map(|number| f64::from(number) * scale);
    let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut numbers = [largest, x, y, z].map(|number| number * vector.most());
    numbers.rotate_right(usize::try_from(last & 3).unwrap_or(0));
    numbers
}

/// A float of an exponent, 8 bits, and a mantissa of 24.
fn float(bytes: &mut [u8; 4]) {
    let code = i32::from_le_bytes(*bytes);
    let mantissa = f64::from((code << 8) >> 8);
    *bytes = narrow::single(mantissa * f64::from(code >> 24).exp2()).to_le_bytes();
}

/// A colour of lightness and its differences to orange and to green; the highest bit of alpha says how many bits all have.
fn colour(vector: Vector) -> [f64; 4] {
    let [y, _, _, code] = vector.unsigned;
    let [_, orange, green, _] = vector.signed;
    // All bits below and including the highest that is set.
    let most = match code {
        0 => 0,
        _ => (1 << (32 - code.leading_zeros())) - 1,
    };
    let alpha = code & (most >> 1);
    let alpha = (alpha << 1) | (alpha & 1);
    let scale = f64::from((1 << vector.bits) - 1) / f64::from(most.max(1));
    let rgb = [y + orange - green, y + green, y - orange - green];
    let [r, g, b] = rgb.map(|number| f64::from(number) * scale);
    [r, g, b, f64::from(alpha) * scale]
}
