//! NIfTI files, versions 1 and 2: `.nii`, `.nii.gz`, and pairs of `.hdr` and `.img`.
//!
//! Takes a path, returns the parts of a volume. The header has fixed places for everything, two versions and two byte orders, told by
//! its first four bytes; it is parsed into the wider types of version 2. Stored numbers become real ones by its slope and intercept.
//! It can place the image in the world in three ways, and this is their order of trust: the matrix (sform), the turn and spacing
//! (qform), the spacing alone. All lead to x right, y front, z head, in the header's unit, mostly millimetres.
//! The source is the description in the reference headers nifti1.h and nifti2.h of the NIfTI initiative.
//! Of volumes over time, of vectors and of colours (RGB24, RGBA32) one is read.
//! Limits: complex numbers and 128-bit floats are refused. Extensions are skipped. World coordinates are the format's own.

use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::axes;
use crate::input::decode::component::Interleaved;
use crate::input::decode::rescale::Rescale;
use crate::input::decode::stored::Stream;
use crate::input::decode::{Layout, component};
use crate::input::file::{Fault, unsupported};
use crate::input::options::LoadOptions;
use crate::input::{Parts, decode, invalid};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, voxel_count};

/// The header beside an image file of a pair, if `path` names one: `brain.hdr` for `brain.img`.
pub(crate) fn header_beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let stem = ["img", "IMG", "img.gz"]
        .iter()
        .find_map(|end| name.strip_suffix(&format!(".{end}")))?;
    let candidates =
        ["hdr", "HDR", "hdr.gz"].map(|end| path.with_file_name(format!("{stem}.{end}")));
    candidates.into_iter().find(|candidate| candidate.is_file())
}

/// How many colours a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = read(&mut Stream::open(path)?.bytes).map_err(|fault| fault.at(path))?;
    Ok(Some(header.colours()).filter(|&colours| colours > 1))
}

/// Points in time.
pub(crate) fn times(path: &Path) -> Result<usize, Error> {
    let header = read(&mut Stream::open(path)?.bytes).map_err(|fault| fault.at(path))?;
    let shape = header.shape().map_err(|fault| fault.at(path))?;
    Ok(shape.times)
}

pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let gate = &options.gate;
    let mut stream = Stream::open(path)?;
    let header = read(&mut stream.bytes).map_err(|fault| fault.at(path))?;
    let chosen = Chosen::of(&header, components, options.time).map_err(|fault| fault.at(path))?;
    if let Some(remark) = chosen.remark(path, options.time) {
        gate.remark(remark);
    }
    let dims = chosen.shape.dims;
    let voxels = match header.place {
        Place::Attached { skip } => {
            stream
                .skip(header.bytes, skip, gate)
                .map_err(|what| invalid(path, what))?;
            voxels(stream, &header, &chosen, gate).map_err(|fault| fault.at(path))?
        }
        Place::Beside { skip } => {
            let image = image_beside(path)?;
            gate.note(&image);
            let mut stream = Stream::open(&image)?;
            stream
                .skip(0, skip, gate)
                .map_err(|what| invalid(&image, what))?;
            voxels(stream, &header, &chosen, gate).map_err(|fault| fault.at(&image))?
        }
    };
    Ok(Parts {
        lattice: Lattice {
            dims,
            world_from_index: world_from_index(&header),
            up_hint: Some(DVec3::Z),
            space: Some("right-anterior-superior".to_owned()),
            modality: None,
            unit: Some(header.length_unit().to_owned()),
            window: header.window(),
        },
        voxels: voxels
            .into_iter()
            .map(|voxels| header.rescale().apply(voxels))
            .collect(),
    })
}

/// The volumes that are read, among those that there are.
struct Chosen {
    shape: Shape,
    /// Volumes before the first of them, and volumes from there to the last.
    before: usize,
    span: usize,
    /// Their numbers, counted from the first of them, or their colours, where a voxel has several.
    numbers: Vec<usize>,
}

impl Chosen {
    fn of(header: &Header, components: &[usize], time: Option<usize>) -> Result<Self, Fault> {
        let shape = header.shape()?;
        let colours = header.colours();
        let vector_or_colour = match (shape.vectors, colours) {
            (1, colours) => component::chosen(components, colours)?,
            (vectors, 1) => component::chosen(components, vectors)?,
            (vectors, _) => {
                return Err(unsupported(format!(
                    "vectors of {vectors} colours: save one of them as a volume first"
                )));
            }
        };
        let time = time.unwrap_or(0);
        if time >= shape.times {
            return Err(Fault::Option(format!(
                "time={time}: the file holds {} point(s) in time, counted from 0",
                shape.times
            )));
        }
        if colours > 1 {
            return Ok(Self {
                shape,
                before: time,
                span: 1,
                numbers: vector_or_colour,
            });
        }
        let volume = |&vector: &usize| {
            let before = vector.checked_mul(shape.times);
            before.and_then(|volumes| volumes.checked_add(time))
        };
        let volumes: Option<Vec<usize>> = vector_or_colour.iter().map(volume).collect();
        let volumes = volumes.ok_or_else(|| TOO_MANY.to_owned())?;
        let before = volumes.iter().copied().min().unwrap_or(0);
        let last = volumes.iter().copied().max().unwrap_or(0);
        Ok(Self {
            shape,
            before,
            span: last - before + 1,
            numbers: volumes.iter().map(|volume| volume - before).collect(),
        })
    }

    /// The note where nobody chose among several.
    fn remark(&self, path: &Path, time: Option<usize>) -> Option<String> {
        let times = self.shape.times;
        (times > 1 && time.is_none()).then(|| axes::first_of(times, path))
    }
}

const TOO_MANY: &str = "dim promises more volumes than can be addressed";

fn voxels(
    mut stream: Stream,
    header: &Header,
    chosen: &Chosen,
    gate: &Gate,
) -> Result<Vec<Voxels>, Fault> {
    let Shape {
        dims,
        times,
        vectors,
    } = chosen.shape;
    let colours = header.colours();
    let layout = Layout {
        voxel_type: header.voxel_type()?,
        endian: header.endian,
        count: voxel_count(dims)?,
    };
    let kept = layout.bytes()?;
    let of_volumes = |volumes: usize| {
        let bytes = kept.checked_mul(colours as u64)?;
        bytes.checked_mul(volumes as u64)
    };
    let volumes = times.checked_mul(vectors).and_then(of_volumes);
    let (Some(span), Some(before), Some(all)) =
        (of_volumes(chosen.span), of_volumes(chosen.before), volumes)
    else {
        return Err(Fault::Invalid(TOO_MANY.to_owned()));
    };
    if stream.is_packed {
        decode::check_expansion(all, stream.held)?;
        // What lies before it is unpacked too.
        decode::check_deflated(before.saturating_add(span), stream.held, gate)?;
    } else if all != stream.held {
        let ([x, y, z], name, held) = (dims, layout.voxel_type.name(), stream.held);
        let several = match (times * vectors, colours) {
            (1, 1) => String::new(),
            (1, colours) => format!(" in {colours} colours"),
            (volumes, _) => format!(" in {volumes} volumes"),
        };
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {name}{several}, which are {all} bytes, but {held} are there: \
             the file is cut off, or its dim, datatype or vox_offset is wrong"
        )));
    }
    stream.pass(before)?;
    let volume_bytes = usize::try_from(kept).map_err(|_| TOO_MANY.to_owned())?;
    let interleaved = Interleaved {
        scalar_bytes: match colours {
            1 => volume_bytes,
            _ => layout.voxel_type.bytes(),
        },
        components: colours.max(chosen.span),
        chosen: chosen.numbers.clone(),
    };
    // Packed data must end where the header says.
    let limit = if span == all { u64::MAX } else { span };
    Ok(component::read(
        stream.bytes.take(limit),
        &layout,
        &interleaved,
    )?)
}

/// The image file of a pair, packed or not.
fn image_beside(header: &Path) -> Result<PathBuf, Error> {
    let name = header.file_name().unwrap_or_default().to_string_lossy();
    let stem = name
        .trim_end_matches(".gz")
        .trim_end_matches(".hdr")
        .trim_end_matches(".HDR");
    let candidates =
        ["img", "IMG", "img.gz"].map(|end| header.with_file_name(format!("{stem}.{end}")));
    let found = candidates
        .iter()
        .find(|candidate| candidate.is_file())
        .cloned();
    found.ok_or_else(|| {
        invalid(
            header,
            format!("the header belongs to an image file {stem}.img or {stem}.img.gz, which is not there"),
        )
    })
}

/// The facts of the header. Names are those of the format.
pub(crate) struct Header {
    pub(crate) endian: Endian,
    /// Number of axes, then the size of each.
    pub(crate) dim: [i64; 8],
    datatype: i16,
    /// The sign of the third axis, then the spacing of each axis.
    pixdim: [f64; 8],
    /// The unit of space in the lowest three bits: 1 is metres, 2 or nothing millimetres, 3 micrometres.
    xyzt_units: u8,
    scl_slope: f64,
    scl_inter: f64,
    cal_min: f64,
    cal_max: f64,
    qform_code: i32,
    sform_code: i32,
    /// quatern_b, quatern_c, quatern_d.
    quaternion: [f64; 3],
    qoffset: [f64; 3],
    /// srow_x, srow_y, srow_z.
    srow: [[f64; 4]; 3],
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
    /// The sign of the unit of lengths.
    fn length_unit(&self) -> &'static str {
        match self.xyzt_units & 7 {
            1 => "m",
            3 => "µm",
            _ => "mm",
        }
    }

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

    /// The rescaled numbers at black and at white; most files leave both at 0.
    fn window(&self) -> Option<[f64; 2]> {
        let ends = [self.cal_min, self.cal_max];
        (ends[0] < ends[1] && ends.iter().all(|end| end.is_finite())).then_some(ends)
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
            xyzt_units: self.bytes[123],
            scl_slope: self.f32(112),
            scl_inter: self.f32(116),
            cal_max: self.f32(124),
            cal_min: self.f32(128),
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
            xyzt_units: u8::try_from(self.i32(500) & 255).unwrap_or(0),
            scl_slope: self.f64(176),
            scl_inter: self.f64(184),
            cal_max: self.f64(192),
            cal_min: self.f64(200),
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

pub(crate) fn world_from_index(header: &Header) -> DAffine3 {
    if header.sform_code > 0 {
        let [x, y, z] = header.srow;
        let column = |index: usize| DVec3::new(x[index], y[index], z[index]);
        let matrix = DMat3::from_cols(column(0), column(1), column(2));
        return DAffine3::from_mat3_translation(matrix, column(3));
    }
    let spacing = DVec3::new(
        length(header.pixdim[1]),
        length(header.pixdim[2]),
        length(header.pixdim[3]),
    );
    if header.qform_code > 0 {
        // The format mirrors the third axis where pixdim[0] is negative; 0 counts as positive.
        let third = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let scale = DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, third));
        let offset = DVec3::from_array(header.qoffset);
        return DAffine3::from_mat3_translation(rotation(header.quaternion) * scale, offset);
    }
    DAffine3::from_scale(spacing)
}

/// Spacings that are 0 or not finite stand for "not known" in real files; the sign means nothing.
fn length(pixdim: f64) -> f64 {
    if pixdim == 0.0 || !pixdim.is_finite() {
        1.0
    } else {
        pixdim.abs()
    }
}

/// The rotation of a unit quaternion whose first part a >= 0 is not stored.
fn rotation([b, c, d]: [f64; 3]) -> DMat3 {
    let squares = b * b + c * c + d * d;
    // Rounding of singles can make the stored part longer than 1: then a is 0 and the rest is brought to length 1.
    let (a, scale) = if squares < 1.0 {
        ((1.0 - squares).sqrt(), 1.0)
    } else {
        (0.0, squares.sqrt().recip())
    };
    let [b, c, d] = [b * scale, c * scale, d * scale];
    DMat3::from_cols(
        DVec3::new(
            a * a + b * b - c * c - d * d,
            2.0 * (b * c + a * d),
            2.0 * (b * d - a * c),
        ),
        DVec3::new(
            2.0 * (b * c - a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d + a * b),
        ),
        DVec3::new(
            2.0 * (b * d + a * c),
            2.0 * (c * d - a * b),
            a * a + d * d - c * c - b * b,
        ),
    )
}

#[cfg(test)]
mod tests;
