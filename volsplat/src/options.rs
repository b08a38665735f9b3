//! What a caller can choose: one plain struct, every field with unit, range, default and effect.

use glam::DVec3;

use crate::Error;
use crate::clip::Clip;
use resample_core::simd::SimdLevel;
use resample_core::{FootprintMode, KernelShape, OpacityMode, SelectMode};

/// The choices of one rendering. `RenderOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// In which order samples are composited.
    pub order: Order,
    /// What is kept of the volume.
    pub clip: Clip,
    /// Image sheets: thickness of a slab along the view direction, in voxels (the smallest spacing).
    pub slab_voxels: f64,
    /// Image sheets: shape of the reconstruction kernel.
    pub sheet_kernel: SheetKernel,
    /// Image sheets, radial kernels, post-classified: whether the kernels' sum blurs or passes through the voxels.
    pub interpolate: Interpolate,
    /// Image sheets: whether the transfer function is applied to voxels or to what their kernels sum up to. The other
    /// orders classify voxels, whatever is said here.
    pub classify: Classify,
    /// How samples are lit. The orders of samples light one channel of scalars.
    pub shading: Shading,
    /// Where the light of shading comes from.
    pub light: Light,
    /// Sub-pixels along a pixel's side at which samples or sheets are composited before they are averaged.
    pub subpixels: Subpixels,
    /// What pre-classified samples stand for: voxels, or what lies between them.
    pub cells: Cells,
    /// `Cells::Split`: a cell is split where the opacity of a part over one opacity unit, or the colour that it adds, is
    /// farther than this from that of the whole; 0..1.
    pub cell_error: f32,
    /// Every sample and axis sheets: shape of the reconstruction kernel.
    pub kernel: KernelShape,
    /// What a pixel shows of its ray. All but `Emission` need image sheets that gather.
    pub blend: Blend,
    /// Emission: lengths of the gradient, value per world unit, between which a factor of
    /// the extinction rises from 0 to 1; from 0 on, the first below the second. Labels are not modulated. `None` is off.
    pub gradient_opacity: Option<[f64; 2]>,
    /// How a perspective footprint is evaluated.
    pub footprint: FootprintMode,
    /// How the opacity of a voxel becomes the opacity of a pixel.
    pub opacity: OpacityMode,
    /// Which samples are points and which are splats. In image sheets it holds for radial kernels, where `Ewa` is refused.
    pub select: SelectMode,
    /// In `SelectMode::Hybrid`: a sample whose spacing projects to less than this is a point. Pixels, above 0.
    pub point_threshold_px: f32,
    /// Depth range within which points are summed before they are composited, in voxels (the smallest spacing).
    pub sheet_voxels: f64,
    /// A pixel is left alone once its transmittance is below this, 0..1: no pixel changes by more than this.
    /// 0 never stops early.
    pub min_transmittance: f32,
    /// The length, in world units, over which a transfer function's opacity is meant; `None` is the smallest spacing.
    pub opacity_unit: Option<f64>,
    /// What gives a sample its colour.
    pub colour_by: ColourBy,
    /// Whether the picture carries a depth plane.
    pub depth: DepthPlane,
    /// Vector instructions to use. Levels agree to rounding.
    pub simd: SimdLevel,
}

/// In which order samples are composited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Each pre-classified sample over those behind it, as point or splat (the paper, section 4.1).
    EverySample,
    /// Pre-classified samples summed in the slice of the grid that faces the view, slice over slice (Westover 1990).
    /// Jumps where the facing slice changes; made to be measured against.
    AxisSheets,
    /// Slabs parallel to the image plane: scalars are summed per slab, classified per pixel, and composited
    /// (Mueller and Crawfis 1998).
    ImageSheets,
}

/// What a pixel shows of its ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blend {
    /// Emission and absorption: each sample behind those before it.
    Emission,
    /// The greatest scalar, classified: its opacity over one opacity unit is the pixel's.
    Maximum,
    /// The least scalar inside the volume, classified alike.
    Minimum,
    /// The mean of the scalars inside the volume, classified alike.
    Average,
    /// A surface of one scalar.
    Isosurface(Isosurface),
}

/// A surface of one scalar. It is lit as the shading says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isosurface {
    /// The scalar, finite.
    pub value: f64,
    /// Linear red, green, blue; `None` is the transfer function's colour of the scalar.
    pub colour: Option<[f32; 3]>,
    /// Opacity of the surface each time that a ray crosses it; above 0, at most 1.
    pub opacity: f32,
}

/// How samples are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// A sample has the colour of the transfer function.
    None,
    /// Ambient and diffuse light by the gradient.
    Lambert,
    /// As `Lambert`, with a white highlight.
    Phong,
}

/// Where the light of shading comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Along the view direction of the camera.
    Headlight,
    /// From this direction in the world: it points towards the light, and has any length above 0.
    Towards(DVec3),
}

/// Shape of the kernel in image sheets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetKernel {
    /// Trilinear interpolation, read on the plane through a slab's middle.
    Trilinear,
    /// A ball, cut into slab sections.
    Radial(KernelShape),
}

/// What a sum of kernels does at the voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolate {
    /// It is the mean of the neighbourhood that the kernel makes: a blur.
    Off,
    /// It takes the voxel's own value: coefficients are solved for when the volume is prepared, and what overshoots
    /// between voxels is clamped to the range of those in reach.
    On,
}

/// What the transfer function is applied to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Classify {
    /// Voxels: their extinction and colour are summed.
    Pre,
    /// The reconstructed scalar: scalars are summed, and classified per slab and pixel.
    Post,
}

/// What a pre-classified sample stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// `Split` in every-sample; `Off` in the other orders, and where the volume is a single slice.
    Auto,
    /// A voxel, by its own value: the paper's way.
    Off,
    /// A cell of eight voxels: the mean of the classified field inside.
    Mean,
    /// A cell, or parts of it where the classified field varies inside. Not in image sheets.
    Split,
}

/// Sub-pixels along a pixel's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subpixels {
    /// As many as make the middle of what is visible about two sub-pixels a voxel, or with every-sample about one a sample,
    /// 1 to 8; 1 in axis sheets.
    Auto,
    /// This many: 1, 2, 4, 8 or 16.
    Fixed(u32),
}

/// What gives a sample its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourBy {
    /// The transfer function.
    Transfer,
    /// Splats are painted red, points keep the colour of the transfer function (the paper, Figure 8a).
    Select,
}

/// Whether the picture carries a depth plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthPlane {
    /// No depth.
    None,
    /// Opacity-weighted mean camera z, world units; +infinity where nothing is seen.
    Expected,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            order: Order::ImageSheets,
            clip: Clip::default(),
            slab_voxels: 0.5,
            sheet_kernel: SheetKernel::Trilinear,
            interpolate: Interpolate::Off,
            classify: Classify::Post,
            shading: Shading::None,
            light: Light::Headlight,
            subpixels: Subpixels::Auto,
            cells: Cells::Auto,
            cell_error: 1.0 / 16.0,
            // 1.1 to 1.6 dB nearer to the trilinear truth than the Gaussian, in less time.
            kernel: KernelShape::Polynomial,
            blend: Blend::Emission,
            gradient_opacity: None,
            footprint: FootprintMode::Exact,
            opacity: OpacityMode::Extinction,
            select: SelectMode::Hybrid,
            point_threshold_px: 1.0,
            sheet_voxels: 1.0,
            // Half a step of an 8-bit picture.
            min_transmittance: 1.0 / 512.0,
            opacity_unit: None,
            colour_by: ColourBy::Transfer,
            depth: DepthPlane::None,
            simd: SimdLevel::Auto,
        }
    }
}

impl RenderOptions {
    /// Every sample over the next, with the default of every other choice.
    pub fn every_sample() -> Self {
        Self {
            order: Order::EverySample,
            ..Self::default()
        }
    }

    /// The paper's way: every voxel over the next, by its own value, with a Gaussian, pixel by pixel.
    pub fn paper() -> Self {
        Self {
            cells: Cells::Off,
            subpixels: Subpixels::Fixed(1),
            kernel: KernelShape::Gaussian,
            ..Self::every_sample()
        }
    }

    /// Westover's order, with the default of every other choice.
    pub fn axis_sheets() -> Self {
        Self {
            order: Order::AxisSheets,
            ..Self::default()
        }
    }

    /// Checks every number against its range.
    pub fn validate(&self) -> Result<(), Error> {
        let range = |name: &str, value: f64, good: bool, expected: &str| {
            if good {
                Ok(())
            } else {
                Err(Error::Option(format!(
                    "{name} is {value}, expected {expected}"
                )))
            }
        };
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let threshold = f64::from(self.point_threshold_px);
        range(
            "the point threshold",
            threshold,
            positive(threshold),
            "pixels above 0",
        )?;
        range(
            "the sheet thickness",
            self.sheet_voxels,
            positive(self.sheet_voxels),
            "voxels above 0",
        )?;
        range(
            "the slab thickness",
            self.slab_voxels,
            positive(self.slab_voxels),
            "voxels above 0",
        )?;
        if let Subpixels::Fixed(n) = self.subpixels {
            range(
                "the number of sub-pixels",
                f64::from(n),
                [1, 2, 4, 8, 16].contains(&n),
                "1, 2, 4, 8 or 16",
            )?;
        }
        self.validate_sheets()?;
        self.validate_shading()?;
        self.clip.validate()?;
        self.validate_blend()?;
        let least = f64::from(self.min_transmittance);
        range(
            "the least transmittance",
            least,
            (0.0..1.0).contains(&least),
            "0 or more, and less than 1",
        )?;
        let cell = f64::from(self.cell_error);
        range(
            "the error of cells",
            cell,
            (0.0..1.0).contains(&cell),
            "0 or more, and less than 1",
        )?;
        let unit = self.opacity_unit.unwrap_or(1.0);
        range("the opacity unit", unit, positive(unit), "a length above 0")
    }

    /// Whether image sheets sum kernels, and do not gather or scatter the trilinear field.
    pub(crate) fn sums_kernels(&self) -> bool {
        self.sheet_kernel != SheetKernel::Trilinear || self.classify == Classify::Pre
    }

    fn validate_sheets(&self) -> Result<(), Error> {
        let radial = self.sheet_kernel != SheetKernel::Trilinear;
        if self.order == Order::ImageSheets && radial && self.select == SelectMode::Ewa {
            let what = "ewa belongs to the orders every-sample and axis-sheets: in image-sheets use hybrid, splats or points";
            return Err(Error::Option(what.into()));
        }
        let has_kernels =
            self.order == Order::ImageSheets && radial && self.classify == Classify::Post;
        if self.interpolate == Interpolate::On && !has_kernels {
            let what = "kernels interpolate in post-classified image sheets: use --order image-sheets with --kernel polynomial, \
                        gaussian or b-spline";
            return Err(Error::Option(what.into()));
        }
        let what = match (self.order, self.classify, self.cells) {
            (Order::ImageSheets, Classify::Post, Cells::Mean | Cells::Split) => {
                "cells are classified before they are drawn: use --classify pre, --order every-sample or axis-sheets"
            }
            (Order::ImageSheets, Classify::Pre, _) if !radial => {
                "classified samples are summed with a radial kernel: use the polynomial, the Gaussian or the B-spline"
            }
            (Order::ImageSheets, Classify::Pre, Cells::Split) => {
                "image sheets have one size of samples: use --cells mean, or --order every-sample"
            }
            _ => return Ok(()),
        };
        Err(Error::Option(what.into()))
    }

    /// Whether samples are gathered from cells, which most choices of what a pixel shows need.
    fn gathers(&self) -> bool {
        self.order == Order::ImageSheets && !self.sums_kernels()
    }

    /// Whether the gradient changes what is seen.
    pub(crate) fn follows_gradient(&self) -> bool {
        self.shading != Shading::None || self.gradient_opacity.is_some()
    }

    fn validate_blend(&self) -> Result<(), Error> {
        let wrong = |what: String| Err(Error::Option(what));
        if self.blend != Blend::Emission && !self.gathers() {
            return wrong(
                "this blend mode needs image sheets with the trilinear kernel, post-classified"
                    .into(),
            );
        }
        match (self.blend, self.gradient_opacity) {
            (Blend::Isosurface(iso), _)
                if !iso.value.is_finite() || !(iso.value as f32).is_finite() =>
            {
                wrong(format!(
                    "the surface is at {}, expected a finite number",
                    iso.value
                ))
            }
            (Blend::Isosurface(iso), _) if !(iso.opacity > 0.0 && iso.opacity <= 1.0) => {
                wrong(format!(
                    "the opacity of the surface is {}, expected above 0, at most 1",
                    iso.opacity
                ))
            }
            (
                Blend::Isosurface(Isosurface {
                    colour: Some(rgb), ..
                }),
                _,
            ) if !rgb.iter().all(|c| c.is_finite() && *c >= 0.0) => wrong(format!(
                "the colour of the surface is {rgb:?}, expected finite numbers from 0 on"
            )),
            (_, Some([low, high])) if !(low >= 0.0 && low < high && high.is_finite()) => {
                wrong(format!(
                    "the ramp over the gradient is {low} to {high}, expected finite numbers from 0 on, rising"
                ))
            }
            (blend, Some(_)) if blend != Blend::Emission => {
                wrong("opacity by the gradient goes with emission only: leave out --blend".into())
            }
            _ => Ok(()),
        }
    }

    fn validate_shading(&self) -> Result<(), Error> {
        let is_statistic = matches!(self.blend, Blend::Maximum | Blend::Minimum | Blend::Average);
        let wrong = |what: &str| Err(Error::Option(what.into()));
        match self.light {
            _ if self.shading != Shading::None && is_statistic => {
                wrong("a greatest, least or mean scalar is not lit: leave out --shade or --blend")
            }
            Light::Towards(direction) if direction.try_normalize().is_none() => wrong(&format!(
                "the light comes from {direction}, expected a direction"
            )),
            _ => Ok(()),
        }
    }
}
