//! stub
use crate::Error;
use crate::gaussians::Gaussians;
use resample_io::Gate;
use std::path::Path;
pub(crate) fn may_begin(_: &[u8]) -> bool {
    false
}
pub(crate) fn begins(_: &Path) -> bool {
    false
}
pub(crate) fn load(path: &Path, _: &Gate, _: &mut Vec<String>) -> Result<Gaussians, Error> {
    Err(crate::input::invalid(path, "x"))
}
