//! Stacks of TIFF pictures: one file of many pages, or files of one page.
//!
//! Takes paths in the order of the slices, returns the parts of a volume. A first pass reads the directories only. It holds all pages to
//! the first one and compares the bytes that they promise with what a file of this length can unpack to, so that the second pass, which
//! decodes, allocates no more than that.
//!
//! Spacing is taken from the description of the first page, else it is 1: the resolution alone is meant for printers.
//! ImageJ writes lines such as `slices=27` and `spacing=2.5`; with a `unit`, the resolution of the page is in pixels per
//! that unit. OME writes XML, whose element Pixels has the physical size of a voxel. Both say how many channels and
//! times there are, and more than one of either is refused. Source: TIFF 6.0 and BigTIFF; the decoder is the crate `tiff`.
//! Limits: grey values of 8 to 64 bits, half precision included; of colours of 8 or 16 bits one component, interleaved; no palettes;
//! one channel, one time.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_io::Gate;
use resample_io::tiff::GREATEST_EXPANSION;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, PlanarConfiguration, Tag};
use tiff::{ColorType, TiffError};

use crate::Error;
use crate::input::decode::component::chosen;
use crate::input::file::{Fault, excerpt, unsupported};
use crate::input::{Parts, cannot_read, decode, invalid, open};
use crate::volume::{Lattice, Voxels};

pub(crate) use resample_io::tiff::begins;

/// How many slices a TIFF file holds; `None` where it holds no slices of a volume, such as colours of a palette.
pub fn pages_of(path: &Path) -> Option<usize> {
    Pages::look_at(path, 1).ok().map(|pages| pages.count)
}

/// How many colours a pixel has; `None` where it is grey.
pub(crate) fn colours(paths: &[PathBuf]) -> Result<Option<usize>, Error> {
    let Some(first) = paths.first() else {
        return Ok(None);
    };
    let components = Pages::look_at(first, paths.len())?.kind.components;
    Ok((components > 1).then_some(components))
}

/// Reads the slices of one file or of several; of colours, the chosen components.
pub(crate) fn load(paths: &[PathBuf], components: &[usize], gate: &Gate) -> Result<Parts, Error> {
    let mut stack: Option<Stack> = None;
    let mut bytes = 0u64;
    for path in paths {
        let pages = Pages::look_at(path, paths.len())?;
        bytes = bytes.saturating_add(pages.bytes());
        let asked = gate
            .ask_unpacked(pages.bytes(), pages.held, "the pages")
            .and_then(|()| gate.ask(bytes, "the slices"));
        asked.map_err(|what| invalid(path, what))?;
        let chosen = chosen(components, pages.kind.components).map_err(|fault| fault.at(path))?;
        match &mut stack {
            None => stack = Some(Stack::begin(&pages, path, chosen)?),
            Some(stack) => stack.add(&pages, path)?,
        }
    }
    let stack = stack.ok_or_else(|| invalid(Path::new(""), "no slices"))?;
    Ok(Parts {
        lattice: Lattice {
            // Rows run from the top of a picture down.
            up_hint: Some(DVec3::NEG_Y),
            ..Lattice::unnamed(
                [stack.kind.width, stack.kind.height, stack.depth],
                decode::upright(stack.spacing, [0.0; 3]),
            )
        },
        voxels: stack.voxels,
    })
}

/// The slices read so far.
struct Stack {
    kind: Kind,
    /// The components that are read.
    chosen: Vec<usize>,
    depth: usize,
    voxels: Vec<Voxels>,
    spacing: [f64; 3],
}

impl Stack {
    fn begin(pages: &Pages, path: &Path, chosen: Vec<usize>) -> Result<Self, Error> {
        let spacing = pages.spacing().map_err(|fault| fault.at(path))?;
        Ok(Self {
            kind: pages.kind,
            depth: pages.count,
            voxels: pages.decode(path, &chosen)?,
            chosen,
            spacing,
        })
    }

    fn add(&mut self, pages: &Pages, path: &Path) -> Result<(), Error> {
        if pages.kind != self.kind {
            let what = format!(
                "a slice of {}, but the slices before it are {}",
                pages.kind, self.kind
            );
            return Err(invalid(path, what));
        }
        let slices = pages.decode(path, &self.chosen)?;
        for (voxels, slices) in self.voxels.iter_mut().zip(slices) {
            if !decode::same_type(voxels, &slices) {
                return Err(invalid(
                    path,
                    "a slice of another number type than the slices before it",
                ));
            }
            decode::append(voxels, slices);
        }
        self.depth += pages.count;
        Ok(())
    }
}

/// Size and type of a page; all pages of a stack have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    /// Pixels.
    pub(crate) width: usize,
    /// Pixels.
    pub(crate) height: usize,
    /// Bits of a number.
    pub(crate) bits: u8,
    /// Numbers of a pixel: 1, or 3 and 4 of colours.
    pub(crate) components: usize,
}

impl Kind {
    /// Bytes of a page.
    fn bytes(self) -> u64 {
        let numbers = self.width as u64 * self.height as u64 * self.components as u64;
        numbers.saturating_mul(u64::from(self.bits / 8))
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{}x{} pixels of {} bits",
            self.width, self.height, self.bits
        )?;
        match self.components {
            1 => Ok(()),
            components => write!(f, " in {components} colours"),
        }
    }
}

/// The facts of a file's directories.
struct Pages {
    pub(crate) kind: Kind,
    pub(crate) count: usize,
    /// Length of the file, bytes.
    pub(crate) held: u64,
    /// ImageDescription of the first page.
    description: Option<String>,
    /// Pixels per unit of length along x and y, where the first page says so.
    resolution: [Option<f64>; 2],
    limits: Limits,
}

/// Longest tag that is kept in memory, far above the descriptions of OME files. A guess.
const MAX_TAG_BYTES: u64 = 1 << 26;

impl Pages {
    /// Reads the directories of a file that is one of `files`.
    fn look_at(path: &Path, files: usize) -> Result<Self, Error> {
        let file = open(path)?;
        let held = file
            .metadata()
            .map_err(|source| cannot_read(path, source))?
            .len();
        look_at(file, held, files).map_err(|fault| fault.at(path))
    }

    /// Bytes of all pages, unpacked.
    pub(crate) fn bytes(&self) -> u64 {
        self.kind.bytes().saturating_mul(self.count as u64)
    }

    /// World distance between voxels along x, y and z.
    pub(crate) fn spacing(&self) -> Result<[f64; 3], Fault> {
        let text = self.description.as_deref().unwrap_or_default();
        spacing(text, self.resolution, self.count)
    }

    /// Some components of all pages, one page after the other.
    fn decode(&self, path: &Path, chosen: &[usize]) -> Result<Vec<Voxels>, Error> {
        self.decode_pages(open(path)?, chosen)
            .map_err(|fault| fault.at(path))
    }

    fn decode_pages(&self, file: File, chosen: &[usize]) -> Result<Vec<Voxels>, Fault> {
        let mut decoder = opened(file, self.limits.clone())?;
        let mut voxels: Vec<Voxels> = Vec::new();
        for page in 0..self.count {
            let fault = |error| fault_of_page(page, &error);
            if page > 0 {
                decoder.next_image().map_err(fault)?;
            }
            let part = numbers(decoder.read_image().map_err(fault)?);
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
                    "page {page} has another number type than page 0"
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

fn look_at(file: File, held: u64, files: usize) -> Result<Pages, Fault> {
    let limits = limits(held);
    let mut decoder = opened(file, limits.clone())?;
    let kind = kind_of(&mut decoder, 0)?;
    let bytes = kind.bytes();
    let mut pages = Pages {
        kind,
        count: 0,
        held,
        description: None,
        resolution: [None; 2],
        limits,
    };
    (pages.description, pages.resolution) = notes(&mut decoder)?;
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

/// Description and resolution of the first page.
fn notes(
    decoder: &mut Decoder<BufReader<File>>,
) -> Result<(Option<String>, [Option<f64>; 2]), Fault> {
    let fault = |error| fault_of_page(0, &error);
    let text = decoder.find_tag(Tag::ImageDescription).map_err(fault)?;
    // Some programs write other text here; it is ignored.
    let text = text.and_then(|value| value.into_string().ok());
    let mut resolution = [None; 2];
    for (place, tag) in [(0, Tag::XResolution), (1, Tag::YResolution)] {
        resolution[place] = match decoder.find_tag(tag).map_err(fault)? {
            Some(::tiff::decoder::ifd::Value::Rational(count, length)) => {
                Some(f64::from(count) / f64::from(length))
            }
            _ => None,
        };
    }
    Ok((text, resolution))
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

fn fault_of_page(page: usize, error: &TiffError) -> Fault {
    let what = format!("page {page}: {error}");
    match error {
        TiffError::UnsupportedError(_) => Fault::Unsupported(what),
        _ => Fault::Invalid(what),
    }
}

/// World distance between voxels along x, y and z: 1 where nothing is known.
///
/// `resolution` is in pixels per unit; `pages` is the number of pages in the file.
pub(crate) fn spacing(
    text: &str,
    resolution: [Option<f64>; 2],
    pages: usize,
) -> Result<[f64; 3], Fault> {
    if text.starts_with("ImageJ=") {
        return image_j(text, resolution, pages);
    }
    if text.trim_start().starts_with('<') && text.contains("<OME") {
        return ome(text);
    }
    Ok([1.0; 3])
}

fn image_j(text: &str, resolution: [Option<f64>; 2], pages: usize) -> Result<[f64; 3], Fault> {
    let value = |key: &str| {
        let found = text
            .lines()
            .filter_map(|line| line.split_once('='))
            .find(|(name, _)| name.trim() == key);
        found.map(|(_, value)| value.trim())
    };
    let count = |key: &str| {
        value(key)
            .and_then(|text| text.parse::<usize>().ok())
            .unwrap_or(1)
    };
    refuse_many(count("channels"), count("frames"))?;
    let images = count("images");
    if images > pages {
        return Err(unsupported(format!(
            "ImageJ says {images} images, but the file lists {pages}, as it does for stacks beyond 4 GB: \
             save it as BigTIFF, NRRD or as single slices"
        )));
    }
    let mut spacing = [1.0; 3];
    if value("unit").is_some_and(|unit| !unit.is_empty() && unit != "pixel") {
        for (length, per_unit) in spacing.iter_mut().zip(resolution) {
            *length = per_unit
                .map(|per_unit| 1.0 / per_unit)
                .filter(is_length)
                .unwrap_or(1.0);
        }
    }
    if let Some(text) = value("spacing") {
        let parsed = text.parse().map(f64::abs).ok().filter(is_length);
        spacing[2] = parsed
            .ok_or_else(|| format!("spacing={}: expected a length above 0", excerpt(text)))?;
    }
    Ok(spacing)
}

fn ome(text: &str) -> Result<[f64; 3], Fault> {
    let document = roxmltree::Document::parse(text)
        .map_err(|error| format!("the OME description is broken XML: {error}"))?;
    let Some(pixels) = document
        .descendants()
        .find(|node| node.has_tag_name("Pixels"))
    else {
        return Ok([1.0; 3]);
    };
    let count = |name: &str| {
        pixels
            .attribute(name)
            .and_then(|text| text.parse::<usize>().ok())
            .unwrap_or(1)
    };
    refuse_many(count("SizeC"), count("SizeT"))?;
    let length = |name: &str| {
        let parsed = pixels.attribute(name).and_then(|text| text.parse().ok());
        parsed.filter(is_length).unwrap_or(1.0)
    };
    Ok(["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"].map(length))
}

fn refuse_many(channels: usize, times: usize) -> Result<(), Fault> {
    if channels <= 1 && times <= 1 {
        return Ok(());
    }
    Err(unsupported(format!(
        "{channels} channel(s) and {times} time(s): save one channel at one time as a stack of its own"
    )))
}

fn is_length(length: &f64) -> bool {
    *length > 0.0 && length.is_finite()
}

#[cfg(test)]
mod tests;
