//! What users bring to the depth-image warp: real pairs, damaged files, every camera format.
//!
//! A wrong convention (a pose the other way around, a flipped axis, a pixel centre that is off) moves the picture to
//! the wrong place. So each format warps a real first view to a real second one: warped right, it must be closer to
//! the second photograph than the first one is as it stands; warped wrong, it must not.

mod exr_files;
mod formats;
mod pairs;

use std::path::Path;

use resample_core::Camera;
use resample_core::image::srgb_from_linear;
use warp3d::input::{self, DepthMeaning, Part, Picture, cameras, colour, depth};
use warp3d::{Method, Reference, WarpOptions, Warper};

/// A picture file, which must be good.
fn picture(path: &Path) -> Picture {
    named_picture(&path.to_string_lossy())
}

/// As [`picture`], with a layer behind a `#`.
fn named_picture(text: &str) -> Picture {
    colour::read(&Part::from_text(text)).unwrap_or_else(|error| panic!("{error}"))
}

/// A reference view from its files, which must be good; a depth file may name a channel.
fn reference(colour: &str, depth_file: &str, camera: Camera, meaning: &DepthMeaning) -> Reference {
    let part = Part::from_text(depth_file);
    let stored = depth::read(&part).unwrap_or_else(|error| panic!("{error}"));
    input::reference(named_picture(colour), &stored, camera, meaning, &part.path)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// A camera of a file, which must be good.
fn camera(path: &Path, entry: &str, hints: &cameras::Hints) -> Camera {
    let set = cameras::read(path, hints).unwrap_or_else(|error| panic!("{error}"));
    let set = set.unwrap_or_else(|| panic!("{}: no known camera format", path.display()));
    set.entry(entry)
        .unwrap_or_else(|error| panic!("{error}"))
        .camera
}

/// How near the view from `camera` is to `truth`: PSNR in sRGB over the pixels that are seen, dB, and the seen part.
fn warped_psnr(reference: &Reference, camera: &Camera, truth: &Picture) -> (f64, f64) {
    let options = WarpOptions::with_method(Method::NEAREST);
    let mut warper = Warper::new(vec![reference.clone()], &options).expect("good options");
    let image = warper.render(camera).expect("a good camera").image;
    assert_eq!(
        (image.width, image.height),
        (truth.width, truth.height),
        "picture sizes"
    );
    let pixels: Vec<_> = image
        .rgba
        .iter()
        .zip(&truth.rgb)
        .filter(|(seen, _)| seen[3] > 0.99)
        .collect();
    let seen = pixels.len() as f64 / truth.rgb.len() as f64;
    (
        psnr(
            pixels
                .into_iter()
                .map(|(seen, truth)| ([seen[0], seen[1], seen[2]], *truth)),
        ),
        seen,
    )
}

/// PSNR between pairs of linear colours after the sRGB curve, dB.
fn psnr(pairs: impl Iterator<Item = ([f32; 3], [f32; 3])>) -> f64 {
    let (mut sum, mut count) = (0.0f64, 0u64);
    for (a, b) in pairs {
        for (a, b) in a.into_iter().zip(b) {
            sum += f64::from(srgb_from_linear(a) - srgb_from_linear(b)).powi(2);
            count += 1;
        }
    }
    -10.0 * (sum / count.max(1) as f64).log10()
}

/// PSNR of the first view as it stands against the second: what a warp to the wrong place cannot beat, dB.
fn unmoved_psnr(reference: &Reference, truth: &Picture) -> f64 {
    let known = reference
        .colour
        .iter()
        .zip(&truth.rgb)
        .zip(&reference.depth)
        .filter(|(_, z)| !z.is_nan());
    psnr(known.map(|((a, b), _)| (*a, *b)))
}

/// Holds a warp with the right convention and one with a wrong one to the bound between them.
///
/// The bound is the first view as it stands, and 2 dB more: 2 dB is more than rounding to whole pixels and real
/// photographs' differences blur, and less than any right warp of these pairs gains.
#[track_caller]
fn assert_only_right_is_near(what: &str, unmoved: f64, right: f64, wrong: f64) {
    let bound = unmoved + 2.0;
    println!("{what}: as it stands {unmoved:.2} dB, warped {right:.2}, warped wrongly {wrong:.2}");
    assert!(
        right > bound,
        "{what}: the right convention gives {right:.2} dB, expected more than {bound:.2}"
    );
    assert!(
        wrong < bound,
        "{what}: a wrong convention gives {wrong:.2} dB, expected less than {bound:.2}"
    );
}
