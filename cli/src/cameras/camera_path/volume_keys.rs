//! The volume's part of a path's keys: the transfer function and the clip.
//!
//! Takes one key's fields, gives a [`VolumeKey`]; a list of them, with their times, gives one [`Track`] per field. A
//! field that a key leaves out is that of the keys before and after it which give it, mixed by time; before the first of
//! them and after the last it stays. Mixing is linear in time, unlike the camera's smooth motion: a box must not swing
//! beyond its keys.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use resample_core::camera::spline;
use serde_json::Value;
use volsplat::transfer::Preset;
use volsplat::{Clip, ClipPlane};

use resample_io::camera_file::json_fields::Fields;

/// The values of a volume at one key.
#[derive(Clone, Debug, Default)]
pub(crate) struct VolumeKey {
    /// The transfer function.
    pub look: Option<KeyLook>,
    /// The box along the world's axes.
    pub crop: Option<[DVec3; 2]>,
    /// The box of voxels.
    pub crop_voxels: Option<[DVec3; 2]>,
    /// The planes, with normals of length 1.
    pub clip_planes: Option<Vec<ClipPlane>>,
}

/// Where the transfer function of a key comes from.
#[derive(Clone, Debug)]
pub(crate) enum KeyLook {
    /// A colour map file, beside the file of the keys.
    File(PathBuf),
    /// A ready-made function.
    Preset(Preset),
}

/// One field along the keys that give it.
#[derive(Clone, Debug)]
pub(crate) struct Track<T> {
    times_s: Vec<f64>,
    values: Vec<T>,
}

/// A moment of a track: one value, or a share of the way from one to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Between<'a, T> {
    /// At a key, or before the first or after the last.
    At(&'a T),
    /// The values before and after, and how far it is from the one to the other, above 0 and below 1.
    Mixed(&'a T, &'a T, f64),
}

impl VolumeKey {
    /// Returns true if the key says nothing.
    pub(crate) fn is_empty(&self) -> bool {
        let clips = self.crop.is_some() || self.crop_voxels.is_some() || self.clip_planes.is_some();
        self.look.is_none() && !clips
    }
}

/// Finds the file that a name in the keys means.
pub(crate) type Named<'a> = dyn Fn(&str) -> Result<PathBuf, String> + 'a;

/// Takes the fields of a key that are about a volume; `named` finds files.
pub(crate) fn volume_key(fields: &mut Fields, named: &Named<'_>) -> Result<VolumeKey> {
    let key = VolumeKey {
        look: look(fields, named)?,
        crop: corners(fields, "crop")?,
        crop_voxels: corners(fields, "crop_voxels")?,
        clip_planes: fields
            .take("clip_planes")
            .map(planes)
            .transpose()
            .context("\"clip_planes\"")?,
    };
    // The library knows what a clip may be.
    let clip = Clip {
        crop_in_world: key.crop,
        crop_in_grid: key.crop_voxels,
        planes: key.clip_planes.clone().unwrap_or_default(),
    };
    clip.validate()?;
    Ok(key)
}

impl<T> Track<T> {
    /// The keys that give a field; `None` where none does.
    pub(crate) fn new<K>(
        times_s: &[f64],
        keys: &[K],
        field: impl Fn(&K) -> Result<Option<T>>,
    ) -> Result<Option<Self>> {
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for (&time_s, key) in times_s.iter().zip(keys) {
            if let Some(value) = field(key)? {
                times.push(time_s);
                values.push(value);
            }
        }
        Ok((!times.is_empty()).then_some(Self {
            times_s: times,
            values,
        }))
    }

    /// The values of all keys.
    pub(crate) fn values(&self) -> &[T] {
        &self.values
    }

    /// The value at a time.
    pub(crate) fn at(&self, time_s: f64) -> Between<'_, T> {
        if self.values.len() == 1 {
            return Between::At(&self.values[0]);
        }
        let at = spline::moment(&self.times_s, time_s);
        let [before, after] = [at.segment, at.segment + 1].map(|place| &self.values[place]);
        match at.share {
            share if share <= 0.0 => Between::At(before),
            share if share >= 1.0 => Between::At(after),
            share => Between::Mixed(before, after, share),
        }
    }
}

fn look(fields: &mut Fields, named: &Named<'_>) -> Result<Option<KeyLook>> {
    match (text(fields, "transfer")?, text(fields, "preset")?) {
        (Some(_), Some(_)) => bail!("\"transfer\" and \"preset\": expected one of them"),
        (None, None) => Ok(None),
        (None, Some(name)) => {
            let preset = name
                .parse()
                .map_err(anyhow::Error::msg)
                .context("\"preset\"")?;
            Ok(Some(KeyLook::Preset(preset)))
        }
        (Some(name), None) => {
            let path = named(&name)
                .map_err(anyhow::Error::msg)
                .context("\"transfer\"")?;
            if !path.is_file() {
                bail!("\"transfer\": {}: there is no such file", path.display());
            }
            Ok(Some(KeyLook::File(path)))
        }
    }
}

fn text(fields: &mut Fields, key: &'static str) -> Result<Option<String>> {
    match fields.take(key) {
        None => Ok(None),
        Some(Value::String(text)) => Ok(Some(text)),
        Some(_) => bail!("\"{key}\": expected a name in quotation marks"),
    }
}

fn corners(fields: &mut Fields, key: &'static str) -> Result<Option<[DVec3; 2]>> {
    if !fields.holds(key) {
        return Ok(None);
    }
    let [x0, y0, z0, x1, y1, z1] = fields.required_numbers::<6>(key)?;
    let ends = [DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)];
    if !ends[0].cmplt(ends[1]).all() {
        bail!(
            "\"{key}\": expected the first three numbers below the other three, found {} to {}",
            ends[0],
            ends[1]
        );
    }
    Ok(Some(ends))
}

fn planes(value: Value) -> Result<Vec<ClipPlane>> {
    let Value::Array(list) = value else {
        bail!("expected a list of planes, each [nx, ny, nz, d]")
    };
    list.into_iter()
        .enumerate()
        .map(|(place, value)| plane(&value).with_context(|| format!("plane {place}")))
        .collect()
}

fn plane(value: &Value) -> Result<ClipPlane> {
    let numbers: Option<Vec<f64>> = value
        .as_array()
        .and_then(|list| list.iter().map(Value::as_f64).collect());
    let Some(&[x, y, z, offset]) = numbers.as_deref() else {
        bail!("expected four numbers [nx, ny, nz, d], found {value}");
    };
    let normal = DVec3::new(x, y, z);
    match normal.try_normalize() {
        Some(unit) => Ok(ClipPlane {
            normal: unit,
            offset: offset / normal.length(),
        }),
        None => bail!("expected a direction in the first three numbers, found {value}"),
    }
}
