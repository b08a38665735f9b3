//! Figures: lengths of bars against the camera, parts against the whole, round numbers.

use glam::DVec3;
use resample_core::LookAt;

use super::ticks::ticks;
use super::*;

fn camera(width: u32) -> Camera {
    let pose = LookAt {
        position: DVec3::new(0.0, 0.0, 10.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, 0.6, [width, width / 2]).expect("a camera")
}

fn figure() -> Figure {
    Figure {
        scale_bar: Some(ScaleBar {
            length: None,
            unit: Some("µm".to_owned()),
            at: DVec3::ZERO,
        }),
        colour_bar: Some(ColourBar {
            title: Some("pressure".to_owned()),
            range: [-3.0, 17.5],
            colours: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        }),
        axes: Some(Axes {
            names: ["x", "y", "z"].map(str::to_owned),
            bounds: Some([DVec3::splat(-1.0), DVec3::ONE]),
            unit: None,
        }),
        caption: Some("A caption".to_owned()),
        ground: Ground::Dark,
    }
}

#[test]
fn a_scale_bar_is_as_long_as_it_says() {
    let camera = camera(800);
    let bar = Figure {
        scale_bar: Some(ScaleBar {
            length: Some(1.5),
            unit: None,
            at: DVec3::ZERO,
        }),
        ground: Ground::Dark,
        ..Figure::default()
    };
    let mut image = Image::transparent(800, 400);
    bar.draw(&mut image, &camera, [0, 0]);
    // The row of the bar, 1.5 ems above the lower edge.
    let row = (400.0 - 1.5 * (0.024f64 * 400.0).max(9.0)) as usize;
    let covered = (0..800).filter(|&x| image.pixel(x, row)[3] > 0.25).count() as f64;
    let expected = 1.5 * camera.fx / 10.0;
    assert!(
        (covered - expected).abs() < 3.0,
        "{covered} px, expected {expected}"
    );
}

#[test]
fn parts_of_a_picture_are_those_of_the_whole() {
    let camera = camera(600);
    for ground in [Ground::Dark, Ground::Unknown] {
        let figure = Figure { ground, ..figure() };
        let mut whole = Image::transparent(600, 300);
        figure.draw(&mut whole, &camera, [0, 0]);
        assert!(whole.rgba.iter().filter(|pixel| pixel[3] > 0.5).count() > 2000);
        for first in [[0, 0], [300, 0], [0, 150], [300, 150]] {
            let mut part = Image::transparent(300, 150);
            figure.draw(&mut part, &camera, first);
            assert_eq!(part.rgba, whole.window(first, [300, 150]).rgba, "{first:?}");
        }
    }
}

#[test]
fn words_at_the_edge_are_moved_into_the_picture() {
    let covered = |at: DVec2| {
        let mut image = Image::transparent(100, 100);
        let mut canvas = Canvas::new(&mut image, [0, 0], [100.0; 2], Ground::Light);
        canvas.text("S (mm)", 10.0, at, Anchor::RIGHT);
        image
            .rgba
            .iter()
            .map(|pixel| f64::from(pixel[3]))
            .sum::<f64>()
    };
    let whole = covered(DVec2::new(80.0, 50.0));
    for place in [[3.0, 50.0], [99.0, 1.0], [2.0, 99.5]] {
        let moved = covered(DVec2::from_array(place));
        assert!(
            (moved / whole - 1.0).abs() < 0.05,
            "{place:?}: {moved} of {whole}"
        );
    }
    assert_eq!(
        covered(DVec2::new(-3.0, 50.0)),
        0.0,
        "numbers of places outside stay outside"
    );
}

#[test]
fn letters_and_bars_keep_their_share_of_a_larger_picture() {
    let covered = |width: u32| {
        let mut image = Image::transparent(width as usize, width as usize / 2);
        figure().draw(&mut image, &camera(width), [0, 0]);
        let alpha: f64 = image.rgba.iter().map(|pixel| f64::from(pixel[3])).sum();
        alpha / f64::from(width).powi(2)
    };
    let (small, large) = (covered(1000), covered(4000));
    assert!((small / large - 1.0).abs() < 0.08, "{small} {large}");
}

#[test]
fn lines_of_the_box_are_hidden_by_what_stands_before_them() {
    let camera = camera(400);
    let draw = |depth: f32| {
        let mut image = Image::transparent(400, 200);
        image.rgba.fill([0.0, 0.5, 0.0, 1.0]);
        image.depth = Some(vec![depth; 400 * 200]);
        let axes = figure().axes.map(|axes| Axes {
            names: Default::default(),
            ..axes
        });
        Figure {
            axes,
            ground: Ground::Light,
            ..Figure::default()
        }
        .draw(&mut image, &camera, [0, 0]);
        image.rgba.iter().filter(|pixel| pixel[1] < 0.4).count()
    };
    assert!(draw(20.0) > draw(1.0) + 300, "{} {}", draw(20.0), draw(1.0));
}

#[test]
fn numbers_are_round_and_written_short() {
    let tenths: Vec<String> = ticks(0.0, 1.0, 5).into_iter().map(number).collect();
    assert_eq!(tenths, ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
    assert_eq!(ticks(-3.0, 17.5, 5), [0.0, 5.0, 10.0, 15.0]);
    assert_eq!(ticks(2.0, 2.0, 5), [2.0]);
    assert_eq!(
        [0.1, 0.00012, 1.5e-7, 250.0, 3e6, -2.0, 0.0].map(number),
        ["0.1", "0.00012", "1.5e−7", "250", "3e6", "−2", "0"]
    );
    for most in [0.3, 1.0, 9.99, 1234.5, 1e-7] {
        let length = round_length(most);
        assert!(
            length <= most * 1.000001 && length > 0.39 * most,
            "{most}: {length}"
        );
    }
}

#[test]
fn a_sheet_has_its_pictures_in_rows_over_their_names() {
    let red = |side: usize| {
        let mut image = Image::transparent(side, side);
        image.rgba.fill([1.0, 0.0, 0.0, 1.0]);
        image
    };
    let name = "a very long name of a file.glb".repeat(4);
    let cells = [
        ("a".to_owned(), red(40)),
        (name, red(30)),
        ("c".to_owned(), red(40)),
    ];
    let sheet = sheet(&cells, 40, 2);
    assert_eq!((sheet.width, sheet.height), (11 + 2 * 51, 11 + 2 * 73));
    let is_red = |x: usize, y: usize| sheet.pixel(x, y) == [1.0, 0.0, 0.0, 1.0];
    assert!(
        is_red(11, 11) && is_red(50, 50) && !is_red(51, 11),
        "the first"
    );
    assert!(
        !is_red(62, 11) && is_red(67, 16),
        "a smaller picture stands in the middle"
    );
    assert!(is_red(11, 84) && !is_red(62, 84), "the second row has one");
    let names = sheet.rgba.iter().filter(|pixel| pixel[0] < 0.5).count();
    assert!(names > 60, "{names}");
    // The long name stays between its neighbours.
    assert!(
        (0..sheet.height)
            .all(|y| sheet.pixel(56, y) == [1.0; 4] && sheet.pixel(108, y) == [1.0; 4])
    );
}

#[test]
fn any_camera_and_any_text_are_drawn_without_panic() {
    let mut image = Image::transparent(40, 30);
    let text = "\n\u{0}木 éß\u{200d} very long ".repeat(50);
    let figure = Figure {
        caption: Some(text.clone()),
        scale_bar: Some(ScaleBar {
            length: Some(1e30),
            unit: Some(text),
            at: DVec3::new(0.0, 0.0, 50.0),
        }),
        ..figure()
    };
    figure.draw(&mut image, &camera(40), [0, 0]);
    let behind = Figure {
        scale_bar: Some(ScaleBar {
            length: Some(1e30),
            unit: None,
            at: DVec3::ZERO,
        }),
        axes: Some(Axes {
            names: Default::default(),
            bounds: Some([DVec3::splat(-1e300), DVec3::splat(1e300)]),
            unit: None,
        }),
        ..figure
    };
    behind.draw(&mut image, &camera(40), [0, 0]);
    assert!(image.rgba.iter().flatten().all(|value| value.is_finite()));
}
