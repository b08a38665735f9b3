//! The heading of a measurement: version, date, machine, threads.
//!
//! Takes nothing, gives one line of text. Where the system does not name its processor, the line says so.

use std::time::{SystemTime, UNIX_EPOCH};

/// Version, date, machine and threads, in one line.
pub(crate) fn heading() -> String {
    format!(
        "resample {}, {}, {} {}, {}, {} threads",
        env!("CARGO_PKG_VERSION"),
        today(),
        std::env::consts::OS,
        std::env::consts::ARCH,
        processor(),
        rayon::current_num_threads()
    )
}

/// The name of the processor, where the system knows it.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(
        || "unknown processor".into(),
        |(_, name)| name.trim().to_owned(),
    )
}

/// The day in Greenwich, year-month-day.
fn today() -> String {
    let seconds = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |age| age.as_secs());
    let [year, month, day] = date(seconds / 86_400);
    format!("{year}-{month:02}-{day:02}")
}

/// Year, month and day of a number of days after 1970-01-01, in the Gregorian calendar.
fn date(days: u64) -> [u64; 3] {
    // Years are counted from March, so that a leap day is the last day; 400 years have 146097 days.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    [era * 400 + year_of_era + u64::from(month <= 2), month, day]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), [1970, 1, 1]);
        assert_eq!(date(59), [1970, 3, 1], "no leap day");
        assert_eq!(date(11_016), [2000, 2, 29], "a leap day");
        assert_eq!(date(20_778), [2026, 11, 21]);
    }
}
