//! Notes for the user. Equal notes on several pictures of a sequence are printed once.

use std::collections::HashSet;

use crate::process::report;

/// The notes that have been printed.
#[derive(Debug, Default)]
pub(crate) struct Notes(HashSet<String>);

impl Notes {
    /// Prints a note of a place, unless the same was said of this place or of another one before.
    pub(crate) fn say_of(&mut self, place: &str, text: String) {
        let line = format!("note: {place}: {text}");
        if self.0.insert(text) {
            report::say(&line);
        }
    }

    /// Prints a line, unless it was printed before.
    pub(crate) fn say(&mut self, line: &str) {
        if self.0.insert(line.to_owned()) {
            report::say(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_notes_are_said_once_whatever_place_they_are_of() {
        let mut notes = Notes::default();
        let (_, lines) = report::heard(|| {
            notes.say_of("a.png", "no unit".into());
            notes.say_of("b.png", "no unit".into());
            notes.say_of("b.png", "upside down".into());
            notes.say("warning: empty");
            notes.say("warning: empty");
        });
        assert_eq!(
            lines,
            [
                "note: a.png: no unit",
                "note: b.png: upside down",
                "warning: empty"
            ]
        );
    }
}
