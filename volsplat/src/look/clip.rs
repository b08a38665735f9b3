//! Clipping: a cropping box and up to six planes, as half-spaces of the grid.
//!
//! Everything that is clipped away is not there: no sample of it is drawn, and framing does not count it. Each half-space
//! is carried into voxel indices once, where a brick is a box: a brick outside one is dropped, a brick inside all is drawn
//! as if there were no clip, and only the samples of a cut brick are tested, each at its own position.
//! Limits: the part that is kept is convex.

use glam::{DAffine3, DVec3};

use crate::Error;
use crate::grid::Bounds;

/// The kept part of a volume: the intersection of all parts of the clip. The default keeps everything.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
pub struct Clip {
    /// Least and greatest corner of a box along the world's axes, world units; its faces are kept.
    pub crop_in_world: Option<[DVec3; 2]>,
    /// Least and greatest corner of a box along the grid's axes, voxel indices (fractions too); its faces are kept.
    pub crop_in_grid: Option<[DVec3; 2]>,
    /// At most [`MAX_PLANES`] planes.
    pub planes: Vec<ClipPlane>,
}

/// A plane in the world: the side that it points to is kept, and so is the plane itself.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ClipPlane {
    /// Points to what is kept; any length above 0.
    pub normal: DVec3,
    /// A position p is kept where `normal . p >= offset`. World units times the normal's length.
    pub offset: f64,
}

/// Most clip planes. With two boxes that makes 18 half-spaces, which a brick counts in the bits of a number.
pub const MAX_PLANES: usize = 6;

/// A half-space of the grid: kept where normal . p + offset >= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfSpace {
    /// Of length 1, in voxels.
    normal: DVec3,
    offset: f64,
}

/// The half-spaces of a clip in the grid of a volume.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GridClip {
    half_spaces: Vec<HalfSpace>,
}

/// A half-space as the vector kernels want it, relative to an anchor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnchoredHalfSpace {
    pub(crate) normal: [f32; 3],
    pub(crate) offset: f32,
}

/// How a box lies in a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Nothing of it is kept.
    Outside,
    /// The half-spaces that cut it, by their bits; 0 where all of it is kept.
    By(u32),
}

/// How far a box may reach out of a half-space and still count as inside, voxels: the rounding of the half-space's own
/// numbers, and less than that of a sample's f32 position.
const INSIDE_MARGIN: f64 = 1e-6;

impl Clip {
    /// Checks every number; [`Error::Option`] says which one is wrong.
    ///
    /// ```
    /// use glam::DVec3;
    /// use volsplat::{Clip, ClipPlane};
    ///
    /// // Keep the half with x of 3 and more.
    /// let half = ClipPlane { normal: DVec3::X, offset: 3.0 };
    /// let clip = Clip { planes: vec![half], ..Clip::default() };
    /// assert!(clip.validate().is_ok());
    /// let many = Clip { planes: vec![half; 7], ..Clip::default() };
    /// assert!(many.validate().is_err());
    /// ```
    pub fn validate(&self) -> Result<(), Error> {
        for (name, corners) in [
            ("the box in the world", self.crop_in_world),
            ("the box of voxels", self.crop_in_grid),
        ] {
            if let Some([low, high]) = corners.filter(|[low, high]| {
                !low.cmplt(*high).all() || !low.is_finite() || !high.is_finite()
            }) {
                return Err(Error::Option(format!(
                    "{name} goes from {low} to {high}: expected three finite numbers, and then three greater ones"
                )));
            }
        }
        if self.planes.len() > MAX_PLANES {
            return Err(Error::Option(format!(
                "there are {} clip planes, and at most {MAX_PLANES} are possible: leave some out",
                self.planes.len()
            )));
        }
        match self
            .planes
            .iter()
            .find(|plane| plane.normal.try_normalize().is_none() || !plane.offset.is_finite())
        {
            Some(plane) => Err(Error::Option(format!(
                "a clip plane has the normal {} and the offset {}: expected a direction and a finite number",
                plane.normal, plane.offset
            ))),
            None => Ok(()),
        }
    }

    /// The half-spaces of the clip in a grid.
    pub(crate) fn in_grid(&self, world_from_index: &DAffine3) -> GridClip {
        let boxed = |corners: Option<[DVec3; 2]>| {
            corners.into_iter().flat_map(|[low, high]| {
                DVec3::AXES
                    .into_iter()
                    .flat_map(move |axis| [(axis, axis.dot(low)), (-axis, -axis.dot(high))])
            })
        };
        let planes = self.planes.iter().map(|plane| (plane.normal, plane.offset));
        let world = boxed(self.crop_in_world).chain(planes);
        let in_grid = boxed(self.crop_in_grid).map(|(normal, offset)| HalfSpace {
            normal,
            offset: -offset,
        });
        let half_spaces = world
            .map(|(normal, offset)| HalfSpace::new(normal, offset, world_from_index))
            .chain(in_grid);
        GridClip {
            half_spaces: half_spaces.collect(),
        }
    }
}

impl HalfSpace {
    /// From normal . p >= offset in the world.
    fn new(normal: DVec3, offset: f64, world_from_index: &DAffine3) -> Self {
        let covector = world_from_index.matrix3.transpose() * normal;
        // The axes span space, so that the length is not 0 for a normal that is not.
        let length = covector.length();
        Self {
            normal: covector / length,
            offset: (normal.dot(world_from_index.translation) - offset) / length,
        }
    }

    fn height(&self, pos_in_grid: DVec3) -> f64 {
        self.normal.dot(pos_in_grid) + self.offset
    }
}

impl GridClip {
    /// The same in a grid whose vertices are every `step` voxels of this one.
    pub(crate) fn coarser(&self, step: usize) -> Self {
        let half_spaces = self.half_spaces.iter().map(|half| HalfSpace {
            offset: half.offset / step as f64,
            ..*half
        });
        Self {
            half_spaces: half_spaces.collect(),
        }
    }

    /// Returns true if everything is kept.
    pub(crate) fn is_whole(&self) -> bool {
        self.half_spaces.is_empty()
    }

    /// Returns true if a position, in the grid, is kept.
    pub(crate) fn keeps(&self, pos_in_grid: DVec3) -> bool {
        self.half_spaces
            .iter()
            .all(|half| half.height(pos_in_grid) >= 0.0)
    }

    /// The distance of a position from the nearest plane, to either side, voxels; infinite without planes.
    pub(crate) fn distance(&self, pos_in_grid: DVec3) -> f64 {
        let heights = self.half_spaces.iter();
        heights.fold(f64::INFINITY, |least, half| {
            least.min(half.height(pos_in_grid).abs())
        })
    }

    /// The part of a ray that is kept, from one parameter to another; the first is the larger where there is none.
    pub(crate) fn interval(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let mut ends = [f64::NEG_INFINITY, f64::INFINITY];
        for half in &self.half_spaces {
            let (height, slope) = (half.height(origin), half.normal.dot(direction));
            if slope > 0.0 {
                ends[0] = ends[0].max(-height / slope);
            } else if slope < 0.0 {
                ends[1] = ends[1].min(-height / slope);
            } else if height < 0.0 {
                return [f64::INFINITY, f64::NEG_INFINITY];
            }
        }
        ends
    }

    /// How a box of samples lies in the clip.
    pub(crate) fn cut(&self, bounds: &Bounds) -> Cut {
        let corners = bounds.corners_in_grid(0.0);
        let mut cuts = 0;
        for (number, half) in self.half_spaces.iter().enumerate() {
            let heights = corners.map(|corner| half.height(corner));
            if heights.iter().all(|height| *height < 0.0) {
                return Cut::Outside;
            }
            cuts |= u32::from(heights.iter().any(|height| *height < -INSIDE_MARGIN)) << number;
        }
        Cut::By(cuts)
    }

    /// The half-spaces relative to a position in the grid.
    pub(crate) fn anchored(&self, anchor: DVec3) -> Vec<AnchoredHalfSpace> {
        let at = |half: &HalfSpace| AnchoredHalfSpace {
            normal: half.normal.as_vec3().to_array(),
            offset: half.height(anchor) as f32,
        };
        self.half_spaces.iter().map(at).collect()
    }

    /// The corners, in the grid, of what the clip keeps of a box; none where that is nothing.
    ///
    /// Every corner is where three planes meet, of the box or of the clip, so that all triples are tried.
    pub(crate) fn corners(&self, bounds: &Bounds) -> Vec<DVec3> {
        let Cut::By(cuts) = self.cut(bounds) else {
            return Vec::new();
        };
        let corners = bounds.corners_in_grid(0.0);
        if cuts == 0 {
            return corners.to_vec();
        }
        let (low, high) = (corners[0], corners[7]);
        let mut planes: Vec<HalfSpace> = DVec3::AXES
            .into_iter()
            .flat_map(|axis| {
                [
                    HalfSpace {
                        normal: axis,
                        offset: -axis.dot(low),
                    },
                    HalfSpace {
                        normal: -axis,
                        offset: axis.dot(high),
                    },
                ]
            })
            .collect();
        let cutting = self
            .half_spaces
            .iter()
            .enumerate()
            .filter(|(number, _)| cuts >> number & 1 == 1);
        planes.extend(cutting.map(|(_, half)| *half));
        let mut found = Vec::new();
        for (i, a) in planes.iter().enumerate() {
            for (j, b) in planes.iter().enumerate().skip(i + 1) {
                for c in &planes[j + 1..] {
                    found.extend(
                        meeting(a, b, c).filter(|p| {
                            planes.iter().all(|half| half.height(*p) >= -INSIDE_MARGIN)
                        }),
                    );
                }
            }
        }
        found
    }
}

/// Where three planes meet; `None` where they do not meet in one point.
fn meeting(a: &HalfSpace, b: &HalfSpace, c: &HalfSpace) -> Option<DVec3> {
    let (bc, ca, ab) = (
        b.normal.cross(c.normal),
        c.normal.cross(a.normal),
        a.normal.cross(b.normal),
    );
    let determinant = a.normal.dot(bc);
    let point = -(a.offset * bc + b.offset * ca + c.offset * ab) / determinant;
    // Unit normals that lie this close to one plane meet too far away, or nowhere.
    (determinant.abs() > 1e-9).then_some(point)
}

/// The box, in the world, of the samples' positions that a clip keeps; `None` if there are none.
pub(crate) fn bounds_in_world(
    bounds: impl Iterator<Item = Bounds>,
    clip: &GridClip,
    world_from_index: &DAffine3,
) -> Option<[DVec3; 2]> {
    bounds
        .flat_map(|b| clip.corners(&b))
        .map(|corner| world_from_index.transform_point3(corner))
        .fold(None, |bounds, p| match bounds {
            None => Some([p, p]),
            Some([low, high]) => Some([low.min(p), high.max(p)]),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brick(least: [usize; 3], greatest: [usize; 3]) -> Bounds {
        let mut bounds = Bounds::nothing([0; 3]);
        bounds.add(least);
        bounds.add(greatest);
        bounds
    }

    fn plane(normal: DVec3, offset: f64) -> Clip {
        Clip {
            planes: vec![ClipPlane { normal, offset }],
            ..Clip::default()
        }
    }

    #[test]
    fn a_plane_keeps_the_side_that_it_points_to_and_itself() {
        let grid = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
        let clip = plane(DVec3::new(3.0, 0.0, 0.0), 12.0).in_grid(&grid);
        assert!(
            clip.keeps(DVec3::new(2.0, 0.0, 0.0)),
            "x = 4 in the world lies on the plane"
        );
        assert!(
            clip.keeps(DVec3::new(2.1, 0.0, 0.0)) && !clip.keeps(DVec3::new(1.9, 0.0, 0.0)),
            "either side"
        );
        assert_eq!(
            clip.cut(&brick([2, 0, 0], [8, 8, 8])),
            Cut::By(0),
            "a box that touches it from inside"
        );
        assert_eq!(
            clip.cut(&brick([0, 0, 0], [1, 8, 8])),
            Cut::Outside,
            "a box behind it"
        );
        assert_eq!(
            clip.cut(&brick([0, 0, 0], [8, 8, 8])),
            Cut::By(1),
            "a box across it"
        );
    }

    #[test]
    fn the_corners_of_a_cut_box_are_where_planes_meet() {
        let clip = plane(DVec3::ONE, 22.0).in_grid(&DAffine3::IDENTITY);
        let corners = clip.corners(&brick([0; 3], [8; 3]));
        let least = corners
            .iter()
            .fold(DVec3::INFINITY, |low, corner| low.min(*corner));
        assert!(
            (least - 6.0).abs().max_element() < 1e-12,
            "a pyramid at the far corner, from 6 to 8: {least}"
        );
        let none = plane(DVec3::X, 9.0).in_grid(&DAffine3::IDENTITY);
        assert!(
            none.corners(&brick([0; 3], [8; 3])).is_empty(),
            "nothing is left"
        );
    }

    #[test]
    fn crops_are_refused_where_they_are_none() {
        let bad = [
            [DVec3::ONE, DVec3::ZERO],
            [DVec3::ZERO, DVec3::new(1.0, f64::INFINITY, 1.0)],
            [DVec3::NAN; 2],
        ];
        for corners in bad {
            let clip = Clip {
                crop_in_world: Some(corners),
                ..Clip::default()
            };
            assert!(clip.validate().is_err(), "{corners:?} is no box");
        }
        let seven = vec![
            ClipPlane {
                normal: DVec3::X,
                offset: 0.0
            };
            7
        ];
        assert!(
            Clip {
                planes: seven,
                ..Clip::default()
            }
            .validate()
            .is_err(),
            "too many planes"
        );
        assert!(plane(DVec3::ZERO, 0.0).validate().is_err(), "no direction");
        assert!(plane(DVec3::X, f64::NAN).validate().is_err(), "no offset");
    }
}
