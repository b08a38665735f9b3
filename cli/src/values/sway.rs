//! The word of a sway: how far, and in how many pictures.

use super::positive;

/// A sway of the camera around the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sway {
    /// Largest angle from the camera, degrees.
    pub angle_deg: f64,
    /// Pictures once around.
    pub pictures: u32,
}

/// Pictures of a sway: two seconds.
const DEFAULT_PICTURES: u32 = 48;

/// Most pictures: more is a slip of the finger.
const MAX_PICTURES: u32 = 100_000;

/// An angle above 0 and up to 45 degrees, and perhaps a number of pictures.
pub fn sway(text: &str) -> Result<Sway, String> {
    let (angle, pictures) = match text.split_once(',') {
        Some((angle, pictures)) => (angle, pictures.trim().parse().ok()),
        None => (text, Some(DEFAULT_PICTURES)),
    };
    let angle = positive(angle).ok().filter(|&angle_deg| angle_deg <= 45.0);
    let pictures = pictures.filter(|pictures| (1..=MAX_PICTURES).contains(pictures));
    match (angle, pictures) {
        (Some(angle_deg), Some(pictures)) => Ok(Sway { angle_deg, pictures }),
        _ => Err("expected an angle above 0 and up to 45 degrees, and perhaps a number of pictures: 3 or 3,48".into()),
    }
}
