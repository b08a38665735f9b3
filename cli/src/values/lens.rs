//! The word of a lens: four numbers, or a file.

use std::path::{Path, PathBuf};

/// A lens as it was typed.
#[derive(Clone, Debug, PartialEq)]
pub enum IntrinsicsWord {
    /// Focal lengths along x and y and the centre, px.
    Numbers([f64; 4]),
    /// A file that holds them.
    File(PathBuf),
}

/// `FX,FY,CX,CY` in pixels, focal lengths above 0, or the name of a file.
pub fn intrinsics(text: &str) -> Result<IntrinsicsWord, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|word| {
            word.trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
        })
        .collect();
    match numbers.as_deref() {
        Some(&[fx, fy, cx, cy]) if fx > 0.0 && fy > 0.0 => {
            Ok(IntrinsicsWord::Numbers([fx, fy, cx, cy]))
        }
        None if Path::new(text).is_file() => Ok(IntrinsicsWord::File(text.into())),
        _ => Err(
            "expected FX,FY,CX,CY in pixels such as 525,525,319.5,239.5, focal lengths above 0, or a file that exists"
                .into(),
        ),
    }
}
