//! Record of unmeasured rows by channel.
//!
//! Enters: a channel's name and its rows without a sample. Leaves: the first channel missing in a row, if any.

/// Channels with unmeasured rows, and these rows.
#[derive(Default)]
pub(super) struct Unmeasured(Vec<(String, Vec<bool>)>);

impl Unmeasured {
    /// Stores a channel's rows, if any are missing.
    pub(super) fn note(&mut self, channel: String, missing: Vec<bool>) {
        if missing.contains(&true) {
            self.0.push((channel, missing));
        }
    }

    /// First channel not measured in this row.
    pub(super) fn channel(&self, row: usize) -> Option<&str> {
        let mut channels = self.0.iter();
        let found = channels.find(|(_, missing)| missing[row]);
        found.map(|(channel, _)| channel.as_str())
    }

    /// True if any channel with this name prefix was not measured in this row.
    pub(super) fn is_missing(&self, stem: &str, row: usize) -> bool {
        let mut channels = self.0.iter();
        channels.any(|(channel, missing)| channel.starts_with(stem) && missing[row])
    }

    /// Selects these rows.
    pub(super) fn select(&mut self, rows: &[usize]) {
        for (_, missing) in &mut self.0 {
            *missing = rows.iter().map(|&row| missing[row]).collect();
        }
    }
}
