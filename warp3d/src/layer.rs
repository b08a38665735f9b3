//! What one reference gives for one picture, before references are blended.

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
    /// Share of the pixel's coverage that its main surface has: below 1 where surfaces blend.
    pub(crate) purity: Vec<f32>,
    /// Number of pixels in which something is seen, if they were counted when they were drawn.
    pub(crate) seen: Option<u64>,
}

impl Layer {
    /// A layer in which nothing is seen.
    pub(crate) fn empty(pixels: usize) -> Self {
        Self {
            rgba: vec![[0.0; 4]; pixels],
            depth: vec![f32::INFINITY; pixels],
            resolution: vec![0.0; pixels],
            purity: vec![1.0; pixels],
            seen: None,
        }
    }

    /// A layer in the buffers of this one, which keep whatever they hold: its drawer clears them, part by part.
    pub(crate) fn reused(mut self, pixels: usize) -> Self {
        self.rgba.resize(pixels, [0.0; 4]);
        self.depth.resize(pixels, f32::INFINITY);
        self.resolution.resize(pixels, 0.0);
        self.purity.resize(pixels, 1.0);
        self.seen = None;
        self
    }
}
