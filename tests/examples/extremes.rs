//! Prints the table of the extremes: pictures at the ends of the range of numbers, against slow references in f64.
//!
//! `cargo run --release -p resample-tests --example extremes -- [N]`; with N, rows of many samples have one of N of them. The exit
//! status is 1 if a row is beyond its bound.

use std::process::ExitCode;

use resample_tests::extremes;

fn main() -> ExitCode {
    let share = std::env::args().nth(1).and_then(|word| word.parse().ok());
    let rows = extremes::rows(share.unwrap_or(1));
    println!("| quantity | extreme | drawn in f32 | true, f64 | error | bound | why it holds |");
    println!("|---|---|---|---|---|---|---|");
    for row in &rows {
        print!("{}", row.line());
    }
    let beyond = rows.iter().filter(|row| !row.holds()).count();
    println!("\n{} rows, {beyond} beyond their bounds", rows.len());
    ExitCode::from(u8::from(beyond > 0))
}
