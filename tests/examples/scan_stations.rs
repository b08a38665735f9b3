//! Stations of a scanner in a room by formula, drawn from new places as discs and as panoramas with depth, against the truth.
//!
//! `cargo run -p resample-tests --example scan_stations [COLUMNS] [FOLDER]` prints a table; COLUMNS are those of a station's
//! full turn. Pictures go into FOLDER.

use std::path::Path;

use glam::{DAffine3, DVec2, DVec3};
use resample_cloud::{
    CloudOptions, CloudRenderer, Floating, GridFate, PointCloud, StationGrid, prepare_with,
};
use resample_core::clock::StageClock;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, Image, LookAt};
use resample_io::{Picture, Plane, Stored};
use warp3d::input::{DepthKind, DepthMeaning, panorama};
use warp3d::{Reference, WarpOptions, Warper};

/// y points down, as in a panorama; the scanner stands 1.6 m above the floor.
const ROOM: [DVec3; 2] = [DVec3::new(-4.0, -1.4, -3.0), DVec3::new(4.0, 1.6, 3.0)];
const BOXES: [[DVec3; 2]; 2] = [
    [DVec3::new(-2.0, 0.8, 0.5), DVec3::new(-0.8, 1.6, 1.7)],
    [DVec3::new(0.4, -1.4, 1.8), DVec3::new(0.48, 1.6, 1.88)],
];
const BALLS: [(DVec3, f64); 2] = [
    (DVec3::new(1.5, 0.9, 1.0), 0.7),
    (DVec3::new(-0.3, 1.3, -1.2), 0.3),
];
const STATIONS: [DVec3; 2] = [DVec3::ZERO, DVec3::new(2.5, 0.0, -1.5)];
const SIZE: [usize; 2] = [480, 360];
const SIGMA_PX: f64 = 0.5;

/// Errors of a scanner.
#[derive(Clone, Copy)]
struct Errors {
    noise_m: f64,
    /// Beams that meet two surfaces give a range between them, every second of them.
    is_mixed: bool,
}

struct Station {
    place: DVec3,
    size: [usize; 2],
    ranges: Vec<f64>,
    colours: Vec<DVec3>,
}

#[derive(Clone, Copy)]
struct Hit {
    distance: f64,
    place: DVec3,
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (self.next().max(1e-300), self.next());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Distances at which a ray enters and leaves a box.
fn through(ends: [DVec3; 2], from: DVec3, towards: DVec3) -> [f64; 2] {
    let (a, b) = ((ends[0] - from) / towards, (ends[1] - from) / towards);
    [a.min(b).max_element(), a.max(b).min_element()]
}

/// The first surface along a ray of unit length.
fn hit(from: DVec3, towards: DVec3) -> Hit {
    let mut distance = through(ROOM, from, towards)[1];
    for ends in BOXES {
        let [enters, leaves] = through(ends, from, towards);
        if enters < leaves && enters > 1e-9 {
            distance = distance.min(enters);
        }
    }
    for (middle, radius) in BALLS {
        let offset = from - middle;
        let b = offset.dot(towards);
        let root = b * b - offset.length_squared() + radius * radius;
        if root > 0.0 && -b - root.sqrt() > 1e-9 {
            distance = distance.min(-b - root.sqrt());
        }
    }
    Hit {
        distance,
        place: from + distance * towards,
    }
}

/// Waves of 0.3 m and a checkerboard of soft squares, linear light.
fn colour(p: DVec3) -> DVec3 {
    let w = std::f64::consts::TAU / 0.3;
    let wave = DVec3::new(
        (w * p.x).sin() * (w * p.y).cos() + 0.5 * (w * p.z).sin(),
        (w * (p.x + 0.5 * p.y - 0.7 * p.z)).cos(),
        (0.5 * w * (p.z + p.y)).sin(),
    );
    0.5 + 0.3 * wave.clamp(DVec3::splat(-1.5), DVec3::splat(1.5))
}

fn scanned(place: DVec3, columns: usize, errors: Errors) -> Station {
    let size = [columns, columns / 2];
    let whole = size.map(|side| side as u32);
    let mut random = Random(11);
    let (mut ranges, mut colours) = (Vec::new(), Vec::new());
    for row in 0..size[1] {
        for column in 0..size[0] {
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let met = |dx: f64, dy: f64| {
                hit(
                    place,
                    warp3d::panorama::direction(at + DVec2::new(dx, dy), whole),
                )
            };
            let one = met(0.0, 0.0);
            let (mut range, mut seen) = (one.distance, colour(one.place));
            if errors.is_mixed {
                let all = [
                    met(-0.25, -0.25),
                    met(0.25, -0.25),
                    met(-0.25, 0.25),
                    met(0.25, 0.25),
                ];
                let far = all.iter().map(|hit| hit.distance).fold(0.0, f64::max);
                let near = all.iter().map(|hit| hit.distance).fold(f64::MAX, f64::min);
                if far - near > 0.05 && random.next() < 0.5 {
                    range = all.iter().map(|hit| hit.distance).sum::<f64>() / 4.0;
                    seen = all.iter().map(|hit| colour(hit.place)).sum::<DVec3>() / 4.0;
                }
            }
            range += errors.noise_m * random.normal();
            ranges.push(range);
            colours.push(seen);
        }
    }
    Station {
        place,
        size,
        ranges,
        colours,
    }
}

/// The use of a station's grid.
#[derive(Clone, Copy, PartialEq)]
enum Use {
    Nothing,
    Mixed,
    MixedAndCrowded,
}

fn fates(station: &Station) -> Vec<GridFate> {
    let [columns, rows] = station.size;
    let at = |index: usize| {
        let at = DVec2::new((index / rows) as f64 + 0.5, (index % rows) as f64 + 0.5);
        let range = station.ranges[index % rows * columns + index / rows];
        range * warp3d::panorama::direction(at, station.size.map(|side| side as u32))
    };
    let grid = StationGrid {
        size: station.size,
        places: (0..columns * rows)
            .map(|index| at(index).as_vec3())
            .collect(),
    };
    let fates = grid.fates().expect("a grid");
    let of = |wanted: GridFate| fates.iter().filter(|fate| **fate == wanted).count();
    eprintln!(
        "{} points: {} mixed, {} crowded",
        fates.len(),
        of(GridFate::Mixed),
        of(GridFate::Crowded)
    );
    (0..columns * rows)
        .map(|index| fates[index % columns * rows + index / columns])
        .collect()
}

fn cloud(stations: &[Station], using: Use) -> PointCloud {
    let mut cloud = PointCloud::default();
    for station in stations {
        let fates = fates(station);
        for (index, range) in station.ranges.iter().enumerate() {
            let is_out = match using {
                Use::Nothing => false,
                Use::Mixed => fates[index] == GridFate::Mixed,
                Use::MixedAndCrowded => fates[index] != GridFate::Kept,
            };
            if is_out {
                continue;
            }
            let at = DVec2::new(
                (index % station.size[0]) as f64 + 0.5,
                (index / station.size[0]) as f64 + 0.5,
            );
            let towards = warp3d::panorama::direction(at, station.size.map(|side| side as u32));
            let place = station.place + *range * towards;
            cloud.positions.push(place.as_vec3().to_array());
            let code = |part: f64| (255.0 * srgb_from_linear(part as f32)).round() as u8;
            cloud
                .colours
                .push(station.colours[index].to_array().map(code));
        }
    }
    cloud
}

fn references(stations: &[Station]) -> Vec<Reference> {
    let mut all = Vec::new();
    for station in stations {
        let [width, height] = station.size;
        let picture = Picture {
            width,
            height,
            rgb: station
                .colours
                .iter()
                .map(|c| c.as_vec3().to_array())
                .collect(),
            coverage: None,
        };
        let plane = Plane {
            width,
            height,
            values: station.ranges.iter().map(|range| *range as f32).collect(),
            stored: Stored::Float,
        };
        let meaning = DepthMeaning::of(DepthKind::Ray);
        let faces = panorama(&picture, &plane, &meaning, Path::new("ranges")).expect("a panorama");
        all.extend(faces.into_iter().map(|mut face| {
            let camera_from_station = face.camera.camera_from_world;
            face.camera.camera_from_world =
                camera_from_station * DAffine3::from_translation(-station.place);
            face
        }));
    }
    all
}

/// The exact picture of a view, and the pixels whose surface the stations see.
struct Truth {
    rgb: Vec<DVec3>,
    /// All of 3x3 pixels is seen by a station; none of it is.
    is_seen: Vec<bool>,
    is_unseen: Vec<bool>,
    /// No edge within two pixels.
    is_inner: Vec<bool>,
}

fn truth(camera: &Camera, stations: &[DVec3]) -> Truth {
    const SUB: usize = 4;
    const MARGIN: usize = 2;
    let [width, height] = SIZE;
    let world_from_camera = camera.camera_from_world.inverse();
    let met = |at: DVec2| {
        let (origin, towards) = camera.ray_in_camera(at);
        let from = world_from_camera.transform_point3(origin);
        hit(
            from,
            world_from_camera.transform_vector3(towards).normalize(),
        )
    };
    let columns = (width + 2 * MARGIN) * SUB;
    let rays: Vec<DVec3> = (0..columns * (height + 2 * MARGIN) * SUB)
        .map(|i| {
            let at = DVec2::new((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5);
            colour(met(at / SUB as f64 - MARGIN as f64).place)
        })
        .collect();
    let reach = (2 * MARGIN + 1) * SUB;
    let weight = |i: usize| {
        let d = (i as f64 + 0.5 - 0.5 * reach as f64) / (SUB as f64 * SIGMA_PX);
        (-0.5 * d * d).exp()
    };
    let weights: Vec<f64> = (0..reach).map(weight).collect();
    let total = weights.iter().sum::<f64>().powi(2);
    let mut rgb = Vec::new();
    let mut visible = Vec::new();
    let mut depth = Vec::new();
    for i in 0..width * height {
        let (x, y) = (i % width, i / width);
        let mut sum = DVec3::ZERO;
        for (row, wy) in weights.iter().enumerate() {
            let start = (y * SUB + row) * columns + x * SUB;
            for (ray, wx) in rays[start..].iter().zip(&weights) {
                sum += wx * wy * *ray;
            }
        }
        rgb.push(sum / total);
        let one = met(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        depth.push(one.distance);
        visible.push(stations.iter().any(|&station| {
            let offset = one.place - station;
            hit(station, offset.normalize()).distance > offset.length() - 1e-4
        }));
    }
    let around = |i: usize, reach: i64, of: &mut dyn FnMut(usize) -> bool| {
        let (x, y) = ((i % width) as i64, (i / width) as i64);
        (-reach..=reach).all(|dy| {
            (-reach..=reach).all(|dx| {
                let (x, y) = (x + dx, y + dy);
                let is_inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
                !is_inside || of(y as usize * width + x as usize)
            })
        })
    };
    Truth {
        is_seen: (0..rgb.len())
            .map(|i| around(i, 1, &mut |j| visible[j]))
            .collect(),
        is_unseen: (0..rgb.len())
            .map(|i| around(i, 1, &mut |j| !visible[j]))
            .collect(),
        is_inner: (0..rgb.len())
            .map(|i| around(i, 2, &mut |j| (depth[j] / depth[i] - 1.0).abs() < 0.1))
            .collect(),
        rgb,
    }
}

/// Errors of pictures of one view, over the pixels that all of them cover.
fn against(images: &[&Image], truth: &Truth) -> Vec<[f64; 5]> {
    let covers = |image: &Image, i: usize| image.rgba[i][3] > 0.98;
    images
        .iter()
        .map(|image| {
            let (mut inner, mut edge, mut counts) = (0.0, 0.0, [0.0; 2]);
            let (mut holes, mut fill, mut seen, mut unseen) = (0.0, 0.0, 0.0, 0.0);
            for i in 0..truth.rgb.len() {
                if truth.is_unseen[i] {
                    unseen += 1.0;
                    fill += f64::from(u8::from(image.rgba[i][3] > 0.5));
                }
                if !truth.is_seen[i] {
                    continue;
                }
                seen += 1.0;
                holes += f64::from(u8::from(!covers(image, i)));
                if !images.iter().all(|image| covers(image, i)) {
                    continue;
                }
                let [r, g, b, _] = image.rgba[i].map(f64::from);
                let square = (DVec3::new(r, g, b) - truth.rgb[i]).length_squared() / 3.0;
                if truth.is_inner[i] {
                    (inner, counts[0]) = (inner + square, counts[0] + 1.0);
                } else {
                    (edge, counts[1]) = (edge + square, counts[1] + 1.0);
                }
            }
            let db = |sum: f64, count: f64| -10.0 * (sum / f64::max(count, 1.0)).log10();
            [
                db(inner, counts[0]),
                db(edge, counts[1]),
                db(inner + edge, counts[0] + counts[1]),
                100.0 * holes / seen,
                100.0 * fill / f64::max(unseen, 1.0),
            ]
        })
        .collect()
}

fn save(image: &Image, folder: Option<&String>, name: &str) {
    let Some(folder) = folder else { return };
    let path = Path::new(folder).join(name);
    let file = std::fs::File::create(path).expect("a folder");
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgba);
    let code = |part: f32| (255.0 * srgb_from_linear(part)).round() as u8;
    let bytes: Vec<u8> = image
        .rgba
        .iter()
        .flat_map(|&[r, g, b, a]| [code(r), code(g), code(b), (255.0 * a) as u8])
        .collect();
    let mut writer = encoder.write_header().expect("a picture");
    writer.write_image_data(&bytes).expect("a picture");
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let columns = words
        .first()
        .map_or(1500, |word| word.parse().expect("a number"));
    let folder = words.get(1);
    println!(
        "| scan | stations | view | px | as | inside | near edges | all | holes % | false fill % | prepare ms | draw ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, noise_m, is_mixed) in [
        ("exact", 0.0, false),
        ("2 mm", 0.002, false),
        ("2 mm, mixed", 0.002, true),
    ] {
        let all = STATIONS.map(|place| scanned(place, columns, Errors { noise_m, is_mixed }));
        for count in [1, 2] {
            let stations = &all[..count];
            let mut discs = Vec::new();
            for (way, using) in [
                ("discs", Use::Nothing),
                ("without mixed", Use::Mixed),
                ("and crowded", Use::MixedAndCrowded),
            ] {
                let cloud = cloud(stations, using);
                let clock = StageClock::start();
                let prepared = prepare_with(&cloud, Floating::LeftOut).expect("points");
                eprintln!("{name}, {count}, {way}: {:?}", prepared.left_out);
                let renderer =
                    CloudRenderer::new(prepared, &CloudOptions::default()).expect("options");
                discs.push((way, renderer, clock.stop().cpu_ms));
            }
            let clock = StageClock::start();
            let faces = references(stations);
            let mut warper = Warper::new(faces, &WarpOptions::default()).expect("references");
            let prepare_faces = clock.stop().cpu_ms;
            for away in [0.3, 1.0, 3.0] {
                for larger in [1.0, 2.0] {
                    let eye = away * DVec3::new(-0.85, 0.1, -0.5).normalize();
                    let camera = camera(eye, larger * columns as f64 / std::f64::consts::TAU);
                    let mut drawn = Vec::new();
                    for (way, renderer, prepare) in &mut discs {
                        let clock = StageClock::start();
                        let image = renderer.render(&camera).expect("a camera").image;
                        drawn.push((*way, image, *prepare, clock.stop().cpu_ms));
                    }
                    let clock = StageClock::start();
                    let image = warper.render(&camera).expect("a camera").image;
                    drawn.push(("panoramas", image, prepare_faces, clock.stop().cpu_ms));
                    let truth = truth(&camera, &STATIONS[..count]);
                    let images: Vec<&Image> = drawn.iter().map(|(_, image, ..)| image).collect();
                    let found = against(&images, &truth);
                    for ((way, image, prepare, draw), found) in drawn.iter().zip(found) {
                        let [inner, edge, whole, holes, fill] = found;
                        println!(
                            "| {name} | {count} | {away} m | {larger} | {way} | {inner:.1} | {edge:.1} | {whole:.1} | {holes:.2} | {fill:.1} | {prepare:.0} | {draw:.0} |"
                        );
                        save(
                            image,
                            folder,
                            &format!("{name}_{count}_{away}_{larger}_{way}.png"),
                        );
                    }
                    let mut exact = Image::transparent(SIZE[0], SIZE[1]);
                    for (pixel, rgb) in exact.rgba.iter_mut().zip(&truth.rgb) {
                        *pixel = rgb.as_vec3().extend(1.0).to_array();
                    }
                    save(&exact, folder, &format!("truth_{away}_{larger}.png"));
                }
            }
        }
    }
}

fn camera(eye: DVec3, focal_px: f64) -> Camera {
    let pose = LookAt {
        position: eye,
        target: DVec3::new(0.8, 0.7, 1.4),
        up: DVec3::new(0.0, -1.0, 0.0),
    };
    let fov_y = 2.0 * (0.5 * SIZE[1] as f64 / focal_px).atan();
    Camera::perspective(&pose, fov_y, SIZE.map(|side| side as u32)).expect("a camera")
}
