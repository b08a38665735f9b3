//! An image of a Zarr store: its axes, its levels and where they lie, the part of an array that makes the volume, and its voxels.
//!
//! Takes the folder of a group or of a plain array, returns an [`Opened`] array, or its voxels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use resample_io::Gate;
use serde_json::Value;

use crate::Error;
use crate::input::axes;
use crate::input::axes::{ImageAxes, ImageChannel};
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::zarr::array::{Array, json};
use crate::input::formats::zarr::codecs::{PlaceIn, Span, copy_box, len};
use crate::input::formats::zarr::store::Store;
use crate::input::formats::zarr::{array, codecs};
use crate::input::options::LoadOptions;
use crate::input::{Parts, decode, invalid, unsupported_file};
use crate::volume::{Lattice, VoxelType, Voxels};

/// More chunks than any store that a single machine reads; a forged shape must not keep us looking for them. A guess.
const MAX_CHUNKS: usize = 1 << 24;

/// Chunks that were never written are legal and stand for the fill value. Where fewer than one in this many is there, the
/// shape is taken for a forgery. A guess.
const FEWEST_CHUNKS: usize = 1000;

/// Most channels that are described one by one; a forged shape must not fill the memory with them. A guess, far above any microscope.
const MOST_CHANNELS: usize = 4096;

/// An array, and what of it makes the volume.
pub(crate) struct Opened {
    pub(crate) store: Store,
    /// The folder of the array, from the store's on.
    pub(crate) folder: PathBuf,
    pub(crate) array: Array,
    /// The wanted part of each axis.
    pub(crate) spans: Vec<Span>,
    /// The axis of the array that is x.
    pub(crate) last_axis: usize,
    pub(crate) lattice: Lattice,
}

impl Opened {
    /// The type of an element.
    pub(crate) fn voxel_type(&self) -> VoxelType {
        self.array.voxel_type
    }
}

/// Reads all voxels of some channels, or of the only one.
pub(crate) fn load(
    folder: &Path,
    options: &LoadOptions,
    channels: &[usize],
) -> Result<Parts, Error> {
    let times = axes(folder, options)?.times;
    if times > 1 && options.time.is_none() {
        options.gate.remark(axes::first_of(times, folder));
    }
    let opened = open(folder, options)?;
    let spans_of = |&channel: &usize| {
        let options = LoadOptions {
            component: Some(channel),
            ..options.clone()
        };
        Ok(open(folder, &options)?.spans)
    };
    let spans: Vec<Vec<Span>> = match channels {
        [] => vec![opened.spans.clone()],
        channels => channels
            .iter()
            .map(spans_of)
            .collect::<Result<_, Error>>()?,
    };
    Ok(Parts {
        voxels: voxels(&opened, &spans, &options.gate)?,
        lattice: opened.lattice,
    })
}

/// The channels and points in time of the chosen level.
pub(crate) fn axes(folder: &Path, options: &LoadOptions) -> Result<ImageAxes, Error> {
    let store = Store::open(folder, &options.gate)?;
    let image = read(&store)?;
    let array = array::read(&store, &dataset_of(&image, folder, options)?.folder(folder))?;
    Ok(image.axes(&array))
}

/// The chosen level.
fn dataset_of<'a>(
    image: &'a Image,
    folder: &Path,
    options: &LoadOptions,
) -> Result<&'a Dataset, Error> {
    let level = options.level.unwrap_or(0);
    image.datasets.get(level).ok_or_else(|| {
        let held = image.datasets.len();
        Error::Option(format!(
            "{}: level={level}: the image has {held} level(s), counted from 0, the finest",
            folder.display()
        ))
    })
}

/// Reads the metadata.
pub(crate) fn open(folder: &Path, options: &LoadOptions) -> Result<Opened, Error> {
    let store = Store::open(folder, &options.gate)?;
    let image = read(&store)?;
    let dataset = dataset_of(&image, folder, options)?;
    let path = dataset.folder(folder);
    let array = array::read(&store, &path)?;
    let spans = selected(&image, &array, options).map_err(|fault| fault.at(folder))?;
    let spatial = spatial_axes(&image, array.shape.len());
    let mut dims = [1; 3];
    let (mut spacing, mut origin) = ([1.0; 3], [0.0; 3]);
    // The last spatial axis is x.
    for (place, &axis) in spatial.iter().rev().enumerate() {
        dims[place] = array.shape[axis];
        spacing[place] = dataset.scale.get(axis).copied().unwrap_or(1.0);
        origin[place] = dataset.translation.get(axis).copied().unwrap_or(0.0);
    }
    if spatial.len() < 3 {
        spacing[2] = spacing[0];
    }
    if let Some(bad) = spacing.iter().find(|&&s| !(s > 0.0 && s.is_finite())) {
        return Err(invalid(
            folder,
            format!(
                "the scale of level {} holds {bad}: expected lengths above 0",
                options.level.unwrap_or(0)
            ),
        ));
    }
    // There is an axis of space, or nothing could have been selected.
    let last_axis = spatial.last().copied().unwrap_or(0);
    Ok(Opened {
        store,
        folder: path,
        array,
        spans,
        last_axis,
        lattice: Lattice {
            unit: image.unit.clone(),
            ..Lattice::unnamed(dims, decode::upright(spacing, origin))
        },
    })
}

fn spatial_axes(image: &Image, count: usize) -> Vec<usize> {
    (0..count)
        .filter(|&axis| image.kind(axis, count) == AxisKind::Space)
        .collect()
}

/// The part of each axis that is read.
fn selected(image: &Image, array: &Array, options: &LoadOptions) -> Result<Vec<Span>, Fault> {
    let count = array.shape.len();
    let spatial = spatial_axes(image, count).len();
    if !(1..=3).contains(&spatial) {
        return Err(unsupported(format!(
            "the image has {spatial} axes in space: expected one to three"
        )));
    }
    let one = |option: &str, what: &str, chosen: Option<usize>, size: usize| match chosen {
        Some(index) if index < size => Ok(Span {
            first: index,
            size: 1,
        }),
        Some(index) => Err(Fault::Option(format!(
            "{option}={index}: the image has {size} {what}(s), counted from 0"
        ))),
        None if size == 1 => Ok(Span { first: 0, size: 1 }),
        None => Err(unsupported(format!(
            "the image has {size} {what}s{}: choose one with {option}=N, from 0 to {}",
            if what == "channel" {
                format!(" ({})", image.axes(array).numbered_names())
            } else {
                String::new()
            },
            size - 1
        ))),
    };
    let span = |axis: usize| match image.kind(axis, count) {
        AxisKind::Space => Ok(Span {
            first: 0,
            size: array.shape[axis],
        }),
        AxisKind::Channel => one("component", "channel", options.component, array.shape[axis]),
        AxisKind::Time => {
            let first = options.time.or(Some(0));
            one("time", "point in time", first, array.shape[axis])
        }
    };
    let has = |kind: AxisKind| (0..count).any(|axis| image.kind(axis, count) == kind);
    if options.time.is_some() && !has(AxisKind::Time) {
        return Err(Fault::Option(
            "time does not apply to an image without an axis of time: leave it out".to_owned(),
        ));
    }
    if options.component.is_some_and(|channel| channel > 0) && !has(AxisKind::Channel) {
        return Err(Fault::Option(
            "component: the image has one channel only".to_owned(),
        ));
    }
    (0..count).map(span).collect()
}

/// Unpacks the chunks that the spans of one component or another touch, each once. All components have the same size.
fn voxels(opened: &Opened, components: &[Vec<Span>], gate: &Gate) -> Result<Vec<Voxels>, Error> {
    let (folder, array) = (opened.folder.as_path(), &opened.array);
    let bytes_each = array.voxel_type.bytes();
    let size: Vec<usize> = components[0].iter().map(|span| span.size).collect();
    let count =
        len(&size).ok_or_else(|| invalid(folder, "more voxels than this machine can count"))?;
    let layout = Layout {
        voxel_type: array.voxel_type,
        endian: array.codecs.endian,
        count,
    };
    // As bytes first, and then as numbers.
    let asked = layout.bytes().and_then(|bytes| {
        gate.ask(
            bytes.saturating_mul(2 * components.len() as u64),
            "the voxels",
        )
    });
    asked.map_err(|what| invalid(folder, what))?;
    let chunk_bytes = (array.chunk.iter().product::<usize>() * bytes_each) as u64;
    let mut chunks = BTreeMap::new();
    for (component, spans) in components.iter().enumerate() {
        for (index, path) in chunks_of(opened, spans)? {
            let (_, users) = chunks.entry(index).or_insert((path, Vec::new()));
            users.push(component);
        }
    }
    let filled = components.iter().map(|_| array.filled(count));
    let filled = filled.collect::<Result<Vec<_>, String>>();
    let mut all = filled.map_err(|what| invalid(folder, what))?;
    for (index, (path, users)) in chunks {
        let packed = opened.store.read(&path)?;
        gate.ask_unpacked(chunk_bytes, packed.len() as u64, "the voxels of the chunk")
            .map_err(|what| invalid(&path, what))?;
        let chunk = codecs::unpack(&array.codecs, &array.chunk, &packed, &array.fill);
        let chunk = chunk.map_err(|fault| fault.at(&path))?;
        for component in users {
            let common = Common::new(array, &components[component], &index);
            let mut target = PlaceIn {
                bytes: all[component].as_mut_slice(),
                shape: &size,
                at: &common.to,
            };
            let source = PlaceIn {
                bytes: chunk.as_slice(),
                shape: &array.chunk,
                at: &common.from,
            };
            copy_box(&source, &mut target, &common.size, bytes_each);
        }
    }
    let decoded = all.into_iter().map(|bytes| {
        decode::binary(&mut bytes.as_slice(), &layout).map_err(|what| invalid(folder, what))
    });
    decoded.collect()
}

/// The common part of a chunk and the spans, counted in either.
pub(crate) struct Common {
    pub(crate) size: Vec<usize>,
    /// Its first place in the chunk.
    pub(crate) from: Vec<usize>,
    /// Its first place in the spans.
    pub(crate) to: Vec<usize>,
}

impl Common {
    pub(crate) fn new(array: &Array, spans: &[Span], index: &[usize]) -> Self {
        let start: Vec<usize> = index
            .iter()
            .zip(&array.chunk)
            .map(|(i, size)| i * size)
            .collect();
        let low: Vec<usize> = start
            .iter()
            .zip(spans)
            .map(|(&s, span)| s.max(span.first))
            .collect();
        let end = |axis: usize| {
            (start[axis] + array.chunk[axis]).min(spans[axis].first + spans[axis].size)
        };
        Self {
            size: (0..start.len()).map(|axis| end(axis) - low[axis]).collect(),
            from: low
                .iter()
                .zip(&start)
                .map(|(low, start)| low - start)
                .collect(),
            to: low
                .iter()
                .zip(spans)
                .map(|(low, span)| low - span.first)
                .collect(),
        }
    }
}

/// The chunks that the spans touch and that were written: their places and their files.
pub(crate) fn chunks_of(
    opened: &Opened,
    spans: &[Span],
) -> Result<Vec<(Vec<usize>, PathBuf)>, Error> {
    let (folder, array) = (&opened.folder, &opened.array);
    let ranges: Vec<Span> = spans
        .iter()
        .zip(&array.chunk)
        .map(|(span, chunk)| {
            let first = span.first / chunk;
            Span {
                first,
                size: (span.first + span.size - 1) / chunk + 1 - first,
            }
        })
        .collect();
    let sizes: Vec<usize> = ranges.iter().map(|range| range.size).collect();
    let count = len(&sizes)
        .filter(|&count| count <= MAX_CHUNKS)
        .ok_or_else(|| {
            invalid(
                folder,
                format!(
                    "its shape {:?} is cut into more than {MAX_CHUNKS} chunks",
                    array.shape
                ),
            )
        })?;
    let mut found = Vec::new();
    for number in 0..count {
        let mut rest = number;
        let mut index = vec![0; sizes.len()];
        for axis in (0..sizes.len()).rev() {
            index[axis] = ranges[axis].first + rest % sizes[axis];
            rest /= sizes[axis];
        }
        let path = folder.join(array.key(&index));
        if opened.store.holds(&path) {
            found.push((index, path));
        }
    }
    if found.len().saturating_mul(FEWEST_CHUNKS) < count {
        let what = format!(
            "{} of {count} chunks are there: the data is missing, or the shape is wrong",
            found.len()
        );
        return Err(invalid(folder, what));
    }
    Ok(found)
}

/// The meaning of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AxisKind {
    Time,
    Channel,
    Space,
}

/// A multi-scale image.
#[derive(Debug, Default)]
pub(crate) struct Image {
    /// None for a plain array.
    kinds: Vec<AxisKind>,
    /// The levels, the finest first.
    datasets: Vec<Dataset>,
    /// The unit of x, the last axis.
    unit: Option<String>,
    /// The channels as the metadata describes them; empty where it does not.
    channels: Vec<ImageChannel>,
}

/// One level.
#[derive(Debug, Default)]
pub(crate) struct Dataset {
    path: String,
    /// Distance between neighbours along each axis; empty where it is not known.
    pub(crate) scale: Vec<f64>,
    /// Position of the first voxel along each axis.
    pub(crate) translation: Vec<f64>,
}

impl Image {
    /// The meaning of an axis of an array with `count` axes.
    pub(crate) fn kind(&self, axis: usize, count: usize) -> AxisKind {
        match self.kinds.get(axis) {
            Some(kind) => *kind,
            None if axis + 3 >= count => AxisKind::Space,
            None if axis + 4 == count => AxisKind::Channel,
            None => AxisKind::Time,
        }
    }

    /// The axes of an array of this image beside those of space.
    fn axes(&self, array: &Array) -> ImageAxes {
        let count = array.shape.len();
        let size = |kind: AxisKind| {
            let sizes = (0..count).filter(|&axis| self.kind(axis, count) == kind);
            sizes
                .map(|axis| array.shape[axis])
                .fold(1, usize::saturating_mul)
        };
        let known = self.channels.iter().cloned();
        ImageAxes {
            channels: known
                .chain(std::iter::repeat(ImageChannel::default()))
                .take(size(AxisKind::Channel).clamp(1, MOST_CHANNELS))
                .collect(),
            times: size(AxisKind::Time).max(1),
        }
        .without_equal_colours()
    }
}

impl Dataset {
    pub(crate) fn folder(&self, group: &Path) -> PathBuf {
        if self.path.is_empty() {
            group.to_owned()
        } else {
            group.join(&self.path)
        }
    }
}

fn read(store: &Store) -> Result<Image, Error> {
    let folder = store.root();
    let v3 = folder.join("zarr.json");
    let (path, attributes) = match json(store, &v3)? {
        Some(meta) if meta["node_type"] == "array" => return Ok(plain()),
        Some(meta) => (v3, meta["attributes"]["ome"].clone()),
        None if store.holds(&folder.join(".zarray")) => return Ok(plain()),
        None => {
            let path = folder.join(".zattrs");
            let attributes = json(store, &path)?.unwrap_or(Value::Null);
            (path, attributes)
        }
    };
    let Some(multiscale) = attributes["multiscales"].get(0) else {
        return Err(unsupported_file(
            folder,
            "a Zarr group without an image of its own (no \"multiscales\"): name one of its folders, such as 0",
        ));
    };
    let kinds = kinds(multiscale).map_err(|what| invalid(&path, what))?;
    let shared = transformation(&multiscale["coordinateTransformations"]);
    let datasets: Vec<Dataset> = multiscale["datasets"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|level| dataset(level, &shared))
        .collect();
    if let Some(level) = datasets
        .iter()
        .position(|d| d.path.is_empty() || d.path.split('/').any(|part| part == ".."))
    {
        return Err(invalid(
            &path,
            format!("level {level} of \"datasets\" has no path inside the group"),
        ));
    }
    if datasets.is_empty() {
        return Err(invalid(&path, "\"datasets\" names no level"));
    }
    let channels = attributes["omero"]["channels"].as_array();
    let channels = channels.into_iter().flatten().map(channel).collect();
    let last = multiscale["axes"].as_array().and_then(|axes| axes.last());
    let unit = last.and_then(|axis| axis["unit"].as_str());
    Ok(Image {
        kinds,
        unit: unit.and_then(axes::unit),
        datasets,
        channels,
    })
}

/// A channel of the rendering settings that OMERO writes.
fn channel(entry: &Value) -> ImageChannel {
    let name = entry["label"].as_str().map(str::trim);
    let end = |key: &str| entry["window"][key].as_f64();
    ImageChannel {
        name: name.filter(|name| !name.is_empty()).map(str::to_owned),
        rgb: entry["color"].as_str().and_then(colour_of_digits),
        window: axes::window(end("start"), end("end")),
        is_shown: entry["active"].as_bool().unwrap_or(true),
    }
}

/// The colour of six digits, after a # or not; alpha behind them is passed over.
fn colour_of_digits(text: &str) -> Option<[u8; 3]> {
    let digits = text.trim_start_matches('#').get(..6)?;
    let [_, red, green, blue] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some([red, green, blue])
}

fn plain() -> Image {
    Image {
        datasets: vec![Dataset::default()],
        ..Image::default()
    }
}

fn kinds(multiscale: &Value) -> Result<Vec<AxisKind>, String> {
    let axes = multiscale["axes"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    let kind = |axis: &Value| {
        // Version 0.3 wrote names only.
        let name = axis.as_str().or(axis["name"].as_str()).unwrap_or("");
        match (axis["type"].as_str(), name) {
            (Some("space"), _) | (None, "x" | "y" | "z") => Ok(AxisKind::Space),
            (Some("time"), _) | (None, "t") => Ok(AxisKind::Time),
            (Some("channel"), _) | (None, "c") => Ok(AxisKind::Channel),
            (other, _) => Err(format!(
                "axis '{name}' is of type {other:?}: expected space, time or channel"
            )),
        }
    };
    axes.iter().map(kind).collect()
}

fn dataset(level: &Value, shared: &Dataset) -> Dataset {
    let own = transformation(&level["coordinateTransformations"]);
    let path = level["path"]
        .as_str()
        .unwrap_or("")
        .trim_matches('/')
        .to_owned();
    // The level's transformation comes first, the one of all levels after it.
    let at = |list: &[f64], axis: usize, none: f64| list.get(axis).copied().unwrap_or(none);
    let count = own
        .scale
        .len()
        .max(shared.scale.len())
        .max(own.translation.len())
        .max(shared.translation.len());
    let scale = (0..count)
        .map(|axis| at(&own.scale, axis, 1.0) * at(&shared.scale, axis, 1.0))
        .collect();
    let translation = (0..count)
        .map(|axis| {
            at(&own.translation, axis, 0.0) * at(&shared.scale, axis, 1.0)
                + at(&shared.translation, axis, 0.0)
        })
        .collect();
    Dataset {
        path,
        scale,
        translation,
    }
}

/// The scale and the translation of a list of transformations; empty where absent.
fn transformation(list: &Value) -> Dataset {
    let mut found = Dataset::default();
    for entry in list.as_array().into_iter().flatten() {
        let numbers = |key: &str| -> Vec<f64> {
            entry[key]
                .as_array()
                .into_iter()
                .flatten()
                .map(|n| n.as_f64().unwrap_or(f64::NAN))
                .collect()
        };
        match entry["type"].as_str() {
            Some("scale") => found.scale = numbers("scale"),
            Some("translation") => found.translation = numbers("translation"),
            _ => {}
        }
    }
    found
}
