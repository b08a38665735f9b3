//! CPU time of a warped frame on rendered, real, noisy and holey depth, beside simple warpers in plain C, as a table.
//!
//! `cargo run --release -p resample-tests --example warp_speed [-- FRAMES [SCENE..]]`, with `WARP_PEER` set to the program of the
//! simple warpers if there is one; it is called as `PEER JOB OUT MODE FRAMES BUDGET_MS 1`. Everything runs on one thread, and a
//! time is the least process-CPU time of the frames, ms; *two threads* is by how much less wall time a frame takes there.
//! Scenes whose data is absent are left out.

use std::io::Write;
use std::process::Command;
use std::time::Instant;

use glam::DVec3;
use resample_core::Camera;
use resample_tests::warps::pairs::pair;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::truth::WarpScene;
use serde_json::Value;
use warp3d::{Method, Reference, WarpOptions, Warper};

/// Timed frames if none are asked for.
const FRAMES: usize = 7;

/// What skip lines call this program.
const PROGRAM: &str = "warp_speed";

/// The simple warpers: each sample to its pixel, and depth forward with colour backward by a cubic.
const PEERS: [&str; 2] = ["mcm", "hyb_cub"];

/// A view to be warped.
struct Case {
    name: &'static str,
    reference: Reference,
    target: Camera,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let frames = arguments.first().and_then(|a| a.parse().ok());
    let wanted = |name: &str| {
        let names = arguments.get(1..).unwrap_or_default();
        names.is_empty() || names.iter().any(|n| n == name)
    };
    println!(
        "| scene | plain loop | nearest | forward-backward | hybrid | hybrid / forward-backward | nearest / loop | prepare | project | accumulate | resolve | edge pixels | two threads |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for name in NAMES.into_iter().filter(|name| wanted(name)) {
        if let Some(case) = case(name) {
            print_case(&case, frames.unwrap_or(FRAMES));
        }
    }
}

/// The cases.
const NAMES: [&str; 9] = [
    "stereo",
    "room-hd",
    "Cones",
    "livingroom",
    "stereo-noise",
    "stereo-missing",
    "livingroom-missing",
    "magnify4",
    "huge",
];

fn case(name: &'static str) -> Option<Case> {
    let of = |scene: WarpScene| Case {
        name,
        reference: scene.reference,
        target: scene.target,
    };
    let room = |size: [u32; 2], focal_px: f64, to: [u32; 2], to_focal_px: f64| Case {
        name,
        reference: AnalyticScene::room().reference(&camera(size, focal_px, DVec3::ZERO, 0.0)),
        target: camera(to, to_focal_px, DVec3::X * 0.25, 0.0),
    };
    match name {
        "room-hd" => Some(room([1920, 1080], 1560.0, [1920, 1080], 1560.0)),
        "huge" => Some(room([64, 48], 52.0, [8000, 6000], 6500.0)),
        "Cones" | "livingroom" => pair(PROGRAM, name).map(of),
        _ => {
            let (base, change) = name.split_once('-').unwrap_or((name, ""));
            let scene = match base {
                "livingroom" => pair(PROGRAM, base),
                _ => WarpScene::load(PROGRAM, base),
            };
            let mut case = of(scene?);
            roughen(&mut case.reference.depth, change);
            Some(case)
        }
    }
}

/// Two hundredths of Gaussian noise, or every tenth sample unknown.
fn roughen(depth: &mut [f32], change: &str) {
    let mut state = 1u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for z in depth {
        match change {
            // Twelve uniform numbers have variance 1.
            "noise" => *z *= 1.0 + 0.02 * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0),
            "missing" if uniform() < 0.1 => *z = f32::NAN,
            _ => {}
        }
    }
}

fn print_case(case: &Case, frames: usize) {
    let peers = PEERS.map(|mode| peer(case, mode, frames));
    let of = |options: &WarpOptions| on_threads(1, || timed(case, options, frames));
    let nearest = of(&WarpOptions::with_method(Method::NEAREST));
    let hybrid = of(&WarpOptions::default());
    let both = on_threads(2, || timed(case, &WarpOptions::default(), frames));
    let ms = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
    let ratio = |v: f64, to: Option<f64>| to.map_or("-".into(), |to| format!("{:.2}", v / to));
    println!(
        "| {} | {} | {:.2} | {} | {:.1} | {} | {} | {:.0} | {:.1} | {:.1} | {:.1} | {} | {:.2} |",
        case.name,
        ms(peers[0]),
        nearest.cpu_ms,
        ms(peers[1]),
        hybrid.cpu_ms,
        ratio(hybrid.cpu_ms, peers[1]),
        ratio(nearest.cpu_ms, peers[0]),
        hybrid.prepare_ms,
        hybrid.stages[0],
        hybrid.stages[1],
        hybrid.stages[2],
        hybrid.edge_pixels,
        hybrid.wall_ms / both.wall_ms,
    );
}

/// The cost of a frame, and of its preparation.
struct Cost {
    cpu_ms: f64,
    wall_ms: f64,
    prepare_ms: f64,
    /// Project, accumulate, resolve, CPU ms of the cheapest frame.
    stages: [f64; 3],
    edge_pixels: u64,
}

fn timed(case: &Case, options: &WarpOptions, frames: usize) -> Cost {
    let start = Instant::now();
    let mut warper = Warper::new(vec![case.reference.clone()], options).expect("a good reference");
    let mut cost = Cost {
        cpu_ms: f64::INFINITY,
        wall_ms: f64::INFINITY,
        prepare_ms: 1e3 * start.elapsed().as_secs_f64(),
        stages: [0.0; 3],
        edge_pixels: 0,
    };
    let large = case.target.width > 4000;
    for _ in 0..if large { 2 } else { frames + 1 } {
        let frame = warper.render(&case.target).expect("a camera");
        let stats = frame.stats;
        cost.wall_ms = cost.wall_ms.min(stats.wall_ms);
        if stats.cpu_ms < cost.cpu_ms {
            cost.cpu_ms = stats.cpu_ms;
            let stages = &stats.stages;
            cost.stages = [
                stages.project.cpu_ms,
                stages.accumulate.cpu_ms,
                stages.resolve.cpu_ms,
            ];
            cost.edge_pixels = stats.edge_pixels;
        }
    }
    cost
}

fn on_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(run)
}

/// The least CPU time of a simple warper; `None` without its program.
fn peer(case: &Case, mode: &str, frames: usize) -> Option<f64> {
    let program = std::env::var_os("WARP_PEER")?;
    let folder = std::env::temp_dir();
    let [job, out] =
        ["job", "out"].map(|kind| folder.join(format!("warp_speed-{}-{kind}", std::process::id())));
    std::fs::write(&job, job_bytes(case)).expect("a writable folder");
    let mut command = Command::new(program);
    command.args([&job, &out]).arg(mode);
    let done = command
        .args([&frames.to_string(), "60000", "1"])
        .output()
        .expect("the peer runs");
    for file in [job, out] {
        // A file that does not exist needs no removal.
        let _ = std::fs::remove_file(file);
    }
    let text = String::from_utf8_lossy(&done.stdout);
    let cost: Value = serde_json::from_str(text.lines().last()?).ok()?;
    cost["cpu_min_ms"].as_f64()
}

/// The job as the simple warpers read it: target, reference, the motion between them, colours, camera z (0: unknown).
fn job_bytes(case: &Case) -> Vec<u8> {
    let Case {
        reference, target, ..
    } = case;
    let mut bytes = b"WJ01".to_vec();
    let mut put = |part: &[u8]| bytes.write_all(part).expect("memory");
    put(&1i32.to_le_bytes());
    for camera in [target, &reference.camera] {
        put(&(camera.width as i32).to_le_bytes());
        put(&(camera.height as i32).to_le_bytes());
        // Their pixel centres are at whole numbers.
        for v in [camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5] {
            put(&v.to_le_bytes());
        }
    }
    let pose = target.camera_from_world * reference.camera.camera_from_world.inverse();
    let rows = pose.matrix3.transpose().to_cols_array();
    for v in rows.into_iter().chain(pose.translation.to_array()) {
        put(&v.to_le_bytes());
    }
    for v in reference.colour.as_flattened() {
        put(&v.to_le_bytes());
    }
    for &z in &reference.depth {
        put(&if z > 0.0 { z } else { 0.0 }.to_le_bytes());
    }
    bytes
}
