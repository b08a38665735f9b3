//! The meaning of a depth file's numbers: from stored numbers to camera z.
//!
//! Takes a plane of numbers and what the user says about them, gives camera z in world units, NaN where nothing is
//! known. Each kind has one formula, evaluated in f64 per pixel; a number that the kind cannot mean (zero or negative
//! distance, NaN, infinity) and the number that the user calls invalid are unknown, not an error, because every
//! sensor leaves some. Sources of the codes: Middlebury stereo (disparity), MPEG view synthesis (linear in inverse
//! depth between near and far), the OpenGL perspective matrix (depth buffer).

use std::path::Path;

use resample_core::{Camera, Projection};
use resample_io::files::fault;
use resample_io::{Picture, Plane, Stored};

use crate::input::codes;
use crate::input::range::RangeOf;
use crate::{Error, Reference};

/// Camera z of a stored number at a column and row, world units; NaN where unknown.
pub(crate) type ZOf<'a> = Box<dyn Fn(f32, [usize; 2]) -> f32 + Sync + 'a>;

/// From a scaled number to camera z, or to distance along the ray.
type Formula = Box<dyn Fn(f64) -> f64 + Sync>;

/// Near and far plane of relative depth where none are given, world units: a picture's subject at 1, and a background
/// that still moves a little. A guess: a network's map does not say how deep its scene is.
const RELATIVE_PLANES: [f64; 2] = [1.0, 10.0];

/// Facts about the numbers of a depth file.
pub(crate) struct Numbers {
    pub(crate) stored: Stored,
    /// The numbers at the far and at the near end, where all have been seen.
    pub(crate) range: Option<[f64; 2]>,
}

impl Numbers {
    fn known_range(&self) -> Result<[f64; 2], String> {
        let [far, near] = self.range.ok_or(
            "relative depth needs its range: give the numbers of the far and of the near end",
        )?;
        match [far, near] {
            range if far <= near => Ok(range),
            _ if far == f64::INFINITY => Err("the depth file holds no usable number".into()),
            _ => Err(format!(
                "a range of depth from {far} to {near}: expected the number of the far end first, which is the smaller"
            )),
        }
    }
}

/// The meaning of a stored number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DepthKind {
    /// Camera z: distance along the optical axis
    Z,
    /// Distance from the eye along the pixel's ray
    Ray,
    /// Shift between the pictures of a rectified pair, px: z = fx * baseline / (d + doffs)
    Disparity,
    /// Inverse of camera z; whole numbers without a scale put the nearest pixels at 1 unit
    Inverse,
    /// Inverse of camera z up to a scale and an offset, as networks give it: larger is nearer; put between --near and
    /// --far [default: 1 and 10], all pictures of a sequence by one range
    Relative,
    /// MPEG code from 0 (far) to its largest value (near), linear in inverse z, between the near and the far plane
    Mpeg,
    /// OpenGL depth buffer from 0 (near) to 1 (far, or nothing drawn)
    #[cfg_attr(feature = "serde", serde(rename = "opengl"))]
    #[cfg_attr(feature = "clap", value(name = "opengl"))]
    OpenGl,
}

/// The user's description of a depth file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMeaning {
    /// The meaning of a number.
    pub kind: DepthKind,
    /// Stored numbers are multiplied by this first; codes of MPEG and OpenGL are divided by their largest value
    /// instead where no range is given.
    pub scale: Option<f64>,
    /// A stored number that means "unknown", beside those that cannot mean anything else.
    pub invalid: Option<f64>,
    /// Distance between the eyes of a rectified pair, world units (disparity).
    pub baseline: Option<f64>,
    /// Difference of the principal points of a rectified pair, right less left, px (disparity).
    pub doffs: f64,
    /// Camera z of the near and the far plane, world units (MPEG, OpenGL, relative).
    pub near_far: Option<[f64; 2]>,
    /// Stored numbers that mean the far and the near plane (relative; numbers beyond are put there), the second the one at
    /// distance 1 (inverse without a scale). Where none are given they are quantiles of the file's own numbers.
    pub range: Option<[f64; 2]>,
}

impl DepthMeaning {
    /// Numbers of `kind` with nothing else said.
    ///
    /// ```
    /// use warp3d::input::{DepthKind, DepthMeaning};
    ///
    /// let inverse = DepthMeaning {
    ///     scale: Some(1000.0),
    ///     ..DepthMeaning::of(DepthKind::Inverse)
    /// };
    /// assert_eq!(inverse.baseline, None);
    /// ```
    pub fn of(kind: DepthKind) -> Self {
        Self {
            kind,
            scale: None,
            invalid: None,
            baseline: None,
            doffs: 0.0,
            near_far: None,
            range: None,
        }
    }

    /// The same with the range of these numbers, where they need one and the caller gives no range.
    pub fn with_range_of(&self, stored: &Plane) -> Self {
        let range = self.range_of(stored);
        Self { range, ..*self }
    }

    /// Camera z of each pixel, world units, above 0; NaN where unknown. Coarse codes are made smooth.
    ///
    /// The error says which option is missing or out of range.
    pub fn camera_z(&self, stored: &Plane, camera: &Camera) -> Result<Vec<f32>, String> {
        let numbers = self.numbers(stored);
        let smooth = codes::smoothed(stored, &*self.distance(&numbers, camera)?);
        let stored = smooth.as_ref().unwrap_or(stored);
        let z_of = self.converter(&numbers, camera)?;
        let mut depth = Vec::with_capacity(stored.values.len());
        for (y, row) in stored.values.chunks(stored.width.max(1)).enumerate() {
            let columns = row.iter().enumerate();
            depth.extend(columns.map(|(x, &value)| z_of(value, [x, y])));
        }
        Ok(depth)
    }

    /// Facts about the numbers of a plane, as far as their meaning needs them.
    pub(crate) fn numbers(&self, stored: &Plane) -> Numbers {
        Numbers {
            stored: stored.stored,
            range: self.range_of(stored),
        }
    }

    /// The range that was given, or that of the numbers of a plane where they need one.
    fn range_of(&self, stored: &Plane) -> Option<[f64; 2]> {
        if self.range.is_some() || !self.needs_range(stored.stored) {
            return self.range;
        }
        let is_known = |value| self.is_known(value);
        let mut range = RangeOf::new(&is_known);
        range.take(stored);
        Some(range.found().unwrap_or([f64::INFINITY, f64::NEG_INFINITY]))
    }

    /// Returns true if numbers of some kind need a range that is not given.
    pub(crate) fn may_need_range(&self) -> bool {
        let is_open = match self.kind {
            DepthKind::Relative => true,
            DepthKind::Inverse => self.scale.is_none(),
            _ => false,
        };
        is_open && self.range.is_none()
    }

    /// Returns true if numbers of this kind need a range that is not given.
    pub(crate) fn needs_range(&self, stored: Stored) -> bool {
        let is_code = matches!(stored, Stored::Code(_));
        self.may_need_range() && (is_code || self.kind == DepthKind::Relative)
    }

    /// Returns true if a stored number may mean a depth.
    pub(crate) fn is_known(&self, value: f32) -> bool {
        let is_unknown_code = self.kind == DepthKind::Inverse && value <= 0.0;
        value.is_finite() && !self.is_invalid(f64::from(value)) && !is_unknown_code
    }

    /// The camera z of a stored number at a column and row, as above.
    fn converter<'a>(&'a self, numbers: &Numbers, camera: &'a Camera) -> Result<ZOf<'a>, String> {
        let distance = self.distance(numbers, camera)?;
        Ok(Box::new(move |value, [x, y]| {
            let z = distance(value);
            if self.kind == DepthKind::Ray {
                usable(z / ray_length(camera, x, y))
            } else {
                usable(z)
            }
        }))
    }

    /// Camera z of a stored number, or distance along the ray where numbers are that; not usable where unknown.
    pub(crate) fn distance<'a>(
        &'a self,
        numbers: &Numbers,
        camera: &Camera,
    ) -> Result<Box<dyn Fn(f32) -> f64 + Sync + 'a>, String> {
        let scale = self.scale_of(numbers)?;
        let from_number = self.formula(numbers, camera)?;
        let zero_is_unknown = self.zero_is_unknown(numbers.stored);
        Ok(Box::new(move |value| {
            let value = f64::from(value);
            let unknown =
                !value.is_finite() || self.is_invalid(value) || (zero_is_unknown && value == 0.0);
            if unknown {
                f64::NAN
            } else {
                from_number(value * scale)
            }
        }))
    }

    /// A note for the user where the numbers leave the scale of the world open, or look upside down.
    ///
    /// `z` is camera z of each pixel, rows of `width` from the top.
    pub fn note(&self, stored: Stored, z: &[f32], width: usize) -> Option<String> {
        let is_whole = matches!(stored, Stored::Code(_));
        let is_open = self.kind == DepthKind::Relative
            || (self.kind == DepthKind::Inverse && self.scale.is_none() && is_whole);
        let is_doubtful = self.kind == DepthKind::Relative
            || (is_whole && matches!(self.kind, DepthKind::Z | DepthKind::Ray));
        if is_doubtful && looks_inverted(z, width) {
            return Some(match self.kind {
                DepthKind::Relative => "the upper part of the picture is nearer than the lower part: if larger numbers \
                     are farther, read them as camera z with a depth scale"
                    .into(),
                _ => "the upper part of the picture is nearer than the lower part: if larger numbers are nearer, as \
                     networks give them, read them as relative depth"
                    .into(),
            });
        }
        let [near, far] = self.relative_planes();
        let numbers = self.range.map_or(String::new(), |[least, most]| {
            format!(", its numbers from {most} to {least}")
        });
        is_open.then(|| match self.kind {
            DepthKind::Inverse => "the depth has no unit: its nearest pixels are put at 1".into(),
            _ => {
                format!("the depth has no unit: it is put between {near} and {far} units{numbers}")
            }
        })
    }

    /// The meaning in words, for messages.
    pub fn told(&self, stored: Stored) -> String {
        let scale = self
            .scale
            .map_or(String::new(), |scale| format!(", scale {scale}"));
        let kind = match self.kind {
            DepthKind::Z => "camera z",
            DepthKind::Ray => "distance along the ray",
            DepthKind::Disparity => "disparity",
            DepthKind::Inverse => "inverse depth",
            DepthKind::Relative => "relative depth",
            DepthKind::Mpeg => "MPEG code",
            DepthKind::OpenGl => "OpenGL depth buffer",
        };
        let numbers = match stored {
            Stored::Float => "floating point".to_owned(),
            Stored::Code(largest) => format!("codes 0 to {largest}"),
        };
        format!("{kind}, {numbers}{scale}")
    }

    /// Stored numbers are single precision, so the number that the user typed is compared as one.
    fn is_invalid(&self, value: f64) -> bool {
        self.invalid
            .is_some_and(|invalid| value == f64::from(invalid as f32))
    }

    /// In whole numbers 0 is the usual sign for "nothing measured"; in a code it is the near or the far plane, and in
    /// relative depth the farthest.
    fn zero_is_unknown(&self, stored: Stored) -> bool {
        let is_code = matches!(
            self.kind,
            DepthKind::Mpeg | DepthKind::OpenGl | DepthKind::Relative
        );
        matches!(stored, Stored::Code(_)) && !is_code
    }

    fn scale_of(&self, numbers: &Numbers) -> Result<f64, String> {
        match (self.scale, self.kind, numbers.stored) {
            (_, DepthKind::Relative, _) => Ok(1.0),
            (Some(scale), _, _) if scale > 0.0 && scale.is_finite() => Ok(scale),
            (Some(scale), _, _) => Err(format!(
                "a depth scale of {scale}: expected a number above 0"
            )),
            (None, DepthKind::Mpeg | DepthKind::OpenGl, Stored::Code(largest)) => {
                Ok(1.0 / f64::from(largest))
            }
            (None, DepthKind::Disparity, _) | (None, _, Stored::Float) => Ok(1.0),
            (None, DepthKind::Inverse, Stored::Code(_)) => {
                let [_, most] = numbers.known_range()?;
                Ok(1.0 / most)
            }
            (None, _, Stored::Code(largest)) => Err(format!(
                "the depth is stored in whole numbers up to {largest}: give --depth-scale, world units per stored \
                 unit (0.001 for millimetres where cameras are in metres, 1 where both have one unit), or \
                 --depth-kind relative for a map from a network"
            )),
        }
    }

    /// The near and the far plane between which relative depth is put, world units.
    pub fn relative_planes(&self) -> [f64; 2] {
        self.near_far.unwrap_or(RELATIVE_PLANES)
    }

    /// The formula from a scaled number to camera z (or distance along the ray).
    fn formula(&self, numbers: &Numbers, camera: &Camera) -> Result<Formula, String> {
        Ok(match self.kind {
            DepthKind::Z | DepthKind::Ray => Box::new(|value| value),
            DepthKind::Inverse => Box::new(|value| 1.0 / value),
            DepthKind::Relative => {
                let [near, far] = match self.near_far {
                    Some(_) => self.planes("relative depth")?,
                    None => self.relative_planes(),
                };
                let [least, most] = numbers.known_range()?;
                // A map of one number is a plane at the far end.
                let step = (1.0 / near - 1.0 / far) / (most - least).max(f64::MIN_POSITIVE);
                // Wild numbers are no nearer than the near plane, and no farther than the far one.
                Box::new(move |value| 1.0 / (1.0 / far + (value.clamp(least, most) - least) * step))
            }
            DepthKind::Disparity => {
                let baseline = self.baseline.ok_or(
                    "a disparity needs the distance between the eyes: give the baseline, or name a calib.txt as camera",
                )?;
                if !(baseline > 0.0 && baseline.is_finite()) {
                    return Err(format!(
                        "a baseline of {baseline}: expected a length above 0"
                    ));
                }
                let (shift_px, product) = (self.doffs, camera.fx * baseline);
                Box::new(move |value| product / (value + shift_px))
            }
            DepthKind::Mpeg => {
                let [near, far] = self.planes("an MPEG depth code")?;
                Box::new(move |code| 1.0 / (code * (1.0 / near - 1.0 / far) + 1.0 / far))
            }
            DepthKind::OpenGl => {
                let [near, far] = self.planes("an OpenGL depth buffer")?;
                // A buffer is cleared to 1, so that 1 is where nothing was drawn.
                let drawn = |code: f64| (0.0..1.0).contains(&code);
                match camera.projection {
                    Projection::Perspective => Box::new(move |code| {
                        if drawn(code) {
                            near * far / (far - code * (far - near))
                        } else {
                            f64::NAN
                        }
                    }),
                    Projection::Orthographic => Box::new(move |code| {
                        if drawn(code) {
                            near + code * (far - near)
                        } else {
                            f64::NAN
                        }
                    }),
                }
            }
        })
    }

    fn planes(&self, what: &str) -> Result<[f64; 2], String> {
        let [near, far] = self
            .near_far
            .ok_or(format!("{what} needs its planes: give --near and --far"))?;
        if !(near > 0.0 && far > near && far.is_finite()) {
            return Err(format!(
                "planes at {near} and {far}: expected 0 < near < far"
            ));
        }
        Ok([near, far])
    }
}

/// A distance as camera z; unknown where it is not above 0, or beyond the range of f32.
fn usable(z: f64) -> f32 {
    let z = z as f32;
    if z > 0.0 && z.is_finite() {
        z
    } else {
        f32::NAN
    }
}

/// Length of the ray through a pixel's centre from the eye to camera z = 1.
fn ray_length(camera: &Camera, x: usize, y: usize) -> f64 {
    let pos_in_screen = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    let (_, direction) = camera.ray_in_camera(pos_in_screen);
    direction.length()
}

// Depth that is most likely read the wrong way round: floors are nearer than ceilings and skies.

/// How much nearer the upper third of a picture must be than the lower third to look upside down. Floors make the lower
/// part nearer in almost every picture; a guess that leaves ceilings and close walls without a note.
const INVERTED_RATIO: f64 = 1.25;

/// Returns true if the upper third of a picture is clearly nearer than the lower third.
fn looks_inverted(z: &[f32], width: usize) -> bool {
    let third = z.len() / width.max(1) / 3 * width;
    let median = |part: &[f32]| -> Option<f64> {
        let mut known: Vec<f32> = part.iter().copied().filter(|z| !z.is_nan()).collect();
        let middle = known.len() / 2;
        (!known.is_empty())
            .then(|| f64::from(*known.select_nth_unstable_by(middle, f32::total_cmp).1))
    };
    let (upper, lower) = (median(&z[..third]), median(&z[z.len() - third..]));
    upper
        .zip(lower)
        .is_some_and(|(upper, lower)| lower > INVERTED_RATIO * upper)
}

// The last steps of every picture with depth: camera z, unknown pixels, and the error where nothing is known.

/// The reference of a picture and its camera z; `None` if no pixel has a usable depth.
pub(super) fn assembled(
    picture: Picture,
    mut depth: Vec<f32>,
    camera: Camera,
) -> Option<Reference> {
    if let Some(coverage) = &picture.coverage {
        let uncovered = coverage
            .iter()
            .zip(&mut depth)
            .filter(|(coverage, _)| **coverage < 0.5);
        uncovered.for_each(|(_, z)| *z = f32::NAN);
    }
    let is_known = depth.iter().any(|z| !z.is_nan());
    is_known.then_some(Reference {
        camera,
        colour: picture.rgb,
        depth,
    })
}

/// Makes camera z of distances along the rays.
pub(super) fn along_the_axis(distances: &mut [f32], camera: &Camera) {
    let width = camera.width as usize;
    for (index, z) in distances.iter_mut().enumerate() {
        let ray = ray_length(camera, index % width, index / width);
        *z = (f64::from(*z) / ray) as f32;
    }
}

/// The error for a depth file of which nothing can be used.
pub(crate) fn nothing_known(meaning: &DepthMeaning, stored: Stored, depth_file: &Path) -> Error {
    fault(
        depth_file,
        format!(
            "no pixel has a usable depth (read as {})",
            meaning.told(stored)
        ),
    )
}

#[cfg(test)]
mod tests;
