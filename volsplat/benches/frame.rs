//! How long a whole frame takes at default settings: the Engine and the Aneurism in three views, 400x400 px.
//!
//! Items are visible voxels. One thread, then all. The wall time of a frame on a busy machine says little: compare
//! the column of the fastest frame, and for CPU time take `project.rs` or the stats file.

mod subject;
mod view;

use divan::Bencher;
use divan::counter::ItemsCount;
use rayon::ThreadPoolBuilder;
use volsplat::{RenderOptions, Renderer};

use subject::Subject;
use view::View;

fn main() {
    subject::announce();
    divan::Divan::default()
        .max_time(std::time::Duration::from_millis(1200))
        .config_with_args()
        .main();
}

#[divan::bench(args = View::ALL)]
fn engine_1_thread(bencher: Bencher, view: View) {
    frame(bencher, &subject::engine(), view, 1);
}

#[divan::bench(args = View::ALL)]
fn engine_all_threads(bencher: Bencher, view: View) {
    frame(bencher, &subject::engine(), view, 0);
}

#[divan::bench(args = View::ALL)]
fn aneurism_1_thread(bencher: Bencher, view: View) {
    frame(bencher, &subject::aneurism(), view, 1);
}

#[divan::bench(args = View::ALL)]
fn aneurism_all_threads(bencher: Bencher, view: View) {
    frame(bencher, &subject::aneurism(), view, 0);
}

/// `threads` of 0 is all.
fn frame(bencher: Bencher, subject: &Subject, view: View, threads: usize) {
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads can be started");
    let camera = view::camera(&subject.volume, view);
    let options = RenderOptions::paper();
    let mut renderer =
        Renderer::new(&subject.volume, &subject.transfer, &options).expect("default options");
    bencher
        .counter(ItemsCount::new(renderer.non_transparent()))
        .bench_local(|| {
            pool.install(|| renderer.render(&camera))
                .expect("a valid camera")
        });
}
