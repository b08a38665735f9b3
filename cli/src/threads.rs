//! The threads that draw.

use anyhow::{Context, Result};

use crate::args::GlobalArgs;

/// Starts as many threads as were asked for; all processors have one if none were.
pub(crate) fn start(args: &GlobalArgs) -> Result<()> {
    let Some(threads) = args.threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads))
        .build_global()
        .with_context(|| format!("--threads {threads}: cannot start that many"))
}
