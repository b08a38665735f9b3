//! Arguments of volumes, one struct for each group of `--help`.
//!
//! `channels` pairs the words of `--channel` and `--also`; `order` infers the order of compositing from options that only one order has.

mod channels;
pub(crate) mod order;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use resample_core::OpacityMode;
use resample_core::simd::SimdLevel;
use resample_io::{Gate, Outside};
use volsplat::transfer::{ColourEncoding, ColourMap, Preset};
use volsplat::{
    Cells, ClipPlane, Endian, FieldOptions, GradientFilter, GradientOpacity, KernelSheets, Layer,
    LightGrid, RenderOptions, SampleOptions, Shading, Subpixels, VoxelType,
};

pub use crate::args::volume::channels::{ChannelArgs, ComponentLook, LookWords, VolumeLook};

use crate::args::short_help;
use crate::values;
use crate::values::Window;
use crate::values::mesh_word::{IsoWord, MeshWord, SliceWord};

/// How the volume file is read.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Volume")]
pub struct VolumeArgs {
    /// Number of voxels along x, y and z (raw files)
    #[arg(long, value_name = "X,Y,Z", value_parser = values::dims, requires = "voxel_type")]
    pub dims: Option<[usize; 3]>,
    /// Type of a voxel: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64 (raw files)
    #[arg(long = "type", value_name = "TYPE", requires = "dims")]
    pub voxel_type: Option<VoxelType>,
    /// Byte order: little (default) or big (raw files)
    #[arg(long, value_name = "ORDER", requires = "dims")]
    pub endian: Option<Endian>,
    /// Bytes before the first voxel, 0 if not given (raw files)
    #[arg(long, value_name = "BYTES", requires = "dims")]
    pub skip: Option<u64>,
    /// Distance between voxels along x, y and z in world units, instead of the file's own [default: 1,1,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector)]
    pub spacing: Option<[f64; 3]>,
    /// World position of the centre of the first voxel, instead of the file's own [default: 0,0,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// Value that stands for NaN; without it, a volume that holds NaN is an error
    #[arg(long, value_name = "V", value_parser = values::number, allow_hyphen_values = true)]
    pub nan_as: Option<f64>,
    /// Multiply every value by SCALE and add OFFSET, such as 1,-1024 for a raw CT
    #[arg(long, value_name = "SCALE,OFFSET", value_parser = values::pair, allow_hyphen_values = true)]
    pub rescale_values: Option<[f64; 2]>,
    /// Rules of reading.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// Rules of reading files.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Reading")]
pub struct ReadingArgs {
    /// Most memory to work in, such as 4G or 512M [default: three quarters of what this machine or its control group has]
    ///
    /// A raw volume, or NRRD or MetaImage data that is not packed, is read brick by brick where it does not fit; a Zarr array
    /// is first unpacked into a temporary file in the folder TMPDIR. Files that cannot be read in parts are refused.
    /// Without this option, files that expand more than 500-fold or refer to the same data repeatedly are refused.
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    /// Follow names inside files out of the folder of the file that is typed
    #[arg(long)]
    pub allow_outside: bool,
}

impl ReadingArgs {
    /// The gate that lets this through.
    pub(crate) fn gate(&self) -> Gate {
        let outside = if self.allow_outside {
            Outside::Allowed
        } else {
            Outside::Refused
        };
        Gate::new(outside, self.max_memory)
    }
}

/// Channels, labels and masks.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Channels, labels, masks")]
pub struct SceneArgs {
    /// Mask volume: samples whose nearest mask voxel is 0 are hidden; resampled where it lies on another grid
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// The values are labels: never interpolated, each with a colour of its own; 0 is not drawn
    #[arg(long, conflicts_with_all = ["transfer", "window", "preset", "colormap", "show_transfer"])]
    pub labels: bool,
    /// Colours and opacities of labels: a label file of ITK-SNAP, CSV, or JSON; labels that it does not list are not drawn
    #[arg(long, alias = "label-colors", value_name = "FILE")]
    pub label_colours: Option<PathBuf>,
    /// Components of the file and further volumes, each with its look.
    #[command(flatten)]
    pub channels: ChannelArgs,
    /// Mesh that stands in the volume, in the volume's world coordinates; may be given several times
    ///
    /// An implant, an electrode, an outline: glTF, OBJ, STL or PLY. COLOUR paints it: red, #ff8000 or R,G,B; without it the mesh
    /// keeps its own colours. OPACITY is 0 to 1: skull.ply:white,0.3. Of a translucent mesh the nearest side is seen.
    #[arg(long = "mesh", value_name = "FILE[:COLOUR[,OPACITY]]", value_parser = MeshWord::of_file)]
    pub meshes: Vec<MeshWord>,
    /// Surface of a value inside the volume, beside the volume itself; may be given several times
    ///
    /// COLOUR paints it: red, #ff8000 or R,G,B; without it the transfer function does. OPACITY is 0 to 1: 300:white,0.5. The nearest side is
    /// seen. --iso draws a surface alone.
    #[arg(long = "with-iso", value_name = "VALUE[:COLOUR[,OPACITY]]", value_parser = IsoWord::of_text, allow_hyphen_values = true)]
    pub isosurfaces: Vec<IsoWord>,
    /// Slice that stands in the volume; may be given several times
    ///
    /// z=77 is the plane of that voxel, NX,NY,NZ,D any plane, as in --clip-plane. LOW,HIGH are the values that are black and white: z=77:0,400
    /// [default: all but the darkest hundredth and the brightest two]. Channels and labels have their colours.
    #[arg(long = "with-slice", value_name = "PLACE[:LOW,HIGH]", value_parser = SliceWord::of_text, allow_hyphen_values = true)]
    pub slices: Vec<SliceWord>,
}

/// How values become colour and opacity.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Transfer function")]
pub struct TransferArgs {
    /// Transfer function file: a colour map of ParaView (JSON), or a volume property of Slicer (.vp, .vp.json) [default: made from the
    /// histogram]
    #[arg(long, value_name = "FILE")]
    pub transfer: Option<PathBuf>,
    /// Colour space of the colours in the transfer function file
    #[arg(long, value_name = "SPACE", value_enum, default_value = "linear")]
    pub transfer_space: ColourEncoding,
    /// Move the file's knots, from the first to the last, to the range of the volume's values
    ///
    /// For colour maps that are written over 0 to 1. Opacity that the file does not give is made from the histogram and
    /// is not moved.
    #[arg(long, requires = "transfer")]
    pub rescale_transfer: bool,
    /// Values LOW to HIGH, or LEVEL - WIDTH/2 to LEVEL + WIDTH/2, span the colour map and an opacity from 0 to 1, as in CT: 40,400 or -160..240
    #[arg(long, value_name = "LEVEL,WIDTH|LOW..HIGH", value_parser = values::window, allow_hyphen_values = true,
        conflicts_with = "transfer")]
    pub window: Option<Window>,
    /// Preset: transfer function, shading and blend mode, such as ct-bone, mr-head, green-channel, flame; `list` prints all
    ///
    /// Those for CT expect Hounsfield units, others take the range of the volume's values. Opacities are per voxel,
    /// unless --opacity-unit says otherwise. --shade and --blend replace the light and the blending of the preset.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["transfer", "window", "colormap"])]
    pub preset: Option<Preset>,
    /// Colour map of the window, or of the transfer function that is made from the histogram [default: viridis]
    #[arg(
        long,
        alias = "colourmap",
        value_name = "NAME",
        conflicts_with = "transfer"
    )]
    pub colormap: Option<ColourMap>,
    /// Multiply the extinction of any transfer function: an opacity A becomes 1 - (1 - A)^S
    #[arg(long, value_name = "S", value_parser = values::positive, default_value = "1")]
    pub opacity_scale: f64,
    /// Length in world units over which an opacity is meant [default: the smallest distance between voxels]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive)]
    pub opacity_unit: Option<f64>,
    /// Also draw the transfer function over the histogram of the volume, as a PNG
    #[arg(long, value_name = "FILE.png", value_parser = values::png_name)]
    pub show_transfer: Option<PathBuf>,
}

/// The value of its ray that a pixel shows.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Blending (order field)")]
pub struct BlendArgs {
    /// The value of its ray that a pixel shows [default: emission, or isosurface with --iso]
    #[arg(long, value_enum)]
    pub blend: Option<RayBlend>,
    /// Draw the surface at this value, lit by the gradient
    #[arg(long, value_name = "VALUE", value_parser = values::number, allow_hyphen_values = true)]
    pub iso: Option<f64>,
    /// Colour of the surface: white, black, #rrggbb, or R,G,B from 0 to 255 [default: the transfer function's]
    #[arg(long, alias = "iso-color", value_name = "COLOUR", value_parser = values::colour, requires = "iso")]
    pub iso_colour: Option<[f32; 3]>,
    /// Opacity of the surface, each time that a ray crosses it; above 0, at most 1 [default: 1]
    #[arg(long, value_name = "A", value_parser = values::positive_f32, requires = "iso")]
    pub iso_opacity: Option<f32>,
    /// Planes of an EXR file beside colour and mean depth (Z) [default: none]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<Layer>>,
}

/// The value of its ray that a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RayBlend {
    /// Emission and absorption, sample behind sample
    Emission,
    /// The greatest value, through the transfer function
    Maximum,
    /// The least value inside the volume, through the transfer function
    Minimum,
    /// The mean of the values inside the volume, through the transfer function
    Average,
    /// The surface at --iso
    Isosurface,
}

/// The part of the volume that is drawn.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Clipping")]
pub struct ClipArgs {
    /// Draw only the inside of a box along the world's axes, from the first corner to the second
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop: Option<[[f64; 3]; 2]>,
    /// Draw only a box of voxels, from the first to the last, both included
    #[arg(long, value_name = "I0,J0,K0,I1,J1,K1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop_voxels: Option<[[f64; 3]; 2]>,
    /// Draw only the side of a plane where NX x + NY y + NZ z >= D, in the world; up to six times
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = values::plane, allow_hyphen_values = true)]
    pub clip_plane: Vec<ClipPlane>,
}

/// How the volume is drawn.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Rendering")]
pub struct RenderArgs {
    /// Order of compositing [default: field; an option that only one order has selects that order, and a single slice is
    /// drawn by every-sample]
    #[arg(long, value_enum)]
    pub order: Option<OrderName>,
    /// The trilinear field.
    #[command(flatten)]
    pub field: FieldOptions,
    /// Sub-pixels along a pixel's side: 1, 2, 4, 8, 16, or auto: about two per voxel (field), one per sample (every-sample), 1 (axis-sheets)
    #[arg(long, value_name = "N|auto", value_parser = values::subpixels, default_value = "auto")]
    pub subpixels: Subpixels,
    /// How the opacity of a voxel becomes the opacity of a pixel
    #[arg(long, value_enum, default_value_t = RenderOptions::default().opacity)]
    pub opacity: OpacityMode,
    /// Stop a ray once its remaining transmittance falls below T (0: never)
    #[arg(long, value_name = "T", value_parser = values::fraction,
        default_value_t = RenderOptions::default().min_transmittance)]
    pub min_transmittance: f32,
    /// SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    #[arg(long, value_enum, default_value = "auto")]
    pub vector_level: SimdLevel,
    /// How samples are lit, by the gradient of the volume [default: as the preset or the data have it; with --transfer,
    /// --window or --colormap none; of an isosurface phong]
    #[arg(long, value_enum)]
    pub shade: Option<Shading>,
    /// Gradient that light follows
    #[arg(long, value_enum, value_name = "FILTER", default_value_t = GradientFilter::Smooth)]
    pub gradient_filter: GradientFilter,
    /// Direction towards the light, in the world [default: the light is at the camera]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub light: Option<DVec3>,
    /// The volume casts shadows on itself, in the light from --light
    #[arg(long, requires = "light")]
    pub shadows: bool,
    /// Diameter of the light of shadows as they see it, degrees: the sun has 0.5, 0 makes hard shadows
    #[arg(long, value_name = "DEG", requires = "shadows", default_value_t = 0.0)]
    pub light_size: f64,
    /// The volume hides light of the sky from itself: depth reads. Matter farther away than RADIUS does not count, world units [default: a
    /// tenth of the visible part's diagonal]
    #[arg(long, value_name = "RADIUS", num_args = 0..=1, require_equals = true, value_parser = values::positive)]
    pub occlusion: Option<Option<f64>>,
    /// Light of shadows and occlusion is found at each voxel, or at one of 2, 4 or 8 along each axis, which is quicker and errs more [default:
    /// each voxel; in a file, as many as fit the memory]
    #[arg(
        long,
        value_name = "auto|1|2|4|8",
        hide_default_value = true,
        default_value_t
    )]
    pub light_grid: LightGrid,
    /// Multiply the extinction by a factor over the length of the gradient, value per world unit: 0 at LOW and 1 at HIGH, or a curve such as
    /// 0:0.1,10:0.1,40:1
    #[arg(long, value_name = "LOW,HIGH|G:FACTOR,...")]
    pub gradient_opacity: Option<GradientOpacity>,
    /// The part of the volume that is drawn.
    #[command(flatten)]
    pub clip: ClipArgs,
    /// The value of a ray that a pixel shows.
    #[command(flatten)]
    pub blend: BlendArgs,
    /// The samples of the paper's orders.
    #[command(flatten, next_help_heading = short_help::PAPER)]
    pub samples: SampleOptions,
    /// The part of the volume that a sample stands for: off, mean, split, split:E, or auto (split in every-sample, off in
    /// the other orders)
    ///
    /// off: a voxel, by its own value; mean: the mean of the field between eight voxels; split: the same, or its parts where one
    /// differs from the whole by more than E in colour or opacity (0.0625 if not given).
    #[arg(long, value_name = "CELLS", value_parser = values::cells, default_value = "auto")]
    pub cells: Cells,
    /// The sheets in which kernels are summed.
    #[command(flatten, next_help_heading = short_help::PAPER)]
    pub sheets: KernelSheets,
}

impl RenderArgs {
    /// Returns true if the volume is in the way of light.
    pub(crate) fn blocks_light(&self) -> bool {
        self.shadows || self.occlusion.is_some()
    }
}

/// `--order`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// The trilinear field on planes parallel to the picture, classified per sub-pixel: sharp and antialiased
    Field,
    /// Each classified sample over those behind it, as point or splat: the paper
    EverySample,
    /// Slices of samples, summed, one over another: jumps as the view turns, for comparison
    AxisSheets,
    /// Kernels summed in slabs parallel to the picture, for comparison
    ImageSheets,
}

impl OrderName {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Field => "field",
            Self::EverySample => "every-sample",
            Self::AxisSheets => "axis-sheets",
            Self::ImageSheets => "image-sheets",
        }
    }
}

super::given::defaults_untyped!(TransferArgs);
