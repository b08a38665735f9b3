//! Real pairs: a photograph with depth and camera, and the photograph that was taken at the second place.
//!
//! Gives them as the synthetic scenes are given. What the first view sees of the second is found with the second view's
//! own depth: a point counts if the first view has it within 3 % of its depth. Piano and Pipes have no second depth; there
//! it is found with the mask of what both views see.
//!
//! Limits: depth of real pairs is quantised and edges are off by a pixel or two, in the mask as in the depth.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use resample_core::{Camera, Image, Intrinsics, PixelCentre};
use warp3d::Reference;
use warp3d::input::cameras::{self, Hints, Lens};
use warp3d::input::{self, DepthKind, DepthMeaning, Part, colour, depth};

use crate::data::data_file;
use crate::warps::several::SeveralViews;
use crate::warps::truth::{Truth, WarpScene};

/// The names of the pairs.
pub const PAIRS: [&str; 7] = [
    "Cones",
    "Teddy",
    "Art",
    "livingroom",
    "Beachball",
    "Piano",
    "Pipes",
];

/// Depths within this part of each other are one point.
const AGREEMENT: f32 = 0.03;

/// The pair of this name; `None`, with a visible skip line for `test`, where it is absent.
///
/// # Panics
/// If a file is there and cannot be read, or the name is none of [`PAIRS`].
pub fn pair(test: &str, name: &str) -> Option<WarpScene> {
    if let "Piano" | "Pipes" = name {
        return calibrated(test, name);
    }
    let [from, to] = match name {
        "livingroom" => livingroom(test, ["0", "20"])?,
        "Beachball" => beachball(test)?,
        "Art" => middlebury(
            test,
            name,
            ["view1", "view5"],
            ["disp1", "disp5"],
            1.0 / 3.0,
        )?,
        "Cones" | "Teddy" => middlebury(test, name, ["imL", "imR"], ["disp2", "disp6"], 0.25)?,
        _ => panic!("no pair is called {name}"),
    };
    let seen = (0..to.depth.len())
        .map(|i| f32::from(u8::from(sees(&from, &to, i))))
        .collect();
    let image = opaque(&to.colour, [to.camera.width, to.camera.height]);
    let depth = to
        .depth
        .iter()
        .map(|&z| if z.is_nan() { f32::INFINITY } else { z })
        .collect();
    let truth = Truth { image, depth, seen };
    Some(WarpScene {
        name: name.into(),
        reference: from,
        target: to.camera,
        truth,
    })
}

/// Art's middle view, with its outer two as references. A pixel counts as seen where a reference's samples, moved to the middle
/// view one by one, give it the nearest depth.
pub fn art_between(test: &str) -> Option<SeveralViews> {
    let name = "Art";
    let references = middlebury(
        test,
        name,
        ["view1", "view5"],
        ["disp1", "disp5"],
        1.0 / 3.0,
    )?;
    let taken = data_file(test, "rgbd/middlebury-2003/Art/view3.png")?;
    let taken = colour::read(&Part::from_text(&taken.to_string_lossy()))
        .unwrap_or_else(|error| panic!("{error}"));
    let size = [taken.width as u32, taken.height as u32];
    let target = straight(size, 1000.0, DVec3::X * 0.05);
    let nearest = references.each_ref().map(|from| forward(from, &target));
    let depth: Vec<f32> = (0..nearest[0].len())
        .map(|i| nearest[0][i].min(nearest[1][i]))
        .collect();
    let agrees = |of: &[f32], i: usize| (of[i] - depth[i]).abs() <= AGREEMENT * depth[i];
    let seen = nearest.each_ref().map(|of| {
        (0..depth.len())
            .map(|i| f32::from(u8::from(agrees(of, i))))
            .collect()
    });
    Some(SeveralViews {
        name: name.into(),
        references: references.into(),
        target,
        image: opaque(&taken.rgb, size),
        depth,
        seen: seen.into(),
    })
}

/// Frame 5 of the living room from frames 0 and 20.
pub fn livingroom_between(test: &str) -> Option<SeveralViews> {
    let [first, to, last] = livingroom(test, ["0", "5", "20"])?;
    let size = [to.camera.width, to.camera.height];
    let seen = [&first, &last].map(|from| {
        (0..to.depth.len())
            .map(|i| f32::from(u8::from(sees(from, &to, i))))
            .collect()
    });
    Some(SeveralViews {
        name: "livingroom".into(),
        target: to.camera,
        image: opaque(&to.colour, size),
        depth: to
            .depth
            .iter()
            .map(|&z| if z.is_nan() { f32::INFINITY } else { z })
            .collect(),
        seen: seen.into(),
        references: vec![first, last],
    })
}

fn opaque(colours: &[[f32; 3]], size: [u32; 2]) -> Image {
    let mut image = Image::transparent(size[0] as usize, size[1] as usize);
    for (pixel, [r, g, b]) in image.rgba.iter_mut().zip(colours) {
        *pixel = [*r, *g, *b, 1.0];
    }
    image
}

/// The depth of each pixel of `target`: camera z of the nearest sample of `from` that falls into it, world units; infinite where no sample does.
fn forward(from: &Reference, target: &Camera) -> Vec<f32> {
    let (width, height) = (target.width as usize, target.height as usize);
    let mut nearest = vec![f32::INFINITY; width * height];
    for (i, &z) in from.depth.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
        let columns = from.camera.width as usize;
        let pixel = DVec2::new((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5);
        let in_world = (from.camera.camera_from_world.inverse())
            .transform_point3(f64::from(z) * from.camera.ray_in_camera(pixel).1);
        let in_target = target.camera_from_world.transform_point3(in_world);
        let at = target.screen_from_camera(in_target);
        if at.cmpge(DVec2::ZERO).all() && at.x < width as f64 && at.y < height as f64 {
            let slot = &mut nearest[at.y as usize * width + at.x as usize];
            *slot = slot.min(in_target.z as f32);
        }
    }
    nearest
}

fn sees(from: &Reference, to: &Reference, index: usize) -> bool {
    let width = to.camera.width as usize;
    let pixel = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    let z = to.depth[index];
    if z.is_nan() {
        return false;
    }
    let (origin, direction) = to.camera.ray_in_camera(pixel);
    let in_world = to
        .camera
        .camera_from_world
        .inverse()
        .transform_point3(origin + f64::from(z) * direction);
    let in_from = from.camera.camera_from_world.transform_point3(in_world);
    let at = from.camera.screen_from_camera(in_from);
    let size = DVec2::new(f64::from(from.camera.width), f64::from(from.camera.height));
    if !(in_from.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all()) {
        return false;
    }
    let found = from.depth[at.y as usize * from.camera.width as usize + at.x as usize];
    (found - in_from.z as f32).abs() <= AGREEMENT * found
}

/// A pair of which only the left depth is known: what the right view sees is found by warping it, sample by sample, as
/// far as the pair's own mask says that both eyes see a sample.
fn calibrated(test: &str, name: &str) -> Option<WarpScene> {
    let calib = data_file(test, &format!("rgbd/middlebury-2014/{name}/calib.txt"))?;
    let file = |name: &str| calib.with_file_name(name).to_string_lossy().into_owned();
    let set = cameras::read(&calib, &Hints::default())
        .expect("good")
        .expect("a known format");
    let pair = set.pair.expect("a pair");
    let [left, right] = ["0", "1"].map(|eye| set.entry(eye).expect("an eye").camera);
    let disparity = DepthMeaning {
        baseline: Some(pair.baseline),
        doffs: pair.doffs,
        ..DepthMeaning::of(DepthKind::Disparity)
    };
    let reference = read(&file("im0.png"), &file("disp0GT.pfm"), &disparity, |_| left);
    let picture =
        |name: &str| colour::read(&Part::from_text(&file(name))).unwrap_or_else(|e| panic!("{e}"));
    let (taken, mask) = (picture("im1.png"), picture("mask0nocc.png"));
    let both: Vec<f32> = (reference.depth.iter().zip(&mask.rgb))
        .map(|(&z, mask)| if mask[0] > 0.9 { z } else { f32::NAN })
        .collect();
    let seen_by_both = Reference {
        depth: both,
        ..reference.clone()
    };
    let depth = forward(&seen_by_both, &right);
    let image = opaque(&taken.rgb, [right.width, right.height]);
    let truth = Truth {
        seen: depth
            .iter()
            .map(|z| f32::from(u8::from(z.is_finite())))
            .collect(),
        image,
        depth,
    };
    Some(WarpScene {
        name: name.into(),
        reference,
        target: right,
        truth,
    })
}

fn middlebury(
    test: &str,
    name: &str,
    views: [&str; 2],
    disparities: [&str; 2],
    scale: f64,
) -> Option<[Reference; 2]> {
    let file = |name: &str, stem: &str| {
        data_file(test, &format!("rgbd/middlebury-2003/{name}/{stem}.png"))
    };
    // The scale of the scene is free: focal length times baseline is 100 px units.
    let meaning = DepthMeaning {
        scale: Some(scale),
        baseline: Some(0.1),
        ..DepthMeaning::of(DepthKind::Disparity)
    };
    let view = |i: usize| {
        let (picture, codes) = (file(name, views[i])?, file(name, disparities[i])?);
        Some(read(
            &picture.to_string_lossy(),
            &codes.to_string_lossy(),
            &meaning,
            |size| straight(size, 1000.0, DVec3::X * (0.1 * i as f64)),
        ))
    };
    Some([view(0)?, view(1)?])
}

fn livingroom<const N: usize>(test: &str, frames: [&str; N]) -> Option<[Reference; N]> {
    let log = data_file(test, "rgbd/livingroom1/test_scene/trajectory.log")?;
    let folder = log.parent().and_then(Path::parent)?;
    let lens = Lens {
        fx: 525.0,
        fy: 525.0,
        cx: 319.5,
        cy: 239.5,
        pixel_centre: PixelCentre::Integer,
    };
    let hints = Hints {
        size: Some([640, 480]),
        lens: Some(lens),
    };
    let poses = cameras::read(&log, &hints)
        .expect("good")
        .expect("a known format");
    let millimetres = DepthMeaning {
        scale: Some(1e-3),
        ..DepthMeaning::of(DepthKind::Z)
    };
    let view = |frame: &str| {
        let file = |kind: &str, end: &str| {
            folder
                .join(kind)
                .join(format!("{frame:0>5}.{end}"))
                .to_string_lossy()
                .into_owned()
        };
        let camera = poses.entry(frame).expect("the frame's pose").camera;
        read(
            &file("image", "jpg"),
            &file("depth", "png"),
            &millimetres,
            |_| camera,
        )
    };
    Some(frames.map(view))
}

fn beachball(test: &str) -> Option<[Reference; 2]> {
    let path = data_file(test, "rgbd/openexr/Beachball/singlepart.0001.exr")?;
    let path = path.to_string_lossy();
    let z = DepthMeaning::of(DepthKind::Z);
    let view = |picture: &str, depth: &str, x: f64| {
        // Focal length times baseline is 333.32 px units; the left eye stands at negative x.
        read(picture, depth, &z, |size| {
            straight(size, 2000.0, DVec3::X * x)
        })
    };
    let left = view(
        &format!("{path}#left"),
        &format!("{path}#left.Z"),
        -333.32 / 2000.0,
    );
    Some([view(&path, &format!("{path}#Z"), 0.0), left])
}

fn read(
    picture: &str,
    depth_file: &str,
    meaning: &DepthMeaning,
    camera: impl Fn([u32; 2]) -> Camera,
) -> Reference {
    let picture = colour::read(&Part::from_text(picture)).unwrap_or_else(|error| panic!("{error}"));
    let part = Part::from_text(depth_file);
    let stored = depth::read(&part).unwrap_or_else(|error| panic!("{error}"));
    let camera = camera([picture.width as u32, picture.height as u32]);
    input::reference(picture, &stored, camera, meaning, &part.path)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// A camera at `eye` that looks along +z, with the centre of the picture on its axis.
pub fn straight(size: [u32; 2], focal_px: f64, eye: DVec3) -> Camera {
    let [width, height] = size;
    let (cx, cy) = (0.5 * f64::from(width), 0.5 * f64::from(height));
    let k = Intrinsics {
        width,
        height,
        fx: focal_px,
        fy: focal_px,
        cx,
        cy,
        pixel_centre: PixelCentre::Half,
    };
    Camera::from_intrinsics(&k, DMat3::IDENTITY, -eye, 1e-3).expect("a good camera")
}
