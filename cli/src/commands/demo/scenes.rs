//! The scenes of the demo: files in its folder, and the words of the commands that draw them.

use std::path::Path;

use anyhow::Result;
use serde_json::Value;

use crate::args::SceneArg;
use crate::commands::built_in;
use crate::commands::built_in::{DEPTH_IMAGE_FOV_Y_DEG, NEW_EYE};
use crate::output;

/// A scene, and the command that draws it.
pub(super) struct DemoScene {
    /// Name of its picture, without the ending.
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// The difficulty of the scene, in a sentence.
    pub(super) about: &'static str,
    /// Words of the command, without the picture's name.
    pub(super) words: Vec<String>,
    /// Words that make it draw the quick way.
    pub(super) quick: &'static [&'static str],
    /// The quick way, in words.
    pub(super) quick_title: &'static str,
    /// Where the error is measured against.
    pub(super) truth: Truth,
}

/// The picture that others are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Truth {
    /// The most exact setting.
    MostExact,
    /// The scene of the depth image, traced from the new eye.
    Traced,
}

/// Knots of a transfer function: value and display colour, value and opacity. By hand, for looks only.
struct Function {
    colours: &'static [(f64, [f64; 3])],
    opacities: &'static [(f64, f64)],
}

const RIPPLES: Function = Function {
    colours: &[
        (0.0, [0.1, 0.15, 0.42]),
        (0.1, [0.15, 0.58, 0.66]),
        (0.2, [0.95, 0.88, 0.58]),
        (0.5, [0.9, 0.48, 0.25]),
        (1.0, [0.54, 0.15, 0.35]),
    ],
    opacities: &[(0.0, 0.3), (0.1, 0.3), (0.2, 0.9)],
};

const BLOBS: Function = Function {
    colours: &[
        (0.0, [0.25, 0.35, 0.74]),
        (1.0, [0.8, 0.35, 0.66]),
        (1.6, [1.0, 0.66, 0.25]),
        (2.2, [1.0, 0.95, 0.74]),
    ],
    opacities: &[
        (0.1, 0.0),
        (0.6, 0.015),
        (1.4, 0.04),
        (1.8, 0.3),
        (2.4, 0.8),
    ],
};

/// Writes all scenes into the folder.
pub(super) fn all(folder: &Path) -> Result<Vec<DemoScene>> {
    let volume = |scene, function: Option<Function>, orbit: &str| -> Result<Vec<String>> {
        let args = built_in::volume(scene, folder)?;
        if let (Some(function), Some(path)) = (function, &args.transfer.transfer) {
            let map: Value = built_in::map(function.colours, function.opacities);
            output::write_text(path, &serde_json::to_string_pretty(&map)?)?;
        }
        let start = ["volsplat".to_owned()].into_iter();
        let view = ["--orbit".to_owned(), orbit.to_owned()];
        Ok(start.chain(built_in::words(&args)).chain(view).collect())
    };
    let one_ray = "one ray a pixel";
    Ok(vec![
        DemoScene {
            name: "marschner-lobb",
            title: "Ripples",
            about: "A field that is as fine as its voxels: what is interpolated badly shows as broken rings.",
            words: volume(SceneArg::MarschnerLobb, Some(RIPPLES), "25,25")?,
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        DemoScene {
            name: "blobs",
            title: "Soft matter",
            about: "Translucent matter that hides itself, with nothing sharp but its insides.",
            words: volume(SceneArg::Blobs, Some(BLOBS), "15,20,0.75")?,
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        DemoScene {
            name: "checker-box",
            title: "A box of opaque cells",
            about: "Edges everywhere: between cells, against the background, and along the rays.",
            words: volume(SceneArg::CheckerBox, None, "35,25")?,
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        mesh(folder)?,
        depth_image(folder)?,
    ])
}

fn mesh(folder: &Path) -> Result<DemoScene> {
    let args = built_in::mesh(folder)?;
    let texture = args.model.texture.unwrap_or_default();
    let words = format!(
        "texmap {} --texture {} --orbit 20,9,0.45",
        args.input.path.display(),
        texture.display()
    );
    Ok(DemoScene {
        name: "ball-on-ground",
        title: "A chequered ground",
        about: "Towards the horizon thousands of texels fall into a pixel: look-ups of a few of them make moire.",
        words: words.split(' ').map(str::to_owned).collect(),
        quick: &["--method", "backward-bilinear", "--subpixels", "1"],
        quick_title: "a bilinear look-up a pixel",
        truth: Truth::MostExact,
    })
}

fn depth_image(folder: &Path) -> Result<DemoScene> {
    let args = built_in::depth_image(folder)?;
    let shift = NEW_EYE.to_array().map(|x| x.to_string()).join(",");
    let words = format!(
        "warp3d {} {} --from fov:{DEPTH_IMAGE_FOV_Y_DEG} --to shift:{shift}",
        args.colour, args.depth
    );
    Ok(DemoScene {
        name: "ball-before-wall",
        title: "A picture with depth, seen from beside",
        about: "The ball uncovers a part of the wall that no pixel has seen; all else should be whole.",
        words: words.split(' ').map(str::to_owned).collect(),
        quick: &["--method", "nearest"],
        quick_title: "each pixel to its nearest place",
        truth: Truth::Traced,
    })
}
