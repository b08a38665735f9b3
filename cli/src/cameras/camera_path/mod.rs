//! Camera paths: keys in time, each a camera, and the pictures between them.
//!
//! Takes a JSON file of keys, gives a camera for every picture: the keys' cameras are passed through smoothly
//! ([`spline`]). A look-at camera moves by its target, its direction and its distance, so that keys around an object
//! go around it; a calibrated camera moves by its eye. Lengths and focal lengths move on a logarithmic scale: a zoom
//! is steady. All keys must agree in kind of projection and in picture size.
//!
//! ```json
//! { "keys": [ { "time": 0, "camera": { "position": [0, 0, 9], "target": [0, 0, 0], "up": [0, 1, 0] } },
//!             { "time": 2.5, "camera": { "position": [9, 0, 0], "target": [0, 0, 0], "up": [0, 1, 0] } } ] }
//! ```
//! Times are seconds; there are `round(duration * pictures per second) + 1` pictures. Keys of a volume may also say how it
//! looks and clips ([`volume_keys`]).

mod volume_keys;

use std::path::Path;

use anyhow::{Context, Result, bail};
use resample_core::Camera;
use resample_core::camera::spline;
use resample_core::camera::tracks::CameraTracks;
use resample_io::Gate;
use serde_json::Value;

use resample_io::camera_file;
use resample_io::camera_file::json_fields::Fields;
use resample_io::camera_file::{CameraDefaults, FileCamera};
pub(crate) use spline::Moment;
use volume_keys::Named;
pub(crate) use volume_keys::{Between, KeyLook, Track, VolumeKey};

/// Keys in ascending order of time, at least two.
#[derive(Clone, Debug)]
pub(crate) struct CameraPath {
    times_s: Vec<f64>,
    keys: Vec<Key>,
}

/// One key.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    camera: FileCamera,
    volume: VolumeKey,
}

/// The keys of a path that an application knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum KeyKind {
    /// Where the camera is.
    Cameras,
    /// And how a volume looks.
    Volume,
}

/// Most pictures of a path: an hour at 25 a second is 90 000. More is a slip of the finger.
const MAX_PICTURES: f64 = 100_000.0;

/// Reads `path`.
pub(crate) fn read(
    path: &Path,
    defaults: &CameraDefaults,
    kind: KeyKind,
    gate: &Gate,
) -> Result<CameraPath> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let named = |name: &str| gate.named_file(name, folder, folder);
    camera_file::read_value(path)
        .map_err(anyhow::Error::from)
        .and_then(|value| keys(value, defaults, kind, &named))
        .with_context(|| format!("{}: not a usable camera path", path.display()))
}

impl CameraPath {
    /// The moments of the pictures.
    pub(crate) fn pictures(&self, fps: f64) -> Result<Vec<Moment>> {
        let (first, last) = (self.times_s[0], self.times_s[self.times_s.len() - 1]);
        let steps = ((last - first) * fps).round().max(1.0);
        if steps >= MAX_PICTURES {
            bail!(
                "{} seconds at {fps} pictures per second are more than {MAX_PICTURES} pictures",
                last - first
            );
        }
        let time = |step: usize| first + (last - first) * step as f64 / steps;
        Ok((0..=steps as usize)
            .map(|step| spline::moment(&self.times_s, time(step)))
            .collect())
    }

    /// The time of a picture, seconds.
    pub(crate) fn time_s(&self, at: Moment) -> f64 {
        let [before, after] = [at.segment, at.segment + 1].map(|key| self.times_s[key]);
        before + at.share * (after - before)
    }

    /// The times of the keys, and their changes of the volume; `None` where no key changes it.
    pub(crate) fn volume_keys(&self) -> Option<(&[f64], Vec<&VolumeKey>)> {
        let keys: Vec<&VolumeKey> = self.keys.iter().map(|key| &key.volume).collect();
        keys.iter()
            .any(|key| !key.is_empty())
            .then_some((&self.times_s, keys))
    }

    /// A camera for each picture; `fitted` gives near planes to cameras of the file that have none.
    pub(crate) fn cameras(
        &self,
        pictures: &[Moment],
        fitted: impl Fn(&FileCamera) -> Result<Camera, resample_core::Error>,
    ) -> Result<Vec<Camera>> {
        let cameras: Vec<Camera> = self
            .keys
            .iter()
            .map(|key| fitted(&key.camera))
            .collect::<Result<_, _>>()?;
        let distances = self.keys.iter().map(|key| key.camera.target_distance());
        let tracks = CameraTracks::new(&cameras, distances);
        pictures
            .iter()
            .map(|&at| Ok(tracks.camera(&self.times_s, at)?))
            .collect()
    }
}

fn keys(
    value: Value,
    defaults: &CameraDefaults,
    kind: KeyKind,
    named: &Named<'_>,
) -> Result<CameraPath> {
    let mut fields = Fields::new(value)?;
    let list = fields.required_list("keys")?;
    fields.finish()?;
    if list.len() < 2 {
        bail!(
            "\"keys\": a path needs two keys or more, found {}",
            list.len()
        );
    }
    let (mut times_s, mut keys) = (Vec::new(), Vec::new());
    for (index, value) in list.into_iter().enumerate() {
        let (time_s, key) = one_key(value, defaults, kind, named)
            .with_context(|| format!("key {index} of the path"))?;
        if times_s.last().is_some_and(|&before| time_s <= before) {
            bail!(
                "key {index} of the path: \"time\" is {time_s}, expected more than that of the key before"
            );
        }
        times_s.push(time_s);
        keys.push(key);
    }
    check_alike(&keys)?;
    Ok(CameraPath { times_s, keys })
}

fn one_key(
    value: Value,
    defaults: &CameraDefaults,
    kind: KeyKind,
    named: &Named<'_>,
) -> Result<(f64, Key)> {
    let mut fields = Fields::new(value)?;
    let time_s = fields.required_number("time")?;
    let camera = camera_file::one_camera(fields.required_value("camera")?, defaults)
        .context("\"camera\"")?;
    let volume = match kind {
        KeyKind::Cameras => VolumeKey::default(),
        KeyKind::Volume => volume_keys::volume_key(&mut fields, named)?,
    };
    fields.finish()?;
    Ok((time_s, Key { camera, volume }))
}

/// Checks what cannot move: the kind of projection and the picture size.
fn check_alike(keys: &[Key]) -> Result<()> {
    let kind = |key: &Key| (key.camera.projection(), key.camera.size());
    let first = kind(&keys[0]);
    match keys.iter().position(|key| kind(key) != first) {
        None => Ok(()),
        Some(other) => {
            bail!(
                "key {other} of the path: its picture size or its projection is not that of key 0: make them the same"
            )
        }
    }
}

#[cfg(test)]
mod tests;
