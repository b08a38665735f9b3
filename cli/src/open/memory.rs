//! Scenes of memory as the options of a command want them: the same checks and changes that a file's scene meets.

use anyhow::Result;
use texmap::{Loaded, Scene};
use volsplat::{Lattice, Volume, Voxels};

use crate::args::{TexmapArgs, VolsplatArgs};
use crate::open::mesh::settings::load_options;
use crate::open::volume::file;

/// Makes the volume that `args` ask for of voxels in memory; errors name the input of `args`.
pub fn volume(args: &VolsplatArgs, lattice: Lattice, voxels: Voxels) -> Result<Volume> {
    let gate = args.volume.reading.gate();
    let options = file::load_options(&args.volume, &args.input, &gate)?;
    let made = volsplat::input::of_memory(&args.input.path, lattice, voxels, &options);
    Ok(made?)
}

/// Makes the scene that `args` ask for of triangles in memory; errors name the input of `args`.
pub fn mesh(args: &TexmapArgs, scene: Scene) -> Result<Loaded> {
    let options = load_options(args, 0, &args.model.reading.gate());
    let made = texmap::input::of_memory(&args.input.path, scene, &options);
    Ok(made?)
}
