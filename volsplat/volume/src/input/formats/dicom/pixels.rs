//! The numbers of a DICOM picture: plain, or packed frame by frame.
//!
//! Takes the elements of a file, returns the stored numbers of each frame, with the bits that do not count removed. Plain
//! data, deflated files and RLE are read here; JPEG (8 bits, and lossless up to 16), JPEG-LS and JPEG 2000 by crates,
//! which check the size of the picture first, and whose panics are caught.
//! A fragment of RLE begins with the number of planes of bytes and where each begins, the most significant bytes first; each is packed like
//! PackBits (DICOM PS3.5, Annex G).

use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::dicom::elements::{Dataset, Meta, PIXEL_DATA, Value};
use crate::input::formats::dicom::header::Kind;
use crate::volume::{Endian, VoxelType, Voxels};

/// How pictures are packed, by the UID of the transfer syntax.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Packing {
    Plain,
    Rle,
    Jpeg,
    JpegLs,
    Jpeg2000,
}

/// Pixels that one packed byte can stand for at most in JPEG, JPEG-LS and JPEG 2000. They can say "nothing here" for large areas;
/// a constant picture of 512x512 takes some 180 bytes, 1500 pixels a byte. A guess ten times beyond that.
const PIXELS_PER_PACKED_BYTE: usize = 1 << 14;

/// The stored numbers of all frames of a file, one item per frame.
pub(crate) fn frames(
    dataset: &Dataset,
    meta: &Meta,
    kind: Kind,
    count: usize,
) -> Result<Vec<Voxels>, Fault> {
    let packing = packing(&meta.syntax)?;
    let value = dataset
        .value(PIXEL_DATA)
        .ok_or_else(|| "the file has no picture".to_owned())?;
    let frames = match (packing, value) {
        (Packing::Plain, Value::Bytes(bytes)) => plain(bytes, meta.endian(), kind, count)?,
        (Packing::Plain, _) | (_, Value::Bytes(_) | Value::Items(_)) => {
            return Err(Fault::Invalid(format!(
                "the picture is not stored as transfer syntax {} says",
                meta.syntax
            )));
        }
        (_, Value::Fragments(fragments)) => {
            let packed = packed_frames(fragments, count)?;
            let frames = packed.iter().enumerate();
            let unpacked = frames.map(|(index, frame)| {
                unpack(packing, frame, kind).map_err(|what| format!("frame {index}: {what}"))
            });
            unpacked.collect::<Result<Vec<Voxels>, String>>()?
        }
    };
    Ok(frames
        .into_iter()
        .map(|frame| counting_bits(frame, kind))
        .collect())
}

fn packing(syntax: &str) -> Result<Packing, Fault> {
    match syntax {
        "1.2.840.10008.1.2"
        | "1.2.840.10008.1.2.1"
        | "1.2.840.10008.1.2.2"
        | "1.2.840.10008.1.2.1.99" => Ok(Packing::Plain),
        "1.2.840.10008.1.2.5" => Ok(Packing::Rle),
        "1.2.840.10008.1.2.4.50" | "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => {
            Ok(Packing::Jpeg)
        }
        "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => Ok(Packing::Jpeg2000),
        "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => Ok(Packing::JpegLs),
        other => Err(unsupported(format!(
            "transfer syntax {other}: unpack the picture first (to explicit VR little endian)"
        ))),
    }
}

fn layout(kind: Kind, endian: Endian) -> Layout {
    let voxel_type = match (kind.bits_allocated, kind.is_signed) {
        (8, false) => VoxelType::U8,
        (8, true) => VoxelType::I8,
        (16, false) => VoxelType::U16,
        (16, true) => VoxelType::I16,
        (_, false) => VoxelType::U32,
        (_, true) => VoxelType::I32,
    };
    Layout {
        voxel_type,
        endian,
        count: kind.frame_len(),
    }
}

fn plain(bytes: &[u8], endian: Endian, kind: Kind, count: usize) -> Result<Vec<Voxels>, String> {
    let layout = layout(kind, endian);
    let frame_bytes = kind.frame_len() * layout.voxel_type.bytes();
    let needed = frame_bytes.checked_mul(count);
    // One byte of padding makes the length even.
    if needed.is_none_or(|needed| bytes.len() < needed || bytes.len() > needed + 1) {
        let held = bytes.len();
        return Err(format!(
            "{count} frame(s) of {} do not fit the {held} bytes of the picture",
            kind.described()
        ));
    }
    bytes
        .chunks_exact(frame_bytes)
        .take(count)
        .map(|mut frame| decode::binary(&mut frame, &layout))
        .collect()
}

/// The packed bytes of each frame. A frame can lie in several fragments; then the table of offsets separates them.
fn packed_frames<'a>(fragments: &[&'a [u8]], count: usize) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let (table, fragments) = fragments
        .split_first()
        .ok_or_else(|| "the picture has no fragment".to_owned())?;
    if fragments.len() == count {
        return Ok(fragments
            .iter()
            .map(|&fragment| Cow::Borrowed(fragment))
            .collect());
    }
    if count == 1 && !fragments.is_empty() {
        return Ok(vec![Cow::Owned(fragments.concat())]);
    }
    let offsets: Vec<u64> = table
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&bytes| u64::from(u32::from_le_bytes(bytes)))
        .collect();
    if offsets.len() != count {
        let held = fragments.len();
        return Err(format!(
            "{count} frames in {held} fragments, and no table that tells which belong together"
        ));
    }
    let mut frames = vec![Vec::new(); count];
    let mut at = 0u64;
    for fragment in fragments {
        let frame = offsets
            .partition_point(|&offset| offset <= at)
            .saturating_sub(1);
        frames[frame].extend_from_slice(fragment);
        // Each fragment has a tag and a length of 8 bytes in front.
        at += 8 + fragment.len() as u64;
    }
    Ok(frames.into_iter().map(Cow::Owned).collect())
}

fn unpack(packing: Packing, packed: &[u8], kind: Kind) -> Result<Voxels, String> {
    if packing == Packing::Rle {
        let layout = layout(kind, Endian::Little);
        let bytes = unpack_runs(packed, kind.frame_len(), layout.voxel_type.bytes())?;
        return decode::binary(&mut bytes.as_slice(), &layout);
    }
    if kind.frame_len() > packed.len().saturating_mul(PIXELS_PER_PACKED_BYTE) {
        return Err(format!(
            "{} packed bytes cannot hold {}: it is cut off",
            packed.len(),
            kind.described()
        ));
    }
    // These decoders are not ours: a panic on broken data must not end the program.
    let unpacked = catch_unwind(AssertUnwindSafe(|| match packing {
        Packing::Jpeg => jpeg(packed, kind),
        Packing::JpegLs => jpeg_ls(packed, kind),
        _ => jpeg_2000(packed, kind),
    }));
    unpacked.unwrap_or_else(|_| {
        Err("the packed picture is broken in a way its decoder does not know".to_owned())
    })
}

fn jpeg(packed: &[u8], kind: Kind) -> Result<Voxels, String> {
    let fault = |error| format!("the JPEG picture is broken: {error}");
    let mut decoder = jpeg_decoder::Decoder::new(packed);
    decoder.read_info().map_err(fault)?;
    let info = decoder
        .info()
        .ok_or_else(|| "the JPEG picture has no header".to_owned())?;
    check_size([u32::from(info.width), u32::from(info.height)], kind)?;
    let bytes_per_value = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => 1,
        jpeg_decoder::PixelFormat::L16 => 2,
        other => {
            return Err(format!(
                "the JPEG picture has pixels of format {other:?}: expected grey"
            ));
        }
    };
    let bytes = decoder.decode().map_err(fault)?;
    // The crate gives 16-bit values in the machine's byte order.
    let values = bytes
        .chunks_exact(bytes_per_value)
        .map(|value| match value {
            [low, high] => i32::from(u16::from_ne_bytes([*low, *high])),
            _ => i32::from(value[0]),
        });
    stored(values, kind)
}

/// Lossless and nearly lossless. The crate takes the expected size, and refuses another one before it decodes.
fn jpeg_ls(packed: &[u8], kind: Kind) -> Result<Voxels, String> {
    let (width, height) = (kind.columns as u32, kind.rows as u32);
    let (values, ..) = jpegls::decode(packed, width, height)
        .map_err(|error| format!("the JPEG-LS picture cannot be unpacked: {error}"))?;
    stored(values.into_iter().map(i32::from), kind)
}

fn jpeg_2000(packed: &[u8], kind: Kind) -> Result<Voxels, String> {
    check_size(size_of_jpeg_2000(packed)?, kind)?;
    // Without being strict, the decoder fills the missing part of a cut picture with grey.
    let parameters = jpeg2k::DecodeParameters::new().strict(true);
    let image = jpeg2k::Image::from_bytes_with(packed, parameters)
        .map_err(|error| format!("the JPEG 2000 picture is broken: {error}"))?;
    match image.components() {
        [grey] => {
            check_size([grey.width(), grey.height()], kind)?;
            stored(grey.data().iter().copied(), kind)
        }
        others => Err(format!(
            "the JPEG 2000 picture has {} components: expected one",
            others.len()
        )),
    }
}

/// Width and height that the codestream claims: its first two markers are SOC and SIZ.
fn size_of_jpeg_2000(packed: &[u8]) -> Result<[u32; 2], String> {
    let begin = packed
        .windows(4)
        .position(|marks| marks == [0xff, 0x4f, 0xff, 0x51]);
    let number = |at: usize| -> Option<u32> {
        let bytes: [u8; 4] = packed.get(begin? + at..begin? + at + 4)?.try_into().ok()?;
        Some(u32::from_be_bytes(bytes))
    };
    // Behind the markers, the length and the capabilities: the far corner of the image, then its near corner.
    let size = |corner: usize, offset: usize| number(corner)?.checked_sub(number(offset)?);
    size(8, 16)
        .zip(size(12, 20))
        .map(|(x, y)| [x, y])
        .ok_or_else(|| "the JPEG 2000 picture has no header".to_owned())
}

fn check_size([width, height]: [u32; 2], kind: Kind) -> Result<(), String> {
    if [width as usize, height as usize] == [kind.columns, kind.rows] {
        return Ok(());
    }
    Err(format!(
        "the packed picture has {width}x{height} pixels, the file says {}x{}",
        kind.columns, kind.rows
    ))
}

/// Numbers in the type in which plain data would hold them: their lowest bits, as many as are allocated.
fn stored(values: impl Iterator<Item = i32>, kind: Kind) -> Result<Voxels, String> {
    let voxels = match (kind.bits_allocated, kind.is_signed) {
        (8, false) => Voxels::U8(values.map(|v| v as u8).collect()),
        (8, true) => Voxels::I8(values.map(|v| v as i8).collect()),
        (16, false) => Voxels::U16(values.map(|v| v as u16).collect()),
        (16, true) => Voxels::I16(values.map(|v| v as i16).collect()),
        (_, false) => Voxels::U32(values.map(|v| v as u32).collect()),
        (_, true) => Voxels::I32(values.collect()),
    };
    let (needed, held) = (kind.frame_len(), voxels.len());
    if held == needed {
        Ok(voxels)
    } else {
        Err(format!("it unpacks to {held} values instead of {needed}"))
    }
}

/// Removes the bits above those stored, in which old files hold overlays, and extends the sign.
fn counting_bits(mut voxels: Voxels, kind: Kind) -> Voxels {
    let unused = kind.bits_allocated - kind.bits_stored;
    if unused == 0 {
        return voxels;
    }
    match &mut voxels {
        Voxels::U8(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::I8(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::U16(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::I16(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::U32(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::I32(values) => values.iter_mut().for_each(|v| *v = *v << unused >> unused),
        Voxels::F32(_) | Voxels::F64(_) => {}
    }
    voxels
}

/// Bytes of the table in front of the planes: their number and fifteen places.
const TABLE_BYTES: usize = 64;

/// Unpacks a frame of `values` numbers of `bytes` bytes each; the result is little-endian.
fn unpack_runs(fragment: &[u8], values: usize, bytes: usize) -> Result<Vec<u8>, String> {
    let number = |at: usize| -> Option<usize> {
        let four = fragment.get(4 * at..4 * at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
    };
    if number(0) != Some(bytes) || fragment.len() < TABLE_BYTES {
        return Err(format!(
            "the RLE table is broken: expected {bytes} plane(s)"
        ));
    }
    // Two packed bytes give at most 128.
    if values.saturating_mul(bytes) > fragment.len().saturating_mul(64) {
        return Err(format!(
            "{} packed bytes cannot hold {values} values: the frame is cut off",
            fragment.len()
        ));
    }
    let mut frame = vec![0; values * bytes];
    for plane in 0..bytes {
        let begin = number(1 + plane).filter(|&begin| begin >= TABLE_BYTES);
        let packed = begin.and_then(|begin| fragment.get(begin..));
        let packed =
            packed.ok_or_else(|| "a plane of the RLE table lies outside the frame".to_owned())?;
        let mut places = (bytes - 1 - plane..frame.len()).step_by(bytes);
        unpack_plane(
            packed,
            &mut |byte| places.next().map(|place| frame[place] = byte).is_some(),
            values,
        )?;
    }
    Ok(frame)
}

/// Hands out `count` bytes; `put` says whether there was a place for the byte.
fn unpack_plane(
    mut packed: &[u8],
    put: &mut dyn FnMut(u8) -> bool,
    count: usize,
) -> Result<(), String> {
    let cut = || "an RLE plane is cut off".to_owned();
    let mut done = 0;
    while done < count {
        let (&control, rest) = packed.split_first().ok_or_else(cut)?;
        let length = usize::from(control);
        match length {
            0..=127 => {
                let (literal, after) = rest.split_at_checked(length + 1).ok_or_else(cut)?;
                done += literal.iter().filter(|&&byte| put(byte)).count();
                packed = after;
            }
            128 => packed = rest,
            _ => {
                let (&byte, after) = rest.split_first().ok_or_else(cut)?;
                done += (0..257 - length).filter(|_| put(byte)).count();
                packed = after;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fragment(planes: &[&[u8]]) -> Vec<u8> {
        let mut table = vec![planes.len() as u32];
        let mut at = TABLE_BYTES as u32;
        for plane in planes {
            table.push(at);
            at += plane.len() as u32;
        }
        table.resize(16, 0);
        table
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .chain(planes.concat())
            .collect()
    }

    #[test]
    fn runs_and_literals_of_two_planes_are_woven() {
        // High bytes: three times 1, then 2. Low bytes: 5 6 7 8, and an ignored 128.
        let packed = fragment(&[&[254, 1, 0, 2], &[128, 3, 5, 6, 7, 8]]);
        assert_eq!(
            unpack_runs(&packed, 4, 2).expect("valid"),
            [5, 1, 6, 1, 7, 1, 8, 2]
        );
        assert_eq!(
            unpack_runs(&fragment(&[&[255, 9, 0]]), 2, 1).expect("a run to the end"),
            [9, 9]
        );
    }

    #[test]
    fn broken_frames_are_refused() {
        assert!(
            unpack_runs(&fragment(&[&[254, 1]]), 4, 1)
                .expect_err("short")
                .contains("cut off")
        );
        assert!(
            unpack_runs(&fragment(&[&[254, 1]]), 4, 2)
                .expect_err("planes")
                .contains("expected 2 plane")
        );
        assert!(
            unpack_runs(&fragment(&[&[1, 1]]), 1 << 20, 1)
                .expect_err("claim")
                .contains("cannot hold")
        );
        assert!(unpack_runs(&[1, 0], 1, 1).is_err(), "no table");
        let mut outside = fragment(&[&[0, 1]]);
        outside[4..8].copy_from_slice(&900u32.to_le_bytes());
        assert!(
            unpack_runs(&outside, 1, 1)
                .expect_err("outside")
                .contains("outside")
        );
    }
}
