//! Repeats the paper's experiments: simulator, firmware chain, navigation, each compared with the printed figure.
//!
//! From a seed it gives a [`Paper`]: the content of `paper.json` and `paper.html`. °, °/h, m/s as printed.
//!
//! Data flow, the same for every experiment: motion as a scenario (`unit`) → simulated recording → f32 chain with Eq. (7)
//! alone, with the dynamic terms, and with Eq. (6) as printed (`run`) → drift, or navigation (`sins`) → comparison with the
//! paper's figures (`printed`, `rows`) → decision on reproduction (`marks`).
//!
//! ```text
//! deflection (Tables 1, 2)   calibration (Table 3) ─ what the chain is told ─▶ coning (Fig. 6–9)
//! gyros (Fig. 4, 5)                                                        └▶ vibration (Fig. 10–13, Tables 4, 5)
//! ```
//!
//! The simulated blocks bend as oscillators on their suspensions, not by the static law of the chain's compensation.
//!
//! Values that the paper does not print (amplitudes, spectra, durations) are chosen in the experiment's own file, with the
//! reason and the results for half and twice the choice.
//!
//! Out of scope: finite elements. Tables 1 and 2 are compared with the simulator's own mechanics.

pub mod calibration;
pub mod coning;
pub mod deflection;
pub mod entry;
pub mod gyros;
pub mod lengths;
mod marks;
pub mod page;
pub mod printed;
pub mod rows;
pub mod run;
pub mod sins;
pub mod unit;
pub mod vibration;

use serde::Serialize;

use crate::error::InputError;
use calibration::calibrate;
use coning::Coning;
use entry::Entry;
use gyros::Figure;
use lengths::Lengths;
use rows::Compared;
use run::Progress;
use vibration::Vibration;

/// Results of all experiments.
pub struct Paper {
    /// `paper.json`.
    pub results: Results,
    /// Fig. 4 and 5.
    pub gyros: [Figure; 2],
    /// Fig. 6 to 9.
    pub coning: Coning,
    /// Fig. 10 to 13: along x, along y.
    pub vibration: [Vibration; 2],
    /// Tables 4 and 5.
    pub tables: [Vec<Compared>; 2],
}

/// `paper.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Results {
    /// Format of the file.
    pub format: u32,
    /// Version of the tool.
    pub version: &'static str,
    /// Seed of the simulations.
    pub seed: u64,
    /// Entries in the paper's order.
    pub entries: Vec<Entry>,
    /// Results of Eq. (6) with its signs as printed.
    pub literal_signs: String,
}

impl Results {
    /// Returns the number of items reproduced, and of reproducible items: drawings are not.
    pub fn score(&self) -> [usize; 2] {
        let could = self.entries.iter().filter(|entry| !entry.drawing);
        let done = self.entries.iter().filter(|entry| entry.reproduced);
        [done.count(), could.count()]
    }
}

/// Returns the number of rows simulated in all.
pub fn rows(lengths: &Lengths) -> usize {
    gyros::rows() + calibration::rows() + coning::rows(lengths) + vibration::rows(lengths)
}

/// Runs all experiments.
pub fn reproduce(seed: u64, lengths: &Lengths, progress: &Progress) -> Result<Paper, InputError> {
    let calibration = calibrate(seed, progress)?;
    let known_s2 = calibration.coefficients_s2();
    let vibration = vibration::directions(seed, known_s2, lengths, progress)?;
    let (gyros, coning) = rayon::join(
        || gyros::figures(seed, progress),
        || coning::systems(seed, known_s2, lengths, progress),
    );
    let (gyros, coning) = (gyros?, coning?);
    let mut entries = marks::drawings();
    entries.extend(marks::deflections(&deflection::deflection()));
    entries.push(marks::calibrated(&calibration));
    entries.extend(
        gyros
            .iter()
            .enumerate()
            .map(|(index, figure)| marks::side_by_side(index, figure)),
    );
    entries.extend(marks::systems(&coning, lengths));
    entries.extend(marks::shaken(&vibration, lengths));
    Ok(Paper {
        results: Results {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            seed,
            entries,
            literal_signs: marks::literal(&gyros[0], &vibration),
        },
        tables: Compared::tables(&vibration, lengths),
        gyros,
        coning,
        vibration,
    })
}
