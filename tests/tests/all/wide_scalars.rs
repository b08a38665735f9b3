//! Scalars of 32 and 64 bits: a volume whose values are shifted or scaled, with the transfer function that goes with them, is
//! the same picture, whatever single precision holds of the values themselves.

use glam::{DAffine3, DVec3};
use resample_core::{Image, KernelShape};
use resample_tests::choices::{summed, with_field};
use resample_tests::volumes::scenes::{perspective, random_volume, transfer, worst_difference};
use volsplat::{
    Blend, GradientOpacity, Isosurface, RenderOptions, Renderer, Shading, TransferFunction, Volume,
    Voxels,
};

/// value -> value * scale + offset.
#[derive(Clone, Copy, Debug)]
struct Units {
    scale: f64,
    offset: f64,
}

impl Units {
    fn of(self, value: f64) -> f64 {
        value * self.scale + self.offset
    }

    fn function(self) -> TransferFunction {
        let colours = [
            (0.1, [0.1, 0.2, 1.0]),
            (0.6, [0.2, 0.9, 0.3]),
            (1.0, [1.0, 0.3, 0.1]),
        ];
        let opacities = [(0.25, 0.0), (0.4, 0.5), (0.7, 0.1), (1.0, 0.6)];
        transfer(
            &colours.map(|(value, rgb)| (self.of(value), rgb)),
            &opacities.map(|(value, opacity)| (self.of(value), opacity)),
        )
    }

    /// Values are multiples of 1/1024 before they are carried over, so that 1e9 more loses none of their digits.
    fn volume(self) -> Volume {
        let mut volume = random_volume([7, 6, 8], DAffine3::IDENTITY);
        let values =
            (0..volume.len()).map(|i| self.of((volume.value(i) * 1024.0).round() / 1024.0));
        volume.voxels = Voxels::F64(values.collect());
        volume
    }

    fn options(self) -> Vec<RenderOptions> {
        let iso = Isosurface {
            value: self.of(0.55),
            colour: None,
            opacity: 0.8,
        };
        let field = RenderOptions::default();
        vec![
            field.clone(),
            RenderOptions {
                shading: Shading::Phong,
                ..field.clone()
            },
            RenderOptions {
                gradient_opacity: Some(GradientOpacity::ramp(0.05 * self.scale, 0.4 * self.scale)),
                ..field.clone()
            },
            with_field(field.clone(), |field| field.blend = Blend::Maximum),
            with_field(field, |field| field.blend = Blend::Isosurface(iso)),
            RenderOptions::every_sample(),
            RenderOptions::axis_sheets(),
            summed(RenderOptions::default(), KernelShape::Polynomial),
        ]
    }

    fn pictures(self) -> Vec<Image> {
        let camera = perspective(
            DVec3::new(12.0, 8.0, -11.0),
            DVec3::splat(3.0),
            40.0,
            [40, 30],
        );
        let draw = |options: RenderOptions| {
            let mut renderer =
                Renderer::new(&self.volume(), &self.function(), &options).expect("valid options");
            renderer.render(&camera).expect("a valid camera").image
        };
        self.options().into_iter().map(draw).collect()
    }
}

#[test]
fn values_in_other_units_are_the_same_picture() {
    let plain = Units {
        scale: 1.0,
        offset: 0.0,
    }
    .pictures();
    for (scale, offset) in [
        (1.0, 1e6),
        (1.0, -273.15),
        (1.0, 1e9),
        (1024.0, 1.7e12),
        (2f64.powi(500), 0.0),
        (2f64.powi(-500), 0.0),
        (2f64.powi(-1000), 2f64.powi(-990)),
        (2f64.powi(1000), 2f64.powi(1002)),
    ] {
        let units = Units { scale, offset };
        for (number, (a, b)) in plain.iter().zip(units.pictures()).enumerate() {
            let apart = worst_difference(a, &b);
            println!("{units:?}, choice {number}: {apart:.1e}");
            // An entry of the transfer function's table, of 4096, may be the next one.
            assert!(apart < 4e-3, "{units:?}, choice {number}: {apart}");
        }
    }
}

#[test]
fn whole_numbers_of_32_bits_keep_their_last_digits() {
    let small = Volume::new(
        [6, 5, 4],
        Voxels::U16((0..120).map(|i| i * 37 % 101).collect()),
        DAffine3::IDENTITY,
    )
    .expect("a volume");
    let shifted = |shift: u32| {
        let values = (0..120).map(|i| shift + i * 37 % 101).collect();
        Volume::new([6, 5, 4], Voxels::U32(values), DAffine3::IDENTITY).expect("a volume")
    };
    let camera = perspective(
        DVec3::new(9.0, 7.0, -8.0),
        DVec3::splat(2.0),
        40.0,
        [40, 30],
    );
    let draw = |volume: &Volume, shift: f64| {
        let function = transfer(
            &[(0.0, [1.0; 3])],
            &[(shift + 20.5, 0.0), (shift + 90.0, 0.6)],
        );
        let mut renderer =
            Renderer::new(volume, &function, &RenderOptions::default()).expect("valid options");
        renderer.render(&camera).expect("a valid camera").image
    };
    let plain = draw(&small, 0.0);
    for shift in [0, 1 << 24, 4_000_000_000] {
        let apart = worst_difference(&plain, &draw(&shifted(shift), f64::from(shift)));
        println!("+ {shift}: {apart:.1e}");
        assert!(apart < 1e-3, "+ {shift}: {apart}");
    }
}
