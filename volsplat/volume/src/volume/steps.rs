//! The values of a volume that changes over time, all steps together: for a look and a view that hold for every step.
//!
//! Takes the volumes one after the other and keeps their histograms, their ranges, and where in the world their values lie. Limits: places are
//! boxes of 64 equal ranges of a step's values.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::narrow::{count, whole};

use crate::volume::{Described, Histogram, Lattice, Volume, VoxelType, scalar, with_voxels};

/// Ranges of a step's values that have a box each. A guess: what is visible is then known to 1/64 of the range.
const RANGES: usize = 64;

/// All steps of a volume that changes over time.
#[derive(Clone, Debug)]
pub struct Steps {
    lattice: Lattice,
    voxel_type: VoxelType,
    range: (f64, f64),
    histograms: Vec<Histogram>,
    places: Vec<Place>,
}

/// The voxels of a range of values: least and greatest of them, and the box around the voxels' cells in the world.
#[derive(Clone, Copy, Debug)]
struct Place {
    values: (f64, f64),
    corners: [DVec3; 2],
}

impl Steps {
    /// The first step, whose grid counts as that of all.
    pub fn new(first: &Volume) -> Self {
        let mut steps = Self {
            lattice: first.lattice(),
            voxel_type: first.voxel_type(),
            range: first.value_range(),
            histograms: Vec::new(),
            places: Vec::new(),
        };
        steps.add(first);
        steps
    }

    /// Adds a step.
    pub fn add(&mut self, volume: &Volume) {
        let (low, high) = volume.value_range();
        self.range = (self.range.0.min(low), self.range.1.max(high));
        self.histograms.push(volume.histogram());
        self.places.extend(places(volume));
    }

    /// The box in the world around all that is shown of all steps; `shows` says whether any value from the first to the second is shown. `None`
    /// where nothing is.
    pub fn box_where(&self, shows: impl Fn(f64, f64) -> bool) -> Option<[DVec3; 2]> {
        let shown = self.places.iter().filter(|place| {
            let (least, most) = place.values;
            shows(least, most)
        });
        shown
            .map(|place| place.corners)
            .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }
}

impl Described for Steps {
    fn lattice(&self) -> Lattice {
        self.lattice.clone()
    }

    fn voxel_type(&self) -> VoxelType {
        self.voxel_type
    }

    fn value_range(&self) -> (f64, f64) {
        self.range
    }

    fn histogram(&self) -> Histogram {
        let is_integer = !matches!(self.voxel_type, VoxelType::F32 | VoxelType::F64);
        Histogram::merged(&self.histograms, is_integer)
    }
}

/// The boxes of the ranges of a step's values that occur.
fn places(volume: &Volume) -> Vec<Place> {
    let [columns, rows, slices] = volume.dims;
    let (low, high) = volume.value_range();
    let per_range = (high - low) / RANGES as f64;
    let range_of = |value: f64| {
        let place = (value - low) / per_range;
        // A volume of one value has ranges of no width.
        if place > 0.0 {
            count(whole(place)).min(RANGES - 1)
        } else {
            0
        }
    };
    let of_slice = |z: usize| {
        let mut parts = [Part::NOTHING; RANGES];
        with_voxels!(&volume.voxels, values => {
            let slice = &values[z * columns * rows..(z + 1) * columns * rows];
            for (index, &value) in slice.iter().enumerate() {
                let (value, at) = (scalar(value), [index % columns, index / columns, z]);
                parts[range_of(value)].widen(&Part { values: (value, value), ends: [at, at] });
            }
        });
        parts
    };
    let joined = |mut one: [Part; RANGES], other: [Part; RANGES]| {
        one.iter_mut()
            .zip(&other)
            .for_each(|(one, other)| one.widen(other));
        one
    };
    let parts = (0..slices)
        .into_par_iter()
        .map(of_slice)
        .reduce(|| [Part::NOTHING; RANGES], joined);
    let place = |part: Part| {
        let [from, to] = part.ends;
        (from[0] <= to[0]).then(|| Place {
            values: part.values,
            corners: in_world(volume, from, to),
        })
    };
    parts.into_iter().filter_map(place).collect()
}

/// The voxels of a range of values: least and greatest value, first and last index along each axis.
#[derive(Clone, Copy)]
struct Part {
    values: (f64, f64),
    ends: [[usize; 3]; 2],
}

impl Part {
    const NOTHING: Self = Self {
        values: (f64::INFINITY, f64::NEG_INFINITY),
        ends: [[usize::MAX; 3], [0; 3]],
    };

    fn widen(&mut self, other: &Self) {
        let (least, most) = other.values;
        self.values = (self.values.0.min(least), self.values.1.max(most));
        let [from, to] = other.ends;
        for axis in 0..3 {
            self.ends[0][axis] = self.ends[0][axis].min(from[axis]);
            self.ends[1][axis] = self.ends[1][axis].max(to[axis]);
        }
    }
}

/// The box in the world around the cells of the voxels from one to another: samples reach to their neighbours.
fn in_world(volume: &Volume, from: [usize; 3], to: [usize; 3]) -> [DVec3; 2] {
    let end = |index: [usize; 3], step: f64, axis: usize| {
        let last = volume.dims[axis] as f64 - 1.0;
        (index[axis] as f64 + step).clamp(0.0, last.max(0.0))
    };
    let low = DVec3::from_array([0, 1, 2].map(|axis| end(from, -1.0, axis)));
    let high = DVec3::from_array([0, 1, 2].map(|axis| end(to, 1.0, axis)));
    let corners = (0..8).map(|corner| {
        let pick = |axis: usize| {
            if corner >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        volume
            .world_from_index
            .transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    });
    let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    corners.fold(nothing, |[least, most], corner| {
        [least.min(corner), most.max(corner)]
    })
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::volume::Voxels;

    /// 8x4x2 voxels of 0, but one of `value` at x.
    fn step(x: usize, value: f32) -> Volume {
        let mut voxels = vec![0.0; 64];
        voxels[x + 8] = value;
        let place = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
        Volume::new([8, 4, 2], Voxels::F32(voxels), place).expect("a volume")
    }

    #[test]
    fn steps_have_the_range_the_counts_and_the_places_of_all() {
        let mut steps = Steps::new(&step(1, 5.0));
        steps.add(&step(6, 9.0));
        assert_eq!(steps.value_range(), (0.0, 9.0));
        assert_eq!(steps.histogram().range(), (0.0, 9.0));
        assert_eq!(steps.histogram().counts().iter().sum::<u64>(), 128);
        // The first shows x 0 to 2, the second 5 to 7, in steps of 2.
        let of = |low: f64, high: f64| steps.box_where(|least, most| least <= high && most >= low);
        let [from, to] = of(4.5, 10.0).expect("both");
        assert_eq!((from.x, to.x), (0.0, 14.0));
        let [from, to] = of(8.0, 10.0).expect("the second");
        assert_eq!((from.x, to.x, from.y, to.y), (10.0, 14.0, 0.0, 2.0));
        assert!(of(9.5, 10.0).is_none());
    }

    #[test]
    fn a_step_of_one_value_lies_everywhere() {
        let flat =
            Volume::new([2, 2, 2], Voxels::U8(vec![7; 8]), DAffine3::IDENTITY).expect("a volume");
        let steps = Steps::new(&flat);
        let all = Some([DVec3::ZERO, DVec3::ONE]);
        assert_eq!(
            steps.box_where(|least, most| (least, most) == (7.0, 7.0)),
            all
        );
        assert_eq!(steps.box_where(|_, most| most > 7.0), None);
    }
}
