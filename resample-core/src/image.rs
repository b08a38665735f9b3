//! The picture that every application ends with: linear, premultiplied, f32.
//!
//! Colour space and alpha state are fixed by the type, so no later stage has to ask: `rgba` is linear light and
//! premultiplied. Straight alpha and sRGB exist only at the edge, where a file format wants them.

mod srgb;

pub use srgb::{linear_from_srgb, srgb_from_linear, srgb8_from_linear};

/// A picture in linear light with premultiplied alpha, with an optional depth plane and named extra planes.
///
/// Rows run from the top; pixel (x, y) is element `y * width + x` of every plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green, blue (linear, premultiplied) and alpha in 0..=1, one entry per pixel.
    pub rgba: Vec<[f32; 4]>,
    /// Camera z of what the pixel shows, in world units; +infinity where it shows nothing.
    pub depth: Option<Vec<f32>>,
    /// Further planes, written as channels of these names where the format allows.
    pub planes: Vec<Plane>,
}

/// One named scalar plane beside the colour, same layout as [`Image::rgba`].
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Channel name, as it will stand in an EXR file.
    pub name: String,
    /// One value per pixel.
    pub values: Vec<f32>,
}

impl Image {
    /// A transparent picture without depth or extra planes.
    ///
    /// ```
    /// use resample_core::Image;
    ///
    /// let image = Image::transparent(2, 1);
    /// assert_eq!(image.pixel(1, 0), [0.0; 4]);
    /// ```
    pub fn transparent(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            rgba: vec![[0.0; 4]; width * height],
            depth: None,
            planes: Vec::new(),
        }
    }

    /// The colour of pixel (x, y), linear and premultiplied.
    pub fn pixel(&self, x: usize, y: usize) -> [f32; 4] {
        self.rgba[y * self.width + x]
    }

    /// The pixels from column and row `first` on, `size` of them along x and y, with depth and planes. All must be inside.
    pub fn window(&self, first: [usize; 2], size: [usize; 2]) -> Self {
        Self {
            width: size[0],
            height: size[1],
            rgba: cut(&self.rgba, self.width, first, size),
            depth: self
                .depth
                .as_ref()
                .map(|depth| cut(depth, self.width, first, size)),
            planes: self
                .planes
                .iter()
                .map(|plane| Plane {
                    name: plane.name.clone(),
                    values: cut(&plane.values, self.width, first, size),
                })
                .collect(),
        }
    }

    /// A transparent picture of another size, with the same planes, all 0.
    pub fn blank(&self, width: usize, height: usize) -> Self {
        let plane = |plane: &Plane| Plane {
            name: plane.name.clone(),
            values: vec![0.0; width * height],
        };
        Self {
            depth: self.depth.as_ref().map(|_| vec![0.0; width * height]),
            planes: self.planes.iter().map(plane).collect(),
            ..Self::transparent(width, height)
        }
    }

    /// Lays the pixels of `tile`, its depth and its planes from column and row `first` on; false where it does not fit in,
    /// or has other planes.
    pub fn paste(&mut self, tile: &Self, first: [usize; 2]) -> bool {
        let names = |image: &Self| {
            image
                .planes
                .iter()
                .map(|plane| plane.name.clone())
                .collect::<Vec<_>>()
        };
        let fits = first[0] + tile.width <= self.width
            && first[1] + tile.height <= self.height
            && self.depth.is_some() == tile.depth.is_some()
            && names(self) == names(tile);
        if !fits {
            return false;
        }
        let (width, own) = (self.width, tile.width);
        lay(&mut self.rgba, width, (&tile.rgba, own), first);
        if let (Some(whole), Some(part)) = (&mut self.depth, &tile.depth) {
            lay(whole, width, (part, own), first);
        }
        for (whole, part) in self.planes.iter_mut().zip(&tile.planes) {
            lay(&mut whole.values, width, (&part.values, own), first);
        }
        true
    }

    /// Adds the rows of a picture as wide as this one, with depth and planes, below its own.
    pub fn append_below(&mut self, band: Self) {
        self.height += band.height;
        self.rgba.extend(&band.rgba);
        if let (Some(above), Some(depth)) = (&mut self.depth, &band.depth) {
            above.extend(depth);
        }
        for (above, plane) in self.planes.iter_mut().zip(&band.planes) {
            above.values.extend(&plane.values);
        }
    }

    /// The picture laid over an opaque background (linear RGB); alpha becomes 1.
    ///
    /// ```
    /// use resample_core::Image;
    ///
    /// let image = Image::transparent(2, 1).over_background([0.25; 3]);
    /// assert_eq!(image.pixel(0, 0), [0.25, 0.25, 0.25, 1.0]);
    /// ```
    pub fn over_background(mut self, background: [f32; 3]) -> Self {
        for pixel in &mut self.rgba {
            let transmittance = 1.0 - pixel[3];
            for (channel, behind) in pixel.iter_mut().zip(background) {
                *channel += transmittance * behind;
            }
            pixel[3] = 1.0;
        }
        self
    }

    /// Red, green and blue of every pixel in sRGB of 8 bits, row by row; of a picture over a background.
    pub fn srgb8(&self) -> Vec<[u8; 3]> {
        let pixel = |&[red, green, blue, _]: &[f32; 4]| [red, green, blue].map(srgb8_from_linear);
        self.rgba.iter().map(pixel).collect()
    }
}

/// A window of a plane whose rows have `width` pixels.
fn cut<T: Copy>(
    plane: &[T],
    width: usize,
    [left, top]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> Vec<T> {
    let row = |y: usize| &plane[y * width + left..][..columns];
    (top..top + rows).flat_map(row).copied().collect()
}

/// Lays a plane whose rows have `columns` pixels over one whose rows have `width`.
fn lay<T: Copy>(
    whole: &mut [T],
    width: usize,
    (part, columns): (&[T], usize),
    [left, top]: [usize; 2],
) {
    for (row, pixels) in part.chunks_exact(columns.max(1)).enumerate() {
        whole[(top + row) * width + left..][..columns].copy_from_slice(pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn over_background_keeps_opaque_and_fills_transparent() {
        let mut image = Image::transparent(2, 1);
        image.rgba[0] = [0.25, 0.5, 0.75, 1.0];
        let image = image.over_background([0.1, 0.2, 0.3]);
        assert_eq!(
            image.rgba,
            vec![[0.25, 0.5, 0.75, 1.0], [0.1, 0.2, 0.3, 1.0]]
        );
    }

    #[test]
    fn pixels_are_found_by_column_and_row() {
        let mut image = Image::transparent(3, 2);
        for (i, pixel) in image.rgba.iter_mut().enumerate() {
            *pixel = [i as f32; 4];
        }
        assert_eq!([image.pixel(2, 0), image.pixel(0, 1)], [[2.0; 4], [3.0; 4]]);
        let window = image.window([1, 0], [2, 2]);
        assert_eq!(window.rgba, [1.0, 2.0, 4.0, 5.0].map(|v| [v; 4]));
        let mut back = image.blank(3, 2);
        assert!(back.paste(&window, [1, 0]), "it fits");
        assert_eq!(back.rgba, [0.0, 1.0, 2.0, 0.0, 4.0, 5.0].map(|v| [v; 4]));
        for first in [[2, 0], [1, 1]] {
            assert!(!back.paste(&window, first), "beyond the rim at {first:?}");
        }
    }

    #[test]
    fn bands_below_one_another_make_the_picture() {
        let numbers = |numbers: &[f32]| Image {
            rgba: numbers.iter().map(|&v| [v; 4]).collect(),
            depth: Some(numbers.iter().map(|v| v + 0.5).collect()),
            planes: vec![Plane {
                name: "u".to_owned(),
                values: numbers.iter().map(|v| v * 10.0).collect(),
            }],
            ..Image::transparent(2, numbers.len() / 2)
        };
        let mut image = numbers(&[1.0, 2.0]);
        image.append_below(numbers(&[3.0, 4.0, 5.0, 6.0]));
        assert_eq!([image.width, image.height], [2, 3]);
        assert_eq!(image.pixel(1, 2), [6.0; 4]);
        assert_eq!(image.depth, Some(vec![1.5, 2.5, 3.5, 4.5, 5.5, 6.5]));
        let values = &image.planes[0].values;
        assert_eq!(values[..], [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
    }

    #[test]
    fn bytes_are_display_colours() {
        let mut image = Image::transparent(2, 1);
        // Half of the light of white is 188 of 255 (IEC 61966-2-1).
        image.rgba = vec![[0.0, 0.5, 1.0, 1.0], [2.0, -1.0, 0.001, 1.0]];
        assert_eq!(image.srgb8(), [[0, 188, 255], [255, 0, 3]]);
    }
}
