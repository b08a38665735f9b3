//! A channel of a file: its number, its words, and the description in the file.

use volsplat::input::ImageChannel;

use crate::args::{ChannelArgs, LookWords};

/// A channel of a file that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FileChannel {
    /// Its number in the file, counted from 0.
    pub(crate) number: usize,
    /// Its place among the channels of the file.
    pub(crate) place: Place,
    /// The place of its words among the typed ones, counted from 0; `None` where nothing was typed.
    pub(crate) typed: Option<usize>,
    /// False for a component of vectors.
    pub(crate) is_of_image: bool,
    /// The file's own description.
    pub(crate) known: ImageChannel,
}

/// A place in a row of channels, for the usual colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) number: usize,
    pub(crate) count: usize,
}

/// A channel of the file as it is drawn, in words that draw it again.
#[derive(Clone, Debug)]
pub(crate) struct ShownChannel {
    pub(crate) number: usize,
    pub(crate) name: Option<String>,
    pub(crate) look: LookWords,
}

impl Place {
    /// The only channel.
    pub(crate) const ALONE: Self = Self {
        number: 0,
        count: 1,
    };
}

impl FileChannel {
    /// The place of its words among the typed ones: those it was read for, or those of the same number that were typed later.
    pub(crate) fn place_in(&self, typed: &ChannelArgs) -> Option<usize> {
        let number = self.number.to_string();
        let of_number = || {
            let mut looks = typed.components.iter();
            looks.position(|look| look.channel == number)
        };
        self.typed.or_else(of_number)
    }
}
