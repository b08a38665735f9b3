//! Soft depth of leaves and twigs: rims without stray pixels, fills without the colour of what is before them.

use resample_tests::warp_soft::Softening::{Blurred, Guided, Linear};
use resample_tests::warp_thicket::{BandFigures, Made, in_band, views, with_depth};
use warp3d::{Fill, WarpOptions, Warper};

/// The sums over the views of these names.
fn figures(made: Made, names: &[&str]) -> BandFigures {
    let options = WarpOptions {
        fill: Fill::Background,
        ..WarpOptions::default()
    };
    let mut total = BandFigures::default();
    let views = views();
    for scene in views
        .iter()
        .filter(|view| names.contains(&view.name.as_str()))
    {
        let reference = with_depth(&scene.reference, made);
        let mut warper = Warper::new(vec![reference], &options).expect("good");
        let image = warper.render(&scene.target).expect("a camera").image;
        let found = in_band(&image, &scene.truth);
        println!("{made:?}, {}: {found:?}", scene.name);
        total.specks += found.specks;
        total.foreign += found.foreign;
        total.count += found.count;
    }
    total
}

#[test]
fn soft_rims_have_no_specks() {
    let all = [
        Made::Soft(Blurred(1.0)),
        Made::Soft(Blurred(2.0)),
        Made::Soft(Blurred(3.0)),
        Made::Soft(Guided(2.0)),
        Made::Soft(Linear(4)),
        Made::Coded(Blurred(1.5)),
        Made::Coded(Guided(2.0)),
    ];
    for made in all {
        let found = figures(made, &["left", "right"]);
        // What was there before had up to 6.5 in a thousand.
        assert!(
            1000 * found.specks <= 5 * found.count,
            "{made:?}: {} specks in {} pixels",
            found.specks,
            found.count
        );
    }
}

#[test]
fn gaps_show_what_lay_beside_the_nearer_surface() {
    let found = figures(Made::Exact, &["left", "right", "sway aside", "sway up"]);
    // Half of what the farthest surface of eight directions gave: a wall in the gap between a twig and a leaf.
    assert!(1000 * found.foreign <= 5 * found.count, "{found:?}");
}
