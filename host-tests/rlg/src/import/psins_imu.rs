//! Imports PSINS `.imu` text.
//!
//! The text has lines that begin with `%` (words); then three lines of six numbers: attitude and velocity at the start;
//! latitude \[°\], longitude \[°\], height \[m\], t0 \[s\], interval \[ms\], g \[m/s²\]; angle of a gyro count \[″\] x
//! y z and velocity of an accelerometer count \[µg·s\] x y z; then six counts a line, gyro x y z, accelerometer x y z.
//! The table written to disk has `gyro_increment` and `velocity_increment`, with the file's own scales and axes (right,
//! forward, up).
//!
//! Source: the words in the files themselves; PSINS toolbox by Gongmin Yan. Its µg is of the file's g. The site is the
//! file's latitude with normal gravity there, because the file's g is the equator's. The first line ("maybe inaccurate") is
//! ignored. Memory does not grow with the file.

use std::io::{BufRead, Read as _};
use std::path::Path;

use strapdown::earth::gravity_m_s2;

use super::still::{self, Foreign, TABLE};
use crate::error::InputError;
use crate::output::OutputFolder;
use crate::recording::{Axis, Clock, Quantity, Site, TableStream};

/// Columns in the order of a line.
const COLUMNS: [&str; 6] = ["gx", "gy", "gz", "ax", "ay", "az"];

/// Longest line \[bytes\]: six f64 of 25 digits; a longer one is not of this format.
const LONGEST_LINE: u64 = 1024;

/// Lines of numbers before the counts.
const HEADER_LINES: usize = 3;

/// One second of arc \[rad\].
const ARCSEC_RAD: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Reads all lines of `source`, which is `file`, into `out`; `site` of the caller takes precedence over the file's.
pub fn import(
    file: &Path,
    mut source: impl BufRead,
    rate_hz: Option<f64>,
    site: Option<Site>,
    out: &mut OutputFolder,
) -> Result<Foreign, InputError> {
    let mut header: Vec<[f64; 6]> = Vec::new();
    let mut table = TableStream::create(out, TABLE, &COLUMNS)?;
    let mut text = Vec::new();
    for line in 1_u64.. {
        text.clear();
        let count = source
            .by_ref()
            .take(LONGEST_LINE + 1)
            .read_until(b'\n', &mut text)
            .map_err(|error| InputError::unreadable(file, &error))?;
        if count == 0 {
            break;
        }
        let at = format!("line {line}");
        if count as u64 > LONGEST_LINE {
            return Err(InputError::new(file, "is too long")
                .channel(at)
                .expected(format!("at most {LONGEST_LINE} bytes: six numbers")));
        }
        let trimmed = text.trim_ascii();
        if trimmed.is_empty() || trimmed.starts_with(b"%") {
            continue;
        }
        let numbers = six(file, &at, trimmed)?;
        if header.len() < HEADER_LINES {
            header.push(numbers);
            if let [_, place, scales] = header[..] {
                check_header(file, &at, place, scales)?;
            }
        } else {
            table.push(&numbers)?;
        }
    }
    let rows = table.finish()?;
    let ([_, place, scales], 2..) = (
        <[[f64; 6]; HEADER_LINES]>::try_from(header).unwrap_or_default(),
        rows,
    ) else {
        return Err(InputError::new(file, "holds too few lines of counts")
            .value(rows)
            .expected("three lines of six numbers, then at least 2 of six counts"));
    };
    let [latitude_deg, _, height_m, start_s, interval_ms, g_m_s2] = place;
    let rate_hz = rate_hz.unwrap_or(1e3 / interval_ms);
    let latitude_rad = latitude_deg.to_radians();
    let site = site.unwrap_or(Site {
        latitude_rad,
        gravity_m_s2: gravity_m_s2(latitude_rad, height_m).norm(),
    });
    let mut channels = Vec::new();
    let mut resolution_rad = [0.0; 3];
    for (place, axis) in Axis::ALL.into_iter().enumerate() {
        let count_rad = scales[place] * ARCSEC_RAD;
        let count_m_s = scales[3 + place] * 1e-6 * g_m_s2;
        resolution_rad[place] = count_rad;
        channels.push(still::column(
            COLUMNS[place],
            Quantity::GyroIncrement,
            Some(axis),
            count_rad,
        ));
        channels.push(still::column(
            COLUMNS[3 + place],
            Quantity::VelocityIncrement,
            Some(axis),
            count_m_s,
        ));
    }
    let clock = Clock::Uniform { rate_hz, start_s };
    Ok(Foreign {
        recording: still::recording(file, Some(site), clock, channels),
        rows,
        rate_hz,
        stamped_rate_hz: None,
        resolution_rad,
    })
}

/// Parses the six numbers of a line.
fn six(file: &Path, at: &str, line: &[u8]) -> Result<[f64; 6], InputError> {
    let mut numbers = [0.0; 6];
    let mut count = 0;
    for word in line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
    {
        let text = String::from_utf8_lossy(word);
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| {
            InputError::new(file, "is not a number")
                .channel(format!("{at}, column {}", count + 1))
                .value(format!("`{text}`"))
                .expected("a finite number")
        })?;
        if let Some(slot) = numbers.get_mut(count) {
            *slot = number;
        }
        count += 1;
    }
    if count != numbers.len() {
        return Err(InputError::new(file, "has another number of columns")
            .channel(at)
            .value(count)
            .expected("6: gyro x y z, accelerometer x y z"));
    }
    Ok(numbers)
}

fn check_header(
    file: &Path,
    at: &str,
    place: [f64; 6],
    scales: [f64; 6],
) -> Result<(), InputError> {
    let fault = |what: &str, value: f64, expected: &str| {
        Err(InputError::new(file, format!("is no {what}"))
            .channel(format!("the header, up to {at}"))
            .value(value)
            .expected(expected))
    };
    if place[0].abs() > 90.0 {
        return fault("latitude", place[0], "-90 to 90 degrees");
    }
    if place[4] <= 0.0 {
        return fault("sampling interval", place[4], "a positive number of ms");
    }
    // Gravity on the ground is 9.76 to 9.83 m/s².
    if !(9.7..=9.9).contains(&place[5]) {
        return fault("gravity", place[5], "9.7 to 9.9 m/s^2");
    }
    if let Some(scale) = scales.into_iter().find(|scale| *scale <= 0.0) {
        return fault("angle or velocity of a count", scale, "a positive number");
    }
    Ok(())
}
