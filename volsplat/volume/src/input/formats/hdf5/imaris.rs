//! Imaris files, `.ims`: `DataSet/ResolutionLevel R/TimePoint T/Channel C/Data`, each array `[z][y][x]`, padded to whole chunks.
//!
//! `DataSetInfo/Image` has the corners of the image in the world and the unit, `DataSetInfo/Channel C` the name, colour and window of a channel.
//! Source: the description of the format that Oxford Instruments publishes with Imaris (version 5.5).

use glam::DVec3;
use netcdf_reader::NcGroup;
use resample_core::narrow;

use crate::input::axes;
use crate::input::axes::{ImageAxes, ImageChannel};
use crate::input::file::Fault;
use crate::input::formats::hdf5::plan::{Plan, Slab, Values, placed};
use crate::input::formats::hdf5::slab::Taken;
use crate::input::formats::hdf5::tree::{group, numbers, text};
use crate::input::options::LoadOptions;
use crate::volume::Lattice;

/// True if the groups are those of Imaris.
pub(crate) fn is_layout(root: &NcGroup) -> bool {
    group(root, &["DataSetInfo", "Image"]).is_some()
        && group(root, &["DataSet", "ResolutionLevel 0", "TimePoint 0"]).is_some()
}

/// Groups of a name and a number, from 0 on.
fn numbered(parent: &NcGroup, name: &str) -> usize {
    (0..)
        .take_while(|number| group(parent, &[&format!("{name} {number}")]).is_some())
        .count()
}

/// The channels and points in time.
pub(crate) fn axes(root: &NcGroup) -> ImageAxes {
    let level = group(root, &["DataSet", "ResolutionLevel 0"]);
    let times = level.map_or(1, |level| numbered(level, "TimePoint"));
    let count = level
        .and_then(|level| group(level, &["TimePoint 0"]))
        .map_or(1, |time| numbered(time, "Channel"));
    let channels = (0..count.max(1)).map(|number| channel(root, number));
    ImageAxes {
        channels: channels.collect(),
        times: times.max(1),
    }
    .without_equal_colours()
}

fn channel(root: &NcGroup, number: usize) -> ImageChannel {
    let Some(found) = group(root, &["DataSetInfo", &format!("Channel {number}")]) else {
        return ImageChannel::default();
    };
    let parts = numbers(&found.attributes, "Color");
    let rgb = parts.and_then(|parts| <[f64; 3]>::try_from(parts).ok());
    let ends = numbers(&found.attributes, "ColorRange").unwrap_or_default();
    ImageChannel {
        name: text(&found.attributes, "Name"),
        rgb: rgb.map(|rgb| rgb.map(|part| narrow::code8((255.0 * part).round()))),
        window: axes::window(ends.first().copied(), ends.get(1).copied()),
        is_shown: true,
    }
}

/// The arrays of the wanted channels.
pub(crate) fn plan(
    root: &NcGroup,
    options: &LoadOptions,
    channels: &[usize],
) -> Result<Plan, Fault> {
    let level = options.level.unwrap_or(0);
    let found = axes(root);
    let time = options.time.unwrap_or(0);
    check("time", "point(s) in time", time, found.times)?;
    let levels = group(root, &["DataSet"]).map_or(0, |all| numbered(all, "ResolutionLevel"));
    check("level", "level(s)", level, levels)?;
    let channels = match (channels, found.channels.len()) {
        ([], 1) => &[0],
        ([], count) => {
            return Err(Fault::Option(format!(
                "the image has {count} channels ({}): choose one with component=N, from 0 to {}",
                found.numbered_names(),
                count - 1
            )));
        }
        (chosen, _) => chosen,
    };
    let (mut slabs, mut dims) = (Vec::new(), None);
    for &channel in channels {
        check("component", "channel(s)", channel, found.channels.len())?;
        let names = [
            "DataSet".to_owned(),
            format!("ResolutionLevel {level}"),
            format!("TimePoint {time}"),
            format!("Channel {channel}"),
        ];
        let place = group(root, &names.each_ref().map(String::as_str));
        let data = place.and_then(|place| Some((place, place.variable("Data")?)));
        let path = format!("{}/Data", names.join("/"));
        let (place, data) = data.ok_or_else(|| format!("it has no array {path}"))?;
        let held: Vec<u64> = data.dimensions.iter().map(|axis| axis.size).collect();
        let size = ["Z", "Y", "X"].map(|axis| {
            let named = numbers(&place.attributes, &format!("ImageSize{axis}"));
            named.and_then(|named| named.first().map(|&size| narrow::whole(size)))
        });
        let shape: Vec<usize> = held
            .iter()
            .zip(size)
            .map(|(&held, size)| {
                // The rest of a chunk is padding.
                let size = size.filter(|size| (1..=held).contains(size));
                usize::try_from(size.unwrap_or(held)).unwrap_or(usize::MAX)
            })
            .collect();
        let [z, y, x] = <[usize; 3]>::try_from(shape)
            .ok()
            .filter(|_| held.len() == 3)
            .ok_or_else(|| format!("the array {path} has {} axes: expected 3", held.len()))?;
        if dims.is_some_and(|dims| dims != [x, y, z]) {
            return Err(Fault::Invalid("its channels have unlike sizes".to_owned()));
        }
        dims = Some([x, y, z]);
        slabs.push(Slab {
            path,
            taken: [z, y, x].map(Taken::First).to_vec(),
        });
    }
    Ok(Plan {
        slabs,
        lattice: lattice(root, dims.unwrap_or([1; 3])),
        values: Values::default(),
    })
}

fn check(option: &str, what: &str, chosen: usize, count: usize) -> Result<(), Fault> {
    if chosen < count {
        return Ok(());
    }
    Err(Fault::Option(format!(
        "{option}={chosen}: the image has {count} {what}, counted from 0"
    )))
}

/// The image reaches from corner to corner; a voxel's place is its middle.
fn lattice(root: &NcGroup, dims: [usize; 3]) -> Lattice {
    let facts = group(root, &["DataSetInfo", "Image"]);
    let attributes = facts.map_or(&[][..], |facts| &facts.attributes);
    let corner = |name: &str, axis: usize| {
        numbers(attributes, &format!("{name}{axis}"))?
            .first()
            .copied()
    };
    let mut steps = [DVec3::ZERO; 3];
    let mut first = DVec3::ZERO;
    for axis in 0..3 {
        let ends = corner("ExtMin", axis).zip(corner("ExtMax", axis));
        let (low, high) = ends
            .filter(|(low, high)| high > low)
            .unwrap_or((0.0, dims[axis] as f64));
        let step = (high - low) / dims[axis] as f64;
        steps[axis][axis] = step;
        first[axis] = low + 0.5 * step;
    }
    Lattice {
        unit: text(attributes, "Unit").and_then(|unit| axes::unit(&unit)),
        ..Lattice::unnamed(dims, placed(steps, first))
    }
}
