//! Messages: the times and counts of a frame, and the reason when a picture would show nothing.

use volsplat::{Described, FrameStats};

use crate::args::VolsplatArgs;
use crate::cameras::framing::volume::grid_bounds;

/// Why nothing of a volume is seen.
pub(crate) fn why_nothing(args: &VolsplatArgs, volume: &dyn Described) -> String {
    let name = args.input.path.display();
    let options = &args.render.options;
    let (low, high) = volume.value_range();
    if let Some(iso) = options.blend.iso.filter(|iso| !(low..=high).contains(iso)) {
        return format!("--iso {iso} is outside the values of {name}, which are {low} to {high}");
    }
    let clip = &options.clip;
    if clip.crop.is_some() || clip.crop_voxels.is_some() || !clip.clip_plane.is_empty() {
        let [from, to] = grid_bounds(volume).map(|corner| {
            let [x, y, z] = corner.to_array();
            format!("{x},{y},{z}")
        });
        return format!(
            "--crop, --crop-voxels or --clip-plane keeps nothing of {name} that can be seen: it reaches from {from} to {to}"
        );
    }
    format!(
        "the transfer function makes every voxel of {name} transparent: its values are {low} to {high}"
    )
}

/// The times of a frame's stages and its counts, one line.
pub(crate) fn stage_line(stats: &FrameStats) -> String {
    let stages = &stats.stages;
    let named = [
        ("cull", stages.cull),
        ("project", stages.project),
        ("bin", stages.bin),
        ("sort", stages.sort),
        ("composite", stages.composite),
        ("image", stages.image),
    ];
    let times: Vec<_> = named
        .iter()
        .map(|(name, time)| format!("{name} {:.1}", time.wall_ms))
        .collect();
    format!(
        "{:.1} ms wall, {:.1} ms CPU ({} ms); {} points, {} splats, {} culled; \
         bricks: {} empty, {} outside, {} hidden",
        stats.wall_ms,
        stats.cpu_ms,
        times.join(", "),
        stats.points,
        stats.splats,
        stats.culled,
        stats.bricks_empty,
        stats.bricks_outside,
        stats.bricks_hidden
    )
}
