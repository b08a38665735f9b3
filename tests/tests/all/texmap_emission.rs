//! Emitted light: every path adds it to the reflected light, as the same texture would be seen as the colour of an unlit
//! surface.

use glam::{DVec3, Vec3};
use resample_core::{Camera, Image};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{material, photo, texture, texture_use};
use texmap::scene::{AlphaMode, Lighting, Material, Mesh, Physical, Texture, TextureUse, Wrap};
use texmap::{Method, RenderOptions, Renderer, Scene, Shade};

use crate::texmap_light::mean;

/// Triangles along each side of the wall.
const CELLS: u32 = 12;

/// A wall of many triangles from (-1, -1) to (1, 1) whose left, middle and right thirds have materials 0, 1 and 2.
fn walls() -> Vec<Mesh> {
    let at = |k: u32| k as f32 / CELLS as f32;
    let corners = || (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (i, j)));
    let mesh = |material: usize| {
        let mut triangles = Vec::new();
        for (i, j) in corners().filter(|&(i, j)| i < CELLS && j < CELLS) {
            if (i * 3 / CELLS) as usize == material {
                let first = j * (CELLS + 1) + i;
                let below = first + CELLS + 1;
                triangles.push([first, below, below + 1]);
                triangles.push([first, below + 1, first + 1]);
            }
        }
        Mesh {
            positions: corners()
                .map(|(i, j)| [2.0 * at(i) - 1.0, 1.0 - 2.0 * at(j), 0.0])
                .collect(),
            normals: corners().map(|_| [0.0, 0.0, 1.0]).collect(),
            uvs: vec![corners().map(|(i, j)| [at(i), at(j)]).collect()],
            triangles,
            material,
            ..Mesh::default()
        }
    };
    (0..3).map(mesh).collect()
}

/// Black, with a bright patch near the top of the left third and a bright spot of one texel further down.
fn glow(side: usize) -> Texture {
    texture([side, side], |x, y| {
        let [r, g, b] = glow_of_texel(side, x, y);
        [r, g, b, 1.0]
    })
}

fn glow_of_texel(side: usize, x: usize, y: usize) -> [f32; 3] {
    let [s, t] = [x, y].map(|k| k as f32 / side as f32);
    let patch = s < 0.2 && (0.1..0.3).contains(&t);
    let spot = x == side / 5 && y == side * 3 / 4;
    if patch || spot {
        [2.0 * s + 0.3, 0.9, 0.5 * t]
    } else {
        [0.0; 3]
    }
}

/// The emission of the wall at a place.
fn emitted(side: usize, place: DVec3) -> DVec3 {
    let [x, y] = [place.x, -place.y].map(|at| 0.5 * (at + 1.0));
    if !(0.0..=1.0).contains(&x) || !(0.0..=1.0).contains(&y) {
        return DVec3::ZERO;
    }
    let third = ((3.0 * x) as usize).min(2);
    let colour = Vec3::from(EMITTED[third]).as_dvec3();
    if third > 0 {
        return colour;
    }
    let [u, v] = [x, y].map(|at| at * side as f64 - 0.5);
    let texel = |i: f64, j: f64| {
        let [i, j] = [i, j].map(|k| k.clamp(0.0, (side - 1) as f64) as usize);
        Vec3::from(glow_of_texel(side, i, j)).as_dvec3()
    };
    let (i, j) = (u.floor(), v.floor());
    let row = |j: f64| texel(i, j).lerp(texel(i + 1.0, j), u - i);
    colour * row(j).lerp(row(j + 1.0), v - j)
}

fn second() -> TextureUse {
    TextureUse {
        texture: 1,
        ..texture_use(Wrap::Clamp)
    }
}

/// The left third emits a texture, the middle one a colour, the right one nothing.
const EMITTED: [[f32; 3]; 3] = [[0.5, 0.25, 1.0], [0.125, 0.5, 0.75], [0.0; 3]];

/// The wall; `emits` says whether it emits, `alpha` holds for all thirds.
fn lit(side: usize, emits: bool, (mode, alpha): (AlphaMode, f32)) -> Scene {
    let third = |k: usize| Material {
        base_colour: [0.6, 0.7, 0.8, alpha],
        emissive: if emits { EMITTED[k] } else { [0.0; 3] },
        emissive_texture: (k == 0).then(second),
        alpha: mode,
        lighting: Lighting::Lit,
        physical: Some(Physical {
            roughness: 0.6,
            metal: 0.5,
            ..Physical::default()
        }),
        ..material(Some(texture_use(Wrap::Clamp)))
    };
    Scene {
        meshes: walls(),
        materials: (0..3).map(third).collect(),
        textures: vec![photo(side), glow(side)],
        ..Scene::default()
    }
}

/// The wall with its emission alone, as colours of unlit surfaces; the second and the third part have a white texture.
fn emission_alone(side: usize, (mode, alpha): (AlphaMode, f32)) -> Scene {
    let mut scene = lit(side, false, (mode, alpha));
    scene.textures[0] = texture([side, side], |_, _| [1.0; 4]);
    for (k, made) in scene.materials.iter_mut().enumerate() {
        let [r, g, b] = EMITTED[k];
        made.base_colour = [r, g, b, alpha];
        made.lighting = Lighting::Unlit;
        made.base_texture = Some(if k == 0 {
            second()
        } else {
            texture_use(Wrap::Clamp)
        });
        made.emissive_texture = None;
    }
    scene
}

fn rendered(scene: &Scene, camera: &Camera, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::new(scene, options).expect("options within their ranges");
    renderer.render(camera).expect("a valid camera").image
}

/// The largest difference between the light that emission adds and the light that was to be added.
///
/// Under the light of surroundings pixels gather magnified texels, and those of an unlit wall are sums of sub-pixels, which are farther from the pixel's Gaussian. Where
/// the two differ, the first is compared with the integral.
fn worst(side: usize, camera: &Camera, alpha: (AlphaMode, f32), options: &RenderOptions) -> f32 {
    let [with, without] =
        [true, false].map(|emits| rendered(&lit(side, emits, alpha), camera, options));
    let unlit = RenderOptions {
        shade: Shade::Unlit,
        ..options.clone()
    };
    let alone = rendered(&emission_alone(side, alpha), camera, &unlit);
    assert!(
        alone.rgba.iter().any(|pixel| pixel[1] > 0.2),
        "nothing is emitted"
    );
    let width = camera.width as usize;
    let mut worst = 0.0f32;
    for (at, alone) in alone.rgba.iter().enumerate() {
        let added = [0, 1, 2].map(|k: usize| with.rgba[at][k] - without.rgba[at][k]);
        let added = Vec3::from(added);
        let apart = |other: Vec3| (added - other).abs().max_element();
        let mut error = apart(Vec3::new(alone[0], alone[1], alone[2]));
        if options.shade == Shade::Pbr && error > GATHERED {
            let pixel = [at % width, at / width].map(|k| k as u32);
            let truth = mean(camera, pixel, &|place| emitted(side, place));
            error = error.min(apart(truth.as_vec3() * alpha.1));
        }
        worst = worst.max(error);
    }
    worst
}

/// How far gathered texels may be from unlit ones before they are compared with the integral.
const GATHERED: f32 = 1e-4;

#[test]
fn emission_is_added_on_every_path() {
    // Texels per pixel from 0.3, all splats, to 5, all points.
    for side in [32, 64, 128, 384] {
        for eye in [[0.0, 0.0, 2.5], [1.2, 0.9, 1.6]] {
            let camera = looking_camera(DVec3::from(eye), DVec3::ZERO, 50.0, [83, 83]);
            for shade in [Shade::Headlight, Shade::Lambert, Shade::Pbr] {
                for alpha in [(AlphaMode::Opaque, 1.0), (AlphaMode::Blend, 0.5)] {
                    let options = RenderOptions {
                        shade,
                        ..RenderOptions::default()
                    };
                    let worst = worst(side, &camera, alpha, &options);
                    assert!(
                        worst < 1e-4,
                        "{side} texels, eye at {eye:?}, {shade:?}, {alpha:?}: {worst}"
                    );
                }
            }
        }
    }
}

#[test]
fn emission_is_added_by_every_method() {
    let camera = looking_camera(DVec3::new(0.5, 0.4, 2.0), DVec3::ZERO, 50.0, [83, 83]);
    for method in Method::ALL {
        for shade in [Shade::Headlight, Shade::Pbr] {
            let options = RenderOptions {
                method,
                shade,
                ..RenderOptions::default()
            };
            let worst = worst(256, &camera, (AlphaMode::Opaque, 1.0), &options);
            assert!(worst < 1e-4, "{method:?}, {shade:?}: {worst}");
        }
    }
}
