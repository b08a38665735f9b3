//! Depth and colour on other pixels, against scenes with a formula.

use resample_core::LookAt;

use super::*;
use resample_io::Stored;

fn camera(size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position: [0.0; 3].into(),
        target: [0.0, 0.0, 1.0].into(),
        up: [0.0, -1.0, 0.0].into(),
    };
    Camera::perspective(&pose, 0.9, size).expect("a good camera")
}

/// The scene at a place: a tilted wall and, left of the line x = -0.1 + 0.1 y, a nearer one. Camera z and
/// colour.
fn scene(on_plane: DVec2) -> (f64, [f32; 3]) {
    let is_near = on_plane.x < -0.1 + 0.1 * on_plane.y;
    if is_near {
        (2.0 / (1.0 + 0.3 * on_plane.y), [0.8, 0.3, 0.1])
    } else {
        (
            6.0 / (1.0 - 0.4 * on_plane.x + 0.2 * on_plane.y),
            [0.1, 0.2, 0.5],
        )
    }
}

fn on_plane(camera: &Camera, index: usize) -> DVec2 {
    let width = camera.width as usize;
    let pixel = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
    (pixel - DVec2::new(camera.cx, camera.cy)) / DVec2::new(camera.fx, camera.fy)
}

fn pixels(camera: &Camera) -> usize {
    camera.width as usize * camera.height as usize
}

/// The scene's picture; `place` gives the ray on the plane z = 1 of a position of the picture.
fn picture(camera: &Camera, place: impl Fn(DVec2) -> DVec2) -> Picture {
    Picture {
        width: camera.width as usize,
        height: camera.height as usize,
        rgb: (0..pixels(camera))
            .map(|index| scene(place(on_plane(camera, index))).1)
            .collect(),
        coverage: None,
    }
}

fn plane(camera: &Camera, place: impl Fn(DVec2) -> DVec2) -> Plane {
    Plane {
        width: camera.width as usize,
        height: camera.height as usize,
        values: (0..pixels(camera))
            .map(|index| scene(place(on_plane(camera, index))).0 as f32)
            .collect(),
        stored: Stored::Float,
    }
}

/// Parts of the pixels whose distance is off by more than 1 %, and the largest error of the others.
fn wrong(found: &[f32], camera: &Camera) -> (f64, f64) {
    let (mut count, mut worst) = (0, 0.0f64);
    for (index, &z) in found.iter().enumerate() {
        let expected = scene(on_plane(camera, index)).0;
        let error = (f64::from(z) / expected - 1.0).abs();
        if error <= 0.01 {
            worst = worst.max(error);
        } else {
            count += 1;
        }
    }
    (f64::from(count) / found.len() as f64, worst)
}

#[test]
fn depth_of_another_size_has_its_edges_where_the_colours_are() {
    let large = camera([320, 240]);
    let photo = picture(&large, |at| at);
    for size in [[160, 120], [80, 60], [40, 30], [64, 48], [640, 480]] {
        let small = large.resized(size[0], size[1]).expect("a size");
        let lens = Lens {
            camera: &large,
            model: Model::Pinhole,
            size: [320, 240],
        };
        let found = distances(&plane(&small, |at| at), &photo, &lens);
        let (wrong, worst) = wrong(&found, &large);
        // The edge crosses 240 rows: less than a pixel of each may be on the wrong side.
        assert!(
            wrong < 0.5 / 320.0,
            "{size:?}: {wrong} of the pixels are on the other wall"
        );
        // Where the edge meets the border, a sample of the coarsest grid has no neighbour of its own along one axis, and
        // the wall's slope there is unknown.
        let allowed = if size == [40, 30] { 5e-3 } else { 1e-5 };
        assert!(worst < allowed, "{size:?}: planes are off by {worst}");
    }
}

#[test]
fn without_a_difference_in_colour_the_nearest_sample_decides() {
    let large = camera([320, 240]);
    let mut photo = picture(&large, |at| at);
    photo.rgb.fill([0.5; 3]);
    let small = large.resized(80, 60).expect("a size");
    let lens = Lens {
        camera: &large,
        model: Model::Pinhole,
        size: [320, 240],
    };
    let found = distances(&plane(&small, |at| at), &photo, &lens);
    let (wrong, worst) = wrong(&found, &large);
    assert!(
        wrong < 2.0 / 320.0,
        "at most half a sample of four pixels: {wrong}"
    );
    assert!(worst < 1e-5, "no distance between the two walls: {worst}");
}

/// The ray that a lens puts at `distorted`, by fixed-point iteration.
fn undistort(distortion: &Distortion, distorted: DVec2) -> DVec2 {
    let mut at = distorted;
    for _ in 0..100 {
        let put = distortion.distort(at).expect("within reach");
        at += distorted - put;
    }
    at
}

#[test]
fn a_distorted_picture_and_its_depth_become_those_of_the_pinhole() {
    let taken = camera([320, 240]);
    let radial = [-0.12, 0.03, 0.0, 0.0, 0.0, 0.0];
    let distortion = Distortion::new(radial, [0.002, -0.001]).expect("distorted");
    let place = |at: DVec2| undistort(&distortion, at);
    let photo = picture(&taken, place);
    let lens = Lens {
        camera: &taken,
        model: Model::Distorted(&distortion),
        size: [320, 240],
    };
    let found = distances(&plane(&taken, place), &photo, &lens);
    let (wrong, worst) = wrong(&found, &taken);
    assert!(wrong < 1.0 / 320.0, "{wrong} of the pixels");
    assert!(
        worst < 2e-4,
        "planes bend by {worst} in a cell of a curved lens"
    );
    let straight = seen(&photo, &lens);
    let truth = picture(&taken, |at| at);
    let off = |index: &usize| {
        let apart = |c: usize| (straight.rgb[*index][c] - truth.rgb[*index][c]).abs();
        (0..3).any(|c| apart(c) > 1e-3)
    };
    // The picture has one edge; the spline is at most four pixels wide there.
    let changed = (0..pixels(&taken)).filter(off).count();
    assert!(changed < 240 * 14, "{changed} pixels differ");
}
