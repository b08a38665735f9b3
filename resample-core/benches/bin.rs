//! How long it takes to list a chunk's primitives by the screen tiles that they touch.
//!
//! Items are primitives. A full chunk of 16384 lies in a 128 x 128 px part of the picture, as the voxels of a few
//! neighbouring bricks do; the argument is the side of a footprint, px (4 is a point).

mod inputs;

use divan::Bencher;
use divan::counter::ItemsCount;
use resample_core::sort::depth_key;
use resample_core::tile::{ChunkBins, Primitive, TileGrid};

/// Primitives of the chunk.
const COUNT: usize = 1 << 14;

fn main() {
    inputs::measure();
}

#[divan::bench(args = [4, 16, 64])]
fn chunk(bencher: Bencher, side_px: u16) {
    let grid = TileGrid::new(400, 400);
    let mut bins = ChunkBins::default();
    for pair in inputs::spread(2 * COUNT, 100.0, 228.0).chunks(2) {
        let [x, y] = [pair[0] as u16, pair[1] as u16];
        let primitive = Primitive {
            depth: pair[0] as f32,
            ..Primitive::default()
        };
        bins.push(
            primitive,
            depth_key(primitive.depth),
            grid.rect([x, x + side_px], [y, y + side_px]),
        );
    }
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| bins.bin(3));
}
