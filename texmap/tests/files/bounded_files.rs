//! Every broken or odd mesh file of the test data, loaded and drawn in a process of its own: a finite picture or one
//! error, in bounded time and bounded memory.
//!
//! The test starts itself once more for each file, under the shell's limit on the address space, so that a flood of
//! memory ends that process and not the test. Where the data is absent, or the shell knows no such limit, it says
//! "skipped".

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use resample_core::{Camera, LookAt};
use texmap::{LoadOptions, RenderOptions, Renderer};

use crate::mesh_files::{folder, mesh_files};

/// Names the file that a child process loads.
const FILE_VARIABLE: &str = "RESAMPLE_MESH_FILE";

/// No file has more than 5 MB, and none takes a second by itself.
const TIME_LIMIT: Duration = Duration::from_secs(30);

/// Address space, kB: 1 GiB. A picture of 64 x 64 px and a few MB of mesh touch less than a tenth; the rest is what
/// threads reserve.
const MEMORY_LIMIT_KB: u64 = 1 << 20;

/// What a child process does: loads the file that the environment names, draws it, and reports the outcome.
#[test]
fn the_file_that_the_environment_names() {
    let Some(file) = std::env::var_os(FILE_VARIABLE) else {
        return;
    };
    let scene = match texmap::load(Path::new(&file), &LoadOptions::default()) {
        Ok(loaded) => loaded.scene,
        Err(error) => return println!("refused: {error}"),
    };
    let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("default options");
    let Some([low, high]) = renderer.bounds_in_world() else {
        return println!("drawn: nothing");
    };
    let (target, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let position = target + glam::DVec3::new(0.6, 0.5, 1.0).normalize() * (3.0 * radius).max(1e-6);
    let pose = LookAt {
        position,
        target,
        up: glam::DVec3::Y,
    };
    let camera = Camera::perspective(&pose, 0.7, [64, 64]).expect("a pose with a direction");
    let image = renderer.render(&camera).expect("a valid camera").image;
    assert!(
        image.rgba.iter().flatten().all(|v| v.is_finite()),
        "a picture that is not finite"
    );
    println!("drawn: {radius}");
}

/// Runs the test above on a file within the limits; what it said.
fn within_limits(file: &Path) -> String {
    let own = std::env::current_exe().expect("the test's own program");
    let limited = format!("ulimit -v {MEMORY_LIMIT_KB}; exec \"$0\" \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &limited])
        .arg(own)
        .args([
            "--exact",
            "bounded_files::the_file_that_the_environment_names",
            "--nocapture",
            "--test-threads",
            "1",
        ])
        .env(FILE_VARIABLE, file)
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a shell");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > TIME_LIMIT {
            child.kill().expect("a child that runs");
            panic!("{}: takes more than {TIME_LIMIT:?}", file.display());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().expect("a child that has ended");
    let [out, err] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let (name, status) = (file.display(), output.status);
    assert!(
        status.success(),
        "{name}: {status}, with {MEMORY_LIMIT_KB} kB of address space: {out}{err}"
    );
    out
}

#[test]
fn broken_and_odd_files_end_in_a_picture_or_an_error_within_bounds() {
    let limits = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY_LIMIT_KB}")])
        .status();
    if !limits.is_ok_and(|status| status.success()) {
        println!("skipped: no shell here limits memory");
        return;
    }
    let Some(folder) = folder() else { return };
    for part in ["bad", "obj"] {
        let mut files = Vec::new();
        mesh_files(&folder.join(part), &mut files);
        let mut drawn = 0;
        for file in &files {
            let said = within_limits(file);
            let refused = said.contains("refused: ");
            assert!(
                refused || said.contains("drawn: "),
                "{}: neither drawn nor refused: {said}",
                file.display()
            );
            drawn += usize::from(!refused);
        }
        println!(
            "{part}: {drawn} of {} files are drawn, the others refused",
            files.len()
        );
    }
}
