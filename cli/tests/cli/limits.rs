//! Limits of the system: names that are too long, memory that a process may not have, pipes among files.

use super::bad_input::assert_refused;
use super::{BALL, Bench, assert_good, stderr};

/// Most bytes of a name on every usual file system.
const LONGEST_NAME: usize = 255;

#[test]
fn names_that_are_too_long_are_refused_before_anything_is_drawn() {
    let bench = Bench::new();
    let name = |letters: usize| "a".repeat(letters - ".png".len());
    let draw = format!("volsplat ball.raw {BALL} --size 8x8");
    assert_good(&bench.run(&format!("{draw} -o {}.png", name(LONGEST_NAME))));
    let (longest, too_long) = (name(LONGEST_NAME), name(LONGEST_NAME + 1));
    for words in [
        format!("{draw} -o out/{too_long}.png"),
        format!("{draw} -o out/{too_long}.exr"),
        // The number makes it longer.
        format!("{draw} --turntable 2 -o out/{longest}.png"),
        format!("{draw} -o out/a.png --stats out/{too_long}.json"),
        format!("{draw} -o out/a.png --save-camera out/{too_long}.json"),
    ] {
        assert_refused(&bench, &words, "choose a shorter name");
    }
    // Only the last number has a digit more than the pattern.
    let nine = "b".repeat(LONGEST_NAME - "0.png".len());
    let words = format!("{draw} --turntable 11 -o out/{nine}%d.png");
    assert_refused(&bench, &words, "choose a shorter name");
}

/// Runs the binary in the folder of a bench under a limit of address space in kB.
#[cfg(target_os = "linux")]
fn run_within(bench: &Bench, limit_kb: u64, words: &str) -> std::process::Output {
    let binary = env!("CARGO_BIN_EXE_resample");
    std::process::Command::new("sh")
        .current_dir(bench.path(""))
        .arg("-c")
        // Threads take address space of their own.
        .arg(format!(
            "ulimit -v {limit_kb}; exec {binary} {words} --threads 1"
        ))
        .output()
        .expect("a shell")
}

/// A colourful JPEG of 4000x4000 pixels.
#[cfg(target_os = "linux")]
fn large_jpeg() -> Vec<u8> {
    let mut picture = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new(&mut picture);
    let pixel = |x, y| image::Rgb([(x / 16) as u8, (y / 16) as u8, 90]);
    image::RgbImage::from_fn(4000, 4000, pixel)
        .write_with_encoder(encoder)
        .expect("in memory");
    picture
}

#[cfg(target_os = "linux")]
#[test]
fn a_background_takes_little_more_than_its_pixels() {
    let bench = Bench::new();
    bench.write("behind.jpg", &large_jpeg());
    // Pixels of three and of four bytes take 112 MB; as three real numbers each they would take 192 MB beside them.
    let words = format!("volsplat ball.raw {BALL} --size 8x8 --background behind.jpg -o out/a.png");
    assert_good(&run_within(&bench, 300_000, &words));
}

#[cfg(target_os = "linux")]
#[test]
fn slices_are_held_against_the_address_space_before_they_are_decoded() {
    let bench = Bench::new();
    let picture = large_jpeg();
    bench.write("s_0.jpg", &picture);
    bench.write("s_1.jpg", &picture);
    // Two slices of 4000x4000 take 0.58 GB, three quarters of 700 MB are 0.54 GB.
    let output = run_within(&bench, 700_000, "volsplat s_*.jpg --size 8x8 -o out/a.png");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("the slices take 576.0 MB"), "{said}");
    assert!(said.contains("what this process may have"), "{said}");
    assert!(bench.written().is_empty());
}

#[cfg(unix)]
#[test]
fn a_pipe_that_has_the_name_of_a_temporary_file_stays() {
    let bench = Bench::new();
    let made = std::process::Command::new("mkfifo")
        .arg(bench.path("out/.resample-pipe.tmp"))
        .status();
    assert!(made.is_ok_and(|status| status.success()), "a pipe");
    assert_good(&bench.draw("--size 8x8 -o out/a.png"));
    assert_eq!(bench.written(), [".resample-pipe.tmp", "a.png"]);
}

/// Peak memory of drawing a cube of bytes, all of them visible, lit by default.
#[cfg(target_os = "linux")]
fn peak_of_bytes(bench: &Bench, side: usize) -> f64 {
    let voxels: Vec<u8> = (0..side.pow(3)).map(|i| (i * i % 251) as u8).collect();
    bench.write("bytes.raw", &voxels);
    assert_good(&bench.run(&format!(
        "volsplat bytes.raw --dims {side},{side},{side} --type u8 --size 32x32 -o out/a.png --stats out/s.json"
    )));
    let stats = super::planner::json(bench, "out/s.json");
    assert_eq!(
        stats["settings"]["render"]["shading"], "phong",
        "the default is lit"
    );
    stats["peak_bytes"].as_f64().expect("Linux tells")
}

#[cfg(target_os = "linux")]
#[test]
fn a_lit_volume_of_bytes_takes_few_bytes_a_voxel() {
    const SIDE: usize = 192;
    let bench = Bench::new();
    let own = peak_of_bytes(&bench, SIDE) - peak_of_bytes(&bench, 8);
    // The voxel; four bytes each for its face and its differences, with the brick's rim 4.5 and 5.7; the brick itself and its
    // places in lists, some 600 bytes for 512 voxels: 12.4. An eighth more for the allocator's reserve.
    let each = own / SIDE.pow(3) as f64;
    assert!(each < 14.0, "{each:.1} bytes a voxel");
}
