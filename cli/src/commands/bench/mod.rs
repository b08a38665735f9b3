//! `resample bench`: published tables, measured again on this machine.
//!
//! Every table is Markdown on stdout, headed by what a reader needs to compare it: version, date, machine, threads
//! and settings. Times are medians over interleaved repetitions of one run, so that a disturbance hits every row.

mod paper;

use std::io::{self, Write};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Result;

use crate::args::{BenchArgs, BenchTable};
use crate::report::Verbosity;

/// Measures and prints one table.
pub(crate) fn run(args: &BenchArgs, verbosity: Verbosity) -> Result<()> {
    let table = match &args.table {
        BenchTable::Paper(args) => paper::table(args, verbosity)?,
    };
    Ok(io::stdout().write_all(table.as_bytes())?)
}

/// Version, date, machine and threads, in one line.
fn heading() -> String {
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

/// The name of the processor, where the system tells it.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| "unknown processor".into(), |(_, name)| name.trim().to_owned())
}

/// The day in Greenwich, year-month-day.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |age| age.as_secs());
    let [year, month, day] = date(seconds / 86_400);
    format!("{year}-{month:02}-{day:02}")
}

/// Year, month and day of a number of days after 1970-01-01, in the Gregorian calendar.
fn date(days: u64) -> [u64; 3] {
    // Years are counted from March, so that a leap day is the last day; 400 years have 146097 days.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    [era * 400 + year_of_era + u64::from(month <= 2), month, day]
}

/// The middle of a list of times; of an even number the upper one. 0 for none.
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
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

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
