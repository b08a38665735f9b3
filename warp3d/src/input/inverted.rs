//! Depth that is most likely read the wrong way round: floors are nearer than ceilings and skies.

/// How much nearer the upper third of a picture must be than the lower third to look upside down. Floors make the lower
/// part nearer in almost every picture; a guess that leaves ceilings and close walls without a note.
const INVERTED_RATIO: f64 = 1.25;

/// Returns true if the upper third of a picture is clearly nearer than the lower third.
pub(super) fn looks_inverted(z: &[f32], width: usize) -> bool {
    let third = z.len() / width.max(1) / 3 * width;
    let median = |part: &[f32]| -> Option<f64> {
        let mut known: Vec<f32> = part.iter().copied().filter(|z| !z.is_nan()).collect();
        let middle = known.len() / 2;
        (!known.is_empty())
            .then(|| f64::from(*known.select_nth_unstable_by(middle, f32::total_cmp).1))
    };
    let (upper, lower) = (median(&z[..third]), median(&z[z.len() - third..]));
    upper
        .zip(lower)
        .is_some_and(|(upper, lower)| lower > INVERTED_RATIO * upper)
}
