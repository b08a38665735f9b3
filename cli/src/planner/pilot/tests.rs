//! Sums and shares of the pilot, with numbers worked out by hand.

use resample_core::{Image, LookAt};

use super::*;

fn camera(width: u32, height: u32) -> Camera {
    let pose = LookAt {
        position: glam::DVec3::new(0.0, 0.0, 5.0),
        target: glam::DVec3::ZERO,
        up: glam::DVec3::Y,
    };
    Camera::perspective(&pose, 0.8, [width, height]).expect("a valid camera")
}

/// A picture of one colour by place.
fn picture(side: usize, colour: impl Fn(usize, usize) -> [f32; 4]) -> Image {
    let rgba = (0..side * side).map(|i| colour(i % side, i / side));
    Image {
        width: side,
        height: side,
        rgba: rgba.collect(),
        depth: None,
        planes: Vec::new(),
    }
}

#[test]
fn errors_inside_the_rim_stand_for_the_rim() {
    let is_rim = |x: usize, y: usize| x.min(y) < 2 || x.max(y) > 5;
    let exact = picture(8, |_, y| [0.5, 0.5, 0.5, if y < 4 { 1.0 } else { 0.0 }]);
    let other = picture(8, |x, y| {
        let off = if is_rim(x, y) { 9.0 } else { 0.25 };
        [0.5 + off, 0.5, 0.5, exact.rgba[8 * y + x][3]]
    });
    // Two of the four rows inside are covered: 8 of 16 pixels with a square of a sixteenth, times the 64 pixels of all over 16.
    assert_eq!(errors(&other, &exact, 2), (8.0 / 16.0 * 64.0 / 16.0, 0.25));
    // A rim of four leaves nothing of eight pixels, so that the whole counts.
    let (squares, max) = errors(&other, &exact, 4);
    assert_eq!(max, 9.0);
    assert_eq!(squares, 24.0 * 81.0 + 8.0 / 16.0);
    assert_eq!(errors(&exact, &exact, 2), (0.0, 0.0));
}

#[test]
fn the_largest_change_counts_where_nothing_is_covered() {
    let exact = picture(8, |_, _| [0.0; 4]);
    let other = picture(8, |x, y| match (x, y) {
        (2, 5) => [0.0, -0.125, 0.0, 0.0],
        _ => [0.0; 4],
    });
    assert_eq!(
        errors(&other, &exact, 2),
        (0.0, 0.125),
        "the last row inside"
    );
    assert_eq!(errors(&other, &exact, 3), (0.0, 0.0), "in the rim");
}

#[test]
fn covered_pixels_are_those_above_a_code() {
    let levels = [0.0, 1.0 / 255.0, 1.01 / 255.0, 1.0];
    let image = picture(2, |x, y| [0.0, 0.0, 0.0, levels[x + 2 * y]]);
    assert_eq!(covered_px(&image), 2.0);
}

#[test]
fn places_stand_in_the_middle_of_equal_parts() {
    assert_eq!(places(16, 4), [2, 6, 10, 14]);
    assert_eq!(places(7, 2), [1, 5]);
    assert_eq!(places(3, 8), [0, 1, 2]);
    assert_eq!(places(5, 1), [2]);
}

#[test]
fn a_preview_has_half_of_the_pixels_or_160() {
    for (size, expected) in [
        ([400, 100], [160, 40]),
        ([200, 101], [100, 51]),
        ([321, 320], [160, 160]),
        ([1, 1], [1, 1]),
    ] {
        let small = preview_camera(&camera(size[0], size[1])).expect("a valid camera");
        assert_eq!([small.width, small.height], expected, "{size:?}");
    }
}

/// A candidate of a volume; times and work of its windows, each with its covered pixels.
fn candidate(parts: &[[(f64, f64, f64); 2]], fixed_ms: f64) -> Candidate {
    let part = |&(cpu_ms, growing, covered): &(f64, f64, f64)| DrawnPart {
        cpu_ms,
        work: Work {
            growing,
            fixed: 3.0,
        },
        covered,
        squares: 0.0,
        max: 0.0,
    };
    Candidate {
        rung: Rung {
            choices: Choices::default(),
            work: 1.0,
        },
        parts: parts
            .iter()
            .map(|parts| parts.iter().map(part).collect())
            .collect(),
        fixed_ms,
    }
}

/// A pilot of pictures of 100x100 pixels, all covered, each with two windows: of a chance of a half, and of an eighth, drawn three
/// times.
fn pilot(views: usize) -> Pilot {
    let whole = camera(100, 100);
    let window = |chance, draws| TrialWindow {
        camera: camera(20, 20),
        at: [0, 0],
        chance,
        draws,
        change: None,
    };
    let view = || View {
        cells: Cells::new(
            &whole,
            &picture(50, |x, _| [x as f32, 0.0, 0.0, 1.0]),
            None,
            20,
        ),
        windows: vec![window(0.5, 1), window(0.125, 3)],
        exact: Vec::new(),
    };
    Pilot {
        views: (0..views).map(|_| view()).collect(),
        guard_px: 0,
        draws: 4,
        pictures: 8,
        cpu_ms: 0.0,
        work: 0.0,
        wall_per_cpu: 0.5,
        compared: Choices::default(),
        default_long: Vec::new(),
    }
}

#[test]
fn windows_stand_for_pictures_as_their_covered_pixels_do() {
    // Weights are draws over chances, 2 and 24; of 400 and 100 covered pixels they make 3200, of 10,000 of the picture.
    let one = candidate(&[[(8.0, 40.0, 400.0), (5.0, 10.0, 100.0)]], 2.0);
    let sum = (2.0 * 40.0 + 24.0 * 10.0) * 10_000.0 / 3200.0;
    assert_eq!(pilot(1).picture_work(&one), 3.0 + sum);
    // The least time of a window and of a picture of one pixel is what every picture takes.
    let time = 2.0 + (2.0 * 6.0 + 24.0 * 3.0) * 10_000.0 / 3200.0;
    assert!((pilot(1).picture_ms(&one) - 1.2 * 0.5 * time).abs() < 1e-9);
    let quick = candidate(&[[(8.0, 40.0, 400.0), (5.0, 10.0, 100.0)]], 6.0);
    let time = 5.0 + 2.0 * 3.0 * 10_000.0 / 3200.0;
    assert!((pilot(1).picture_ms(&quick) - 1.2 * 0.5 * time).abs() < 1e-9);
}

#[test]
fn work_is_the_mean_of_the_pictures_and_time_that_of_the_slowest() {
    let two = candidate(
        &[
            [(8.0, 40.0, 400.0), (8.0, 40.0, 400.0)],
            [(4.0, 20.0, 400.0), (4.0, 20.0, 400.0)],
        ],
        0.0,
    );
    // Where windows are alike, a picture has 25 times their work: 10,000 of 400 pixels.
    assert_eq!(pilot(2).picture_work(&two), 3.0 + 25.0 * 30.0);
    // The window's own 8 ms are the least that is known to be needed.
    let times = candidate(
        &[
            [(8.0, 40.0, 400.0), (12.0, 40.0, 400.0)],
            [(4.0, 20.0, 400.0), (4.0, 20.0, 400.0)],
        ],
        1.0,
    );
    let slowest = 1.0 + (2.0 * 7.0 + 24.0 * 11.0) * 10_000.0 / (26.0 * 400.0);
    assert!((pilot(2).picture_ms(&times) - 1.2 * 0.5 * slowest).abs() < 1e-9);
}

#[test]
fn the_size_counts_windows_and_their_share_of_the_pixels() {
    assert_eq!(pilot(2).size(), (2, 4, 4.0 * 400.0 / 20_000.0));
    assert!(pilot(1).sees_something() && !pilot(0).sees_something());
}

#[test]
fn meshes_count_pixels_and_volumes_their_own_work() {
    let mut rung = candidate(&[], 0.0);
    rung.rung.work = 7.0;
    let cost = Cost {
        growing: 10.0,
        fixed: 2.0,
        ..Cost::default()
    };
    let of = |drawing: crate::args::Drawing| {
        let work = rung.work(&drawing.setting(), &cost);
        [work.growing, work.fixed]
    };
    assert_eq!(
        of(crate::args::Drawing::Volsplat(Box::default())),
        [10.0, 2.0]
    );
    assert_eq!(
        of(crate::args::Drawing::Texmap(Box::default())),
        [70.0, 2.0]
    );
}

/// Finds the peaks of a sequence of 64 pictures by 16 previews; gives them and the places of which previews were drawn.
fn peaks(contrast: impl Fn(usize) -> f64) -> (Vec<usize>, Vec<usize>) {
    let whole = camera(20, 20);
    let mut previews = Previews {
        candidate: candidate(&[], 0.0),
        side_px: 20,
        seen: BTreeMap::new(),
    };
    let draw = |previews: &mut Previews, place: usize| {
        let mut cells = Cells::new(&whole, &picture(10, |_, _| [1.0; 4]), None, 20);
        cells.contrast = contrast(place);
        previews.seen.insert(place, cells);
        Ok(())
    };
    let peaks = previews.most_contrast(64, 16, draw).expect("previews");
    (peaks, previews.seen.into_keys().collect())
}

#[test]
fn the_two_peaks_of_a_turn_are_found_between_previews() {
    let hill = |at: f64, place: usize| (20.0 - (place as f64 - at).abs()).max(0.0);
    let (found, drawn) = peaks(|place| hill(13.0, place).max(0.9 * hill(45.0, place)));
    assert_eq!(found, [13, 45]);
    assert!(drawn.len() < 26, "{} previews", drawn.len());
    // At the ends of the sequence, too.
    assert_eq!(peaks(|place| place as f64).0[0], 63);
    assert_eq!(peaks(|place| 64.0 - place as f64).0[0], 0);
}

#[test]
fn a_second_peak_is_more_than_an_eighth_of_the_sequence_away() {
    let steep = |at: usize, place: usize| 9.0 - place.abs_diff(at) as f64;
    // Previews stand at 2, 6, 10 and so on: 18 is eight from 10, and 22 is twelve.
    let (found, _) = peaks(|place| {
        steep(10, place)
            .max(0.5 * steep(18, place))
            .max(0.25 * steep(22, place))
    });
    assert_eq!(found[0], 10);
    assert!(found[1].abs_diff(10) > 8, "{found:?}");
}
