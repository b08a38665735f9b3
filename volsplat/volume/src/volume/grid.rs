//! Typed voxels of a volume, read by index, and continued beyond its faces by the outermost ones.

/// Typed voxels of a volume.
pub struct Grid<'a, T> {
    /// x fastest.
    pub voxels: &'a [T],
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
}

impl<T> Grid<'_, T> {
    /// `count` voxels along x, from this one on; all of them must be in the volume.
    #[inline(always)]
    pub fn row(&self, [x, y, z]: [usize; 3], count: usize) -> &[T] {
        let start = x + self.dims[0] * (y + self.dims[1] * z);
        &self.voxels[start..start + count]
    }
}

impl<T: Copy + Into<f64>> Grid<'_, T> {
    /// The scalar of a voxel; beyond the volume, that of the nearest one.
    pub fn at(&self, index: [isize; 3]) -> f32 {
        self.stored(index) as f32
    }

    /// As [`Grid::at`], with all digits.
    pub fn stored(&self, index: [isize; 3]) -> f64 {
        let [x, y, z] =
            [0, 1, 2].map(|axis| index[axis].clamp(0, self.dims[axis] as isize - 1) as usize);
        self.voxels[x + self.dims[0] * (y + self.dims[1] * z)].into()
    }
}
