//! Options of `resample warp3d`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. Cameras are only split
//! into file and entry here; `viewpoint.rs` reads them.

use std::path::PathBuf;

use clap::Args;
use resample_core::camera::PixelCentre;
use warp3d::WarpArgs;
use warp3d::input::DepthKind;
use warp3d::multiview::{Anaglyph, Places};

use crate::args::{AskArgs, Given, PartArgs, PictureArgs};
use crate::cameras::viewpoint;
use crate::cameras::viewpoint::Viewpoint;
use crate::values;
use crate::values::input_file::{HeldPictures, Source};
use crate::values::{Grid, IntrinsicsWord, Size, Sway};

/// Options of `resample warp3d`.
#[derive(Args, Clone, Debug, Default)]
pub struct Warp3dArgs {
    /// Picture: PNG, JPEG, TIFF or EXR (FILE.exr#LAYER), detected by the content
    ///
    /// A sequence has a pattern such as %05d in the name, or a list: a text file (.txt) with a name a line, or a time in
    /// seconds and a name. DEPTH is then a pattern or a list too; --from and --to may name a file of as many cameras, one
    /// with their times or names, or a pattern. A film is any that ffmpeg reads; - is a film on the standard input.
    #[arg(value_name = "COLOUR")]
    pub colour: String,
    /// Depth of the picture: EXR (FILE.exr#CHANNEL), PFM, PNG, .npy or TIFF, of any size
    ///
    /// Of a film: a film, or half of one (FILM#right, #left, #top, #bottom); of the same film, the other half is the picture.
    #[arg(value_name = "DEPTH")]
    pub depth: String,
    /// Picture to write, .png, .jpg or .exr, or - for the standard output; a pattern such as %04d is replaced by the number of the picture
    ///
    /// An EXR file also holds depth (Z), the filled part, and the confidence. With .apng, .webp or .gif, all pictures go into
    /// one animation; with .mp4, .webm or .mkv into one video, which needs the program ffmpeg. With .mpo and .jps, the views of --stereo are a stereo photograph.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write where the picture has or had holes as a grey PNG or EXR: 1 where nothing was seen
    #[arg(long, value_name = "FILE")]
    pub filled: Option<PathBuf>,
    /// Also write how well each pixel was seen as a grey PNG or EXR: 0 to 1
    #[arg(long, value_name = "FILE")]
    pub confidence: Option<PathBuf>,
    /// Also write counts and times as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Most memory to use, such as 4G or 512M; a warp that needs more is refused, with the memory it needs
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    /// Source of the pictures: their files, or memory.
    #[arg(skip)]
    pub source: Source<HeldPictures>,
    /// Cameras.
    #[command(flatten)]
    pub cameras: WarpCameraArgs,
    /// The meaning of the depth file's numbers.
    #[command(flatten)]
    pub meaning: DepthArgs,
    /// Several views in one picture.
    #[command(flatten)]
    pub views: ViewArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: WarpSequenceArgs,
    /// How it is drawn.
    #[command(flatten)]
    pub render: Given<WarpArgs>,
    /// An error or a time that is asked for.
    #[command(flatten)]
    pub ask: AskArgs,
    /// How the picture is written.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// Where pictures were and are taken from.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Cameras")]
pub struct WarpCameraArgs {
    /// Camera of the picture: FILE, FILE#ENTRY, fov:DEGREES (the vertical angle of view) or equirectangular [default: the
    /// lens of --intrinsics, at the origin]
    ///
    /// Files: this program's JSON, Middlebury calib.txt, Open3D and TUM trajectories, Open3D's camera JSON, a COLMAP
    /// model (its folder, images.txt or images.bin), NeRF and Blender transforms.json, MPEG camera JSON, poses as 4x4 or
    /// 3x4 matrices (7-Scenes, ScanNet, KITTI). ENTRY is the name, number or time of a camera in the file. A lens with
    /// distortion is undistorted on reading.
    #[arg(long, value_name = "CAM", value_parser = viewpoint::parse)]
    pub from: Option<Viewpoint>,
    /// New camera: FILE, FILE#ENTRY, or shift:X,Y,Z from the picture's camera (right, down, forward) [default: the
    /// picture's own camera, with --stereo, --layout, --quilt or --sway]
    ///
    /// A file of several cameras without ENTRY gives one numbered picture for each.
    #[arg(long, value_name = "CAM", value_parser = viewpoint::parse)]
    pub to: Option<Viewpoint>,
    /// Also write the new cameras as a camera file, from which --to draws the same bytes
    #[arg(long, value_name = "FILE.json")]
    pub save_camera: Option<PathBuf>,
    /// A further picture, its depth and its camera; may be repeated
    #[arg(long, value_names = ["COLOUR", "DEPTH", "CAM"], num_args = 3, action = clap::ArgAction::Append)]
    pub reference: Vec<String>,
    /// Lens of the picture in pixels, where the camera file holds poses alone: numbers, or a file (Open3D's JSON, a
    /// matrix)
    #[arg(long, value_name = "FX,FY,CX,CY|FILE", value_parser = values::intrinsics)]
    pub intrinsics: Option<IntrinsicsWord>,
    /// Pixel-centre convention of CX and CY: integer (0) or half (0.5)
    #[arg(long, value_enum, default_value = "integer")]
    pub pixel_centre: PixelCentre,
    /// Size of the new picture in pixels [default: that of its camera]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,
}

/// The meaning of a depth file's numbers.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Depth")]
pub struct DepthArgs {
    /// Meaning of the depth file's numbers [default: z; relative for a film]
    #[arg(long, value_enum)]
    pub depth_kind: Option<DepthKind>,
    /// World units per stored unit, such as 0.001; needed where distances are stored in whole numbers [default: 1]
    #[arg(long, value_name = "S", value_parser = values::positive)]
    pub depth_scale: Option<f64>,
    /// Near plane of an MPEG or OpenGL depth code or of relative depth, world units
    #[arg(long, value_name = "Z", value_parser = values::positive, requires = "far")]
    pub near: Option<f64>,
    /// Far plane of an MPEG or OpenGL depth code or of relative depth, world units
    #[arg(long, value_name = "Z", value_parser = values::positive, requires = "near")]
    pub far: Option<f64>,
    /// Stored numbers of relative depth that mean the far and the near plane, such as 0,255; numbers beyond are put there
    /// [default: all but 0.5 % of the numbers at each end, of all pictures of a sequence together]
    #[arg(long, value_name = "FAR,NEAR", value_parser = values::ascending, allow_hyphen_values = true)]
    pub relative_range: Option<[f64; 2]>,
    /// A stored number that means "unknown", beside 0, NaN and infinity
    #[arg(long, value_name = "V", value_parser = values::number, allow_hyphen_values = true)]
    pub invalid: Option<f64>,
    /// Stereo baseline for disparity maps, world units [default: that of calib.txt]
    #[arg(long, value_name = "B", value_parser = values::positive)]
    pub baseline: Option<f64>,
    /// Difference of the principal points of a disparity, px [default: that of calib.txt, else 0]
    #[arg(long, value_name = "PX", value_parser = values::number, allow_hyphen_values = true)]
    pub doffs: Option<f64>,
}

impl DepthArgs {
    /// The meaning that was typed, else camera z.
    pub fn kind(&self) -> DepthKind {
        self.depth_kind.unwrap_or(DepthKind::Z)
    }
}

/// Several views in one picture.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Stereo and light fields")]
pub struct ViewArgs {
    /// Two views this far apart (world units), side by side unless --layout says otherwise
    #[arg(long, value_name = "BASELINE", value_parser = values::positive, conflicts_with = "quilt")]
    pub stereo: Option<f64>,
    /// How views lie in the picture [default with --stereo: side-by-side]
    #[arg(long, value_enum, conflicts_with_all = ["quilt", "anaglyph"])]
    pub layout: Option<LayoutWord>,
    /// One red-cyan picture of the two views of --stereo
    #[arg(long, value_enum, requires = "stereo", num_args = 0..=1, default_missing_value = "dubois")]
    pub anaglyph: Option<Anaglyph>,
    /// Most disparity of the views of --stereo before and behind the screen, per cent of the width: the eyes stand closer
    /// together where there is more
    #[arg(long, value_name = "PERCENT", value_parser = values::positive, requires = "stereo")]
    pub comfort: Option<f64>,
    /// Black bars at the outer sides of the views of --stereo, as wide as the disparity of the nearest things, so that the
    /// frame cuts off nothing that stands before the screen
    #[arg(long, requires = "stereo")]
    pub floating_window: bool,
    /// A grid of COLUMNSxROWS views for light-field screens: the leftmost view at the bottom left, the rightmost at
    /// the top right, row by row upwards
    #[arg(long, value_name = "CxR", value_parser = values::grid)]
    pub quilt: Option<Grid>,
    /// Angle between the outer views of --quilt, degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, default_value = "40", requires = "quilt")]
    pub view_cone: f64,
    /// Distance at which the views of --stereo and --quilt agree and about which --sway turns; `inf` for parallel
    /// views [default: the median depth]
    #[arg(long, value_name = "Z", value_parser = values::distance)]
    pub convergence: Option<f64>,
}

/// How views lie in a picture, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LayoutWord {
    /// Of --stereo: the left eye's view on the left
    SideBySide,
    /// Of --stereo: the left eye's view on the left, both at half their width, as 3-D screens expect them
    HalfSideBySide,
    /// Of --stereo: the left eye's view above
    TopBottom,
    /// Of --stereo: the left eye's view above, both at half their height
    HalfTopBottom,
    /// Of --stereo: the right eye's view on the left, to be seen with crossed eyes
    CrossEye,
    /// The picture on the left, its inverse depth in grey on the right, near white
    ColourAndDepth,
    /// All directions around the new camera, longitude along x and latitude along y; the width is 360 degrees. With --stereo, of a panorama: the left eye's above
    Equirectangular,
    /// Of --stereo: the left eye's view on the left, each a square of 180 by 180 degrees, for headsets
    Vr180,
}

impl Warp3dArgs {
    /// The distance of two eyes that are drawn from all around one panorama; `None` where none are.
    pub(crate) fn baseline_around(&self) -> Option<f64> {
        let is_panorama =
            self.cameras.from == Some(Viewpoint::Equirectangular) && self.cameras.to.is_none();
        let (views, is_around) = (
            &self.views,
            self.views.layout.is_some_and(LayoutWord::is_around),
        );
        views.stereo.filter(|_| is_panorama && is_around)
    }
}

impl LayoutWord {
    /// Returns true if a view holds directions beside those of a lens.
    pub(crate) fn is_around(self) -> bool {
        matches!(self, Self::Equirectangular | Self::Vr180)
    }

    /// Where the views of a stereo pair lie, if there are two.
    pub fn places(self) -> Option<Places> {
        match self {
            Self::SideBySide => Some(Places::SideBySide),
            Self::HalfSideBySide => Some(Places::HalfSideBySide),
            Self::TopBottom => Some(Places::TopBottom),
            Self::HalfTopBottom => Some(Places::HalfTopBottom),
            Self::CrossEye => Some(Places::CrossEye),
            Self::ColourAndDepth | Self::Equirectangular | Self::Vr180 => None,
        }
    }
}

/// Several pictures, one after another.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Several pictures")]
pub struct WarpSequenceArgs {
    /// Move through the keys of a file, each with a time in seconds and a camera, in numbered pictures
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["to", "sway"])]
    pub path: Option<PathBuf>,
    /// Sway around the scene, up to this angle from the new camera, once around in N pictures [default: 48]
    #[arg(long, value_name = "DEG[,N]", value_parser = values::sway)]
    pub sway: Option<Sway>,
    /// Pictures over which the depth of things at rest is averaged, scale and offset of each taken out; 0 takes every depth
    /// as it is [default: 32 for a sequence whose depth has no unit, else 0]
    #[arg(long, value_name = "N")]
    pub steady: Option<u32>,
    /// Text file of the numbers of the pictures that begin a shot, counted from 0 [default: found in colour and depth]
    #[arg(long, value_name = "FILE")]
    pub cuts: Option<PathBuf>,
    /// Also draw from the N pictures before and after each one of a sequence whose pictures have cameras of their own
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true)]
    pub neighbours: usize,
    /// Keep pictures, and pieces of a video, that were already drawn with these options and draw the rest: continues after Ctrl-C
    #[arg(long)]
    pub resume: bool,
    /// Pictures per second of an animation or of --path [default: 25, or the film's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1_000))]
    pub fps: Option<u16>,
    /// The pictures that this process draws.
    #[command(flatten)]
    pub part: PartArgs,
}

super::given::defaults_untyped!(WarpCameraArgs, DepthArgs, ViewArgs);
