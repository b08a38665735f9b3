//! Everything that decided the pictures of a volume, for the `settings` object of the stats file.

use serde_json::{Value, json};
use volsplat::transfer::{ColourMap, DataKind};
use volsplat::{Described, FrameStats};

use crate::args::{TransferArgs, VolsplatArgs};
use crate::cameras::framing;
use crate::look::{Look, transfer};
use crate::open::volume::scene;
use crate::output::Format;
use crate::plan;
use crate::plan::Request;
use crate::process::report;

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &VolsplatArgs,
    request: &Request,
    format: Format,
    look: &Look,
    volume: &dyn Described,
) -> Value {
    let stance = framing::volume::stance(volume, args.camera.up.map(|axis| axis.direction));
    json!({
        "volume": volume_record(args, volume),
        "transfer": transfer_record(&args.transfer, look, volume),
        "scene": scene::record(&args.scene),
        "camera": plan::camera_record(request, stance),
        "render": look.options,
        "picture": plan::picture_record(request, format),
    })
}

fn volume_record(args: &VolsplatArgs, volume: &dyn Described) -> Value {
    let lattice = volume.lattice();
    json!({
        "file": report::name(&args.input.path),
        "part": args.input.part,
        "dims": lattice.dims,
        "spacing": lattice.spacing(),
        "origin": lattice.world_from_index.translation.to_array(),
        "space": lattice.space,
        "raw_type": args.volume.voxel_type.map(|kind| kind.name()),
        "raw_endian": args.volume.endian.map(|endian| format!("{endian:?}").to_lowercase()),
        "raw_skip_bytes": args.volume.skip,
        "nan_as": args.volume.nan_as,
        "max_memory_bytes": args.volume.reading.max_memory,
        "rescaled_by": args.volume.rescale_values,
    })
}

/// The transfer function's part of the settings in the stats file.
fn transfer_record(args: &TransferArgs, look: &Look, volume: &dyn Described) -> Value {
    let kind = look.suggested.kind;
    let opacity_unit = look.options.opacity_unit;
    json!({
        "file": args.transfer.as_deref().map(report::name),
        "space": args.transfer_space,
        "rescaled": args.rescale_transfer,
        "window": args.window.map(|window| [window.level, window.width]),
        "preset": args.preset.map(|preset| preset.name()),
        "colormap": colour_map(args, kind).map(|map| map.name()),
        "taken_for": kind.map(transfer::name),
        "shown_in": args.show_transfer.as_deref().map(report::name),
        "opacity_scale": args.opacity_scale,
        "opacity_unit": opacity_unit.unwrap_or_else(|| volume.lattice().smallest_spacing()),
    })
}

/// The named colour map that is used, if one is.
fn colour_map(args: &TransferArgs, kind: Option<DataKind>) -> Option<ColourMap> {
    let is_mapped = matches!(kind, None | Some(DataKind::Field));
    if args.transfer.is_some() || args.preset.is_some() || !is_mapped {
        return None;
    }
    Some(args.colormap.unwrap_or_default())
}

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
        let [from, to] = volume.lattice().bounds_in_world().map(|corner| {
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
