//! One tile of the picture, from its list of triangles to its pixels.
//!
//! Every stage is a function from the outputs of earlier stages to its own, whose storage it refills; [`draw_tile`] calls them in
//! order. Inputs of all stages are in `task`. Visibility: `visible`. Accumulate: `patches`, `points` for pixels on one minified plane,
//! `splats` at sub-pixels elsewhere; `texels` reads textures at sub-pixels, `light` lights both. Resolve: `splats`, and `planes` for
//! depth, normals and the others.

pub(crate) mod task;
pub(crate) mod visible;
pub(crate) mod patches;
pub(crate) mod texels;
pub(crate) mod light;
pub(crate) mod points;
pub(crate) mod splats;
pub(crate) mod planes;

use resample_core::clock::ThreadClock;

use crate::project::surface::TileView;
use crate::screen::{BORDER_PX, TILE_HEIGHT, TILE_WIDTH};
use crate::tile::patches::{Patches, find_patches};
use crate::tile::planes::{PlaneBuffers, planes};
use crate::tile::points::{DirectPixels, PixelLookUps, lay_points};
use crate::tile::splats::{SubpixelColours, lay_splats, resolve};
use crate::tile::task::{FrameView, Tile, TileImage};
use crate::tile::visible::{Cells, Visible, find_cells, find_edges, find_visible};
use crate::visibility::edges::Edges;

/// The outputs of the stages, whose storage one task refills tile after tile.
#[derive(Default)]
pub(crate) struct StageBuffers {
    visible: Visible,
    cells: Cells,
    edges: Edges,
    patches: Patches,
    direct: DirectPixels,
    subpixels: SubpixelColours,
    planes: PlaneBuffers,
}

/// Draws one tile; `look_ups` take the place of points, if there are any.
pub(crate) fn draw_tile(
    frame: &FrameView,
    look_ups: Option<PixelLookUps>,
    (at, list): ([usize; 2], &[u32]),
    buffers: &mut StageBuffers,
) -> TileImage {
    let mut image = TileImage::default();
    if list.is_empty() {
        return image;
    }
    let corner_px =
        [at[0] * TILE_WIDTH, at[1] * TILE_HEIGHT].map(|px| px as f64 - BORDER_PX as f64);
    let view = TileView::new(
        (frame.scene, frame.blocked),
        frame.camera,
        corner_px,
        frame.options.light,
    );
    let tile = &Tile { frame, view, list };

    let start = ThreadClock::start();
    let visible = find_visible(tile, &mut buffers.visible);
    if visible.drawn.is_empty() {
        image.visibility_ms = start.elapsed_ms();
        return image;
    }
    image.drawn.extend(&visible.drawn);
    let cells = find_cells(frame.filter.per_pixel, visible, &mut buffers.cells);
    let edges = find_edges(tile, visible, &mut buffers.edges);
    image.visibility_ms = start.elapsed_ms();

    let start = ThreadClock::start();
    let direct = match look_ups {
        None => {
            let patches = find_patches(tile, (visible, cells, edges), &mut buffers.patches);
            lay_points(tile, (visible, cells, patches), &mut buffers.direct)
        }
        Some(look_up) => look_up(tile, (visible, cells, edges), &mut buffers.direct),
    };
    let subpixels = lay_splats(tile, (visible, edges, direct), &mut buffers.subpixels);
    image.points = direct.laid.points;
    image.splats = direct.laid.splats + direct.looked_up + subpixels.splats;
    image.accumulate_ms = start.elapsed_ms();

    let start = ThreadClock::start();
    image.rgba = resolve(tile, direct, subpixels);
    if !frame.options.planes.is_empty() {
        let seen = (visible, cells, edges, direct);
        image.planes = planes(tile, seen, &mut buffers.planes);
    }
    image.resolve_ms = start.elapsed_ms();
    image
}
