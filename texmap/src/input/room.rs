//! The memory that the pictures of a scene take when they are drawn, asked for before it is taken.
//!
//! A renderer keeps each picture in linear light with all its coarser levels, once for every way in which materials use it, beside the
//! scene itself.

use resample_io::Gate;

use crate::mip;
use crate::scene::Scene;
use crate::usage::{Pictures, Varying};

/// Asks for the memory of all pictures: as they are in the scene, and as they are drawn.
pub(super) fn ask(scene: &Scene, gate: &Gate) -> Result<(), String> {
    let held: u64 = scene.textures.iter().map(|texture| texture.bytes()).sum();
    let mut keys = Vec::new();
    let mut varying = Varying::default();
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
