//! `resample bench extremes`: pictures at the ends of what numbers hold, against slow references in f64.
//!
//! Every row draws a small scene with the renderer and compares it with its definition, evaluated in f64 ([`twin`]) or
//! known in closed form. A row that is beyond its bound makes the command fail.

mod cameras;
mod fields;
mod meshes;
mod row;
mod sums;
mod twin;
mod voxels;
mod warps;

use anyhow::Result;

use crate::args::BenchExtremesArgs;
use crate::commands::compare::TooFar;
use crate::process::{machine, report};

/// Draws every extreme and prints the table; an error where a row is beyond its bound.
pub(super) fn run(args: &BenchExtremesArgs) -> Result<()> {
    let share = usize::from(args.share);
    let mut rows = voxels::rows()?;
    rows.extend(cameras::rows()?);
    rows.extend(fields::rows()?);
    rows.extend(sums::rows(share)?);
    rows.extend(meshes::rows()?);
    rows.extend(warps::rows()?);
    let mut text = format!(
        "{}\nRows of many samples have 1/{share} of them. A picture's row is its worst pixel.\n\n\
         | quantity | extreme | drawn in f32 | true, f64 | error | bound | why it holds |\n|---|---|---|---|---|---|---|\n",
        machine::heading()
    );
    rows.iter().for_each(|row| text += &row.line());
    let beyond = rows.iter().filter(|row| !row.holds()).count();
    text += &format!("\n{} rows, {beyond} beyond their bounds\n", rows.len());
    report::print(&text)?;
    if beyond > 0 {
        let what = format!(
            "{beyond} of {} extremes are beyond their bounds",
            rows.len()
        );
        return Err(TooFar { what }.into());
    }
    Ok(())
}
