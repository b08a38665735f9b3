//! The picture that every application ends with: linear, premultiplied, f32.
//!
//! Colour space and alpha state are fixed by the type, so no later stage has to ask: `rgba` is linear light and
//! premultiplied. Straight alpha and sRGB exist only at the edge, where a file format wants them.

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

    /// The picture laid over an opaque background (linear RGB); alpha becomes 1.
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
        let byte = |linear: f32| (255.0 * srgb_from_linear(linear)).round() as u8;
        let pixel = |&[red, green, blue, _]: &[f32; 4]| [byte(red), byte(green), byte(blue)];
        self.rgba.iter().map(pixel).collect()
    }
}

/// The sRGB transfer curve (IEC 61966-2-1): linear light in 0..=1 to the encoded value in 0..=1.
///
/// Values outside 0..=1 are clamped; NaN becomes 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let linear = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of [`srgb_from_linear`].
pub fn linear_from_srgb(encoded: f32) -> f32 {
    let encoded = if encoded > 0.0 { encoded.min(1.0) } else { 0.0 };
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trip_is_exact_to_eight_bits() {
        for code in 0..=255u8 {
            let encoded = f32::from(code) / 255.0;
            let back = srgb_from_linear(linear_from_srgb(encoded));
            assert!(
                (back - encoded).abs() < 1e-5,
                "code {code}: {back} against {encoded}"
            );
        }
        assert_eq!(srgb_from_linear(f32::NAN), 0.0, "NaN must not reach a file");
    }

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
}
