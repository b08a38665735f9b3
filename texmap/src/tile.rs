//! One tile of the picture, from its list of triangles to its pixels.
//!
//! The stages are those of the frame: visibility, select (points where the texture is minified on one plane, splats
//! at sub-pixels elsewhere), accumulate, resolve.

use cpu_time::ThreadTime;
use resample_core::{Camera, FootprintMode};

use crate::cull::{InView, ScreenTriangle};
use crate::filter::{BORDER_PX, PixelFilter};
use crate::lookup::small_footprint;
use crate::options::RenderOptions;
use crate::points::{PointFootprint, PointSettings};
use crate::prepare::Prepared;
use crate::scene::AlphaMode;
use crate::stats::elapsed_ms;
use crate::surface::{Surface, TileView, UvPlanes};
use crate::visibility::{NONE, NearKey, RasterTriangle, SPAN_PX, TILE_PX, Visibility};

/// What all tiles of a frame share.
pub(crate) struct FrameView<'a> {
    pub(crate) scene: &'a Prepared,
    pub(crate) camera: &'a Camera,
    pub(crate) options: &'a RenderOptions,
    pub(crate) in_view: &'a InView,
    pub(crate) filter: &'a PixelFilter,
    pub(crate) near: NearKey,
}

/// What a tile shows and what it cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileImage {
    /// Linear premultiplied colour, rows from the top; empty where the tile shows nothing.
    pub(crate) rgba: Vec<[f32; 4]>,
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
    visibility: Visibility,
    /// By place in the tile's list.
    surfaces: Vec<Option<Box<Surface>>>,
    /// Colours of sub-pixels.
    colours: Vec<[f32; 4]>,
    /// By pixel of the span: what its sub-pixels show.
    cells: Vec<Cell>,
    wanted: Vec<bool>,
}

/// What the sub-pixels of one pixel show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cell {
    Empty,
    /// One plane, of which this is a triangle's place in the tile's list and the plane's own number.
    Plane(u32, u64),
    Mixed,
}

/// Draws one tile.
pub(crate) fn render_tile(frame: &FrameView, at: [usize; 2], list: &[u32], work: &mut TileWork) -> TileImage {
    let mut image = TileImage::default();
    if list.is_empty() {
        return image;
    }
    let corner_px = at.map(|tile| (tile * TILE_PX) as f64 - BORDER_PX as f64);
    let view = TileView::new(frame.scene, frame.camera, corner_px, frame.options.light);
    let tile = Tile { frame, view, list };

    let start = ThreadTime::try_now().ok();
    tile.find_visible(work);
    if !tile.note_drawn(work, &mut image) {
        image.visibility_ms = elapsed_ms(start);
        return image;
    }
    tile.find_cells(work);
    image.visibility_ms = elapsed_ms(start);

    let start = ThreadTime::try_now().ok();
    image.rgba = vec![[0.0; 4]; TILE_PX * TILE_PX];
    let pixels = tile.lay_points(work, &mut image);
    tile.lay_splats(work, &mut image);
    image.accumulate_ms = elapsed_ms(start);

    let start = ThreadTime::try_now().ok();
    tile.resolve(&pixels, work, &mut image);
    image.resolve_ms = elapsed_ms(start);
    image
}

struct Tile<'a> {
    frame: &'a FrameView<'a>,
    view: TileView<'a>,
    list: &'a [u32],
}

impl Tile<'_> {
    fn triangle(&self, id: u32) -> &ScreenTriangle {
        &self.frame.in_view.triangles[self.list[id as usize] as usize]
    }

    fn alpha_mode(&self, id: u32) -> AlphaMode {
        let mesh = &self.frame.scene.meshes[self.triangle(id).mesh as usize];
        self.frame.scene.materials[mesh.material].alpha
    }

    fn find_visible(&self, work: &mut TileWork) {
        let FrameView { filter, near, .. } = *self.frame;
        let TileWork { visibility, surfaces, .. } = work;
        visibility.clear(filter);
        surfaces.clear();
        surfaces.resize(self.list.len(), None);
        let raster = |id: u32| RasterTriangle::new(self.triangle(id), self.view.corner_px, filter);
        let ids = 0..self.list.len() as u32;
        for id in ids.clone() {
            let mode = self.alpha_mode(id);
            if mode == AlphaMode::Blend {
                continue;
            }
            let Some(triangle) = raster(id) else { continue };
            match mode {
                AlphaMode::Mask { cutoff } => {
                    let slot = &mut surfaces[id as usize];
                    visibility.draw(&triangle, id, (filter, near), |at| {
                        let at = subpixel_px(filter, at);
                        let surface = slot.get_or_insert_with(|| self.surface(id, at));
                        self.base_colour(surface, at)[3] >= cutoff
                    });
                }
                _ => visibility.draw(&triangle, id, (filter, near), |_| true),
            }
        }
        for id in ids.filter(|&id| self.alpha_mode(id) == AlphaMode::Blend) {
            if let Some(triangle) = raster(id) {
                visibility.list(&triangle, id, filter, near);
            }
        }
        visibility.sort_layers();
    }

    fn surface(&self, id: u32, seen_px: [f32; 2]) -> Box<Surface> {
        Box::new(Surface::new(&self.view, self.triangle(id), seen_px))
    }

    /// Prepares the surfaces that are seen and lists their triangles; whether there are any.
    fn note_drawn(&self, work: &mut TileWork, image: &mut TileImage) -> bool {
        let filter = self.frame.filter;
        let mut seen = vec![false; self.list.len()];
        let opaque = work.visibility.ids.iter().enumerate().map(|(at, &id)| (at, id));
        let layers = work.visibility.layers.iter().map(|l| (l.subpixel as usize, l.id));
        let mut last = NONE;
        for (at, id) in opaque.chain(layers) {
            if id == NONE || id == last {
                continue;
            }
            last = id;
            if !std::mem::replace(&mut seen[id as usize], true) {
                let surface = &mut work.surfaces[id as usize];
                surface.get_or_insert_with(|| self.surface(id, subpixel_px(filter, at)));
                image.drawn.push(self.list[id as usize]);
            }
        }
        !image.drawn.is_empty()
    }

    fn plane_number(&self, id: u32) -> u64 {
        let triangle = self.triangle(id);
        let mesh = &self.frame.scene.meshes[triangle.mesh as usize];
        u64::from(triangle.mesh) << 32 | u64::from(mesh.plane_of[triangle.triangle as usize])
    }

    fn find_cells(&self, work: &mut TileWork) {
        let n = self.frame.filter.subpixels;
        let side = work.visibility.side;
        work.cells.clear();
        for row in 0..SPAN_PX {
            for column in 0..SPAN_PX {
                let mut cell = None;
                let mut last = None;
                for j in 0..n {
                    let start = (row * n + j) * side + column * n;
                    for &id in &work.visibility.ids[start..start + n] {
                        if last == Some(id) {
                            continue;
                        }
                        last = Some(id);
                        let here =
                            if id == NONE { Cell::Empty } else { Cell::Plane(id, self.plane_number(id)) };
                        cell = Some(match cell {
                            None => here,
                            Some(before) => joined(before, here),
                        });
                    }
                }
                work.cells.push(cell.unwrap_or(Cell::Empty));
            }
        }
        for layer in &work.visibility.layers {
            let (column, row) = (layer.subpixel as usize % side, layer.subpixel as usize / side);
            work.cells[row / n * SPAN_PX + column / n] = Cell::Mixed;
        }
    }

    /// Gathers points at every pixel that sees one minified plane. Gives what is left for splats: 3x3 cells each.
    fn lay_points(&self, work: &mut TileWork, image: &mut TileImage) -> Vec<usize> {
        let mut left = Vec::new();
        work.wanted.clear();
        work.wanted.resize(SPAN_PX * SPAN_PX, false);
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let around = |k: usize| (y + k / 3) * SPAN_PX + x + k % 3;
                let cell = (1..9).fold(work.cells[around(0)], |cell, k| joined(cell, work.cells[around(k)]));
                if cell == Cell::Empty {
                    continue;
                }
                let centre = [(x + BORDER_PX) as f32 + 0.5, (y + BORDER_PX) as f32 + 0.5];
                let gathered = match cell {
                    Cell::Plane(id, _) => self.gathered(work.surfaces[id as usize].as_deref(), centre, image),
                    _ => None,
                };
                match gathered {
                    Some(colour) => image.rgba[y * TILE_PX + x] = colour,
                    None => {
                        left.push(y * TILE_PX + x);
                        (0..9).for_each(|k| work.wanted[around(k)] = true);
                    }
                }
            }
        }
        left
    }

    /// The colour of a pixel that one minified plane fills.
    fn gathered(&self, surface: Option<&Surface>, at: [f32; 2], image: &mut TileImage) -> Option<[f32; 4]> {
        let surface = surface?;
        let base = match &surface.base {
            Some(planes) => self.gather(surface, planes, at, image)?,
            None => [1.0; 4],
        };
        let emissive = match &surface.emissive {
            Some(planes) => self.gather(surface, planes, at, image)?,
            None => [1.0; 4],
        };
        Some(self.lit(surface, at, base, emissive))
    }

    fn gather(
        &self,
        surface: &Surface,
        planes: &UvPlanes,
        at: [f32; 2],
        image: &mut TileImage,
    ) -> Option<[f32; 4]> {
        let options = self.frame.options;
        let settings = PointSettings { level: options.level, max_texels: options.max_texels };
        let slope = match options.footprint {
            FootprintMode::Exact => surface.over_w_slope(at),
            _ => [0.0; 2],
        };
        let pyramid = &self.frame.scene.pyramids[planes.pyramid];
        let gathered = PointFootprint::new(pyramid, &surface.uv_at(planes, at), slope, &settings)?.gather();
        image.points += u64::from(gathered.texels);
        Some(gathered.rgba)
    }

    /// Colours of the sub-pixels that some pixel wants.
    fn lay_splats(&self, work: &mut TileWork, image: &mut TileImage) {
        let n = self.frame.filter.subpixels;
        let side = work.visibility.side;
        work.colours.resize(side * side, [0.0; 4]);
        for cell in (0..SPAN_PX * SPAN_PX).filter(|&cell| work.wanted[cell]) {
            let (column, row) = (cell % SPAN_PX, cell / SPAN_PX);
            let known_empty = work.cells[cell] == Cell::Empty;
            for j in 0..n {
                let start = (row * n + j) * side + column * n;
                for at in start..start + n {
                    work.colours[at] = [0.0; 4];
                    let id = work.visibility.ids[at];
                    if known_empty || id == NONE {
                        continue;
                    }
                    if let Some(surface) = &work.surfaces[id as usize] {
                        work.colours[at] = self.colour(surface, subpixel_px(self.frame.filter, at));
                        image.splats += 4;
                    }
                }
            }
        }
        for layer in &work.visibility.layers {
            let Some(surface) = &work.surfaces[layer.id as usize] else { continue };
            let at = layer.subpixel as usize;
            if !work.wanted[at / side / n * SPAN_PX + at % side / n] {
                continue;
            }
            let front = self.colour(surface, subpixel_px(self.frame.filter, at));
            let behind = &mut work.colours[at];
            for (b, f) in behind.iter_mut().zip(front) {
                *b = f + (1.0 - front[3]) * *b;
            }
            image.splats += 4;
        }
    }

    /// Premultiplied colour of a surface at a sub-pixel.
    #[inline(always)]
    fn colour(&self, surface: &Surface, at: [f32; 2]) -> [f32; 4] {
        let base = self.texture(surface, &surface.base, at);
        let emissive = self.texture(surface, &surface.emissive, at);
        self.lit(surface, at, base, emissive)
    }

    #[inline(always)]
    fn texture(&self, surface: &Surface, planes: &Option<UvPlanes>, at: [f32; 2]) -> [f32; 4] {
        let Some(planes) = planes else { return [1.0; 4] };
        let side_px = 1.0 / self.frame.filter.subpixels as f32;
        small_footprint(&self.frame.scene.pyramids[planes.pyramid], &surface.uv_at(planes, at), side_px)
    }

    /// Texture times factor, before light.
    fn base_colour(&self, surface: &Surface, at: [f32; 2]) -> [f32; 4] {
        let factor = surface.factor(at);
        let texture = self.texture(surface, &surface.base, at);
        [0, 1, 2, 3].map(|k| factor[k] * texture[k])
    }

    /// What the pixel shows of a surface: filtered textures times factors, lit, premultiplied.
    #[inline(always)]
    fn lit(&self, surface: &Surface, at: [f32; 2], base: [f32; 4], emissive: [f32; 4]) -> [f32; 4] {
        let material = surface.material(self.frame.scene);
        let factor = surface.factor(at);
        let light = surface.light_at(&self.view, at);
        // Textures of materials with alpha are premultiplied; what their factor's alpha makes of it is still to do.
        let (weight, alpha) = match material.alpha {
            AlphaMode::Opaque => (1.0, 1.0),
            AlphaMode::Mask { .. } => (if base[3] > 0.0 { 1.0 / base[3] } else { 0.0 }, 1.0),
            AlphaMode::Blend => (factor[3], (factor[3] * base[3]).min(1.0)),
        };
        let mut out = [alpha; 4];
        for k in 0..3 {
            let emitted = alpha * material.emissive_colour[k] * emissive[k];
            out[k] = weight * light * factor[k] * base[k] + emitted;
        }
        out
    }

    /// Filters the sub-pixels down to the pixels that have no colour yet.
    fn resolve(&self, pixels: &[usize], work: &TileWork, image: &mut TileImage) {
        let n = self.frame.filter.subpixels;
        let side = work.visibility.side;
        for &pixel in pixels {
            let (x, y) = (pixel % TILE_PX, pixel / TILE_PX);
            let mut sum = [0.0f32; 4];
            for (j, weights) in self.frame.filter.weights.chunks_exact(3 * n).enumerate() {
                let colours = &work.colours[(y * n + j) * side + x * n..][..3 * n];
                for (weight, colour) in weights.iter().zip(colours) {
                    for (s, c) in sum.iter_mut().zip(colour) {
                        *s += weight * c;
                    }
                }
            }
            image.rgba[pixel] = sum;
        }
    }
}

/// What two neighbouring cells show together.
fn joined(a: Cell, b: Cell) -> Cell {
    match (a, b) {
        (Cell::Plane(_, one), Cell::Plane(_, two)) if one == two => a,
        (Cell::Empty, Cell::Empty) => a,
        _ => Cell::Mixed,
    }
}

/// Position of a sub-pixel by its place in the tile.
#[inline(always)]
fn subpixel_px(filter: &PixelFilter, at: usize) -> [f32; 2] {
    let side = SPAN_PX * filter.subpixels;
    filter.position_px(at % side, at / side)
}

/// Largest key that the near plane lets through.
pub(crate) fn near_key(camera: &Camera) -> NearKey {
    let key = match camera.projection {
        resample_core::Projection::Perspective => 1.0 / camera.near,
        resample_core::Projection::Orthographic => -camera.near,
    };
    NearKey(key as f32)
}
