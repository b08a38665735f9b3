//! Draws one picture of a warp: the views that a layout puts on a sheet, from its references.

use anyhow::Result;
use resample_core::{Camera, Image};
use serde_json::json;
use warp3d::{FrameStats, Warper};

use crate::args::Warp3dArgs;
use crate::cameras::multiview::Layout;
use crate::open::depth::frames::Frames;
use crate::open::depth::scene;
use crate::picture::Drawn;
use crate::process::report::{Account, Cost, Notes};

/// Draws the views of a sheet.
pub(crate) struct Drawer {
    pub(crate) warper: Warper,
    /// Where the references of other pictures come from, if each picture has its own.
    pub(crate) source: Option<Source>,
    pub(crate) layout: Layout,
    pub(crate) convergence: f64,
    /// Notes that were printed.
    pub(crate) notes: Notes,
    pub(crate) last: LastPicture,
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
    pub(crate) args: Warp3dArgs,
    /// The picture whose references the warper holds.
    pub(crate) current: usize,
}

impl Source {
    /// The warper of picture `number`, if it is another than the present one.
    fn next(&mut self, number: usize, notes: &mut Notes) -> Result<Option<Warper>> {
        if self.current == number {
            return Ok(None);
        }
        self.current = number;
        let words = self.frames.words(&self.args, number);
        let scene = scene::read(&words, notes)?;
        let options = self.args.render.options.options()?;
        Ok(Some(Warper::new(scene.references, &options)?))
    }
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

    /// Takes the references of picture `number`.
    pub(crate) fn turn_to(&mut self, number: usize) -> Result<()> {
        if let Some(source) = &mut self.source
            && let Some(warper) = source.next(number, &mut self.notes)?
        {
            self.warper = warper;
        }
        Ok(())
    }

    /// Draws.
    pub(crate) fn draw_silently(&mut self, sheet: &Camera) -> Result<Drawn> {
        let views = self.layout.views(sheet, self.convergence);
        let frames: Result<Vec<_>, _> = views
            .iter()
            .map(|camera| self.warper.render(camera))
            .collect();
        let (images, stats): (Vec<_>, Vec<_>) = frames?
            .into_iter()
            .map(|frame| (frame.image, frame.stats))
            .unzip();
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
