//! Pictures of references that stay in their files, window by window.
//!
//! A camera with a moved principal point and a smaller picture sees a part of what the whole camera sees. A window that
//! sees more of the references than fits the memory is cut in two, until it fits.

use resample_core::Camera;
use resample_core::clock::StageClock;

use super::LargeReference;
use super::blocks::OnScreen;
use super::sheet::Rect;
use crate::beyond::View;
use crate::layer::{Layer, Purpose};
use crate::memory::{allowed_for_windows, left_for_windows, window_bytes};
use crate::options::{Fill, Method, WarpOptions};
use crate::prepared::Surveyed;
use crate::stats::FrameStats;
use crate::warper::finished;
use crate::{Error, Frame, Warper};

/// Samples around what a window sees that may have a weight in it. A colour is gathered from up to three sigmas of at
/// most 32 samples away, in each direction; its spline has two samples more on either side; and coefficients there are
/// those of the whole picture when another 32 samples follow: what is beyond counts by 0.268^32 = 5e-19, the pole of the
/// cubic spline. The distances to cuts are counted up to 32 samples too.
pub(super) const REACH: usize = 99 + 3 + 32 + 2;

/// Pixels around a window that decide its pixels: whether one is at an edge depends on what the next but one sees, on
/// whether a rim touches that, and on what is seen beside it, four pixels away at most; two more to be sure.
const GUARD_PX: u32 = 6;

/// Farthest that a footprint reaches on the screen, px: that of the methods that lay samples one by one, and of the
/// pieces of surfaces, whose places are rounded.
const REACH_PX: [f32; 2] = [65.0, 1.0];

/// Parts of references begin and end at multiples of this, so that the next window or picture finds them again.
const ALIGNED: usize = 256;

/// A side that is not cut any further, px.
const LEAST_PX: u32 = 4;

/// Warps references that stay in their files, frame after frame.
#[derive(Debug)]
pub struct LargeWarper {
    references: Vec<LargeReference>,
    options: WarpOptions,
    max_memory: u64,
    kept: Option<Kept>,
}

/// The parts of the references that were read last, prepared.
#[derive(Debug)]
struct Kept {
    parts: Vec<Option<Rect>>,
    warper: Warper,
}

/// First and end column and row, px.
type Window = [[u32; 2]; 2];

/// A frame in the making.
struct Drawing<'a> {
    camera: &'a Camera,
    /// Memory for windows, bytes.
    room: u64,
    layer: Layer,
    stats: FrameStats,
}

impl LargeWarper {
    /// Warps `references` with `options`, holding at most about `max_memory` bytes.
    ///
    /// # Errors
    /// No reference, or an option out of range.
    pub fn new(
        references: Vec<LargeReference>,
        options: &WarpOptions,
        max_memory: u64,
    ) -> Result<Self, Error> {
        options.validate()?;
        if references.is_empty() {
            return Err(Error::Option(
                "there is no reference view: give one picture with depth at least".into(),
            ));
        }
        Ok(Self {
            references,
            options: options.clone(),
            max_memory,
            kept: None,
        })
    }

    /// How they are warped.
    pub fn options(&self) -> &WarpOptions {
        &self.options
    }

    /// The references, as they were given.
    pub fn references(&self) -> &[LargeReference] {
        &self.references
    }

    /// The picture from `camera`.
    ///
    /// # Errors
    /// An invalid camera, memory too small for the picture or for the least window, and a temporary file that can no
    /// longer be read.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let whole = StageClock::start();
        let pixels = u64::from(camera.width) * u64::from(camera.height);
        let blocks = block_count(&self.references);
        let room = left_for_windows(self.max_memory, pixels, blocks, &self.options);
        let references = std::mem::take(&mut self.references);
        let drawn = self.draw(&references, &camera, room);
        self.references = references;
        let (mut layer, mut stats) = drawn?;
        let view = View {
            camera: &camera,
            references: self.references.iter().map(|r| r.camera).collect(),
        };
        let image = finished(&mut layer, &view, &self.options, &mut stats);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    fn draw(
        &mut self,
        references: &[LargeReference],
        camera: &Camera,
        room: u64,
    ) -> Result<(Layer, FrameStats), Error> {
        let reach_px = match self.options.method {
            Method::Points { .. } | Method::Splats { .. } => REACH_PX[0],
            Method::Nearest { .. } | Method::Hybrid { .. } => REACH_PX[1],
        };
        let clock = StageClock::start();
        let on_screen = references
            .iter()
            .map(|r| r.blocks.on_screen(&r.camera, camera, reach_px));
        let on_screen: Vec<OnScreen<'_>> = on_screen.collect();
        let pixels = camera.width as usize * camera.height as usize;
        let mut layer = Layer::empty(pixels);
        layer.purity = vec![1.0; pixels];
        let mut drawing = Drawing {
            camera,
            room,
            layer,
            stats: FrameStats::default(),
        };
        drawing.stats.stages.project += clock.stop();
        let mut windows = vec![[[0, camera.width], [0, camera.height]]];
        while let Some(window) = windows.pop() {
            windows.extend(
                self.draw_or_cut(references, &on_screen, window, &mut drawing)?
                    .into_iter()
                    .flatten(),
            );
        }
        let Drawing {
            layer, mut stats, ..
        } = drawing;
        stats.samples = references.iter().map(|reference| reference.known).sum();
        stats.outside = on_screen
            .iter()
            .map(|places| places.outside([camera.width, camera.height]))
            .sum();
        Ok((layer, stats))
    }

    /// Draws a window, or gives its two halves, the first one last.
    fn draw_or_cut(
        &mut self,
        references: &[LargeReference],
        on_screen: &[OnScreen<'_>],
        window: Window,
        drawing: &mut Drawing<'_>,
    ) -> Result<Option<[Window; 2]>, Error> {
        let camera = drawing.camera;
        let outer = grown(window, [camera.width, camera.height]);
        let parts = parts_seen(on_screen, outer);
        if parts.iter().all(Option::is_none) {
            return Ok(None);
        }
        let needed = |parts: &[Option<Rect>]| self.window_bytes(references, parts, outer);
        let held = self.kept.as_ref().filter(|kept| holds(&kept.parts, &parts));
        let is_held = held.is_some_and(|kept| needed(&kept.parts) <= drawing.room);
        if !is_held {
            let wide: Vec<Option<Rect>> = parts
                .iter()
                .zip(references)
                .map(|(part, r)| part.map(|part| aligned(&part, r.sheet.size)))
                .collect();
            let chosen = [wide, parts]
                .into_iter()
                .find(|parts| needed(parts) <= drawing.room);
            let Some(chosen) = chosen else {
                return halves(window)
                    .map(Some)
                    .ok_or_else(|| self.too_little(references, on_screen, camera));
            };
            // The old parts make room before the new ones are read.
            self.kept = None;
            self.kept = Some(self.prepared(references, chosen, &mut drawing.stats)?);
        }
        if let Some(kept) = &mut self.kept {
            drawing.draw(&mut kept.warper, window, outer);
        }
        Ok(None)
    }

    /// Reads and prepares parts of the references.
    fn prepared(
        &self,
        references: &[LargeReference],
        parts: Vec<Option<Rect>>,
        stats: &mut FrameStats,
    ) -> Result<Kept, Error> {
        let read = |(part, reference): (&Option<Rect>, &LargeReference)| match part {
            Some(part) => reference.part(part),
            None => Ok(reference.nothing()),
        };
        let clock = StageClock::start();
        let samples = parts
            .iter()
            .zip(references)
            .map(read)
            .collect::<Result<Vec<_>, _>>()?;
        stats.read_samples += parts.iter().flatten().map(Rect::samples).sum::<u64>();
        let surveyed: Vec<Surveyed> = references.iter().map(|r| r.surveyed).collect();
        // Holes are filled when the picture is whole.
        let options = WarpOptions {
            fill: Fill::None,
            ..self.options.clone()
        };
        let warper = Warper::of_surveyed(samples, Some(&surveyed), &options)?;
        stats.stages.prepare += clock.stop();
        Ok(Kept { parts, warper })
    }

    /// Bytes in which a window that sees these parts is drawn, with what surrounds it.
    fn window_bytes(
        &self,
        references: &[LargeReference],
        parts: &[Option<Rect>],
        outer: Window,
    ) -> u64 {
        let samples: Vec<u64> = parts
            .iter()
            .map(|part| part.map_or(1, |part| part.samples()))
            .collect();
        let with_reference = parts.iter().zip(references);
        let cuts = with_reference
            .filter_map(|(part, r)| part.map(|part| r.blocks.cuts_in(&part)))
            .sum();
        let pixels = sides(outer).map(u64::from).iter().product();
        window_bytes(&samples, cuts, pixels, &self.options)
    }

    /// The refusal of a picture whose least windows do not fit; it names the memory in which all of them do.
    fn too_little(
        &self,
        references: &[LargeReference],
        on_screen: &[OnScreen<'_>],
        camera: &Camera,
    ) -> Error {
        let size = [camera.width, camera.height];
        let mut most = 0;
        let mut windows = vec![[[0, size[0]], [0, size[1]]]];
        // A part of a window takes no more than the window.
        while let Some(window) = windows.pop() {
            let outer = grown(window, size);
            let needed = self.window_bytes(references, &parts_seen(on_screen, outer), outer);
            if needed > most {
                match halves(window) {
                    Some(both) => windows.extend(both),
                    None => most = needed,
                }
            }
        }
        let [width, height] = size;
        let needed = allowed_for_windows(
            most,
            u64::from(width) * u64::from(height),
            block_count(references),
            &self.options,
        );
        Error::Option(format!(
            "{} MiB are allowed, a picture of {width}x{height} takes at least {} MiB: allow more, or make the new \
             picture smaller",
            self.max_memory >> 20,
            needed.div_ceil(1 << 20)
        ))
    }
}

impl Drawing<'_> {
    /// Draws `outer` and keeps `window` of it.
    fn draw(&mut self, warper: &mut Warper, window: Window, outer: Window) {
        let camera = self.camera;
        let [width, height] = sides(outer);
        let [left, top] = outer.map(|range| range[0]);
        let (cx, cy) = (camera.cx - f64::from(left), camera.cy - f64::from(top));
        let part = warper.layer(
            &Camera {
                width,
                height,
                cx,
                cy,
                ..*camera
            },
            Purpose::Part,
            &mut self.stats,
        );
        self.stats.windows += 1;
        let columns = (window[0][1] - window[0][0]) as usize;
        for y in window[1][0]..window[1][1] {
            let from = ((y - top) * width + window[0][0] - left) as usize;
            let to = y as usize * camera.width as usize + window[0][0] as usize;
            let (from, to) = (from..from + columns, to..to + columns);
            self.layer.rgba[to.clone()].copy_from_slice(&part.rgba[from.clone()]);
            self.layer.depth[to.clone()].copy_from_slice(&part.depth[from.clone()]);
            self.layer.resolution[to.clone()].copy_from_slice(&part.resolution[from.clone()]);
            if !part.purity.is_empty() {
                self.layer.purity[to].copy_from_slice(&part.purity[from]);
            }
        }
    }
}

fn block_count(references: &[LargeReference]) -> u64 {
    references
        .iter()
        .map(|reference| reference.blocks.len() as u64)
        .sum()
}

/// The part of each reference that a window sees.
fn parts_seen(on_screen: &[OnScreen<'_>], outer: Window) -> Vec<Option<Rect>> {
    on_screen
        .iter()
        .map(|places| places.seen_in(outer, REACH))
        .collect()
}

/// A window with what decides its pixels, as far as the picture goes.
fn grown(window: Window, size: [u32; 2]) -> Window {
    [0, 1].map(|i| {
        [
            window[i][0].saturating_sub(GUARD_PX),
            (window[i][1] + GUARD_PX).min(size[i]),
        ]
    })
}

fn sides(window: Window) -> [u32; 2] {
    window.map(|[first, end]| end - first)
}

/// The window cut in two across its longer side; `None` where it is as small as it gets.
fn halves(window: Window) -> Option<[Window; 2]> {
    let sides = sides(window);
    let axis = usize::from(sides[1] > sides[0]);
    if sides[axis] < 2 * LEAST_PX {
        return None;
    }
    let middle = window[axis][0] + sides[axis] / 2;
    let (mut before, mut behind) = (window, window);
    before[axis][1] = middle;
    behind[axis][0] = middle;
    Some([behind, before])
}

/// Whether some parts hold others.
fn holds(parts: &[Option<Rect>], others: &[Option<Rect>]) -> bool {
    parts.iter().zip(others).all(|pair| match pair {
        (Some(part), Some(other)) => part.holds(other),
        (_, other) => other.is_none(),
    })
}

/// A part grown to multiples of [`ALIGNED`], as far as the picture goes.
fn aligned(part: &Rect, size: [usize; 2]) -> Rect {
    let first = part.first.map(|v| v / ALIGNED * ALIGNED);
    let end = |i: usize| ((part.first[i] + part.size[i]).div_ceil(ALIGNED) * ALIGNED).min(size[i]);
    Rect {
        first,
        size: [end(0) - first[0], end(1) - first[1]],
    }
}
