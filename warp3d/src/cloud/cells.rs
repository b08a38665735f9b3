//! Points sorted into a tree of cells, and the nearest neighbours of a place.
//!
//! Takes positions, returns them in the order of a k-d tree without pointers: the point in the middle of a range splits the
//! range along its widest axis (Bentley 1975). Cells adapt to the density, which in a scan falls with the squared
//! distance, where equal cells of a grid would be empty or crowded.

use glam::Vec3;

/// Ranges of at most this many points are searched one by one. A guess.
const LEAF: usize = 10;

/// Ranges longer than this are sorted by two tasks. A guess.
const TASK: usize = 1 << 14;

/// Most neighbours that one search finds.
pub(crate) const MOST_NEIGHBOURS: usize = 48;

/// A point and its number in the cloud.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) at: Vec3,
    pub(crate) index: u32,
}

/// The tree: places in its order, and the axis along which each splits its range.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) places: Vec<Place>,
    axes: Vec<u8>,
}

/// The nearest places of one search, nearest first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    wanted: usize,
    count: usize,
    squares: [f32; MOST_NEIGHBOURS],
    slots: [u32; MOST_NEIGHBOURS],
}

impl Tree {
    pub(crate) fn new(positions: &[[f32; 3]]) -> Self {
        let place = |(&at, index): (&[f32; 3], u32)| Place {
            at: at.into(),
            index,
        };
        let mut places: Vec<Place> = positions.iter().zip(0..).map(place).collect();
        let mut axes = vec![0; places.len()];
        split(&mut places, &mut axes);
        Self { places, axes }
    }

    /// Finds the `wanted` places nearest to `at`, the place itself among them. As many are known to lie within `bound` of it: what
    /// is farther is not looked at.
    pub(crate) fn nearest(&self, at: Vec3, wanted: usize, bound: f32, nearest: &mut Nearest) {
        nearest.wanted = wanted.min(MOST_NEIGHBOURS);
        nearest.count = 0;
        // The square of the bound is rounded, and places at the bound itself are wanted.
        let square = (bound * bound * (1.0 + 1e-5)).max(f32::MIN_POSITIVE);
        nearest.squares[..nearest.wanted].fill(square);
        self.search(at, [0, self.places.len()], nearest);
    }

    fn search(&self, at: Vec3, [first, end]: [usize; 2], nearest: &mut Nearest) {
        if end - first <= LEAF {
            for (place, slot) in self.places[first..end].iter().zip(first..) {
                nearest.offer(place.at.distance_squared(at), slot);
            }
            return;
        }
        let middle = usize::midpoint(first, end);
        let place = self.places[middle].at;
        let axis = usize::from(self.axes[middle]);
        let beyond = at[axis] - place[axis];
        let (near, far) = if beyond < 0.0 {
            ([first, middle], [middle + 1, end])
        } else {
            ([middle + 1, end], [first, middle])
        };
        self.search(at, near, nearest);
        nearest.offer(place.distance_squared(at), middle);
        if beyond * beyond < nearest.farthest_square() {
            self.search(at, far, nearest);
        }
    }
}

impl Nearest {
    /// The slots of the places in the tree's order, nearest first.
    pub(crate) fn slots(&self) -> &[u32] {
        &self.slots[..self.count]
    }

    /// No neighbours yet.
    pub(crate) fn new() -> Self {
        Self {
            wanted: 0,
            count: 0,
            squares: [f32::INFINITY; MOST_NEIGHBOURS],
            slots: [0; MOST_NEIGHBOURS],
        }
    }

    /// The squared distances, least first.
    pub(crate) fn squares(&self) -> &[f32] {
        &self.squares[..self.count]
    }

    #[inline(always)]
    fn farthest_square(&self) -> f32 {
        self.squares[self.wanted - 1]
    }

    #[inline(always)]
    fn offer(&mut self, square: f32, slot: usize) {
        if square < self.farthest_square() {
            self.insert(square, slot);
        }
    }

    fn insert(&mut self, square: f32, slot: usize) {
        let mut place = self.count.min(self.wanted - 1);
        while place > 0 && self.squares[place - 1] > square {
            self.squares[place] = self.squares[place - 1];
            self.slots[place] = self.slots[place - 1];
            place -= 1;
        }
        self.squares[place] = square;
        self.slots[place] = slot as u32;
        self.count = (self.count + 1).min(self.wanted);
    }
}

/// Sorts a range around its middle along its widest axis, then both halves.
fn split(places: &mut [Place], axes: &mut [u8]) {
    if places.len() <= LEAF {
        return;
    }
    let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for place in places.iter() {
        least = least.min(place.at);
        most = most.max(place.at);
    }
    let size = most - least;
    let axis = match size {
        s if s.x >= s.y && s.x >= s.z => 0,
        s if s.y >= s.z => 1,
        _ => 2,
    };
    let middle = places.len() / 2;
    places.select_nth_unstable_by(middle, |a, b| {
        a.at[axis]
            .total_cmp(&b.at[axis])
            .then(a.index.cmp(&b.index))
    });
    axes[middle] = axis as u8;
    let (low, high) = places.split_at_mut(middle);
    let (low_axes, high_axes) = axes.split_at_mut(middle);
    let (high, high_axes) = (&mut high[1..], &mut high_axes[1..]);
    if low.len() > TASK {
        rayon::join(|| split(low, low_axes), || split(high, high_axes));
    } else {
        split(low, low_axes);
        split(high, high_axes);
    }
}
