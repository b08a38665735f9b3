//! The pictures of a document, by their numbers in it.

use std::borrow::Cow;

use gltf::json::{Image, Root};
use resample_io::whole_picture::ImageFormat;

use crate::input::files::{self, Names};
use crate::input::gltf::accessor::Numbers;
use crate::input::gltf::document;
use crate::input::pictures::{Decoded, Packed, decode_all};
use crate::scene::Texture;

/// Where the pictures of a document are.
#[derive(Clone, Copy)]
pub(super) struct Images<'a> {
    root: &'a Root,
    numbers: &'a Numbers<'a>,
    names: &'a Names<'a>,
}

impl<'a> Images<'a> {
    pub(super) fn new(root: &'a Root, numbers: &'a Numbers<'a>, names: &'a Names<'a>) -> Self {
        Self {
            root,
            numbers,
            names,
        }
    }

    /// The name of a picture for messages; an error if the document has no such picture.
    pub(super) fn label(&self, index: usize) -> Result<String, String> {
        let json = self.json(index)?;
        Ok(match (&json.name, &json.uri) {
            (_, Some(uri)) if files::data_uri(uri).is_none() => files::excerpt(uri),
            (Some(name), _) => files::excerpt(name),
            (None, _) => format!("image {index}"),
        })
    }

    /// Decodes a picture.
    pub(super) fn decode(&self, index: usize) -> Result<Texture, String> {
        self.packed(index)?.decode(self.names.gate)
    }

    /// Decodes these pictures on all threads, from the first on, as many as memory has room for. A picture whose bytes cannot be read is left
    /// out; [`Self::decode`] gives its fault.
    pub(super) fn decode_all(&self, indices: &[usize]) -> Decoded<usize> {
        let packed = indices
            .iter()
            .filter_map(|&index| Some((index, self.packed(index).ok()?)));
        decode_all(packed, self.names.gate)
    }

    fn json(&self, index: usize) -> Result<&'a Image, String> {
        let json = self.root.images.get(index);
        json.ok_or_else(|| format!("image {index} does not exist"))
    }

    fn packed(&self, index: usize) -> Result<Packed<'a>, String> {
        let json = self.json(index)?;
        let mime = json
            .mime_type
            .as_ref()
            .and_then(|mime| ImageFormat::from_mime_type(&mime.0));
        let bytes = match (json.buffer_view, &json.uri) {
            (Some(view), _) => Cow::Borrowed(self.numbers.view(view.value())?),
            (None, Some(uri)) => Cow::Owned(document::from_uri(uri, self.names)?),
            (None, None) => return Err("has neither a file nor data".into()),
        };
        Ok(Packed {
            name: self.label(index)?,
            bytes,
            format: mime.or_else(|| ImageFormat::from_path(json.uri.as_deref()?).ok()),
        })
    }
}
