//! Errors of shadows and occlusion.
use glam::DVec3;
use resample_tests::volumes::lit_scenes::{
    SIDE_VOXELS, ball, fog, peaks, shells, solid, thin, vessels,
};
use resample_tests::volumes::scenes::perspective;
use resample_tests::volumes::shadow_truth::{ShadowTruth, Sky};
use volsplat::{Occlusion, RenderOptions, Renderer};
fn main() {
    let whole = |_| true;
    let which = std::env::args().nth(1).unwrap_or_default();
    for (name, volume, look) in [
        ("ball", ball(), solid()),
        ("vessels", vessels(), solid()),
        ("fog", fog(), thin()),
        ("shells", shells(), peaks()),
    ] {
        if !which.is_empty() && which != name {
            continue;
        }
        let radius = 8.0;
        let middle = DVec3::splat(0.5 * (SIDE_VOXELS - 1) as f64);
        let truth =
            ShadowTruth::new(&volume, &look, Vec::new(), &whole).with_sky(Sky::new(100, radius));
        let g = truth.sky_gain;
        println!("{name} truth gain {g}");
        let eye = middle + 110.0 * DVec3::new(0.62, 0.5, 0.69).normalize();
        let camera = perspective(eye, middle, 32.0, [40; 2]);
        let truth = truth.picture(&camera, 3);
        for set in [1, 3, 7] {
            volsplat::shadow::sky::SETS.store(set, std::sync::atomic::Ordering::Relaxed);
            let options = RenderOptions {
                occlusion: Some(Occlusion {
                    radius: Some(radius),
                }),
                ..RenderOptions::default()
            };
            for slab in [0.5, 0.25] {
                let options = RenderOptions {
                    order: volsplat::Order::Field(volsplat::FieldOptions {
                        slab_voxels: slab,
                        ..Default::default()
                    }),
                    ..options.clone()
                };
                let drawn = Renderer::new(&volume, &look, &options)
                    .unwrap()
                    .render(&camera)
                    .unwrap()
                    .image;
                let (mut ab, mut aa, mut n, mut sq) = (0.0, 0.0, 0.0, 0.0);
                for (d, t) in drawn
                    .rgba
                    .iter()
                    .zip(&truth.rgba)
                    .filter(|(_, t)| t[3] > 0.02)
                {
                    for (d, t) in d[..3].iter().zip(t) {
                        let (d, t) = (f64::from(*d), f64::from(*t));
                        ab += d * t;
                        aa += d * d;
                        n += 1.0;
                        sq += (d - t).powi(2);
                    }
                }
                let fit = ab / aa;
                let mut fsq = 0.0;
                for (d, t) in drawn
                    .rgba
                    .iter()
                    .zip(&truth.rgba)
                    .filter(|(_, t)| t[3] > 0.02)
                {
                    for (d, t) in d[..3].iter().zip(t) {
                        fsq += (f64::from(*d) * fit - f64::from(*t)).powi(2);
                    }
                }
                let db = |sq: f64| -10.0 * (sq / n).log10();
                println!(
                    "{name} {set} {slab}: {:.1} dB, fit {fit:.4}: {:.1} dB",
                    db(sq),
                    db(fsq)
                );
            }
        }
    }
}
