//! The windows of a picture: small parts, spread over the covered area, more of them where contrast is.
//!
//! Takes a small preview of a picture, gives cameras of parts of it. The picture is cut into cells; a cell counts by its
//! contrast and a little by being covered. Each draw takes a cell with a probability in proportion to its count, so that a
//! mean over all pixels can be estimated without bias (Hansen and Hurwitz 1943). Draws follow the sequence of van der
//! Corput, so that any number of them spreads over the picture. No chance is involved: the same picture gives the same
//! windows.

use crate::{Camera, Image};

/// The cells of a picture that show something.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Their left upper pixels, row by row, each with the sum of the counts up to and with its own.
    list: Vec<([u32; 2], f64)>,
    /// The sum of the squared changes of each between two settings; empty where these were not compared.
    changes: Vec<f64>,
    camera: Camera,
    side_px: u32,
    /// Pixels around a cell that its window holds beside it.
    margin_px: u32,
    /// The sum of the squared changes of the whole picture, where its own pixels were compared.
    whole_change: Option<f64>,
    /// Where windows follow the largest changes of the picture: each cell's largest change and its place in the list, largest
    /// first. Empty where they are drawn.
    ranks: Vec<(f64, usize)>,
    /// Pixels of the picture that are covered.
    pub covered_px: f64,
    /// Contrast for each covered pixel.
    pub contrast: f64,
}

/// A part of a picture.
#[derive(Clone, Debug)]
pub struct TrialWindow {
    /// Draws the window.
    pub camera: Camera,
    /// The left upper pixel of its cell.
    pub at: [u32; 2],
    /// The chance with which a draw takes this cell.
    pub chance: f64,
    /// How often it was drawn.
    pub draws: usize,
    /// The change of its pixels between two settings, where these were compared: the largest where cells are ranked by it, else
    /// the sum of squares.
    pub change: Option<f64>,
}

/// Share of the count that a covered cell has without contrast, of the mean: flat parts hold little error, but not none.
/// A guess.
const FLOOR: f64 = 0.25;

/// Smallest part of alpha that counts as covered, as in the figures of `resample compare`.
pub const COVERED: f32 = 1.0 / 255.0;

impl Cells {
    /// The covered cells of this side, after a preview of the picture.
    ///
    /// `steps` has them by the error of long steps: the preview under another setting, where one was drawn. Contrast shows where
    /// pixels are too few, and not where steps are: in thin parts, and along a spacing that is unlike the others.
    pub fn new(camera: &Camera, preview: &Image, steps: Option<&Image>, side_px: u32) -> Self {
        let columns = camera.width.div_ceil(side_px);
        let corners = (0..columns * camera.height.div_ceil(side_px))
            .map(|index| [index % columns * side_px, index / columns * side_px]);
        let seen = |at: [u32; 2]| {
            let pixels = pixels_of(preview, camera, at, side_px);
            let changed = steps.map_or(0.0, |steps| change(preview, steps, pixels));
            Some((at, contrast(preview, pixels)?, changed))
        };
        let shown: Vec<([u32; 2], f64, f64)> = corners.filter_map(seen).collect();
        let cells = shown.len().max(1) as f64;
        let mean = shown.iter().map(|(_, contrast, _)| contrast).sum::<f64>() / cells;
        let mean_change = shown.iter().map(|(.., change)| change).sum::<f64>() / cells;
        // Both counts weigh the same over the whole picture, so that either finds its cells with half of the draws.
        let per_change = mean / mean_change.max(f64::MIN_POSITIVE.sqrt());
        let mut passed = 0.0;
        let count = |(at, contrast, change): ([u32; 2], f64, f64)| {
            passed += contrast + per_change * change + FLOOR * mean + f64::MIN_POSITIVE.sqrt();
            (at, passed)
        };
        let covered = preview
            .rgba
            .iter()
            .filter(|pixel| pixel[3] > COVERED)
            .count();
        let whole = [[0, preview.width], [0, preview.height]];
        let changes = shown.iter().map(|(.., change)| *change);
        Self {
            changes: steps.map_or(Vec::new(), |_| changes.collect()),
            list: shown.into_iter().map(count).collect(),
            whole_change: steps.and_then(|steps| whole_change(preview, steps, camera)),
            ranks: Vec::new(),
            camera: *camera,
            side_px,
            margin_px: 0,
            covered_px: covered as f64 / preview.rgba.len().max(1) as f64 * pixels(camera),
            contrast: contrast(preview, whole).unwrap_or(0.0) / covered.max(1) as f64,
        }
    }

    /// The cells of the same picture after its preview under another setting too.
    pub fn with_steps(&self, preview: &Image, steps: &Image) -> Self {
        Self::new(&self.camera, preview, Some(steps), self.side_px)
    }

    /// The cells of the same picture after another drawing of it.
    pub fn of(&self, image: &Image) -> Self {
        Self::new(&self.camera, image, None, self.side_px)
    }

    /// Ranks the cells by the largest change of one pixel between two settings' pictures of all pixels: where the largest error is asked
    /// for, all pixels were looked at, and only the cells that change most are drawn with the exact setting. Windows have a margin of the
    /// pixels that are not compared, so that no pixel of a cell is missed.
    pub fn rank(&mut self, image: &Image, other: &Image, margin_px: u32) {
        let change = |(place, (at, _)): (usize, &([u32; 2], f64))| {
            let end = |k: usize, length: u32| (at[k] + self.side_px).min(length) as usize;
            let columns = [at[0] as usize, end(0, self.camera.width)];
            let rows = [at[1] as usize, end(1, self.camera.height)];
            (largest_change(image, other, [columns, rows]), place)
        };
        let mut ranks: Vec<(f64, usize)> = self.list.iter().enumerate().map(change).collect();
        ranks.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.ranks = ranks;
        self.margin_px = margin_px;
    }

    /// Has the changes between two other settings stand for those of before; chances stay as they are.
    pub fn recompare(&mut self, image: &Image, other: &Image) {
        self.recompare_cells(image, other);
        self.whole_change = whole_change(image, other, &self.camera);
    }

    /// The same for what windows miss alone: the change of the whole picture stays that of before.
    pub fn recompare_cells(&mut self, image: &Image, other: &Image) {
        let of = |&(at, _): &([u32; 2], f64)| {
            change(
                image,
                other,
                pixels_of(image, &self.camera, at, self.side_px),
            )
        };
        self.changes = self.list.iter().map(of).collect();
    }

    /// Adds the error of steps to the change of the whole picture: the change from twice the step, over three. A rule of second order
    /// errs by a third of it; at a narrow peak the order is lower, and the error larger.
    pub fn add_steps(&mut self, image: &Image, long: &Image) {
        /// The square of three.
        const SQUARED: f64 = 9.0;
        let steps = whole_change(image, long, &self.camera);
        if let (Some(all), Some(steps)) = (&mut self.whole_change, steps) {
            *all += steps / SQUARED;
        }
    }

    /// The change of the cell that begins at a pixel; `None` where two settings were not compared.
    pub fn change_at(&self, at: [u32; 2]) -> Option<f64> {
        let place = self.list.iter().position(|(corner, _)| *corner == at)?;
        if self.is_ranked() {
            let mut ranks = self.ranks.iter();
            return ranks.find(|rank| rank.1 == place).map(|rank| rank.0);
        }
        self.changes.get(place).copied()
    }

    /// The mean square of the change between two settings over the covered pixels' red, green and blue; `None` where not all of the
    /// picture's own pixels were compared.
    pub fn mean_square_change(&self) -> Option<f64> {
        let change = self.whole_change?;
        Some(change / (3.0 * self.covered_px.max(1.0)))
    }

    /// The sum of the squared changes of all cells; `None` where two settings were not compared.
    pub fn change(&self) -> Option<f64> {
        (!self.changes.is_empty()).then(|| self.changes.iter().sum())
    }

    /// Returns true if windows follow the largest changes.
    pub fn is_ranked(&self) -> bool {
        !self.ranks.is_empty()
    }

    /// The window of the cell with the largest change among those that no window shows; `None` where all are shown.
    pub fn next_in_rank(&self, windows: &[TrialWindow]) -> Option<TrialWindow> {
        let is_shown = |at: [u32; 2]| windows.iter().any(|window| window.at == at);
        let mut ranks = self
            .ranks
            .iter()
            .map(|&(change, place)| (change, self.list[place].0));
        let (change, at) = ranks.find(|(_, at)| !is_shown(*at))?;
        Some(TrialWindow {
            camera: part(&self.camera, at, self.side_px, self.margin_px),
            at,
            chance: 1.0 / self.list.len() as f64,
            draws: 1,
            change: Some(change),
        })
    }

    /// The largest change of a pixel in the cells that no window shows; `None` where cells are not ranked.
    pub fn change_behind(&self, windows: &[TrialWindow]) -> Option<f64> {
        let next = || self.next_in_rank(windows).and_then(|window| window.change);
        self.is_ranked().then(|| next().unwrap_or_default())
    }

    /// The camera of the whole picture.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.list.len()
    }

    /// The window of a draw; `None` where nothing is shown.
    pub fn window(&self, draw: usize) -> Option<TrialWindow> {
        let &(_, total) = self.list.last()?;
        let target = van_der_corput(draw) * total;
        let place = self.list.partition_point(|(_, passed)| *passed <= target);
        let (at, passed) = self.list[place.min(self.list.len() - 1)];
        let before = place.checked_sub(1).map_or(0.0, |k| self.list[k].1);
        Some(TrialWindow {
            camera: part(&self.camera, at, self.side_px, self.margin_px),
            at,
            chance: (passed - before) / total,
            draws: 1,
            change: self.changes.get(place.min(self.list.len() - 1)).copied(),
        })
    }
}

/// Pixels of a picture.
pub fn pixels(camera: &Camera) -> f64 {
    f64::from(camera.width) * f64::from(camera.height)
}

/// The camera of a part of the picture, and of a margin around it: the same pixels.
fn part(camera: &Camera, at: [u32; 2], side_px: u32, margin_px: u32) -> Camera {
    Camera {
        width: side_px.min(camera.width - at[0]) + 2 * margin_px,
        height: side_px.min(camera.height - at[1]) + 2 * margin_px,
        cx: camera.cx - f64::from(at[0]) + f64::from(margin_px),
        cy: camera.cy - f64::from(at[1]) + f64::from(margin_px),
        ..*camera
    }
}

/// The columns and rows of a preview that show a cell, and one more on each side: small things fall between its pixels.
fn pixels_of(preview: &Image, camera: &Camera, at: [u32; 2], side_px: u32) -> [[usize; 2]; 2] {
    let range = |at: u32, length: u32, shown: usize| {
        let (at, end) = (at as usize, (at + side_px).min(length) as usize);
        let length = length as usize;
        let first = (at * shown / length).saturating_sub(1);
        [first, ((end * shown).div_ceil(length) + 1).min(shown)]
    };
    [
        range(at[0], camera.width, preview.width),
        range(at[1], camera.height, preview.height),
    ]
}

/// The sum of the squared differences of two pictures of one size.
fn change(image: &Image, other: &Image, [columns, rows]: [[usize; 2]; 2]) -> f64 {
    let mut sum = 0.0;
    for y in rows[0]..rows[1] {
        let row = y * image.width + columns[0]..y * image.width + columns[1];
        for (pixel, other) in image.rgba[row.clone()].iter().zip(&other.rgba[row]) {
            let squares = (0..3).map(|k| f64::from(pixel[k] - other[k]).powi(2));
            sum += squares.sum::<f64>();
        }
    }
    sum
}

/// The sum of the squared differences of two pictures; `None` where they are not the camera's own.
fn whole_change(image: &Image, other: &Image, camera: &Camera) -> Option<f64> {
    let [width, height] = [camera.width as usize, camera.height as usize];
    let is_own = [image.width, image.height] == [width, height];
    is_own.then(|| change(image, other, [[0, width], [0, height]]))
}

/// The largest difference of two pictures of one size.
fn largest_change(image: &Image, other: &Image, [columns, rows]: [[usize; 2]; 2]) -> f64 {
    let mut largest = 0.0_f64;
    for y in rows[0]..rows[1] {
        let row = y * image.width + columns[0]..y * image.width + columns[1];
        for (pixel, other) in image.rgba[row.clone()].iter().zip(&other.rgba[row]) {
            for k in 0..3 {
                largest = largest.max(f64::from((pixel[k] - other[k]).abs()));
            }
        }
    }
    largest
}

/// The sum of the squared differences of neighbours; `None` where nothing is covered.
fn contrast(image: &Image, [columns, rows]: [[usize; 2]; 2]) -> Option<f64> {
    let (mut covered, mut sum) = (false, 0.0);
    for y in rows[0]..rows[1] {
        for x in columns[0]..columns[1] {
            let pixel = image.rgba[y * image.width + x];
            covered |= pixel[3] > COVERED;
            // The last row and column have one neighbour less.
            let right = image.rgba[y * image.width + (x + 1).min(image.width - 1)];
            let below = image.rgba[(y + 1).min(image.height - 1) * image.width + x];
            for k in 0..3 {
                sum +=
                    f64::from(pixel[k] - right[k]).powi(2) + f64::from(pixel[k] - below[k]).powi(2);
            }
        }
    }
    covered.then_some(sum)
}

/// The digits of a number in base 2 behind the point, in reverse: 1/2, 1/4, 3/4, 1/8, 5/8 for 0, 1, 2, 3, 4.
fn van_der_corput(index: usize) -> f64 {
    let bits = (index as u32 + 1).reverse_bits();
    f64::from(bits) / 2.0_f64.powi(32)
}

#[cfg(test)]
mod tests {
    use crate::LookAt;
    use glam::DVec3;

    use super::*;

    fn camera(scale: u32) -> Camera {
        let pose = LookAt {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        Camera::perspective(&pose, 0.5, [64 * scale, 48 * scale]).expect("a camera")
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
        // The preview stands for a picture of four times as many pixels.
        let cells = Cells::new(&camera(2), &picture(), None, 32);
        assert_eq!(cells.count(), 9, "the right half, and cells beside it");
        assert_eq!(cells.covered_px, 4.0 * 1536.0);
        let windows: Vec<TrialWindow> = (0..16).filter_map(|draw| cells.window(draw)).collect();
        let above = windows
            .iter()
            .filter(|window| window.camera.cy > 47.0)
            .count();
        assert!(above >= 10, "contrast is drawn more often: {above} of 16");
        assert!(
            windows.iter().all(|window| window.camera.cx <= 32.0),
            "never on what is empty"
        );
        let shares: f64 = windows.iter().map(|w| 1.0 / w.chance).sum::<f64>() / 16.0;
        assert!(
            (shares / 9.0 - 1.0).abs() < 0.2,
            "the mean of the inverse chance is the number of cells: {shares}"
        );
    }

    #[test]
    fn windows_stand_where_long_steps_change_the_picture() {
        let (preview, mut steps) = (picture(), picture());
        // Flat in the preview: contrast alone would hardly ever draw it.
        for y in 40..44 {
            for x in 52..56 {
                steps.rgba[y * 64 + x] = [0.4, 0.4, 0.4, 1.0];
            }
        }
        let drawn = |steps: Option<&Image>| {
            let cells = Cells::new(&camera(1), &preview, steps, 8);
            let windows = (0..16).filter_map(|draw| cells.window(draw));
            let part = camera(1);
            let there =
                |w: &TrialWindow| w.camera.cx == part.cx - 48.0 && w.camera.cy == part.cy - 40.0;
            windows.filter(there).count()
        };
        assert!(drawn(None) <= 1, "contrast does not show it");
        // A cell looks one pixel around it: the patch is 16 pixels of its own, and 9 of three neighbours. Contrast, change and
        // floor are 1, 1 and 1/4 in all: 16/25 of 1/2.25 of 16 draws are 4.6.
        let found = drawn(Some(&steps));
        assert!(found >= 4, "change shows it: {found}");
    }

    #[test]
    fn a_narrow_thing_has_more_contrast_than_a_wide_one() {
        let mut narrow = picture();
        let outside = narrow
            .rgba
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| i % 64 >= 34);
        outside.for_each(|(_, pixel)| *pixel = [0.0; 4]);
        let of = |image: &Image| Cells::new(&camera(1), image, None, 16).contrast;
        assert!(of(&narrow) > of(&picture()), "edges count for fewer pixels");
    }

    #[test]
    fn an_empty_picture_has_no_windows() {
        let empty = Cells::new(&camera(1), &Image::transparent(64, 48), None, 16);
        assert!(empty.window(0).is_none() && empty.covered_px == 0.0 && empty.contrast == 0.0);
    }
}
