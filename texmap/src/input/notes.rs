//! Notes to the user: what was left out or could not be had.

/// Notes, each said once.
#[derive(Debug, Default)]
pub(super) struct Notes(pub(super) Vec<String>);

/// Most notes that are kept: nobody reads more, and a broken file could make any number.
pub(super) const MAX_NOTES: usize = 20;

impl Notes {
    /// Adds a note, unless it has been said.
    pub(super) fn say(&mut self, note: String) {
        if self.0.contains(&note) || self.0.len() > MAX_NOTES {
            return;
        }
        let full = self.0.len() == MAX_NOTES;
        self.0.push(if full {
            "more notes are left out".to_owned()
        } else {
            note
        });
    }
}
