//! The cubic of Keys (1981), a = -1/2: it passes through the samples and needs no coefficients.

/// Weights of four samples around a place `t` past the second.
///
/// ```
/// let weights = warp3d::keys::weights(0.25);
/// assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
/// assert_eq!(warp3d::keys::weights(0.0), [0.0, 1.0, 0.0, 0.0]);
/// ```
pub fn weights(t: f64) -> [f32; 4] {
    let t = t as f32;
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}
