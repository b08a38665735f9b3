//! COLMAP's text model: `images.txt`, with `cameras.txt` beside it.
//!
//! An image has two lines: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and its points, which may be empty. Poses
//! are world-to-camera; axes x right, y down, z forward; pixel centres at one half. The picture's name is the camera's.
//! Source: COLMAP's description of its output formats. Limits: lens models without distortion, or with all of its
//! coefficients 0; other pictures must be undistorted first.

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};
use resample_core::camera::PixelCentre;

use super::entry::{CameraSet, Entry, Lens, camera};
use super::trajectory::{content, numbers, rotation};
use resample_io::files::read_text;

type Lenses<'a> = HashMap<&'a str, (Lens, [u32; 2])>;

pub(super) fn is_it(text: &str) -> bool {
    let first = content(text).next();
    first.is_some_and(|(_, words)| words.len() >= 10 && numbers(&words[..9]).is_some())
}

pub(super) fn read(path: &Path, text: &str) -> Result<CameraSet, String> {
    let beside = path.with_file_name("cameras.txt");
    let cameras = read_text(&beside)
        .map_err(|error| format!("its lenses must stand in a cameras.txt beside it: {error}"))?;
    let lenses = lenses(&cameras).map_err(|what| format!("{}: {what}", beside.display()))?;
    let mut entries = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        entries.push(image(line, &lenses).map_err(|what| format!("line {}: {what}", index + 1))?);
        // The line of points, empty without points.
        lines.next();
    }
    Ok(CameraSet {
        format: "COLMAP model",
        entries,
        pair: None,
    })
}

fn image(line: &str, lenses: &Lenses) -> Result<Entry, String> {
    let expected = "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, pose @ .., _, _] = words.get(..10).ok_or(expected)? else {
        return Err(expected.into());
    };
    let pose = numbers(pose).ok_or(expected)?;
    let (id, name) = (words[8], words[9..].join(" "));
    let (lens, size) = lenses
        .get(id)
        .ok_or_else(|| format!("no camera {id} in cameras.txt"))?;
    let turn = rotation(DQuat::from_xyzw(pose[1], pose[2], pose[3], pose[0]))?;
    let camera_from_world =
        DAffine3::from_rotation_translation(turn, DVec3::new(pose[4], pose[5], pose[6]));
    let camera = camera(lens, *size, camera_from_world).map_err(|error| error.to_string())?;
    Ok(Entry { name, camera })
}

fn lenses(text: &str) -> Result<Lenses<'_>, String> {
    let one = |(number, words): (usize, Vec<&'_ str>)| {
        lens(&words)
            .map_err(|what| format!("line {number}: {what}"))
            .map(|lens| (number, lens))
    };
    content(text)
        .map(|(number, words)| {
            let id = words[0];
            one((number, words)).map(|(_, lens)| (id, lens))
        })
        .collect()
}

fn lens(words: &[&str]) -> Result<(Lens, [u32; 2]), String> {
    let expected = "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS";
    let [_, model, width, height, parameters @ ..] = words else {
        return Err(expected.into());
    };
    let side = |word: &str| word.parse::<u32>().map_err(|_| expected.to_owned());
    let size = [side(width)?, side(height)?];
    let parameters = numbers(parameters).ok_or(expected)?;
    let one_focal = matches!(
        *model,
        "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE"
    );
    let two_focals = matches!(*model, "PINHOLE" | "OPENCV" | "FULL_OPENCV");
    if model.contains("FISHEYE") || !(one_focal || two_focals) {
        return Err(format!(
            "the lens model {model} is not read: undistort the pictures to PINHOLE first"
        ));
    }
    let taken = if one_focal { 3 } else { 4 };
    let (taken, distortion) = parameters.split_at_checked(taken).ok_or(expected)?;
    if distortion.iter().any(|&coefficient| coefficient != 0.0) {
        return Err(format!(
            "the lens model {model} has distortion, which is not read: undistort the pictures first (colmap image_undistorter)"
        ));
    }
    let (fx, fy) = if one_focal {
        (taken[0], taken[0])
    } else {
        (taken[0], taken[1])
    };
    let [cx, cy] = [taken[taken.len() - 2], taken[taken.len() - 1]];
    Ok((
        Lens {
            fx,
            fy,
            cx,
            cy,
            pixel_centre: PixelCentre::Half,
        },
        size,
    ))
}
