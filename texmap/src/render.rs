//! The renderer: a scene prepared once, then one picture per camera.
//!
//! Tiles are cut without regard to the number of threads, and each is owned by one task, so the same bytes come out
//! on any number of them.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::composite::surface::SAMPLES_PER_SIDE;
use resample_core::tile::TileLists;
use resample_core::{Camera, Image, Reuse, Surface};

use crate::finish::tone;
use crate::light::blocked::BlockedLight;
use crate::options::{PlaneKind, RenderOptions};
use crate::paper::pixel_look_ups;
use crate::prepare::Prepared;
use crate::project::cull::{InView, cull};
use crate::screen::{TILE_WIDTH, Window, tile_grid};
use crate::shadow::block_light;
use crate::stats::FrameStats;
use crate::tile::planes::add_planes;
use crate::tile::task::{FrameView, TileImage, near_key};
use crate::tile::{StageBuffers, draw_tile};
use crate::visibility::filter::PixelFilter;
use crate::{Error, Scene};

/// Renders one prepared scene, frame after frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Prepared,
    /// The light on its surfaces, where they block it.
    blocked: Option<Arc<BlockedLight>>,
    options: RenderOptions,
    filter: PixelFilter,
    bounds_in_world: Option<[DVec3; 2]>,
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

impl Renderer {
    /// Prepares `scene` for rendering with `options`.
    ///
    /// # Errors
    /// [`Error::Option`] if an option is outside its range.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// let wrong = RenderOptions { subpixels: 5, ..RenderOptions::default() };
    /// assert!(Renderer::new(&scene, &wrong).is_err());
    /// assert!(Renderer::new(&scene, &RenderOptions::default()).is_ok());
    /// ```
    pub fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        options.validate()?;
        let mut prepared = Prepared::new(scene, options);
        let blocked = block_light(scene, &mut prepared, options);
        Ok(Self {
            scene: prepared,
            blocked: blocked.map(Arc::new),
            options: options.clone(),
            filter: PixelFilter::new(options.subpixels as usize),
            bounds_in_world: bounds_in_world(scene),
        })
    }

    /// Draws with `options` from now on, if the preparation serves them; else nothing changes, and a new renderer is needed.
    ///
    /// # Errors
    /// [`Error::Option`] if an option is outside its range.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer, Reuse, Shade};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
    /// let fewer = RenderOptions { subpixels: 2, ..RenderOptions::default() };
    /// assert_eq!(renderer.update(&fewer)?, Reuse::Kept);
    /// let unlit = RenderOptions { shade: Shade::Unlit, ..RenderOptions::default() };
    /// assert_eq!(renderer.update(&unlit)?, Reuse::NeedsRenderer);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn update(&mut self, options: &RenderOptions) -> Result<Reuse, Error> {
        options.validate()?;
        // The preparation depends on the shading alone; an option that is not named here counts as a part of it.
        let own = self.options.clone();
        let alike = RenderOptions {
            method: own.method,
            subpixels: own.subpixels,
            exposure: own.exposure,
            tone_map: own.tone_map,
            planes: own.planes.clone(),
            background: own.background,
            ..options.clone()
        };
        if alike != own {
            return Ok(Reuse::NeedsRenderer);
        }
        self.filter = PixelFilter::new(options.subpixels as usize);
        self.options = options.clone();
        Ok(Reuse::Kept)
    }

    /// The box, in the world, of the vertices that triangles use; `None` without triangles.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// let renderer = Renderer::new(&scene, &RenderOptions::default())?;
    /// let [low, high] = renderer.bounds_in_world().ok_or("no triangles")?;
    /// assert_eq!((low.x, high.y), (-1.0, 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders one frame.
    ///
    /// # Errors
    /// [`Error::Option`] if the camera is invalid.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// # let pose = resample_core::LookAt {
    /// #     position: [0.0, 0.0, 4.0].into(),
    /// #     target: [0.0; 3].into(),
    /// #     up: [0.0, 1.0, 0.0].into(),
    /// # };
    /// # let camera = resample_core::Camera::perspective(&pose, 0.8, [64, 48])?;
    /// let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
    /// let frame = renderer.render(&camera)?;
    /// assert_eq!(frame.stats.triangles, 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let whole = [camera.width as usize, camera.height as usize];
        self.render_window(camera, [0, 0], whole)
    }

    /// Renders a window of a frame: `size` pixels from column and row `first` on, with the bytes that the whole frame has there.
    ///
    /// # Errors
    /// [`Error::Option`] if the camera is invalid, or the window is not inside or does not begin at a multiple of 16 pixels.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// # let pose = resample_core::LookAt {
    /// #     position: [0.0, 0.0, 4.0].into(),
    /// #     target: [0.0; 3].into(),
    /// #     up: [0.0, 1.0, 0.0].into(),
    /// # };
    /// # let camera = resample_core::Camera::perspective(&pose, 0.8, [64, 48])?;
    /// let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
    /// let whole = renderer.render(&camera)?.image;
    /// let window = renderer.render_window(&camera, [32, 16], [20, 10])?.image;
    /// assert_eq!(window.pixel(3, 4), whole.pixel(35, 20));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn render_window(
        &mut self,
        camera: &Camera,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Result<Frame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = FrameStats::default();
        let whole = StageClock::start();

        let clock = StageClock::start();
        let in_view = cull(&self.scene, &camera, &mut stats);
        stats.stages.cull = clock.stop();

        let clock = StageClock::start();
        let grid = tile_grid(&camera);
        let window = Window::new(&grid, first, size)?;
        let lists = TileLists::new(&grid, &in_view.rects);
        stats.tile_pairs = in_view.rects.iter().map(|rect| rect.area() as u64).sum();
        stats.stages.bin = clock.stop();

        let tiles = self.tiles(&camera, &in_view, (&window, &lists), &mut stats);

        let clock = StageClock::start();
        let mut image = picture(&window, &tiles);
        tone::apply(self.options.exposure, self.options.tone_map, &mut image);
        if !self.options.planes.is_empty() {
            add_planes(&mut image, &self.options, &window, &tiles);
        }
        stats.pixels_touched = image.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        stats.stages.image = clock.stop();

        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    /// Draws the scene for a renderer that composites it inside its own picture from `camera`: the nearest surface at each of
    /// `subpixels` x `subpixels` sub-pixels of a pixel. A pixel has four lines of samples at least, as pictures have by default; their
    /// filter is as narrow as a sub-pixel.
    ///
    /// # Errors
    /// [`Error::Option`] if the camera is invalid, or too many sub-pixels are asked for.
    ///
    /// ```
    /// use texmap::{RenderOptions, Renderer};
    ///
    /// # use texmap::scene::{Material, Mesh};
    /// # let mesh = Mesh {
    /// #     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
    /// #     triangles: vec![[0, 1, 2]],
    /// #     ..Mesh::default()
    /// # };
    /// # let scene = texmap::Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Default::default() };
    /// # let pose = resample_core::LookAt {
    /// #     position: [0.0, 0.0, 4.0].into(),
    /// #     target: [0.0; 3].into(),
    /// #     up: [0.0, 1.0, 0.0].into(),
    /// # };
    /// # let camera = resample_core::Camera::perspective(&pose, 0.8, [64, 48])?;
    /// let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
    /// let surface = renderer.surface(&camera, 2)?;
    /// assert_eq!(surface.size(), [128, 96]);
    /// assert!(surface.tile([4, 3]).is_some_and(|tile| (tile.depth[0][0] - 4.0).abs() < 1e-5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn surface(&mut self, camera: &Camera, subpixels: u32) -> Result<Surface, Error> {
        let whole = [camera.width as usize, camera.height as usize];
        self.surface_window(camera, ([0; 2], whole), subpixels)
    }

    /// As [`Renderer::surface`], a window of it: its first column and row, its width and height, px. It has the bits of the whole.
    ///
    /// # Errors
    /// As [`Renderer::surface`], and a window beyond the picture.
    pub fn surface_window(
        &mut self,
        camera: &Camera,
        (first, size): ([usize; 2], [usize; 2]),
        subpixels: u32,
    ) -> Result<Surface, Error> {
        let sides = [camera.width, camera.height];
        let too_many = || {
            Error::Option(format!(
                "{subpixels} sub-pixels along a pixel's side are too many"
            ))
        };
        let fine = sides.map(|side| side.checked_mul(subpixels));
        let [Some(width), Some(height)] = fine else {
            return Err(too_many());
        };
        let fine = camera.resized(width, height).map_err(|_| too_many())?;
        let own = self.options.clone();
        let samples = (SAMPLES_PER_SIDE / subpixels).max(1);
        let _kept = self.update(&RenderOptions {
            planes: vec![PlaneKind::Depth],
            subpixels: samples,
            ..own.clone()
        })?;
        self.filter = PixelFilter::as_square(samples as usize);
        let [first, size] = [first, size].map(|px| px.map(|px| px * subpixels as usize));
        let drawn = Surface::in_bands(size, |row, rows| {
            let first = [first[0], first[1] + row];
            Ok(self.render_window(&fine, first, [size[0], rows])?.image)
        });
        let _kept = self.update(&own)?;
        drawn
    }

    /// Draws every tile: the stages visibility, accumulate and resolve.
    fn tiles(
        &self,
        camera: &Camera,
        in_view: &InView,
        (window, lists): (&Window, &TileLists),
        stats: &mut FrameStats,
    ) -> Vec<TileImage> {
        let clock = StageClock::start();
        let frame = FrameView {
            scene: &self.scene,
            blocked: self.blocked.as_deref(),
            camera,
            options: &self.options,
            in_view,
            filter: &self.filter,
            near: near_key(camera),
            simd: self.options.simd.resolve(),
        };
        let look_ups = pixel_look_ups(self.options.method);
        let tiles: Vec<TileImage> = (0..window.tiles())
            .into_par_iter()
            .map_init(StageBuffers::default, |buffers, index| {
                let at = window.tile(index);
                draw_tile(&frame, look_ups, (at, lists.tile(at[0], at[1])), buffers)
            })
            .collect();
        let sum = |part: fn(&TileImage) -> f64| tiles.iter().map(part).sum::<f64>();
        [
            stats.stages.visibility,
            stats.stages.accumulate,
            stats.stages.resolve,
        ] = clock.stop().shared([
            sum(|tile| tile.visibility_ms),
            sum(|tile| tile.accumulate_ms),
            sum(|tile| tile.resolve_ms),
        ]);
        stats.points = tiles.iter().map(|tile| tile.points).sum();
        stats.splats = tiles.iter().map(|tile| tile.splats).sum();
        let mut drawn = vec![false; in_view.triangles.len()];
        tiles
            .iter()
            .flat_map(|tile| &tile.drawn)
            .for_each(|&i| drawn[i as usize] = true);
        stats.drawn = drawn.iter().filter(|&&d| d).count() as u64;
        stats.hidden = drawn.len() as u64 - stats.drawn;
        tiles
    }
}

/// Copies the tiles into a picture.
fn picture(window: &Window, tiles: &[TileImage]) -> Image {
    let [width, height] = window.size;
    let mut image = Image::transparent(width, height);
    let rows = image.rgba.par_chunks_mut(width.max(1)).enumerate();
    rows.for_each(|(y, row)| {
        let (tiles, y) = window.row(tiles, y);
        for (part, tile) in row.chunks_mut(TILE_WIDTH).zip(tiles) {
            if !tile.rgba.is_empty() {
                part.copy_from_slice(&tile.rgba[y * TILE_WIDTH..][..part.len()]);
                // A sum of weights may be above 1 by its rounding.
                part.iter_mut()
                    .for_each(|pixel| pixel[3] = pixel[3].min(1.0));
            }
        }
    });
    image
}

fn bounds_in_world(scene: &Scene) -> Option<[DVec3; 2]> {
    let corners = scene.meshes.iter().flat_map(|mesh| {
        mesh.triangles.iter().flatten().map(|&i| {
            scene.origin_in_world + DVec3::from(mesh.positions[i as usize].map(f64::from))
        })
    });
    corners.fold(None, |bounds, p| match bounds {
        None => Some([p, p]),
        Some([low, high]) => Some([low.min(p), high.max(p)]),
    })
}
