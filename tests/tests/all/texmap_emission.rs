//! Emitted light: every path adds it to the reflected light, as the same texture would be seen as the colour of an unlit
//! surface.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{material, photo, texture, texture_use};
use texmap::scene::{AlphaMode, Lighting, Material, Mesh, Physical, Texture, TextureUse, Wrap};
use texmap::{Method, RenderOptions, Renderer, Scene, Shade};

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
        let [s, t] = [x, y].map(|k| k as f32 / side as f32);
        let patch = s < 0.2 && (0.1..0.3).contains(&t);
        let spot = x == side / 5 && y == side * 3 / 4;
        if patch || spot {
            [2.0 * s + 0.3, 0.9, 0.5 * t, 1.0]
        } else {
            [0.0, 0.0, 0.0, 1.0]
        }
    })
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

/// Texels along the side of a texture that is magnified.
const MAGNIFIED: usize = 64;

/// The largest difference between the light that emission adds and the light that was to be added.
///
/// Under the light of surroundings magnified texels are gathered by the pixel's Gaussian, and unlit ones are summed by sub-pixels. There
/// it is how much farther the light is from that by four times as many sub-pixels than theirs is.
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
    let added = with.rgba.iter().zip(&without.rgba);
    let added: Vec<_> = added
        .map(|(with, without)| [0, 1, 2].map(|k| with[k] - without[k]))
        .collect();
    let alone: Vec<_> = alone.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let apart = farthest(&added, &alone);
    if options.shade != Shade::Pbr || side > MAGNIFIED {
        return apart;
    }
    assert!(apart < 2e-3, "{side} texels: {apart}");
    let fine = RenderOptions {
        subpixels: 8,
        ..unlit
    };
    let fine = rendered(&emission_alone(side, alpha), camera, &fine);
    let fine: Vec<_> = fine.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let own = farthest(&alone, &fine);
    (farthest(&added, &fine) - own).max(0.0)
}

/// The largest difference between two lists of colours.
fn farthest(some: &[[f32; 3]], others: &[[f32; 3]]) -> f32 {
    let pairs = some.as_flattened().iter().zip(others.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

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
