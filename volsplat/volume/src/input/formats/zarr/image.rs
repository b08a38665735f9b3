//! The image of an OME-Zarr group: its axes, its levels, and where they lie.
//!
//! Takes the folder of a group or of a plain array. Version 0.4 keeps the metadata in `.zattrs`, version 0.5 under `ome` in
//! `zarr.json`. A plain array is an image of one level whose last three axes are z, y and x.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::Error;
use crate::input::formats::zarr::metadata::json;
use crate::input::{invalid, unsupported_file};

/// The meaning of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AxisKind {
    Time,
    Channel,
    Space,
}

/// A multi-scale image.
#[derive(Debug, Default)]
pub(crate) struct Image {
    /// None for a plain array.
    kinds: Vec<AxisKind>,
    /// The levels, the finest first.
    pub(crate) datasets: Vec<Dataset>,
    channels: Vec<String>,
}

/// One level.
#[derive(Debug, Default)]
pub(crate) struct Dataset {
    path: String,
    /// Distance between neighbours along each axis; empty where it is not known.
    pub(crate) scale: Vec<f64>,
    /// Position of the first voxel along each axis.
    pub(crate) translation: Vec<f64>,
}

impl Image {
    /// The meaning of an axis of an array with `count` axes.
    pub(crate) fn kind(&self, axis: usize, count: usize) -> AxisKind {
        match self.kinds.get(axis) {
            Some(kind) => *kind,
            None if axis + 3 >= count => AxisKind::Space,
            None if axis + 4 == count => AxisKind::Channel,
            None => AxisKind::Time,
        }
    }

    /// The names of the channels, as a part of a sentence; empty where there are none.
    pub(crate) fn channel_names(&self) -> String {
        if self.channels.is_empty() {
            String::new()
        } else {
            format!(" ({})", self.channels.join(", "))
        }
    }
}

impl Dataset {
    pub(crate) fn folder(&self, group: &Path) -> PathBuf {
        if self.path.is_empty() {
            group.to_owned()
        } else {
            group.join(&self.path)
        }
    }
}

pub(crate) fn read(folder: &Path) -> Result<Image, Error> {
    let v3 = folder.join("zarr.json");
    let (path, attributes) = match json(&v3)? {
        Some(meta) if meta["node_type"] == "array" => return Ok(plain()),
        Some(meta) => (v3, meta["attributes"]["ome"].clone()),
        None if folder.join(".zarray").is_file() => return Ok(plain()),
        None => {
            let path = folder.join(".zattrs");
            let attributes = json(&path)?.unwrap_or(Value::Null);
            (path, attributes)
        }
    };
    let Some(multiscale) = attributes["multiscales"].get(0) else {
        return Err(unsupported_file(
            folder,
            "a Zarr group without an image of its own (no \"multiscales\"): name one of its folders, such as 0",
        ));
    };
    let kinds = kinds(multiscale).map_err(|what| invalid(&path, what))?;
    let shared = transformation(&multiscale["coordinateTransformations"]);
    let datasets: Vec<Dataset> = multiscale["datasets"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|level| dataset(level, &shared))
        .collect();
    if let Some(level) = datasets
        .iter()
        .position(|d| d.path.is_empty() || d.path.split('/').any(|part| part == ".."))
    {
        return Err(invalid(
            &path,
            format!("level {level} of \"datasets\" has no path inside the group"),
        ));
    }
    if datasets.is_empty() {
        return Err(invalid(&path, "\"datasets\" names no level"));
    }
    let channels = attributes["omero"]["channels"]
        .as_array()
        .into_iter()
        .flatten();
    let channels = channels
        .map(|channel| channel["label"].as_str().unwrap_or("?").to_owned())
        .collect();
    Ok(Image {
        kinds,
        datasets,
        channels,
    })
}

fn plain() -> Image {
    Image {
        datasets: vec![Dataset::default()],
        ..Image::default()
    }
}

fn kinds(multiscale: &Value) -> Result<Vec<AxisKind>, String> {
    let axes = multiscale["axes"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    let kind = |axis: &Value| {
        // Version 0.3 wrote names only.
        let name = axis.as_str().or(axis["name"].as_str()).unwrap_or("");
        match (axis["type"].as_str(), name) {
            (Some("space"), _) | (None, "x" | "y" | "z") => Ok(AxisKind::Space),
            (Some("time"), _) | (None, "t") => Ok(AxisKind::Time),
            (Some("channel"), _) | (None, "c") => Ok(AxisKind::Channel),
            (other, _) => Err(format!(
                "axis '{name}' is of type {other:?}: expected space, time or channel"
            )),
        }
    };
    axes.iter().map(kind).collect()
}

fn dataset(level: &Value, shared: &Dataset) -> Dataset {
    let own = transformation(&level["coordinateTransformations"]);
    let path = level["path"]
        .as_str()
        .unwrap_or("")
        .trim_matches('/')
        .to_owned();
    // The level's transformation comes first, the one of all levels after it.
    let at = |list: &[f64], axis: usize, none: f64| list.get(axis).copied().unwrap_or(none);
    let count = own
        .scale
        .len()
        .max(shared.scale.len())
        .max(own.translation.len())
        .max(shared.translation.len());
    let scale = (0..count)
        .map(|axis| at(&own.scale, axis, 1.0) * at(&shared.scale, axis, 1.0))
        .collect();
    let translation = (0..count)
        .map(|axis| {
            at(&own.translation, axis, 0.0) * at(&shared.scale, axis, 1.0)
                + at(&shared.translation, axis, 0.0)
        })
        .collect();
    Dataset {
        path,
        scale,
        translation,
    }
}

/// The scale and the translation of a list of transformations; empty where absent.
fn transformation(list: &Value) -> Dataset {
    let mut found = Dataset::default();
    for entry in list.as_array().into_iter().flatten() {
        let numbers = |key: &str| -> Vec<f64> {
            entry[key]
                .as_array()
                .into_iter()
                .flatten()
                .map(|n| n.as_f64().unwrap_or(f64::NAN))
                .collect()
        };
        match entry["type"].as_str() {
            Some("scale") => found.scale = numbers("scale"),
            Some("translation") => found.translation = numbers("translation"),
            _ => {}
        }
    }
    found
}
