//! Lists the known foreign recordings by their SHA-256, with their provenance.
//!
//! A sum gives the provenance, and the site if the source names one. The files themselves are not here: their owners have
//! not permitted redistribution.

use std::fs;
use std::path::Path;

use crate::error::InputError;
use crate::recording::Site;

/// File of a known source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// SHA-256 in hexadecimal.
    pub sha256: &'static str,
    /// Its name at the source.
    pub name: &'static str,
    /// Source and terms of use.
    pub source: &'static str,
    /// Site of the recording, if stated by the source: latitude \[deg\], gravity \[m/s²\].
    pub site: Option<(f64, f64)>,
}

/// The known files.
pub const KNOWN: [Known; 2] = [
    Known {
        sha256: "67fe71f929e5aaa33a606e7dcc49274cd9d334148f5808bc06d5a7d0f5ab0dcb",
        name: "x_LN100_up.ins",
        source: "GitHub talhaitis/Ins-Calibration, data/ (repository MIT; course data, owner not stated)",
        site: Some((51.0447, 9.80841)),
    },
    Known {
        sha256: "5de921e75f690c91ce6b7d3e811e547e050c4f1d000f648f537a59521206ba4d",
        name: "lasergyro.imu",
        source: "GitHub WangShanpeng/PSINS, data/ (toolbox by Gongmin Yan, BSD-2-Clause)",
        site: None,
    },
];

impl Known {
    /// Returns the file with this sum.
    pub fn of(sha256: &str) -> Option<&'static Self> {
        KNOWN.iter().find(|known| known.sha256 == sha256)
    }

    /// Returns its site in SI units.
    pub fn site(&self) -> Option<Site> {
        self.site.map(|(latitude_deg, gravity_m_s2)| Site {
            latitude_rad: latitude_deg.to_radians(),
            gravity_m_s2,
        })
    }
}

/// Returns the required sum of `file`: `given` is the sum itself, or a file of `SUM  NAME` lines.
pub fn expected_sum(file: &Path, given: &str) -> Result<String, InputError> {
    if is_sum(given) {
        return Ok(given.to_ascii_lowercase());
    }
    let list = Path::new(given);
    let text = fs::read_to_string(list).map_err(|error| {
        InputError::unreadable(list, &error)
            .channel("--sha256")
            .expected("64 hexadecimal digits, or a file of `SUM  NAME` lines")
    })?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    text.lines()
        .find_map(|line| {
            // sha256sum marks files read as binary with a star.
            let (sum, listed) = line.split_once(char::is_whitespace)?;
            let listed = listed.trim_start().trim_start_matches('*');
            (listed == name && is_sum(sum)).then(|| sum.to_ascii_lowercase())
        })
        .ok_or_else(|| {
            InputError::new(list, "has no sum for this file")
                .channel("--sha256")
                .value(&name)
                .expected("a line `SUM  NAME`")
        })
}

/// Checks `found`, the sum of `file`, against the expected one.
pub fn check(file: &Path, found: &str, expected: Option<&str>) -> Result<(), InputError> {
    match expected {
        Some(expected) if expected != found => {
            Err(InputError::new(file, "is not the file it should be")
                .channel("sha256")
                .value(found)
                .expected(expected))
        }
        _ => Ok(()),
    }
}

fn is_sum(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}
