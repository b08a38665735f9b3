//! `resample demo`: volumes, a mesh and a depth image, all made of formulas, as pictures on one page.
//!
//! 1. the scenes are written as files that any command can read (`scenes`);
//! 2. each is drawn twice, as the command line draws it and the quick way that most programs go, and both are held against
//!    a reference (`drawn`);
//! 3. a page shows the pictures, their errors, and the commands that draw them again (`page`).

mod drawn;
mod page;
mod scenes;

use std::time::Instant;

use anyhow::Result;

use crate::args::DemoArgs;
use crate::output;
use crate::process::report;
use crate::process::report::Verbosity;

/// Writes files, pictures and the page, and says where it is.
pub(crate) fn run(args: &DemoArgs, verbosity: Verbosity) -> Result<()> {
    let start = Instant::now();
    let folder = &args.output;
    output::make_folder(folder)?;
    let page = folder.join("index.html");
    output::check_writable(&page)?;
    let mut shown = Vec::new();
    for scene in scenes::all(folder)? {
        let scene = drawn::shown(scene, folder, args.size)?;
        if verbosity == Verbosity::Verbose {
            report::say(&format!("{}: {:.0} ms", scene.title, scene.draw_ms));
        }
        shown.push(scene);
    }
    output::write_text(&page, &page::html(&shown))?;
    if verbosity != Verbosity::Quiet {
        report::say(&format!(
            "wrote {} pictures and {} in {:.1} s",
            2 * shown.len(),
            page.display(),
            start.elapsed().as_secs_f64()
        ));
    }
    Ok(())
}
