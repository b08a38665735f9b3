//! Films: steady depth, things that move, and what other pictures show of what one hides.

use resample_core::Image;
use resample_tests::warps::films::{FilmScene, Network};
use rayon::prelude::*;
use warp3d::film::{Film, FilmOptions, Hidden};
use warp3d::{Fill, Reference, WarpOptions, Warper};

const SIZE: [u32; 2] = [320, 180];
const PICTURES: usize = 30;

/// Distance of the eyes, world units: of the Face the wall is 10 px away, the head 20.
const BASELINE: f64 = 0.2;

/// The pictures of a film with their exact depth, and as a network gives them.
fn pictures(scene: FilmScene, network: Network) -> Vec<(Reference, Reference)> {
    (0..PICTURES)
        .into_par_iter()
        .map(|number| {
            let exact = scene.picture(number, SIZE);
            let found = network.of(&exact, number);
            (exact, found)
        })
        .collect()
}

/// Disparity of each pixel, px.
fn disparities(reference: &Reference) -> Vec<f64> {
    let scale = reference.camera.fx * BASELINE;
    reference.depth.iter().map(|&z| scale / f64::from(z)).collect()
}

/// Mean over pixels of the standard deviation over time of the disparities at pixels that `counts`.
fn unsteadiness(film: &[Vec<f64>], counts: impl Fn(usize) -> bool) -> f64 {
    let pixels = (0..film[0].len()).filter(|&index| counts(index));
    let n = film.len() as f64;
    let deviation = |index: usize| {
        let mean = film.iter().map(|d| d[index]).sum::<f64>() / n;
        (film.iter().map(|d| (d[index] - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    let (sum, count) = pixels.fold((0.0, 0), |(sum, count), i| (sum + deviation(i), count + 1));
    sum / f64::from(count)
}

#[test]
fn a_background_at_rest_rests() {
    let film = pictures(FilmScene::Face, Network::USUAL);
    let exact: Vec<Vec<f64>> = film.iter().map(|(exact, _)| disparities(exact)).collect();
    let raw: Vec<Vec<f64>> = film.iter().map(|(_, found)| disparities(found)).collect();
    let options = FilmOptions { hidden: Hidden::LeftOut, ..FilmOptions::default() };
    let mut steadier = Film::new(options);
    let steady: Vec<Vec<f64>> = film.iter().map(|(_, found)| {
        let mut found = found.clone();
        steadier.add(&mut found, None).expect("a picture");
        disparities(&found)
    }).collect();
    // The wall is farther than all else: pixels that show it in every picture, off the soft edges.
    let wall = |index: usize| {
        let (x, y) = (index % SIZE[0] as usize, index / SIZE[0] as usize);
        exact.iter().all(|d| {
            (-4i64..=4).all(|dx| (-4i64..=4).all(|dy| {
                let x = (x as i64 + dx).clamp(0, 319) as usize;
                let y = (y as i64 + dy).clamp(0, 179) as usize;
                d[y * SIZE[0] as usize + x] < 11.0
            }))
        })
    };
    println!("wall: raw {:.3} px, steady {:.3} px", unsteadiness(&raw, wall), unsteadiness(&steady, wall));
    for (name, film) in [("raw", &raw), ("steady", &steady)] {
        // The head: difference from the truth after one scale and offset for the whole film.
        let (mut sx, mut sy, mut sxx, mut sxy, mut n) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (d, e) in film.iter().zip(&exact).skip(2) {
            for (&d, &e) in d.iter().zip(e) { sx += d; sy += e; sxx += d*d; sxy += d*e; n += 1.0; }
        }
        let a = (n*sxy - sx*sy)/(n*sxx - sx*sx); let b = (sy - a*sx)/n;
        let (mut err, mut bias, mut c) = (0.0, 0.0, 0.0);
        for (d, e) in film.iter().zip(&exact).skip(2) {
            for (&d, &e) in d.iter().zip(e) { if e > 16.0 { let x = a*d+b-e; err += x*x; bias += x; c += 1.0; } }
        }
        println!("{name}: head rms {:.3} px, bias {:.3}", (err/c as f64).sqrt(), bias/c);
    }
}

fn psnr(image: &Image, truth: &Image, counts: &[bool]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for ((a, b), &counts) in image.rgba.iter().zip(&truth.rgba).zip(counts) {
        if counts { for c in 0..3 { sum += f64::from(a[c].clamp(0.0,1.0) - b[c]).powi(2); n += 1.0; } }
    }
    -10.0 * (sum / n).log10()
}

#[test]
fn other_pictures_fill_what_one_hides() {
    for scene in FilmScene::ALL {
        for (name, network) in [("exact", None), ("network", Some(Network::USUAL))] {
            let pairs: Vec<_> = (0..PICTURES).into_par_iter().map(|n| scene.pair(n, SIZE, BASELINE)).collect();
            let mut film = Film::new(FilmOptions { steady: if network.is_some() {32} else {0}, ..FilmOptions::default() });
            let options = WarpOptions { fill: Fill::Background, ..WarpOptions::default() };
            let (mut alone, mut both, mut whole) = ([0.0;2], [0.0;2], [0.0;2]);
            let mut count = 0.0;
            for (number, pair) in pairs.iter().enumerate() {
                let mut picture = match network { Some(n) => n.of(&pair.reference, number), None => pair.reference.clone() };
                let added = film.add(&mut picture, None).expect("a picture");
                if number < PICTURES / 2 { continue; }
                let hidden: Vec<bool> = pair.truth.seen.iter().map(|&s| s < 0.001).collect();
                let all = vec![true; hidden.len()];
                let one = Warper::new(vec![picture.clone()], &options).unwrap().render(&pair.target).unwrap().image;
                let two = Warper::new(std::iter::once(picture).chain(added.hidden).collect(), &options).unwrap().render(&pair.target).unwrap().image;
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
