//! Slices along the axes of the grid, as people read them: one voxel a pixel.

use super::Volume;

/// The scalars of a plane of voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Width and height, voxels.
    pub size: [usize; 2],
    /// Row by row from the top.
    pub values: Vec<f64>,
}

impl Volume {
    /// The voxels whose index along `axis` (0 to 2) is `index`, both clamped.
    ///
    /// Across z, x goes to the right and y down, as files store their slices. Across y, x goes to the right, and across x
    /// y does; z goes up in both.
    pub fn slice(&self, axis: usize, index: usize) -> Slice {
        let axis = axis.min(2);
        let index = index.min(self.dims[axis] - 1);
        let [across, down] = [[1, 2], [0, 2], [0, 1]][axis];
        let size = [self.dims[across], self.dims[down]];
        let mut values = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            let mut voxel = [index; 3];
            voxel[down] = if axis == 2 { row } else { size[1] - 1 - row };
            for column in 0..size[0] {
                voxel[across] = column;
                let [x, y, z] = voxel;
                values.push(self.value(x + self.dims[0] * (y + self.dims[1] * z)));
            }
        }
        Slice { size, values }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::volume::Voxels;

    /// A volume whose scalar at x, y, z is 100 x + 10 y + z.
    fn counted() -> Volume {
        let mut values = Vec::new();
        for z in 0..4 {
            for y in 0..3 {
                for x in 0..2 {
                    values.push((100 * x + 10 * y + z) as f32);
                }
            }
        }
        Volume::new([2, 3, 4], Voxels::F32(values), DAffine3::IDENTITY).expect("as many as voxels")
    }

    #[test]
    fn rows_go_down_along_y_and_up_along_z() {
        let volume = counted();
        let slice = volume.slice(2, 3);
        assert_eq!(
            (slice.size, &slice.values[..]),
            ([2, 3], &[3.0, 103.0, 13.0, 113.0, 23.0, 123.0][..])
        );
        let slice = volume.slice(1, 2);
        assert_eq!(slice.size, [2, 4]);
        assert_eq!(slice.values[..4], [23.0, 123.0, 22.0, 122.0]);
        let slice = volume.slice(0, 1);
        assert_eq!(slice.size, [3, 4]);
        assert_eq!(slice.values[..4], [103.0, 113.0, 123.0, 102.0]);
        assert_eq!(volume.slice(0, 99), volume.slice(0, 1), "clamped");
    }
}
