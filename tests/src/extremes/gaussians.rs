//! 3-D Gaussians at extremes: needles and plates, the eye inside, opacity 1, far from the origin, files with NaN.

use std::io::Write;
use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use resample_core::{Camera, Image, LookAt};
use volsplat::{Gaussian, GaussianLoadOptions, GaussianOptions, GaussianRenderer, Gaussians};

use super::row::{Claim, Result, Row};
use crate::gaussians::twin::GaussianTwin;

/// Pixels along a side.
const SIDE: usize = 33;

const OPACITY: Claim = Claim {
    quantity: "opacity of Gaussians",
    bound: 5e-3,
    why: "rays and ellipsoids meet in the eye's coordinates; a pixel has one sample or four, the truth has 64 rays",
};

const CUT: Claim = Claim {
    quantity: "opacity of a Gaussian around the eye",
    bound: 0.02,
    why: "its profile along the ray is a parabola: a cut is off by at most 0.031 of the optical depth",
};

const ALONG: Claim = Claim {
    quantity: "opacity of a needle along the view",
    bound: 0.05,
    why: "the pixel's Gaussian is that at the depth of the centre, and its profile is a parabola",
};

const SOUND: Claim = Claim {
    quantity: "numbers of a picture of Gaussians that are NaN, infinite or below 0, or an opacity above 1",
    bound: 0.0,
    why: "scales and opacities are kept off the numbers that have no quotient",
};

const ONE: Claim = Claim {
    quantity: "opacity in the middle of a Gaussian of opacity 1",
    bound: 1e-5,
    why: "an opacity is held 2^-20 below 1, where its optical depth is finite",
};

const MOVED: Claim = Claim {
    quantity: "colour and opacity of Gaussians, against the same at the origin",
    bound: 2e-6,
    why: "centres are relative to an origin in f64, and the eye is subtracted in f64",
};

const LEFT_OUT: Claim = Claim {
    quantity: "Gaussians of a file that are drawn",
    bound: 0.0,
    why: "a Gaussian with a number that is not finite is left out, with a count",
};

const REFUSED: Claim = Claim {
    quantity: "refused before any work",
    bound: 0.0,
    why: "numbers are checked where they come in",
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (claim, extreme, eye, scales, opacity) in [
        (
            OPACITY,
            "a needle, 1e6 times as long as thick",
            5.0,
            [3e5, 0.3, 0.3],
            0.8,
        ),
        (OPACITY, "a needle of no width", 5.0, [1.0, 1e-6, 1e-6], 0.8),
        (
            OPACITY,
            "a plate, 1e6 times as wide as thick",
            5.0,
            [1.0, 1.0, 1e-6],
            0.8,
        ),
        (OPACITY, "no thickness", 5.0, [0.5, 0.5, 0.0], 0.8),
        (OPACITY, "opacity 1e-3", 5.0, [0.5, 0.4, 0.6], 1e-3),
        (OPACITY, "1e-4 px", 1e6, [0.01, 0.01, 0.01], 0.8),
        (
            OPACITY,
            "as large as 1e6 pictures",
            5.0,
            [1e6, 1e6, 1e6],
            0.8,
        ),
        (CUT, "across the eye plane", 0.3, [0.5, 0.4, 0.6], 0.5),
        (
            CUT,
            "the eye 1e-3 from the centre",
            1e-3,
            [0.5, 0.4, 0.6],
            0.5,
        ),
        (
            ALONG,
            "a needle from before the eye to behind it",
            0.5,
            [0.3, 0.3, 3e5],
            0.5,
        ),
    ] {
        let gaussian = Gaussian {
            centre: Vec3::ZERO,
            // Nearly towards the eye.
            rotation: Quat::from_rotation_x(0.1) * Quat::from_rotation_y(0.05),
            scales: Vec3::from(scales),
            opacity,
            colour: Vec3::new(0.8, 0.5, 0.2),
        };
        let gaussians = Arc::new(of(&[gaussian], DVec3::ZERO));
        let camera = camera(eye, DVec3::ZERO)?;
        let image = drawn(&gaussians, &camera)?;
        let twin = GaussianTwin::new(&gaussians, &camera);
        let pixels = [[16, 16], [16, 20], [10, 16], [2, 30]];
        let pairs = pixels.map(|[x, y]| [f64::from(image.pixel(x, y)[3]), twin.pixel(x, y)[3]]);
        rows.push(claim.worst(extreme, pairs));
        rows.push(SOUND.row(extreme, [unsound(&image), 0.0]));
    }
    rows.extend(opaque()?);
    rows.extend(moved()?);
    rows.extend(not_finite()?);
    Ok(rows)
}

fn opaque() -> Result<Vec<Row>> {
    let gaussian = Gaussian {
        centre: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        scales: Vec3::splat(1e3),
        opacity: 1.0,
        colour: Vec3::ONE,
    };
    let mut rows = Vec::new();
    let camera = camera(5e3, DVec3::ZERO)?;
    // Behind the pixel's Gaussian.
    let sigma2_px = (1e3 * camera.fx / 5e3).powi(2);
    let kept = sigma2_px / (sigma2_px + 0.25);
    for (count, truth) in [(1, kept), (1000, 1.0)] {
        let gaussians = Arc::new(of(&vec![gaussian; count], DVec3::ZERO));
        let image = drawn(&gaussians, &camera)?;
        let extreme = format!("{count} at one place");
        rows.push(ONE.row(&*extreme, [f64::from(image.pixel(16, 16)[3]), truth]));
        rows.push(SOUND.row(extreme, [unsound(&image), 0.0]));
    }
    Ok(rows)
}

fn moved() -> Result<Vec<Row>> {
    let some: Vec<Gaussian> = (0..20)
        .map(|i| Gaussian {
            centre: Vec3::new(
                (i as f32).sin(),
                (1.7 * i as f32).cos(),
                0.1 * i as f32 - 1.0,
            ),
            rotation: Quat::from_rotation_x(i as f32),
            scales: Vec3::new(0.3, 0.1, 0.05),
            opacity: 0.7,
            colour: Vec3::new(0.05 * i as f32, 0.5, 0.2),
        })
        .collect();
    let at = |offset: f64| -> Result<Image> {
        let offset = DVec3::splat(offset);
        drawn(&Arc::new(of(&some, offset)), &camera(5.0, offset)?)
    };
    let here = at(0.0)?;
    let mut rows = Vec::new();
    for offset in [1e5, 1e7] {
        let there = at(offset)?;
        let pairs = there.rgba.iter().flatten().zip(here.rgba.iter().flatten());
        let pairs = pairs.map(|(a, b)| [f64::from(*a), f64::from(*b)]);
        rows.push(MOVED.worst(format!("{offset:e} units from the origin"), pairs));
    }
    Ok(rows)
}

fn not_finite() -> Result<Vec<Row>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("damaged.ply");
    let names =
        "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let good = "0 0 0 1 1 1 2 -1 -1 -1 1 0 0 0";
    // Each row but the first two has one NaN; the second has a scale whose exponential is infinite.
    let mut lines = vec![good.to_owned(), good.replacen("-1", "1e30", 1)];
    let columns = names.split(' ').count();
    lines.extend((0..columns).map(|wrong| {
        let words = good.split(' ').enumerate();
        let words = words.map(|(at, word)| if at == wrong { "nan" } else { word });
        words.collect::<Vec<_>>().join(" ")
    }));
    let write = |lines: &[String]| -> Result<()> {
        let mut file = std::fs::File::create(&path)?;
        write!(
            file,
            "ply\nformat ascii 1.0\nelement vertex {}\n",
            lines.len()
        )?;
        for name in names.split(' ') {
            writeln!(file, "property float {name}")?;
        }
        write!(file, "end_header\n{}\n", lines.join("\n"))?;
        Ok(())
    };
    let options = GaussianLoadOptions::default();
    write(&lines)?;
    let (read, notes) = volsplat::load_gaussians(&path, &options)?;
    let mut rows = vec![LEFT_OUT.row(
        "NaN in each of 14 properties in turn, and a scale beyond f32",
        [read.len() as f64, 1.0],
    )];
    rows.push(LEFT_OUT.row("the same: notes", [notes.len() as f64, 1.0]));
    write(&lines[1..])?;
    let extreme = "a file of Gaussians that are all NaN";
    rows.push(REFUSED.refused(extreme, volsplat::load_gaussians(&path, &options)));
    Ok(rows)
}

fn of(all: &[Gaussian], origin: DVec3) -> Gaussians {
    let mut gaussians = Gaussians::with_capacity(0, all.len());
    gaussians.origin_in_world = origin;
    for gaussian in all {
        gaussians.push(gaussian, &[]).expect("finite numbers");
    }
    gaussians
}

/// From so far in front of a place.
fn camera(distance: f64, place: DVec3) -> Result<Camera> {
    let pose = LookAt {
        position: place + DVec3::new(0.0, 0.0, distance),
        target: place - DVec3::new(0.0, 0.0, 1.0),
        up: DVec3::Y,
    };
    Ok(Camera::perspective(&pose, 0.7, [SIDE as u32; 2])?)
}

fn drawn(gaussians: &Arc<Gaussians>, camera: &Camera) -> Result<Image> {
    let mut renderer = GaussianRenderer::new(gaussians.clone(), &GaussianOptions::default())?;
    Ok(renderer.render(camera)?.image)
}

fn unsound(image: &Image) -> f64 {
    let wrong = |pixel: &&[f32; 4]| {
        pixel.iter().any(|value| !value.is_finite() || *value < 0.0) || pixel[3] > 1.0
    };
    image.rgba.iter().filter(wrong).count() as f64
}
