//! Chooses the channels of a file that are drawn: those that were typed, by number or name, or all that the file shows.
//!
//! Takes the arguments and the axes of the file, returns the channels; none where the file is one scalar a voxel and nobody typed one.

use anyhow::{Context, Result, bail};
use volsplat::LoadOptions;
use volsplat::input::ImageAxes;

use crate::args::{ComponentLook, VolsplatArgs};
use crate::look::file_channel::{FileChannel, Place};
use crate::look::transfer::is_typed;

/// Most channels that are drawn where nobody chose: as many as there are usual colours.
const MOST_CHANNELS: usize = 7;

/// The channels that are drawn.
///
/// # Errors
/// Channels that are not there, and options for one transfer function where there are several channels.
pub(crate) fn drawn(
    args: &VolsplatArgs,
    options: &LoadOptions,
    axes: &ImageAxes,
) -> Result<Vec<FileChannel>> {
    let typed = &args.scene.channels.components;
    if !typed.is_empty() {
        let channel = |(place, look): (usize, &ComponentLook)| {
            let number = axes
                .number_of(&look.channel)
                .map_err(anyhow::Error::msg)
                .with_context(|| format!("{}: --channel {}", args.input, look.channel))?;
            // The components of a vector are counted where they were typed.
            let counted = match axes.channels.len() {
                1 => Place {
                    number: place,
                    count: typed.len(),
                },
                count => Place { number, count },
            };
            Ok(FileChannel {
                number,
                place: counted,
                typed: Some(place),
                is_of_image: axes.channels.len() > 1,
                known: axes.channels.get(number).cloned().unwrap_or_default(),
            })
        };
        return typed.iter().enumerate().map(channel).collect();
    }
    let count = axes.channels.len();
    if count == 1 || options.component.is_some() {
        return Ok(Vec::new());
    }
    if is_for_one(args) {
        bail!(
            "{}: the file has {count} channels ({}): a transfer function, labels or an isosurface take one of them: \
             {}#component=N; --channel N:COLOUR gives each a look of its own",
            args.input,
            axes.numbered_names(),
            args.input.path.display()
        );
    }
    let shown: Vec<usize> = (0..count)
        .filter(|&number| axes.channels[number].is_shown)
        .collect();
    // A file that shows nothing has nothing to say.
    let all = if shown.is_empty() {
        (0..count).collect()
    } else {
        shown
    };
    let left = count - all.len().min(MOST_CHANNELS);
    if left > 0 {
        options.gate.remark(format!(
            "{}: {left} of {count} channels ({}) are left out; --channel NAME or --channel N draws them",
            args.input,
            axes.numbered_names()
        ));
    }
    let channel = |number: usize| FileChannel {
        number,
        place: Place { number, count },
        typed: None,
        is_of_image: true,
        known: axes.channels[number].clone(),
    };
    Ok(all.into_iter().take(MOST_CHANNELS).map(channel).collect())
}

/// Returns true if an option takes a single channel.
fn is_for_one(args: &VolsplatArgs) -> bool {
    args.scene.labels
        || is_typed(&args.transfer)
        || args.transfer.show_transfer.is_some()
        || args.render.options.blend.iso.is_some()
}
