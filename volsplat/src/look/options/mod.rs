//! Options: one struct of choices that every picture has, and one for each of the two pipelines.
//!
//! Every number has its unit, range and default beside it. With the crate feature `serde` options can be written and
//! read, and with `clap` they are arguments of a command line; names are the same in both.

mod check;
mod field;
mod samples;
mod seen;

use resample_core::OpacityMode;
use resample_core::simd::SimdLevel;

use crate::look::clip::Clip;
pub use field::{Blend, FieldOptions, Isosurface};
pub use samples::{
    Cells, Classify, ColourBy, Interpolate, KernelSheets, SampleOptions, SampleOrder,
};
pub use seen::{DepthPlane, Light, Shading, Subpixels};

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
    /// Emission: lengths of the gradient, value per world unit, between which a factor of
    /// the extinction rises from 0 to 1; from 0 on, the first below the second. Labels are not modulated. `None` is off.
    pub gradient_opacity: Option<[f64; 2]>,
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

    /// Returns true if the gradient changes the picture.
    pub(crate) fn follows_gradient(&self) -> bool {
        self.shading != Shading::None || self.gradient_opacity.is_some()
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
