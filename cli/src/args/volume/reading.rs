//! Rules of reading files, as typed.

use clap::Args;
use resample_io::{Gate, Outside};

use crate::values;

/// Rules of reading files.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Reading")]
pub struct ReadingArgs {
    /// Most memory to work in, such as 4G or 512M [default: three quarters of what this machine or its control group has]
    ///
    /// A raw volume, or NRRD or MetaImage data that is not packed, is read brick by brick where it does not fit; a Zarr array
    /// is first unpacked into a temporary file in the folder TMPDIR. Files that cannot be read in parts are refused.
    /// Without this option, files that expand more than 500-fold or refer to the same data repeatedly are refused.
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    /// Follow names inside files out of the folder of the file that is typed
    #[arg(long)]
    pub allow_outside: bool,
}

impl ReadingArgs {
    /// The gate that lets this through.
    pub(crate) fn gate(&self) -> Gate {
        let outside = if self.allow_outside {
            Outside::Allowed
        } else {
            Outside::Refused
        };
        Gate::new(outside, self.max_memory)
    }
}
