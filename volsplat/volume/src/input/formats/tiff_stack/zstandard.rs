//! Pages packed by Zstandard, which the crate `tiff` unpacks with a C library alone.
//!
//! Takes a decoder at a page, returns the numbers of the page. Strips or tiles are unpacked one after the other, differences between pixels
//! are summed, and what of a tile lies on the page is kept.
//! Source: tags 50000 and 34926 as libtiff and tifffile write them. Limits: integers of 8 to 32 bits and floats; of predictors, none
//! and that of integers.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use tiff::decoder::Decoder;
use tiff::tags::{ByteOrder, Tag};

use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::tiff_stack::kind::{Kind, fault_of_page};
use crate::input::formats::zarr::codecs::{Size, zstd};
use crate::volume::{Endian, VoxelType, Voxels};

/// The number of the compression, and that of its trial.
const METHODS: [u16; 2] = [50000, 34926];

/// Returns true if the decoder's page is packed so.
pub(super) fn is_packed(
    decoder: &mut Decoder<BufReader<File>>,
    page: usize,
) -> Result<bool, Fault> {
    let method = decoder.find_tag_unsigned::<u16>(Tag::Compression);
    let method = method.map_err(|error| fault_of_page(page, &error))?;
    Ok(method.is_some_and(|method| METHODS.contains(&method)))
}

/// How a page is cut and packed.
struct Cut {
    /// Width and height of a strip or a tile, pixels.
    size: [usize; 2],
    /// Strips or tiles side by side.
    across: usize,
    pixel_bytes: usize,
    /// Where each begins in the file, and its bytes there.
    places: Vec<[u64; 2]>,
    /// Numbers are differences to the pixel before.
    are_differences: bool,
    endian: Endian,
    voxel_type: VoxelType,
}

/// The numbers of the decoder's page.
pub(super) fn read(
    decoder: &mut Decoder<BufReader<File>>,
    kind: &Kind,
    page: usize,
) -> Result<Voxels, Fault> {
    let damaged = |what: String| Fault::Invalid(format!("page {page}: {what}"));
    let cut = Cut::of(decoder, kind, page)?;
    let row_bytes = kind.width * cut.pixel_bytes;
    let mut bytes = vec![0u8; row_bytes * kind.height];
    for (number, [place, count]) in cut.places.iter().enumerate() {
        let mut packed = Vec::new();
        let file = decoder.inner();
        let read = file
            .seek(SeekFrom::Start(*place))
            .and_then(|_| file.take(*count).read_to_end(&mut packed));
        if read.map_err(|error| damaged(error.to_string()))? as u64 != *count {
            return Err(damaged("the file ends within its data".to_owned()));
        }
        let [width, height] = cut.size;
        let (left, top) = (number % cut.across * width, number / cut.across * height);
        // The last strip has the rows that are left.
        let rows = if cut.across == 1 && width == kind.width {
            height.min(kind.height.saturating_sub(top))
        } else {
            height
        };
        let needed = width * rows * cut.pixel_bytes;
        let mut part = zstd(&packed, Size::Exactly(needed)).map_err(damaged)?;
        if part.len() < needed {
            return Err(damaged(format!(
                "a part of it has {} bytes, expected {needed}",
                part.len()
            )));
        }
        let line_bytes = width * cut.pixel_bytes;
        let shown = line_bytes.min((kind.width.saturating_sub(left)) * cut.pixel_bytes);
        let lines = part.chunks_exact_mut(line_bytes).take(rows);
        for (line, y) in lines.zip(top..kind.height) {
            if cut.are_differences {
                cut.sum(line, kind.components);
            }
            let first = y * row_bytes + left * cut.pixel_bytes;
            bytes[first..][..shown].copy_from_slice(&line[..shown]);
        }
    }
    let layout = Layout {
        voxel_type: cut.voxel_type,
        endian: cut.endian,
        count: kind.width * kind.height * kind.components,
    };
    decode::binary(&mut bytes.as_slice(), &layout).map_err(damaged)
}

impl Cut {
    fn of(decoder: &mut Decoder<BufReader<File>>, kind: &Kind, page: usize) -> Result<Self, Fault> {
        let mut numbers = |tag: Tag| {
            let numbers = decoder.find_tag_unsigned_vec::<u64>(tag);
            numbers.map_err(|error| fault_of_page(page, &error))
        };
        let are_tiles = numbers(Tag::TileOffsets)?.is_some();
        let [offsets, counts] = match are_tiles {
            true => [Tag::TileOffsets, Tag::TileByteCounts],
            false => [Tag::StripOffsets, Tag::StripByteCounts],
        };
        let places = numbers(offsets)?.unwrap_or_default();
        let counts = numbers(counts)?.unwrap_or_default();
        let format = numbers(Tag::SampleFormat)?.and_then(|list| list.first().copied());
        let predictor = numbers(Tag::Predictor)?.and_then(|list| list.first().copied());
        let (width, height) = decoder.chunk_dimensions();
        let [width, height] = [width, height].map(|side| side as usize);
        let across = kind.width.div_ceil(width.max(1));
        if width == 0
            || height == 0
            || places.len() != across * kind.height.div_ceil(height)
            || counts.len() != places.len()
        {
            return Err(Fault::Invalid(format!(
                "page {page} has {} parts of {width}x{height} pixels, which do not cover it once",
                places.len()
            )));
        }
        let voxel_type = match (format.unwrap_or(1), kind.bits) {
            (1, 8) => VoxelType::U8,
            (1, 16) => VoxelType::U16,
            (1, 32) => VoxelType::U32,
            (2, 8) => VoxelType::I8,
            (2, 16) => VoxelType::I16,
            (2, 32) => VoxelType::I32,
            (3, 32) => VoxelType::F32,
            (3, 64) => VoxelType::F64,
            _ => {
                return Err(unsupported(format!(
                    "page {page} has numbers of {} bits packed by Zstandard: save it with deflate",
                    kind.bits
                )));
            }
        };
        let is_float = matches!(voxel_type, VoxelType::F32 | VoxelType::F64);
        let are_differences = match predictor {
            None | Some(1) => false,
            Some(2) if !is_float => true,
            Some(other) => {
                return Err(unsupported(format!(
                    "page {page} has predictor {other} under Zstandard: save it with deflate"
                )));
            }
        };
        Ok(Self {
            size: [width, height],
            across,
            pixel_bytes: voxel_type.bytes() * kind.components,
            places: places
                .into_iter()
                .zip(counts)
                .map(|(place, count)| [place, count])
                .collect(),
            are_differences,
            endian: match decoder.byte_order() {
                ByteOrder::LittleEndian => Endian::Little,
                ByteOrder::BigEndian => Endian::Big,
            },
            voxel_type,
        })
    }

    /// Sums the differences of a line of pixels; numbers overflow as they did when they were subtracted.
    fn sum(&self, line: &mut [u8], components: usize) {
        let each = self.voxel_type.bytes();
        let number = |bytes: &[u8]| {
            let fold = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
            match self.endian {
                Endian::Big => bytes.iter().fold(0, fold),
                Endian::Little => bytes.iter().rev().fold(0, fold),
            }
        };
        for at in (each * components..line.len()).step_by(each) {
            let before = number(&line[at - each * components..][..each]);
            let sum = number(&line[at..][..each]).wrapping_add(before);
            let bytes = match self.endian {
                Endian::Big => &sum.to_be_bytes()[4 - each..],
                Endian::Little => &sum.to_le_bytes()[..each],
            };
            line[at..][..each].copy_from_slice(bytes);
        }
    }
}
