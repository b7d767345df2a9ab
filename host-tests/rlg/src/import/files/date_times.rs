//! Reads date-times and times of day as loggers and spreadsheets write them.

use chrono::{DateTime, NaiveDateTime, NaiveTime, SecondsFormat, Timelike as _};

use super::columns::{Column, Dates};

/// Formats with a zone, in addition to RFC 3339.
const WITH_ZONE: [&str; 2] = ["%Y-%m-%d %H:%M:%S%.f%:z", "%Y-%m-%dT%H:%M:%S%.f%z"];

/// Formats without one. A day before a month only with points between: 05/01/2026 is ambiguous.
const WITHOUT_ZONE: [&str; 6] = [
    "%Y-%m-%d %H:%M:%S%.f",
    "%Y-%m-%dT%H:%M:%S%.f",
    "%Y/%m/%d %H:%M:%S%.f",
    "%d.%m.%Y %H:%M:%S%.f",
    // MATLAB's default, and the clock of twelve hours, which only the month goes before.
    "%d-%b-%Y %H:%M:%S%.f",
    "%m/%d/%Y %I:%M:%S%.f %p",
];

/// Length of a day \[s\].
const DAY_S: f64 = 86_400.0;

/// Plausible stamps in seconds since 1970: from 2001 to 2100 \[s\].
const SINCE_1970_S: std::ops::Range<f64> = 1e9..4.1e9;

/// Parses the cell as whole seconds, the fraction of a second \[s\], and their origin.
pub fn parse(cell: &str) -> Option<(i64, f64, Dates)> {
    let of = |time: DateTime<chrono::Utc>, has_zone| {
        let fraction_s = f64::from(time.timestamp_subsec_nanos()) * 1e-9;
        let dates = Dates {
            origin_s: time.timestamp(),
            has_zone,
            has_day: true,
        };
        (time.timestamp(), fraction_s, dates)
    };
    let with_zone = || {
        let mut forms = WITH_ZONE.iter();
        let other = || forms.find_map(|form| DateTime::parse_from_str(cell, form).ok());
        DateTime::parse_from_rfc3339(cell).ok().or_else(other)
    };
    // Only text with a colon can be a date-time: most cells that are no number are not.
    if !cell.contains(':') {
        return None;
    }
    // Python's logging and spreadsheets with decimal commas: 12:00:00,010.
    let point = cell.replace(',', ".");
    let cell = point.as_str();
    let mut forms = WITHOUT_ZONE.iter();
    if let Some(time) = forms.find_map(|form| NaiveDateTime::parse_from_str(cell, form).ok()) {
        return Some(of(time.and_utc(), false));
    }
    if let Some(time) = with_zone() {
        return Some(of(time.to_utc(), true));
    }
    let time = NaiveTime::parse_from_str(cell, "%H:%M:%S%.f").ok()?;
    let whole_s = i64::from(time.num_seconds_from_midnight());
    let dates = Dates {
        origin_s: whole_s,
        has_zone: false,
        has_day: false,
    };
    Some((whole_s, f64::from(time.nanosecond()) * 1e-9, dates))
}

/// Returns the whole second since 1970 from which stamps count, if they are seconds since 1970 \[s\].
pub fn origin_since_1970_s(first_s: f64, last_s: f64) -> Option<i64> {
    let is_absolute = SINCE_1970_S.contains(&first_s) && SINCE_1970_S.contains(&last_s);
    is_absolute.then_some(first_s.floor() as i64)
}

/// Adds a day to times of day behind each midnight.
pub fn unwrap_midnight(column: &mut Column) {
    if column.dates.is_none_or(|dates| dates.has_day) {
        return;
    }
    let (mut days, mut before) = (0.0, f64::NEG_INFINITY);
    for value in &mut column.values {
        if *value - before < -0.5 * DAY_S {
            days += 1.0;
        }
        if value.is_finite() {
            before = *value;
        }
        *value += days * DAY_S;
    }
}

/// Formats seconds since 1970 by RFC 3339, in UTC.
pub fn rfc3339(since_1970_s: i64) -> Option<String> {
    let time = DateTime::from_timestamp(since_1970_s, 0)?;
    Some(time.to_rfc3339_opts(SecondsFormat::Secs, true))
}

/// True if `text` is a date and time with its zone, as required of `start` in `recording.toml`.
pub fn is_rfc3339(text: &str) -> bool {
    DateTime::parse_from_rfc3339(text).is_ok()
}
