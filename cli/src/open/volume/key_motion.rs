//! Moving parts of a volume: its transfer function and its clip, between the keys of a path.
//!
//! Takes the keys and the volume, makes the functions once, gives each picture its own by mixing those of the keys
//! around it. The renderer is prepared with the mean of all of them, so that its bricks hold what any picture shows and
//! only a table is made anew; an order that classifies voxels is prepared again for each picture.

use anyhow::{Context, Result, bail};
use glam::DVec3;
use serde_json::{Value, json};
use volsplat::transfer::FileLook;
use volsplat::{Clip, ClipPlane, ColourEncoding, Described, Renderer, Reuse, TransferFunction};

use crate::args::VolsplatArgs;
use crate::cameras::camera_path::{Between, CameraPath, KeyLook, Moment, Track, VolumeKey};
use crate::look::options;
use crate::open::volume::data::{Content, Keeping};
use crate::process::report::Progress;

/// A volume's transfer function and clip over the pictures of a path.
pub(crate) struct VolumeMotion {
    /// When each picture is.
    times_s: Vec<f64>,
    transfer: Option<Track<TransferFunction>>,
    crop: Option<Track<[DVec3; 2]>>,
    crop_voxels: Option<Track<[DVec3; 2]>>,
    planes: Option<Track<Vec<ClipPlane>>>,
    /// The clip of the command line.
    still: Clip,
    /// The function that the renderer shows.
    shown: Option<TransferFunction>,
}

impl VolumeMotion {
    /// The motion of a path; `None` where its keys have cameras only. Errors name the key and the field.
    pub(crate) fn new(
        path: &CameraPath,
        pictures: &[Moment],
        args: &VolsplatArgs,
        volume: &dyn Described,
    ) -> Result<Option<Self>> {
        let Some((times_s, keys)) = path.volume_keys() else {
            return Ok(None);
        };
        check_words(args, &keys)?;
        let encoding = args.transfer.transfer_space;
        let scale = args.transfer.opacity_scale;
        let numbered: Vec<(usize, &VolumeKey)> = keys.iter().copied().enumerate().collect();
        let function = |(number, key): &(usize, &VolumeKey)| {
            let named = || format!("key {number} of the path");
            key.look
                .as_ref()
                .map(|look| made(look, encoding, scale, volume).with_context(named))
                .transpose()
        };
        let motion = Self {
            times_s: pictures.iter().map(|&at| path.time_s(at)).collect(),
            transfer: Track::new(times_s, &numbered, function)?,
            crop: Track::new(times_s, &keys, |key| Ok(key.crop))?,
            crop_voxels: Track::new(times_s, &keys, |key| Ok(key.crop_voxels))?,
            planes: Track::new(times_s, &keys, |key| Ok(key.clip_planes.clone()))?,
            still: options::clip(&args.render.options.clip),
            shown: None,
        };
        motion.check_planes()?;
        Ok(Some(motion))
    }

    /// The mean of the functions of all keys: it shows what any of them shows. `None` where the function stays.
    pub(crate) fn mean(&self) -> Option<TransferFunction> {
        let (first, others) = self.transfer.as_ref()?.values().split_first()?;
        let mixed = |(mean, count): (TransferFunction, f64), next: &TransferFunction| {
            (mean.mixed(next, 1.0 / (count + 1.0)), count + 1.0)
        };
        Some(others.iter().fold((first.clone(), 1.0), mixed).0)
    }

    /// Gives the renderer the function and the clip of a picture.
    pub(crate) fn set(
        &mut self,
        number: usize,
        renderer: &mut Renderer,
        content: &mut Content,
    ) -> Result<()> {
        if let Some(function) = self.transfer(number)
            && self.shown.as_ref() != Some(&function)
        {
            if renderer.update_transfer(&function) == Reuse::NeedsRenderer {
                content.look.set_function(function.clone());
                *renderer = content.renderer(Keeping::Shown, Progress::Hidden)?;
            }
            self.shown = Some(function);
        }
        renderer.update_clip(self.clip(number)?)?;
        Ok(())
    }

    /// Has the next picture set its function again, for a renderer that is another one.
    pub(crate) fn forget(&mut self) {
        self.shown = None;
    }

    /// The function of a picture; `None` where it stays.
    fn transfer(&self, number: usize) -> Option<TransferFunction> {
        Some(match self.transfer.as_ref()?.at(self.times_s[number]) {
            Between::At(function) => function.clone(),
            Between::Mixed(before, after, share) => before.mixed(after, share),
        })
    }

    /// The clip of a picture.
    fn clip(&self, number: usize) -> Result<Clip> {
        let time_s = self.times_s[number];
        let boxed = |track: &Option<Track<[DVec3; 2]>>, still| match track
            .as_ref()
            .map(|track| track.at(time_s))
        {
            None => still,
            Some(Between::At(&corners)) => Some(corners),
            Some(Between::Mixed(a, b, share)) => {
                Some([a[0].lerp(b[0], share), a[1].lerp(b[1], share)])
            }
        };
        let planes = match self.planes.as_ref().map(|track| track.at(time_s)) {
            None => self.still.planes.clone(),
            Some(Between::At(planes)) => planes.clone(),
            Some(Between::Mixed(a, b, share)) => a
                .iter()
                .zip(b)
                .map(|(a, b)| mixed_plane(a, b, share))
                .collect::<Result<_>>()?,
        };
        Ok(Clip {
            crop_in_world: boxed(&self.crop, self.still.crop_in_world),
            crop_in_grid: boxed(&self.crop_voxels, self.still.crop_in_grid),
            planes,
        })
    }

    /// Refuses planes that come and go, and those that turn by half a turn between two keys.
    fn check_planes(&self) -> Result<()> {
        let Some(track) = &self.planes else {
            return Ok(());
        };
        for pair in track.values().windows(2) {
            if pair[0].len() != pair[1].len() {
                bail!(
                    "\"clip_planes\" of the path's keys: {} planes in one and {} in the next that gives any: expected as \
                     many (a plane far away clips nothing)",
                    pair[0].len(),
                    pair[1].len()
                );
            }
            pair[0]
                .iter()
                .zip(&pair[1])
                .try_for_each(|(a, b)| mixed_plane(a, b, 0.5).map(|_| ()))?;
        }
        Ok(())
    }
}

/// The moving parts in the stats file.
pub(crate) fn record(motion: &VolumeMotion) -> Value {
    json!({
        "transfer": motion.transfer.is_some(),
        "crop": motion.crop.is_some(),
        "crop_voxels": motion.crop_voxels.is_some(),
        "clip_planes": motion.planes.is_some(),
    })
}

/// The plane on which a share of the way from one signed distance to the other is 0: it turns about the line in which the
/// two planes meet.
fn mixed_plane(a: &ClipPlane, b: &ClipPlane, share: f64) -> Result<ClipPlane> {
    let normal = a.normal.lerp(b.normal, share);
    let length = normal.length();
    // Opposite normals cancel: there is no way between them that is shorter than others.
    if length < 1e-6 {
        bail!(
            "\"clip_planes\" of the path's keys: a plane turns over between two keys: put a key between them"
        );
    }
    Ok(ClipPlane {
        normal: normal / length,
        offset: (a.offset + share * (b.offset - a.offset)) / length,
    })
}

fn made(
    look: &KeyLook,
    encoding: ColourEncoding,
    scale: f64,
    volume: &dyn Described,
) -> Result<TransferFunction> {
    let function = match look {
        KeyLook::Preset(preset) => preset.transfer(&volume.histogram()),
        KeyLook::File(path) => {
            let file = FileLook::load(path, encoding, volume).context("\"transfer\"")?;
            file.function
        }
    };
    if scale == 1.0 {
        Ok(function)
    } else {
        Ok(function.with_opacity_scaled(scale)?)
    }
}

/// Refuses words of the command line that say the same thing as the keys.
fn check_words(args: &VolsplatArgs, keys: &[&VolumeKey]) -> Result<()> {
    let (transfer, clip, scene) = (&args.transfer, &args.render.options.clip, &args.scene);
    let looks = keys.iter().any(|key| key.look.is_some());
    let one_function = [
        ("--transfer", transfer.transfer.is_some()),
        ("--window", transfer.window.is_some()),
        ("--preset", transfer.preset.is_some()),
        ("--colormap", transfer.colormap.is_some()),
        ("--show-transfer", transfer.show_transfer.is_some()),
        ("--labels", scene.labels),
        ("--channel", !scene.channels.components.is_empty()),
        ("--also", !scene.channels.also.is_empty()),
    ];
    let given = one_function.into_iter().find(|(_, given)| looks && *given);
    let clips = [
        (
            "--crop",
            clip.crop.is_some() && keys.iter().any(|key| key.crop.is_some()),
        ),
        (
            "--crop-voxels",
            clip.crop_voxels.is_some() && keys.iter().any(|key| key.crop_voxels.is_some()),
        ),
        (
            "--clip-plane",
            !clip.clip_plane.is_empty() && keys.iter().any(|key| key.clip_planes.is_some()),
        ),
    ];
    match given.or(clips.into_iter().find(|(_, both)| *both)) {
        Some((word, _)) => {
            bail!("{word} and the keys of --path say different things: drop one of them")
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_turns_about_the_line_where_two_meet() {
        let plane = |normal: DVec3, offset: f64| ClipPlane { normal, offset };
        let half = mixed_plane(&plane(DVec3::X, 3.0), &plane(DVec3::Y, 5.0), 0.5).expect("a plane");
        assert!(
            (half.normal.length() - 1.0).abs() < 1e-12,
            "normal {}",
            half.normal
        );
        let on_both = DVec3::new(3.0, 5.0, 17.0);
        assert!(
            (half.normal.dot(on_both) - half.offset).abs() < 1e-12,
            "the line stays on it"
        );
        assert!(
            (half.normal - DVec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-12,
            "half way"
        );
        assert!(
            mixed_plane(&plane(DVec3::X, 0.0), &plane(-DVec3::X, 1.0), 0.5).is_err(),
            "turned over"
        );
        let shifted =
            mixed_plane(&plane(DVec3::Z, 1.0), &plane(DVec3::Z, 2.0), 0.25).expect("a plane");
        assert!(
            (shifted.offset - 1.25).abs() < 1e-12,
            "parallel planes move evenly: {}",
            shifted.offset
        );
    }
}
