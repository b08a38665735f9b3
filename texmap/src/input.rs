//! Mesh files as scenes that can be drawn: read by `resample-mesh`, and refused where their pictures do not fit into memory.
//!
//! A renderer keeps each picture in linear light with all its coarser levels, once for every way in which materials use it,
//! beside the scene itself. That memory is asked for before it is allocated.

use std::path::Path;

use resample_io::Gate;
use resample_mesh::{Error, Scene, input};

pub use resample_mesh::input::*;

use crate::prepare::maps::{Pictures, VaryingMetals};
use crate::prepare::mip;

/// Reads a mesh file as [`resample_mesh::load`] does.
///
/// # Errors
///
/// Those of [`resample_mesh::load`], and one where the pictures with their levels take more memory than the gate allows.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, Error> {
    let loaded = input::load(path, options)?;
    checked(path, loaded, options)
}

/// A scene of memory, as if a file held it: texture and surroundings come from the options.
///
/// # Errors
///
/// As [`load`] has them; they name `name`.
pub fn of_memory(name: &Path, scene: Scene, options: &LoadOptions) -> Result<Loaded, Error> {
    let loaded = input::of_memory(name, scene, options)?;
    checked(name, loaded, options)
}

fn checked(path: &Path, loaded: Loaded, options: &LoadOptions) -> Result<Loaded, Error> {
    let asked = ask_for_memory(&loaded.scene, &options.gate);
    asked.map_err(|what| Error::Input(format!("{}: {what}", path.display())))?;
    Ok(loaded)
}

/// Asks for the memory of all pictures: as they are in the scene, and as they are drawn.
fn ask_for_memory(scene: &Scene, gate: &Gate) -> Result<(), String> {
    let held: u64 = scene.textures.iter().map(|texture| texture.bytes()).sum();
    let mut keys = Vec::new();
    let mut varying = VaryingMetals::default();
    let mut drawn = 0;
    let pictures = scene.materials.iter().flat_map(|material| {
        let Pictures {
            base,
            emissive,
            maps,
            ..
        } = Pictures::new(scene, material, &mut varying);
        [base, emissive].into_iter().chain(maps)
    });
    for (used, usage) in pictures.flatten() {
        let key = (used.texture, usage, used.wrap, used.magnify);
        if !keys.contains(&key) {
            keys.push(key);
            drawn += mip::bytes_of_levels(&scene.textures[used.texture], usage);
        }
    }
    gate.ask(held + drawn, "all textures with their levels")
}
