//! One tile of the picture, from its list of triangles to its pixels.
//!
//! The stages are those of the frame: visibility; accumulate (points where the texture is minified on one plane, splats
//! at sub-pixels elsewhere; look-ups in backward methods); resolve. In the order of use: `tile_mesh` and `alpha_cut` serve
//! visibility; `cells` and `texels` read textures, `pixel_light` and `batch_light` light them; `accumulate` decides between
//! points, `patches` and `splats`; `planes` makes depth, normals and the other planes.

pub(crate) mod tile_mesh;
pub(crate) mod alpha_cut;
pub(crate) mod cells;
pub(crate) mod texels;
pub(crate) mod pixel_light;
pub(crate) mod batch_light;
pub(crate) mod accumulate;
pub(crate) mod splats;
pub(crate) mod patches;
pub(crate) mod planes;

use glam::Vec4;
use resample_core::Camera;
use resample_core::clock::ThreadClock;
use resample_core::simd::Vectors;
use resample_mesh::scene::AlphaMode;

use crate::options::{Method, RenderOptions};
use crate::prepare::Prepared;
use crate::project::cull::{InView, ScreenTriangle, SeenTriangle};
use crate::project::patch::Patches;
use crate::project::surface::{Surface, TileView};
use crate::screen::padded_tile::{BORDER_PX, NONE, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH, WINDOW_PX};
use crate::screen::plane::{Plane, moved, narrow};
use crate::visibility::by_triangle::ByTriangle;
use crate::visibility::changes::{changes, each_bit};
use crate::visibility::edges::Edges;
use crate::visibility::filter::PixelFilter;
use crate::visibility::fragments::{Fragment, Fragments};
use crate::visibility::layers::Layers;
use crate::visibility::{CutOut, NearKey, RasterTriangle, Visibility};

/// Values shared by all tiles of a frame.
pub(crate) struct FrameView<'a> {
    pub(crate) scene: &'a Prepared,
    pub(crate) camera: &'a Camera,
    pub(crate) options: &'a RenderOptions,
    pub(crate) in_view: &'a InView,
    pub(crate) filter: &'a PixelFilter,
    pub(crate) near: NearKey,
    pub(crate) simd: Vectors,
}

/// The result of a tile and its cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileImage {
    /// Linear premultiplied colour, rows from the top; empty where the tile shows nothing.
    pub(crate) rgba: Vec<[f32; 4]>,
    /// The channels of the planes beside colour, one after another; empty where no plane is requested.
    pub(crate) planes: Vec<f32>,
    /// Triangles that some sub-pixel shows.
    pub(crate) drawn: Vec<u32>,
    pub(crate) points: u64,
    pub(crate) splats: u64,
    pub(crate) visibility_ms: f64,
    pub(crate) accumulate_ms: f64,
    pub(crate) resolve_ms: f64,
}

/// Storage of one task, reused from tile to tile.
#[derive(Default)]
pub(crate) struct TileWork {
    pub(crate) visibility: Visibility,
    /// By place in the tile's list.
    pub(crate) surfaces: Vec<Option<Box<Surface>>>,
    /// Linear premultiplied colours of sub-pixels.
    pub(crate) colours: Vec<[f32; 4]>,
    pub(crate) by_triangle: ByTriangle,
    pub(crate) layers: Layers,
    /// By row of sub-pixels, from the second on: where it differs from the one above.
    changes: Vec<u32>,
    /// By pixel of the span: what its sub-pixels show.
    pub(crate) cells: Vec<Cell>,
    cells_along: Vec<Cell>,
    /// By pixel of the tile: what its filter sees.
    pub(crate) seen: Vec<Cell>,
    /// By pixel of the span: whether its sub-pixels' colours are needed.
    pub(crate) wanted: Vec<bool>,
    /// Pixels of the tile that are made from sub-pixels.
    pub(crate) from_subpixels: Vec<u16>,
    pub(crate) fragments: Vec<Fragment>,
    pub(crate) by_row: Fragments,
    /// By place in the tile's list: opaque and cut-out triangles.
    pub(crate) rasters: Vec<Option<RasterTriangle>>,
    pub(crate) edges: Edges,
    pub(crate) patches: Patches,
    /// By edge: the difference in colour across it.
    pub(crate) jumps: Vec<Vec4>,
}

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

/// Draws one tile.
pub(crate) fn render_tile(
    frame: &FrameView,
    at: [usize; 2],
    list: &[u32],
    work: &mut TileWork,
) -> TileImage {
    let mut image = TileImage::default();
    if list.is_empty() {
        return image;
    }
    let corner_px =
        [at[0] * TILE_WIDTH, at[1] * TILE_HEIGHT].map(|px| px as f64 - BORDER_PX as f64);
    let view = TileView::new(frame.scene, frame.camera, corner_px, frame.options.light);
    let tile = Tile { frame, view, list };

    let start = ThreadClock::start();
    tile.find_visible(work);
    if !tile.note_drawn(work, &mut image) {
        image.visibility_ms = start.elapsed_ms();
        return image;
    }
    tile.find_cells(work);
    tile.find_edges(work);
    image.visibility_ms = start.elapsed_ms();

    let start = ThreadClock::start();
    image.rgba = vec![[0.0; 4]; TILE_WIDTH * TILE_HEIGHT];
    match frame.options.method {
        Method::Hybrid => {
            tile.find_patches(work);
            tile.lay_points(work, &mut image);
        }
        _ => tile.look_up(work, &mut image),
    }
    tile.lay_splats(work, &mut image);
    image.accumulate_ms = start.elapsed_ms();

    let start = ThreadClock::start();
    tile.resolve(work, &mut image);
    if !frame.options.planes.is_empty() {
        tile.fill_planes(work, &mut image);
    }
    image.resolve_ms = start.elapsed_ms();
    image
}

/// One tile of a frame and the triangles that touch it.
pub(crate) struct Tile<'a> {
    pub(crate) frame: &'a FrameView<'a>,
    pub(crate) view: TileView<'a>,
    pub(crate) list: &'a [u32],
}

impl Tile<'_> {
    fn triangle(&self, id: u32) -> ScreenTriangle {
        let FrameView {
            scene,
            camera,
            in_view,
            ..
        } = self.frame;
        in_view.triangle(scene, camera.projection, self.list[id as usize])
    }

    pub(crate) fn seen(&self, id: u32) -> &SeenTriangle {
        &self.frame.in_view.triangles[self.list[id as usize] as usize]
    }

    /// The depth key over the tile.
    pub(crate) fn key_plane(&self, id: u32) -> Plane {
        narrow(moved(self.triangle(id).key, self.view.corner_px))
    }

    fn alpha_mode(&self, id: u32) -> AlphaMode {
        let mesh = &self.frame.scene.meshes[self.seen(id).mesh as usize];
        self.frame.scene.materials[mesh.material].alpha
    }

    fn find_visible(&self, work: &mut TileWork) {
        let FrameView { filter, near, .. } = *self.frame;
        let TileWork {
            visibility,
            surfaces,
            rasters,
            ..
        } = work;
        visibility.clear(filter);
        rasters.clear();
        surfaces.clear();
        surfaces.resize(self.list.len(), None);
        let mut translucent = Vec::new();
        for id in 0..self.list.len() as u32 {
            let raster = RasterTriangle::new(&self.triangle(id), self.view.corner_px, filter);
            let is_translucent = self.alpha_mode(id) == AlphaMode::Blend;
            let (opaque, behind) = raster.map_or((None, None), |raster| {
                if is_translucent {
                    (None, Some((id, raster)))
                } else {
                    (Some(raster), None)
                }
            });
            translucent.extend(behind);
            rasters.push(opaque);
        }
        if let Some(id) = self.alone(rasters).filter(|_| translucent.is_empty()) {
            return visibility.show_alone(id);
        }
        for (id, triangle) in (0..).zip(rasters.iter()) {
            let Some(triangle) = triangle else { continue };
            match self.alpha_mode(id) {
                AlphaMode::Mask { cutoff } => {
                    let cut = CutOut {
                        triangle,
                        id,
                        cutoff,
                    };
                    self.draw_cut(cut, visibility, &mut surfaces[id as usize]);
                }
                _ => visibility.draw(triangle, id, (filter, near), self.frame.simd),
            }
        }
        for (id, triangle) in &translucent {
            visibility.list(triangle, *id, (filter, near), self.frame.simd);
        }
        visibility.sort_layers();
    }

    /// The opaque triangle that is all that the tile shows, if there is one.
    fn alone(&self, rasters: &[Option<RasterTriangle>]) -> Option<u32> {
        let mut drawn = (0..)
            .zip(rasters)
            .filter_map(|(id, raster)| Some((id, raster.as_ref()?)));
        let (id, triangle) = drawn.next().filter(|_| drawn.next().is_none())?;
        let covers =
            self.alpha_mode(id) == AlphaMode::Opaque && triangle.covers_tile(self.frame.near);
        covers.then_some(id)
    }

    pub(crate) fn surface(&self, id: u32, seen_px: [f32; 2]) -> Box<Surface> {
        Box::new(Surface::new(&self.view, &self.triangle(id), seen_px))
    }

    /// Prepares the surfaces that are seen and lists their triangles; whether there are any.
    fn note_drawn(&self, work: &mut TileWork, image: &mut TileImage) -> bool {
        let filter = self.frame.filter;
        if let Some(id) = work.visibility.alone {
            work.surfaces[id as usize] = Some(self.surface(id, subpixel_px(filter, 0)));
            image.drawn.push(self.list[id as usize]);
            return true;
        }
        let mut seen = vec![false; self.list.len()];
        let mut note = |at: usize, id: u32| {
            if id != NONE && !std::mem::replace(&mut seen[id as usize], true) {
                let surface = &mut work.surfaces[id as usize];
                surface.get_or_insert_with(|| self.surface(id, subpixel_px(filter, at)));
                image.drawn.push(self.list[id as usize]);
            }
        };
        let ids = &work.visibility.ids;
        changes(self.frame.simd, ids, &filter.above, &mut work.changes);
        (0..SPAN_WIDTH).for_each(|at| note(at, ids[at]));
        for (pair, &bits) in filter.above.iter().zip(&work.changes) {
            each_bit(bits).for_each(|k| note(pair.here + k, ids[pair.here + k]));
        }
        work.visibility
            .layers
            .iter()
            .for_each(|layer| note(layer.subpixel as usize, layer.id));
        !image.drawn.is_empty()
    }

    fn find_cells(&self, work: &mut TileWork) {
        let per_pixel = self.frame.filter.per_pixel;
        if let Some(id) = work.visibility.alone {
            work.seen.clear();
            return work.seen.resize(TILE_WIDTH * TILE_HEIGHT, Cell::Plane(id));
        }
        work.cells.clear();
        let rows = work.visibility.ids.chunks_exact(per_pixel * SPAN_WIDTH);
        // The rows of a pixel but the first one are compared with those above.
        for (y, rows) in rows.enumerate() {
            let below = &work.changes[y * per_pixel..][..per_pixel - 1];
            let changed = below.iter().fold(0, |all, bits| all | bits);
            work.cells
                .extend((0..SPAN_WIDTH).map(|column| match rows[column] {
                    _ if changed >> column & 1 == 1 => Cell::Mixed,
                    NONE => Cell::Empty,
                    id => Cell::Plane(id),
                }));
        }
        for layer in &work.visibility.layers {
            let (column, row) = (
                layer.subpixel as usize % SPAN_WIDTH,
                layer.subpixel as usize / SPAN_WIDTH,
            );
            work.cells[row / per_pixel * SPAN_WIDTH + column] = Cell::Layered;
        }
        seen(&work.cells, &mut work.cells_along, &mut work.seen);
    }
}

/// Joins the cells of the tile's span to the cells that the filter of each pixel reaches.
fn seen(cells: &[Cell], along: &mut Vec<Cell>, out: &mut Vec<Cell>) {
    out.clear();
    if cells.iter().all(|&cell| cell == cells[0]) {
        return out.resize(TILE_WIDTH * TILE_HEIGHT, cells[0]);
    }
    along.clear();
    for row in cells.chunks_exact(SPAN_WIDTH) {
        along.extend(
            row.windows(WINDOW_PX)
                .map(|window| window[1..].iter().fold(window[0], joined)),
        );
    }
    let below = |first: usize| (1..WINDOW_PX).map(move |k| first + k * TILE_WIDTH);
    out.extend(
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

/// Position of a sub-pixel by its place in the tile.
#[inline(always)]
pub(crate) fn subpixel_px(filter: &PixelFilter, at: usize) -> [f32; 2] {
    filter.position_px(at % SPAN_WIDTH, at / SPAN_WIDTH)
}

/// Largest key that the near plane lets through.
pub(crate) fn near_key(camera: &Camera) -> NearKey {
    let key = match camera.projection {
        resample_core::Projection::Perspective => 1.0 / camera.near,
        resample_core::Projection::Orthographic => -camera.near,
    };
    NearKey(key as f32)
}
