//! Metal, paint and what lies between: even light comes back whole from white, and a map of both that is too fine to be seen
//! gives the mean of what metal and paint give.

use std::sync::Arc;

use glam::DVec3;
use resample_tests::meshes::surroundings::{Reflector, lamps, reflected};
use resample_tests::meshes::textured::{material, quad, seen_from_afar, texture_use};
use texmap::Scene;
use texmap::scene::{Lighting, Material, Physical, Surroundings, Texels, Texture, Wrap};

/// Even light from all sides.
fn white() -> Surroundings {
    Surroundings {
        width: 8,
        height: 4,
        rgb: vec![[1.0; 3]; 32],
    }
}

/// What a camera far away sees in the middle of a square in the plane z = 0 whose texture is repeated over it.
fn seen(
    surroundings: &Surroundings,
    textures: Vec<Texture>,
    material: Material,
    eye: DVec3,
) -> DVec3 {
    let corners = [
        [-8.0, -8.0, 0.0],
        [8.0, -8.0, 0.0],
        [8.0, 8.0, 0.0],
        [-8.0, 8.0, 0.0],
    ];
    let repeats = 64.0;
    let uvs = [[0.0, repeats], [repeats; 2], [repeats, 0.0], [0.0; 2]];
    let scene = Scene {
        meshes: vec![quad(corners, uvs, 0)],
        materials: vec![material],
        textures,
        surroundings: Some(Arc::new(surroundings.clone())),
        ..Scene::default()
    };
    let [r, g, b, _] = seen_from_afar(&scene, eye);
    DVec3::new(r, g, b)
}

fn lit(base_colour: [f32; 4], physical: Physical) -> Material {
    Material {
        base_colour,
        lighting: Lighting::Lit,
        physical: Some(physical),
        ..material(None)
    }
}

fn eyes() -> [DVec3; 3] {
    [0.1, 0.9, 1.3].map(|angle: f64| DVec3::new(angle.sin(), 0.0, angle.cos()))
}

#[test]
fn white_of_any_metalness_gives_even_light_back() {
    let even = white();
    for metal in [0.0, 0.1, 0.35, 0.5, 0.8, 1.0] {
        for roughness in [0.05, 0.2, 0.55, 1.0] {
            for eye in eyes() {
                let physical = Physical {
                    metal,
                    roughness,
                    ..Physical::default()
                };
                let light = seen(&even, Vec::new(), lit([1.0; 4], physical), eye);
                assert!(
                    (light - DVec3::ONE).abs().max_element() < 2e-3,
                    "metal {metal}, roughness {roughness}, from {eye:.2}: {light:.3}"
                );
            }
        }
    }
}

/// A chequered map of 8 by 8 texels in codes.
fn chequered(name: &str, colours: [[u8; 3]; 2]) -> Texture {
    let texel = |at: usize| {
        let [r, g, b] = colours[(at % 8 + at / 8) % 2];
        [r, g, b, 255]
    };
    Texture {
        name: name.to_owned(),
        width: 8,
        height: 8,
        texels: Texels::Srgb8(Arc::new((0..64).map(texel).collect())),
    }
}

/// The worst difference of a fine map of metal and paint from the mean of the two, over eyes, as a part of that mean.
fn off(surroundings: &Surroundings, colours: [[u8; 3]; 2], roughnesses: [u8; 2]) -> f64 {
    let linear = |code: u8| {
        f64::from(resample_core::image::linear_from_srgb(
            f32::from(code) / 255.0,
        ))
    };
    let base = colours.map(|[r, g, b]| DVec3::new(linear(r), linear(g), linear(b)));
    let textures = vec![
        chequered("colour", colours),
        chequered(
            "metal",
            [[255, roughnesses[0], 255], [255, roughnesses[1], 0]],
        ),
    ];
    let of_map = texture_use(Wrap::Repeat);
    let physical = Physical {
        metal: 1.0,
        metal_roughness_texture: Some(texmap::scene::TextureUse {
            texture: 1,
            ..of_map
        }),
        ..Physical::default()
    };
    let material = Material {
        base_texture: Some(of_map),
        ..lit([1.0; 4], physical)
    };
    let mut worst = 0.0f64;
    for eye in eyes() {
        let light = seen(surroundings, textures.clone(), material.clone(), eye);
        let truth = [0, 1].map(|k| {
            let surface = Reflector {
                base: base[k],
                metal: 1.0 - k as f64,
                roughness: f64::from(roughnesses[k]) / 255.0,
            };
            reflected(surroundings, &surface, (DVec3::Z, eye), 8192)
        });
        let mean = 0.5 * (truth[0] + truth[1]);
        worst = worst.max(((light - mean) / mean.max_element()).abs().max_element());
    }
    worst
}

#[test]
fn a_fine_map_of_metal_and_paint_gives_the_mean_of_both() {
    let even = white();
    let silver = [250; 3];
    for roughnesses in [[60, 60], [128, 128], [230, 230], [40, 220]] {
        let off = off(&even, [silver; 2], roughnesses);
        assert!(off < 0.02, "roughness {roughnesses:?}: {off:.3}");
    }
}

#[test]
fn a_fine_map_of_metal_and_paint_of_two_colours_gives_the_mean_of_both() {
    let even = white();
    for roughness in [60, 128, 230] {
        for colours in [[[255, 220, 150], [200, 20, 15]], [[250; 3], [30, 30, 35]]] {
            let off = off(&even, colours, [roughness; 2]);
            assert!(off < 0.02, "{colours:?}, roughness {roughness}: {off:.3}");
        }
    }
}

#[test]
fn a_fine_map_of_metal_and_paint_in_a_room_gives_the_mean_of_both() {
    for roughness in [60, 128, 230] {
        let off = off(&lamps(64), [[250; 3]; 2], [roughness; 2]);
        assert!(off < 0.03, "roughness {roughness}: {off:.3}");
    }
}

#[test]
fn a_fine_map_of_rough_metal_on_smooth_paint_gives_the_mean_of_both() {
    let even = white();
    for roughnesses in [[230, 60], [40, 200]] {
        for colours in [[[250; 3], [30, 30, 35]], [[60, 40, 20], [230, 20, 15]]] {
            let off = off(&even, colours, roughnesses);
            assert!(
                off < 0.02,
                "{colours:?}, roughnesses {roughnesses:?}: {off:.3}"
            );
        }
    }
}
