//! Kills a sequence of pictures again and again, resumes it, and compares what is there at last with an undisturbed run.
//!
//! `cargo run --release -p resample-tests --example kill_loop -- target/release/resample 200`
//! Signals are sent by the program `kill`: KILL, TERM and INT in turn, after times that spread over the run.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Pictures of the sequence.
const PICTURES: usize = 40;

/// Steps of the golden ratio spread times evenly, however many there are.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

fn main() {
    let mut words = std::env::args().skip(1);
    let binary = words.next().expect("the program");
    let kills: usize = words
        .next()
        .map_or(200, |word| word.parse().expect("a number"));
    let folder = tempfile::tempdir().expect("a folder");
    let volume: Vec<u8> = (0..48_usize.pow(3)).map(|i| (i % 251) as u8).collect();
    std::fs::write(folder.path().join("a.raw"), volume).expect("a volume");
    for name in ["whole", "killed"] {
        std::fs::create_dir(folder.path().join(name)).expect("a folder");
    }

    let start = Instant::now();
    let ran = command(&binary, folder.path(), "whole")
        .status()
        .expect("it runs");
    assert!(ran.success(), "an undisturbed run");
    let whole = start.elapsed();

    let (mut ended, mut begun_again) = (0, 0);
    for kill in 0..kills {
        let mut child = command(&binary, folder.path(), "killed")
            .arg("--resume")
            .spawn()
            .expect("it runs");
        let share = (kill as f64 * GOLDEN).fract();
        std::thread::sleep(whole.mul_f64(share.powi(2)) + Duration::from_millis(2));
        let signal = ["-KILL", "-TERM", "-INT"][kill % 3];
        let _ = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .stderr(Stdio::null())
            .status();
        let status = child.wait().expect("it ends");
        ended += usize::from(status.success());
        let pictures = names(&folder.path().join("killed"), ".png");
        for name in &pictures {
            assert!(
                same(folder.path(), name),
                "kill {kill}: {name} is not the picture"
            );
        }
        // All are there: the next run begins anew, with some of them gone.
        if pictures.len() == PICTURES {
            begun_again += 1;
            for name in pictures.iter().step_by(2) {
                std::fs::remove_file(folder.path().join("killed").join(name)).expect("a file");
            }
        }
    }
    let ran = command(&binary, folder.path(), "killed")
        .arg("--resume")
        .status()
        .expect("it runs");
    assert!(ran.success(), "the last run");
    let left = names(&folder.path().join("killed"), ".tmp");
    let pictures = names(&folder.path().join("killed"), ".png");
    assert!(pictures.len() == PICTURES && pictures.iter().all(|name| same(folder.path(), name)));
    assert!(left.is_empty(), "temporary files are left: {left:?}");
    println!(
        "{kills} kills, {ended} of them too late, {begun_again} times begun anew: every picture is the same, nothing is left"
    );
}

fn command(binary: &str, folder: &Path, to: &str) -> Command {
    let binary = std::fs::canonicalize(binary).expect("the program");
    let mut command = Command::new(binary);
    command
        .current_dir(folder)
        .args([
            "volsplat", "a.raw", "--dims", "48,48,48", "--type", "u8", "--size", "160x120",
            "--quiet",
        ])
        .args([
            "--turntable",
            &PICTURES.to_string(),
            "-o",
            &format!("{to}/%02d.png"),
        ])
        .stderr(Stdio::null());
    command
}

/// Returns true if a picture is that of the undisturbed run.
fn same(folder: &Path, name: &str) -> bool {
    let read = |from: &str| std::fs::read(folder.join(from).join(name)).expect("a picture");
    read("whole") == read("killed")
}

fn names(folder: &Path, ending: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| {
        entry
            .expect("an entry")
            .file_name()
            .to_string_lossy()
            .into_owned()
    });
    names.filter(|name| name.ends_with(ending)).collect()
}
