//! Draws one picture of a warp: the views that a layout puts on a sheet, from its references.

use anyhow::Result;
use resample_core::{Camera, Image};
use serde_json::json;
use warp3d::film::{Film, FilmOptions, Freedom, Hidden};
use warp3d::input::DepthKind;
use warp3d::input::film::{FilmInput, Streams};
use warp3d::multiview::{Layout, SeenDepths, comfortable_baseline, disparity_percent};
use warp3d::{Fill, FrameStats, Reference, Warper};

use crate::args::{LayoutWord, Warp3dArgs};
use crate::open::depth::film::held;
use crate::open::depth::frames::Frames;
use crate::open::depth::scene;
use crate::open::depth::scene::WarpScene;
use crate::picture::Drawn;
use crate::process::report::{Account, Cost, Notes};

/// Draws the views of a sheet.
pub(crate) struct Drawer {
    pub(crate) warper: Warper,
    /// Where the references of other pictures come from, if each picture has its own.
    pub(crate) source: Option<Source>,
    pub(crate) layout: Layout,
    pub(crate) comfort: Comfort,
    pub(crate) convergence: f64,
    pub(crate) converges: Converges,
    /// Notes that were printed.
    pub(crate) notes: Notes,
    pub(crate) last: LastPicture,
}

/// Where the views of a pair agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Converges {
    /// At a distance that was typed, or nowhere.
    AtDistance,
    /// At the median depth of the first picture of each shot.
    AtMedian,
}

impl Converges {
    pub(crate) fn of(args: &Warp3dArgs, layout: &Layout) -> Self {
        let is_around = args.views.layout.is_some_and(LayoutWord::is_around);
        match args.views.convergence {
            None if layout.needs_convergence() && !is_around => Self::AtMedian,
            _ => Self::AtDistance,
        }
    }
}

/// The limits within which a pair is comfortable to look at.
pub(crate) struct Comfort {
    /// The pair that was asked for.
    asked: Layout,
    /// Most disparity, per cent of the width.
    limit: Option<f64>,
    /// True if bars are asked for.
    has_window: bool,
    /// The nearest and the farthest depth that there can be, if that is known.
    planes: Option<[f64; 2]>,
    /// Width of the bars, per cent of the width.
    bar: f64,
}

impl Comfort {
    pub(crate) fn new(args: &Warp3dArgs, asked: Layout) -> Self {
        let meaning = scene::meaning(&args.meaning, None);
        let is_relative = meaning.kind == DepthKind::Relative;
        Self {
            asked,
            limit: args.views.comfort,
            has_window: args.views.floating_window,
            planes: is_relative.then(|| meaning.relative_planes()),
            bar: 0.0,
        }
    }
}

/// The last picture that was drawn, for `--filled` and `--confidence`.
pub(crate) enum LastPicture {
    /// Neither was asked for.
    NotKept,
    /// Kept, once there is one.
    Kept(Option<Image>),
}

/// Pictures with depth, one for each picture that is drawn.
pub(crate) struct Source {
    pub(crate) frames: Frames,
    args: Warp3dArgs,
    /// The films that are read, at the picture `next`.
    streams: Option<Streams>,
    /// Means and background, kept from picture to picture.
    film: Option<Film>,
    /// The picture that follows the last one that was read.
    next: usize,
    /// The picture whose references the warper holds.
    current: Option<usize>,
    /// Where each picture is seen from, once that is known.
    targets: Vec<Camera>,
}

/// A picture that was read.
pub(crate) struct Read {
    pub(crate) scene: WarpScene,
    /// The background that it hides and other pictures show.
    pub(crate) hidden: Option<Reference>,
    /// The depths of the first picture of its shot, where that has begun since the picture that was read before.
    pub(crate) begun: Option<SeenDepths>,
}

impl Source {
    /// The pictures of `frames`, from the first one.
    pub(crate) fn new(frames: Frames, args: &Warp3dArgs) -> Result<Self> {
        let mut source = Self {
            frames,
            args: args.clone(),
            streams: None,
            film: None,
            next: 0,
            current: None,
            targets: Vec::new(),
        };
        source.rewind()?;
        Ok(source)
    }

    /// Says where each picture is seen from.
    pub(crate) fn seen_from(&mut self, targets: &[Camera]) {
        self.targets = targets.to_vec();
    }

    /// Back to the first picture.
    fn rewind(&mut self) -> Result<()> {
        self.streams = self.frames.film().map(FilmInput::open).transpose()?;
        self.film = film_options(&self.args).map(Film::new);
        self.next = 0;
        Ok(())
    }

    /// Reads picture `number`, and those before it where it depends on them.
    pub(crate) fn read(&mut self, number: usize, notes: &mut Notes) -> Result<Read> {
        if self.streams.is_none() && self.film.is_none() {
            // Nothing depends on other pictures than the first of the shot.
            let first = self.frames.first_of_shot(number);
            let is_same = self
                .current
                .is_some_and(|current| (first..=number).contains(&current));
            self.next = if is_same { number } else { first };
        } else if number < self.next {
            self.rewind()?;
        }
        let mut begun = None;
        loop {
            let index = self.next;
            let mut words = self.frames.words(&self.args, index)?;
            if let (Some(streams), Some(film)) = (&mut self.streams, self.frames.film()) {
                words.source = held(streams.next(film)?);
            }
            self.next += 1;
            let said = self.frames.begins_shot(index);
            let is_of_shot = index >= self.frames.first_of_shot(number);
            if !is_of_shot || (self.film.is_none() && index < number && said != Some(true)) {
                continue;
            }
            let mut scene = scene::read(&words, notes)?;
            let mut hidden = None;
            let mut begins_shot = said == Some(true);
            if let (Some(film), [picture]) = (&mut self.film, &mut scene.references[..]) {
                let added = film.add(picture, said)?;
                hidden = added.hidden;
                begins_shot = added.begins_shot;
            }
            if begins_shot && let Some(target) = self.targets.get(index) {
                begun = scene::seen_depths(&scene.references, target).or(begun);
            }
            if index == number {
                self.current = Some(number);
                return Ok(Read {
                    scene,
                    hidden,
                    begun,
                });
            }
        }
    }
}

/// The things that are kept from picture to picture; `None` where every picture stands for itself.
pub(crate) fn film_options(args: &Warp3dArgs) -> Option<FilmOptions> {
    let kind = args.meaning.kind();
    let has_no_unit = kind == DepthKind::Relative;
    let steady = args.sequence.steady.unwrap_or(if has_no_unit {
        FilmOptions::default().steady
    } else {
        0
    });
    let hidden = match args.render.options.fill {
        Fill::Film => Hidden::Kept,
        Fill::None | Fill::Background | Fill::Natural => Hidden::LeftOut,
    };
    let freedom = match kind {
        DepthKind::Relative | DepthKind::Inverse => Freedom::ScaleAndOffset,
        _ => Freedom::Scale,
    };
    (steady > 0 || hidden == Hidden::Kept).then_some(FilmOptions {
        freedom,
        steady,
        hidden,
    })
}

impl Drawer {
    /// Draws, and warns of an empty picture.
    pub(crate) fn draw(&mut self, sheet: &Camera, number: usize) -> Result<Drawn> {
        self.turn_to(number)?;
        let drawn = self.draw_silently(sheet)?;
        if drawn.image.rgba.iter().all(|pixel| !(pixel[3] > 0.0)) {
            self.notes.say(
                "warning: nothing of the references is seen from this camera: the picture is empty",
            );
        }
        Ok(drawn)
    }

    /// Takes the references of picture `number`, and with a new shot its own convergence.
    pub(crate) fn turn_to(&mut self, number: usize) -> Result<()> {
        let Some(source) = &mut self.source else {
            return Ok(());
        };
        if source.current == Some(number) {
            return Ok(());
        }
        let read = source.read(number, &mut self.notes)?;
        let options = source.args.render.options.options()?;
        let target = source.targets.get(number).copied();
        self.warper = Warper::with_hidden(read.scene.references, read.hidden, &options)?;
        if let Some((seen, target)) = read.begun.zip(target) {
            self.begin_shot(&seen, &target, number);
        }
        Ok(())
    }

    /// Begins a shot with picture `number`: with its own convergence, and eyes as close together as it needs.
    pub(crate) fn begin_shot(&mut self, seen: &SeenDepths, view: &Camera, number: usize) {
        if self.converges == Converges::AtMedian {
            self.convergence = seen.median;
        }
        self.settle(seen, view, number);
    }

    /// The layout that was asked for.
    pub(crate) fn asked(&self) -> Layout {
        self.comfort.asked
    }

    /// Brings the eyes of a pair as close together as `--comfort` wants, and says what range is left, in the shot that begins
    /// with picture `number`.
    fn settle(&mut self, seen: &SeenDepths, view: &Camera, number: usize) {
        let comfort = &mut self.comfort;
        let is_asked = comfort.limit.is_some() || comfort.has_window;
        let Some(asked) = comfort.asked.baseline().filter(|_| is_asked) else {
            return;
        };
        let ends = comfort.planes.unwrap_or([seen.nearest, seen.farthest]);
        let baseline = match comfort.limit {
            None => asked,
            Some(limit) => comfortable_baseline(asked, view, self.convergence, ends, limit),
        };
        self.layout = comfort.asked.with_baseline(baseline);
        let [near, far] = ends.map(|z| disparity_percent(baseline, view, self.convergence, z));
        comfort.bar = match comfort.has_window {
            true => (-near).max(0.0),
            false => 0.0,
        };
        let shot = match number {
            0 => String::new(),
            _ => format!("from picture {number} on, "),
        };
        let eyes = match baseline < asked {
            true => format!("; --stereo {baseline:.3} instead of {asked}"),
            false => String::new(),
        };
        self.notes.say(&format!(
            "note: {shot}things have {near:.1} % (near) to {far:.1} % (far) of the width as disparity{eyes}"
        ));
    }

    /// Draws.
    pub(crate) fn draw_silently(&mut self, sheet: &Camera) -> Result<Drawn> {
        let views = self.layout.views(sheet, self.convergence);
        let frames: Result<Vec<_>, _> = views
            .iter()
            .map(|camera| self.warper.render(camera))
            .collect();
        let (mut images, stats): (Vec<_>, Vec<_>) = frames?
            .into_iter()
            .map(|frame| (frame.image, frame.stats))
            .unzip();
        if self.comfort.bar > 0.0 {
            self.layout.float_window(&mut images, self.comfort.bar);
        }
        let image = self.layout.put_together(sheet, images);
        if let LastPicture::Kept(last) = &mut self.last {
            *last = Some(image.clone());
        }
        Ok(Drawn {
            image,
            account: account(&stats)?,
        })
    }
}

/// Work at the pixel of an edge, and for a sample of the depth image, in other pixels. From the times of the stages.
const EDGE_PIXEL: f64 = 20.0;
const SAMPLE: f64 = 0.13;

/// The account of a warp's frames: that of one view, or a list of them.
fn account(stats: &[FrameStats]) -> Result<Account> {
    let keys = match stats {
        [one] => serde_json::to_value(one)?,
        several => json!({ "views": several }),
    };
    let sum = |number: fn(&FrameStats) -> f64| stats.iter().map(number).sum::<f64>();
    let line = format!(
        "{:.1} ms wall, {:.1} ms CPU; {} pixels seen, {} filled",
        sum(|stats| stats.wall_ms),
        sum(|stats| stats.cpu_ms),
        sum(|stats| stats.seen as f64),
        sum(|stats| stats.filled as f64)
    );
    let cost = Cost {
        wall_ms: sum(|stats| stats.wall_ms),
        cpu_ms: sum(|stats| stats.cpu_ms),
        growing: sum(|stats| stats.seen as f64 + EDGE_PIXEL * stats.edge_pixels as f64),
        fixed: sum(|stats| SAMPLE * stats.samples as f64),
        subpixels: 0,
    };
    Ok(Account { keys, line, cost })
}
