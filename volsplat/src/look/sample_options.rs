//! The choices of samples: which they are, with which kernel, and in which order they are composited.

use resample_core::{FootprintMode, KernelShape, SelectMode};

/// Samples of a regular grid, each with a kernel around it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SampleOptions {
    /// In which order they are composited.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub order: SampleOrder,
    /// Shape of the reconstruction kernel
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = Self::default().kernel))]
    pub kernel: KernelShape,
    /// How a perspective footprint is evaluated (not in image sheets)
    #[cfg_attr(
        feature = "clap",
        arg(long, value_enum, default_value_t = Self::default().footprint)
    )]
    pub footprint: FootprintMode,
    /// Choice of points and splats; image sheets have no EWA
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = Self::default().select))]
    pub select: SelectMode,
    /// In hybrid: samples whose spacing projects to less than this many pixels are points
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "point-threshold",
            value_name = "PX",
            default_value_t = Self::default().point_threshold_px
        )
    )]
    pub point_threshold_px: f32,
    /// The meaning of a classified sample.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub cells: Cells,
    /// Depth range within which points are summed before they are composited, in voxels (every sample)
    #[cfg_attr(
        feature = "clap",
        arg(long = "sheet", value_name = "VOXELS", default_value_t = Self::default().sheet_voxels)
    )]
    pub sheet_voxels: f64,
    /// Source of a sample's colour (not in image sheets)
    #[cfg_attr(
        feature = "clap",
        arg(long, alias = "color-by", value_enum, default_value_t = Self::default().colour_by)
    )]
    pub colour_by: ColourBy,
}

/// In which order samples are composited.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum SampleOrder {
    /// Each classified sample over those behind it, as point or splat (the paper, section 4.1).
    #[default]
    EverySample,
    /// Classified samples summed in the slice of the grid that faces the view, slice over slice (Westover 1990).
    /// Jumps where the facing slice changes; made to be measured against.
    AxisSheets,
    /// Slabs parallel to the picture: kernels are summed slab by slab, and the slabs composited (Mueller and Crawfis
    /// 1998).
    ImageSheets(KernelSheets),
}

/// Slabs in which radial kernels are summed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct KernelSheets {
    /// Thickness of a slab along the view, in voxels (the smallest spacing).
    #[cfg_attr(feature = "clap", arg(skip = Self::default().slab_voxels))]
    pub slab_voxels: f64,
    /// Input of the transfer function
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = Self::default().classify))]
    pub classify: Classify,
    /// Post-classified: whether the kernels' sum blurs or passes through the voxels
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_enum,
            num_args = 0..=1,
            default_missing_value = "on",
            default_value_t = Self::default().interpolate
        )
    )]
    pub interpolate: Interpolate,
}

/// A sum of kernels at the voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Interpolate {
    /// It is the mean of the neighbourhood that the kernel makes: a blur
    Off,
    /// It takes the voxel's own value: coefficients are solved for when the volume is prepared, and what overshoots
    /// between voxels is clamped to the range of those in reach
    On,
}

/// The input of the transfer function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Classify {
    /// Voxels: their extinction and colour are summed
    Pre,
    /// The reconstructed scalar: scalars are summed, and classified per slab and pixel
    Post,
}

/// The meaning of a classified sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Cells {
    /// `Split` with the default error in every-sample; `Off` in the other orders, and where the volume is a single
    /// slice.
    #[default]
    Auto,
    /// A voxel, by its own value: the paper's way.
    Off,
    /// A cell of eight voxels: the mean of the classified field inside.
    Mean,
    /// A cell, or parts of it where the classified field varies inside. Not in image sheets.
    Split {
        /// A cell is split where the opacity of a part over one opacity unit, or the colour that it adds, is
        /// farther than this from that of the whole; 0..1.
        error: f32,
    },
}

/// The source of a sample's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum ColourBy {
    /// The transfer function
    Transfer,
    /// Splats are painted red, points keep the colour of the transfer function (the paper, Figure 8a)
    Select,
}

impl Cells {
    /// [`Cells::Split`] with the default error.
    pub const SPLIT: Self = Self::Split { error: 1.0 / 16.0 };
}

impl Default for KernelSheets {
    fn default() -> Self {
        Self {
            slab_voxels: 0.5,
            classify: Classify::Post,
            interpolate: Interpolate::Off,
        }
    }
}

impl Default for SampleOptions {
    fn default() -> Self {
        Self {
            order: SampleOrder::EverySample,
            // 1.1 to 1.6 dB nearer to the trilinear truth than the Gaussian, in less time.
            kernel: KernelShape::Polynomial,
            footprint: FootprintMode::Exact,
            select: SelectMode::Hybrid,
            point_threshold_px: 1.0,
            cells: Cells::Auto,
            sheet_voxels: 1.0,
            colour_by: ColourBy::Transfer,
        }
    }
}

impl SampleOptions {
    /// The paper's way: voxels by their own value, with a Gaussian.
    pub fn paper() -> Self {
        Self {
            kernel: KernelShape::Gaussian,
            cells: Cells::Off,
            ..Self::default()
        }
    }

    /// The slabs, where kernels are summed in them.
    pub fn sheets(&self) -> Option<&KernelSheets> {
        match &self.order {
            SampleOrder::ImageSheets(sheets) => Some(sheets),
            SampleOrder::EverySample | SampleOrder::AxisSheets => None,
        }
    }

    /// Takes from others what each frame reads anew.
    pub(crate) fn take_frame_choices(&mut self, others: &Self) {
        self.footprint = others.footprint;
        self.point_threshold_px = others.point_threshold_px;
        self.sheet_voxels = others.sheet_voxels;
        if let (SampleOrder::ImageSheets(own), Some(sheets)) = (&mut self.order, others.sheets()) {
            own.slab_voxels = sheets.slab_voxels;
        }
    }
}
