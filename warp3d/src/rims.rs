//! How far surfaces reach beyond their outermost samples.
//!
//! Between two samples on different surfaces the edge lies somewhere; half way unless the picture says better. The
//! nearer surface ends there. The farther one goes on behind it up to the nearer sample: nothing is seen of that until
//! the nearer one moves away, and then the rim has no gap of a part of a sample, which would be a hole where the
//! reference did see.

use crate::surface::Surfaces;

/// Where edges lie between samples.
#[derive(Clone, Debug)]
pub(crate) struct Rims;

/// How far the farther surface goes on behind the nearer one, samples from its own.
const BEHIND: f64 = 0.9;

impl Rims {
    /// The rims of these surfaces.
    pub(crate) fn new(_surfaces: &Surfaces) -> Self {
        Self
    }

    /// How far the sample `index` reaches along x and y into the cut cell that lies towards `towards`, samples.
    pub(crate) fn reach(&self, surfaces: &Surfaces, index: usize, towards: [i32; 2]) -> [f64; 2] {
        let [width, height] = surfaces.size;
        let places = [index % width, index / width];
        let along = |axis: usize| {
            let (step, count) = ([1, width][axis], [width, height][axis]);
            let forwards = towards[axis] > 0;
            if places[axis] == if forwards { count - 1 } else { 0 } {
                return 0.5;
            }
            let (next, link) = if forwards { (index + step, index) } else { (index - step, index - step) };
            // A linked neighbour has a quarter of its own; both overlap a little, so that no crack opens between.
            if surfaces.linked_on(link, axis) {
                return 0.55;
            }
            let farther = surfaces.disparity[index] < surfaces.disparity[next];
            if farther { BEHIND } else { 0.5 }
        };
        [along(0), along(1)]
    }
}
