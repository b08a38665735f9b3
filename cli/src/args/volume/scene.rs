//! Options of further channels, labels and masks; see `args.rs`.
//!
//! A look is one word: a transfer function file, a colour map, a colour, or `labels`. Its meaning for a volume is decided
//! when the volume is there (`scene.rs`).

use std::path::PathBuf;

use clap::Args;

/// Channels, labels and masks.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Channels, labels, masks")]
pub struct SceneArgs {
    /// Mask volume of the same dimensions: samples whose nearest mask voxel is 0 are hidden
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// The values are labels: never interpolated, each with a colour of its own; 0 is not drawn
    #[arg(long, conflicts_with_all = ["transfer", "window", "preset", "colormap", "show_transfer"])]
    pub labels: bool,
    /// Colours and opacities of labels: a label file of ITK-SNAP, CSV, or JSON; labels that it does not list are not drawn
    #[arg(long, alias = "label-colors", value_name = "FILE")]
    pub label_colours: Option<PathBuf>,
    /// Draw component N of the file with LOOK: a transfer function (.json), a colour map, a colour such as green or
    /// #ff8000, or labels; once for each component that is drawn
    #[arg(long, num_args = 2, value_names = ["N", "LOOK"],
        conflicts_with_all = ["labels", "transfer", "window", "preset", "colormap", "show_transfer"])]
    pub channel: Vec<String>,
    /// Also draw this volume (FILE or FILE#PART), on the same grid, with LOOK as in --channel; may be given several times
    #[arg(long, num_args = 2, value_names = ["FILE", "LOOK"])]
    pub also: Vec<String>,
}
