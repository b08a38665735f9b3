//! A contact sheet: pictures of one size in rows and columns on white, each over its name.

use glam::DVec2;
use resample_core::Image;
use resample_core::narrow::{cell, single};

use crate::figure::canvas::Canvas;
use crate::figure::parts::Ground;
use crate::figure::text;
use crate::figure::text::Anchor;

/// Height of names, as a share of a picture's side, and the least, px.
const EM_SHARE: f64 = 0.055;
const LEAST_EM_PX: f64 = 11.0;

/// The sheet of pictures with at most `side` pixels a side, in columns, at least one. Names that are too long end in three dots.
pub fn sheet(cells: &[(String, Image)], side: usize, columns: usize) -> Image {
    let em = (EM_SHARE * side as f64).max(LEAST_EM_PX);
    let gap = cell(single(em.ceil()));
    let [across, down] = [side + gap, side + 3 * gap];
    let columns = columns.clamp(1, cells.len().max(1));
    let rows = cells.len().div_ceil(columns).max(1);
    let mut image = Image::transparent(gap + columns * across, gap + rows * down);
    image.rgba.fill([1.0; 4]);
    for (number, (name, picture)) in cells.iter().enumerate() {
        let corner = [
            gap + number % columns * across,
            gap + number / columns * down,
        ];
        let inset = [picture.width, picture.height].map(|length| side.saturating_sub(length) / 2);
        for (y, row) in picture
            .rgba
            .chunks_exact(picture.width)
            .enumerate()
            .take(side)
        {
            let first = corner[0] + inset[0] + image.width * (corner[1] + inset[1] + y);
            for (pixel, over) in image.rgba[first..]
                .iter_mut()
                .zip(&row[..row.len().min(side)])
            {
                let left = 1.0 - over[3];
                *pixel = [over[0] + left, over[1] + left, over[2] + left, 1.0];
            }
        }
        let size = [image.width as f64, image.height as f64];
        let place = DVec2::new(
            corner[0] as f64 + 0.5 * side as f64,
            (corner[1] + side) as f64 + em,
        );
        let mut canvas = Canvas::new(&mut image, [0, 0], size, Ground::Light);
        canvas.text(&fitting(name, em, side as f64), em, place, Anchor::MIDDLE);
    }
    image
}

/// A name that is no wider than `most_px`, cut off at its end.
fn fitting(name: &str, em_px: f64, most_px: f64) -> String {
    let mut letters: Vec<char> = name.chars().take(200).collect();
    let mut shown = name.to_owned();
    while text::size(&shown, em_px).x > most_px && letters.pop().is_some() {
        shown = letters.iter().chain(&['…']).collect();
    }
    shown
}
