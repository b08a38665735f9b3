//! Attributes: differences from element to element, byte plane by byte plane.
//!
//! A block of up to 256 elements holds a plane for each byte of an element; a plane is groups of 16 differences, each group
//! with as many bits as its largest needs. Version 1 leaves planes out that are zero, and takes differences of 16 bits, or of
//! 32 by exclusive or, as well as of 8.
//! Source: `KHR_meshopt_compression`, "Mode 0: attributes".

use crate::input::gltf::compressed::meshopt::stream::{Stream, signed};

/// Most elements of a block.
const BLOCK: usize = 256;

/// Most bytes of the planes of a block.
const BLOCK_BYTES: usize = 8192;

/// Differences of a group.
const GROUP: usize = 16;

/// Least bytes behind the blocks, by version: the first element, how each channel is coded, and padding.
const LEAST_TAIL: [usize; 2] = [32, 24];

/// How the differences of 4 bytes are coded.
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    Words,
    /// By exclusive or, turned right by so many bits.
    Bits(u32),
}

pub(super) fn decode(stream: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (&header, body) = stream.split_first().ok_or("it is empty")?;
    let version = match header {
        0xa0 => 0,
        0xa1 => 1,
        _ => return Err(format!("attributes of an unknown version, {header:#04x}")),
    };
    let channels_at = stride;
    let tail_bytes = stride + version * stride / 4;
    let padded = tail_bytes.max(LEAST_TAIL[version]);
    let blocks = body.len().checked_sub(padded).ok_or("it is cut")?;
    let (blocks, tail) = body.split_at(blocks);
    let tail = &tail[padded - tail_bytes..];
    let channels = match version {
        0 => vec![Channel::Bytes; stride / 4],
        _ => tail[channels_at..]
            .iter()
            .map(|&code| channel(code))
            .collect::<Result<_, String>>()?,
    };
    let mut previous = tail[..stride].to_vec();
    let mut stream = Stream { left: blocks };
    let in_block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let mut elements = vec![0; count * stride];
    let mut planes = vec![[0; BLOCK]; stride];
    for block in elements.chunks_mut(in_block * stride) {
        let count = block.len() / stride;
        let controls = match version {
            0 => &[],
            _ => stream.take(stride / 4)?,
        };
        for (byte, plane) in planes.iter_mut().enumerate() {
            // Two bits for each plane.
            let control = controls.get(byte / 4).map(|c| (c >> (byte % 4 * 2)) & 3);
            read_plane(&mut stream, control, count, plane)?;
        }
        undo_differences(&planes, &channels, &mut previous, block);
    }
    stream.check_end()?;
    Ok(elements)
}

fn channel(code: u8) -> Result<Channel, String> {
    match code & 3 {
        0 => Ok(Channel::Bytes),
        1 => Ok(Channel::Words),
        2 => Ok(Channel::Bits(u32::from(code >> 4))),
        _ => Err("a channel of an unknown kind".into()),
    }
}

/// Reads the first `count` differences of a plane; `control` is that of version 1.
fn read_plane(
    stream: &mut Stream,
    control: Option<u8>,
    count: usize,
    plane: &mut [u8; BLOCK],
) -> Result<(), String> {
    // Bits of a difference, by the two bits of its group.
    let widths: [u32; 4] = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            plane.fill(0);
            return Ok(());
        }
        Some(_) => {
            plane[..count].copy_from_slice(stream.take(count)?);
            return Ok(());
        }
    };
    let groups = count.div_ceil(GROUP);
    let header = stream.take(groups.div_ceil(4))?;
    for (index, group) in plane.chunks_exact_mut(GROUP).take(groups).enumerate() {
        let width = widths[usize::from((header[index / 4] >> (index % 4 * 2)) & 3)];
        read_group(stream, width, group)?;
    }
    Ok(())
}

/// Reads a group of differences of `width` bits; the largest of such a number means that the difference follows as a byte.
fn read_group(stream: &mut Stream, width: u32, group: &mut [u8]) -> Result<(), String> {
    match width {
        0 => group.fill(0),
        8 => group.copy_from_slice(stream.take(GROUP)?),
        _ => {
            let codes = stream.take(GROUP * width as usize / 8)?;
            let escape = (1u8 << width) - 1;
            let in_byte = 8 / width as usize;
            for (index, difference) in group.iter_mut().enumerate() {
                let place = index % in_byte;
                // Single bits begin with the lowest of a byte, wider ones with the highest.
                let place = if width == 1 {
                    place
                } else {
                    in_byte - 1 - place
                };
                let code = (codes[index / in_byte] >> (place * width as usize)) & escape;
                *difference = if code == escape { stream.byte()? } else { code };
            }
        }
    }
    Ok(())
}

/// Adds the differences to the element before each.
fn undo_differences(
    planes: &[[u8; BLOCK]],
    channels: &[Channel],
    previous: &mut [u8],
    block: &mut [u8],
) {
    for (at, element) in block.chunks_exact_mut(previous.len()).enumerate() {
        let of_channels = element
            .chunks_exact_mut(4)
            .zip(previous.chunks_exact_mut(4));
        let planes = planes.chunks_exact(4).zip(channels);
        for ((to, from), (planes, channel)) in of_channels.zip(planes) {
            let differences = [planes[0][at], planes[1][at], planes[2][at], planes[3][at]];
            let before = [from[0], from[1], from[2], from[3]];
            let after = match channel {
                Channel::Bytes => {
                    let sum = |i: usize| {
                        let [difference, ..] = signed(u32::from(differences[i])).to_le_bytes();
                        before[i].wrapping_add(difference)
                    };
                    [sum(0), sum(1), sum(2), sum(3)]
                }
                Channel::Words => {
                    let word = |of: [u8; 4], i: usize| u16::from_le_bytes([of[i], of[i + 1]]);
                    let sum = |i: usize| {
                        let difference = signed(u32::from(word(differences, i))).to_le_bytes();
                        let difference = u16::from_le_bytes([difference[0], difference[1]]);
                        word(before, i).wrapping_add(difference).to_le_bytes()
                    };
                    let ([a, b], [c, d]) = (sum(0), sum(2));
                    [a, b, c, d]
                }
                Channel::Bits(turn) => {
                    let turned = u32::from_le_bytes(differences).rotate_right(*turn);
                    (u32::from_le_bytes(before) ^ turned).to_le_bytes()
                }
            };
            to.copy_from_slice(&after);
            from.copy_from_slice(&after);
        }
    }
}
