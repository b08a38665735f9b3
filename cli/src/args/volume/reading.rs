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
    /// is first unpacked into a temporary file in the folder TMPDIR. What cannot be read in parts is refused. A small file
    /// that unpacks to 500 times its size, or names the same data again and again, is only read with this option.
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
