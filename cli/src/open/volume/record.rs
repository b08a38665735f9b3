//! Everything that decided the pictures of a volume, for the `settings` object of the stats file.

use serde_json::{Value, json};
use volsplat::Described;

use crate::args::VolsplatArgs;
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
        "transfer": transfer::record(&args.transfer, look, volume),
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
