//! MINC, `.mnc`, of the McConnell Brain Imaging Centre: an array `image` over axes that are called `xspace`, `yspace` and `zspace`.
//!
//! MINC 1 is a NetCDF file with the arrays in its root, MINC 2 an HDF5 file with the group `minc-2.0`. Each axis has a start, a step and
//! direction cosines in a world whose x points right, y forward and z up. Integers stand for real numbers: the valid range for the range
//! between `image-min` and `image-max`, which may change from slice to slice.
//! Source: the MINC 2 format description, BIC-MNI.

use glam::DVec3;
use netcdf_reader::{NcFile, NcGroup, NcType};

use crate::input::decode::component;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::hdf5::plan::{Plan, Scaling, Slab, Values, placed};
use crate::input::formats::hdf5::slab::Taken;
use crate::input::formats::hdf5::tree::{Found, arrays};
use crate::input::options::LoadOptions;
use crate::volume::Lattice;

/// Names of the axes, and their directions where no cosines are given.
const AXES: [(&str, DVec3); 3] = [
    ("xspace", DVec3::X),
    ("yspace", DVec3::Y),
    ("zspace", DVec3::Z),
];

/// The arrays of an image, by their names behind the groups.
pub(crate) struct Image<'a> {
    all: Vec<Found<'a>>,
    image: Found<'a>,
    /// Names of the image's axes.
    axes: Vec<String>,
}

/// The image, if the arrays are those of MINC.
pub(crate) fn image(root: &NcGroup) -> Option<Image<'_>> {
    let all = arrays(root);
    let image = all
        .iter()
        .find(|array| matches!(array.path.as_str(), "image" | "minc-2.0/image/0/image"))?
        .clone();
    let axes: Vec<String> = match image.text("dimorder") {
        Some(order) => order
            .split(',')
            .map(|name| name.trim().to_owned())
            .collect(),
        None => (image.variable.dimensions.iter())
            .map(|axis| axis.name.clone())
            .collect(),
    };
    let is_image = axes.len() == image.variable.ndim()
        && axes
            .iter()
            .any(|axis| AXES.iter().any(|(name, _)| name == axis));
    is_image.then_some(Image { all, image, axes })
}

impl Image<'_> {
    fn found(&self, name: &str) -> Option<&Found<'_>> {
        self.all
            .iter()
            .find(|array| array.path.rsplit('/').next() == Some(name))
    }

    fn size_of(&self, axis: &str) -> usize {
        let at = self.axes.iter().position(|name| name == axis);
        at.map_or(1, |at| self.image.shape()[at])
    }

    /// Points in time.
    pub(crate) fn times(&self) -> usize {
        self.size_of("time")
    }

    /// The image at the wanted time, of the wanted components of vectors.
    pub(crate) fn plan(
        &self,
        file: &NcFile,
        options: &LoadOptions,
        components: &[usize],
    ) -> Result<Plan, Fault> {
        let shape = self.image.shape();
        let chosen = |option: &str, axis: &str, index: usize| {
            let size = self.size_of(axis);
            if index < size {
                return Ok(Taken::Only(index));
            }
            Err(Fault::Option(format!(
                "{option}={index}: the image has {size} along {axis}, counted from 0"
            )))
        };
        let time = chosen("time", "time", options.time.unwrap_or(0))?;
        let vectors = self.size_of("vector_dimension");
        let components = component::chosen(components, vectors)?;
        let (mut steps, mut first, mut dims) = ([DVec3::ZERO; 3], DVec3::ZERO, [1; 3]);
        let mut spatial = Vec::new();
        for (name, &size) in self.axes.iter().zip(&shape) {
            if let Some((_, direction)) = AXES.iter().find(|(axis, _)| axis == name) {
                spatial.push((self.axis(name, *direction), size));
            } else if !matches!(name.as_str(), "time" | "vector_dimension") {
                return Err(unsupported(format!("its image has an axis {name}")));
            }
        }
        // The last axis is x of the voxels, whatever its name.
        for (place, ((step, start), size)) in spatial.into_iter().rev().enumerate() {
            (steps[place], dims[place]) = (step, size);
            first += start;
        }
        fill_up(&mut steps);
        let slab = |&component: &usize| {
            let component = chosen("component", "vector_dimension", component)?;
            let taken = self
                .axes
                .iter()
                .zip(&shape)
                .map(|(name, &size)| match name.as_str() {
                    "time" => time,
                    "vector_dimension" => component,
                    _ => Taken::First(size),
                });
            Ok(Slab {
                path: self.image.path.clone(),
                taken: taken.collect(),
            })
        };
        Ok(Plan {
            slabs: components.iter().map(slab).collect::<Result<_, Fault>>()?,
            lattice: Lattice {
                up_hint: Some(DVec3::Z),
                space: Some("right-anterior-superior".to_owned()),
                unit: Some("mm".to_owned()),
                ..Lattice::unnamed(dims, placed(steps, first))
            },
            values: self.values(file, time, dims[2])?,
        })
    }

    /// The step along an axis in the world, and what its start adds to the place of the first voxel.
    fn axis(&self, name: &str, direction: DVec3) -> (DVec3, DVec3) {
        let facts = self.found(name);
        let number = |what: &str| {
            let number = facts.and_then(|facts| facts.number(what));
            number.filter(|number| number.is_finite())
        };
        let cosines = facts.and_then(|facts| facts.numbers("direction_cosines"));
        let direction = cosines
            .and_then(|numbers| <[f64; 3]>::try_from(numbers).ok())
            .map(DVec3::from_array)
            .and_then(DVec3::try_normalize)
            .unwrap_or(direction);
        let step = number("step").filter(|&step| step != 0.0).unwrap_or(1.0);
        (step * direction, number("start").unwrap_or(0.0) * direction)
    }

    /// From stored numbers to real ones, slice by slice.
    fn values(&self, file: &NcFile, time: Taken, slices: usize) -> Result<Values, Fault> {
        let is_unsigned = self
            .image
            .text("signtype")
            .is_some_and(|sign| sign.starts_with("unsigned"));
        let scaling = match self.stored_range(is_unsigned) {
            None => Scaling::None,
            Some(range) => self.scaling(file, range, time, slices)?,
        };
        Ok(Values {
            is_unsigned,
            missing: Vec::new(),
            scaling,
        })
    }

    fn scaling(
        &self,
        file: &NcFile,
        [low, high]: [f64; 2],
        time: Taken,
        slices: usize,
    ) -> Result<Scaling, Fault> {
        let (Some(least), Some(most)) = (self.found("image-min"), self.found("image-max")) else {
            return Ok(Scaling::None);
        };
        let ends = |of: &Found| {
            let read = file.read_variable_as_f64(&of.path);
            let all =
                read.map_err(|error| format!("the array {} cannot be read: {error}", of.path))?;
            let all: Vec<f64> = all.iter().copied().collect();
            let row = match time {
                Taken::Only(time) if all.len() == self.times() * slices => time * slices,
                _ => 0,
            };
            match all.len() {
                1 => Ok(vec![all[0]; slices]),
                count if count == slices || count == self.times() * slices => {
                    Ok(all[row..row + slices].to_vec())
                }
                count => Err(unsupported(format!(
                    "the array {} has {count} elements: expected one, or one for each of {slices} slices",
                    of.path
                ))),
            }
        };
        let pairs: Vec<[f64; 2]> = ends(least)?
            .into_iter()
            .zip(ends(most)?)
            .map(|(from, to)| {
                let slope = (to - from) / (high - low);
                [slope, from - slope * low]
            })
            .collect();
        if pairs.iter().flatten().any(|number| !number.is_finite()) {
            return Err(Fault::Invalid(
                "image-min, image-max or the valid range is not finite".to_owned(),
            ));
        }
        Ok(match pairs.first() {
            Some(&first) if pairs.iter().all(|&pair| pair == first) => Scaling::Whole(first),
            _ => Scaling::Slices(pairs),
        })
    }

    /// The range of stored integers; `None` for real numbers, which stand for themselves.
    fn stored_range(&self, is_unsigned: bool) -> Option<[f64; 2]> {
        let given = self.image.numbers("valid_range");
        let given = given.and_then(|range| <[f64; 2]>::try_from(range).ok());
        let ends = || {
            Some([
                self.image.number("valid_min")?,
                self.image.number("valid_max")?,
            ])
        };
        let (bits, is_unsigned) = match self.image.variable.dtype {
            NcType::Byte => (8, is_unsigned),
            NcType::UByte => (8, true),
            NcType::Short => (16, is_unsigned),
            NcType::UShort => (16, true),
            NcType::Int => (32, is_unsigned),
            NcType::UInt => (32, true),
            _ => return None,
        };
        let all = if is_unsigned {
            [0.0, 2f64.powi(bits) - 1.0]
        } else {
            [-(2f64.powi(bits - 1)), 2f64.powi(bits - 1) - 1.0]
        };
        let range = given.or_else(ends).unwrap_or(all);
        Some(if range[0] < range[1] { range } else { all })
    }
}

/// Gives axes that the image lacks a step at right angles to the others.
fn fill_up(steps: &mut [DVec3; 3]) {
    if steps[1] == DVec3::ZERO {
        steps[1] = steps[0].any_orthogonal_vector().normalize() * steps[0].length();
    }
    if steps[2] == DVec3::ZERO {
        steps[2] = steps[0].cross(steps[1]).normalize_or(DVec3::Z) * steps[0].length();
    }
}
