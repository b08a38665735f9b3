//! Points sorted into a tree of cells, and the nearest neighbours of a place.
//!
//! Takes positions, returns them in the order of a k-d tree without pointers: a place near the middle of a range splits the
//! range along its widest axis (Bentley 1975), so that leaves have sixteen points. Cells adapt to the density, which in a scan falls with the squared
//! distance, where equal cells of a grid would be empty or crowded.

use glam::Vec3;

/// Points of a leaf, which are searched one by one; the last one may have fewer.
pub(crate) const LEAF: usize = 16;

/// Ranges longer than this are sorted by two tasks. A guess.
const TASK: usize = 1 << 14;

/// Most neighbours that one search finds.
pub(crate) const MOST_NEIGHBOURS: usize = 48;

/// Ranges that wait on the way down the tree: one a level.
const MOST_DEPTH: usize = 64;

/// A point and its number in the cloud.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) at: Vec3,
    pub(crate) index: u32,
}

/// The tree: places in its order, and where ranges are split; a split lies between two leaves, and has the number of the second.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) places: Vec<Place>,
    splits: Vec<Split>,
}

/// Places before it are at most at the value along the axis, those after it at least.
#[derive(Clone, Copy, Debug, Default)]
struct Split {
    value: f32,
    axis: u8,
}

/// The end of the first part of a range: a whole number of leaves, as many as in the second or one more.
fn middle_of([first, end]: [usize; 2]) -> usize {
    let leaves = (end - first).div_ceil(LEAF);
    first + leaves.div_ceil(2) * LEAF
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
        let mut splits = vec![Split::default(); places.len().div_ceil(LEAF)];
        split(&mut places, &mut splits);
        Self { places, splits }
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

    /// The places of the leaf whose first place has this slot.
    pub(crate) fn leaf(&self, first: usize) -> &[Place] {
        &self.places[first..(first + LEAF).min(self.places.len())]
    }

    /// Visits the leaves that a box meets: the slot of the first place, and the box that all lie in. Ends where one visit asks for it, and
    /// returns false then.
    pub(crate) fn for_each_leaf(
        &self,
        within: [Vec3; 2],
        mut visit: impl FnMut(usize, [Vec3; 2]) -> bool,
    ) -> bool {
        let everywhere = [Vec3::NEG_INFINITY, Vec3::INFINITY];
        let mut waiting = [([0; 2], everywhere); MOST_DEPTH];
        waiting[0].0 = [0, self.places.len()];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let ([first, end], bounds) = waiting[count];
            if end - first <= LEAF {
                if !visit(first, bounds) {
                    return false;
                }
                continue;
            }
            let middle = middle_of([first, end]);
            let Split { value, axis } = self.splits[middle / LEAF];
            let axis = usize::from(axis);
            if within[1][axis] >= value {
                let mut bounds = bounds;
                bounds[0][axis] = value;
                waiting[count] = ([middle, end], bounds);
                count += 1;
            }
            if within[0][axis] <= value {
                let mut bounds = bounds;
                bounds[1][axis] = value;
                waiting[count] = ([first, middle], bounds);
                count += 1;
            }
        }
        true
    }

    fn search(&self, at: Vec3, [first, end]: [usize; 2], nearest: &mut Nearest) {
        if end - first <= LEAF {
            for (place, slot) in self.places[first..end].iter().zip(first..) {
                nearest.offer(place.at.distance_squared(at), slot);
            }
            return;
        }
        let middle = middle_of([first, end]);
        let Split { value, axis } = self.splits[middle / LEAF];
        let beyond = at[usize::from(axis)] - value;
        let (near, far) = if beyond < 0.0 {
            ([first, middle], [middle, end])
        } else {
            ([middle, end], [first, middle])
        };
        self.search(at, near, nearest);
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

/// Sorts a range around its middle along its widest axis, then both parts.
fn split(places: &mut [Place], splits: &mut [Split]) {
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
    let middle = middle_of([0, places.len()]);
    places.select_nth_unstable_by(middle, |a, b| {
        a.at[axis]
            .total_cmp(&b.at[axis])
            .then(a.index.cmp(&b.index))
    });
    splits[middle / LEAF] = Split {
        value: places[middle].at[axis],
        axis: axis as u8,
    };
    let (low, high) = places.split_at_mut(middle);
    let (low_splits, high_splits) = splits.split_at_mut(middle / LEAF);
    // The first of the second part is this range's own.
    if low.len() > TASK {
        rayon::join(|| split(low, low_splits), || split(high, high_splits));
    } else {
        split(low, low_splits);
        split(high, high_splits);
    }
}
