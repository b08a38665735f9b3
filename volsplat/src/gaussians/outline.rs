//! The extent of the visible Gaussians, for framing: a box without floaters, and the ends of a sample of them.
//!
//! Takes Gaussians and their clip, gives a box in the world and points. Faint ones, and those outside the box, are not looked at.

use glam::{DVec3, Vec3};
use resample_volume::{Gaussian, Gaussians};

use crate::look::clip::Clip;

/// The part of a scene that is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The least and the greatest corner of a box along the world's axes.
    pub bounds: [DVec3; 2],
    /// Ends of Gaussians, world positions inside the box.
    pub points: Vec<DVec3>,
}

/// About so many Gaussians stand for all of them. A guess: their ends fill the silhouette to about a percent of its size.
const LOOKED_AT: usize = 20_000;

/// The end of a Gaussian, standard deviations from its centre: an opaque one has faded to a third there.
const END: f32 = 1.5;

/// Opacity of a Gaussian that is seen at all. A guess: a twentieth is no more than a veil.
const SEEN: f32 = 0.05;

impl Outline {
    /// The outline of the Gaussians whose centres a clip keeps; `None` where it keeps no centre.
    pub fn of(gaussians: &Gaussians, clip: &Clip) -> Option<Self> {
        let centre_in_world =
            |index: usize| gaussians.origin_in_world + gaussians.centres()[index].as_dvec3();
        let is_kept = |index: usize| keeps(clip, centre_in_world(index));
        let [low, high] = gaussians.bounds_in_world(is_kept)?;
        let bounds = match clip.crop_in_world {
            Some([from, to]) => [low.max(from), high.min(to)],
            None => [low, high],
        };
        let is_inside = |at: DVec3| at.cmpge(bounds[0]).all() && at.cmple(bounds[1]).all();
        let seen = |least: f32| -> Vec<usize> {
            let all = 0..gaussians.len();
            all.filter(|&index| {
                let is_seen = gaussians.get(index).opacity >= least;
                is_seen && is_kept(index) && is_inside(centre_in_world(index))
            })
            .collect()
        };
        let mut looked_at = seen(SEEN);
        if looked_at.is_empty() {
            looked_at = seen(0.0);
        }
        let step = looked_at.len().div_ceil(LOOKED_AT).max(1);
        let points = looked_at.iter().step_by(step).flat_map(|&index| {
            let centre = centre_in_world(index);
            let offsets = ends(&gaussians.get(index));
            offsets.map(move |offset| (centre + offset).clamp(bounds[0], bounds[1]))
        });
        Some(Self {
            bounds,
            points: points.collect(),
        })
    }
}

/// Returns true if a clip keeps a point.
fn keeps(clip: &Clip, at: DVec3) -> bool {
    let is_inside = clip
        .crop_in_world
        .is_none_or(|[low, high]| at.cmpge(low).all() && at.cmple(high).all());
    let mut planes = clip.planes.iter();
    is_inside && planes.all(|plane| plane.normal.dot(at) >= plane.offset)
}

/// The ends of a Gaussian's axes, from its centre.
fn ends(gaussian: &Gaussian) -> [DVec3; 6] {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    std::array::from_fn(|end| {
        let axis = end % 3;
        let length = if end < 3 { END } else { -END } * gaussian.scales[axis];
        (gaussian.rotation * axes[axis] * length).as_dvec3()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look::clip::ClipPlane;
    use glam::Quat;

    fn row() -> Gaussians {
        let mut all = Gaussians::with_capacity(0, 100);
        for number in 0..100 {
            let gaussian = Gaussian {
                centre: Vec3::new(number as f32, 0.0, 0.0),
                rotation: Quat::IDENTITY,
                scales: Vec3::splat(0.1),
                opacity: 0.8,
                colour: Vec3::ONE,
            };
            all.push(&gaussian, &[]).expect("taken");
        }
        all
    }

    #[test]
    fn a_clip_moves_the_outline() {
        let whole = Outline::of(&row(), &Clip::default()).expect("all");
        assert!(whole.bounds[1].x > 97.0 && whole.points.len() >= 6 * 95);
        let half = Clip {
            planes: vec![ClipPlane {
                normal: DVec3::X,
                offset: 49.5,
            }],
            ..Clip::default()
        };
        let half = Outline::of(&row(), &half).expect("half of them");
        assert!(half.bounds[0].x > 49.0, "{:?}", half.bounds);
        let nothing = Clip {
            crop_in_world: Some([DVec3::splat(5.0), DVec3::splat(6.0)]),
            ..Clip::default()
        };
        assert_eq!(Outline::of(&row(), &nothing), None);
    }
}
