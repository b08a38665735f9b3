//! The commands that draw, as one type: which application it is, and the options that say how it draws.

use std::path::Path;

use anyhow::{Result, bail};
use clap::Subcommand;

use super::{
    AskArgs, GaussiansArgs, Goes, PartArgs, PictureArgs, PointsArgs, TexmapArgs, VolsplatArgs,
    Warp3dArgs, short_help,
};
use crate::values::input_file::{Held, Source};

/// A command that draws.
#[derive(Clone, Debug, Subcommand)]
pub enum Drawing {
    /// Render a textured mesh (glTF, OBJ, PLY, STL) from one or several cameras
    ///
    /// Example: resample texmap helmet.glb -o helmet.png
    #[command(mut_args(short_help::texmap))]
    Texmap(Box<TexmapArgs>),
    /// Draw a volume file from one or several cameras
    ///
    /// Example: resample volsplat engine.raw --dims 256,256,128 --type u8 -o engine.png
    #[command(mut_args(short_help::volsplat))]
    Volsplat(Box<VolsplatArgs>),
    /// Draw a file of 3-D Gaussians from one or several cameras
    ///
    /// Example: resample gaussians garden.ply -o garden.png
    #[command(mut_args(short_help::gaussians))]
    Gaussians(Box<GaussiansArgs>),
    /// Render an image with a depth map from a new viewpoint
    ///
    /// Example: resample warp3d im0.png disp0.pfm --depth-kind disparity --from calib.txt#0 --to calib.txt#1 -o new.png
    #[command(name = "warp3d", mut_args(short_help::warp3d))]
    Warp3d(Box<Warp3dArgs>),
    /// Draw a scan of points (PLY, LAS, LAZ, E57, PCD, PTX, PTS, XYZ) from one or several cameras
    ///
    /// Example: resample points street.laz -o street.png
    #[command(mut_args(short_help::points))]
    Points(Box<PointsArgs>),
}

impl Drawing {
    /// The name of the command.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Texmap(_) => "texmap",
            Self::Volsplat(_) => "volsplat",
            Self::Gaussians(_) => "gaussians",
            Self::Warp3d(_) => "warp3d",
            Self::Points(_) => "points",
        }
    }

    /// The error or the time that is asked for.
    pub fn ask(&self) -> &AskArgs {
        match self {
            Self::Texmap(args) => &args.ask,
            Self::Volsplat(args) => &args.ask,
            Self::Gaussians(args) => &args.ask,
            Self::Warp3d(args) => &args.ask,
            Self::Points(args) => &args.ask,
        }
    }

    /// As [`Drawing::ask`], to be changed.
    pub(crate) fn ask_mut(&mut self) -> &mut AskArgs {
        match self {
            Self::Texmap(args) => &mut args.ask,
            Self::Volsplat(args) => &mut args.ask,
            Self::Gaussians(args) => &mut args.ask,
            Self::Warp3d(args) => &mut args.ask,
            Self::Points(args) => &mut args.ask,
        }
    }

    /// Returns true if pictures that exist are kept.
    pub fn resume(&self) -> bool {
        match self {
            Self::Texmap(args) => args.sequence.resume,
            Self::Volsplat(args) => args.sequence.resume,
            Self::Gaussians(args) => args.sequence.resume,
            Self::Warp3d(args) => args.sequence.resume,
            Self::Points(args) => args.sequence.resume,
        }
    }

    /// The part of the pictures that is drawn.
    pub fn part(&self) -> PartArgs {
        match self {
            Self::Texmap(args) => args.sequence.part,
            Self::Volsplat(args) => args.sequence.part,
            Self::Gaussians(args) => args.sequence.part,
            Self::Warp3d(args) => args.sequence.part,
            Self::Points(args) => args.sequence.part,
        }
    }

    /// Rejects options that separate processes could resolve differently.
    pub(crate) fn check_part(&self) -> Result<()> {
        let part = self.part();
        let is_part = part != PartArgs::default();
        if is_part && self.ask().max_time_ms.is_some() {
            bail!(
                "--max-time: each process would choose by its own clock: give --max-error, or leave --frames and --tile out"
            );
        }
        match (part.tile, self) {
            (Some(_), Self::Warp3d(_)) => bail!(
                "--tile: a warp moves all of its samples for any part of a picture: divide the pictures by --frames"
            ),
            _ => Ok(()),
        }
    }

    /// Takes a scene of memory in place of its file; one of another command changes nothing.
    pub fn hold(&mut self, held: &Held) {
        match (self, held) {
            (Self::Volsplat(args), Held::Volumes(held)) => {
                args.scene.meshes.extend(held.meshes.iter().cloned());
                args.source = Source::Memory(held.clone());
            }
            (Self::Volsplat(args), Held::Meshes(held)) => {
                args.scene.meshes.extend(held.iter().cloned());
            }
            (Self::Gaussians(args), Held::Gaussians(held)) => {
                args.source = Source::Memory(held.clone());
            }
            (Self::Texmap(args), Held::Mesh(held)) => args.source = Source::Memory(held.clone()),
            (Self::Warp3d(args), Held::Pictures(held)) => {
                args.source = Source::Memory(held.clone());
            }
            (Self::Points(args), Held::Points(held)) => args.source = Source::Memory(held.clone()),
            _ => {}
        }
    }

    /// Renders to memory instead of files (embedding API).
    pub fn keep_in_memory(&mut self) {
        self.picture_mut().goes = Goes::Memory;
    }

    /// Names the picture to write.
    pub fn write_to(&mut self, path: &Path) {
        self.write(path, Goes::File);
    }

    /// Names the picture to write; files that exist are an error, numbered ones too.
    pub fn write_to_new(&mut self, path: &Path) {
        self.write(path, Goes::NewFile);
    }

    fn write(&mut self, path: &Path, goes: Goes) {
        self.picture_mut().goes = goes;
        let output = match self {
            Self::Texmap(args) => &mut args.output,
            Self::Volsplat(args) => &mut args.output,
            Self::Gaussians(args) => &mut args.output,
            Self::Warp3d(args) => &mut args.output,
            Self::Points(args) => &mut args.output,
        };
        *output = path.to_owned();
    }

    fn picture_mut(&mut self) -> &mut PictureArgs {
        match self {
            Self::Texmap(args) => &mut args.picture,
            Self::Volsplat(args) => &mut args.picture,
            Self::Gaussians(args) => &mut args.picture,
            Self::Warp3d(args) => &mut args.picture,
            Self::Points(args) => &mut args.picture,
        }
    }
}
