//! The axes of an NRRD file that are the volume's, and where they lie in the world.
//!
//! Takes the header, gives three dims and the affine map. Axes of size 1 that are not needed are dropped, missing ones
//! (a picture, a line) are added with size 1. One axis that is not in space, such as colours, vectors or time, holds
//! components, of which one is read; more than one such axis is refused with a word on what to do.

use glam::{DAffine3, DVec3};

use crate::input::decode::axes;
use crate::input::fault::Fault;
use crate::input::formats::nrrd::header::Header;
use crate::volume::Lattice;

/// The axes of a scalar volume.
pub(crate) struct Geometry {
    pub(crate) lattice: Lattice,
    /// The axis along which the components of a voxel lie, where there are several.
    pub(crate) components: Option<usize>,
}

pub(crate) fn derive(header: &Header) -> Result<Geometry, Fault> {
    let (spatial, components) = spatial_axes(header)?;
    let mut dims = [1; 3];
    let mut columns = Vec::new();
    for (dim, &axis) in dims.iter_mut().zip(&spatial) {
        *dim = header.sizes[axis];
        columns.push(axis_in_world(header, axis, columns.len())?);
    }
    let origin = header
        .origin
        .as_deref()
        .map_or(Ok(DVec3::ZERO), |origin| in_space("space origin", origin))?;
    let lattice = Lattice {
        dims,
        world_from_index: DAffine3::from_mat3_translation(axes::complete(columns), origin),
        up_hint: header.space.as_deref().and_then(up_of),
        space: header.space.clone(),
        modality: None,
    };
    Ok(Geometry {
        lattice,
        components,
    })
}

/// The one to three axes that are the volume's, in file order, and the axis of a voxel's components.
fn spatial_axes(header: &Header) -> Result<(Vec<usize>, Option<usize>), Fault> {
    let is_spatial = |axis: usize| {
        let kind = header.kinds[axis].to_lowercase();
        let has_direction = header.directions.get(axis).is_none_or(Option::is_some);
        has_direction && matches!(kind.as_str(), "domain" | "space" | "none" | "???" | "stub")
    };
    let mut axes = Vec::new();
    let mut components = None;
    for axis in 0..header.sizes.len() {
        match (is_spatial(axis), header.sizes[axis]) {
            (true, _) => axes.push(axis),
            (false, 1) => {}
            (false, _) if components.is_none() => components = Some(axis),
            (false, size) => return Err(not_scalar(&header.kinds[axis], axis, size)),
        }
    }
    // Of more than three, those of size 1 go, the slowest first.
    while axes.len() > 3 {
        let Some(place) = axes.iter().rposition(|&axis| header.sizes[axis] == 1) else {
            let count = axes.len();
            return Err(Fault::Unsupported(format!(
                "{count} axes are longer than 1: a volume has three, so cut out one volume first"
            )));
        };
        axes.remove(place);
    }
    Ok((axes, components))
}

fn not_scalar(kind: &str, axis: usize, size: usize) -> Fault {
    let what = if matches!(kind, "domain" | "space" | "none" | "???") {
        "not in space"
    } else {
        kind
    };
    Fault::Unsupported(format!(
        "axis {axis} of size {size} is {what}, and another axis is not in space either: cut out one component or one time first"
    ))
}

fn axis_in_world(header: &Header, axis: usize, place: usize) -> Result<DVec3, Fault> {
    if let Some(direction) = header.directions.get(axis).and_then(Option::as_deref) {
        return in_space("space directions", direction);
    }
    let spacing = header.spacings[axis];
    // NaN is how the format writes a spacing that is not known.
    Ok(DVec3::AXES[place] * if spacing.is_nan() { 1.0 } else { spacing })
}

/// Two to four components as a vector of space; the fourth, which would be time, must be 0.
fn in_space(name: &str, components: &[f64]) -> Result<DVec3, Fault> {
    match *components {
        [x, y] => Ok(DVec3::new(x, y, 0.0)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        [x, y, z, 0.0] => Ok(DVec3::new(x, y, z)),
        _ => {
            let count = components.len();
            Err(Fault::Unsupported(format!(
                "field '{name}' has a vector of {count} components: space has three"
            )))
        }
    }
}

/// In the anatomical spaces the third coordinate grows towards the head.
fn up_of(space: &str) -> Option<DVec3> {
    let space = space.trim_matches('"').to_lowercase();
    let anatomical = [
        "right-anterior-superior",
        "ras",
        "left-anterior-superior",
        "las",
        "left-posterior-superior",
        "lps",
    ];
    let spatial = space.strip_suffix("-time").unwrap_or(&space);
    let known = anatomical.contains(&spatial) || matches!(spatial, "rast" | "last" | "lpst");
    known.then_some(DVec3::Z)
}
