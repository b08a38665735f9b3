//! Values of points become colours.
//!
//! Takes the attributes of a file's points and a renderer of their discs, and colours the discs. A colour map runs from the 2nd to the
//! 98th percentile, so that a few strong returns do not take the colours from the rest.

use anyhow::{Result, bail};
use glam::{DVec3, Vec3};
use resample_cloud::input::PointCloudFile;
use resample_cloud::{CloudRenderer, Disc, Prepared, Shade};
use resample_core::narrow::{count, single, whole};
use volsplat::transfer::ColourMap;

use crate::args::{ColourBy, PointsLookArgs};
use crate::open::points::classes;

/// Share of the points at each end whose values have the colour of the end.
const OUTSIDE: f64 = 0.02;

/// Steps of a colour map: colours have 8 bits.
const STEPS: u16 = 256;

/// How colours were found.
pub(super) struct Found {
    /// Where they come from.
    pub(super) by: ColourBy,
    /// The values at the ends of the colour map.
    pub(super) range: Option<[f64; 2]>,
    /// The colours from the least value to the greatest.
    colours: Vec<[f32; 3]>,
    /// For the person who looks at the picture.
    pub(super) note: Option<String>,
}

impl Found {
    /// The least and greatest value, and the colours between; `None` where colours do not come from values.
    pub(super) fn scale(&self) -> Option<([f64; 2], Vec<[f32; 3]>)> {
        Some((self.range?, self.colours.clone()))
    }

    /// The light that fits: colours of a file and strengths of returns hold light already.
    pub(super) fn shade(&self) -> Shade {
        match self.by {
            ColourBy::Height | ColourBy::Class => Shade::Headlight,
            _ => Shade::Unlit,
        }
    }
}

/// Gives every disc its colour.
pub(super) fn colour(
    renderer: &mut CloudRenderer,
    look: &PointsLookArgs,
    file: &PointCloudFile,
    up: DVec3,
) -> Result<Found> {
    let by = source(look.color_by, file)?;
    let mut found = Found {
        by,
        range: None,
        colours: Vec::new(),
        note: None,
    };
    if !matches!(by, ColourBy::Height | ColourBy::Intensity) {
        refuse_values(look, by)?;
    }
    match (by, &file.colours, &file.intensities, &file.classes) {
        (ColourBy::Colour, Some(colours), ..) => renderer.recolour(|_, point| colours[point]),
        (ColourBy::Intensity, _, Some(all), _) => {
            let value = |_: &Disc, point: usize| f32::from(all[point]);
            let map = look.colormap.unwrap_or_else(ColourMap::greys);
            spread(renderer, look, (map, 0.0), &value, &mut found);
        }
        (ColourBy::Class, _, _, Some(all)) => {
            renderer.recolour(|_, point| classes::colour(all[point]))
        }
        (ColourBy::Normal, ..) => renderer.recolour(|disc, _| {
            let normal = Vec3::from(disc.normal).abs();
            normal.to_array().map(classes::in_8_bits)
        }),
        _ => {
            // Heights count from the origin of the file, in f32 from that of the discs.
            let origin = renderer.prepared().origin_in_world.dot(up);
            let axis = up.as_vec3();
            let value = move |disc: &Disc, _: usize| Vec3::from(disc.position).dot(axis);
            let map = look.colormap.unwrap_or_default();
            spread(renderer, look, (map, origin), &value, &mut found);
        }
    }
    Ok(found)
}

/// The values of a file that colours come from.
fn source(asked: ColourBy, file: &PointCloudFile) -> Result<ColourBy> {
    let lacking = |what: &str| {
        let mut has = vec!["height", "normal"];
        let lists = [
            ("colour", file.colours.is_some()),
            ("intensity", file.intensities.is_some()),
            ("class", file.classes.is_some()),
        ];
        has.extend(lists.iter().filter(|(_, has)| *has).map(|(name, _)| *name));
        has.sort_unstable();
        format!(
            "--color-by {what}: the file has none; expected {}",
            has.join(", ")
        )
    };
    match asked {
        ColourBy::Colour if file.colours.is_none() => bail!("{}", lacking("colour")),
        ColourBy::Intensity if file.intensities.is_none() => bail!("{}", lacking("intensity")),
        ColourBy::Class if file.classes.is_none() => bail!("{}", lacking("class")),
        ColourBy::Auto => Ok(match (&file.colours, &file.intensities) {
            (Some(colours), _) if differ(colours) => ColourBy::Colour,
            (_, Some(intensities)) if differ(intensities) => ColourBy::Intensity,
            _ => ColourBy::Height,
        }),
        asked => Ok(asked),
    }
}

/// Some programs write the same colour or strength for every point.
fn differ<T: PartialEq>(all: &[T]) -> bool {
    all.windows(2).any(|pair| pair[0] != pair[1])
}

/// A colour map needs values to lie on it.
fn refuse_values(look: &PointsLookArgs, by: ColourBy) -> Result<()> {
    let option = match (look.colormap, look.color_range) {
        (Some(_), _) => "--colormap",
        (None, Some(_)) => "--color-range",
        (None, None) => return Ok(()),
    };
    let word = crate::values::word(by);
    bail!("{option}: is for --color-by height and intensity, and the colours are those of {word}")
}

/// Spreads values, which count from `start`, over a colour map.
fn spread(
    renderer: &mut CloudRenderer,
    look: &PointsLookArgs,
    (map, start): (ColourMap, f64),
    value: &(dyn Fn(&Disc, usize) -> f32 + Sync),
    found: &mut Found,
) {
    let [low, high] = match look.color_range {
        Some(range) => range.map(|end| single(end - start)),
        None => usual(renderer.prepared(), value),
    };
    let colour = |step: u16| map.colour(f64::from(step) / f64::from(STEPS - 1));
    found.colours = (0..STEPS).map(colour).collect();
    let colours: Vec<[u8; 3]> = found.colours.iter().copied().map(classes::srgb8).collect();
    let size = if high > low { high - low } else { 1.0 };
    renderer.recolour(|disc, point| {
        let place = (value(disc, point) - low) / size;
        colours[usize::from(classes::in_8_bits(place))]
    });
    let range = [low, high].map(|end| f64::from(end) + start);
    found.range = Some(range);
    if look.color_range.is_none() {
        let what = match found.by {
            ColourBy::Intensity => "intensities",
            _ => "heights",
        };
        found.note = Some(format!(
            "colours are {what} from {:.5} to {:.5}, which all but 2 % at each end lie between, over the map {}; --color-by and \
             --color-range choose others",
            range[0],
            range[1],
            map.name()
        ));
    }
}

/// The values that all but a few points at each end lie between.
fn usual(prepared: &Prepared, value: &dyn Fn(&Disc, usize) -> f32) -> [f32; 2] {
    let pairs = prepared.discs.iter().zip(&prepared.points);
    let mut values: Vec<f32> = pairs
        .map(|(disc, &point)| value(disc, point as usize))
        .collect();
    let last = values.len() - 1;
    let skipped = count(whole(OUTSIDE * values.len() as f64));
    let mut nth = |place: usize| *values.select_nth_unstable_by(place, f32::total_cmp).1;
    [nth(skipped), nth(last - skipped)]
}
