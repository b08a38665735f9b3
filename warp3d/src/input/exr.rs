//! OpenEXR: colour layers and depth channels, on the display window.
//!
//! Takes a path and perhaps a layer or channel, gives planes of the display window's size: pixels of the data window
//! that lie outside it are cut off, and where it reaches beyond the data window nothing is known. Half, single
//! precision and whole numbers are read, tiled or in scan lines, one part or several. The sizes that the header claims
//! are held against the length of the file before pixels are decoded. The decoding itself is the crate `exr`'s.
//! Limits: the largest resolution level; no deep data, no sub-sampled channels; the pixel aspect ratio is left to the
//! camera.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::exr::meta::MetaData;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Compression, FlatSamples, Image, IntegerBounds, Layer, ReadChannels, ReadLayers,
    read,
};

use super::{MAX_PIXELS, Picture, Plane, Stored, fault, open};
use crate::Error;

type Layers = Image<::exr::prelude::SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>>;

/// First four bytes of every EXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Largest display window that a file may ask for whatever its data window has, px: 4096 x 4096.
const FREE_DISPLAY_PIXELS: u64 = 1 << 24;

/// Beyond that, a display window may have this many times the pixels of the data. A guess, far above what cropped
/// renderings have.
const MOST_DISPLAY_PER_DATA: u64 = 64;

/// Whether a file with these first bytes is an EXR file.
pub(super) fn is_exr(start: &[u8]) -> bool {
    start.starts_with(&MAGIC)
}

/// Width and height of the display window, from the header alone.
pub(super) fn size(path: &Path) -> Result<[u32; 2], Error> {
    let (_, length) = open(path)?;
    let meta = catch_unwind(|| MetaData::read_from_file(path, false))
        .map_err(|_| fault(path, "not a usable EXR file: its header makes no sense"))?
        .map_err(|error| fault(path, format!("not a usable EXR file: {error}")))?;
    check_sizes(&meta, length).map_err(|what| fault(path, what))?;
    let window = meta.headers.first().map(|header| header.shared_attributes.display_window.size);
    let window = window.ok_or_else(|| fault(path, "an EXR file without a picture"))?;
    Ok([window.width() as u32, window.height() as u32])
}

/// Red, green, blue and alpha of the picture, or of a layer.
pub(super) fn read_colour(path: &Path, layer: Option<&str>) -> Result<Picture, Error> {
    let image = decoded(path)?;
    let found = colour_channels(&image, layer).map_err(|what| fault(path, what))?;
    let window = image.attributes.display_window;
    let planes = found.rgb.map(|at| on_display(at, window));
    let alpha = found.alpha.map(|at| on_display(at, window));
    let [red, green, blue] = &planes;
    let rgb = red.iter().zip(green).zip(blue).map(|((&r, &g), &b)| [r, g, b]);
    // Without alpha, a pixel is covered where the data window has it.
    let inside = || red.iter().map(|red| if red.is_nan() { 0.0 } else { 1.0 }).collect();
    let coverage: Vec<f32> = alpha.as_ref().map_or_else(inside, |alpha| {
        alpha.iter().map(|&alpha| if alpha > 0.0 { alpha.min(1.0) } else { 0.0 }).collect()
    });
    let straight = |(rgb, &alpha): ([f32; 3], &f32)| match alpha {
        _ if alpha >= 1.0 => rgb,
        _ if alpha > 0.0 => rgb.map(|channel| channel / alpha),
        _ => [0.0; 3],
    };
    let rgb = rgb.zip(&coverage).map(straight).collect();
    let whole = alpha.is_none() && coverage.iter().all(|&coverage| coverage == 1.0);
    let coverage = (!whole).then_some(coverage);
    Ok(Picture { width: window.size.width(), height: window.size.height(), rgb, coverage })
}

/// The channel that is named, or the only one that can be depth.
pub(super) fn read_depth(path: &Path, channel: Option<&str>) -> Result<Plane, Error> {
    let image = decoded(path)?;
    let at = depth_channel(&image, channel).map_err(|what| fault(path, what))?;
    let window = image.attributes.display_window;
    let stored = match at.channel.sample_data {
        FlatSamples::U32(_) => Stored::Code(u32::MAX),
        _ => Stored::Float,
    };
    let (width, height) = (window.size.width(), window.size.height());
    Ok(Plane { width, height, values: on_display(at, window), stored })
}

/// A channel and the layer it lies in.
#[derive(Clone, Copy)]
struct At<'a> {
    layer: &'a Layer<AnyChannels<FlatSamples>>,
    channel: &'a AnyChannel<FlatSamples>,
}

struct Colour<'a> {
    rgb: [At<'a>; 3],
    alpha: Option<At<'a>>,
}

fn decoded(path: &Path) -> Result<Layers, Error> {
    let (_, length) = open(path)?;
    // The crate's checks are thorough, yet a panic in one of its decoders must not end the program without a word.
    let all = catch_unwind(AssertUnwindSafe(|| -> Result<Layers, String> {
        let wrong = |error: ::exr::error::Error| format!("not a usable EXR file: {error}");
        let meta = MetaData::read_from_file(path, false).map_err(wrong)?;
        check_sizes(&meta, length)?;
        let all =
            read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        all.non_parallel().from_file(path).map_err(wrong)
    }));
    all.unwrap_or_else(|_| Err("not a usable EXR file: its packed pixels make no sense".into()))
        .map_err(|what| fault(path, what))
}

/// Holds the claims of all parts against the length of the file.
fn check_sizes(meta: &MetaData, file_bytes: u64) -> Result<(), String> {
    let (mut all_bytes, mut all_pixels) = (0u64, 0u64);
    for header in &meta.headers {
        let [width, height] = [header.layer_size.width() as u64, header.layer_size.height() as u64];
        let pixels = width.saturating_mul(height);
        let per_pixel = header.channels.bytes_per_pixel as u64;
        if pixels > MAX_PIXELS {
            return Err(format!("{width}x{height} pixels, more than the {MAX_PIXELS} that are read"));
        }
        // Deflate unpacks a byte to at most 1032, the other codecs to less; DWA packs runs of 128 before deflate.
        let expansion = match header.compression {
            Compression::Uncompressed => 1,
            Compression::DWAA(_) | Compression::DWAB(_) => 1032 * 128,
            _ => 1032,
        };
        let needed = pixels.saturating_mul(per_pixel);
        if needed > file_bytes.saturating_mul(expansion) {
            return Err(format!(
                "the header says {width}x{height} pixels, more than a file of {file_bytes} bytes can hold"
            ));
        }
        all_bytes = all_bytes.saturating_add(needed);
        all_pixels = all_pixels.max(pixels);
    }
    let most = MAX_PIXELS * 16;
    if all_bytes > most {
        return Err(format!("its parts unpack to {all_bytes} bytes, more than the {most} that are read"));
    }
    let window = meta.headers.first().map(|header| header.shared_attributes.display_window.size);
    let (width, height) = window.map_or((0, 0), |size| (size.width() as u64, size.height() as u64));
    let display = width.saturating_mul(height);
    let allowed = FREE_DISPLAY_PIXELS.max(all_pixels.saturating_mul(MOST_DISPLAY_PER_DATA)).min(MAX_PIXELS);
    if display == 0 || display > allowed {
        return Err(format!("the display window has {width}x{height} pixels, which the data cannot fill"));
    }
    Ok(())
}

/// Every channel with its full name: the layer's or part's name may stand before it.
fn channels(image: &Layers) -> impl Iterator<Item = (String, At<'_>)> {
    let of_layer = |layer: &'_ Layer<AnyChannels<FlatSamples>>| layer.attributes.layer_name.clone();
    image.layer_data.iter().flat_map(move |layer| {
        let part = of_layer(layer);
        layer.channel_data.list.iter().map(move |channel| {
            let name = channel.name.to_string();
            let name = match &part {
                Some(part) if image.layer_data.len() > 1 => format!("{part}:{name}"),
                _ => name,
            };
            (name, At { layer, channel })
        })
    })
}

/// The channel that is called `name`, in its part or with the part's name and a dot before it.
fn find<'a>(image: &'a Layers, name: &str) -> Option<At<'a>> {
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
    channels(image).find(|(full, _)| matches(full)).map(|(_, at)| at)
}

fn colour_channels<'a>(image: &'a Layers, layer: Option<&str>) -> Result<Colour<'a>, String> {
    let prefix = layer.map_or(String::new(), |layer| format!("{layer}."));
    let named = |channel: &str| find(image, &format!("{prefix}{channel}"));
    let same_part = |a: At, b: At| std::ptr::eq(a.layer, b.layer);
    if let (Some(red), Some(green), Some(blue)) = (named("R"), named("G"), named("B")) {
        let alpha = named("A").filter(|&alpha| same_part(red, alpha));
        return Ok(Colour { rgb: [red, green, blue], alpha });
    }
    let only = || if channels(image).count() == 1 { channels(image).next().map(|(_, at)| at) } else { None };
    if let Some(grey) = named("Y").or_else(|| layer.map_or_else(only, |name| find(image, name))) {
        return Ok(Colour { rgb: [grey; 3], alpha: named("A") });
    }
    let held = listed(image);
    Err(match layer {
        Some(layer) => format!("no colours in layer '{layer}': the channels are {held}"),
        None => format!("no channels R, G, B or Y: name a layer behind a colon; the channels are {held}"),
    })
}

fn depth_channel<'a>(image: &'a Layers, wanted: Option<&str>) -> Result<At<'a>, String> {
    if let Some(name) = wanted {
        let found = find(image, name).or_else(|| find(image, &format!("{name}.Z")));
        return found.ok_or_else(|| format!("no channel '{name}': the channels are {}", listed(image)));
    }
    let usual = ["Z", "depth.Z", "Depth.Z", "depth", "Depth", "D"];
    if let Some(at) = usual.iter().find_map(|name| find(image, name)) {
        return Ok(at);
    }
    let all: Vec<_> = channels(image).collect();
    let candidates: Vec<_> = all.iter().filter(|(name, _)| name.ends_with(".Z")).collect();
    match (candidates.as_slice(), all.as_slice()) {
        ([(_, at)], _) | (_, [(_, at)]) => Ok(*at),
        _ => Err(format!(
            "no channel Z or depth.Z: name the depth channel behind a colon; the channels are {}",
            listed(image)
        )),
    }
}

/// The names of the channels, for a message: the first ones if there are many.
fn listed(image: &Layers) -> String {
    const MOST: usize = 16;
    let mut names: Vec<String> = channels(image).map(|(name, _)| name).take(MOST + 1).collect();
    if names.len() > MOST {
        names[MOST] = "...".into();
    }
    names.join(", ")
}

/// A channel on the display window; NaN where the data window has no pixel.
fn on_display(at: At, window: IntegerBounds) -> Vec<f32> {
    let data = &at.channel.sample_data;
    let size = at.layer.size;
    let (width, height) = (window.size.width(), window.size.height());
    // Where the display window's first pixel lies in the data.
    let offset = |display: i32, data: i32| i64::from(display) - i64::from(data);
    let left = offset(window.position.x(), at.layer.attributes.layer_position.x());
    let top = offset(window.position.y(), at.layer.attributes.layer_position.y());
    let mut values = vec![f32::NAN; width * height];
    for (y, row) in values.chunks_exact_mut(width).enumerate() {
        let Some(data_y) = inside(y as i64 + top, size.height()) else { continue };
        for (x, value) in row.iter_mut().enumerate() {
            if let Some(data_x) = inside(x as i64 + left, size.width()) {
                *value = data.value_by_flat_index(data_y * size.width() + data_x).to_f32();
            }
        }
    }
    values
}

fn inside(index: i64, length: usize) -> Option<usize> {
    usize::try_from(index).ok().filter(|&index| index < length)
}
