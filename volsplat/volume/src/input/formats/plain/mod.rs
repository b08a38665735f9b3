//! A header of fixed places, or none, and then the numbers: raw files (`raw`), GIPL (`gipl`), Amira's regular grids (`amira`).

pub(crate) mod amira;
pub(crate) mod gipl;
pub(crate) mod raw;
