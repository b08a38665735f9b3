//! The windows of a picture: small parts, spread over the covered area, more of them where contrast is.
//!
//! Takes a coarse picture, gives cameras of parts of it. The picture is cut into cells; a cell counts by its contrast and a
//! little by being covered; windows stand at equal steps of that count, row by row (systematic sampling with
//! probability proportional to size), so that they spread over the picture and a mean over all pixels can be
//! estimated from them without bias (Hansen and Hurwitz 1943). No chance is involved: the same picture gives the same
//! windows.

use resample_core::{Camera, Image};

/// A part of a picture.
#[derive(Clone, Debug)]
pub(super) struct Window {
    pub(super) camera: Camera,
    /// The chance with which a draw takes this cell.
    pub(super) chance: f64,
    /// How often it was drawn.
    pub(super) draws: usize,
}

/// The windows of a picture.
#[derive(Clone, Debug)]
pub(super) struct Windows {
    pub(super) list: Vec<Window>,
    /// Cells that could have been drawn.
    pub(super) cells: usize,
    /// Covered pixels of the coarse picture.
    pub(super) covered_px: f64,
}

/// Share of the count that a covered cell has without contrast, of the mean: flat parts hold little error, but not none.
/// A guess.
const FLOOR: f64 = 0.25;

/// Smallest part of alpha that counts as covered, as in the figures of `resample compare`.
const COVERED: f32 = 1.0 / 255.0;

/// One window: the whole picture. Its covered area is known once it is drawn.
pub(super) fn whole(camera: &Camera) -> Windows {
    let list = vec![Window {
        camera: *camera,
        chance: 1.0,
        draws: 1,
    }];
    Windows {
        list,
        cells: 1,
        covered_px: 0.0,
    }
}

/// Covered pixels of a picture.
pub(super) fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().filter(|pixel| pixel[3] > COVERED).count() as f64
}

/// Contrast of a picture for each pixel that it covers: errors come from edges, and count for covered pixels.
pub(super) fn contrast(image: &Image) -> f64 {
    let whole = cell(image, [0, 0], image.width.max(image.height) as u32);
    if whole.covered > 0 {
        whole.contrast / whole.covered as f64
    } else {
        0.0
    }
}

/// How many cells of a side show something.
pub(super) fn covered_cells(camera: &Camera, coarse: &Image, side: u32) -> usize {
    cells(camera, coarse, side)
        .iter()
        .filter(|cell| cell.covered > 0)
        .count()
}

/// A picture as large as the camera's, of the pixels of a smaller one.
pub(super) fn enlarged(image: Image, camera: &Camera) -> Image {
    let [width, height] = [camera.width as usize, camera.height as usize];
    if [image.width, image.height] == [width, height] {
        return image;
    }
    let mut large = Image::transparent(width, height);
    for (index, pixel) in large.rgba.iter_mut().enumerate() {
        let (x, y) = (
            index % width * image.width / width,
            index / width * image.height / height,
        );
        *pixel = image.rgba[y * image.width + x];
    }
    large
}

/// Windows of a side in `count` draws.
pub(super) fn spread(camera: &Camera, coarse: &Image, (side, count): (u32, usize)) -> Windows {
    let cells = cells(camera, coarse, side);
    let covered: Vec<&Cell> = cells.iter().filter(|cell| cell.covered > 0).collect();
    let covered_px: usize = covered.iter().map(|cell| cell.covered).sum();
    let mean = covered.iter().map(|cell| cell.contrast).sum::<f64>() / covered.len().max(1) as f64;
    let size = |cell: &Cell| cell.contrast + FLOOR * mean + f64::MIN_POSITIVE.sqrt();
    let total: f64 = covered.iter().map(|cell| size(cell)).sum();
    let mut list = Vec::new();
    let (mut passed, mut drawn) = (0.0, 0);
    for &cell in &covered {
        passed += size(cell);
        let mut draws = 0;
        while drawn < count && (drawn as f64 + 0.5) / count as f64 * total <= passed {
            (drawn, draws) = (drawn + 1, draws + 1);
        }
        if draws > 0 {
            list.push(Window {
                camera: part(camera, cell.at, side),
                chance: size(cell) / total,
                draws,
            });
        }
    }
    Windows {
        list,
        cells: covered.len(),
        covered_px: covered_px as f64,
    }
}

/// The camera of a part of the picture: the same pixels.
pub(super) fn part(camera: &Camera, at: [u32; 2], side: u32) -> Camera {
    Camera {
        width: side.min(camera.width - at[0]),
        height: side.min(camera.height - at[1]),
        cx: camera.cx - f64::from(at[0]),
        cy: camera.cy - f64::from(at[1]),
        ..*camera
    }
}

/// All cells of a picture, row by row.
fn cells(camera: &Camera, coarse: &Image, side: u32) -> Vec<Cell> {
    let columns = camera.width.div_ceil(side);
    (0..columns * camera.height.div_ceil(side))
        .map(|index| {
            cell(
                coarse,
                [index % columns * side, index / columns * side],
                side,
            )
        })
        .collect()
}

struct Cell {
    at: [u32; 2],
    covered: usize,
    /// Sum of the squared differences of neighbours.
    contrast: f64,
}

fn cell(image: &Image, at: [u32; 2], side: u32) -> Cell {
    let [x0, y0] = at.map(|a| a as usize);
    let (x1, y1) = (
        (x0 + side as usize).min(image.width),
        (y0 + side as usize).min(image.height),
    );
    let mut cell = Cell {
        at,
        covered: 0,
        contrast: 0.0,
    };
    for y in y0..y1 {
        for x in x0..x1 {
            let pixel = image.rgba[y * image.width + x];
            cell.covered += usize::from(pixel[3] > COVERED);
            // The last row and column have one neighbour less.
            let right = image.rgba[y * image.width + (x + 1).min(image.width - 1)];
            let below = image.rgba[(y + 1).min(image.height - 1) * image.width + x];
            for k in 0..3 {
                cell.contrast +=
                    f64::from(pixel[k] - right[k]).powi(2) + f64::from(pixel[k] - below[k]).powi(2);
            }
        }
    }
    cell
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use resample_core::LookAt;

    use super::*;

    fn camera() -> Camera {
        let pose = LookAt {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        Camera::perspective(&pose, 0.5, [64, 48]).expect("a camera")
    }

    /// Covered in the right half, with contrast in its upper part.
    fn picture() -> Image {
        let mut image = Image::transparent(64, 48);
        for (index, pixel) in image.rgba.iter_mut().enumerate() {
            let (x, y) = (index % 64, index / 64);
            if x >= 32 {
                let light = if y < 16 && (x + y) % 2 == 0 { 1.0 } else { 0.5 };
                *pixel = [light, light, light, 1.0];
            }
        }
        image
    }

    #[test]
    fn windows_stand_on_what_is_covered_and_mostly_on_contrast() {
        let windows = spread(&camera(), &picture(), (16, 6));
        assert_eq!(
            (windows.cells, windows.covered_px),
            (6, 1536.0),
            "cells of the right half"
        );
        assert_eq!(covered_cells(&camera(), &picture(), 16), 6, "counted alike");
        let draws: usize = windows.list.iter().map(|window| window.draws).sum();
        assert_eq!(draws, 6, "as many as asked for");
        let above = windows.list.iter().filter(|window| window.camera.cy > 23.0);
        assert!(
            above.map(|window| window.draws).sum::<usize>() >= 4,
            "contrast draws more"
        );
        assert!(
            windows.list.iter().all(|window| window.camera.cx <= 0.0),
            "never on what is empty"
        );
    }

    #[test]
    fn a_narrow_thing_has_more_contrast_than_a_wide_one() {
        let mut narrow = picture();
        narrow
            .rgba
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| i % 64 >= 34)
            .for_each(|(_, pixel)| *pixel = [0.0; 4]);
        assert!(
            contrast(&narrow) > contrast(&picture()),
            "edges count for fewer pixels"
        );
        assert_eq!(
            contrast(&Image::transparent(64, 48)),
            0.0,
            "nothing has none"
        );
    }

    #[test]
    fn a_smaller_picture_stands_for_a_large_one() {
        let large = enlarged(picture(), &camera().resized(128, 96).expect("a camera"));
        assert_eq!((large.width, large.height), (128, 96));
        assert_eq!(
            covered_px(&large),
            4.0 * covered_px(&picture()),
            "each pixel four times"
        );
        assert_eq!(
            large.rgba[37 * 128 + 81],
            picture().rgba[18 * 64 + 40],
            "where it was"
        );
    }

    #[test]
    fn an_empty_picture_has_no_windows() {
        let windows = spread(&camera(), &Image::transparent(64, 48), (16, 4));
        assert!(windows.list.is_empty() && windows.covered_px == 0.0);
    }
}
