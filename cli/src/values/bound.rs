//! Bounds on the error and the time of a picture.

use resample_core::metrics::estimate::BoundMetric;

/// The largest error that is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The error measure.
    pub metric: BoundMetric,
    /// Its largest value, above 0, where white is 1.
    pub value: f64,
}

/// `1/255`, `0.004`, or one of them behind `rms:` or `max:`.
pub fn bound(text: &str) -> Result<Bound, String> {
    let (metric, number) = match text.split_once(':') {
        Some(("rms", number)) => (BoundMetric::Rms, number),
        Some(("max", number)) => (BoundMetric::Max, number),
        None => (BoundMetric::Rms, text),
        Some(_) => (BoundMetric::Rms, ""),
    };
    let value = match number.split_once('/') {
        Some((over, under)) => super::finite(over)
            .zip(super::finite(under))
            .map(|(a, b)| a / b),
        None => super::finite(number),
    };
    value.filter(|value| *value > 0.0 && *value < 1.0).map(|value| Bound { metric, value }).ok_or_else(|| {
        "expected a number above 0 and below 1 such as 1/255 or 0.004, perhaps behind rms: or max:".into()
    })
}

/// `METRIC=VALUE`.
pub fn metric_bound(text: &str) -> Result<(String, f64), String> {
    let parts = text
        .split_once('=')
        .and_then(|(name, value)| Some((name.trim().to_owned(), super::finite(value)?)));
    parts.ok_or_else(|| "expected METRIC=VALUE such as flip=0.02".into())
}

/// `50ms`, `2s` or `50` in milliseconds.
pub fn time_ms(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, unit_ms) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1.0),
        (None, Some(number)) => (number, 1e3),
        (None, None) => (text, 1.0),
    };
    super::finite(number)
        .map(|number| number * unit_ms)
        .filter(|&time| time > 0.0 && time.is_finite())
        .ok_or_else(|| "expected a time above 0 such as 50ms or 2s".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_fractions_with_or_without_a_metric() {
        assert_eq!(
            bound("1/255"),
            Ok(Bound {
                metric: BoundMetric::Rms,
                value: 1.0 / 255.0
            })
        );
        assert_eq!(
            bound("max:0.004"),
            Ok(Bound {
                metric: BoundMetric::Max,
                value: 0.004
            })
        );
        for bad in [
            "", "0", "-1/255", "1/0", "1", "psnr:0.1", "max:", "1/", "nan", "2/1",
        ] {
            assert!(bound(bad).is_err(), "{bad:?} is no bound");
        }
    }

    #[test]
    fn times_have_a_unit() {
        assert_eq!(time_ms("50ms"), Ok(50.0));
        assert_eq!(time_ms("0.5s"), Ok(500.0));
        for bad in ["", "0", "-1s", "ms", "1m", "inf"] {
            assert!(time_ms(bad).is_err(), "{bad:?} is no time");
        }
    }
}
