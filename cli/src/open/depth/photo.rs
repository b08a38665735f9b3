//! The defaults of a photograph: its lens, and the filling of holes.

use anyhow::Result;
use resample_io::{Part, colour};
use warp3d::Fill;
use warp3d::input::DepthKind;

use crate::args::Warp3dArgs;
use crate::cameras::viewpoint::Viewpoint;
use crate::open::depth::film;
use crate::process::report;

/// Sets the lens of a photograph, and the filling of holes for relative depth, where they were not typed.
pub(crate) fn set_defaults(args: &mut Warp3dArgs) -> Result<()> {
    set_lens(args)?;
    if args.meaning.kind() == DepthKind::Relative && !args.render.has("fill") {
        let word = "background".to_owned();
        args.render
            .set("fill", word, |options| options.fill = Fill::Background);
        report::say(
            "note: holes are filled with the background beside them (--fill none leaves them open)",
        );
    }
    Ok(())
}

/// The lens with which the viewer shows a picture whose camera was not typed: depth with a unit has that of films, too.
pub(crate) fn lens_of_view(args: &Warp3dArgs) -> Viewpoint {
    let exif = lens_of_exif(args);
    exif.ok().flatten().unwrap_or(film::LENS)
}

/// The lens of a photograph by its EXIF data, to a tenth of a degree.
fn lens_of_exif(args: &Warp3dArgs) -> Result<Option<Viewpoint>> {
    if args.source.held().is_some() {
        return Ok(None);
    }
    let degrees = colour::fov_y_deg(&Part::from_text(&args.colour))?;
    Ok(degrees.map(|degrees| Viewpoint::Fov((10.0 * degrees).round() / 10.0)))
}

/// Sets the lens from the photograph's EXIF data; without those, relative depth gets the lens of films.
fn set_lens(args: &mut Warp3dArgs) -> Result<()> {
    let cameras = &args.cameras;
    let is_typed = cameras.from.is_some() || cameras.intrinsics.is_some();
    if is_typed || !cameras.reference.is_empty() {
        return Ok(());
    }
    if let Some(lens) = lens_of_exif(args)? {
        report::say(&format!(
            "note: {}: the lens is that of its EXIF data, {lens} (--from says another)",
            args.colour
        ));
        args.cameras.from = Some(lens);
    } else if args.meaning.kind() == DepthKind::Relative {
        args.cameras.from = Some(film::LENS);
        report::say(&film::unknown_lens());
    }
    Ok(())
}
