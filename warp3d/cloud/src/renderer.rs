//! The driver: discs prepared once, then one picture per camera.

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::narrow::side;
use resample_core::simd::SimdLevel;
use resample_core::tile;
use resample_core::{Camera, Image, Plane, dispatch};

use crate::discs::prepare::{Disc, LeftOut, Prepared};
use crate::draw::groups::Groups;
use crate::draw::listed::Listed;
use crate::draw::sizes::TILE_PX;
use crate::draw::tile::{EMPTY, Shown, TileScratch, draw_tile};
use crate::draw::view::View;
use crate::options::{CloudLayer, CloudOptions};
use resample_core::Error;
use resample_core::clock::StageTime;

/// Draws a prepared cloud, picture after picture.
#[derive(Clone, Debug)]
pub struct CloudRenderer {
    prepared: Prepared,
    options: CloudOptions,
    groups: Groups,
    listed: Listed,
    /// The camera and the options that `listed` belongs to.
    listed_for: Option<(Camera, CloudOptions)>,
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct CloudFrame {
    /// Linear premultiplied colour, and depth (camera z).
    pub image: Image,
    /// Counts and times.
    pub stats: CloudStats,
}

/// Counts and times of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct CloudStats {
    /// Discs of the cloud.
    pub discs: u64,
    /// Points that have no disc.
    pub left_out: LeftOut,
    /// Discs in the picture, seen or hidden, and neighbours of such.
    pub in_view: u64,
    /// Pixels in which something is seen.
    pub seen: u64,
    /// Time of projecting and listing.
    pub project: StageTime,
    /// Time of drawing tiles.
    pub draw: StageTime,
}

/// A part of a picture that begins at edges of tiles.
struct Window {
    first: [usize; 2],
    /// Width and height, px.
    size: [usize; 2],
}

impl Window {
    fn new(camera: &Camera, first: [usize; 2], size: [usize; 2]) -> Result<Self, Error> {
        let whole = [camera.width as usize, camera.height as usize];
        let is_inside = (0..2).all(|axis| {
            let end = first[axis].checked_add(size[axis]);
            first[axis].is_multiple_of(tile::TILE_PX) && end.is_some_and(|end| end <= whole[axis])
        });
        if !is_inside {
            return Err(Error::Option(format!(
                "a window of {size:?} pixels from {first:?} on is not inside of {}x{}, or begins within {} pixels",
                whole[0],
                whole[1],
                tile::TILE_PX
            )));
        }
        Ok(Self { first, size })
    }
}

impl CloudRenderer {
    /// A renderer of discs.
    ///
    /// # Errors
    /// An option is out of its range.
    pub fn new(prepared: Prepared, options: &CloudOptions) -> Result<Self, Error> {
        options.validate()?;
        Ok(Self {
            prepared,
            options: options.clone(),
            groups: Groups::default(),
            listed: Listed::default(),
            listed_for: None,
        })
    }

    /// Draws with these options from now on.
    ///
    /// # Errors
    /// As [`CloudRenderer::new`]; then nothing changes.
    pub fn update(&mut self, options: &CloudOptions) -> Result<(), Error> {
        options.validate()?;
        self.options = options.clone();
        Ok(())
    }

    /// The discs.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// Takes other colours, as [`Prepared::recolour`] does.
    pub fn recolour(&mut self, colour: impl Fn(&Disc, usize) -> [u8; 3] + Sync) {
        self.prepared.recolour(colour);
    }

    /// The picture from `camera`.
    ///
    /// # Errors
    /// The camera is invalid.
    pub fn render(&mut self, camera: &Camera) -> Result<CloudFrame, Error> {
        let size = [camera.width as usize, camera.height as usize];
        self.render_window(camera, [0, 0], size)
    }

    /// A window of the picture from `camera`: the pixels that the whole picture has there. It begins at edges of tiles
    /// ([`tile::TILE_PX`]).
    ///
    /// # Errors
    /// The camera is invalid, or the window does not begin at edges of tiles or leaves the picture.
    pub fn render_window(
        &mut self,
        camera: &Camera,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Result<CloudFrame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let window = Window::new(&camera, first, size)?;
        let mut stats = CloudStats {
            discs: self.prepared.discs.len() as u64,
            left_out: self.prepared.left_out,
            ..CloudStats::default()
        };
        let clock = StageClock::start();
        let wanted = (camera, self.options.clone());
        let level = SimdLevel::Auto.resolve();
        let every = self.options.every as usize;
        if self.groups.every != every {
            self.groups = Groups::new(&self.prepared.discs, every);
        }
        let view = View::new(&self.prepared, &self.groups, &camera, &self.options, level);
        if self.listed_for.as_ref() != Some(&wanted) {
            self.listed.fill(&view);
            self.listed_for = Some(wanted);
        }
        stats.project = clock.stop();
        stats.in_view = self.listed.discs(&view);
        let clock = StageClock::start();
        let image = draw(&view, &self.listed, &window);
        stats.draw = clock.stop();
        stats.seen = image.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        Ok(CloudFrame { image, stats })
    }
}

fn draw(view: &View, listed: &Listed, window: &Window) -> Image {
    let [width, height] = window.size;
    let mut image = Image::transparent(width, height);
    let mut depth = vec![EMPTY.depth; width * height];
    let has_normals = view.options.layers.contains(&CloudLayer::Normal);
    let mut normals = vec![[0.0; 3]; if has_normals { width * height } else { 0 }];
    let planes = (&mut image.rgba[..], &mut depth[..], &mut normals[..]);
    window.bands(planes).for_each_init(
        || Box::new(TileScratch::new(view.options.subpixels as usize)),
        |scratch, mut band| {
            let [first, end] = [window.first[0], window.first[0] + width];
            for column in first / TILE_PX..end.div_ceil(TILE_PX) {
                let tile = [column, band.first_row / TILE_PX].map(side);
                let shown =
                    dispatch!(view.level, simd => draw_tile(simd, view, listed, tile, scratch));
                if let Some(shown) = shown {
                    band.put(shown, column * TILE_PX, [first, end]);
                }
            }
        },
    );
    image.depth = Some(depth);
    if has_normals {
        for (axis, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
            let values = normals.iter().map(|normal| normal[axis]).collect();
            let name = name.to_owned();
            image.planes.push(Plane { name, values });
        }
    }
    image
}

/// The pixels of a window: colours, depths and normals, which are empty where they are not asked for.
type Planes<'a> = (&'a mut [[f32; 4]], &'a mut [f32], &'a mut [[f32; 3]]);

/// The rows of a window that lie in one row of tiles.
struct Band<'a> {
    /// The first row, of the picture.
    first_row: usize,
    rgba: &'a mut [[f32; 4]],
    depth: &'a mut [f32],
    /// Empty where normals are not asked for.
    normals: &'a mut [[f32; 3]],
}

impl Window {
    /// Takes a window's pixels apart into bands. The first and the last may be cut.
    fn bands<'a>(
        &self,
        (mut rgba, mut depth, mut normals): Planes<'a>,
    ) -> impl ParallelIterator<Item = Band<'a>> {
        let mut bands = Vec::new();
        let (mut row, end) = (self.first[1], self.first[1] + self.size[1]);
        while row < end {
            let rows = (TILE_PX - row % TILE_PX).min(end - row);
            let count = rows * self.size[0];
            let (colours, other_colours) = rgba.split_at_mut(count);
            let (depths, other_depths) = depth.split_at_mut(count);
            let (own, other_normals) = normals.split_at_mut(count.min(normals.len()));
            bands.push(Band {
                first_row: row,
                rgba: colours,
                depth: depths,
                normals: own,
            });
            (rgba, depth, normals) = (other_colours, other_depths, other_normals);
            row += rows;
        }
        bands.into_par_iter()
    }
}

impl Band<'_> {
    /// Puts a tile, whose first column is given, into a window of these columns.
    fn put(&mut self, tile: Shown<'_>, column: usize, [first, end]: [usize; 2]) {
        let width = end - first;
        let columns = column.max(first)..(column + TILE_PX).min(end);
        let skipped = self.first_row % TILE_PX;
        for row in 0..(TILE_PX - skipped).min(self.depth.len() / width) {
            let (from, to) = ((skipped + row) * TILE_PX, row * width);
            for place in columns.clone() {
                let pixel = &tile.pixels[from + place - column];
                self.rgba[to + place - first] = pixel.rgba;
                self.depth[to + place - first] = pixel.depth;
            }
            if !self.normals.is_empty() && !tile.normals.is_empty() {
                let normals =
                    &tile.normals[from + columns.start - column..from + columns.end - column];
                let to = to + columns.start - first;
                self.normals[to..to + normals.len()].copy_from_slice(normals);
            }
        }
    }
}
