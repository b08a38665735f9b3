//! Clipping, blend modes, labels, masks and channels from the command line: what is seen, and what is refused.

use super::bad_input::assert_refused;
use super::{BALL, Bench, SIDE, assert_good, read_png};

/// Mean of a channel over the picture's left and right halves.
fn halves(bench: &Bench, channel: usize) -> [f64; 2] {
    let (width, height, rgba) = read_png(&bench.path("out/a.png"));
    let mut sums = [0.0; 2];
    for (i, pixel) in rgba.chunks(4).enumerate() {
        sums[2 * (i % width as usize) / width as usize] += f64::from(pixel[channel]);
    }
    sums.map(|sum| 2.0 * sum / f64::from(width * height))
}

/// Draws from the front, with a camera that does not follow what is left.
fn drawn(bench: &Bench, words: &str) {
    let camera = r#"{"position": [15.5, 15.5, 90], "target": [15.5, 15.5, 15.5], "up": [0, 1, 0], "fov_y": 30}"#;
    bench.write("front.json", camera.as_bytes());
    assert_good(&bench.draw(&format!(
        "--camera front.json --size 64x64 {words} -o out/a.png"
    )));
}

#[test]
fn a_clip_leaves_one_side() {
    let bench = Bench::new();
    for words in [
        "--clip-plane 1,0,0,16",
        "--clip-plane=-2,0,0,-32 --clip-plane 0,1,0,-5",
        "--crop 16,0,0,40,40,40",
        "--crop-voxels 16,-1,-1,40,40,40 --order every-sample",
    ] {
        drawn(&bench, words);
        let [left, right] = halves(&bench, 3);
        let (kept, cut) = if words.contains("-2,") {
            (left, right)
        } else {
            (right, left)
        };
        assert!(
            kept > 20.0 && cut < 0.1 * kept,
            "{words}: {left} on the left, {right} on the right"
        );
    }
}

#[test]
fn every_blend_mode_shows_the_ball() {
    let bench = Bench::new();
    for words in [
        "--blend maximum",
        "--blend average --window 20,40",
        "--iso 100",
        "--blend isosurface --iso 100 --iso-colour #ff8000 --iso-opacity 0.5",
        "--gradient-opacity 1,10",
        "--blend minimum --window 1,1 --crop-voxels 10,10,10,20,20,20",
    ] {
        drawn(&bench, words);
        let [left, right] = halves(&bench, 3);
        assert!(
            left > 4.0 && right > 4.0,
            "{words}: {left} on the left, {right} on the right"
        );
    }
}

#[test]
fn masks_labels_and_channels_are_drawn() {
    let bench = Bench::new();
    let half: Vec<u8> = (0..SIDE.pow(3)).map(|i| u8::from(i % SIDE > 15)).collect();
    bench.write("half.raw", &half);
    bench.write(
        "colours.txt",
        b"# labels\n0 0 0 0 0 0 0 \"none\"\n1 0 255 0 1 1 1 \"half\"\n",
    );
    drawn(&bench, "--mask half.raw");
    let [left, right] = halves(&bench, 3);
    assert!(
        right > 20.0 && left < 0.1 * right,
        "the mask hides the left: {left} and {right}"
    );
    drawn(&bench, "--also half.raw labels --label-colours colours.txt");
    let [red, green] = [halves(&bench, 0), halves(&bench, 1)];
    assert!(
        green[1] > 50.0 && red[1] < 5.0,
        "the right is green: {red:?} red, {green:?} green"
    );
    drawn(&bench, "--also half.raw #ff00ff");
    assert!(halves(&bench, 2)[1] > 20.0, "the right is magenta");
    assert_good(&bench.run(&format!(
        "volsplat half.raw {BALL} --labels --size 32x32 --stats out/s.json -o out/a.png"
    )));
    assert!(
        halves(&bench, 3).iter().sum::<f64>() > 50.0,
        "label 1 is opaque"
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let bench = Bench::new();
    bench.write("small.raw", &[1; 8]);
    bench.write("bad.txt", b"1 2 3\n");
    let to = format!("ball.raw {BALL} -o out/a.png");
    let cases = [
        ("--crop 0,0,0,1,1", "--crop"),
        ("--crop 5,5,5,1,9,9", "--crop"),
        ("--clip-plane 0,0,0,1", "--clip-plane"),
        ("--blend isosurface", "--iso"),
        ("--blend maximum --iso 5", "--iso"),
        ("--iso 5 --iso-opacity 1.5", "opacity"),
        ("--iso 5 --order every-sample", "--iso"),
        ("--blend maximum --kernel gaussian", "--order field"),
        ("--gradient-opacity 5,2", "--gradient-opacity"),
        ("--mask small.raw", "small.raw"),
        ("--mask none.raw", "none.raw"),
        ("--labels --label-colours bad.txt", "bad.txt"),
        ("--labels --blend maximum", "labels"),
        ("--also ball.raw nonsense", "nonsense"),
        ("--also ball.raw", "--also"),
        ("--channel x:green", "--channel x"),
        (
            "--clip-plane 1,0,0,0 --clip-plane 1,0,0,0 --clip-plane 1,0,0,0 --clip-plane 1,0,0,0 --clip-plane 1,0,0,0 \
          --clip-plane 1,0,0,0 --clip-plane 1,0,0,0",
            "clip planes",
        ),
    ];
    for (words, named) in cases {
        assert_refused(&bench, &format!("volsplat {to} {words}"), named);
    }
}
