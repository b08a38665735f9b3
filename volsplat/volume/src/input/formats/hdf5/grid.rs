//! Arrays of numbers as programs of simulation, climate and microscopy store them: the last three axes are z, y and x.
//!
//! The name of an axis, the units of its coordinates (CF conventions) or `axistags` (ilastik) say that it is one of time or channels. Coordinates
//! along the axes give the places of voxels; else `element_size_um` gives their sizes.
//! Limits: one or two axes beside those of space; steps along an axis that change are drawn as equal.

use glam::DVec3;
use netcdf_reader::{NcFile, NcGroup};
use resample_io::Gate;
use serde_json::Value;

use crate::input::axes;
use crate::input::axes::{ImageAxes, ImageChannel};
use crate::input::decode::component;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::hdf5::placed;
use crate::input::formats::hdf5::plan::{Plan, Scaling, Slab, Values, placed as axes_placed};
use crate::input::formats::hdf5::slab::Taken;
use crate::input::formats::hdf5::tree::{Found, arrays, is_number, text};
use crate::input::options::LoadOptions;
use crate::volume::Lattice;

/// Names of axes of time.
const TIMES: [&str; 6] = ["t", "time", "times", "valid_time", "frame", "frames"];

/// Names of axes of channels.
const CHANNELS: [&str; 4] = ["c", "channel", "channels", "band"];

/// Most elements of a last axis that is taken for the components of a vector or a colour, and not for x. A guess.
const MOST_COMPONENTS: usize = 4;

/// Steps along an axis are equal if none differs from their mean by a larger part of it.
const EQUAL_STEPS: f64 = 1e-3;

/// The meaning of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axis {
    Space,
    Time,
    Channel,
    /// Parts of a vector or a colour.
    Component,
    /// One element, which is taken.
    Single,
}

/// The arrays that may be drawn: numbers on three axes, or on two where no array has three.
pub(crate) fn drawable(root: &NcGroup) -> Vec<Found<'_>> {
    let extents = |found: &Found| found.shape().iter().filter(|&&size| size > 1).count();
    let mut all = arrays(root);
    all.retain(|found| is_number(&found.variable.dtype) && extents(found) >= 2);
    if all.iter().any(|found| extents(found) >= 3) {
        all.retain(|found| extents(found) >= 3);
    }
    all
}

/// The first of the largest arrays.
pub(crate) fn largest<'a, 'b>(all: &'b [Found<'a>]) -> Option<&'b Found<'a>> {
    let size = |found: &Found| found.shape().into_iter().fold(1, usize::saturating_mul);
    let most = all.iter().map(size).max();
    all.iter().find(|found| Some(size(found)) == most)
}

/// The array of a name, or the largest one.
fn chosen<'a>(all: &[Found<'a>], name: Option<&str>) -> Result<Found<'a>, Fault> {
    let names = || {
        let names: Vec<&str> = all.iter().map(|found| found.path.as_str()).collect();
        names.join(", ")
    };
    let Some(name) = name else {
        return largest(all).cloned().ok_or_else(|| {
            unsupported(
                "it holds no array of integers, or of real numbers of 32 or 64 bits, with two axes or more",
            )
        });
    };
    let wanted = name.trim_matches('/');
    let whole = all.iter().find(|found| found.path == wanted);
    let mut ends = all
        .iter()
        .filter(|found| found.path.rsplit('/').next() == Some(wanted));
    let one = whole.or_else(|| ends.next().filter(|_| ends.next().is_none()));
    one.cloned()
        .ok_or_else(|| Fault::Option(format!("array={name}: it holds {}", names())))
}

/// The channels and points in time of the chosen array.
pub(crate) fn axes(root: &NcGroup, name: Option<&str>) -> Result<ImageAxes, Fault> {
    let found = chosen(&drawable(root), name)?;
    let meanings = meanings(&found)?;
    let size_of = |axis: Axis| {
        let at = meanings.iter().position(|meaning| *meaning == axis);
        at.map_or(1, |at| found.shape()[at])
    };
    Ok(ImageAxes {
        channels: vec![ImageChannel::default(); size_of(Axis::Channel)],
        times: size_of(Axis::Time),
    })
}

/// The meaning of each axis.
fn meanings(found: &Found) -> Result<Vec<Axis>, Fault> {
    let shape = found.shape();
    let names = names(found);
    let mut meanings: Vec<Axis> = (names.iter().zip(&shape))
        .map(|(name, &size)| match name.to_lowercase() {
            _ if size <= 1 => Axis::Single,
            name if TIMES.contains(&name.as_str()) => Axis::Time,
            _ if is_time(found, name) => Axis::Time,
            name if CHANNELS.contains(&name.as_str()) => Axis::Channel,
            _ => Axis::Space,
        })
        .collect();
    let spatial = |meanings: &[Axis]| -> Vec<usize> {
        let all = 0..meanings.len();
        all.filter(|&axis| meanings[axis] == Axis::Space).collect()
    };
    let all = spatial(&meanings);
    if let [.., z, y, x, last] = all[..]
        && shape[last] <= MOST_COMPONENTS
        && [z, y, x].iter().all(|&axis| shape[axis] > MOST_COMPONENTS)
    {
        meanings[last] = Axis::Component;
    }
    // An axis before those of space is one of time, or of whatever else there are several volumes of.
    for axis in spatial(&meanings).into_iter().rev().skip(3) {
        if meanings.contains(&Axis::Time) {
            return Err(unsupported(format!(
                "the array {} has the axes {} of {shape:?} elements: a volume has three axes, and one of time and one of channels at most",
                found.path,
                names.join(", ")
            )));
        }
        meanings[axis] = Axis::Time;
    }
    // Axes of one element make up three axes, so that a slice keeps its place.
    for axis in (0..shape.len()).rev() {
        if meanings[axis] == Axis::Single && spatial(&meanings).len() < 3 {
            let is_named = TIMES.contains(&names[axis].to_lowercase().as_str())
                || CHANNELS.contains(&names[axis].to_lowercase().as_str())
                || is_time(found, &names[axis]);
            if !is_named {
                meanings[axis] = Axis::Space;
            }
        }
    }
    Ok(meanings)
}

fn names(found: &Found) -> Vec<String> {
    let axes = &found.variable.dimensions;
    let tags = found.text("axistags");
    let tags = tags.and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let keys: Option<Vec<String>> = tags.and_then(|tags| {
        let axes = tags["axes"].as_array()?.iter();
        axes.map(|axis| Some(axis["key"].as_str()?.to_owned()))
            .collect()
    });
    let names = axes.iter().map(|axis| axis.name.clone()).collect();
    keys.filter(|keys| keys.len() == axes.len())
        .unwrap_or(names)
}

/// True where the coordinates count from a date.
fn is_time(found: &Found, axis: &str) -> bool {
    let coordinates = found.coordinates(axis);
    let units = coordinates.and_then(|(_, array)| text(&array.attributes, "units"));
    units.is_some_and(|units| units.contains(" since "))
}

/// The wanted part of the chosen array.
pub(crate) fn plan(
    (file, root): (&NcFile, &NcGroup),
    options: &LoadOptions,
    components: &[usize],
) -> Result<Plan, Fault> {
    let all = drawable(root);
    let found = chosen(&all, options.array.as_deref())?;
    if options.array.is_none() && all.len() > 1 {
        options.gate.remark(format!(
            "of {} arrays, {} is read, the largest: #array=NAME names another",
            all.len(),
            found.path
        ));
    }
    let (shape, meanings) = (found.shape(), meanings(&found)?);
    let is_inner = |meaning: &Axis| matches!(meaning, Axis::Channel | Axis::Component);
    let (inner, time) = (
        meanings.iter().position(is_inner),
        meanings.iter().position(|meaning| *meaning == Axis::Time),
    );
    let one = |option: &str, axis: Option<usize>, index: usize| match axis.map_or(1, |at| shape[at])
    {
        size if index < size => Ok(Taken::Only(index)),
        size => Err(Fault::Option(format!(
            "{option}={index}: the array {} has {size}, counted from 0",
            found.path
        ))),
    };
    let when = one("time", time, options.time.unwrap_or(0))?;
    let components = component::chosen(components, inner.map_or(1, |axis| shape[axis]))?;
    let slab = |&component: &usize| {
        let component = one("component", inner, component)?;
        let taken = meanings
            .iter()
            .zip(&shape)
            .map(|(meaning, &size)| match meaning {
                Axis::Space => Taken::First(size),
                Axis::Time => when,
                Axis::Channel | Axis::Component => component,
                Axis::Single => Taken::Only(0),
            });
        Ok(Slab {
            path: found.path.clone(),
            taken: taken.collect(),
        })
    };
    Ok(Plan {
        slabs: components.iter().map(slab).collect::<Result<_, Fault>>()?,
        lattice: lattice(file, &found, &meanings, &options.gate)?,
        values: values(&found),
    })
}

/// Slope, offset and marks of missing values, as the CF conventions name them.
fn values(found: &Found) -> Values {
    let [slope, offset] = ["scale_factor", "add_offset"].map(|name| found.number(name));
    let scaling = match [slope.unwrap_or(1.0), offset.unwrap_or(0.0)] {
        [1.0, 0.0] => Scaling::None,
        pair if pair[0] != 0.0 && pair.iter().all(|part| part.is_finite()) => Scaling::Whole(pair),
        _ => Scaling::None,
    };
    let missing = ["_FillValue", "missing_value"].map(|name| found.numbers(name));
    Values {
        is_unsigned: found.text("_Unsigned").is_some_and(|text| text == "true"),
        missing: missing.into_iter().flatten().flatten().collect(),
        scaling,
    }
}

/// Places along one axis.
struct Places {
    first: f64,
    step: f64,
    unit: Option<String>,
    is_vertical: bool,
}

fn lattice(file: &NcFile, found: &Found, meanings: &[Axis], gate: &Gate) -> Result<Lattice, Fault> {
    let (names, shape) = (names(found), found.shape());
    let spatial = (0..shape.len()).filter(|&axis| meanings[axis] == Axis::Space);
    // The last axis is x.
    let spatial: Vec<usize> = spatial.collect::<Vec<_>>().into_iter().rev().collect();
    let sizes = found.numbers("element_size_um");
    let mut dims = [1; 3];
    for (place, &axis) in spatial.iter().enumerate() {
        dims[place] = shape[axis];
    }
    if let Some(lattice) = placed::lattice(file, found, dims)? {
        return Ok(lattice);
    }
    let mut all = Vec::new();
    for (place, &axis) in spatial.iter().enumerate() {
        let along = match found.coordinates(&names[axis]) {
            Some(_) => places(file, found, &names[axis], gate)?,
            None => {
                // Listed as the axes of space are, z first.
                let size = sizes.as_ref().and_then(|sizes| {
                    let at = sizes.len().checked_sub(1 + place)?;
                    Some(sizes[at]).filter(|&size| size > 0.0 && size.is_finite())
                });
                Places {
                    first: 0.0,
                    step: size.unwrap_or(1.0),
                    unit: size.map(|_| "micrometer".to_owned()),
                    is_vertical: false,
                }
            }
        };
        all.push(along);
    }
    let is_up = all.get(2).is_some_and(|z| z.is_vertical);
    if let [x, y, z] = &mut all[..]
        && x.unit == y.unit
        && x.unit != z.unit
    {
        // Degrees beside metres or pressures: a common scale would flatten the volume.
        let step = 0.5 * (x.step.abs() + y.step.abs()) * z.step.signum();
        gate.remark(format!(
            "the axis {} has the unit {}, the others {}: its steps are drawn as long as theirs; --spacing X,Y,Z sets others",
            names[spatial[2]],
            z.unit.as_deref().unwrap_or("of its own"),
            x.unit.as_deref().unwrap_or("of their own")
        ));
        z.first *= step / z.step;
        z.step = step;
    }
    let unit = all.first().and_then(|x| axes::unit(x.unit.as_deref()?));
    let is_same = all.windows(2).all(|pair| pair[0].unit == pair[1].unit);
    let mut steps = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut first = DVec3::ZERO;
    for (axis, places) in all.iter().enumerate() {
        steps[axis] *= places.step;
        first[axis] = places.first;
    }
    if all.len() < 3 {
        steps[2] *= steps[0].length();
    }
    Ok(Lattice {
        unit: unit.filter(|_| is_same),
        up_hint: is_up.then_some(DVec3::Z),
        ..Lattice::unnamed(dims, axes_placed(steps, first))
    })
}

/// The places that the coordinates along an axis give.
fn places(file: &NcFile, found: &Found, axis: &str, gate: &Gate) -> Result<Places, Fault> {
    let (path, array) = found
        .coordinates(axis)
        .ok_or_else(|| format!("the axis {axis} has no coordinates"))?;
    let unit = text(&array.attributes, "units");
    // Depths and pressures grow downwards.
    let positive = text(&array.attributes, "positive");
    let sign = if positive.as_deref() == Some("down") {
        -1.0
    } else {
        1.0
    };
    let even = Places {
        first: 0.0,
        step: sign,
        unit: unit.clone(),
        is_vertical: positive.is_some(),
    };
    if !is_number(&array.dtype) {
        return Ok(even);
    }
    let read = file.read_variable_as_f64(&path);
    let read = read.map_err(|error| format!("the array {path} cannot be read: {error}"))?;
    let at: Vec<f64> = read.iter().map(|place| sign * place).collect();
    let (Some(&first), Some(&last)) = (at.first(), at.last()) else {
        return Ok(even);
    };
    let mean = (last - first) / (at.len() - 1) as f64;
    if !(mean.is_finite() && mean != 0.0) {
        return Ok(Places { first, ..even });
    }
    let steps = at.windows(2).map(|pair| (pair[1] - pair[0]) / mean);
    let [least, most] = steps.fold([1.0f64, 1.0f64], |[least, most], step| {
        [least.min(step), most.max(step)]
    });
    // Decimal places are rounded when they are stored.
    if least < 1.0 - EQUAL_STEPS || most > 1.0 + EQUAL_STEPS {
        gate.remark(format!(
            "the axis {axis} has uneven steps, {} to {} of their mean: they are drawn as equal",
            short(least),
            short(most)
        ));
    }
    Ok(Places {
        first,
        step: mean,
        ..even
    })
}

fn short(number: f64) -> String {
    format!("{number:.2}")
}
