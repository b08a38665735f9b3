//! Notes to the user: what was left out or could not be had.

use super::choice::Unreadable;

/// Notes, each said once.
#[derive(Debug, Default)]
pub(super) struct Notes {
    pub(super) said: Vec<String>,
    unreadable: Unreadable,
}

/// Most notes that are kept: nobody reads more, and a broken file could make any number.
pub(super) const MAX_NOTES: usize = 20;

impl Notes {
    /// None yet.
    pub(super) fn new(unreadable: Unreadable) -> Self {
        Self {
            said: Vec::new(),
            unreadable,
        }
    }

    /// Adds a note, unless it has been said.
    pub(super) fn say(&mut self, note: String) {
        if self.said.contains(&note) || self.said.len() > MAX_NOTES {
            return;
        }
        let full = self.said.len() == MAX_NOTES;
        self.said.push(if full {
            "more notes are left out".to_owned()
        } else {
            note
        });
    }

    /// A picture or a material file cannot be read: an error, or a note of what is drawn instead.
    pub(super) fn unreadable(&mut self, what: &str, instead: &str) -> Result<(), String> {
        match self.unreadable {
            Unreadable::Refused => Err(format!(
                "{what}: mend or fetch what is missing, or draw without pictures by --textures left-out"
            )),
            Unreadable::Noted => {
                self.say(format!("{what}: {instead}"));
                Ok(())
            }
        }
    }
}
