//! Slices that stand in volumes: texmap draws a polygon with the values of its plane as a picture. They are compared with the values at the places where rays
//! meet the plane.

use glam::{DAffine3, DQuat, DVec2, DVec3};
use resample_core::narrow::single;
use resample_core::tile::TILE_PX;
use resample_core::{Camera, Image, Projection, Surface};
use resample_tests::volumes::scenes::{orthographic, perspective};
use texmap::{RenderOptions, Renderer, Scene};
use volsplat::volume::procedural::blobs;
use volsplat::volume::{Between, PlaneGrid};
use volsplat::{Described, Volume};

/// Voxels along the volume's sides.
const SIDE: usize = 40;

/// Rays of a pixel along its side.
const RAYS: usize = 6;

/// A volume that lies askew in the world.
fn volume() -> Volume {
    let blobs = blobs(SIDE).expect("valid");
    let turned = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.5, 0.2);
    let scale = DVec3::new(0.7, 0.9, 1.1);
    let world =
        DAffine3::from_scale_rotation_translation(scale, turned, DVec3::new(30.0, -7.0, 4.0));
    Volume::new(blobs.dims, blobs.voxels, world).expect("valid")
}

/// The trilinear value at a place of the world; `None` beyond its voxels.
fn value(volume: &Volume, pos_in_world: DVec3) -> Option<f64> {
    let place = volume
        .world_from_index
        .inverse()
        .transform_point3(pos_in_world);
    let last = DVec3::splat((SIDE - 1) as f64);
    if place.cmplt(DVec3::ZERO).any() || place.cmpgt(last).any() {
        return None;
    }
    let corner = place.floor().min(last - 1.0);
    let within = place - corner;
    let mut sum = 0.0;
    for number in 0..8 {
        let step = DVec3::from_array([0, 1, 2].map(|axis| f64::from(number >> axis & 1)));
        let weight = (step * within + (1.0 - step) * (1.0 - within)).element_product();
        let [x, y, z] = (corner + step).to_array().map(|v| v as usize);
        sum += weight * volume.value((z * SIDE + y) * SIDE + x);
    }
    Some(sum)
}

/// The slice as a scene: values from 0 to 1 as linear light.
fn slice(volume: &Volume, (normal, offset): (DVec3, f64)) -> Scene {
    let PlaneGrid { grid, corners } = volume
        .lattice()
        .on_plane((normal, offset), 1)
        .expect("inside");
    let plane = PlaneGrid { grid, corners };
    let cut = volume
        .on_grid(&plane.grid, Between::Linear, 0.0)
        .expect("inside");
    let (low, high) = volume.voxels.finite_range();
    let [width, height, _] = plane.grid.dims;
    let mut picture = Image::transparent(width, height);
    for (pixel, value) in picture.rgba.iter_mut().zip(cut.slice(2, 0).values) {
        let light = single((value - low) / (high - low));
        *pixel = [light, light, light, 1.0];
    }
    let uvs = plane.corners.iter().map(|&at| plane.uv(at)).collect();
    Scene::polygon(&plane.corners, uvs, picture)
}

/// The mean over a pixel of what its rays meet on the plane; `None` where one of them meets nothing.
fn truth(
    volume: &Volume,
    (normal, offset): (DVec3, f64),
    camera: &Camera,
    pixel: DVec2,
) -> Option<f64> {
    let world_from_camera = camera.camera_from_world.inverse();
    let mut sum = 0.0;
    for number in 0..RAYS * RAYS {
        let sub =
            DVec2::new((number % RAYS) as f64 + 0.5, (number / RAYS) as f64 + 0.5) / RAYS as f64;
        let (from, along) = camera.ray_in_camera(pixel + sub);
        let [from, along] = [
            world_from_camera.transform_point3(from),
            world_from_camera.transform_vector3(along),
        ];
        let z = (offset - normal.dot(from)) / normal.dot(along);
        sum += value(volume, from + z * along)?;
    }
    Some(sum / (RAYS * RAYS) as f64)
}

fn planes(volume: &Volume) -> [(&'static str, (DVec3, f64)); 3] {
    let lattice = volume.lattice();
    let middle = volume.world_from_index.transform_point3(DVec3::splat(19.5));
    let oblique = DVec3::new(2.0, -1.0, 3.0);
    [
        ("along z", lattice.plane_of(2, 17)),
        ("along x", lattice.plane_of(0, 22)),
        ("oblique", (oblique, oblique.dot(middle))),
    ]
}

fn cameras(volume: &Volume) -> [(&'static str, Camera); 3] {
    let middle = volume.world_from_index.transform_point3(DVec3::splat(19.5));
    let towards = DVec3::new(0.5, 0.35, 0.8).normalize();
    [
        (
            "close",
            perspective(middle + 60.0 * towards, middle, 40.0, [160, 140]),
        ),
        (
            "far",
            perspective(middle + 300.0 * towards, middle, 9.0, [32, 32]),
        ),
        (
            "parallel",
            orthographic(middle + 60.0 * towards, middle, 44.0, [90, 80]),
        ),
    ]
}

/// Sub-pixels along a pixel's side: as many as a volume's picture may have.
const SUBPIXELS: u32 = 4;

/// Light of a pixel of a surface, the mean of its sub-pixels; `None` unless it covers all of them.
fn light(surface: &Surface, pixel: [usize; 2]) -> Option<f64> {
    let side = SUBPIXELS as usize;
    let mut sum = 0.0;
    for number in 0..side * side {
        let at = [
            side * pixel[0] + number % side,
            side * pixel[1] + number / side,
        ];
        let tile = surface.tile(at.map(|px| px / TILE_PX))?;
        let [light, .., alpha] = tile.rgba[at[1] % TILE_PX][at[0] % TILE_PX];
        if alpha < 0.999 {
            return None;
        }
        sum += f64::from(light);
    }
    Some(sum / (side * side) as f64)
}

/// Least ratio of signal to noise inside a slice, dB. The grid of an oblique plane interpolates
/// once more than the truth, and a sub-pixel is the mean of a Gaussian, that of the truth of a square. The least of the scenes is 50.9 dB.
const LEAST_DB: f64 = 48.0;

#[test]
fn slices_have_the_values_where_rays_meet_their_plane() {
    let volume = volume();
    let (low, high) = volume.voxels.finite_range();
    for (plane_name, plane) in planes(&volume) {
        let scene = slice(&volume, plane);
        let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("valid");
        for (name, camera) in cameras(&volume) {
            let surface = renderer.surface(&camera, SUBPIXELS).expect("valid");
            let (mut squares, mut count) = (0.0, 0);
            for y in 0..camera.height as usize {
                for x in 0..camera.width as usize {
                    let at = DVec2::new(x as f64, y as f64);
                    let both = truth(&volume, plane, &camera, at).zip(light(&surface, [x, y]));
                    if let Some((value, found)) = both {
                        let expected = (value - low) / (high - low);
                        squares += (found - expected).powi(2);
                        count += 1;
                    }
                }
            }
            let db = -10.0 * (squares / f64::from(count)).log10();
            println!("{plane_name}, {name}: {db:.1} dB over {count} pixels");
            assert!(
                count > 50 && db > LEAST_DB,
                "{plane_name}, {name}: {db:.1} dB"
            );
        }
    }
}

#[test]
fn a_window_of_a_surface_has_the_bits_of_the_whole() {
    let volume = volume();
    let [.., (_, plane)] = planes(&volume);
    let mut renderer =
        Renderer::new(&slice(&volume, plane), &RenderOptions::default()).expect("valid");
    for (name, camera) in cameras(&volume) {
        if camera.projection == Projection::Perspective && camera.width < 64 {
            continue;
        }
        let (subpixels, first, size) = (2, [32, 16], [40, 48]);
        let whole = renderer.surface(&camera, subpixels).expect("valid");
        let window = renderer
            .surface_window(&camera, (first, size), subpixels)
            .expect("valid");
        assert_eq!(window.size(), size.map(|px| 2 * px), "{name}");
        let shift = first.map(|px| 2 * px / TILE_PX);
        let mut seen = 0;
        for row in 0..2 * size[1] / TILE_PX {
            for column in 0..2 * size[0] / TILE_PX {
                let [own, expected] = [
                    window.tile([column, row]),
                    whole.tile([column + shift[0], row + shift[1]]),
                ];
                assert_eq!(own.is_some(), expected.is_some(), "{name}, {column}, {row}");
                let (Some(own), Some(expected)) = (own, expected) else {
                    continue;
                };
                seen += 1;
                assert!(
                    own.rgba == expected.rgba && own.depth == expected.depth,
                    "{name}, {column}, {row}"
                );
            }
        }
        assert!(seen > 10, "{name}: {seen} tiles");
    }
}
