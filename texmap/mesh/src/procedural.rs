//! Formulas for a mesh and its texture. Demonstrations and benchmarks draw them where they have no file.

use std::fmt::Write;

use resample_core::Image;

/// Side of the texture, px, and its cells along a side.
const TEXTURE_PX: usize = 512;
const TEXTURE_CELLS: usize = 16;

/// Columns and rows of the ball: 2300 triangles.
const BALL_CELLS: [usize; 2] = [48, 24];

/// A ground of 20 by 20 units, and a ball of radius 1 that lies on it, as an OBJ file has them.
pub fn ball_on_ground() -> String {
    let [columns, rows] = BALL_CELLS;
    let mut text = String::from("v -10 -1 -10\nv 10 -1 -10\nv 10 -1 10\nv -10 -1 10\n");
    text += "vt 0 0\nvt 8 0\nvt 8 8\nvt 0 8\nf 1/1 4/4 3/3 2/2\n";
    for row in 0..=rows {
        let (sin, cos) = (std::f64::consts::PI * row as f64 / rows as f64).sin_cos();
        for column in 0..=columns {
            let angle_rad = std::f64::consts::TAU * column as f64 / columns as f64;
            let (x, z) = (sin * angle_rad.cos(), sin * angle_rad.sin());
            let (u, v) = (column as f64 / columns as f64, row as f64 / rows as f64);
            // Writing to a string cannot fail.
            let _ = writeln!(text, "v {x:.6} {cos:.6} {z:.6}\nvt {u:.6} {v:.6}");
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = 5 + row * (columns + 1) + column;
            let (right, below) = (at + 1, at + columns + 1);
            let after = below + 1;
            let _ = writeln!(
                text,
                "f {at}/{at} {right}/{right} {after}/{after} {below}/{below}"
            );
        }
    }
    text
}

/// A checkerboard of 512 by 512 texels.
pub fn checkerboard() -> Image {
    let side = TEXTURE_PX;
    let cell = side / TEXTURE_CELLS;
    let mut image = Image::transparent(side, side);
    for (index, pixel) in image.rgba.iter_mut().enumerate() {
        let (x, y) = (index % side, index / side);
        let light = if (x / cell + y / cell).is_multiple_of(2) {
            0.8
        } else {
            0.1
        };
        // A slow gradient makes the cells distinct.
        *pixel = [
            light,
            light * x as f32 / side as f32,
            light * y as f32 / side as f32,
            1.0,
        ];
    }
    image
}
