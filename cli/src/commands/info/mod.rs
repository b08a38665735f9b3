//! `resample info`: what a file holds and which command draws it, for people or as JSON.
//!
//! The content decides whether that is a volume, a mesh or a picture. It all goes to stdout, because it is the result of
//! the command.

mod mesh;
mod picture;
mod volume;
mod words;

use anyhow::Result;
use serde_json::json;

use crate::args::InfoArgs;
use crate::content::Content;
use crate::report;
use crate::typed;

/// Describes the file.
pub(crate) fn run(args: &InfoArgs) -> Result<()> {
    let is_headerless = args.volume.dims.is_some();
    let content = Content::of(&args.input.path).ok();
    let name = args.input.path.to_string_lossy().into_owned();
    let commands = |words: &[&[&str]]| -> Vec<String> {
        let line =
            |words: &&[&str]| typed::line(&words.iter().map(|&w| w.to_owned()).collect::<Vec<_>>());
        words.iter().map(line).collect()
    };
    let by_volsplat: &[&str] = &["volsplat", &name, "-o", "picture.png"];
    let by_warp: &[&str] = &[
        "warp3d",
        "PICTURE",
        &name,
        "--from",
        "CAM",
        "--to",
        "CAM",
        "-o",
        "picture.png",
    ];
    let ((lines, mut facts), drawn) = match content.filter(|_| !is_headerless) {
        Some(Content::Mesh) => (
            mesh::facts(args)?,
            commands(&[&["texmap", &name, "-o", "picture.png"]]),
        ),
        Some(Content::Picture) => {
            let facts = picture::facts(args)?;
            let as_colour: &[&str] = &[
                "warp3d",
                &name,
                "DEPTH",
                "--from",
                "CAM",
                "--to",
                "CAM",
                "-o",
                "picture.png",
            ];
            let drawn = if facts.1["colour"] == true {
                as_colour
            } else {
                by_warp
            };
            (facts, commands(&[drawn]))
        }
        Some(Content::PictureAndDepth) => {
            let words = [
                "warp3d",
                &name,
                &name,
                "--from",
                "CAM",
                "--to",
                "CAM",
                "-o",
                "picture.png",
            ];
            (picture::facts(args)?, commands(&[&words]))
        }
        Some(Content::Plane) => (picture::facts(args)?, commands(&[by_warp, by_volsplat])),
        Some(Content::Volume | Content::Unknown) | None => {
            (volume::facts(args)?, commands(&[by_volsplat]))
        }
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
