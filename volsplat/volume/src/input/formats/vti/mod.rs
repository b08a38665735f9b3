//! VTK ImageData in XML, `.vti`.
//!
//! Takes a path, returns the parts of a volume. The XML (`head.rs`) says how the image lies and which arrays it has; one
//! array is chosen, and its data stands in the XML or in a part appended to it, as text, base64 or plain
//! bytes, compressed by zlib or not. The source is the chapter on XML formats in the VTK User's Guide.
//!
//! Binary data begins with its length, or, where compressed, with the number of blocks, the size of a block and of the
//! last one, and the packed size of each. These numbers must give the size of the image and must fit into
//! the file; only then is anything unpacked. Base64 is padded at the end of the header and again at the end of the data, so every four
//! characters are decoded on their own.
//! Limits: one piece; data at points or in cells (a cell's value stands at its centre); no LZ4 and no LZMA.

mod head;
mod pieces;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::{io, vec};

use resample_core::narrow::count;
use resample_io::Gate;

use crate::Error;
use crate::input::decode::component::Interleaved;
use crate::input::decode::{Layout, component};
use crate::input::file::{Fault, excerpt};
use crate::input::formats::vti::head::{Image, Packing, Source, Text};
use crate::input::formats::zarr::codecs::lz4_block;
use crate::input::options::LoadOptions;
use crate::input::{Parts, decode, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, voxel_count};

/// The element that holds appended data; everything before it is XML.
const APPENDED: &[u8] = b"<AppendedData";

/// The remark where values stand in cells.
pub(crate) const CELLS_REMARK: &str =
    "its values are those of cells and stand at their centres, half a step beside the points";

/// The remark where a file has several arrays and the caller has not chosen one of them.
pub(crate) fn others_remark(read: &str, arrays: &[String]) -> Option<String> {
    let others: Vec<String> = arrays
        .iter()
        .filter(|name| *name != read)
        .map(|name| excerpt(name))
        .collect();
    (!others.is_empty()).then(|| {
        format!(
            "the array {} is read, there is also {}: FILE#array=NAME names another",
            excerpt(read),
            others.join(", ")
        )
    })
}

/// Returns true if a file that begins with `head` is XML of VTK, of any kind of data.
pub(crate) fn begins(head: &[u8]) -> bool {
    let head = head
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(head)
        .trim_ascii_start();
    head.starts_with(b"<") && head.windows(8).any(|window| window == b"<VTKFile")
}

pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let Some(files) = pieces::files(path, &options.gate)? else {
        return load_one(path, options, components);
    };
    let read = |file: &PathBuf| load_one(file, options, components);
    let parts = files
        .iter()
        .map(read)
        .collect::<Result<Vec<Parts>, Error>>()?;
    pieces::joined(parts, &options.gate).map_err(|fault| fault.at(path))
}

fn load_one(path: &Path, options: &LoadOptions, components: &[usize]) -> Result<Parts, Error> {
    let (mut file, held) = open_sized(path)?;
    read(&mut file, held, options, components).map_err(|fault| fault.at(path))
}

/// The file itself, or the first piece that an index names.
fn first_piece(path: &Path) -> Result<PathBuf, Error> {
    let files = pieces::files(path, &Gate::default())?;
    let first = files.into_iter().flatten().next();
    Ok(first.unwrap_or_else(|| path.to_owned()))
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path, array: Option<&str>) -> Result<Option<usize>, Error> {
    let path = &first_piece(path)?;
    let (mut file, _) = open_sized(path)?;
    let image = XmlText::read(&mut file)
        .and_then(|text| head::parse(&text.xml, array))
        .map_err(|fault| fault.at(path))?;
    Ok(Some(image.components).filter(|_| image.voxel_type == VoxelType::U8))
}

/// The names of all arrays of a file.
pub(crate) fn array_names(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    let path = &first_piece(path)?;
    let (mut file, _) = open_sized(path)?;
    XmlText::read(&mut file)
        .and_then(|text| head::array_names(&text.xml))
        .map_err(|fault| fault.at(path))
}

fn read(
    file: &mut File,
    held: u64,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Fault> {
    let gate = &options.gate;
    let text = XmlText::read(file)?;
    let image = head::parse(&text.xml, options.array.as_deref())?;
    let chosen = component::chosen(components, image.components)?;
    gate.ask_unpacked(bytes(&image)?, held, "the voxels")?;
    if image.is_of_cells {
        gate.remark(CELLS_REMARK.to_owned());
    }
    if options.array.is_none() {
        others_remark(&image.array, &image.arrays)
            .into_iter()
            .for_each(|remark| gate.remark(remark));
    }
    let voxels = match &image.source {
        Source::Inline(content) => inline(content, &image, chosen)?,
        Source::Appended { offset } => {
            let tag = text
                .appended
                .ok_or_else(|| "format is appended, but there is no AppendedData".to_owned())?;
            let begin = tag.begin.saturating_add(*offset);
            file.seek(SeekFrom::Start(begin))
                .map_err(|error| decode::broken(&error))?;
            let held = held.saturating_sub(begin);
            appended(file, held, &tag.encoding, &image, chosen)?
        }
    };
    Ok(Parts {
        lattice: Lattice::unnamed(image.dims, image.world_from_index),
        voxels,
    })
}

/// The appended data of an array, `held` bytes from where the file stands.
fn appended(
    file: &mut File,
    held: u64,
    encoding: &str,
    image: &Image,
    chosen: Vec<usize>,
) -> Result<Vec<Voxels>, Fault> {
    let reader = BufReader::new(file);
    match encoding {
        "raw" => binary(reader, held, image, chosen),
        "base64" => {
            let unpacked = Base64Reader::new(reader);
            binary(unpacked, held / 4 * 3, image, chosen)
        }
        other => Err(Fault::Invalid(format!(
            "AppendedData has encoding '{other}': expected raw or base64"
        ))),
    }
}

/// The XML of the file, closed where appended data was cut off.
struct XmlText {
    xml: String,
    appended: Option<AppendedTag>,
}

/// The element of the appended data.
struct AppendedTag {
    encoding: String,
    /// Where the data begins in the file, behind the underscore.
    begin: u64,
}

/// Bytes that are searched at a time. A guess.
const PIECE_BYTES: u64 = 1 << 16;

/// Longest tag `<AppendedData ...>` and white space up to the underscore. A guess far beyond what writers produce.
const MAX_TAG_BYTES: usize = 4096;

impl XmlText {
    /// Reads up to the appended data, or to the end of the file.
    fn read(file: &mut File) -> Result<Self, Fault> {
        let mut bytes = Vec::new();
        let mut found = None;
        while found.is_none() {
            // The word can lie across two pieces.
            let searched = bytes.len().saturating_sub(APPENDED.len());
            let got = (&mut *file).take(PIECE_BYTES).read_to_end(&mut bytes);
            if got.map_err(|error| decode::broken(&error))? == 0 {
                break;
            }
            let behind = &bytes[searched..];
            found = behind
                .windows(APPENDED.len())
                .position(|word| word == APPENDED)
                .map(|at| searched + at);
        }
        let Some(at) = found else {
            return Ok(Self {
                xml: utf8(bytes)?,
                appended: None,
            });
        };
        let read = (&mut *file)
            .take(MAX_TAG_BYTES as u64)
            .read_to_end(&mut bytes);
        read.map_err(|error| decode::broken(&error))?;
        let appended = appended_tag(&bytes[at..], at as u64)?;
        bytes.truncate(at);
        bytes.extend_from_slice(b"</VTKFile>");
        Ok(Self {
            xml: utf8(bytes)?,
            appended: Some(appended),
        })
    }
}

fn utf8(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|_| "the XML is not UTF-8".to_owned())
}

/// `tag` begins with `<AppendedData` and stands at byte `at` of the file.
fn appended_tag(tag: &[u8], at: u64) -> Result<AppendedTag, String> {
    let fault = || "AppendedData is cut off: expected '_' and data behind it".to_owned();
    let tag = &tag[..tag.len().min(MAX_TAG_BYTES)];
    let end = tag
        .iter()
        .position(|&byte| byte == b'>')
        .ok_or_else(fault)?;
    let begin = end
        + 1
        + tag[end + 1..]
            .iter()
            .position(|&byte| byte == b'_')
            .ok_or_else(fault)?
        + 1;
    let attributes = String::from_utf8_lossy(&tag[..end]).into_owned();
    let value = attributes
        .split_once("encoding")
        .and_then(|(_, rest)| rest.split(['"', '\'']).nth(1));
    Ok(AppendedTag {
        encoding: value.unwrap_or("base64").to_owned(),
        begin: at + begin as u64,
    })
}

/// Data that stands in the XML.
pub(crate) fn inline(
    content: &Text,
    image: &Image,
    chosen: Vec<usize>,
) -> Result<Vec<Voxels>, Fault> {
    match content {
        Text::Ascii(text) => ascii(text, image, &chosen),
        Text::Base64(text) => {
            let held = text.len() as u64 / 4 * 3;
            binary(Base64Reader::new(text.as_bytes()), held, image, chosen)
        }
    }
}

/// Data as bytes, of which there are at most `held`.
pub(crate) fn binary(
    mut stream: impl Read,
    held: u64,
    image: &Image,
    chosen: Vec<usize>,
) -> Result<Vec<Voxels>, Fault> {
    let (layout, needed) = (layout(image)?, bytes(image)?);
    let interleaved = Interleaved {
        scalar_bytes: image.voxel_type.bytes(),
        components: image.components,
        chosen,
    };
    Ok(match image.packing {
        Packing::None => {
            let promised = number(&mut stream, image)?;
            check_promise(promised, needed, image)?;
            if needed > held {
                return Err(Fault::Invalid(format!(
                    "the array needs {needed} bytes, the file has {held} there"
                )));
            }
            component::read(stream.take(needed), &layout, &interleaved)?
        }
        Packing::Zlib | Packing::Lz4 => {
            let blocks = Blocks::begin(stream, held, image)?;
            check_promise(blocks.total(), needed, image)?;
            decode::check_expansion(needed, held)?;
            component::read(blocks, &layout, &interleaved)?
        }
    })
}

/// Bytes that the values of an image take unpacked.
pub(crate) fn bytes(image: &Image) -> Result<u64, String> {
    let bytes = layout(image)?.bytes()?.checked_mul(image.components as u64);
    bytes.ok_or_else(|| "the image takes more bytes than can be counted".to_owned())
}

fn layout(image: &Image) -> Result<Layout, String> {
    Ok(Layout {
        voxel_type: image.voxel_type,
        endian: image.endian,
        count: voxel_count(image.dims)?,
    })
}

fn ascii(text: &str, image: &Image, chosen: &[usize]) -> Result<Vec<Voxels>, Fault> {
    let layout = layout(image)?;
    if image.components == 1 {
        return Ok(vec![decode::text(&mut text.as_bytes(), &layout)?]);
    }
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let needed = layout.count.checked_mul(image.components);
    if needed != Some(words.len()) {
        let (count, components, held) = (layout.count, image.components, words.len());
        return Err(Fault::Invalid(format!(
            "{count} x {components} values are needed, {held} are there"
        )));
    }
    let decoded = chosen.iter().map(|&component| {
        let own = words.iter().skip(component).step_by(image.components);
        let own: Vec<&str> = own.copied().collect();
        Ok(decode::text(&mut own.join(" ").as_bytes(), &layout)?)
    });
    decoded.collect()
}

fn check_promise(promised: u64, needed: u64, image: &Image) -> Result<(), String> {
    if promised == needed {
        return Ok(());
    }
    let ([x, y, z], name, components) = (image.dims, image.voxel_type.name(), image.components);
    Err(format!(
        "the array '{}' begins with the length {promised}, but {x}x{y}x{z} values of {components} x {name} are \
         {needed} bytes: check Extent, type, NumberOfComponents, header_type and byte_order",
        image.array
    ))
}

/// One number of the header in front of binary data.
fn number(stream: &mut dyn Read, image: &Image) -> Result<u64, String> {
    let mut bytes = [0; 8];
    let used = &mut bytes[..image.header_bytes];
    stream
        .read_exact(used)
        .map_err(|error| decode::broken(&error))?;
    if image.endian == Endian::Big {
        used.reverse();
    }
    Ok(u64::from_le_bytes(bytes))
}

/// LZ4 expands at most so many times: a byte of a length adds 255.
const LZ4_EXPANSION: u64 = 255;

/// Data packed in blocks, as a stream of the unpacked bytes.
struct Blocks<R> {
    stream: R,
    packing: Packing,
    /// Packed sizes of the blocks that are not read yet.
    packed: vec::IntoIter<u64>,
    /// Unpacked size of a block, and of the last one.
    block_bytes: u64,
    last_bytes: u64,
    /// The unpacked block, read up to `at`.
    block: Vec<u8>,
    at: usize,
}

impl<R: Read> Blocks<R> {
    /// Reads the header in front of the blocks and checks it against the bytes there.
    fn begin(mut stream: R, held: u64, image: &Image) -> Result<Self, String> {
        let blocks = number(&mut stream, image)?;
        let block_bytes = number(&mut stream, image)?;
        let partial_bytes = number(&mut stream, image)?;
        if blocks
            .checked_mul(image.header_bytes as u64)
            .is_none_or(|bytes| bytes > held)
        {
            return Err(format!(
                "the array promises {blocks} packed blocks, which the {held} bytes there cannot list"
            ));
        }
        let packed = (0..blocks)
            .map(|_| number(&mut stream, image))
            .collect::<Result<Vec<u64>, _>>()?;
        let total = packed
            .iter()
            .try_fold(0u64, |sum, &bytes| sum.checked_add(bytes));
        if total.is_none_or(|total| total > held) {
            return Err(format!(
                "the packed blocks are longer than the {held} bytes there: the file is cut off"
            ));
        }
        let last_bytes = if partial_bytes == 0 {
            block_bytes
        } else {
            partial_bytes
        };
        Ok(Self {
            stream,
            packing: image.packing,
            packed: packed.into_iter(),
            block_bytes,
            last_bytes,
            block: Vec::new(),
            at: 0,
        })
    }

    /// Unpacked bytes of all blocks; a forged sum saturates, and then fits no image.
    fn total(&self) -> u64 {
        match self.packed.len() as u64 {
            0 => 0,
            blocks => (blocks - 1)
                .saturating_mul(self.block_bytes)
                .saturating_add(self.last_bytes),
        }
    }

    fn refill(&mut self) -> io::Result<()> {
        let Some(packed) = self.packed.next() else {
            return Ok(());
        };
        let expected = if self.packed.len() == 0 {
            self.last_bytes
        } else {
            self.block_bytes
        };
        let mut bytes = Vec::new();
        (&mut self.stream).take(packed).read_to_end(&mut bytes)?;
        self.block.clear();
        self.at = 0;
        match self.packing {
            Packing::Lz4 => {
                let faulty = |what| io::Error::new(io::ErrorKind::InvalidData, what);
                if expected > bytes.len() as u64 * LZ4_EXPANSION {
                    return Err(faulty("a block is too short for its size".to_owned()));
                }
                self.block.resize(count(expected), 0);
                lz4_block(&bytes, &mut self.block).map_err(faulty)?;
            }
            Packing::Zlib | Packing::None => {
                let decoder = flate2::bufread::ZlibDecoder::new(bytes.as_slice());
                decoder
                    .take(expected.saturating_add(1))
                    .read_to_end(&mut self.block)?;
            }
        }
        if self.block.len() as u64 == expected {
            return Ok(());
        }
        let held = self.block.len();
        Err(io::Error::new(
            io::ErrorKind::InvalidData,
            format!("a block unpacks to {held} bytes, not {expected}"),
        ))
    }
}

impl<R: Read> Read for Blocks<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        while self.at == self.block.len() && self.packed.len() > 0 {
            self.refill()?;
        }
        let count = bytes.len().min(self.block.len() - self.at);
        bytes[..count].copy_from_slice(&self.block[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

/// Unpacks base64; the end of the text, or a `<`, is the end of the bytes.
struct Base64Reader<R> {
    text: R,
    /// Unpacked bytes of the last four characters that were not asked for yet: `ready[at..end]`.
    ready: [u8; 3],
    at: usize,
    end: usize,
}

impl<R: BufRead> Base64Reader<R> {
    pub(crate) fn new(text: R) -> Self {
        Self {
            text,
            ready: [0; 3],
            at: 0,
            end: 0,
        }
    }

    /// Decodes the next four characters; `end` stays at `at` where the text ends.
    fn refill(&mut self) -> io::Result<()> {
        (self.at, self.end) = (0, 0);
        let (mut bits, mut digits, mut padding) = (0u32, 0, 0);
        while digits + padding < 4 {
            let Some(character) = self.next_character()? else {
                return if digits + padding == 0 {
                    Ok(())
                } else {
                    Err(fault("it ends within four characters"))
                };
            };
            match digit(character) {
                Some(value) if padding == 0 => {
                    bits = (bits << 6) | value;
                    digits += 1;
                }
                None if character == b'=' && digits >= 2 => padding += 1,
                _ => return Err(fault("a character that is no base64")),
            }
        }
        bits <<= 6 * padding;
        self.ready = [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8];
        self.end = 3 - padding;
        Ok(())
    }

    fn next_character(&mut self) -> io::Result<Option<u8>> {
        loop {
            let Some(&character) = self.text.fill_buf()?.first() else {
                return Ok(None);
            };
            if character == b'<' {
                return Ok(None);
            }
            self.text.consume(1);
            if !character.is_ascii_whitespace() {
                return Ok(Some(character));
            }
        }
    }
}

impl<R: BufRead> Read for Base64Reader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written < bytes.len() {
            if self.at == self.end {
                self.refill()?;
                if self.end == 0 {
                    break;
                }
            }
            bytes[written] = self.ready[self.at];
            self.at += 1;
            written += 1;
        }
        Ok(written)
    }
}

fn digit(character: u8) -> Option<u32> {
    let value = match character {
        b'A'..=b'Z' => character - b'A',
        b'a'..=b'z' => character - b'a' + 26,
        b'0'..=b'9' => character - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    };
    Some(u32::from(value))
}

fn fault(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("base64 data: {what}"))
}

#[cfg(test)]
mod tests;
