//! The parts of a figure: bars, axes and a caption are drawn, in every kind of picture, and what cannot be is refused.

use super::bad_input::assert_refused;
use super::{BALL, Bench, assert_good, read_png};

/// Pixels that differ between two pictures, by thirds of the picture: columns, then rows.
fn changed(bench: &Bench, words: &str) -> [[usize; 3]; 3] {
    let base = format!("volsplat ball.raw {BALL} --size 240x180 --background black");
    assert_good(&bench.run(&format!("{base} -o out/plain.png")));
    assert_good(&bench.run(&format!("{base} -o out/figure.png {words}")));
    let (width, height, plain) = read_png(&bench.path("out/plain.png"));
    let (_, _, figure) = read_png(&bench.path("out/figure.png"));
    let mut thirds = [[0; 3]; 3];
    for (i, (a, b)) in plain.chunks(4).zip(figure.chunks(4)).enumerate() {
        let [x, y] = [i % width as usize, i / width as usize];
        thirds[3 * y / height as usize][3 * x / width as usize] += usize::from(a != b);
    }
    thirds
}

#[test]
fn parts_stand_where_figures_have_them() {
    let bench = Bench::new();
    let bar = changed(&bench, "--scale-bar");
    assert!(
        bar[2][0] > 30 && bar[0] == [0; 3] && bar[1] == [0; 3],
        "{bar:?}"
    );
    let colours = changed(&bench, "--colour-bar=density");
    assert!(
        colours[1][2] > 300 && colours[0][0] + colours[2][0] == 0,
        "{colours:?}"
    );
    let axes = changed(&bench, "--axes");
    assert!(axes[2][2] > 60 && axes[0] == [0; 3], "{axes:?}");
    let caption = changed(&bench, "--caption Ball");
    assert!(caption[0][1] > 30 && caption[2] == [0; 3], "{caption:?}");
}

#[test]
fn tiles_and_animations_have_the_figure_of_the_whole() {
    let bench = Bench::new();
    let base = format!(
        "volsplat ball.raw {BALL} --size 128x96 --scale-bar --colour-bar --axes=box --caption ball --orbit 20,30"
    );
    assert_good(&bench.run(&format!("{base} -o out/whole.png")));
    for tile in ["0,0/2x1", "1,0/2x1"] {
        assert_good(&bench.run(&format!("{base} -o out/a.png --tile {tile}")));
    }
    assert_good(&bench.run("join out/a.tile-0-0.exr out/a.tile-1-0.exr -o out/joined.png"));
    let read = |name: &str| read_png(&bench.path(name));
    assert!(read("out/joined.png") == read("out/whole.png"));
    assert_good(&bench.run(&format!("{base} -o out/turn.gif --turntable 3")));
    let head = std::fs::read(bench.path("out/turn.gif")).expect("a film");
    assert!(head.starts_with(b"GIF89a"));
}

#[test]
fn scans_and_gaussians_have_figures_too() {
    let bench = super::points::bench();
    bench.write("a.bin", &super::gaussians::ply(0));
    let parts = "--scale-bar --axes=box --caption drawn";
    let of_points = format!("hill.ply --color-by height --colour-bar=Height {parts}");
    for (command, words) in [
        ("points", &of_points),
        ("volsplat", &format!("a.bin {parts}")),
    ] {
        let base = format!("{command} {words} --size 240x180 --background white");
        assert_good(&bench.run(&format!("{base} -o out/whole.png")));
        for tile in ["0,0/1x2", "0,1/1x2"] {
            assert_good(&bench.run(&format!("{base} -o out/a.png --tile {tile}")));
        }
        assert_good(&bench.run("join out/a.tile-0-0.exr out/a.tile-0-1.exr -o out/joined.png"));
        let (_, _, whole) = read_png(&bench.path("out/whole.png"));
        assert!(
            read_png(&bench.path("out/joined.png")).2 == whole,
            "{command}"
        );
        // Lines and letters are grey where they are thinner than a pixel.
        let is_grey = |pixel: &[u8]| {
            let (least, most) = (pixel[..3].iter().min(), pixel[..3].iter().max());
            most.zip(least)
                .is_some_and(|(most, least)| most - least < 8 && *most < 200)
        };
        let letters = whole.chunks(4).filter(|pixel| is_grey(pixel)).count();
        assert!(letters > 300, "{command}: {letters} grey pixels");
    }
}

#[test]
fn what_no_figure_has_is_refused() {
    let bench = Bench::new();
    let to = format!("ball.raw {BALL} -o out/a.png --size 64x64");
    for (words, named) in [
        ("--scale-bar=1000", "choose a shorter bar"),
        ("--scale-bar=0", "--scale-bar"),
        ("--axes=cube", "directions"),
        ("--labels --colour-bar", "one transfer function has a scale"),
    ] {
        assert_refused(&bench, &format!("volsplat {to} {words}"), named);
    }
    let points = super::points::bench();
    assert_refused(
        &points,
        "points hill.ply --color-by colour --colour-bar -o out/a.png",
        "points by height or intensity",
    );
    assert_refused(
        &bench,
        &format!("volsplat ball.raw {BALL} -o out/a.gif --bits 16 --turntable 2"),
        "GIF",
    );
}
