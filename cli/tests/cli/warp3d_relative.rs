//! `resample warp3d` on depth without a unit: one range for all pictures of a sequence, whatever is in them.

use super::bad_input::assert_one_line;
use super::warp3d::{pfm_of, png_of};
use super::{Bench, assert_good, read_png, stderr};

/// Large enough that nine numbers are less than the share of wild ones.
const SIZE: [usize; 2] = [64, 48];

/// Frames of a red post before a wall that is nearer at its lower end. `number` gives what is stored at a pixel of a frame
/// in place of the scene's number.
fn frames(count: usize, number: impl Fn(usize, [usize; 2], f32) -> f32) -> Bench {
    let bench = Bench::new();
    let is_post = |x: usize| (20..24).contains(&x);
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]);
    let colours = pixels.flat_map(|[x, y]| match is_post(x) {
        true => [230, 30, 30],
        false => [(x * 3) as u8, (y * 5) as u8, 90],
    });
    let picture = png_of(SIZE, &colours.collect::<Vec<u8>>());
    for frame in 0..count {
        let scene = |x: usize, y: usize| {
            if is_post(x) {
                6.0
            } else {
                1.0 + y as f32 / 24.0
            }
        };
        let stored = |x, y| number(frame, [x, y], scene(x, y));
        bench.write(&format!("c_{frame}.png"), &picture);
        bench.write(&format!("z_{frame}.pfm"), &pfm_of(SIZE, stored));
    }
    bench
}

const WORDS: &str = "warp3d c_%d.png z_%d.pfm --depth-kind relative --from fov:40 --method nearest";

/// The bytes of the pictures of a run, and its messages.
fn drawn(bench: &Bench, words: &str) -> (Vec<Vec<u8>>, String) {
    let output = bench.run(&format!("{WORDS} --to shift:0.1,0,0 {words} -o out/a.png"));
    assert_good(&output);
    let pictures = bench.written();
    let bytes = |name: &String| read_png(&bench.path(&format!("out/{name}"))).2;
    (pictures.iter().map(bytes).collect(), stderr(&output))
}

/// The column at which the post begins, and the first pixel of the wall's own colour at a place.
fn post(bytes: &[u8]) -> Option<usize> {
    super::warp3d::panel_start(bytes, SIZE[0], 24)
}

#[test]
fn a_photograph_of_an_unknown_lens_gets_one_and_no_holes() {
    let bench = frames(1, |_, _, z| z);
    let drawn = |words: &str| {
        let words = format!(
            "warp3d c_0.png z_0.pfm --depth-kind relative --stereo 0.3 {words} -o out/a.png"
        );
        let output = bench.run(&words);
        assert_good(&output);
        (read_png(&bench.path("out/a.png")).2, stderr(&output))
    };
    let holes = |rgba: &[u8]| rgba.chunks(4).filter(|pixel| pixel[3] == 0).count();
    let (plain, notes) = drawn("");
    assert!(
        notes.contains("fov:35") && notes.contains("--fill none"),
        "{notes}"
    );
    assert_eq!(plain, drawn("--from fov:35 --fill background").0);
    let (open, notes) = drawn("--fill none");
    assert!(!notes.contains("holes are filled"), "{notes}");
    assert!(holes(&plain) == 0 && holes(&open) > 20);
}

#[test]
fn wild_numbers_in_some_frames_do_not_make_depth_pump() {
    let bench = frames(4, |frame, [x, y], z| {
        let is_wild = frame % 2 == 1 && x % 20 == 3 && y % 15 == 7;
        if is_wild { 60.0 } else { z }
    });
    let (pictures, _) = drawn(&bench, "");
    let places: Vec<Option<usize>> = pictures.iter().map(|bytes| post(bytes)).collect();
    assert!(
        places[0].is_some_and(|x| x < 15),
        "the post moves: {places:?}"
    );
    assert!(places.iter().all(|place| *place == places[0]), "{places:?}");
    assert_eq!(pictures[0], pictures[2], "equal frames");
}

#[test]
fn what_walks_into_a_picture_moves_nothing_else() {
    let walker = |frame: usize, [x, y]: [usize; 2], z| {
        let is_there = frame == 2 && (44..60).contains(&x) && y > 8;
        if is_there { 30.0 } else { z }
    };
    let bench = frames(3, walker);
    let (pictures, _) = drawn(&bench, "");
    let left = |bytes: &[u8]| -> Vec<u8> {
        let rows = bytes.chunks(SIZE[0] * 4);
        rows.flat_map(|row| row[..30 * 4].to_vec()).collect()
    };
    assert_eq!(left(&pictures[0]), left(&pictures[2]));
    // A part has the bytes of the whole run; so has a single frame under the range of all.
    let (part, _) = drawn(&frames(3, walker), "--frames 2..3");
    assert_eq!(part, pictures[2..]);
    let (with_range, _) = drawn(&frames(2, walker), "--relative-range 1,30");
    assert_eq!(with_range, pictures[..2]);
}

#[test]
fn equal_notes_are_printed_once_in_a_command() {
    let (pictures, said) = drawn(&frames(3, |_, _, z| z), "");
    assert_eq!(pictures.len(), 3);
    assert_eq!(said.matches("the depth has no unit").count(), 1, "{said}");
    assert!(said.contains("note: z_0.pfm"), "{said}");
    let away = format!("{WORDS} --to shift:0,0,200 -o out/b.png");
    let said = stderr(&frames(3, |_, _, z| z).run(&away));
    assert_eq!(said.matches("the picture is empty").count(), 1, "{said}");
}

#[test]
fn a_range_is_refused_where_it_means_nothing() {
    let bench = frames(1, |_, _, z| z);
    let words =
        |more: &str| format!("warp3d c_0.png z_0.pfm --from fov:40 --sway 3,2 -o out/a.png {more}");
    assert_one_line(
        &bench,
        &words("--relative-range 0,255"),
        "--depth-kind relative",
    );
    let backwards = stderr(&bench.run(&words("--depth-kind relative --relative-range 255,0")));
    assert!(backwards.contains("the first the smaller"), "{backwards}");
    let panorama = words("--depth-kind relative --stereo 0.1 --layout equirectangular");
    assert_one_line(&bench, &panorama, "or --layout vr180");
}

#[test]
fn comfort_holds_for_all_depths_that_there_can_be() {
    // In the first frame nothing is near; the near plane, 1 unit, is where later frames have their nearest things.
    let bench = frames(3, |frame, _, z| if frame == 0 { z.min(2.0) } else { z });
    let (_, said) = drawn(&bench, "--stereo 0.3 --convergence 3 --comfort 1.5");
    assert!(said.contains("things have -1.5 % (near)"), "{said}");
    assert!(said.contains("instead of 0.3"), "{said}");
    let (_, said) = drawn(&bench, "--stereo 0.001 --convergence 3 --comfort 1.5");
    assert!(
        !said.contains("instead of"),
        "a pair that is comfortable stays: {said}"
    );
}
