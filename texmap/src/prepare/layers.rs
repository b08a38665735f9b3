//! The layers of a material above and below its metal and paint: a clear coat, sheen, glass, and the reflection of its dielectric.
//!
//! Takes a material; gives the numbers of each layer and the picture of it. A layer has two pictures in glTF; where both lie alike and are as
//! large, they become one with the numbers of both. Limits: where they do not, the second counts by its mean.

use glam::Vec3;
use resample_mesh::scene::{CoatNormals, Glass, Physical, Scene, TextureUse};

use crate::prepare::texel_use::{TexelUse, Used};

/// The reflection of a dielectric, a coat, sheen, and what passes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layers {
    /// Reflectance along the normal: red, green, blue.
    pub(crate) reflectance: Vec3,
    /// How much of the reflection counts.
    pub(crate) specular: f32,
    pub(crate) reflection: Shares,
    pub(crate) coat: f32,
    pub(crate) coat_roughness: f32,
    pub(crate) coat_normals: CoatNormals,
    pub(crate) coated: Shares,
    pub(crate) sheen: Vec3,
    pub(crate) sheen_roughness: f32,
    pub(crate) of_sheen: Shares,
    /// How much of the light that is not reflected passes.
    pub(crate) glass: f32,
    /// The logarithm of one over the light that is left after the body: red, green, blue.
    pub(crate) absorbed: Vec3,
    pub(crate) of_glass: Shares,
}

/// The numbers that the picture of a layer has; the others are 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    /// The first: the amount of a coat, a colour.
    pub(crate) has_first: bool,
    /// The second: a roughness, the amount of a reflection.
    pub(crate) has_second: bool,
}

/// The picture of a layer.
pub(crate) struct LayerPicture {
    pub(crate) used: Used,
    shares: Shares,
    /// The second picture and its channel, where it could not be joined.
    apart: Option<(TextureUse, usize)>,
}

impl Layers {
    /// The layers of a material; `None` where it has only those that every material has.
    pub(crate) fn new(scene: &Scene, physical: &Physical) -> Option<Self> {
        let plain = Physical::default();
        let is_plain = physical.dielectric == plain.dielectric
            && physical.coat.is_none()
            && physical.sheen.is_none()
            && physical.glass.is_none();
        if is_plain {
            return None;
        }
        let finished = |layer: Option<LayerPicture>| {
            let shares = layer
                .as_ref()
                .map_or(Shares::default(), |layer| layer.shares);
            let apart = layer.and_then(|layer| layer.apart);
            let mean = apart.map(|(used, channel)| scene.textures[used.texture].mean(channel));
            (shares, mean.unwrap_or(1.0))
        };
        let (reflection, specular_mean) = finished(reflection(scene, physical));
        let (coated, coat_mean) = finished(coat(scene, physical));
        let (of_sheen, sheen_mean) = finished(sheen(scene, physical));
        let (of_glass, thickness_mean) = finished(glass(scene, physical));
        let dielectric = &physical.dielectric;
        let part = |number: f32| number.clamp(0.0, 1.0);
        let (coat, sheen) = (physical.coat, physical.sheen);
        Some(Self {
            reflectance: Vec3::from(dielectric.reflectance()).clamp(Vec3::ZERO, Vec3::ONE),
            specular: part(dielectric.specular * specular_mean),
            reflection,
            coat: coat.map_or(0.0, |coat| part(coat.amount)),
            coat_roughness: coat.map_or(0.0, |coat| part(coat.roughness * coat_mean)),
            coat_normals: coat.map_or(CoatNormals::Smooth, |coat| coat.normals),
            coated,
            sheen: sheen.map_or(Vec3::ZERO, |sheen| {
                Vec3::from(sheen.colour).clamp(Vec3::ZERO, Vec3::ONE)
            }),
            sheen_roughness: sheen.map_or(0.0, |sheen| part(sheen.roughness * sheen_mean)),
            of_sheen,
            glass: physical.glass.map_or(0.0, |glass| part(glass.amount)),
            absorbed: physical
                .glass
                .map_or(Vec3::ZERO, |glass| absorbed(&glass, thickness_mean)),
            of_glass,
        })
    }
}

/// The logarithm of one over the light that is left after a body.
fn absorbed(glass: &Glass, thickness_mean: f32) -> Vec3 {
    // Black would be no number.
    let colour = Vec3::from(glass.attenuation_colour).clamp(Vec3::splat(1e-6), Vec3::ONE);
    let thickness = (glass.thickness * thickness_mean).max(0.0);
    let part = thickness / glass.attenuation_distance.max(f32::MIN_POSITIVE);
    // As much as leaves nothing.
    -colour.map(f32::ln) * part.min(100.0)
}

/// The picture of glass: how much passes is red, thickness green.
pub(crate) fn glass(scene: &Scene, physical: &Physical) -> Option<LayerPicture> {
    let glass = physical.glass?;
    let pictures = [glass.amount_texture, glass.thickness_texture];
    joined(scene, pictures, 1, red_and_green)
}

/// The picture of a coat: its amount is red, its roughness green.
pub(crate) fn coat(scene: &Scene, physical: &Physical) -> Option<LayerPicture> {
    let coat = physical.coat?;
    let pictures = [coat.amount_texture, coat.roughness_texture];
    joined(scene, pictures, 1, red_and_green)
}

fn red_and_green(red: Option<TextureUse>, green: Option<TextureUse>) -> Option<Used> {
    match (red, green) {
        (Some(red), Some(green)) if red != green => {
            let picture = red.texture;
            Some((green, TexelUse::WithOcclusion { picture }))
        }
        _ => Some((red.or(green)?, TexelUse::Numbers)),
    }
}

/// The picture of sheen: a colour, and its roughness in alpha.
pub(crate) fn sheen(scene: &Scene, physical: &Physical) -> Option<LayerPicture> {
    let sheen = physical.sheen?;
    let pictures = [sheen.colour_texture, sheen.roughness_texture];
    joined(scene, pictures, 3, colour_with)
}

/// The picture of a dielectric's reflection: a colour, and how much counts in alpha.
pub(crate) fn reflection(scene: &Scene, physical: &Physical) -> Option<LayerPicture> {
    let dielectric = physical.dielectric;
    let pictures = [dielectric.colour_texture, dielectric.specular_texture];
    joined(scene, pictures, 3, colour_with)
}

fn colour_with(colour: Option<TextureUse>, alpha: Option<TextureUse>) -> Option<Used> {
    let used = colour.or(alpha)?;
    let picture = alpha.map_or(used.texture, |alpha| alpha.texture);
    Some((used, TexelUse::ColourWith { picture }))
}

/// Two pictures as one by `join`, if they lie alike; else the first, and the mean of a channel of the second.
fn joined(
    scene: &Scene,
    [first, second]: [Option<TextureUse>; 2],
    channel: usize,
    join: impl Fn(Option<TextureUse>, Option<TextureUse>) -> Option<Used>,
) -> Option<LayerPicture> {
    let apart = first.zip(second).filter(|&(first, second)| {
        let moved = TextureUse {
            texture: first.texture,
            ..second
        };
        let size = |used: TextureUse| {
            let picture = &scene.textures[used.texture];
            [picture.width, picture.height]
        };
        moved != first || size(first) != size(second)
    });
    let with_second = second.filter(|_| apart.is_none());
    Some(LayerPicture {
        used: join(first, with_second)?,
        shares: Shares {
            has_first: first.is_some(),
            has_second: with_second.is_some(),
        },
        apart: apart.map(|(_, second)| (second, channel)),
    })
}
