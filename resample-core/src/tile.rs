//! Screen tiles: which primitives touch which 16x16-pixel tile.
//!
//! A tile is owned by one task, so that accumulation needs no locks and the picture does not depend on the number of
//! threads. Primitives are made in chunks of the source; each chunk lists its own primitives by tile (a counting sort
//! over the rectangle of tiles that it touches), and a tile then gathers its slices chunk by chunk, in source order.

use crate::sort::entry;

/// Side of a tile, px: one row is one 512-bit vector, and the tile's state stays in the first-level cache.
pub const TILE_PX: usize = 16;

/// Pixels of a tile.
pub const TILE_AREA: usize = TILE_PX * TILE_PX;

/// Most primitives of one chunk: their index has 16 bits, beside 16 bits for the chunk.
pub const MAX_CHUNK_LEN: usize = 1 << 16;

/// A sample on the screen, as point or as splat. 48 bytes: what a tile needs to accumulate it, nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Primitive {
    /// Position of a point, or centre of a splat's form, px.
    pub x: f32,
    /// As `x`, along y.
    pub y: f32,
    /// Quadratic form of the offset from the centre: xx, twice xy, yy. Times the pixel's map it is q = (d/r)^2.
    pub form: [f32; 3],
    /// Squared sine of the half cone angle (used by the index correction).
    pub sin2_cone: f32,
    /// Splat: optical depth per grid unit of line integral. Point: optical depth summed over the screen, px^2.
    /// With linear opacity, opacity in place of optical depth.
    pub strength: f32,
    /// Linear colour, not premultiplied.
    pub rgb: [f32; 3],
    /// Pixel rows first..end that a splat touches; a point has [`POINT_ROWS`].
    pub rows: [u16; 2],
    /// Distance from the eye (perspective) or camera z (orthographic), world units: the order of compositing.
    pub depth: f32,
}

/// Marks a point: no splat touches an empty range of rows that starts past every picture.
pub const POINT_ROWS: [u16; 2] = [u16::MAX, 0];

/// The grid of tiles over a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// Picture width, px.
    pub width: usize,
    /// Picture height, px.
    pub height: usize,
    /// Height of a tile, px; it is [`TILE_PX`] wide.
    pub tile_height: usize,
}

/// A rectangle of tiles: columns and rows, end exclusive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileRect {
    /// First column.
    pub x0: u16,
    /// One past the last column.
    pub x1: u16,
    /// First row.
    pub y0: u16,
    /// One past the last row.
    pub y1: u16,
}

impl TileGrid {
    /// Square tiles over a picture of so many pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            tile_height: TILE_PX,
        }
    }

    /// Tiles in a row.
    pub fn columns(&self) -> usize {
        self.width.div_ceil(TILE_PX)
    }

    /// Rows of tiles.
    pub fn rows(&self) -> usize {
        self.height.div_ceil(self.tile_height)
    }

    /// The tiles that hold any of the pixels columns.0..columns.1 x rows.0..rows.1, which lie in the picture.
    pub fn rect(&self, columns: [u16; 2], rows: [u16; 2]) -> TileRect {
        if columns[0] >= columns[1] || rows[0] >= rows[1] {
            return TileRect::default();
        }
        let (width, height) = (TILE_PX as u16, self.tile_height as u16);
        TileRect {
            x0: columns[0] / width,
            x1: (columns[1] - 1) / width + 1,
            y0: rows[0] / height,
            y1: (rows[1] - 1) / height + 1,
        }
    }
}

impl TileRect {
    /// Tiles inside.
    pub fn area(&self) -> usize {
        usize::from(self.x1 - self.x0) * usize::from(self.y1 - self.y0)
    }

    /// The smallest rectangle that holds both; an empty one adds nothing.
    pub fn union(self, other: Self) -> Self {
        if other.area() == 0 {
            return self;
        }
        if self.area() == 0 {
            return other;
        }
        Self {
            x0: self.x0.min(other.x0),
            x1: self.x1.max(other.x1),
            y0: self.y0.min(other.y0),
            y1: self.y1.max(other.y1),
        }
    }

    fn slot(&self, x: u16, y: u16) -> Option<usize> {
        let inside = (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y);
        inside.then(|| {
            usize::from(y - self.y0) * usize::from(self.x1 - self.x0) + usize::from(x - self.x0)
        })
    }
}

/// The primitives of one chunk, of whatever kind, and their lists by tile. Buffers are kept from frame to frame.
#[derive(Clone, Debug)]
pub struct ChunkBins<P> {
    /// The primitives, in source order.
    pub primitives: Vec<P>,
    keys: Vec<u32>,
    rects: Vec<TileRect>,
    bounds: TileRect,
    starts: Vec<u32>,
    entries: Vec<u64>,
}

impl<P> Default for ChunkBins<P> {
    fn default() -> Self {
        Self {
            primitives: Vec::new(),
            keys: Vec::new(),
            rects: Vec::new(),
            bounds: TileRect::default(),
            starts: Vec::new(),
            entries: Vec::new(),
        }
    }
}

impl<P> ChunkBins<P> {
    /// Forgets the last frame.
    pub fn clear(&mut self) {
        self.primitives.clear();
        self.keys.clear();
        self.rects.clear();
        self.entries.clear();
        self.bounds = TileRect::default();
    }

    /// Adds a primitive that touches the tiles of `rect` and is sorted by `key`, least first.
    pub fn push(&mut self, primitive: P, key: u32, rect: TileRect) {
        assert!(
            self.primitives.len() < MAX_CHUNK_LEN,
            "the index of a primitive has 16 bits"
        );
        self.primitives.push(primitive);
        self.keys.push(key);
        self.rects.push(rect);
        self.bounds = self.bounds.union(rect);
    }

    /// Lists the primitives by tile. `chunk` is this chunk's number, below 65536.
    pub fn bin(&mut self, chunk: usize) {
        self.starts.clear();
        self.starts.resize(self.bounds.area() + 1, 0);
        for rect in &self.rects {
            for_each_tile(rect, |x, y| {
                if let Some(slot) = self.bounds.slot(x, y) {
                    self.starts[slot + 1] += 1;
                }
            });
        }
        for slot in 1..self.starts.len() {
            self.starts[slot] += self.starts[slot - 1];
        }
        let total = self.starts.last().map_or(0, |&n| n as usize);
        self.entries.resize(total, 0);
        for (local, (&key, rect)) in self.keys.iter().zip(&self.rects).enumerate() {
            let packed = entry(key, (chunk << 16 | local) as u32);
            for_each_tile(rect, |x, y| {
                if let Some(slot) = self.bounds.slot(x, y) {
                    self.entries[self.starts[slot] as usize] = packed;
                    self.starts[slot] += 1;
                }
            });
        }
        // Each start has moved to its list's end: shift them back by one place.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// The list of tile (x, y) of this chunk, in source order.
    pub fn tile(&self, x: u16, y: u16) -> &[u64] {
        match self.bounds.slot(x, y) {
            Some(slot) => &self.entries[self.starts[slot] as usize..self.starts[slot + 1] as usize],
            None => &[],
        }
    }

    /// Number of primitives times the tiles that each touches.
    pub fn pairs(&self) -> usize {
        self.entries.len()
    }
}

/// Items by tile, where one task can list them all: few large items, such as bricks.
#[derive(Clone, Debug, Default)]
pub struct TileLists {
    columns: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl TileLists {
    /// Lists the items 0.. by the tiles that their rectangles touch; each tile keeps the order of the items.
    pub fn new(grid: &TileGrid, rects: &[TileRect]) -> Self {
        let columns = grid.columns();
        let slot = |x: u16, y: u16| usize::from(y) * columns + usize::from(x);
        let mut starts = vec![0u32; columns * grid.rows() + 1];
        for rect in rects {
            for_each_tile(rect, |x, y| starts[slot(x, y) + 1] += 1);
        }
        for tile in 1..starts.len() {
            starts[tile] += starts[tile - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts.last().map_or(0, |&n| n as usize)];
        for (item, rect) in rects.iter().enumerate() {
            for_each_tile(rect, |x, y| {
                let place = &mut next[slot(x, y)];
                items[*place as usize] = item as u32;
                *place += 1;
            });
        }
        Self {
            columns,
            starts,
            items,
        }
    }

    /// The items of tile (x, y).
    pub fn tile(&self, x: usize, y: usize) -> &[u32] {
        let tile = y * self.columns + x;
        &self.items[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }
}

fn for_each_tile(rect: &TileRect, mut visit: impl FnMut(u16, u16)) {
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            visit(x, y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sort::entry_index;

    #[test]
    fn rect_holds_exactly_the_tiles_of_its_pixels() {
        let grid = TileGrid::new(100, 40);
        assert_eq!((grid.columns(), grid.rows()), (7, 3));
        assert_eq!(
            grid.rect([15, 17], [0, 16]),
            TileRect {
                x0: 0,
                x1: 2,
                y0: 0,
                y1: 1
            }
        );
        assert_eq!(
            grid.rect([16, 32], [32, 33]),
            TileRect {
                x0: 1,
                x1: 2,
                y0: 2,
                y1: 3
            }
        );
        assert_eq!(grid.rect([5, 5], [0, 40]).area(), 0);
    }

    #[test]
    fn every_primitive_is_listed_in_each_of_its_tiles_once_and_in_order() {
        let grid = TileGrid::new(160, 160);
        let mut bins: ChunkBins<u16> = ChunkBins::default();
        for frame in 0..2 {
            bins.clear();
            let mut rects = Vec::new();
            for i in 0..500u16 {
                let (x, y) = (i * 7 % 150, i * 13 % 140);
                let rect = grid.rect(
                    [x, (x + i % 40).min(160)],
                    [y, (y + i % 23 + frame).min(160)],
                );
                bins.push(i, u32::from(i), rect);
                rects.push(rect);
            }
            bins.bin(3);
            for y in 0..10 {
                for x in 0..10 {
                    let listed: Vec<u32> =
                        bins.tile(x, y).iter().map(|&e| entry_index(e)).collect();
                    let expected: Vec<u32> = (0..500)
                        .filter(|&i| rects[i as usize].slot(x, y).is_some())
                        .map(|i| 3 << 16 | i)
                        .collect();
                    assert_eq!(listed, expected, "tile ({x}, {y}) of frame {frame}");
                }
            }
            assert_eq!(
                bins.pairs(),
                rects.iter().map(TileRect::area).sum::<usize>()
            );
        }
    }

    #[test]
    fn lists_keep_every_item_in_each_of_its_tiles_in_order() {
        let grid = TileGrid::new(70, 50);
        let rects: Vec<TileRect> = (0..60u16)
            .map(|i| grid.rect([i, (2 * i + 3).min(70)], [i % 40, i % 40 + 9]))
            .collect();
        let lists = TileLists::new(&grid, &rects);
        for y in 0..grid.rows() {
            for x in 0..grid.columns() {
                let expected: Vec<u32> = (0..60)
                    .filter(|&i| rects[i as usize].slot(x as u16, y as u16).is_some())
                    .collect();
                assert_eq!(lists.tile(x, y), expected, "tile ({x}, {y})");
            }
        }
    }
}
