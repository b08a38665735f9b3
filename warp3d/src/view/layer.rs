//! The picture of one reference, before references are blended, and the bands of rows in which it is drawn.

/// One reference seen from the target camera.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layer {
    /// Linear premultiplied colour and coverage.
    pub(crate) rgba: Vec<[f32; 4]>,
    /// Camera z, world units; +infinity where nothing is seen.
    pub(crate) depth: Vec<f32>,
    /// Reference pixels per target pixel along the worse direction, inverted and at most 1: how well the reference
    /// resolves what is seen; 0 where nothing is seen.
    pub(crate) resolution: Vec<f32>,
    /// How surfaces blend in each pixel. Empty if one surface fills every pixel, or if nobody asks for it.
    pub(crate) mixes: Vec<Mix>,
    /// Number of pixels in which something is seen, if they were counted when they were drawn; then `resolution` already is
    /// weighted by coverage.
    pub(crate) seen: Option<u64>,
}

/// The surfaces of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mix {
    /// Share of the pixel's coverage that its main surface has: below 1 where surfaces blend.
    pub(crate) purity: f32,
    /// Camera z of the nearest surface, world units; +infinity where that is the main one.
    pub(crate) front: f32,
}

impl Mix {
    /// One surface alone.
    pub(crate) const ONE: Self = Self {
        purity: 1.0,
        front: f32::INFINITY,
    };
}

/// The purpose of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It is the picture: mixes are left out, and resolution is weighted by coverage as it is drawn, while both are in
    /// the cache.
    Picture,
    /// It is blended with others, or its holes are filled.
    Part,
}

/// Puts what lies beyond infinity there: a surface that is continued so far would lie behind the eye.
#[inline(always)]
pub(crate) fn before_infinity(depths: &mut [f32]) {
    for depth in depths {
        *depth = if *depth > 0.0 { *depth } else { f32::INFINITY };
    }
}

impl Layer {
    /// A layer in which nothing is seen.
    pub(crate) fn empty(pixels: usize) -> Self {
        Self {
            rgba: vec![[0.0; 4]; pixels],
            depth: vec![f32::INFINITY; pixels],
            resolution: vec![0.0; pixels],
            mixes: Vec::new(),
            seen: None,
        }
    }

    /// The share of a pixel's coverage that its main surface has.
    pub(crate) fn purity(&self, at: usize) -> f32 {
        self.mixes.get(at).map_or(1.0, |mix| mix.purity)
    }

    /// Camera z of the nearest surface in a pixel, world units; +infinity where nothing is seen.
    pub(crate) fn front(&self, at: usize) -> f32 {
        let front = self.mixes.get(at).map_or(f32::INFINITY, |mix| mix.front);
        front.min(self.depth[at])
    }

    /// A layer in the buffers of this one, which keep whatever they hold: its drawer clears them, part by part.
    pub(crate) fn reused(mut self, pixels: usize) -> Self {
        self.rgba.resize(pixels, [0.0; 4]);
        self.depth.resize(pixels, f32::INFINITY);
        self.resolution.resize(pixels, 0.0);
        self.mixes.clear();
        self.seen = None;
        self
    }
}

/// A row of a layer that is drawn.
pub(crate) struct Row<'a> {
    pub(crate) rgba: &'a mut [[f32; 4]],
    pub(crate) depth: &'a mut [f32],
    pub(crate) resolution: &'a mut [f32],
    /// Empty where nobody asks for it.
    pub(crate) mixes: &'a mut [Mix],
}

impl Row<'_> {
    /// Nothing is seen.
    pub(crate) fn clear(&mut self) {
        self.rgba.fill([0.0; 4]);
        self.depth.fill(f32::INFINITY);
        self.resolution.fill(0.0);
        self.mixes.fill(Mix::ONE);
    }

    /// Returns true if mixes are asked for.
    #[inline(always)]
    pub(crate) fn asks_for_mixes(&self) -> bool {
        !self.mixes.is_empty()
    }

    /// Weights resolution by coverage.
    #[inline(always)]
    pub(crate) fn weigh(&mut self) {
        for (resolution, pixel) in self.resolution.iter_mut().zip(self.rgba.iter()) {
            *resolution *= pixel[3];
        }
    }

    /// Number of pixels in which something is seen.
    #[inline(always)]
    pub(crate) fn seen(&self) -> u64 {
        let mut count = 0;
        for pixel in self.rgba.iter() {
            count += u64::from(pixel[3] > 0.0);
        }
        count
    }
}

// Bands of target rows: what one task owns.
//
// The cut does not look at the number of threads, so the same bytes come out on any number of them.

/// Rows of a band, px. Small enough that a full-HD picture has 34 of them to share out, large enough that a segment of
/// a reference row seldom touches more than two.
pub(crate) const BAND_ROWS: usize = 32;

/// A closed range of screen rows (px), empty when `low > high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowRange {
    /// Lowest screen y.
    pub(crate) low: f32,
    /// Highest screen y.
    pub(crate) high: f32,
}

impl RowRange {
    /// Nothing.
    pub(crate) const EMPTY: Self = Self {
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
    };

    /// Widens the range to hold `y`.
    pub(crate) fn include(&mut self, y: f32) {
        self.low = self.low.min(y);
        self.high = self.high.max(y);
    }

    /// Widens the range to hold `other`.
    pub(crate) fn join(&mut self, other: Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Returns true if the range touches rows `first..end` (px).
    pub(crate) fn touches(&self, first: usize, end: usize) -> bool {
        self.high >= first as f32 && self.low <= end as f32
    }
}
