//! The header of a NIfTI file: fixed places, two versions, two byte orders.
//!
//! Takes a reader at the start of the unpacked file, gives a [`Header`] in the wider types of version 2. The first four
//! bytes, the length of the header, tell the version and the byte order.

use std::io::Read;

use crate::input::decode::rescale::Rescale;
use crate::input::fault::{Fault, unsupported};
use crate::volume::{Endian, VoxelType};

/// The facts of the header. Names are those of the format.
pub(crate) struct Header {
    pub(crate) endian: Endian,
    /// Number of axes, then the size of each.
    pub(crate) dim: [i64; 8],
    pub(crate) datatype: i16,
    /// The sign of the third axis, then the spacing of each axis.
    pub(crate) pixdim: [f64; 8],
    pub(crate) scl_slope: f64,
    pub(crate) scl_inter: f64,
    pub(crate) qform_code: i32,
    pub(crate) sform_code: i32,
    /// quatern_b, quatern_c, quatern_d.
    pub(crate) quaternion: [f64; 3],
    pub(crate) qoffset: [f64; 3],
    /// srow_x, srow_y, srow_z.
    pub(crate) srow: [[f64; 4]; 3],
    pub(crate) place: Place,
    /// Bytes of the header itself.
    pub(crate) bytes: u64,
}

/// The facts of the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Number of voxels along x, y and z.
    pub(crate) dims: [usize; 3],
    /// Volumes over time, one behind the other.
    pub(crate) times: usize,
    /// Components of a vector: all times of the first, then all of the second.
    pub(crate) vectors: usize,
}

/// The datatype of red, green and blue bytes.
const RGB24: i16 = 128;

/// With alpha behind them.
const RGBA32: i16 = 2304;

/// Where the image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// In the same file, behind so many bytes, header included.
    Attached { skip: u64 },
    /// In an image file of its own, behind so many bytes.
    Beside { skip: u64 },
}

/// Length of a header of version 1, which is also how it begins.
const BYTES_1: usize = 348;

/// Length of a header of version 2, which is also how it begins.
const BYTES_2: usize = 540;

/// The longest header.
pub(crate) const MAX_HEADER_BYTES: u64 = BYTES_2 as u64;

/// Greatest number of axes in the format.
const MAX_DIMENSION: i64 = 7;

/// Returns true if an unpacked file that begins with `head` is NIfTI.
pub(crate) fn is_nifti(head: &[u8]) -> bool {
    match begin(head) {
        Some((BYTES_1, _)) => head
            .get(344..348)
            .is_some_and(|magic| matches!(magic, b"n+1\0" | b"ni1\0")),
        Some((_, _)) => head
            .get(4..7)
            .is_some_and(|magic| matches!(magic, b"n+2" | b"ni2")),
        None => false,
    }
}

/// Returns true if it is a header of ANALYZE 7.5, from which NIfTI grew: the same length without the mark.
pub(crate) fn is_analyze(head: &[u8]) -> bool {
    // Its field "regular", at byte 38, is always r; a headerless file must not be taken for a header.
    matches!(begin(head), Some((BYTES_1, _))) && head.get(38) == Some(&b'r') && !is_nifti(head)
}

/// Length and byte order of the header.
fn begin(head: &[u8]) -> Option<(usize, Endian)> {
    let first: [u8; 4] = head.get(..4)?.try_into().ok()?;
    let lengths = [BYTES_1, BYTES_2];
    let of = |value: u32, endian| {
        lengths
            .into_iter()
            .find(|&l| l as u32 == value)
            .map(|l| (l, endian))
    };
    of(u32::from_le_bytes(first), Endian::Little)
        .or_else(|| of(u32::from_be_bytes(first), Endian::Big))
}

pub(crate) fn read(stream: &mut dyn Read) -> Result<Header, Fault> {
    let mut bytes = Vec::new();
    let mut take = |count: usize, bytes: &mut Vec<u8>| {
        let got = (&mut *stream).take(count as u64).read_to_end(bytes);
        got.map_err(|error| format!("the header cannot be read: {error}"))
    };
    take(BYTES_1, &mut bytes)?;
    let (length, endian) =
        begin(&bytes).ok_or_else(|| "the header has an unknown length".to_owned())?;
    take(length - BYTES_1, &mut bytes)?;
    if bytes.len() < length {
        return Err(Fault::Invalid(format!(
            "the header needs {length} bytes, the file has {}",
            bytes.len()
        )));
    }
    let fields = Fields {
        bytes: &bytes,
        endian,
    };
    let header = if length == BYTES_1 {
        fields.version_1()
    } else {
        fields.version_2()
    };
    Ok(header?)
}

impl Header {
    /// Number of voxels along x, y and z, and how many volumes of them there are. Axes beyond the fifth must have size 1.
    pub(crate) fn shape(&self) -> Result<Shape, Fault> {
        let axes = self.dim[0];
        if !(1..=MAX_DIMENSION).contains(&axes) {
            return Err(Fault::Invalid(format!(
                "dim[0], the number of axes, is {axes}: expected 1 to 7"
            )));
        }
        let mut shape = Shape {
            dims: [1; 3],
            times: 1,
            vectors: 1,
        };
        for axis in 1..=axes as usize {
            let size = self.dim[axis];
            match (usize::try_from(size), axis) {
                (Ok(0) | Err(_), _) => {
                    return Err(Fault::Invalid(format!(
                        "dim[{axis}] is {size}: expected at least 1"
                    )));
                }
                (Ok(size), 1..=3) => shape.dims[axis - 1] = size,
                (Ok(size), 4) => shape.times = size,
                (Ok(size), 5) => shape.vectors = size,
                (Ok(1), _) => {}
                (Ok(size), _) => {
                    return Err(unsupported(format!(
                        "dim[{axis}] is {size}: axes beyond time and vectors are not read; save one volume as a file of \
                         three dimensions first"
                    )));
                }
            }
        }
        Ok(shape)
    }

    /// How many colours of a byte each voxel has; 1 where it is a number.
    pub(crate) fn colours(&self) -> usize {
        match self.datatype {
            RGB24 => 3,
            RGBA32 => 4,
            _ => 1,
        }
    }

    /// The type of a number, or of a colour.
    pub(crate) fn voxel_type(&self) -> Result<VoxelType, Fault> {
        let refused = |what: &str, advice: &str| {
            Err(unsupported(format!(
                "datatype {} is {what}: {advice}",
                self.datatype
            )))
        };
        match self.datatype {
            2 | RGB24 | RGBA32 => Ok(VoxelType::U8),
            4 => Ok(VoxelType::I16),
            8 => Ok(VoxelType::I32),
            16 => Ok(VoxelType::F32),
            64 => Ok(VoxelType::F64),
            256 => Ok(VoxelType::I8),
            512 => Ok(VoxelType::U16),
            768 => Ok(VoxelType::U32),
            1024 => Ok(VoxelType::I64),
            1280 => Ok(VoxelType::U64),
            1 => refused("single bits", "save it as bytes"),
            32 | 1792 | 2048 => refused("complex numbers", "save the magnitude"),
            1536 => refused("floats of 128 bits", "save it as float32 or float64"),
            other => Err(Fault::Invalid(format!(
                "datatype {other} is no type of this format"
            ))),
        }
    }

    /// A slope of 0 means no rescaling; so do values that are not finite.
    pub(crate) fn rescale(&self) -> Rescale {
        if self.scl_slope == 0.0 || !self.scl_slope.is_finite() {
            return Rescale::NONE;
        }
        let intercept = if self.scl_inter.is_finite() {
            self.scl_inter
        } else {
            0.0
        };
        Rescale {
            slope: self.scl_slope,
            intercept,
        }
    }
}

/// Fields by their byte offsets, all inside `bytes`.
struct Fields<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Fields<'_> {
    fn version_1(&self) -> Result<Header, String> {
        let floats = |at: usize| -> [f64; 3] { [self.f32(at), self.f32(at + 4), self.f32(at + 8)] };
        let row = |at: usize| [0, 4, 8, 12].map(|step| self.f32(at + step));
        let offset = self.f32(108);
        Ok(Header {
            endian: self.endian,
            dim: [0, 1, 2, 3, 4, 5, 6, 7].map(|axis| i64::from(self.i16(40 + 2 * axis))),
            datatype: self.i16(70),
            pixdim: [0, 1, 2, 3, 4, 5, 6, 7].map(|axis| self.f32(76 + 4 * axis)),
            scl_slope: self.f32(112),
            scl_inter: self.f32(116),
            qform_code: i32::from(self.i16(252)),
            sform_code: i32::from(self.i16(254)),
            quaternion: floats(256),
            qoffset: floats(268),
            srow: [row(280), row(296), row(312)],
            place: self.place(self.bytes[345], offset)?,
            bytes: BYTES_1 as u64,
        })
    }

    fn version_2(&self) -> Result<Header, String> {
        let floats =
            |at: usize| -> [f64; 3] { [self.f64(at), self.f64(at + 8), self.f64(at + 16)] };
        let row = |at: usize| [0, 8, 16, 24].map(|step| self.f64(at + step));
        // Beyond 2^53 the offset would lie behind any file, so the rounding does no harm.
        let offset = self.i64(168) as f64;
        Ok(Header {
            endian: self.endian,
            dim: [0, 1, 2, 3, 4, 5, 6, 7].map(|axis| self.i64(16 + 8 * axis)),
            datatype: self.i16(12),
            pixdim: [0, 1, 2, 3, 4, 5, 6, 7].map(|axis| self.f64(104 + 8 * axis)),
            scl_slope: self.f64(176),
            scl_inter: self.f64(184),
            qform_code: self.i32(344),
            sform_code: self.i32(348),
            quaternion: floats(352),
            qoffset: floats(376),
            srow: [row(400), row(432), row(464)],
            place: self.place(self.bytes[5], offset)?,
            bytes: BYTES_2 as u64,
        })
    }

    /// `kind` is the second byte of the mark: + for an attached image, i for one beside. An offset of 0 in an attached
    /// one means that it begins behind the header and the four bytes that announce extensions.
    fn place(&self, kind: u8, offset: f64) -> Result<Place, String> {
        let least = self.bytes.len() as u64;
        // Fractions occur in no real file; NaN fails the comparison.
        let skip = if offset >= 0.0 && offset <= u64::MAX as f64 && offset.fract() == 0.0 {
            Ok(offset as u64)
        } else {
            Err(format!(
                "vox_offset is {offset}: expected a whole number of bytes"
            ))
        }?;
        match (kind, skip) {
            (b'i', skip) => Ok(Place::Beside { skip }),
            (_, 0) => Ok(Place::Attached { skip: least + 4 }),
            (_, skip) if skip >= least => Ok(Place::Attached { skip }),
            (_, skip) => Err(format!(
                "vox_offset is {skip}: the image cannot begin inside the header of {least} bytes"
            )),
        }
    }

    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.bytes[at..at + N]);
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.array(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.array(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.array(at))
    }

    fn f32(&self, at: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.array(at)))
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.array(at))
    }
}
