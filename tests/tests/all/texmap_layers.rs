//! Layers of materials: how a dielectric reflects, clear coats and sheen, against sums over directions in f64.

use std::sync::Arc;

use glam::DVec3;
use resample_core::{Camera, LookAt};
use resample_tests::meshes::surroundings::{Above, Reflector, lamps, reflected_through};
use resample_tests::meshes::textured::{material, quad, seen_from_afar, texture_use};
use texmap::scene::{
    Coat, CoatNormals, Dielectric, Lighting, Material, Physical, Sheen, Surroundings, Texels,
    Texture, Wrap,
};
use texmap::{RenderOptions, Renderer, Scene};

/// The colour in the middle of a lit square in the plane z = 0, seen by a distant camera.
fn seen(
    surroundings: &Surroundings,
    textures: Vec<Texture>,
    physical: Physical,
    eye: DVec3,
) -> DVec3 {
    let corners = [[-8.0, -8.0], [8.0, -8.0], [8.0, 8.0], [-8.0, 8.0]].map(|[x, y]| [x, y, 0.0]);
    let scene = Scene {
        meshes: vec![quad(
            corners,
            [[0.0, 1.0], [1.0; 2], [1.0, 0.0], [0.0; 2]],
            0,
        )],
        materials: vec![Material {
            base_colour: [0.5, 0.25, 0.1, 1.0],
            lighting: Lighting::Lit,
            physical: Some(physical),
            ..material(None)
        }],
        textures,
        surroundings: Some(Arc::new(surroundings.clone())),
        ..Scene::default()
    };
    let [r, g, b, _] = seen_from_afar(&scene, eye);
    DVec3::new(r, g, b)
}

fn eyes() -> [DVec3; 4] {
    [0.1, 0.6, 1.0, 1.3].map(|angle: f64| DVec3::new(angle.sin(), 0.0, angle.cos()))
}

const BELOW: Reflector = Reflector {
    base: DVec3::new(0.5, 0.25, 0.1),
    metal: 0.2,
    roughness: 0.6,
};

fn physical() -> Physical {
    Physical {
        metal: 0.2,
        roughness: 0.6,
        ..Physical::default()
    }
}

/// The worst difference from the sum, over eyes, as a part of it.
fn worst(surroundings: &Surroundings, physical: Physical, above: &Above) -> f64 {
    let mut worst = 0.0f64;
    for eye in eyes() {
        let light = seen(surroundings, Vec::new(), physical, eye);
        let at = (DVec3::Z, eye);
        let truth = reflected_through(surroundings, (&BELOW, above), at, 1 << 15);
        worst = worst.max(((light - truth) / truth).abs().max_element());
    }
    worst
}

/// The error of a plain surface in this room is that of blurred light; each layer adds at most as much again.
const MOST: f64 = 0.06;

#[test]
fn dielectrics_reflect_by_their_index_their_colour_and_their_amount() {
    let room = lamps(128);
    let plain = worst(&room, physical(), &Above::default());
    assert!(plain < MOST, "without: {plain}");
    for (ior, specular, colour) in [
        (2.4, 1.0, [1.0; 3]),
        (1.33, 1.0, [1.0; 3]),
        (1.5, 0.3, [1.0; 3]),
        (1.8, 0.9, [0.2, 1.0, 0.6]),
    ] {
        let dielectric = Dielectric {
            ior,
            specular,
            colour,
            ..Dielectric::default()
        };
        let f0 = f64::from((ior - 1.0) / (ior + 1.0)).powi(2) * f64::from(specular);
        let above = Above {
            f0: DVec3::from(colour.map(f64::from)) * f0,
            f90: f64::from(specular),
            ..Above::default()
        };
        let physical = Physical {
            dielectric,
            ..physical()
        };
        let off = worst(&room, physical, &above);
        assert!(off < MOST, "{dielectric:?}: {off}");
    }
}

#[test]
fn coats_reflect_above_what_they_dim() {
    let room = lamps(128);
    for (amount, roughness) in [(1.0, 0.05), (1.0, 0.3), (0.5, 0.6)] {
        let coat = Coat {
            amount,
            roughness,
            amount_texture: None,
            roughness_texture: None,
            normals: CoatNormals::Smooth,
        };
        let above = Above {
            coat: [amount, roughness].map(f64::from),
            ..Above::default()
        };
        let physical = Physical {
            coat: Some(coat),
            ..physical()
        };
        let off = worst(&room, physical, &above);
        assert!(off < MOST, "{coat:?}: {off}");
    }
}

fn fibres(colour: [f32; 3], roughness: f32) -> (Physical, Above) {
    let sheen = Sheen {
        colour,
        roughness,
        colour_texture: None,
        roughness_texture: None,
    };
    let above = Above {
        sheen: DVec3::from(colour.map(f64::from)),
        sheen_roughness: f64::from(roughness),
        ..Above::default()
    };
    let physical = Physical {
        sheen: Some(sheen),
        ..physical()
    };
    (physical, above)
}

#[test]
fn fibres_shine_at_grazing_angles() {
    let even = Surroundings {
        width: 8,
        height: 4,
        rgb: vec![[1.0; 3]; 32],
    };
    let room = lamps(128);
    for (colour, roughness) in [([1.0; 3], 0.3), ([0.2, 0.5, 0.9], 0.6), ([0.8; 3], 1.0)] {
        let (physical, above) = fibres(colour, roughness);
        let off = worst(&even, physical, &above);
        assert!(off < 0.003, "{colour:?}, {roughness} in even light: {off}");
        let off = worst(&room, physical, &above);
        assert!(off < 0.13, "{colour:?}, {roughness} in a room: {off}");
    }
}

/// A picture of one colour.
fn even_picture(texel: [u8; 4]) -> Texture {
    Texture {
        name: String::new(),
        width: 4,
        height: 4,
        texels: Texels::Srgb8(Arc::new(vec![texel; 16])),
    }
}

#[test]
fn pictures_of_layers_are_their_factors() {
    let room = lamps(64);
    let picture = |texture: usize| {
        Some(texmap::scene::TextureUse {
            texture,
            ..texture_use(Wrap::Repeat)
        })
    };
    // Codes 188 and 128 of sRGB.
    let [light, dark] =
        [188u8, 128].map(|code| resample_core::image::linear_from_srgb(f32::from(code) / 255.0));
    let share = |code: u8| f32::from(code) / 255.0;
    let textures = vec![
        even_picture([102, 204, 0, 255]),
        even_picture([0, 51, 0, 255]),
        even_picture([188, 128, 188, 153]),
        even_picture([0, 0, 0, 204]),
        // As large as no other, so that its mean counts.
        Texture {
            width: 2,
            height: 1,
            texels: Texels::Srgb8(Arc::new(vec![[0, 51, 0, 102], [0, 153, 0, 204]])),
            ..even_picture([0; 4])
        },
    ];
    let coat = |amount, roughness, amount_texture, roughness_texture| Coat {
        amount,
        roughness,
        amount_texture,
        roughness_texture,
        normals: CoatNormals::Smooth,
    };
    let sheen = |colour, roughness, colour_texture, roughness_texture| Sheen {
        colour,
        roughness,
        colour_texture,
        roughness_texture,
    };
    let of_coat = |coat| Physical {
        coat: Some(coat),
        ..physical()
    };
    let of_sheen = |sheen| Physical {
        sheen: Some(sheen),
        ..physical()
    };
    let of_dielectric = |dielectric| Physical {
        dielectric,
        ..physical()
    };
    let pairs = [
        (
            of_coat(coat(1.0, 0.5, picture(0), None)),
            of_coat(coat(share(102), 0.5, None, None)),
        ),
        (
            of_coat(coat(1.0, 0.5, picture(0), picture(0))),
            of_coat(coat(share(102), 0.5 * share(204), None, None)),
        ),
        (
            of_coat(coat(0.5, 1.0, picture(0), picture(1))),
            of_coat(coat(0.5 * share(102), share(51), None, None)),
        ),
        (
            of_coat(coat(1.0, 1.0, picture(0), picture(4))),
            of_coat(coat(share(102), share(102), None, None)),
        ),
        (
            of_sheen(sheen([0.5; 3], 1.0, picture(2), picture(4))),
            of_sheen(sheen(
                [0.5 * light, 0.5 * dark, 0.5 * light],
                share(153),
                None,
                None,
            )),
        ),
        (
            of_sheen(sheen([1.0; 3], 0.5, picture(2), None)),
            of_sheen(sheen([light, dark, light], 0.5, None, None)),
        ),
        (
            of_sheen(sheen([0.5; 3], 1.0, picture(2), picture(3))),
            of_sheen(sheen(
                [0.5 * light, 0.5 * dark, 0.5 * light],
                share(204),
                None,
                None,
            )),
        ),
        (
            of_dielectric(Dielectric {
                ior: 2.0,
                specular_texture: picture(2),
                colour_texture: picture(2),
                ..Dielectric::default()
            }),
            of_dielectric(Dielectric {
                ior: 2.0,
                specular: share(153),
                colour: [light, dark, light],
                ..Dielectric::default()
            }),
        ),
        (
            of_dielectric(Dielectric {
                ior: 2.0,
                specular_texture: picture(3),
                ..Dielectric::default()
            }),
            of_dielectric(Dielectric {
                ior: 2.0,
                specular: share(204),
                ..Dielectric::default()
            }),
        ),
    ];
    for (number, (with_pictures, with_factors)) in pairs.into_iter().enumerate() {
        for eye in eyes() {
            let one = seen(&room, textures.clone(), with_pictures, eye);
            let other = seen(&room, textures.clone(), with_factors, eye);
            // Texels are kept in 16 bits.
            let off = ((one - other) / other).abs().max_element();
            assert!(off < 1e-3, "pair {number} from {eye:.2}: {one} for {other}");
        }
    }
}

/// The colours of two pixels of a square of glass in even light: one before an unlit square, one before nothing.
fn through_glass(physical: Physical, base: [f32; 4], background: [f32; 3]) -> [[f64; 4]; 2] {
    let at = |depth: f32, [left, right]: [f32; 2]| {
        [[left, -8.0], [right, -8.0], [right, 8.0], [left, 8.0]].map(|[x, y]| [x, y, depth])
    };
    let uvs = [[0.0, 1.0], [1.0; 2], [1.0, 0.0], [0.0; 2]];
    let glass = Material {
        base_colour: base,
        lighting: Lighting::Lit,
        alpha: texmap::scene::AlphaMode::Blend,
        physical: Some(physical),
        ..material(None)
    };
    let behind = Material {
        base_colour: [0.5, 0.4, 0.3, 1.0],
        lighting: Lighting::Unlit,
        ..material(None)
    };
    let scene = Scene {
        meshes: vec![
            quad(at(0.0, [-8.0, 8.0]), uvs, 0),
            quad(at(-1.0, [-8.0, 0.0]), uvs, 1),
        ],
        materials: vec![glass, behind],
        surroundings: Some(Arc::new(Surroundings {
            width: 8,
            height: 4,
            rgb: vec![[1.0; 3]; 32],
        })),
        ..Scene::default()
    };
    let pose = LookAt {
        position: DVec3::Z * 50.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::orthographic(&pose, 4.0, [16, 16]).expect("a pose with a direction");
    let options = RenderOptions {
        background,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene, &options).expect("good options");
    let image = renderer.render(&camera).expect("a valid camera").image;
    [3, 12].map(|x| image.pixel(x, 8).map(f64::from))
}

#[test]
fn glass_shows_what_lies_behind_in_its_colour() {
    let base = [1.0, 0.6, 0.2, 1.0];
    for (amount, background, thickness) in [
        (1.0, [1.0; 3], 0.0),
        (0.7, [0.2, 0.5, 0.9], 0.0),
        (1.0, [0.0; 3], 2.0),
    ] {
        let glass = texmap::scene::Glass {
            amount,
            amount_texture: None,
            thickness,
            thickness_texture: None,
            attenuation_colour: [0.25, 0.5, 1.0],
            attenuation_distance: 4.0,
        };
        let physical = Physical {
            roughness: 0.1,
            glass: Some(glass),
            ..Physical::default()
        };
        let [before_grey, before_nothing] = through_glass(physical, base, background);
        for k in 0..3 {
            // Along the normal the surface reflects 0.04 of even light; the rest passes through it or scatters below it.
            let amount = f64::from(amount);
            let colour = f64::from(base[k]) * (1.0 - 0.04);
            let body = [0.25f64, 0.5, 1.0][k].powf(f64::from(thickness) / 4.0);
            let front = 0.04 + colour * (1.0 - amount);
            let seen = |behind: f64| front + colour * amount * body * behind;
            let off = before_grey[k] - seen([0.5, 0.4, 0.3][k]);
            assert!(off.abs() < 3e-3, "before grey: {off} in {before_grey:?}");
            let behind = f64::from(background[k]);
            let laid_over = before_nothing[k] + (1.0 - before_nothing[3]) * behind;
            let off = laid_over - seen(behind);
            assert!(
                off.abs() < 3e-3,
                "before the background: {off} in {before_nothing:?}"
            );
        }
        assert!(
            (before_grey[3] - 1.0).abs() < 1e-5,
            "nothing is seen through both"
        );
    }
}

#[test]
fn glass_without_light_of_surroundings_is_thin() {
    let glass = texmap::scene::Glass {
        amount: 0.5,
        amount_texture: None,
        thickness: 0.0,
        thickness_texture: None,
        attenuation_colour: [1.0; 3],
        attenuation_distance: f32::INFINITY,
    };
    let material = Material {
        lighting: Lighting::Unlit,
        alpha: texmap::scene::AlphaMode::Blend,
        physical: Some(Physical {
            glass: Some(glass),
            ..Physical::default()
        }),
        ..material(None)
    };
    let corners = [[-8.0, -8.0], [8.0, -8.0], [8.0, 8.0], [-8.0, 8.0]].map(|[x, y]| [x, y, 0.0]);
    let scene = Scene {
        meshes: vec![quad(
            corners,
            [[0.0, 1.0], [1.0; 2], [1.0, 0.0], [0.0; 2]],
            0,
        )],
        materials: vec![material],
        ..Scene::default()
    };
    let [.., alpha] = seen_from_afar(&scene, DVec3::Z);
    assert!((alpha - 0.55).abs() < 1e-4, "{alpha}");
}

#[test]
fn numbers_and_coordinates_are_those_of_the_triangle_that_covers_most() {
    let at = |depth: f32, [left, right]: [f32; 2]| {
        [[left, -8.0], [right, -8.0], [right, 8.0], [left, 8.0]].map(|[x, y]| [x, y, depth])
    };
    let uvs = [[0.0, 1.0], [1.0; 2], [1.0, 0.0], [0.0; 2]];
    let pictured = Material {
        lighting: Lighting::Unlit,
        ..material(Some(texture_use(Wrap::Repeat)))
    };
    let plain = Material {
        lighting: Lighting::Unlit,
        ..material(None)
    };
    let scene = Scene {
        // The second lies before the first, from x = 0.1 on.
        meshes: vec![
            quad(at(0.0, [-8.0, 8.0]), uvs, 1),
            quad(at(1.0, [0.1, 8.0]), uvs, 0),
        ],
        materials: vec![plain, pictured],
        textures: vec![even_picture([200, 100, 50, 255])],
        ..Scene::default()
    };
    let pose = LookAt {
        position: DVec3::Z * 50.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    // 20 pixels of one unit: the outer two on each side see nothing.
    let camera = Camera::orthographic(&pose, 20.0, [20, 20]).expect("a pose with a direction");
    let options = RenderOptions {
        planes: vec![
            texmap::PlaneKind::Mesh,
            texmap::PlaneKind::Material,
            texmap::PlaneKind::Coordinates,
        ],
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene, &options).expect("good options");
    let image = renderer.render(&camera).expect("a valid camera").image;
    let plane = |name: &str| {
        let plane = image.planes.iter().find(|plane| plane.name == name);
        &plane.expect("it was asked for").values
    };
    for x in 0..20 {
        let of = |name: &str| plane(name)[9 * 20 + x];
        // The pixel with the edge lies between x = 0 and 1, nine tenths of it on the second.
        let expected = match x {
            0 | 1 | 18 | 19 => (-1.0, -1.0, [0.0; 2]),
            2..=9 => (0.0, 1.0, [(x as f32 - 1.5) / 16.0, 7.5 / 16.0]),
            _ => (1.0, 0.0, [0.0; 2]),
        };
        assert_eq!(
            (of("mesh"), of("material")),
            (expected.0, expected.1),
            "pixel {x}"
        );
        // A border pixel of the first sees it up to its own middle.
        for (name, expected) in ["uv.U", "uv.V"].into_iter().zip(expected.2) {
            assert!(
                (of(name) - expected).abs() < 0.02,
                "{name} at {x}: {} for {expected}",
                of(name)
            );
        }
    }
}
