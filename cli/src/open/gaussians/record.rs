//! Everything that decided the pictures of Gaussians, and their times and counts, for the stats file and the terminal.

use anyhow::Result;
use serde_json::{Value, json};
use volsplat::{BlendSpace, FrameStats, GaussianFormat, GaussianOptions, Gaussians};

use crate::args::GaussiansArgs;
use crate::cameras::framing::Stance;
use crate::output::Format;
use crate::plan;
use crate::plan::Request;
use crate::process::report;
use crate::process::report::{Account, Cost};

/// The Gaussians that are drawn.
pub(super) fn scene_record(
    gaussians: &Gaussians,
    format: Option<GaussianFormat>,
    notes: &[String],
) -> Value {
    json!({
        "gaussians": gaussians.len(),
        "format": format.map(GaussianFormat::name),
        "degree": gaussians.degree(),
        "blend_space": blend_space(gaussians.blend_space),
        "bytes": gaussians.bytes(),
        "notes": notes,
    })
}

/// A blend space in a word.
pub(super) fn blend_space(space: BlendSpace) -> &'static str {
    match space {
        BlendSpace::Srgb => "srgb",
        BlendSpace::Linear => "linear",
    }
}

/// Everything that decided the pictures.
pub(super) fn record(
    args: &GaussiansArgs,
    request: &Request,
    (options, format): (&GaussianOptions, Format),
    stance: Stance,
) -> Value {
    json!({
        "gaussians": { "file": report::name(&args.input.path) },
        "camera": plan::camera_record(request, stance),
        "render": options,
        "picture": plan::picture_record(request, format),
    })
}

/// The times and the counts of a frame.
pub(super) fn account(stats: &FrameStats) -> Result<Account> {
    Ok(Account {
        keys: serde_json::to_value(stats)?,
        line: stage_line(stats),
        cost: cost(stats),
    })
}

/// The time and work of a frame, in pixels of slabs.
fn cost(stats: &FrameStats) -> Cost {
    /// The work of looking at a Gaussian: about 200 ns, where a lane of a slab takes about two. A guess from the times of the stages.
    const LOOK: f64 = 100.0;
    Cost {
        wall_ms: stats.wall_ms,
        cpu_ms: stats.cpu_ms,
        growing: stats.lanes_computed as f64,
        fixed: LOOK * (stats.splats + stats.culled) as f64,
        subpixels: 0,
    }
}

/// The times of a frame's stages and its counts, one line.
fn stage_line(stats: &FrameStats) -> String {
    let stages = &stats.stages;
    let named = [
        ("project", stages.project),
        ("composite", stages.composite),
        ("image", stages.image),
    ];
    let times: Vec<_> = named
        .iter()
        .map(|(name, time)| format!("{name} {:.1}", time.wall_ms))
        .collect();
    format!(
        "{:.1} ms wall, {:.1} ms CPU ({} ms); {} Gaussians in view, {} not, {} in tiles",
        stats.wall_ms,
        stats.cpu_ms,
        times.join(", "),
        stats.splats,
        stats.culled,
        stats.tile_pairs
    )
}
