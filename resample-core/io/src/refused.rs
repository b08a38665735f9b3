//! Why the content of a file is refused, before the file's name is known.

/// Why the content of a file is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// It contradicts the format or itself.
    Invalid(String),
    /// It is right, but a rare form that is not read.
    Unsupported(String),
}

impl From<String> for Refused {
    fn from(what: String) -> Self {
        Self::Invalid(what)
    }
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Invalid(what) | Self::Unsupported(what)) = self;
        f.write_str(what)
    }
}

/// The start of a text, short enough for a message.
///
/// ```
/// use resample_io::refused::excerpt;
///
/// assert_eq!(excerpt(&"x".repeat(1000)).len(), 60);
/// ```
pub fn excerpt(text: &str) -> String {
    text.chars().take(60).collect()
}
