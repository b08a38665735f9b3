//! Writes a large volume of 16-bit voxels from a formula, slice by slice.
//!
//! `cargo run --release -p resample-tests --example large_raw -- FILE.raw X,Y,Z`. A ball of shells whose surface is dented along
//! all axes; every brick of it is different. It takes the memory of one slice. The values go from 0 to 4000.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::ExitCode;

use rayon::prelude::*;

/// Shells from the middle to the rim.
const SHELLS: f64 = 24.0;

/// Values by squared distance from the middle: enough that neighbouring voxels of a side of 4096 differ.
const STEPS: usize = 1 << 16;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let parsed = match arguments.as_slice() {
        [path, dims] => parse(dims).map(|dims| (path, dims)),
        _ => None,
    };
    let Some((path, dims)) = parsed else {
        eprintln!("usage: large_raw FILE.raw X,Y,Z");
        return ExitCode::FAILURE;
    };
    match write(path, dims) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{path}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn parse(dims: &str) -> Option<[usize; 3]> {
    let dims: Vec<usize> = dims
        .split(',')
        .map_while(|n| n.parse().ok())
        .filter(|&n| n > 1)
        .collect();
    dims.try_into().ok()
}

fn write(path: &str, dims: [usize; 3]) -> std::io::Result<()> {
    let shells: Vec<u16> = (0..STEPS)
        .map(|step| shell((step as f64 / STEPS as f64).sqrt()))
        .collect();
    // Squared distances along each axis, from the middle to 1/3 at a face, with dents.
    let along = dims.map(|count| -> Vec<f32> {
        let place = |i: usize| 2.0 * i as f64 / (count - 1) as f64 - 1.0;
        (0..count)
            .map(place)
            .map(|p| ((p * p + 0.06 * (19.0 * p).sin()) / 3.0) as f32)
            .collect()
    });
    let mut file = BufWriter::new(File::create(path)?);
    let mut slice = vec![0u8; 2 * dims[0] * dims[1]];
    for &z in &along[2] {
        slice
            .par_chunks_mut(2 * dims[0])
            .zip(&along[1])
            .for_each(|(row, y)| {
                for (bytes, x) in row.chunks_exact_mut(2).zip(&along[0]) {
                    let step = ((x + y + z).clamp(0.0, 0.9999) * STEPS as f32) as usize;
                    bytes.copy_from_slice(&shells[step].to_le_bytes());
                }
            });
        file.write_all(&slice)?;
    }
    file.flush()
}

/// The value at a distance from the middle, 1 in a corner.
fn shell(distance: f64) -> u16 {
    // The ball ends before the faces, which lie at 0.58.
    let inside = (1.0 - distance / 0.56).clamp(0.0, 0.1) * 10.0;
    let ripple = 0.5 + 0.5 * (std::f64::consts::TAU * SHELLS * distance).cos();
    (4000.0 * inside * (0.25 + 0.75 * ripple)) as u16
}
