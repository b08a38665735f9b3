//! The mesh readers and the files of the test data: good, odd and damaged ones.

mod bounded_files;
mod far_files;
mod memory;
mod mesh_files;
mod real_files;
