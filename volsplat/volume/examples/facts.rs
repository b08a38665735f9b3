//! Prints the facts of a volume file: `cargo run -p resample-volume --example facts -- head.nrrd`.

use std::path::Path;

use resample_volume::{Described, LoadOptions, load};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected a volume file")?;
    let volume = load(Path::new(&path), &LoadOptions::default())?;
    let lattice = volume.lattice();
    let [x, y, z] = lattice.dims;
    let (low, high) = volume.value_range();
    println!("{x} x {y} x {z} voxels, {:?}", volume.voxel_type());
    println!("values from {low} to {high}");
    println!("world from index: {:?}", lattice.world_from_index);
    Ok(())
}
