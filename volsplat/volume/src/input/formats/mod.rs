//! One folder or file for each format: takes a path, returns the parts of a volume, or where its voxels are stored.

pub(crate) mod dicom;
pub(crate) mod hdf5;
pub(crate) mod nifti;
pub(crate) mod nrrd;
pub(crate) mod meta_image;
pub(crate) mod mgh;
pub(crate) mod density;
pub(crate) mod vti;
pub(crate) mod vtk;
pub(crate) mod zarr;
pub(crate) mod tiff_stack;
pub(crate) mod picture_slices;
pub(crate) mod numpy;
pub(crate) mod plain;
