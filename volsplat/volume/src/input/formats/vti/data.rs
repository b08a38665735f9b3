//! The data of one array: from text, base64 or plain bytes to voxels.
//!
//! Binary data begins with its length, or, where compressed, with the number of blocks, the size of a block and of the
//! last one, and the packed size of each. What these numbers promise must be the size of the image and must fit into
//! what the file holds; only then is anything unpacked.

use std::io::Read;
use std::{io, vec};

use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::decode::component::Interleaved;
use crate::input::fault::Fault;
use crate::input::formats::vti::base64::Base64Reader;
use crate::input::formats::vti::head::{Image, Packing, Text};
use crate::volume::{Endian, Voxels, voxel_count};

/// Data that stands in the XML.
pub(crate) fn inline(content: &Text, image: &Image, component: usize) -> Result<Voxels, Fault> {
    match content {
        Text::Ascii(text) => ascii(text, image, component),
        Text::Base64(text) => {
            let held = text.len() as u64 / 4 * 3;
            binary(Base64Reader::new(text.as_bytes()), held, image, component)
        }
    }
}

/// Data as bytes, of which there are at most `held`.
pub(crate) fn binary(
    mut stream: impl Read,
    held: u64,
    image: &Image,
    component: usize,
) -> Result<Voxels, Fault> {
    let (layout, needed) = (layout(image)?, bytes(image)?);
    let interleaved = Interleaved {
        scalar_bytes: image.voxel_type.bytes(),
        components: image.components,
        chosen: component,
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
            decode::component(stream.take(needed), &layout, interleaved)?
        }
        Packing::Zlib => {
            let blocks = Blocks::begin(stream, held, image)?;
            check_promise(blocks.total(), needed, image)?;
            decode::check_expansion(needed, held)?;
            decode::component(blocks, &layout, interleaved)?
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

fn ascii(text: &str, image: &Image, component: usize) -> Result<Voxels, Fault> {
    let layout = layout(image)?;
    if image.components == 1 {
        return Ok(decode::text(&mut text.as_bytes(), &layout)?);
    }
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let needed = layout.count.checked_mul(image.components);
    if needed != Some(words.len()) {
        let (count, components, held) = (layout.count, image.components, words.len());
        return Err(Fault::Invalid(format!(
            "{count} x {components} values are needed, {held} are there"
        )));
    }
    let chosen: Vec<&str> = words
        .into_iter()
        .skip(component)
        .step_by(image.components)
        .collect();
    Ok(decode::text(&mut chosen.join(" ").as_bytes(), &layout)?)
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

/// Data packed in blocks, as a stream of the unpacked bytes.
struct Blocks<R> {
    stream: R,
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
        let decoder = flate2::bufread::ZlibDecoder::new(bytes.as_slice());
        decoder
            .take(expected.saturating_add(1))
            .read_to_end(&mut self.block)?;
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
