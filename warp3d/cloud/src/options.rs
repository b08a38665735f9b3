//! Options of the drawing of points.
//!
//! With the feature `clap` they are arguments of a command line, whose help is the text below; with the feature `serde` they can
//! be written and read.

use glam::DVec3;

use resample_core::Error;

/// How the colours of discs become the colour of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Blend {
    /// The weighted mean (Zwicker 2001)
    Mean,
    /// The value at the pixel of a line fitted to the weighted colours (moving least squares)
    #[default]
    Linear,
}

/// How discs are lit, by their normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shade {
    /// Every point shows its own colour
    #[default]
    Unlit,
    /// A light at the eye
    Headlight,
    /// A distant light
    Lambert,
}

/// A plane of the picture beside colour and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum CloudLayer {
    /// World normal of the surface that is seen, towards the eye, times coverage (channels normal.X, normal.Y, normal.Z)
    Normal,
}

/// Options of the drawing of points.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
pub struct CloudOptions {
    /// How colours are blended.
    pub blend: Blend,
    /// How discs are lit.
    pub shade: Shade,
    /// Direction towards the distant light of [`Shade::Lambert`], in the world, of any length. Normals are
    /// turned towards the eye.
    pub light: DVec3,
    /// Sub-pixels along a pixel's side that say how much of a pixel at an outline is covered: 1, 2, 4 or 8. Their step is the
    /// largest error of the place of an outline: 1/8 px with 4.
    pub subpixels: u32,
    /// Draw one disc of so many, each larger by the root of that, so that the surface stays closed: 1 to 64.
    pub every: u32,
    /// Standard deviation of a disc's Gaussian, spacings of its points; more where its disc reaches farther. Less is sharper
    /// and noisier. Measured with a smooth texture at one point a pixel and at one per 2x2: 0.35 gave 56.5 and 41.6 dB, 0.42 55.5
    /// and 42.9, 0.5 54.0 and 41.7. 0.1 to 1.5.
    pub sigma_spacings: f64,
    /// How far behind the nearest surface of a pixel a disc still belongs to it, spacings of its points. 0 to 10.
    pub depth_tolerance_spacings: f64,
    /// Further planes of the picture.
    pub layers: Vec<CloudLayer>,
}

impl Default for CloudOptions {
    fn default() -> Self {
        Self {
            blend: Blend::default(),
            shade: Shade::default(),
            light: DVec3::new(0.4, 1.0, 0.6),
            subpixels: 4,
            every: 1,
            sigma_spacings: 0.42,
            depth_tolerance_spacings: 1.0,
            layers: Vec::new(),
        }
    }
}

impl CloudOptions {
    /// Checks that every option lies in its range.
    ///
    /// # Errors
    /// [`Error::Option`] names the option.
    pub fn validate(&self) -> Result<(), Error> {
        let ranges = [
            ("sigma_spacings", self.sigma_spacings, [0.1, 1.5]),
            (
                "depth_tolerance_spacings",
                self.depth_tolerance_spacings,
                [0.0, 10.0],
            ),
            ("every", f64::from(self.every), [1.0, 64.0]),
        ];
        for (name, value, [least, most]) in ranges {
            if !(least..=most).contains(&value) {
                return Err(Error::Option(format!(
                    "{name} is {value}, expected {least} to {most}"
                )));
            }
        }
        if ![1, 2, 4, 8].contains(&self.subpixels) {
            return Err(Error::Option(format!(
                "the number of sub-pixels is {}, expected 1, 2, 4 or 8",
                self.subpixels
            )));
        }
        if self.light.try_normalize().is_none() {
            return Err(Error::Option(format!(
                "the light comes from {}, expected a direction",
                self.light
            )));
        }
        Ok(())
    }
}
