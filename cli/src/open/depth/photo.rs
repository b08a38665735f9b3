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

/// Sets the lens from the photograph's EXIF data; without those, relative depth gets the lens of films.
fn set_lens(args: &mut Warp3dArgs) -> Result<()> {
    let cameras = &args.cameras;
    let is_typed = cameras.from.is_some() || cameras.intrinsics.is_some();
    if is_typed || !cameras.reference.is_empty() {
        return Ok(());
    }
    let fov_y_deg = match args.source.held() {
        Some(_) => None,
        None => colour::fov_y_deg(&Part::from_text(&args.colour))?,
    };
    if let Some(degrees) = fov_y_deg {
        let degrees = (10.0 * degrees).round() / 10.0;
        args.cameras.from = Some(Viewpoint::Fov(degrees));
        report::say(&format!(
            "note: {}: the lens is that of its EXIF data, fov:{degrees} (--from says another)",
            args.colour
        ));
    } else if args.meaning.kind() == DepthKind::Relative {
        args.cameras.from = Some(film::LENS);
        report::say(&film::unknown_lens());
    }
    Ok(())
}
