//! NumPy's files: one array (`npy`), or several in a ZIP archive (`npz`).

pub(crate) mod npy;
pub(crate) mod npz;
