//! `resample warp3d` from several pictures at once: neighbours of a sequence, and pictures of another exposure.

use resample_core::image::srgb_from_linear;

use super::bad_input::assert_one_line;
use super::warp3d::{pfm_of, png_of};
use super::{Bench, assert_good, read_png, stderr};

const SIZE: [usize; 2] = [64, 48];

/// A post 2 units away before a wall 4 units away, from three places in a row; `brightness` is a factor of each picture.
fn walk(brightness: [f32; 3]) -> Bench {
    let bench = Bench::new();
    let mut poses = String::new();
    for (frame, brightness) in brightness.into_iter().enumerate() {
        let place = 0.2 * frame as f32;
        let at = |x: usize, z: f32| place + (x as f32 - 31.5) / 60.0 * z;
        let is_post = |x: usize| (0.1..0.3).contains(&at(x, 2.0));
        let pixels = (0..SIZE[0] * SIZE[1]).flat_map(|i| {
            let x = i % SIZE[0];
            let level = match is_post(x) {
                true => 0.1,
                false => 0.3 + 0.1 * (3.0 * at(x, 4.0)).sin(),
            };
            let code = (255.0 * srgb_from_linear(level * brightness)).round();
            [code as u8; 3]
        });
        bench.write(
            &format!("c_{frame}.png"),
            &png_of(SIZE, &pixels.collect::<Vec<u8>>()),
        );
        let depth = |x, _| if is_post(x) { 2.0 } else { 4.0 };
        bench.write(&format!("z_{frame}.pfm"), &pfm_of(SIZE, depth));
        poses += &format!("{frame} {place} 0 0 0 0 0 1\n");
    }
    bench.write("poses.txt", poses.as_bytes());
    bench
}

const WORDS: &str =
    "warp3d c_%d.png z_%d.pfm --from poses.txt --intrinsics 60,60,31.5,23.5 --to shift:0.1,0,0";

/// Pixels that stay open in the middle one of three pictures, and the messages.
fn open(bench: &Bench, words: &str) -> (usize, String) {
    let output = bench.run(&format!("{WORDS} {words} -o out/a_%d.png"));
    assert_good(&output);
    let (_, _, bytes) = read_png(&bench.path("out/a_1.png"));
    let open = bytes.chunks(4).filter(|pixel| pixel[3] < 128).count();
    (open, stderr(&output))
}

#[test]
fn neighbours_show_what_a_picture_hides() {
    let bench = walk([1.0; 3]);
    let (alone, _) = open(&bench, "");
    let (with, messages) = open(&bench, "--neighbours 1");
    assert!(
        alone > 50 && with * 4 < alone,
        "{alone} pixels open, {with} with neighbours"
    );
    assert!(!messages.contains("exposure"), "{messages}");
}

#[test]
fn neighbours_take_the_exposure_of_their_picture() {
    let bench = walk([1.3, 1.0, 0.8]);
    let (_, messages) = open(&bench, "--neighbours 1");
    assert_eq!(
        messages.matches("exposure").count(),
        1,
        "once a command: {messages}"
    );
    let level = |words: &str| {
        assert_good(&bench.run(&format!("{WORDS} {words} -o out/b_%d.png")));
        let (_, _, bytes) = read_png(&bench.path("out/b_1.png"));
        bytes
            .chunks(4)
            .map(|pixel| u64::from(pixel[0]))
            .collect::<Vec<u64>>()
    };
    // Where the picture itself sees, its neighbours change nothing.
    let (alone, with) = (level(""), level("--neighbours 1"));
    let apart = alone
        .iter()
        .zip(&with)
        .filter(|(a, b)| **a > 0 && a.abs_diff(**b) > 6);
    // The rims of the post are 2 of 64 columns.
    let apart = apart.count();
    assert!(
        apart < alone.len() / 20,
        "{apart} pixels of {}",
        alone.len()
    );
}

#[test]
fn one_picture_and_one_camera_have_no_neighbours() {
    let bench = walk([1.0; 3]);
    let refused = [
        (
            "warp3d c_0.png z_0.pfm --from fov:40 --to shift:0.1,0,0 --neighbours 1",
            "one picture",
        ),
        (
            "warp3d c_%d.png z_%d.pfm --from fov:40 --to shift:0.1,0,0 --neighbours 1",
            "camera of its own",
        ),
    ];
    for (words, why) in refused {
        assert_one_line(&bench, &format!("{words} -o out/x_%d.png"), why);
    }
}
