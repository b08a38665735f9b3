//! One folder or file for each format: takes a path, returns the parts of a volume, or where its voxels are stored.
