//! The options that `-h` shows, about twenty of each command; `--help` shows all, those for research under a heading of
//! their own.

use clap::Arg;

const VOLSPLAT: &[&str] = &[
    "input",
    "output",
    "dims",
    "voxel_type",
    "transfer",
    "window",
    "preset",
    "colormap",
    "labels",
    "mask",
    "camera",
    "orbit",
    "size",
    "turntable",
    "path",
    "crop",
    "shade",
    "blend",
    "iso",
    "subpixels",
    "max_error",
    "background",
];

const GAUSSIANS: &[&str] = &[
    "input",
    "output",
    "camera",
    "orbit",
    "fov",
    "up",
    "size",
    "turntable",
    "path",
    "crop",
    "clip_plane",
    "slab_error",
    "model",
    "samples",
    "layers",
    "max_error",
    "max_time_ms",
    "background",
];

const TEXMAP: &[&str] = &[
    "input",
    "output",
    "camera_name",
    "pose_time",
    "texture",
    "camera",
    "orbit",
    "fov",
    "up",
    "size",
    "turntable",
    "path",
    "method",
    "shade",
    "light",
    "subpixels",
    "max_error",
    "max_time_ms",
    "background",
];

const WARP3D: &[&str] = &[
    "colour",
    "depth",
    "output",
    "from",
    "to",
    "reference",
    "intrinsics",
    "size",
    "depth_kind",
    "depth_scale",
    "baseline",
    "stereo",
    "layout",
    "anaglyph",
    "quilt",
    "path",
    "sway",
    "method",
    "fill",
    "max_error",
    "background",
];

const POINTS: &[&str] = &[
    "input",
    "output",
    "points",
    "keep_all",
    "crop",
    "clip_plane",
    "color_by",
    "colormap",
    "color_range",
    "camera",
    "orbit",
    "fov",
    "up",
    "size",
    "turntable",
    "path",
    "shade",
    "light",
    "blend",
    "subpixels",
    "layers",
    "max_error",
    "max_time_ms",
    "background",
];

/// Heading of the options of `trade` itself.
pub(super) const MEASUREMENT: &str = "Measurement";

/// Heading of the options of the paper's methods, which the default does not use.
pub(in crate::args) const PAPER: &str = "The paper's methods";

/// Options of the paper's methods that lie among others.
const OF_PAPER: &[&str] = &["order", "cells", "opacity", "visibility"];

/// Options that no picture needs: they are there for comparison and measurement.
const RESEARCH: &[&str] = &["vector_level"];

/// As `-h` shows it for volumes.
pub(super) fn volsplat(arg: Arg) -> Arg {
    brief(arg, VOLSPLAT)
}

/// As `-h` shows it for Gaussians.
pub(super) fn gaussians(arg: Arg) -> Arg {
    brief(arg, GAUSSIANS)
}

/// As `-h` shows it for meshes.
pub(super) fn texmap(arg: Arg) -> Arg {
    brief(arg, TEXMAP)
}

/// As `-h` shows it for pictures with depth.
pub(super) fn warp3d(arg: Arg) -> Arg {
    brief(arg, WARP3D)
}

/// As `-h` shows it for scans.
pub(super) fn points(arg: Arg) -> Arg {
    brief(arg, POINTS)
}

fn brief(arg: Arg, shown: &[&str]) -> Arg {
    // The options of `trade` itself are few.
    let is_own = arg.get_help_heading() == Some(MEASUREMENT);
    let hide = !is_own && !shown.contains(&arg.get_id().as_str());
    let arg = arg.hide_short_help(hide);
    let id = arg.get_id().as_str();
    let heading = if OF_PAPER.contains(&id) {
        PAPER
    } else if RESEARCH.contains(&id) {
        "For research"
    } else {
        return arg;
    };
    arg.help_heading(heading)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    #[test]
    fn every_name_is_an_option() {
        let command = Cli::command();
        for (name, shown) in [
            ("volsplat", VOLSPLAT),
            ("gaussians", GAUSSIANS),
            ("texmap", TEXMAP),
            ("warp3d", WARP3D),
            ("points", POINTS),
        ] {
            let command = command.find_subcommand(name).expect("a command");
            let has = |id: &&&str| command.get_arguments().any(|arg| arg.get_id() == **id);
            let missing: Vec<_> = shown.iter().filter(|id| !has(id)).collect();
            assert!(missing.is_empty(), "{name} has no {missing:?}");
            assert!((15..=24).contains(&shown.len()), "about twenty");
        }
    }
}
