//! `recording.toml` as text, from a recording in memory; the same recording gives the same bytes.

use std::fmt::Write as _;

use super::manifest::INSTANT;
use super::{Clock, Quantity, Recording};
use crate::toml_file;

/// Formats `recording.toml` for `recording`. `scaling` returns, for a table and a channel, the scale and offset of the
/// stored channel; `instants` are quantities sampled at the rows' ends.
pub(super) fn manifest_text(
    recording: &Recording,
    scaling: impl Fn(usize, usize) -> (f64, f64),
    instants: &[Quantity],
) -> String {
    let mut out = format!(
        "format = {}\nname = {}\n",
        toml_file::FORMAT,
        toml_file::string(&recording.name)
    );
    // Writing to a String cannot fail, so the results of write! are dropped.
    if let Some(site) = recording.site {
        let _ = write!(
            out,
            "\n[site]\nlatitude_rad = {}\ngravity_m_s2 = {}\n",
            toml_file::float(site.latitude_rad),
            toml_file::float(site.gravity_m_s2)
        );
    }
    for (t, table) in recording.tables.iter().enumerate() {
        let _ = write!(
            out,
            "\n[[table]]\nfile = {}\n",
            toml_file::string(&table.file)
        );
        let _ = match &table.clock {
            Clock::Uniform { rate_hz, start_s } => write!(
                out,
                "rate_hz = {}\nstart_s = {}\n",
                toml_file::float(*rate_hz),
                toml_file::float(*start_s)
            ),
            Clock::Stamped { column, .. } => writeln!(out, "time = {}", toml_file::string(column)),
        };
        for (c, channel) in table.channels.iter().enumerate() {
            let (scale, offset) = scaling(t, c);
            let _ = write!(
                out,
                "\n  [[table.channel]]\n  column = {}\n  quantity = {}\n",
                toml_file::string(&channel.column),
                toml_file::string(channel.quantity.name())
            );
            if let Some(axis) = &channel.axis {
                let _ = writeln!(out, "  axis = {}", toml_file::string(axis));
            }
            if instants.contains(&channel.quantity) {
                let _ = writeln!(out, "  sampling = {}", toml_file::string(INSTANT));
            }
            let _ = write!(
                out,
                "  scale = {}\n  offset = {}\n",
                toml_file::float(scale),
                toml_file::float(offset)
            );
        }
    }
    for segment in &recording.segments {
        let _ = write!(
            out,
            "\n[[segment]]\nname = {}\nkind = {}\nstart_s = {}\nend_s = {}\n",
            toml_file::string(&segment.name),
            toml_file::string(&segment.kind),
            toml_file::float(segment.start_s),
            toml_file::float(segment.end_s)
        );
    }
    out
}
