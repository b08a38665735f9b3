//! Tiles of sheets in which kernels are summed.

mod ball;
mod close;
mod sums;
mod tile;

pub(crate) use sums::{KernelSample, KernelScratch, KernelSettings, Tile, TileRays};
pub(crate) use tile::render_tile;
