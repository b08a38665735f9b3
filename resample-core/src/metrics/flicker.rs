//! Flicker: the difference between the changes of a row of pictures, from one to the next, and the changes of its truth.

use crate::Image;
use crate::metrics::Mask;

/// Changes from picture to picture, against the changes of the truth.
#[derive(Clone, Debug, Default)]
pub struct Flicker {
    before: Option<(Image, Image)>,
    sum_of_squares: f64,
    count: usize,
}

impl Flicker {
    /// Takes the next pair of pictures, both of the size of those before.
    pub fn add(&mut self, picture: Image, reference: Image, mask: Option<&Mask>) {
        if let Some((before, reference_before)) = &self.before {
            let changes = picture.rgba.iter().zip(&before.rgba);
            let expected = reference.rgba.iter().zip(&reference_before.rgba);
            for (index, ((now, then), (expected_now, expected_then))) in
                changes.zip(expected).enumerate()
            {
                if mask.is_some_and(|mask| !mask.inside()[index]) {
                    continue;
                }
                for k in 0..3 {
                    let change = f64::from(now[k]) - f64::from(then[k]);
                    let expected = f64::from(expected_now[k]) - f64::from(expected_then[k]);
                    self.sum_of_squares += (change - expected).powi(2);
                    self.count += 1;
                }
            }
        }
        self.before = Some((picture, reference));
    }

    /// RMS over pixels, channels and steps of the difference between the two changes; `None` before a step.
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum_of_squares / self.count as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_that_are_the_truths_are_no_flicker() {
        let grey = |light: f32| {
            let mut image = Image::transparent(2, 1);
            image.rgba.fill([light; 4]);
            image
        };
        let mut flicker = Flicker::default();
        flicker.add(grey(0.5), grey(0.25), None);
        assert_eq!(flicker.rms(), None, "no step yet");
        flicker.add(grey(0.75), grey(0.5), None);
        assert_eq!(flicker.rms(), Some(0.0));
        flicker.add(grey(0.75), grey(0.0), None);
        assert_eq!(flicker.rms(), Some((0.5f64.powi(2) / 2.0).sqrt()));
        let mask = Mask::new(2, 1, vec![false; 2]).expect("of its size");
        flicker.add(grey(0.0), grey(1.0), Some(&mask));
        assert_eq!(
            flicker.rms(),
            Some((0.5f64.powi(2) / 2.0).sqrt()),
            "nothing is inside"
        );
    }
}
