//! What the numbers of a depth file mean: from stored numbers to camera z.
//!
//! Takes a plane of numbers and what the user says about them, gives camera z in world units, NaN where nothing is
//! known. Each kind has one formula, evaluated in f64 per pixel; a number that the kind cannot mean (zero or negative
//! distance, NaN, infinity) and the number that the user calls invalid are unknown, not an error, because every
//! sensor leaves some. Sources of the codes: Middlebury stereo (disparity), MPEG view synthesis (linear in inverse
//! depth between near and far), the OpenGL perspective matrix (depth buffer).

use resample_core::{Camera, Projection};

use resample_io::{Plane, Stored};

/// Camera z of a stored number at a column and row, world units; NaN where unknown.
pub(crate) type ZOf<'a> = Box<dyn Fn(f32, [usize; 2]) -> f32 + Sync + 'a>;

/// From a scaled number to camera z, or to distance along the ray.
type Formula = Box<dyn Fn(f64) -> f64 + Sync>;

/// What a stored number is.
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
    /// Inverse of camera z
    Inverse,
    /// MPEG code from 0 (far) to its largest value (near), linear in inverse z, between the near and the far plane
    Mpeg,
    /// OpenGL depth buffer from 0 (near) to 1 (far, or nothing drawn)
    #[cfg_attr(feature = "serde", serde(rename = "opengl"))]
    #[cfg_attr(feature = "clap", value(name = "opengl"))]
    OpenGl,
}

/// What the user says about a depth file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMeaning {
    /// What a number is.
    pub kind: DepthKind,
    /// Stored numbers are multiplied by this first; codes of MPEG and OpenGL are divided by their largest value
    /// instead where none is given.
    pub scale: Option<f64>,
    /// A stored number that means "unknown", beside those that cannot mean anything else.
    pub invalid: Option<f64>,
    /// Distance between the eyes of a rectified pair, world units (disparity).
    pub baseline: Option<f64>,
    /// Difference of the principal points of a rectified pair, right less left, px (disparity).
    pub doffs: f64,
    /// Camera z of the near and the far plane, world units (MPEG, OpenGL).
    pub near_far: Option<[f64; 2]>,
}

impl DepthMeaning {
    /// Numbers of `kind` with nothing else said.
    pub fn of(kind: DepthKind) -> Self {
        Self {
            kind,
            scale: None,
            invalid: None,
            baseline: None,
            doffs: 0.0,
            near_far: None,
        }
    }

    /// Camera z of each pixel, world units, above 0; NaN where unknown.
    ///
    /// The error says which option is missing or out of range.
    pub fn camera_z(&self, stored: &Plane, camera: &Camera) -> Result<Vec<f32>, String> {
        let z_of = self.converter(stored.stored, camera)?;
        let per_pixel = stored.values.iter().enumerate();
        Ok(per_pixel
            .map(|(index, &value)| z_of(value, [index % stored.width, index / stored.width]))
            .collect())
    }

    /// The camera z of a stored number at a column and row, as above.
    pub(crate) fn converter<'a>(
        &'a self,
        stored: Stored,
        camera: &'a Camera,
    ) -> Result<ZOf<'a>, String> {
        let scale = self.scale_of(stored)?;
        let from_number = self.formula(camera)?;
        let (invalid, zero_is_unknown) = (self.invalid, self.zero_is_unknown(stored));
        Ok(Box::new(move |value, [x, y]| {
            let value = f64::from(value);
            if !value.is_finite()
                || self.is_invalid(value, invalid)
                || (zero_is_unknown && value == 0.0)
            {
                return f32::NAN;
            }
            let z = from_number(value * scale);
            let z = if self.kind == DepthKind::Ray {
                z / ray_length(camera, x, y)
            } else {
                z
            };
            // A distance beyond the range of f32 is unknown.
            let z = z as f32;
            if z > 0.0 && z.is_finite() {
                z
            } else {
                f32::NAN
            }
        }))
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
    fn is_invalid(&self, value: f64, invalid: Option<f64>) -> bool {
        invalid.is_some_and(|invalid| value == f64::from(invalid as f32))
    }

    /// In whole numbers 0 is the usual sign for "nothing measured"; in a code it is the near or the far plane.
    fn zero_is_unknown(&self, stored: Stored) -> bool {
        let is_code = matches!(self.kind, DepthKind::Mpeg | DepthKind::OpenGl);
        matches!(stored, Stored::Code(_)) && !is_code
    }

    fn scale_of(&self, stored: Stored) -> Result<f64, String> {
        match (self.scale, self.kind, stored) {
            (Some(scale), _, _) if scale > 0.0 && scale.is_finite() => Ok(scale),
            (Some(scale), _, _) => Err(format!(
                "a depth scale of {scale}: expected a number above 0"
            )),
            (None, DepthKind::Mpeg | DepthKind::OpenGl, Stored::Code(largest)) => {
                Ok(1.0 / f64::from(largest))
            }
            (None, DepthKind::Disparity, _) | (None, _, Stored::Float) => Ok(1.0),
            (None, _, Stored::Code(largest)) => Err(format!(
                "the depth is stored in whole numbers up to {largest}: give a depth scale, how many world units \
                 one of them is (0.001 for millimetres where cameras are in metres, 1 where both have one unit)"
            )),
        }
    }

    /// The formula from a scaled number to camera z (or distance along the ray).
    fn formula(&self, camera: &Camera) -> Result<Formula, String> {
        Ok(match self.kind {
            DepthKind::Z | DepthKind::Ray => Box::new(|value| value),
            DepthKind::Inverse => Box::new(|value| 1.0 / value),
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
            .ok_or(format!("{what} needs its planes: give near and far"))?;
        if !(near > 0.0 && far > near && far.is_finite()) {
            return Err(format!(
                "planes at {near} and {far}: expected 0 < near < far"
            ));
        }
        Ok([near, far])
    }
}

/// Length of the ray through a pixel's centre from the eye to camera z = 1.
fn ray_length(camera: &Camera, x: usize, y: usize) -> f64 {
    let pos_in_screen = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    let (_, direction) = camera.ray_in_camera(pos_in_screen);
    direction.length()
}

#[cfg(test)]
mod tests;
