//! The volume: a lattice of scalars and where it lies in the world.
//!
//! Takes voxels in the type in which they are stored and an affine map, checks both, and returns the domain object that
//! every later stage reads. A voxel stands at a vertex of the lattice: voxel (i, j, k) is at
//! `world_from_index * (i, j, k)`, so a volume of n voxels along an axis is n - 1 spacings long. After
//! [`Volume::new`] no voxel is NaN or infinite and the axes span space, so later stages need no such checks.
//! Limits: one scalar per voxel; 64-bit integers are held as f64, which rounds values beyond 2^53.

use std::ops::Range;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::Error;

pub use crate::with_voxels;

/// Lengths from its inverse to this are f32 numbers of full precision.
const LONGEST: f64 = 8.507_059_173_023_462e37;

/// A scalar volume in the world.
///
/// [`Volume::new`] checks the promises that the fields' docs make; code that changes a field keeps them.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Number of voxels along x, y and z, each at least 1.
    pub dims: [usize; 3],
    /// The scalars, x fastest, then y; as many as the product of `dims`, all finite.
    pub voxels: Voxels,
    /// World position of voxel (i, j, k); finite, and its three axes are not in one plane. May be sheared or mirrored.
    pub world_from_index: DAffine3,
    /// The world direction that points up for a viewer (a unit vector), where the file says which one that is.
    pub up_hint: Option<DVec3>,
    /// The name of the world space as the file gives it, such as "left-posterior-superior".
    pub space: Option<String>,
    /// The kind of scanner, where the file names it.
    pub modality: Option<Modality>,
    /// The unit of lengths, such as `mm` or `µm`, where the file tells it.
    pub unit: Option<String>,
    /// The scalars at black and at white in slices, ascending, where the file has a window.
    pub window: Option<[f64; 2]>,
}

/// The kind of scanner that a volume comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Modality {
    /// Computed tomography.
    Ct,
    /// Magnetic resonance.
    Mr,
}

/// Where a volume lies and how large it is, without its scalars.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// Number of voxels along x, y and z.
    pub dims: [usize; 3],
    /// World position of voxel (i, j, k).
    pub world_from_index: DAffine3,
    /// The world direction that points up for a viewer (a unit vector), where the file says which one that is.
    pub up_hint: Option<DVec3>,
    /// The name of the world space as the file gives it.
    pub space: Option<String>,
    /// The kind of scanner, where the file names it.
    pub modality: Option<Modality>,
    /// The unit of lengths, such as `mm` or `µm`, where the file tells it.
    pub unit: Option<String>,
    /// The scalars at black and at white in slices, ascending, where the file has a window.
    pub window: Option<[f64; 2]>,
}

#[cfg(feature = "input")]
impl Lattice {
    /// A lattice in a world without a name and without a known up.
    pub(crate) fn unnamed(dims: [usize; 3], world_from_index: DAffine3) -> Self {
        Self {
            dims,
            world_from_index,
            up_hint: None,
            space: None,
            modality: None,
            unit: None,
            window: None,
        }
    }
}

/// Scalars in the type in which they were stored.
#[derive(Clone, Debug, PartialEq)]
pub enum Voxels {
    /// Unsigned, 8 bits.
    U8(Vec<u8>),
    /// Signed, 8 bits.
    I8(Vec<i8>),
    /// Unsigned, 16 bits.
    U16(Vec<u16>),
    /// Signed, 16 bits.
    I16(Vec<i16>),
    /// Unsigned, 32 bits.
    U32(Vec<u32>),
    /// Signed, 32 bits.
    I32(Vec<i32>),
    /// IEEE single.
    F32(Vec<f32>),
    /// IEEE double; 64-bit integers are held here too, rounded beyond 2^53.
    F64(Vec<f64>),
}

/// The treatment of voxels that are NaN or infinite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum NanPolicy {
    /// The volume is refused.
    #[default]
    Refuse,
    /// Each such voxel becomes this value, which must be finite in the voxel type.
    Replace(f64),
}

/// Binds the typed slice of a [`Voxels`] and runs the body once per type: `with_voxels!(&voxels, slice => body)`.
///
/// In the body, [`scalar`] gives a value of any of the types as f64.
#[macro_export]
macro_rules! with_voxels {
    ($voxels:expr, $slice:ident => $body:expr) => {
        match $voxels {
            $crate::volume::Voxels::U8($slice) => $body,
            $crate::volume::Voxels::I8($slice) => $body,
            $crate::volume::Voxels::U16($slice) => $body,
            $crate::volume::Voxels::I16($slice) => $body,
            $crate::volume::Voxels::U32($slice) => $body,
            $crate::volume::Voxels::I32($slice) => $body,
            $crate::volume::Voxels::F32($slice) => $body,
            $crate::volume::Voxels::F64($slice) => $body,
        }
    };
}

/// Other voxels of the same type: `map_voxels!(voxels, values => f(&values))`.
#[cfg(feature = "input")]
macro_rules! map_voxels {
    ($voxels:expr, $values:ident => $body:expr) => {
        match $voxels {
            Voxels::U8($values) => Voxels::U8($body),
            Voxels::I8($values) => Voxels::I8($body),
            Voxels::U16($values) => Voxels::U16($body),
            Voxels::I16($values) => Voxels::I16($body),
            Voxels::U32($values) => Voxels::U32($body),
            Voxels::I32($values) => Voxels::I32($body),
            Voxels::F32($values) => Voxels::F32($body),
            Voxels::F64($values) => Voxels::F64($body),
        }
    };
}
#[cfg(feature = "input")]
pub(crate) use map_voxels;

/// A stored value as f64, exactly.
pub fn scalar<T: Into<f64>>(value: T) -> f64 {
    value.into()
}

/// Voxels per parallel task of a streaming pass: a few hundred kB, so that a task outweighs its own overhead. A guess.
const VOXELS_PER_TASK: usize = 1 << 18;

/// Least |determinant| of the axes, each scaled to length 1. Below it the axes lie within 1e-6 rad of one plane, and
/// the inverse map would lose six of the sixteen digits. No scanner or simulation comes near.
const MIN_AXES_DETERMINANT: f64 = 1e-6;

impl Volume {
    /// A volume of checked parts: `voxels` holds the product of `dims` scalars, x fastest, then y.
    ///
    /// Refused with [`Error::Option`]: a dimension of 0, a count that does not match, axes that are not finite or lie
    /// (nearly) in one plane, and a voxel that is NaN or infinite.
    pub fn new(
        dims: [usize; 3],
        voxels: Voxels,
        world_from_index: DAffine3,
    ) -> Result<Self, Error> {
        check_count(dims, voxels.len()).map_err(Error::Option)?;
        check_axes(&world_from_index).map_err(Error::Option)?;
        if let Some(index) = voxels.first_non_finite() {
            return Err(Error::Option(non_finite_message(
                dims,
                index,
                voxels.value(index),
            )));
        }
        Ok(Self {
            dims,
            voxels,
            world_from_index,
            up_hint: None,
            space: None,
            modality: None,
            unit: None,
            window: None,
        })
    }

    /// Number of voxels, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a volume is never empty")]
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// The scalar of the voxel at a linear index, `(k * dims[1] + j) * dims[0] + i`; panics beyond [`Volume::len`].
    pub fn value(&self, index: usize) -> f64 {
        self.voxels.value(index)
    }

    /// World distance between neighbours along x, y and z, each above 0.
    pub fn spacing(&self) -> [f64; 3] {
        spacing(&self.world_from_index)
    }

    /// The least of [`Volume::spacing`]. An axis along which there is one voxel only counts like the others.
    pub fn smallest_spacing(&self) -> f64 {
        self.spacing().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Least and greatest scalar. One pass over all voxels.
    pub fn value_range(&self) -> (f64, f64) {
        self.voxels.finite_range()
    }

    /// Memory that the scalars take, in bytes.
    pub fn bytes(&self) -> usize {
        with_voxels!(&self.voxels, slice => size_of_val(slice.as_slice()))
    }
}

impl Lattice {
    /// World distance between neighbours along x, y and z, each above 0.
    pub fn spacing(&self) -> [f64; 3] {
        spacing(&self.world_from_index)
    }

    /// Least and greatest corner of the box, along the world's axes, around the centres of all voxels.
    pub fn bounds_in_world(&self) -> [DVec3; 2] {
        let last = DVec3::from_array(self.dims.map(|n| (n - 1) as f64));
        let corner =
            |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let in_world = |i: u32| self.world_from_index.transform_point3(corner(i) * last);
        (1..8)
            .map(in_world)
            .fold([in_world(0); 2], |[low, high], pos| {
                [low.min(pos), high.max(pos)]
            })
    }

    /// The unit of lengths: that of the file, or millimetres where axes are named after a patient's sides.
    pub fn length_unit(&self) -> Option<String> {
        let of_file = self.unit.clone();
        of_file.or_else(|| self.patient_sides().map(|_| "mm".to_owned()))
    }

    /// The sides of a patient that the axes point to, such as left, posterior and superior.
    pub fn patient_sides(&self) -> Option<Vec<String>> {
        const SIDES: [&str; 6] = [
            "left",
            "right",
            "anterior",
            "posterior",
            "inferior",
            "superior",
        ];
        let space = self.space.as_ref()?.to_lowercase();
        let named: Vec<String> = space.split('-').map(str::to_owned).collect();
        let is_patient = named.iter().all(|word| SIDES.contains(&word.as_str()));
        is_patient.then_some(named)
    }

    /// The least of [`Lattice::spacing`].
    pub fn smallest_spacing(&self) -> f64 {
        self.spacing().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Number of voxels.
    #[expect(clippy::len_without_is_empty, reason = "a volume is never empty")]
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// The checks of [`Volume::new`] that need no voxel.
    pub fn check(&self) -> Result<(), Error> {
        voxel_count(self.dims).map_err(Error::Option)?;
        check_axes(&self.world_from_index).map_err(Error::Option)
    }
}

impl Voxels {
    /// Number of scalars.
    pub fn len(&self) -> usize {
        with_voxels!(self, slice => slice.len())
    }

    /// Returns true if there is no scalar.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One scalar; panics beyond [`Voxels::len`].
    pub fn value(&self, index: usize) -> f64 {
        with_voxels!(self, slice => scalar(slice[index]))
    }

    /// Pieces of `len` scalars each, from these places on, one behind the other.
    pub fn pieces(&self, starts: &[usize], len: usize) -> Self {
        macro_rules! pieces {
            ($($kind:ident),*) => {
                match self {
                    $(Self::$kind(all) => Self::$kind(starts.iter().flat_map(|&at| &all[at..at + len]).copied().collect()),)*
                }
            };
        }
        pieces!(U8, I8, U16, I16, U32, I32, F32, F64)
    }

    /// Makes room for this many more, and no more than that.
    #[cfg(feature = "input")]
    pub(crate) fn reserve_exact(&mut self, more: usize) {
        with_voxels!(self, slice => slice.reserve_exact(more));
    }

    /// Replaces values that are NaN or infinite. Refused where the replacement is not finite in the voxel type.
    ///
    /// ```
    /// use resample_volume::Voxels;
    ///
    /// let mut voxels = Voxels::F32(vec![1.0, f32::NAN]);
    /// voxels.replace_non_finite(0.0)?;
    /// assert_eq!(voxels.value(1), 0.0);
    /// # Ok::<(), String>(())
    /// ```
    pub fn replace_non_finite(&mut self, replacement: f64) -> Result<(), String> {
        match self {
            Self::F32(values) if (replacement as f32).is_finite() => {
                let broken = values.iter_mut().filter(|v| !v.is_finite());
                broken.for_each(|v| *v = replacement as f32);
            }
            Self::F64(values) if replacement.is_finite() => {
                let broken = values.iter_mut().filter(|v| !v.is_finite());
                broken.for_each(|v| *v = replacement);
            }
            Self::F32(_) | Self::F64(_) => {
                return Err(format!(
                    "the value {replacement} that is to replace NaN is itself not finite"
                ));
            }
            _ => {}
        }
        Ok(())
    }

    pub(crate) fn first_non_finite(&self) -> Option<usize> {
        match self {
            Self::F32(values) => values.par_iter().position_first(|v| !v.is_finite()),
            Self::F64(values) => values.par_iter().position_first(|v| !v.is_finite()),
            _ => None,
        }
    }

    /// Least and greatest scalar; all of them must be finite.
    pub fn finite_range(&self) -> (f64, f64) {
        let of_part = |part: Range<usize>| match self {
            Self::U8(bytes) => range_of_bytes(&bytes[part]),
            _ => {
                with_voxels!(self, slice => range_of(slice[part].iter().map(|&value| scalar(value))))
            }
        };
        self.parts().into_par_iter().map(of_part).reduce(
            || (f64::INFINITY, f64::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        )
    }

    /// The scalars cut into the parts of parallel tasks. Tasks look at the type inside: one that is made anew for each
    /// type costs as much code as the work itself.
    pub fn parts(&self) -> Vec<Range<usize>> {
        self.parts_of(VOXELS_PER_TASK)
    }

    /// As [`Voxels::parts`], of so many scalars each.
    pub(crate) fn parts_of(&self, each: usize) -> Vec<Range<usize>> {
        let count = self.len();
        (0..count)
            .step_by(each)
            .map(|first| first..(first + each).min(count))
            .collect()
    }
}

/// World distance between neighbours along each axis.
fn spacing(world_from_index: &DAffine3) -> [f64; 3] {
    let axes = world_from_index.matrix3;
    [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length)
}

/// Number of voxels of a lattice; an error where a dimension is 0 or the product does not fit.
pub(crate) fn voxel_count(dims: [usize; 3]) -> Result<usize, String> {
    let [x, y, z] = dims;
    if dims.contains(&0) {
        return Err(format!("dims {x}x{y}x{z}: each must be at least 1"));
    }
    x.checked_mul(y)
        .and_then(|plane| plane.checked_mul(z))
        .ok_or_else(|| format!("dims {x}x{y}x{z}: more voxels than this machine can count"))
}

fn check_count(dims: [usize; 3], held: usize) -> Result<(), String> {
    let needed = voxel_count(dims)?;
    if needed == held {
        return Ok(());
    }
    let [x, y, z] = dims;
    Err(format!(
        "dims {x}x{y}x{z} need {needed} voxels, but there are {held}"
    ))
}

fn check_axes(world_from_index: &DAffine3) -> Result<(), String> {
    if !world_from_index.is_finite() {
        return Err(
            "the axes or the origin of the volume are not finite: check spacing and origin"
                .to_owned(),
        );
    }
    let axes = world_from_index.matrix3;
    let columns = [axes.x_axis, axes.y_axis, axes.z_axis];
    let [x, y, z] = columns.map(DVec3::length);
    if let Some(axis) = [x, y, z]
        .iter()
        .position(|&length| !(1.0 / LONGEST..=LONGEST).contains(&length))
    {
        return Err(format!(
            "axis {axis} of the volume has length {:e}: expected a spacing from {:.1e} to {LONGEST:.1e}, as single precision holds it",
            [x, y, z][axis],
            1.0 / LONGEST
        ));
    }
    let determinant = (columns[0] / x).dot((columns[1] / y).cross(columns[2] / z));
    if determinant.abs() >= MIN_AXES_DETERMINANT {
        return Ok(());
    }
    Err(format!(
        "the axes of the volume lie in one plane (determinant {determinant:.1e} for unit axes): check the directions"
    ))
}

fn non_finite_message(dims: [usize; 3], index: usize, value: f64) -> String {
    let [i, j, k] = [
        index % dims[0],
        index / dims[0] % dims[1],
        index / (dims[0] * dims[1]),
    ];
    let what = if value.is_nan() { "NaN" } else { "infinite" };
    format!("voxel ({i},{j},{k}) is {what}: give --nan-as VALUE")
}

/// Typed voxels of a volume.
pub struct Grid<'a, T> {
    /// x fastest.
    pub voxels: &'a [T],
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
}

impl<T> Grid<'_, T> {
    /// `count` voxels along x, from this one on; all of them must be in the volume.
    #[inline(always)]
    pub fn row(&self, [x, y, z]: [usize; 3], count: usize) -> &[T] {
        let start = x + self.dims[0] * (y + self.dims[1] * z);
        &self.voxels[start..start + count]
    }
}

impl<T: Copy + Into<f64>> Grid<'_, T> {
    /// The scalar of a voxel; beyond the volume, that of the nearest one.
    pub fn at(&self, index: [isize; 3]) -> f32 {
        self.stored(index) as f32
    }

    /// As [`Grid::at`], with all digits.
    pub fn stored(&self, index: [isize; 3]) -> f64 {
        let [x, y, z] =
            [0, 1, 2].map(|axis| index[axis].clamp(0, self.dims[axis] as isize - 1) as usize);
        self.voxels[x + self.dims[0] * (y + self.dims[1] * z)].into()
    }
}

/// Least and greatest byte: of bytes, because the comparisons of many at once are cheap.
fn range_of_bytes(bytes: &[u8]) -> (f64, f64) {
    let (low, high) = bytes.iter().fold((u8::MAX, 0), |(low, high), &byte| {
        (byte.min(low), byte.max(high))
    });
    if bytes.is_empty() {
        (f64::INFINITY, f64::NEG_INFINITY)
    } else {
        (low.into(), high.into())
    }
}

/// Least and greatest scalar.
fn range_of(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

#[cfg(test)]
mod tests;
