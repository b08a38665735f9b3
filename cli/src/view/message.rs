//! Messages between the page and the server: JSON texts, and pictures behind a JSON head.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::view::options_text::Changes;

/// The view that the page requests.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub(crate) struct View {
    /// A camera in the words of a camera file: position, target, up, and fov_y or projection and height.
    pub(crate) camera: Value,
    /// Width and height, px.
    pub(crate) size: [u32; 2],
    /// Options by name.
    #[serde(default)]
    pub(crate) changes: Changes,
    /// A transfer function in the form of ParaView, with display colours.
    #[serde(default)]
    pub(crate) transfer: Option<Value>,
    /// A table of labels in the form of a label file, with display colours.
    #[serde(default)]
    pub(crate) labels: Option<Value>,
    /// How exact a resting picture is.
    #[serde(default)]
    pub(crate) exactness: Exactness,
}

/// How exact a resting picture is.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Exactness {
    /// As moving pictures, at full size.
    Fast,
    /// As the command line draws.
    #[default]
    Default,
    /// With an error of at most 1/64 against the most exact setting.
    #[serde(rename = "1/64")]
    Within64,
    /// With an error of at most 1/255.
    #[serde(rename = "1/255")]
    Within255,
    /// The most exact setting.
    Exact,
}

impl Exactness {
    /// The bound of the error, in the words of `--max-error`.
    pub(crate) fn bound(self) -> Option<&'static str> {
        match self {
            Self::Within64 => Some("1/64"),
            Self::Within255 => Some("1/255"),
            Self::Fast | Self::Default | Self::Exact => None,
        }
    }
}

/// The state of the camera: moving pictures are replaced by the next, resting ones are looked at.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Motion {
    /// Quickly, and smaller if need be.
    Moving,
    /// To the end.
    Resting,
}

/// A request of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(crate) enum Asked {
    /// Draw this, and forget what was asked for before.
    Draw {
        id: u32,
        motion: Motion,
        #[serde(flatten)]
        view: View,
    },
    /// This picture is on the screen.
    Shown { id: u32 },
    /// The point under a place of the picture, px.
    Probe {
        at: [f64; 2],
        /// A word of the page's own, which comes back with the answer.
        #[serde(default)]
        purpose: Option<String>,
        #[serde(flatten)]
        view: View,
    },
    /// A small picture of a preset.
    Thumbnail {
        preset: String,
        #[serde(flatten)]
        view: View,
    },
    /// The command line that draws this.
    Command {
        #[serde(flatten)]
        view: View,
    },
    /// End the picture in work, and the file that is being written.
    Cancel,
    /// Write a file into the folder where the command was started.
    Save {
        what: Saved,
        name: String,
        #[serde(flatten)]
        view: View,
        /// The key frames of a path or a film, or the cameras of a turntable.
        #[serde(default)]
        detail: Value,
    },
}

/// The kind of a saved file.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Saved {
    Picture,
    Transfer,
    Labels,
    Camera,
    Path,
    Turntable,
    Film,
}

/// The head of a picture.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PictureHead {
    pub(crate) id: u32,
    /// "moving", "resting" or "thumbnail".
    pub(crate) kind: &'static str,
    /// Name of the preset of a thumbnail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) preset: Option<String>,
    /// MIME type of the bytes behind the head.
    pub(crate) format: &'static str,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Wall time of the drawing, ms.
    pub(crate) draw_ms: f64,
    /// True if this is the last picture of the view.
    pub(crate) is_last: bool,
}

impl PictureHead {
    /// Length of the head (4 bytes, little-endian), head, picture.
    pub(crate) fn with(&self, picture: &[u8]) -> Vec<u8> {
        // A struct of numbers and words can always be written.
        let head = serde_json::to_vec(self).unwrap_or_default();
        let length = u32::try_from(head.len()).unwrap_or_default();
        [&length.to_le_bytes()[..], &head, picture].concat()
    }
}
