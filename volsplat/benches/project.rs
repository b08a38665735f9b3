//! How much CPU time each stage of a frame takes per visible voxel, projection first.
//!
//! Projection is private to the crate, so this takes the renderer's own clocks in place of a harness: the frame with
//! the least CPU time of several, on one thread. CPU time holds on a machine that other work shares. Prints a table.
//! Without `--bench`, as under `cargo test`, one frame of each view is rendered.

mod subject;
mod view;

use rayon::ThreadPoolBuilder;
use volsplat::{FrameStats, RenderOptions, Renderer};

use subject::Subject;
use view::View;

/// Frames per view: the least of eleven is stable to some percent on a shared machine.
const FRAMES: usize = 11;

fn main() {
    subject::announce();
    let frames = if std::env::args().any(|argument| argument == "--bench") {
        FRAMES
    } else {
        1
    };
    for (name, subject) in [
        ("engine", subject::engine()),
        ("aneurism", subject::aneurism()),
    ] {
        println!("{name}: CPU ns per visible voxel\n");
        println!("| view | project | bin | sort | composite | frame | splats | points |");
        println!("|---|---|---|---|---|---|---|---|");
        for view in View::ALL {
            row(view, &least(&subject, view, frames));
        }
        println!();
    }
}

fn row(view: View, stats: &FrameStats) {
    let visible = (stats.points + stats.splats + stats.culled + stats.hidden) as f64;
    let ns = |cpu_ms: f64| 1e6 * cpu_ms / visible;
    let stages = &stats.stages;
    println!(
        "| {view:?} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {} | {} |",
        ns(stages.project.cpu_ms),
        ns(stages.bin.cpu_ms),
        ns(stages.sort.cpu_ms),
        ns(stages.composite.cpu_ms),
        ns(stats.cpu_ms),
        stats.splats,
        stats.points
    );
}

/// The cost of the frame with the least CPU time.
fn least(subject: &Subject, view: View, frames: usize) -> FrameStats {
    let pool = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread can be started");
    let camera = view::camera(&subject.volume, view);
    let options = RenderOptions::paper();
    let mut renderer =
        Renderer::new(&subject.volume, &subject.transfer, &options).expect("default options");
    let stats = (0..frames).map(|_| {
        pool.install(|| renderer.render(&camera))
            .expect("a valid camera")
            .stats
    });
    stats
        .min_by(|a, b| a.cpu_ms.total_cmp(&b.cpu_ms))
        .expect("at least one frame")
}
