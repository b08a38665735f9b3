//! Numbers of bytes, as people write them.

use super::finite;

/// A number of bytes such as 4G: K, M, G and T stand for powers of 1024.
pub fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let (digits, unit) = text.split_at(
        text.trim_end_matches(|c: char| c.is_ascii_alphabetic())
            .len(),
    );
    let power = match unit.to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 1,
        "M" | "MB" | "MIB" => 2,
        "G" | "GB" | "GIB" => 3,
        "T" | "TB" | "TIB" => 4,
        _ => return Err("expected a number of bytes such as 4G or 512M".into()),
    };
    let count = finite(digits)
        .filter(|&count| count > 0.0)
        .map(|count| count * 1024f64.powi(power));
    // Beyond 2^60 bytes there is no machine.
    match count {
        Some(count) if (1.0..1.2e18).contains(&count) => Ok(count as u64),
        _ => Err("expected a number of bytes such as 4G or 512M".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_units_of_1024() {
        for (text, expected) in [
            ("1000", 1000),
            ("4G", 4 << 30),
            ("1.5k", 1536),
            ("512MiB", 512 << 20),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for bad in ["", "G", "-1G", "0", "4X", "1e30", "nan"] {
            assert!(bytes(bad).is_err(), "{bad:?} is no number of bytes");
        }
    }
}
