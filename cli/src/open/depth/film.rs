//! Films on the command line: their names handed to the library, and the defaults that a film sets.

use std::sync::Arc;

use anyhow::Result;
use resample_io::Stored;
use warp3d::args::MethodName;
use warp3d::input::film::{FilmInput, FilmWords, Follower};
use warp3d::input::{DepthKind, Picture, Plane};
use warp3d::{Fill, WarpArgs};

use crate::args::{LayoutWord, Warp3dArgs};
use crate::cameras::viewpoint::Viewpoint;
use crate::process::report;
use crate::process::report::{Progress, watch};
use crate::values::input_file::{HeldPicture, HeldPictures, Source};

/// The lens of a film that says nothing of it, degrees from top to bottom: 38 mm before a picture of 36 mm by 24 mm, between the usual ones of cinema.
pub(super) const LENS: Viewpoint = Viewpoint::Fov(35.0);

/// Default surface tolerance of relative depth in a film. The noise of a network and of a film's coding makes smaller jumps within one surface. On films with truth,
/// 0.02 to 0.05 have the error of the automatic tolerance, or up to 0.7 dB less, in half of its time.
const TOLERANCE: f32 = 0.03;

/// Returns true if both eyes of a pair are drawn from one picture alone, which they share their rows with.
fn is_pair(args: &Warp3dArgs) -> bool {
    let (cameras, views) = (&args.cameras, &args.views);
    let is_alone = cameras.to.is_none() && cameras.reference.is_empty();
    let is_plane = cameras.from != Some(Viewpoint::Equirectangular)
        && views
            .layout
            .is_none_or(|layout| layout.places().is_some() || layout == LayoutWord::Vr180);
    views.stereo.is_some() && is_alone && (is_plane || args.baseline_around().is_some())
}

/// The note on an unknown lens.
pub(super) fn unknown_lens() -> String {
    format!("note: the lens is unknown: it is taken as {LENS} (--from says another)")
}

/// Sets the defaults of a film, where nothing else was typed: relative depth, a lens, the surface tolerance, the method of a pair, and the
/// filling of holes. Pictures from memory have no film.
pub(crate) fn set_defaults(args: &mut Warp3dArgs, film: Option<&FilmInput>) -> Result<()> {
    let is_relative = film.is_none_or(FilmInput::has_ranges);
    if is_relative && args.meaning.depth_kind.is_none() {
        args.meaning.depth_kind = Some(DepthKind::Relative);
    }
    let has_lens = args.cameras.from.is_some() || args.cameras.intrinsics.is_some();
    if !has_lens && film.is_some_and(FilmInput::is_panorama) {
        args.cameras.from = Some(Viewpoint::Equirectangular);
        report::say(
            "note: the film says that it is a panorama: it is read with --from equirectangular",
        );
    } else if !has_lens {
        args.cameras.from = Some(LENS);
        report::say(&unknown_lens());
    }
    let is_around = args.cameras.from == Some(Viewpoint::Equirectangular);
    let (views, cameras) = (&args.views, &args.cameras);
    if is_around && cameras.to.is_none() && views.stereo.is_some() && views.anaglyph.is_none() {
        let layout = views.layout.unwrap_or(LayoutWord::Equirectangular);
        args.views.layout = Some(layout);
    }
    let has_surfaces = args.render.options.method != MethodName::Nearest;
    if args.meaning.kind() == DepthKind::Relative && has_surfaces && !args.render.has("tolerance") {
        let word = TOLERANCE.to_string();
        args.render.set("tolerance", word, |options| {
            options.tolerance = Some(TOLERANCE)
        });
    }
    if is_pair(args) && !args.render.has("method") {
        let rows = |options: &mut WarpArgs| options.method = MethodName::Rows;
        args.render.set("method", "rows".to_owned(), rows);
    }
    if !args.render.has("fill") {
        let word = "film".to_owned();
        args.render
            .set("fill", word, |options| options.fill = Fill::Film);
    }
    Ok(())
}

/// The film that the words name; `None` where they name none. Looks it through.
pub(crate) fn find(args: &Warp3dArgs, progress: Progress) -> Result<Option<FilmInput>> {
    let words = FilmWords {
        colour: &args.colour,
        depth: &args.depth,
        fps: args.sequence.fps,
        cuts: args.sequence.cuts.as_deref(),
    };
    let mut follower = Follower {
        note: &mut report::say,
        progress: &mut watch("looking through the film", progress),
    };
    Ok(FilmInput::find(&words, &mut follower)?)
}

/// A picture of a film's size without pixels, for what needs no more.
pub(crate) fn blank(film: &FilmInput) -> Result<Source<HeldPictures>> {
    let [width, height] = film.size()?.map(|side| side as usize);
    let colour = Picture {
        width,
        height,
        rgb: Vec::new(),
        coverage: None,
    };
    let depth = Plane {
        width,
        height,
        values: Vec::new(),
        stored: Stored::Float,
    };
    Ok(held((colour, depth)))
}

/// A picture of a film with its depth, as a source.
pub(crate) fn held((colour, depth): (Picture, Plane)) -> Source<HeldPictures> {
    Source::Memory(Arc::new(HeldPictures(vec![HeldPicture { colour, depth }])))
}
