//! The pictures of a document: those that materials ask for are decoded ahead, on all threads, as far as memory allows.

use std::borrow::Cow;
use std::collections::HashMap;

use gltf::json::{Image, Root};
use rayon::prelude::*;
use resample_io::whole_picture::ImageFormat;

use crate::input::files::{self, Names};
use crate::input::gltf::accessor::Numbers;
use crate::input::gltf::document;
use crate::scene::Texture;

/// Memory of a picture while it is decoded, in sizes of what is kept of it: before it is kept, it lies in the decoder.
const WHILE_DECODED: u64 = 2;

/// Where the pictures of a document are.
#[derive(Clone, Copy)]
pub(super) struct Pictures<'a> {
    root: &'a Root,
    numbers: &'a Numbers<'a>,
    names: &'a Names<'a>,
}

/// Pictures by their numbers in the document, or why one cannot be had.
pub(super) type Decoded = HashMap<usize, Result<Texture, String>>;

/// A picture as the document holds it.
struct Packed<'a> {
    label: String,
    bytes: Cow<'a, [u8]>,
    /// Where the content has no mark.
    format: Option<ImageFormat>,
}

impl Packed<'_> {
    fn decode(&self, names: &Names) -> Result<Texture, String> {
        files::decode(&self.bytes, (self.format, &self.label), names.gate)
    }
}

impl<'a> Pictures<'a> {
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
        self.packed(index)?.decode(self.names)
    }

    /// Decodes the first of these pictures on all threads, as many as memory has room for. Files are read one after another, in this order.
    pub(super) fn decode_all(&self, indices: &[usize]) -> Decoded {
        let (mut all, mut bytes) = (Vec::new(), 0);
        for &index in indices {
            // Whoever asks for a picture that cannot be had gets the reason.
            let Ok(packed) = self.packed(index) else {
                continue;
            };
            let kept = files::decoded_bytes(&packed.bytes, packed.format).unwrap_or(0);
            bytes += WHILE_DECODED * kept;
            if self.names.gate.ask(bytes, &packed.label).is_err() {
                break;
            }
            all.push((index, packed));
        }
        all.into_par_iter()
            .map(|(index, packed)| (index, packed.decode(self.names)))
            .collect()
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
            label: self.label(index)?,
            bytes,
            format: mime.or_else(|| ImageFormat::from_path(json.uri.as_deref()?).ok()),
        })
    }
}
