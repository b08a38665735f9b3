//! Options: one struct of choices that every picture has, and one for each of the two pipelines; out-of-range numbers and contradictions
//! are refused.
//!
//! Every number has its unit, range and default beside it. With the crate feature `serde` options can be written and
//! read, and with `clap` they are arguments of a command line; names are the same in both.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use resample_core::simd::SimdLevel;
use resample_core::{OpacityMode, SelectMode};
pub use resample_volume::transfer::Shading;

use crate::look::clip::Clip;
use crate::{Error, GradientOpacity};
pub use resample_volume::transfer::{Blend, Isosurface};

pub use crate::look::sample_options::{
    Cells, Classify, ColourBy, Interpolate, KernelSheets, SampleOptions, SampleOrder,
};

/// Shortest opacity unit, spacings: products of optical depths with strengths and with depths stay far below the end of
/// f32. An opacity of 1e-12 over it is two thirds over a voxel; what is fainter still over a shorter unit comes out fainter
/// than it is.
const SHORTEST_UNIT: f64 = 1e-12;

/// The choices of one rendering. `RenderOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
pub struct RenderOptions {
    /// The composited samples, and their order.
    pub order: Order,
    /// The kept part of the volume.
    pub clip: Clip,
    /// How samples are lit. Samples of the paper's orders are lit by one channel of scalars.
    pub shading: Shading,
    /// Where the light of shading comes from.
    pub light: Light,
    /// The shadows that the volume casts on itself; `None` is off. The light comes from a direction in the world then.
    pub shadow: Option<Shadow>,
    /// How finely the light of shadows and occlusion is found.
    pub light_grid: LightGrid,
    /// The light of the sky that the volume hides from itself; `None` is off.
    pub occlusion: Option<Occlusion>,
    /// The gradient that light follows.
    pub gradient_filter: GradientFilter,
    /// Emission: a factor of the extinction over the length of the gradient. Labels are not modulated. `None` is off.
    pub gradient_opacity: Option<GradientOpacity>,
    /// Sub-pixels along a pixel's side at which samples or sheets are composited before they are averaged.
    pub subpixels: Subpixels,
    /// How the opacity of a voxel becomes the opacity of a pixel.
    pub opacity: OpacityMode,
    /// A pixel is left alone once its transmittance is below this, 0..1: no pixel changes by more than this.
    /// 0 never stops early.
    pub min_transmittance: f32,
    /// The length, in world units, over which a transfer function's opacity is meant; `None` is the smallest spacing.
    pub opacity_unit: Option<f64>,
    /// The depth plane of the picture.
    pub depth: DepthPlane,
    /// Vector instructions to use. Levels agree to rounding.
    pub simd: SimdLevel,
}

/// The composited samples, and their order.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Order {
    /// The trilinear field, sampled on sheets parallel to the picture, each sample classified: the default.
    Field(FieldOptions),
    /// Samples of a regular grid, each with a kernel around it: the paper.
    Samples(SampleOptions),
}

impl Default for Order {
    fn default() -> Self {
        Self::Field(FieldOptions::default())
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            order: Order::default(),
            clip: Clip::default(),
            shading: Shading::None,
            light: Light::Headlight,
            shadow: None,
            light_grid: LightGrid::Auto,
            occlusion: None,
            gradient_filter: GradientFilter::Smooth,
            gradient_opacity: None,
            subpixels: Subpixels::Auto,
            opacity: OpacityMode::Extinction,
            // Half a step of an 8-bit picture.
            min_transmittance: 1.0 / 512.0,
            opacity_unit: None,
            depth: DepthPlane::None,
            simd: SimdLevel::Auto,
        }
    }
}

impl RenderOptions {
    /// Samples with these choices, and the default of every other choice.
    pub fn of_samples(samples: SampleOptions) -> Self {
        Self {
            order: Order::Samples(samples),
            ..Self::default()
        }
    }

    /// Every sample over the next, with the default of every other choice.
    pub fn every_sample() -> Self {
        Self::of_samples(SampleOptions::default())
    }

    /// The paper's way: every voxel over the next, by its own value, with a Gaussian, pixel by pixel.
    ///
    /// ```
    /// use volsplat::{Order, RenderOptions};
    ///
    /// assert!(matches!(RenderOptions::paper().order, Order::Samples(_)));
    /// assert!(matches!(RenderOptions::default().order, Order::Field(_)));
    /// ```
    pub fn paper() -> Self {
        Self {
            subpixels: Subpixels::Fixed(1),
            ..Self::of_samples(SampleOptions::paper())
        }
    }

    /// Westover's order, with the default of every other choice.
    pub fn axis_sheets() -> Self {
        Self::of_samples(SampleOptions {
            order: SampleOrder::AxisSheets,
            ..SampleOptions::default()
        })
    }

    /// Slabs in which radial kernels are summed, with the default of every other choice.
    pub fn kernel_sheets() -> Self {
        Self::of_samples(SampleOptions {
            order: SampleOrder::ImageSheets(KernelSheets::default()),
            ..SampleOptions::default()
        })
    }

    /// The choices of the field, where it is drawn.
    pub fn field(&self) -> Option<&FieldOptions> {
        match &self.order {
            Order::Field(field) => Some(field),
            Order::Samples(_) => None,
        }
    }

    /// The choices of samples, where they are drawn.
    pub fn samples(&self) -> Option<&SampleOptions> {
        match &self.order {
            Order::Field(_) => None,
            Order::Samples(samples) => Some(samples),
        }
    }

    /// The value of a ray that its pixel shows.
    pub(crate) fn blend(&self) -> Blend {
        self.field().map_or(Blend::Emission, |field| field.blend)
    }

    /// Returns true if the volume is in the way of light.
    pub(crate) fn blocks_light(&self) -> bool {
        self.shadow.is_some() || self.occlusion.is_some()
    }

    /// Returns true if the gradient changes the picture.
    pub(crate) fn follows_gradient(&self) -> bool {
        self.shading != Shading::None || self.gradient_opacity.is_some()
    }

    /// The filter of the gradients that are drawn: lengths for opacity by the gradient are those of central differences.
    pub(crate) fn used_gradient_filter(&self) -> GradientFilter {
        match &self.gradient_opacity {
            Some(_) => GradientFilter::Central,
            None => self.gradient_filter,
        }
    }

    /// World length over which opacity is meant, for samples at this spacing.
    pub(crate) fn opacity_unit_in_world(&self, smallest_spacing: f64) -> f64 {
        let unit = self.opacity_unit.unwrap_or(smallest_spacing);
        unit.max(SHORTEST_UNIT * smallest_spacing)
    }

    /// Returns true if what was prepared for these options serves the others: only what each frame reads anew differs.
    pub(crate) fn prepares_like(&self, other: &Self) -> bool {
        let mut alike = Self {
            subpixels: self.subpixels,
            shadow: self.shadow,
            light_grid: self.light_grid,
            occlusion: self.occlusion,
            min_transmittance: self.min_transmittance,
            depth: self.depth,
            ..other.clone()
        };
        match (&mut alike.order, &self.order) {
            (Order::Field(alike), Order::Field(own)) => alike.slab_voxels = own.slab_voxels,
            (Order::Samples(alike), Order::Samples(own)) => alike.take_frame_choices(own),
            _ => {}
        }
        alike == *self
    }
}

/// The trilinear field, sampled on planes parallel to the picture.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FieldOptions {
    /// Thickness of a slab along the view, in voxels (the smallest spacing)
    #[cfg_attr(
        feature = "clap",
        arg(long = "slab", value_name = "VOXELS", default_value_t = Self::default().slab_voxels)
    )]
    pub slab_voxels: f64,
    /// The value of a ray that its pixel shows.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub blend: Blend,
}

impl Default for FieldOptions {
    fn default() -> Self {
        Self {
            slab_voxels: 0.5,
            blend: Blend::Emission,
        }
    }
}

/// The gradient that light follows. In grids whose spacing differs between the axes, such as scans of thick slices, the trilinear
/// field has a terrace at each slice, which light shows as rings. The orders of samples have central differences only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum GradientFilter {
    /// Of values blurred along the axes of shorter spacing, by a Gaussian of half the greatest spacing; central differences where
    /// spacings are alike, and for opacity by the gradient
    #[default]
    Smooth,
    /// Central differences
    Central,
}

/// Where the light of shading comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Light {
    /// Along the view direction of the camera.
    Headlight,
    /// From this direction in the world: it points towards the light, and has any length above 0.
    Towards(DVec3),
}

/// Shadows: the diffuse light and the highlight of a sample are multiplied by the transmittance towards the light, and divided by the mean
/// transmittance of the places that absorb light. So a lit surface keeps its brightness. The ambient light is not changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shadow {
    /// Apparent diameter of the light, degrees: 0 is a point far away, with hard shadows; at most 90.
    pub light_size_deg: f64,
}

/// Occlusion: light is multiplied by the share of the sky that a sample sees, the mean over all directions of the transmittance up to a
/// radius, and divided by its mean over what is visible. So a picture keeps its brightness. With shadows it is the ambient light
/// alone, without them all light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Occlusion {
    /// Matter farther away does not count, world units; `None` is a tenth of the diagonal of what is visible.
    pub radius: Option<f64>,
}

/// How finely the light of shadows and occlusion is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum LightGrid {
    /// At each voxel; of a volume that stays in its file, at the most voxels that fit the memory.
    #[default]
    Auto,
    /// At each voxel of so many along each axis: 1, 2, 4 or 8. Between them it is interpolated, and matter is its mean. Of a volume that
    /// stays in its file, at fewer where memory is too little.
    Every(u32),
    /// For moving pictures: the light that is known, or quickly found on a coarse grid.
    AtHand,
}

impl FromStr for LightGrid {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "auto" => Ok(Self::Auto),
            word => match word.parse() {
                Ok(step @ (1 | 2 | 4 | 8)) => Ok(Self::Every(step)),
                _ => Err("expected auto, 1, 2, 4 or 8".into()),
            },
        }
    }
}

impl fmt::Display for LightGrid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Every(step) => write!(f, "{step}"),
            Self::AtHand => f.write_str("at hand"),
        }
    }
}

/// Sub-pixels along a pixel's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Subpixels {
    /// As many as make the middle of what is visible about two sub-pixels a voxel, or with every-sample about one a sample,
    /// 1 to 8; 1 in axis sheets. Up to 4, emission and absorption of the field correct a pixel's mean by its neighbours.
    Auto,
    /// This many, 1, 2, 4, 8 or 16, and their plain mean.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Fixed(u32),
}

/// The depth plane of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DepthPlane {
    /// No depth
    None,
    /// Opacity-weighted mean camera z, world units; +infinity where nothing is seen
    Expected,
}

impl RenderOptions {
    /// Checks every number against its range, and the choices against one another.
    pub fn validate(&self) -> Result<(), Error> {
        match &self.order {
            Order::Field(field) => field.validate()?,
            Order::Samples(samples) => samples.validate()?,
        }
        if let Subpixels::Fixed(n) = self.subpixels {
            in_range(
                "the number of sub-pixels",
                f64::from(n),
                [1, 2, 4, 8, 16].contains(&n),
                "1, 2, 4, 8 or 16",
            )?;
        }
        self.validate_gradient()?;
        self.validate_blocked_light()?;
        self.clip.validate()?;
        share("the least transmittance", self.min_transmittance)?;
        above_0(
            "the opacity unit",
            self.opacity_unit.unwrap_or(1.0),
            "a length",
        )
    }

    /// Checks shadows and occlusion.
    fn validate_blocked_light(&self) -> Result<(), Error> {
        if let Some(shadow) = self.shadow {
            in_range(
                "the light's size",
                shadow.light_size_deg,
                (0.0..=90.0).contains(&shadow.light_size_deg),
                "0 to 90 degrees",
            )?;
        }
        if let Some(radius) = self.occlusion.and_then(|occlusion| occlusion.radius) {
            above_0("the radius of occlusion", radius, "a length")?;
        }
        if let LightGrid::Every(step) = self.light_grid {
            in_range(
                "the light's grid",
                f64::from(step),
                [1, 2, 4, 8].contains(&step),
                "1, 2, 4 or 8 voxels",
            )?;
        }
        if !self.blocks_light() {
            return Ok(());
        }
        match (self.blend(), self.field()) {
            (_, None) => wrong(
                "samples of the paper's orders have neither shadows nor occlusion: draw the field",
            ),
            (Blend::Maximum | Blend::Minimum | Blend::Average, _) => wrong(
                "maximum, minimum and average projections have no light: remove --shadows and --occlusion, or --blend",
            ),
            (Blend::Isosurface(iso), _) if iso.opacity < 1.0 => wrong(
                "a translucent isosurface has neither shadows nor occlusion: give it opacity 1 or leave them out",
            ),
            _ if self.shadow.is_some() && self.light == Light::Headlight => wrong(
                "what casts a shadow hides it where the light stands at the eye: give the light a direction",
            ),
            _ if self.opacity != OpacityMode::Extinction => {
                wrong("shadows and occlusion follow extinction: leave out the other opacity")
            }
            _ => Ok(()),
        }
    }

    fn validate_gradient(&self) -> Result<(), Error> {
        let blend = self.blend();
        let is_statistic = matches!(blend, Blend::Maximum | Blend::Minimum | Blend::Average);
        if self.shading != Shading::None && is_statistic {
            return wrong("maximum, minimum and mean projections cannot be shaded");
        }
        if let Light::Towards(direction) = self.light
            && direction.try_normalize().is_none()
        {
            return wrong(format!(
                "the light comes from {direction}, expected a direction"
            ));
        }
        match &self.gradient_opacity {
            Some(_) if blend != Blend::Emission => {
                wrong("opacity by the gradient goes with emission only: leave out the other blend")
            }
            Some(curve) => curve.validate(),
            None => Ok(()),
        }
    }
}

impl FieldOptions {
    fn validate(&self) -> Result<(), Error> {
        slab(self.slab_voxels)?;
        match self.blend {
            Blend::Isosurface(surface) => validate_surface(&surface),
            _ => Ok(()),
        }
    }
}

impl SampleOptions {
    fn validate(&self) -> Result<(), Error> {
        let threshold = f64::from(self.point_threshold_px);
        above_0("the point threshold", threshold, "pixels")?;
        above_0("the sheet thickness", self.sheet_voxels, "voxels")?;
        if let Cells::Split { error } = self.cells {
            share("the error of cells", error)?;
        }
        match self.sheets() {
            Some(sheets) => self.validate_sheets(sheets),
            None => Ok(()),
        }
    }

    fn validate_sheets(&self, sheets: &KernelSheets) -> Result<(), Error> {
        slab(sheets.slab_voxels)?;
        match (sheets.classify, self.cells, sheets.interpolate) {
            _ if self.select == SelectMode::Ewa => wrong(
                "EWA belongs to every-sample and axis sheets: image sheets take hybrid, splats or points",
            ),
            (Classify::Pre, _, Interpolate::On) => wrong(
                "kernels interpolate scalars: classify after the sum, or leave out interpolation",
            ),
            (Classify::Post, Cells::Mean | Cells::Split { .. }, _) => wrong(
                "cells are classified before they are drawn: pre-classify image sheets, or take every-sample or axis sheets",
            ),
            (Classify::Pre, Cells::Split { .. }, _) => wrong(
                "image sheets have one size of samples: take means of whole cells, or every-sample",
            ),
            _ => Ok(()),
        }
    }
}

fn wrong(what: impl Into<String>) -> Result<(), Error> {
    Err(Error::Option(what.into()))
}

fn in_range(name: &str, value: f64, is_good: bool, expected: &str) -> Result<(), Error> {
    if is_good {
        Ok(())
    } else {
        wrong(format!("{name} is {value}, expected {expected}"))
    }
}

fn above_0(name: &str, value: f64, unit: &str) -> Result<(), Error> {
    let is_good = value > 0.0 && value.is_finite();
    in_range(name, value, is_good, &format!("{unit} above 0"))
}

/// The field is smooth within a voxel: thinner slabs show nothing new, and take time in proportion to their number.
const THINNEST_SLAB: f64 = 1.0 / 1024.0;

fn slab(voxels: f64) -> Result<(), Error> {
    let is_good = voxels >= THINNEST_SLAB && voxels.is_finite();
    let expected =
        "1/1024 voxel or more: thinner ones show nothing new and take time in proportion";
    in_range("the slab thickness", voxels, is_good, expected)
}

fn share(name: &str, value: f32) -> Result<(), Error> {
    let value = f64::from(value);
    let is_good = (0.0..1.0).contains(&value);
    in_range(name, value, is_good, "0 or more, and less than 1")
}

fn validate_surface(surface: &Isosurface) -> Result<(), Error> {
    if !surface.value.is_finite() {
        return wrong(format!(
            "the surface is at {}, expected a finite number",
            surface.value
        ));
    }
    if !(surface.opacity > 0.0 && surface.opacity <= 1.0) {
        return wrong(format!(
            "the opacity of the surface is {}, expected above 0, at most 1",
            surface.opacity
        ));
    }
    match surface.colour {
        Some(rgb) if !rgb.iter().all(|c| c.is_finite() && *c >= 0.0) => wrong(format!(
            "the colour of the surface is {rgb:?}, expected finite numbers from 0 on"
        )),
        _ => Ok(()),
    }
}
