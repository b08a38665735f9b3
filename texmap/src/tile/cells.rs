//! The surfaces in each pixel: none, one triangle, or several.

use crate::screen::padded_tile::{NONE, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH, WINDOW_PX};
use crate::tile::visible::Visible;

/// The surfaces in the sub-pixels of a pixel, or of all pixels that a filter reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    Empty,
    /// One triangle, by its place in the tile's list.
    Plane(u32),
    /// Several opaque things.
    Mixed,
    /// Something translucent.
    Layered,
}

/// The cells of a tile.
#[derive(Default)]
pub(crate) struct Cells {
    /// By pixel of the span: of its own sub-pixels. Empty where one triangle is all that the tile shows.
    pub(crate) own: Vec<Cell>,
    along: Vec<Cell>,
    /// By pixel of the tile: of all pixels that its filter reaches.
    pub(crate) under_filter: Vec<Cell>,
}

/// Finds the cells of a tile from what its sub-pixels show.
pub(crate) fn find_cells<'a>(
    per_pixel: usize,
    visible: &Visible,
    cells: &'a mut Cells,
) -> &'a Cells {
    cells.own.clear();
    cells.under_filter.clear();
    if let Some(id) = visible.subpixels.alone {
        cells
            .under_filter
            .resize(TILE_WIDTH * TILE_HEIGHT, Cell::Plane(id));
        return cells;
    }
    let rows = visible.subpixels.ids.chunks_exact(per_pixel * SPAN_WIDTH);
    // The rows of a pixel but the first one are compared with those above.
    for (y, rows) in rows.enumerate() {
        let below = &visible.changes[y * per_pixel..][..per_pixel - 1];
        let changed = below.iter().fold(0, |all, bits| all | bits);
        cells
            .own
            .extend((0..SPAN_WIDTH).map(|column| match rows[column] {
                _ if changed >> column & 1 == 1 => Cell::Mixed,
                NONE => Cell::Empty,
                id => Cell::Plane(id),
            }));
    }
    for layer in &visible.subpixels.layers {
        let (column, row) = (
            layer.subpixel as usize % SPAN_WIDTH,
            layer.subpixel as usize / SPAN_WIDTH,
        );
        cells.own[row / per_pixel * SPAN_WIDTH + column] = Cell::Layered;
    }
    join_cells(cells);
    cells
}

/// Joins the cells of the tile's span to the cells that the filter of each pixel reaches.
fn join_cells(cells: &mut Cells) {
    let Cells {
        own,
        along,
        under_filter,
    } = cells;
    if own.iter().all(|&cell| cell == own[0]) {
        return under_filter.resize(TILE_WIDTH * TILE_HEIGHT, own[0]);
    }
    along.clear();
    for row in own.chunks_exact(SPAN_WIDTH) {
        along.extend(
            row.windows(WINDOW_PX)
                .map(|window| window[1..].iter().fold(window[0], joined)),
        );
    }
    let below = |first: usize| (1..WINDOW_PX).map(move |k| first + k * TILE_WIDTH);
    under_filter.extend(
        (0..TILE_WIDTH * TILE_HEIGHT)
            .map(|at| below(at).fold(along[at], |cell, k| joined(cell, &along[k]))),
    );
}

/// Joins two neighbouring cells.
fn joined(a: Cell, b: &Cell) -> Cell {
    match (a, *b) {
        (a, b) if a == b => a,
        (Cell::Layered, _) | (_, Cell::Layered) => Cell::Layered,
        _ => Cell::Mixed,
    }
}
