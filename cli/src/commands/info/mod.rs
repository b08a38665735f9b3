//! `resample info` describes a file and names the command that draws it, as text or JSON.
//!
//! The content decides whether that is a volume, Gaussians, a mesh, a scan or a picture. It all goes to stdout, because it is the result of
//! the command.

mod gaussians;
mod mesh;
mod picture;
mod points;
mod volume;
mod words;

use anyhow::Result;
use serde_json::json;

use crate::args::InfoArgs;
use crate::args::words::content::Content;
use crate::args::words::typed;
use crate::process::report;

/// Describes the file.
pub(crate) fn run(args: &InfoArgs) -> Result<()> {
    let is_headerless = args.volume.dims.is_some();
    let content = Content::of(&args.input.path).ok();
    let name = args.input.to_string();
    let volsplat = draws(&["volsplat", &name]);
    let ((lines, mut facts), drawn) = match content.filter(|_| !is_headerless) {
        Some(Content::Points) => (points::facts(args)?, vec![draws(&["points", &name])]),
        Some(Content::Gaussians) => (gaussians::facts(args)?, vec![draws(&["gaussians", &name])]),
        Some(Content::Mesh) => (mesh::facts(args)?, vec![draws(&["texmap", &name])]),
        Some(Content::Picture) => {
            let facts = picture::facts(args)?;
            let drawn = match facts.1["colour"] == true {
                true => vec![pair(&name), warps(&name, "DEPTH")],
                false => vec![warps("PICTURE", &name)],
            };
            (facts, drawn)
        }
        Some(Content::PictureAndDepth) => (picture::facts(args)?, vec![warps(&name, &name)]),
        Some(Content::Plane) => (
            picture::facts(args)?,
            vec![warps("PICTURE", &name), volsplat],
        ),
        Some(Content::Volume | Content::Unknown) | None => (volume::facts(args)?, vec![volsplat]),
    };
    if args.json {
        facts["path"] = json!(args.input.path.display().to_string());
        facts["commands"] = json!(drawn);
        return report::print(&format!("{}\n", serde_json::to_string_pretty(&facts)?));
    }
    let drawn = drawn
        .into_iter()
        .enumerate()
        .map(|(number, text)| (if number == 0 { "draw" } else { "" }, text));
    let lines: String = lines
        .into_iter()
        .chain(drawn)
        .map(|(name, text)| format!("  {name:<10} {text}\n"))
        .collect();
    report::print(&format!("{}\n{lines}", args.input.path.display()))
}

/// A command that draws, as it is typed.
fn draws(words: &[&str]) -> String {
    let words = words.iter().chain(&["-o", "picture.png"]);
    typed::line(&words.map(|&word| word.to_owned()).collect::<Vec<_>>())
}

/// The command that makes a pair of views from a photograph and the depth map of a network.
fn pair(colour: &str) -> String {
    draws(&[
        "warp3d",
        colour,
        "DEPTH",
        "--depth-kind",
        "relative",
        "--stereo",
        "0.06",
    ])
}

/// The command that shows a picture with its depth from another camera.
fn warps(colour: &str, depth: &str) -> String {
    draws(&["warp3d", colour, depth, "--from", "CAM", "--to", "CAM"])
}
