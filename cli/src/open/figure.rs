//! The figure of a scene, from the typed options and the scene's bounds, unit, axes and colours.

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, Projection};
use resample_io::figure::{Axes, ColourBar, Figure, Ground, ScaleBar, number};

use crate::args::{AxesKind, FigureArgs};
use crate::cameras::framing;
use texmap::background::Background;

/// The facts of a scene that a figure shows.
pub(crate) struct FigureFacts {
    /// The box around the visible part, world units.
    pub(crate) bounds: [DVec3; 2],
    /// The unit of lengths.
    pub(crate) unit: Option<String>,
    /// The names of the axes.
    pub(crate) names: [String; 3],
    /// Values and their colours, where the scene has one function for them.
    pub(crate) colours: Option<([f64; 2], Vec<[f32; 3]>)>,
}

impl FigureFacts {
    /// The facts of a scene whose axes are x, y and z, without a scale of colours.
    pub(crate) fn of_box(bounds: [DVec3; 2], unit: Option<String>) -> Self {
        Self {
            bounds,
            unit,
            names: ["x", "y", "z"].map(str::to_owned),
            colours: None,
        }
    }
}

/// Luminance on a display, 0 to 1, from which on letters are black. The middle.
const LIGHT_GROUND: f32 = 0.5;

/// The figure; `None` where nothing of one was typed.
///
/// # Errors
/// A colour bar of a scene that has no such scale.
pub(crate) fn figure(
    args: &FigureArgs,
    background: &Background,
    facts: impl FnOnce() -> FigureFacts,
) -> Result<Option<Figure>> {
    if *args == FigureArgs::default() {
        return Ok(None);
    }
    let facts = facts();
    if args.colour_bar.is_some() && facts.colours.is_none() {
        bail!(
            "--colour-bar: only a volume with one transfer function has a scale of colours, or points by height or intensity, not labels, several channels or a mesh: leave it out"
        );
    }
    let [low, high] = facts.bounds;
    Ok(Some(Figure {
        scale_bar: args.scale_bar.map(|length| ScaleBar {
            length,
            unit: facts.unit.clone(),
            at: 0.5 * (low + high),
        }),
        colour_bar: args
            .colour_bar
            .clone()
            .zip(facts.colours)
            .map(|(title, (range, colours))| ColourBar {
                title,
                range,
                colours,
            }),
        axes: args.axes.map(|kind| Axes {
            names: facts.names,
            bounds: (kind == AxesKind::Box).then_some(facts.bounds),
            unit: facts.unit,
        }),
        caption: args.caption.clone(),
        ground: ground(background),
    }))
}

/// The corners of the box of `--axes=box`, with room for its numbers and names; empty without that option. The framing has to show them.
pub(crate) fn corners_of_axes(args: &FigureArgs, [low, high]: [DVec3; 2]) -> Vec<DVec3> {
    if args.axes != Some(AxesKind::Box) {
        return Vec::new();
    }
    // Parts of the box's longest side, guesses that were looked at. The colour bar takes room at the right.
    let room = match args.colour_bar {
        None => 0.1,
        Some(_) => 0.16,
    } * (high - low).max_element();
    framing::volume::corners([low - room, high + room]).to_vec()
}

fn ground(background: &Background) -> Ground {
    match background {
        Background::Colour(rgb) => {
            let [red, green, blue] = rgb.map(|light| srgb_from_linear(light.clamp(0.0, 1.0)));
            // Weights of Rec. 709.
            let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
            if luminance > LIGHT_GROUND {
                Ground::Light
            } else {
                Ground::Dark
            }
        }
        Background::Transparent | Background::Picture(_) => Ground::Unknown,
    }
}

/// Refuses a bar that is longer than a picture.
pub(crate) fn check(figure: &Figure, cameras: &[Camera]) -> Result<()> {
    let Some(ScaleBar {
        length: Some(length),
        at,
        ..
    }) = figure.scale_bar
    else {
        return Ok(());
    };
    for camera in cameras {
        let across = match camera.projection {
            Projection::Perspective => camera.camera_from_world.transform_point3(at).z,
            Projection::Orthographic => 1.0,
        } * f64::from(camera.width)
            / camera.fx;
        if across > 0.0 && length > across {
            bail!(
                "--scale-bar {}: a picture is {} units wide: choose a shorter bar",
                number(length),
                number((1e3 * across).round() / 1e3)
            );
        }
    }
    Ok(())
}
