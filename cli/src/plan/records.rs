//! The requested cameras and picture, as the stats file records them.

use serde_json::{Value, json};

use super::request::Request;
use crate::cameras::framing;
use crate::cameras::framing::Stance;
use crate::output;
use crate::output::{Depth, Format};
use crate::process::report;
use crate::values::BackgroundWord;

/// The cameras in the stats file.
pub(crate) fn camera_record(request: &Request, stance: Stance) -> Value {
    let args = request.camera;
    let orbit = args.orbit.unwrap_or(framing::DEFAULT_ORBIT);
    match &args.camera {
        Some(file) => json!({ "file": report::name(file) }),
        None => json!({
            "turntable": request.sequence.turntable,
            "azimuth_deg": orbit.azimuth_deg,
            "elevation_deg": orbit.elevation_deg,
            "distance": orbit.distance,
            "fov_y_deg": args.fov,
            "up": stance.up.to_array(),
            "projection": args.projection,
        }),
    }
}

/// The picture in the stats file.
pub(crate) fn picture_record(request: &Request, format: Format) -> Value {
    let bits = match format {
        Format::Png(Depth::Eight) | Format::Jpeg(_) => Some(8),
        Format::Png(Depth::Sixteen) => Some(16),
        Format::Exr => None,
    };
    // The name has been checked by now.
    let film = output::kind_of(request.output, None, request.sequence.original.is_some())
        .ok()
        .flatten();
    let (colour, file) = match &request.picture.background {
        Some(BackgroundWord::Colour(colour)) => (Some(colour), None),
        Some(BackgroundWord::File(path)) => (None, Some(path)),
        Some(BackgroundWord::Transparent) | None => (None, None),
    };
    json!({
        "output": report::name(request.output),
        "bits": bits,
        "background_linear": colour,
        "background_file": file.map(|file| report::name(file)),
        "fps": film.map(|_| request.sequence.rate().per_second()),
    })
}
