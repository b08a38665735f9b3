//! The pages of a TIFF file: their directories, held to one kind and to what the file can hold, and their numbers.
//!
//! Takes a path, returns the facts of all pages, and the voxels of some of them.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use resample_io::tiff::GREATEST_EXPANSION;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{
    ByteOrder, CompressionMethod, PhotometricInterpretation, PlanarConfiguration, Tag,
};

use crate::Error;
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::tiff_stack::kind::{Kind, fault_of_page};
use crate::input::formats::tiff_stack::notes::FirstPage;
use crate::input::formats::tiff_stack::{notes, zstandard};
use crate::input::{cannot_read, decode, open};
use crate::volume::{Endian, VoxelType, Voxels};

/// The facts of a file's directories.
pub(crate) struct Pages {
    pub(crate) kind: Kind,
    pub(crate) count: usize,
    /// Length of the file, bytes.
    pub(crate) held: u64,
    pub(crate) first: FirstPage,
    /// The place of pages that have no directories of their own.
    bare: Option<Bare>,
    limits: Limits,
}

/// Pages without directories of their own, one after another in the file. ImageJ writes stacks beyond 4 GB this way.
#[derive(Clone, Copy)]
struct Bare {
    first_byte: u64,
    endian: Endian,
    voxel_type: VoxelType,
}

/// Longest tag that is kept in memory, far above the descriptions of OME files. A guess.
const MAX_TAG_BYTES: u64 = 1 << 26;

impl Pages {
    /// Reads the directories of a file that is one of `files`.
    pub(crate) fn look_at(path: &Path, files: usize) -> Result<Self, Error> {
        let file = open(path)?;
        let held = file
            .metadata()
            .map_err(|source| cannot_read(path, source))?
            .len();
        look_at(file, held, files).map_err(|fault| fault.at(path))
    }

    /// Some components of some pages, one page after the other.
    pub(crate) fn decode(
        &self,
        path: &Path,
        pages: &[usize],
        chosen: &[usize],
    ) -> Result<Vec<Voxels>, Error> {
        self.decode_pages(open(path)?, pages, chosen)
            .map_err(|fault| fault.at(path))
    }

    fn decode_pages(
        &self,
        file: File,
        pages: &[usize],
        chosen: &[usize],
    ) -> Result<Vec<Voxels>, Fault> {
        if let Some(page) = pages.iter().find(|&&page| page >= self.count) {
            let count = self.count;
            return Err(Fault::Invalid(format!(
                "page {page} of a file of {count} pages"
            )));
        }
        let mut decoder = opened(file, self.limits.clone())?;
        let mut voxels: Vec<Voxels> = Vec::new();
        for &page in pages {
            let fault = |error| fault_of_page(page, &error);
            let part = match &self.bare {
                Some(bare) => bare.read(decoder.inner(), &self.kind, page)?,
                None => {
                    decoder.seek_to_image(page).map_err(fault)?;
                    match zstandard::is_packed(&mut decoder, page)? {
                        true => zstandard::read(&mut decoder, &self.kind, page)?,
                        false => numbers(decoder.read_image().map_err(fault)?),
                    }
                }
            };
            let components = self.kind.components;
            let needed = self.kind.width * self.kind.height * components;
            let held = part.len();
            if held != needed {
                return Err(Fault::Invalid(format!(
                    "page {page} has {held} values instead of {needed}"
                )));
            }
            if voxels
                .first()
                .is_some_and(|voxels| !decode::same_type(voxels, &part))
            {
                return Err(Fault::Invalid(format!(
                    "page {page} has another number type than the pages before it"
                )));
            }
            let parts = match components {
                1 => vec![part],
                _ => chosen
                    .iter()
                    .map(|&component| {
                        let places: Vec<usize> = (component..held).step_by(components).collect();
                        part.pieces(&places, 1)
                    })
                    .collect(),
            };
            voxels = decode::joined([Ok::<_, Fault>(voxels), Ok(parts)].into_iter())?;
        }
        if voxels.is_empty() {
            return Err(Fault::Invalid("the file has no page".to_owned()));
        }
        Ok(voxels)
    }
}

/// The OME description in a file: the file's text, or, of a TIFF file, the text of its first page.
pub(crate) fn description(path: &Path) -> Result<Option<String>, Error> {
    let read = |source| cannot_read(path, source);
    let mut bytes = Vec::new();
    let mut file = open(path)?.take(MAX_TAG_BYTES);
    file.by_ref()
        .take(8)
        .read_to_end(&mut bytes)
        .map_err(read)?;
    if resample_io::tiff::begins(&bytes) {
        return Ok(Pages::look_at(path, 1)?.first.text);
    }
    file.read_to_end(&mut bytes).map_err(read)?;
    Ok(String::from_utf8(bytes).ok())
}

impl Bare {
    /// Reads a page.
    fn read(&self, file: &mut BufReader<File>, kind: &Kind, page: usize) -> Result<Voxels, Fault> {
        let start = self.first_byte + kind.bytes() * page as u64;
        let cut = |error: std::io::Error| Fault::Invalid(format!("page {page}: {error}"));
        file.seek(SeekFrom::Start(start)).map_err(cut)?;
        let layout = Layout {
            voxel_type: self.voxel_type,
            endian: self.endian,
            count: kind.width * kind.height,
        };
        Ok(decode::binary(&mut file.take(kind.bytes()), &layout)?)
    }
}

impl Pages {
    /// Finds the pages behind the first, if ImageJ says that there are so many images and they fit in the file.
    fn find_bare(
        &mut self,
        decoder: &mut Decoder<BufReader<File>>,
        images: usize,
    ) -> Result<(), Fault> {
        let fault = |error| fault_of_page(0, &error);
        let mut number = |tag| decoder.find_tag_unsigned::<u16>(tag).map_err(fault);
        let (compression, format) = (number(Tag::Compression)?, number(Tag::SampleFormat)?);
        let strips = decoder
            .find_tag_unsigned_vec::<u64>(Tag::StripOffsets)
            .map_err(fault)?;
        let plain = CompressionMethod::None.to_u16();
        let voxel_type = match (self.kind.bits, format.unwrap_or(1)) {
            (8, 1) => VoxelType::U8,
            (16, 1) => VoxelType::U16,
            (16, 2) => VoxelType::I16,
            (32, 3) => VoxelType::F32,
            _ => return Ok(()),
        };
        let (1, Some(&[first_byte]), true) = (
            self.kind.components,
            strips.as_deref(),
            compression.unwrap_or(plain) == plain,
        ) else {
            return Ok(());
        };
        let needed = self.kind.bytes().saturating_mul(images as u64);
        if first_byte.saturating_add(needed) <= self.held {
            self.count = images;
            self.bare = Some(Bare {
                first_byte,
                endian: match decoder.byte_order() {
                    ByteOrder::LittleEndian => Endian::Little,
                    ByteOrder::BigEndian => Endian::Big,
                },
                voxel_type,
            });
        }
        Ok(())
    }
}

fn look_at(file: File, held: u64, files: usize) -> Result<Pages, Fault> {
    let limits = limits(held);
    let mut decoder = opened(file, limits.clone())?;
    let kind = kind_of(&mut decoder, 0)?;
    let bytes = kind.bytes();
    let mut pages = Pages {
        kind,
        count: 0,
        held,
        first: first_page(&mut decoder)?,
        bare: None,
        limits,
    };
    let mut promised = 0u64;
    loop {
        promised = promised.saturating_add(bytes);
        check_promise(promised, held, &mut decoder)?;
        pages.count += 1;
        if !decoder.more_images() {
            break;
        }
        decoder
            .next_image()
            .map_err(|error| fault_of_page(pages.count, &error))?;
        if kind_of(&mut decoder, pages.count)? != kind {
            let (page, other) = (pages.count, kind_of(&mut decoder, pages.count)?);
            return Err(unsupported(format!(
                "page {page} has {other}, page 0 has {kind}: all slices of a stack must be alike (previews and \
                 pyramids are not read)"
            )));
        }
    }
    if let (1, Some(images)) = (pages.count, notes::images_of_image_j(&pages.first)) {
        pages.find_bare(&mut decoder, images)?;
    }
    if files > 1 && pages.count > 1 {
        let count = pages.count;
        return Err(unsupported(format!(
            "{count} pages, but it is one of {files} files: give a single file of many pages, or files of one page"
        )));
    }
    // The promise was held to the length of the file, so the page can be allocated.
    let page_bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    pages.limits.decoding_buffer_size = pages.limits.decoding_buffer_size.max(page_bytes);
    pages.limits.intermediate_buffer_size = pages.limits.decoding_buffer_size;
    Ok(pages)
}

/// The most that the decoder may allocate before the size of a page is checked: tags cannot be longer than the file, and each
/// of their numbers, of at least one byte, takes up to 32 bytes when it is unpacked.
fn limits(held: u64) -> Limits {
    let tag_bytes = usize::try_from(held.min(MAX_TAG_BYTES)).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.ifd_value_size = tag_bytes;
    limits.decoding_buffer_size = tag_bytes.saturating_mul(32);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    limits
}

fn opened(file: File, limits: Limits) -> Result<Decoder<BufReader<File>>, Fault> {
    let decoder = Decoder::new(BufReader::new(file)).map_err(|error| fault_of_page(0, &error))?;
    Ok(decoder.with_limits(limits))
}

fn kind_of(decoder: &mut Decoder<BufReader<File>>, page: usize) -> Result<Kind, Fault> {
    let fault = |error| fault_of_page(page, &error);
    let photometric = decoder
        .find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)
        .map_err(fault)?;
    if photometric == Some(PhotometricInterpretation::RGBPalette.to_u16()) {
        return Err(colour(page, "colours of a palette"));
    }
    let (width, height) = decoder.dimensions().map_err(fault)?;
    let (bits, components) = match decoder.colortype().map_err(fault)? {
        ColorType::Gray(bits @ (8 | 16 | 32 | 64)) => (bits, 1),
        ColorType::Gray(bits) => {
            return Err(unsupported(format!(
                "page {page} has {bits} bits per value: save it with 8, 16 or 32"
            )));
        }
        ColorType::RGB(bits @ (8 | 16)) => (bits, 3),
        ColorType::RGBA(bits @ (8 | 16)) => (bits, 4),
        ColorType::Multiband { num_samples, .. } => {
            return Err(colour(page, &format!("{num_samples} values per pixel")));
        }
        ColorType::GrayA(_) => return Err(colour(page, "an alpha channel")),
        _ => {
            return Err(colour(
                page,
                "colours that are no red, green and blue of 8 or 16 bits",
            ));
        }
    };
    let planes = decoder
        .find_tag_unsigned::<u16>(Tag::PlanarConfiguration)
        .map_err(fault)?;
    if components > 1 && planes == Some(PlanarConfiguration::Planar.to_u16()) {
        return Err(unsupported(format!(
            "page {page} has its colours one behind the other: save them pixel by pixel"
        )));
    }
    Ok(Kind {
        width: width as usize,
        height: height as usize,
        bits,
        components,
    })
}

fn colour(page: usize, what: &str) -> Fault {
    unsupported(format!(
        "page {page} has {what}: convert the stack to grey (8, 16 or 32 bits) or to red, green and blue first"
    ))
}

/// Tags of ImageJ: the lengths of its metadata's entries, and the entries.
const IMAGE_J: [Tag; 2] = [Tag::Unknown(50838), Tag::Unknown(50839)];

/// The notes on the first page. Tags of another type than they must have are ignored: some programs write other things there.
fn first_page(decoder: &mut Decoder<BufReader<File>>) -> Result<FirstPage, Fault> {
    let mut value = |tag: Tag| {
        let value = decoder.find_tag(tag);
        value.map_err(|error| fault_of_page(0, &error))
    };
    let text = value(Tag::ImageDescription)?;
    let lengths = value(IMAGE_J[0])?.and_then(|value| value.into_u32_vec().ok());
    let bytes = value(IMAGE_J[1])?.and_then(|value| value.into_u8_vec().ok());
    let mut resolution = [None; 2];
    for (place, tag) in [(0, Tag::XResolution), (1, Tag::YResolution)] {
        resolution[place] = match value(tag)? {
            Some(::tiff::decoder::ifd::Value::Rational(count, length)) => {
                Some(f64::from(count) / f64::from(length))
            }
            _ => None,
        };
    }
    Ok(FirstPage {
        text: text.and_then(|value| value.into_string().ok()),
        resolution,
        image_j: bytes.zip(lengths),
    })
}

/// Compares the bytes that all pages so far promise with what the file can hold.
fn check_promise(
    promised: u64,
    held: u64,
    decoder: &mut Decoder<BufReader<File>>,
) -> Result<(), Fault> {
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression);
    let compression = compression.map_err(|error| fault_of_page(0, &error))?;
    let is_plain = compression.is_none_or(|method| method == CompressionMethod::None.to_u16());
    let possible = if is_plain {
        held
    } else {
        held.saturating_mul(GREATEST_EXPANSION)
    };
    if promised <= possible {
        return Ok(());
    }
    Err(Fault::Invalid(format!(
        "the pages promise {promised} bytes, but a file of {held} bytes holds at most {possible}: it is cut off"
    )))
}

fn numbers(values: DecodingResult) -> Voxels {
    match values {
        DecodingResult::U8(values) => Voxels::U8(values),
        DecodingResult::I8(values) => Voxels::I8(values),
        DecodingResult::U16(values) => Voxels::U16(values),
        DecodingResult::I16(values) => Voxels::I16(values),
        DecodingResult::U32(values) => Voxels::U32(values),
        DecodingResult::I32(values) => Voxels::I32(values),
        DecodingResult::U64(values) => Voxels::F64(values.into_iter().map(|v| v as f64).collect()),
        DecodingResult::I64(values) => Voxels::F64(values.into_iter().map(|v| v as f64).collect()),
        DecodingResult::F16(values) => {
            Voxels::F32(values.into_iter().map(|v| v.to_f32()).collect())
        }
        DecodingResult::F32(values) => Voxels::F32(values),
        DecodingResult::F64(values) => Voxels::F64(values),
    }
}
