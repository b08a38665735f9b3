//! What is drawn: volumes in memory, or one that stays in its file because it is larger than the memory that was allowed.
//!
//! Takes what was typed, gives what framing and the stats file ask of the first volume, and a renderer.

use std::path::Path;

use anyhow::{Result, bail};
use volsplat::input::peek;
use volsplat::large::most_brick_bytes;
use volsplat::{Described, LargeVolume, RenderOptions, Renderer, TransferFunction};

use crate::args::{SceneArgs, TransferArgs, VolsplatArgs, VolumeArgs};
use crate::input_file::InputFile;
use crate::progress::{Progress, watch};
use crate::scene::{self, Volumes};
use crate::volume_file::load_options;
use crate::{report, transfer};

/// What is drawn.
pub(crate) enum Content {
    /// Volumes in memory.
    Memory(Volumes),
    /// A volume in its file, and how it looks.
    Stored(Box<LargeVolume>, TransferFunction),
}

impl Content {
    /// Reads the volumes, or looks the only one through.
    pub(crate) fn load(
        args: &VolsplatArgs,
        options: &RenderOptions,
        progress: Progress,
    ) -> Result<Self> {
        let max_memory = args.volume.max_memory;
        match look_through(&args.input, &args.volume, max_memory, options, progress)? {
            None => Ok(Self::Memory(scene::load(args)?)),
            Some(_) if !is_single(&args.scene) => bail!(
                "{}: masks, labels and further channels need all voxels in memory: allow more with --max-memory, leave them out, \
                 or draw a coarser level or a smaller volume",
                args.input.path.display()
            ),
            Some(volume) => {
                let function = transfer::function(&args.transfer, volume.as_ref())?;
                Ok(Self::Stored(volume, function))
            }
        }
    }

    /// The first volume, which gives the picture its grid.
    pub(crate) fn first(&self) -> &dyn Described {
        match self {
            Self::Memory(volumes) => volumes.first(),
            Self::Stored(volume, _) => volume.as_ref(),
        }
    }

    /// Takes another transfer function for the first volume, for renderers that are made from now on.
    pub(crate) fn set_function(&mut self, function: TransferFunction) {
        match self {
            Self::Memory(volumes) => volumes.set_function(function),
            Self::Stored(_, own) => *own = function,
        }
    }

    /// Draws the first transfer function over its volume's histogram, where that was asked for.
    pub(crate) fn show_transfer(&self, args: &TransferArgs) -> Result<()> {
        match self {
            Self::Memory(volumes) => volumes.show_transfer(args),
            Self::Stored(volume, function) => transfer::show(args, function, volume.as_ref()),
        }
    }

    /// A renderer.
    pub(crate) fn renderer(
        &self,
        options: &RenderOptions,
        progress: Progress,
    ) -> Result<Renderer, volsplat::Error> {
        match self {
            Self::Memory(volumes) => Renderer::with_scene(&volumes.scene(), options),
            Self::Stored(volume, function) => Renderer::from_file(
                volume,
                function,
                options,
                &mut watch("finding what is visible", progress),
            ),
        }
    }
}

/// Looks a volume through that does not fit the memory as a whole; `None` where it fits or nothing was said.
pub(crate) fn look_through(
    file: &InputFile,
    args: &VolumeArgs,
    max_memory: Option<u64>,
    options: &RenderOptions,
    progress: Progress,
) -> Result<Option<Box<LargeVolume>>> {
    let Some(max_memory) = max_memory else {
        return Ok(None);
    };
    let load_options = load_options(args, file)?;
    let path = file.path.as_path();
    let Some((lattice, voxel_type)) = peek(path, &load_options)? else {
        // What is packed is at least as large unpacked, as good as always.
        check_fits(
            path,
            std::fs::metadata(path).map_or(0, |data| data.len()),
            max_memory,
        )?;
        return Ok(None);
    };
    let voxels = lattice.len() as u64 * voxel_type.bytes() as u64;
    if voxels.saturating_add(most_brick_bytes(&lattice, options)) <= max_memory {
        return Ok(None);
    }
    let mut watch = watch("looking through the volume", progress);
    Ok(LargeVolume::open(path, &load_options, max_memory, &mut watch)?.map(Box::new))
}

fn is_single(args: &SceneArgs) -> bool {
    args.mask.is_none() && !args.labels && args.channel.is_empty() && args.also.is_empty()
}

fn check_fits(path: &Path, bytes: u64, max_memory: u64) -> Result<()> {
    if bytes <= max_memory {
        return Ok(());
    }
    let (needed, allowed) = (report::human_bytes(bytes), report::human_bytes(max_memory));
    bail!(
        "{}: the voxels take at least {needed} and cannot be read in parts, because the file is packed; --max-memory \
         allows {allowed}: unpack it to a raw file, or allow more",
        path.display()
    )
}
