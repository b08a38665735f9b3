//! OpenEXR: colour layers and depth channels, on the display window.
//!
//! Takes a path and perhaps a layer or channel, gives pieces of rows on the display window: pixels of the data window
//! that lie outside it are cut off, and where it reaches beyond the data window nothing is known. Half, single
//! precision and whole numbers are read, tiled or in scan lines, one part or several, block by block (`blocks`). The
//! sizes that the header claims are held against the length of the file before pixels are decoded. The decoding itself
//! is the crate `exr`'s.
//! Limits: the largest resolution level; no deep data, no sub-sampled channels; the pixel aspect ratio is left to the
//! camera.

mod blocks;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::exr::meta::attribute::SampleType;
use ::exr::meta::header::Header;

use crate::files::fault;
pub use crate::formats::exr::blocks::check_all;
use crate::formats::exr::blocks::{At, headers};
use crate::picture::Stored;
use crate::receiver::{Receiver, Room};
use resample_core::Error;

/// First four bytes of every EXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Returns true if a file with these first bytes is an EXR file.
pub(crate) fn is_exr(start: &[u8]) -> bool {
    start.starts_with(&MAGIC)
}

/// Width and height of the display window, from the header alone.
pub(crate) fn size(path: &Path) -> Result<[u32; 2], Error> {
    let headers = headers(path)?;
    let window = headers
        .first()
        .map(|header| header.shared_attributes.display_window.size);
    let window = window.ok_or_else(|| fault(path, "an EXR file without a picture"))?;
    Ok([window.width() as u32, window.height() as u32])
}

/// The channels of an EXR file, from its header alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channels {
    /// Names, with those of their parts, and the types of their numbers.
    pub all: Vec<(String, &'static str)>,
    /// True if there are colours, and beside them a channel that is taken for depth.
    pub has_colour_and_depth: bool,
}

/// The channels of a file.
///
/// # Errors
/// A file that cannot be read, or whose header claims more than the file can hold.
pub fn channels_of(path: &Path) -> Result<Channels, Error> {
    let headers = headers(path)?;
    let kind = |at: At| match headers[at.layer].channels.list[at.channel].sample_type {
        SampleType::U32 => "u32",
        SampleType::F16 => "f16",
        SampleType::F32 => "f32",
    };
    let colour = colour_channels(&headers, None).ok();
    let depth = depth_channel(&headers, None).ok();
    Ok(Channels {
        all: channels(&headers)
            .map(|(name, at)| (name, kind(at)))
            .collect(),
        has_colour_and_depth: colour
            .zip(depth)
            .is_some_and(|(colour, depth)| !colour.rgb.contains(&depth)),
    })
}

/// Gives red, green, blue and alpha of the picture, or of a layer; whether there is alpha.
pub(crate) fn decode_colour(
    path: &Path,
    layer: Option<&str>,
    room: Room,
    to: &mut dyn Receiver,
) -> Result<bool, Error> {
    let headers = headers(path)?;
    let found = colour_channels(&headers, layer).map_err(|what| fault(path, what))?;
    let mut row = Vec::new();
    to.begin(blocks::display_size(&headers))?;
    let wanted: Vec<At> = found.rgb.into_iter().chain(found.alpha).collect();
    guarded(path, || {
        blocks::pieces(path, &wanted, room, &mut |at, planes| {
            row.clear();
            for i in 0..planes[0].len() {
                let rgb = [planes[0][i], planes[1][i], planes[2][i]];
                row.extend(straight(rgb, planes.get(3).map(|alpha| alpha[i])));
            }
            to.put(at, &row)
        })
    })?;
    Ok(found.alpha.is_some())
}

/// Gives the channel that is named, or the only one that can be depth; what kind of numbers it has.
pub(crate) fn decode_depth(
    path: &Path,
    channel: Option<&str>,
    room: Room,
    to: &mut dyn Receiver,
) -> Result<Stored, Error> {
    let headers = headers(path)?;
    let at = depth_channel(&headers, channel).map_err(|what| fault(path, what))?;
    to.begin(blocks::display_size(&headers))?;
    guarded(path, || {
        blocks::pieces(path, &[at], room, &mut |at, planes| to.put(at, &planes[0]))
    })?;
    Ok(
        match headers[at.layer].channels.list[at.channel].sample_type {
            SampleType::U32 => Stored::Code(u32::MAX),
            SampleType::F16 | SampleType::F32 => Stored::Float,
        },
    )
}

/// A premultiplied colour divided by its alpha, and the covered part of the pixel.
fn straight(rgb: [f32; 3], alpha: Option<f32>) -> [f32; 4] {
    let [r, g, b] = rgb;
    match alpha {
        None => [r, g, b, if r.is_nan() { 0.0 } else { 1.0 }],
        Some(alpha) if alpha >= 1.0 => [r, g, b, 1.0],
        Some(alpha) if alpha > 0.0 => [r / alpha, g / alpha, b / alpha, alpha],
        Some(_) => [0.0; 4],
    }
}

struct Colour {
    rgb: [At; 3],
    alpha: Option<At>,
}

/// The crate's checks are thorough, yet a panic in one of its decoders must not end the program without a word.
fn guarded(path: &Path, decode: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        Err(fault(
            path,
            "not a usable EXR file: its packed pixels make no sense",
        ))
    })
}

/// Every channel with its full name: the layer's or part's name may stand before it.
fn channels(headers: &[Header]) -> impl Iterator<Item = (String, At)> {
    headers.iter().enumerate().flat_map(move |(layer, header)| {
        let part = &header.own_attributes.layer_name;
        header
            .channels
            .list
            .iter()
            .enumerate()
            .map(move |(channel, description)| {
                let name = description.name.to_string();
                let name = match part {
                    Some(part) if headers.len() > 1 => format!("{part}:{name}"),
                    _ => name,
                };
                (name, At { layer, channel })
            })
    })
}

/// The channel that is called `name`, in its part or with the part's name and a dot before it.
fn find(headers: &[Header], name: &str) -> Option<At> {
    let matches = |full: &str| match full.split_once(':') {
        Some((part, channel)) => {
            channel == name
                || name
                    .strip_prefix(part)
                    .and_then(|rest| rest.strip_prefix('.'))
                    .is_some_and(|rest| rest == channel)
        }
        None => full == name,
    };
    channels(headers)
        .find(|(full, _)| matches(full))
        .map(|(_, at)| at)
}

fn colour_channels(headers: &[Header], layer: Option<&str>) -> Result<Colour, String> {
    let prefix = layer.map_or(String::new(), |layer| format!("{layer}."));
    let named = |channel: &str| find(headers, &format!("{prefix}{channel}"));
    if let (Some(red), Some(green), Some(blue)) = (named("R"), named("G"), named("B")) {
        let alpha = named("A").filter(|&alpha| red.layer == alpha.layer);
        return Ok(Colour {
            rgb: [red, green, blue],
            alpha,
        });
    }
    let only = || {
        if channels(headers).count() == 1 {
            channels(headers).next().map(|(_, at)| at)
        } else {
            None
        }
    };
    if let Some(grey) = named("Y").or_else(|| layer.map_or_else(only, |name| find(headers, name))) {
        return Ok(Colour {
            rgb: [grey; 3],
            alpha: named("A"),
        });
    }
    let held = listed(headers);
    Err(match layer {
        Some(layer) => format!("no colours in layer '{layer}': the channels are {held}"),
        None => {
            format!("no channels R, G, B or Y: name a layer behind a #; the channels are {held}")
        }
    })
}

fn depth_channel(headers: &[Header], wanted: Option<&str>) -> Result<At, String> {
    if let Some(name) = wanted {
        let found = find(headers, name).or_else(|| find(headers, &format!("{name}.Z")));
        return found
            .ok_or_else(|| format!("no channel '{name}': the channels are {}", listed(headers)));
    }
    let usual = ["Z", "depth.Z", "Depth.Z", "depth", "Depth", "D"];
    if let Some(at) = usual.iter().find_map(|name| find(headers, name)) {
        return Ok(at);
    }
    let all: Vec<_> = channels(headers).collect();
    let candidates: Vec<_> = all
        .iter()
        .filter(|(name, _)| name.ends_with(".Z"))
        .collect();
    match (candidates.as_slice(), all.as_slice()) {
        ([(_, at)], _) | (_, [(_, at)]) => Ok(*at),
        _ => Err(format!(
            "no channel Z or depth.Z: name the depth channel behind a #; the channels are {}",
            listed(headers)
        )),
    }
}

/// The names of the channels, for a message: the first ones if there are many.
fn listed(headers: &[Header]) -> String {
    const MOST: usize = 16;
    let mut names: Vec<String> = channels(headers)
        .map(|(name, _)| name)
        .take(MOST + 1)
        .collect();
    if names.len() > MOST {
        names[MOST] = "...".into();
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn premultiplied_colours_are_divided_by_their_alpha() {
        let rgb = [0.2, 0.3, 0.4];
        assert_eq!(straight(rgb, None), [0.2, 0.3, 0.4, 1.0]);
        assert_eq!(straight([f32::NAN, 0.3, 0.4], None)[3], 0.0, "unknown");
        assert_eq!(straight(rgb, Some(0.5)), [0.4, 0.6, 0.8, 0.5]);
        assert_eq!(straight(rgb, Some(1.0)), [0.2, 0.3, 0.4, 1.0]);
        assert_eq!(
            straight(rgb, Some(1.5)),
            [0.2, 0.3, 0.4, 1.0],
            "no more than covered"
        );
        for nothing in [0.0, -1.0, f32::NAN] {
            assert_eq!(straight(rgb, Some(nothing)), [0.0; 4], "{nothing}");
        }
    }
}
