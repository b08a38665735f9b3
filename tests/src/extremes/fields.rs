//! The trilinear field at extremes: units of length and of scalars, and eyes inside the volume.

use super::row::Result;
use glam::{DAffine3, DVec3};
use resample_core::Camera;
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{RenderOptions, Renderer, Subpixels, TransferFunction, Volume, Voxels};

use super::row::{Claim, Row};
use super::twin::Field;
use super::voxels::eye;

/// Voxels along a side.
const SIDE: usize = 12;

const FIELD: Claim = Claim {
    quantity: "red and opacity of a field",
    bound: 2e-3,
    why: "planes are placed in f64, samples are f32 from the middle; the function's table has 4096 entries",
};

/// A soft ball whose scalars are `scale` times 0 to 1, plus `offset`, in a world counted in `unit`.
struct Ball {
    unit: f64,
    scale: f64,
    offset: f64,
    mirrored: bool,
    origin: DVec3,
}

impl Ball {
    const PLAIN: Self = Self {
        unit: 1.0,
        scale: 1.0,
        offset: 0.0,
        mirrored: false,
        origin: DVec3::ZERO,
    };

    fn values(&self) -> Vec<f64> {
        let middle = 0.5 * (SIDE - 1) as f64;
        let value = |i: usize| {
            let at = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
            let r2: f64 = at.iter().map(|&c| (c as f64 - middle).powi(2)).sum();
            // Multiples of 2^-10, so that 1e9 more loses no digit.
            let ball = (1.0 - r2 / 30.0).max(0.0);
            self.offset + self.scale * (ball * 1024.0).round() / 1024.0
        };
        (0..SIDE.pow(3)).map(value).collect()
    }

    fn transfer(&self) -> Result<TransferFunction> {
        let value = |v: f64| self.offset + self.scale * v;
        let colour = |v: f64, red: f32| ColourKnot {
            value: value(v),
            rgb: [red, 0.5, 0.5],
        };
        let opacity = |v: f64, opacity: f64| OpacityKnot {
            value: value(v),
            opacity,
        };
        Ok(TransferFunction::new(
            vec![colour(0.0, 0.2), colour(1.0, 1.0)],
            vec![opacity(0.1, 0.0), opacity(0.9, 0.4)],
        )?)
    }

    fn placed(&self) -> DAffine3 {
        let mut placed = DAffine3::from_scale(DVec3::splat(self.unit));
        if self.mirrored {
            placed.matrix3.x_axis *= -1.0;
        }
        placed.translation = self.origin;
        placed
    }

    /// The middle of the ball in the world.
    fn middle(&self) -> DVec3 {
        self.placed()
            .transform_point3(DVec3::splat(0.5 * (SIDE - 1) as f64))
    }

    fn pairs(&self, camera: &Camera) -> Result<Vec<[f64; 2]>> {
        let (values, transfer) = (self.values(), self.transfer()?);
        let volume = Volume::new([SIDE; 3], Voxels::F64(values.clone()), self.placed())?;
        let options = RenderOptions {
            min_transmittance: 0.0,
            subpixels: Subpixels::Fixed(1),
            ..RenderOptions::default()
        };
        let image = Renderer::new(&volume, &transfer, &options)?
            .render(camera)?
            .image;
        let twin = Field {
            dims: [SIDE; 3],
            values: &values,
            world_from_index: self.placed(),
            transfer: &transfer,
            thickness: 0.5 * self.unit,
            unit: self.unit,
        };
        let pixel = |(at, pixel): (usize, &[f32; 4])| {
            let [red, opacity] = twin.pixel(camera, at);
            [[pixel[0].into(), red], [pixel[3].into(), opacity]]
        };
        Ok(image.rgba.iter().enumerate().flat_map(pixel).collect())
    }

    fn row(&self, extreme: String) -> Result<Row> {
        let from = self.unit * DVec3::new(14.0, 9.0, -21.0);
        let camera = eye(self.middle() + from, self.middle(), 30.0)?;
        Ok(FIELD.worst(extreme, self.pairs(&camera)?))
    }
}

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let plain = Ball::PLAIN;
    let mut rows = Vec::new();
    for unit in [2f64.powi(-120), 1e-11, 1e10, 2f64.powi(120)] {
        rows.push(Ball { unit, ..plain }.row(format!("spacing {unit:.1e}"))?);
    }
    for (scale, offset) in [
        (1.0, 1e6),
        (1.0, 1e9),
        (2f64.powi(500), 0.0),
        (2f64.powi(-1040), 0.0),
    ] {
        let ball = Ball {
            scale,
            offset,
            ..plain
        };
        rows.push(ball.row(format!("f64 scalars times {scale:.1e} plus {offset:.0e}"))?);
    }
    rows.push(
        Ball {
            mirrored: true,
            ..plain
        }
        .row("mirrored axes".into())?,
    );
    let origin = DVec3::new(1e7, -1e7, 1e7);
    rows.push(Ball { origin, ..plain }.row("1e7 units from the origin".into())?);
    for (extreme, position, fov) in [
        (
            "the eye exactly on a voxel",
            DVec3::new(4.0, 5.0, 3.0),
            70.0,
        ),
        (
            "the eye on a plane of voxels",
            DVec3::new(4.3, 5.0, 2.6),
            70.0,
        ),
        (
            "179.99 degrees inside the volume",
            DVec3::new(4.3, 5.1, 2.6),
            179.99,
        ),
    ] {
        let camera = eye(position, plain.middle(), fov)?;
        rows.push(FIELD.worst(extreme, plain.pairs(&camera)?));
    }
    Ok(rows)
}
