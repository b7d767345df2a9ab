//! Which channels were not measured in which rows.
//!
//! Enters: a channel's name and its rows without a reading. Leaves: whether a row has everything, and the channel to
//! name where it has not.

/// Channels with rows that were not measured, with those rows.
#[derive(Default)]
pub(super) struct Unmeasured(Vec<(String, Vec<bool>)>);

impl Unmeasured {
    /// Notes a channel's rows, if any are missing.
    pub(super) fn note(&mut self, channel: String, missing: Vec<bool>) {
        if missing.contains(&true) {
            self.0.push((channel, missing));
        }
    }

    /// The first channel that was not measured in this row.
    pub(super) fn channel(&self, row: usize) -> Option<&str> {
        let mut channels = self.0.iter();
        let found = channels.find(|(_, missing)| missing[row]);
        found.map(|(channel, _)| channel.as_str())
    }

    /// Whether any channel whose name begins so was not measured in this row.
    pub(super) fn is_missing(&self, stem: &str, row: usize) -> bool {
        let mut channels = self.0.iter();
        channels.any(|(channel, missing)| channel.starts_with(stem) && missing[row])
    }

    /// Keeps these rows alone.
    pub(super) fn select(&mut self, rows: &[usize]) {
        for (_, missing) in &mut self.0 {
            *missing = rows.iter().map(|&row| missing[row]).collect();
        }
    }
}
