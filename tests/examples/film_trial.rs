//! Trial of films.
use rayon::prelude::*;
use resample_core::Image;
use resample_tests::warps::films::{FilmScene, Network};
use warp3d::film::{Film, FilmOptions};
use warp3d::{Fill, WarpOptions, Warper};
const SIZE: [u32; 2] = [320, 180];
const PICTURES: usize = 30;
const BASELINE: f64 = 0.2;
fn psnr(image: &Image, truth: &Image, counts: &[bool]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for ((a, b), &counts) in image.rgba.iter().zip(&truth.rgba).zip(counts) {
        if counts { for c in 0..3 { sum += f64::from(a[c].clamp(0.0,1.0) - b[c]).powi(2); n += 1.0; } }
    }
    -10.0 * (sum / n).log10()
}

fn main() {
    for scene in FilmScene::ALL {
        for (name, network) in [("exact", None), ("network", Some(Network::USUAL))] {
            let pairs: Vec<_> = (0..PICTURES).into_par_iter().map(|n| scene.pair(n, SIZE, BASELINE)).collect();
            let mut film = Film::new(FilmOptions { steady: if network.is_some() {32} else {0}, ..FilmOptions::default() });
            let options = WarpOptions { fill: Fill::Background, ..WarpOptions::default() };
            let (mut alone, mut both) = ([0.0;2], [0.0;2]);
            let mut count = 0.0;
            for (number, pair) in pairs.iter().enumerate() {
                let mut picture = match network { Some(n) => n.of(&pair.reference, number), None => pair.reference.clone() };
                let added = film.add(&mut picture, None).expect("a picture");
                if number == PICTURES - 1 && network.is_none() { if let Some(h) = &added.hidden {
                    let bytes: Vec<u8> = h.colour.iter().zip(&h.depth).flat_map(|(p, z)| p.iter().map(|v| if z.is_nan() { 0 } else {(v.clamp(0.0,1.0).powf(1.0/2.2)*255.0) as u8}).collect::<Vec<_>>()).collect();
                    let mut f = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]).into_bytes(); f.extend(bytes);
                    std::fs::write(format!("/tmp/o/plate_{scene:?}.ppm"), f).unwrap();
                    // truth without what moves or stands before
                    let (mut s, cam) = scene.at(number, SIZE); s.0.truncate(1);
                    let t = resample_tests::warps::filtered::filtered(&s, &cam);
                    let bytes: Vec<u8> = t.iter().flat_map(|p| p.iter().map(|v| (v.clamp(0.0,1.0).powf(1.0/2.2)*255.0) as u8).collect::<Vec<_>>()).collect();
                    let mut f = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]).into_bytes(); f.extend(bytes);
                    std::fs::write(format!("/tmp/o/wall_{scene:?}.ppm"), f).unwrap();
                }}
                if number < PICTURES / 2 { continue; }
                let places = scene.at(number, SIZE).0.places(&pair.target);
                let shown: Vec<bool> = places.par_iter().map(|place| place.is_some_and(|place| (0..number).any(|k| { let (s, c) = scene.at(k, SIZE); s.sees(&c, place) }))).collect();
                let hidden: Vec<bool> = pair.truth.seen.iter().zip(&shown).map(|(&s, &shown)| s < 0.001 && shown).collect();
                let all = vec![true; hidden.len()];
                let one = Warper::new(vec![picture.clone()], &options).unwrap().render(&pair.target).unwrap().image;
                let two = Warper::with_hidden(vec![picture], added.hidden, &options).unwrap().render(&pair.target).unwrap().image;
                if number == PICTURES - 1 {
                    for (n, im) in [("one", &one), ("two", &two), ("truth", &pair.truth.image)] {
                        let bytes: Vec<u8> = im.rgba.iter().flat_map(|p| p[..3].iter().map(|v| (v.clamp(0.0,1.0).powf(1.0/2.2)*255.0) as u8).collect::<Vec<_>>()).collect();
                        let mut f = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]).into_bytes(); f.extend(bytes);
                        std::fs::write(format!("/tmp/o/film_{scene:?}_{name}_{n}.ppm"), f).unwrap();
                    }
                }
                alone[0] += psnr(&one, &pair.truth.image, &hidden);
                both[0] += psnr(&two, &pair.truth.image, &hidden);
                alone[1] += psnr(&one, &pair.truth.image, &all);
                both[1] += psnr(&two, &pair.truth.image, &all);
                count += 1.0;
            }
            println!("{scene:?} {name}: hidden one {:.1} film {:.1} dB; all one {:.1} film {:.1}", alone[0]/count, both[0]/count, alone[1]/count, both[1]/count);
        }
    }
}
