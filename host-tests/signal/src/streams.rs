//! The recording resampled for the diagnosis: every channel on the gyros' rows.
//!
//! Row k covers \[start + k/rate, start + (k+1)/rate); increments are in rad (body axes). alignment.rs makes them of a
//! recording.
//!
//! At rest on the Earth the case's motion is the Earth's rotation (still.rs), and no reference is needed.

use super::accelerometer_rows::Rows;
pub use super::axes::{AXES, Triad, add, add_triad, each_axis, weighted_sum};
use super::piece::Piece;
use super::still::{self, AtRest};
use super::unmeasured::Unmeasured;
use rlg_model::Model;
use rlg_plan::AlignPlan;
use rlg_recording::Site;

/// All channels on the gyros' rows.
pub struct Streams {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Beginning of row 0 \[s\].
    pub start_s: f64,
    /// Number of rows.
    pub rows: usize,
    /// Angle of one pulse \[rad\]; 0 where the gyros report increments or rates.
    pub pulse_rad: [f64; 3],
    /// The gyros report rates; their quantisation is no pulse.
    pub reports_rates: bool,
    /// Increment sensed by each gyro over the row \[rad\], its own dither included.
    pub sensed_rad: Triad,
    /// Pickoff angle of block relative to case at the row's end \[rad\]; one entry more than rows, the first being the end
    /// of the row before. `None` for gyros without dither channels.
    pub pickoff_rad: Option<Triad>,
    /// Increment of the case's angle over the row \[rad\], from the reference or from the Earth's rotation.
    pub case_rad: Triad,
    /// Samples of the reference a second \[Hz\]; `None`: one in each row.
    pub reference_hz: Option<f64>,
    /// The case's motion is taken from the gyros themselves, the reference being slower.
    pub own_motion: bool,
    /// Motion of a unit at rest; `None` where a reference measures its motion.
    pub at_rest: Option<AtRest>,
    /// The recorder's own time at each row's end \[s\], NaN in gaps.
    pub stamps_s: Option<Vec<f64>>,
    /// Mean specific force \[m/s²\].
    pub force_m_s2: Option<Triad>,
    /// Temperature \[K\].
    pub temperature_k: Option<Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<Triad>,
    /// Channels of unknown quantity, by name, for the search for unlisted physics.
    pub others: Vec<(String, Vec<f64>)>,
    /// Rows in which gyros, pickoffs and reference were all measured.
    pub usable: Vec<bool>,
    /// Measured rows before the masking of data faults.
    pub measured: Vec<bool>,
    /// Recording, or stretch of one, of the rows.
    pub piece: Piece,
    /// The accelerometers on rows of their own, or the reason for their absence.
    pub accelerometers: Result<Rows, String>,
    /// Site of the recording.
    pub site: Option<Site>,
    /// Channels with unmeasured rows, and these rows.
    pub(super) unmeasured: Unmeasured,
}

impl Streams {
    /// Sets the case's motion to the Earth's rotation, estimated from the gyros' usable rows.
    pub(super) fn stand_still(&mut self, model: &Model, plan: &AlignPlan) {
        let fitted = (plan.rest_share * self.rows as f64) as usize;
        let rest = AtRest::new(
            &still::shown_rad(
                &self.sensed_rad,
                self.pickoff_rad.as_ref(),
                model,
                self.rate_hz,
            ),
            self.force_m_s2.as_ref(),
            &self.usable,
            0..fitted,
            self.rate_hz,
            self.site,
        );
        let turns = |axis: usize| vec![rest.earth_rad_s[axis] / self.rate_hz; self.rows];
        self.case_rad = [0, 1, 2].map(turns);
        self.at_rest = Some(rest);
    }

    /// Dither increment of each block relative to the case over the row \[rad\], from the pickoffs; `None` without dither
    /// channels.
    pub fn dither_rad(&self) -> Option<Triad> {
        let of_angles = |angles: &Vec<f64>| {
            let ends = angles.windows(2);
            ends.map(|pair| pair[1] - pair[0]).collect()
        };
        let pickoff = self.pickoff_rad.as_ref()?;
        Some(pickoff.each_ref().map(of_angles))
    }

    /// Repeats the estimate of the Earth's rotation after further rows were masked.
    pub fn stand_still_again(&mut self, model: &Model, plan: &AlignPlan) {
        if self.at_rest.is_some() {
            self.stand_still(model, plan);
        }
    }

    /// Selects these rows of the record of unmeasured channels.
    pub(super) fn select_unmeasured(&mut self, rows: &[usize]) {
        self.unmeasured.select(rows);
    }

    /// A perfect, undithered unit on a given motion: input of a proposed experiment to the catalogue.
    pub fn of_motion(rate_hz: f64, case_rad: Triad) -> Self {
        let rows = case_rad[0].len();
        let nowhere = Piece {
            origin: None,
            recording: String::new(),
            segments: Vec::new(),
            held_out: false,
        };
        Self {
            sensed_rad: case_rad.clone(),
            case_rad,
            own_motion: true,
            ..Self::bare(rate_hz, 0.0, vec![true; rows], &nowhere)
        }
    }

    /// Rows on another clock without channels, for splitting and locating.
    pub fn bare(rate_hz: f64, start_s: f64, usable: Vec<bool>, of: &Piece) -> Self {
        Self {
            rate_hz,
            start_s,
            rows: usable.len(),
            pulse_rad: [0.0; 3],
            reports_rates: false,
            sensed_rad: Triad::default(),
            pickoff_rad: None,
            case_rad: Triad::default(),
            reference_hz: None,
            own_motion: false,
            at_rest: None,
            stamps_s: None,
            force_m_s2: None,
            temperature_k: None,
            magnetic_t: None,
            others: Vec::new(),
            measured: usable.clone(),
            piece: of.clone(),
            usable,
            accelerometers: Err(String::new()),
            site: None,
            unmeasured: Unmeasured::default(),
        }
    }

    /// Returns the longest stretch of rows with a continuous attitude from the reference.
    pub fn longest_carried(&self, plan: &AlignPlan) -> std::ops::Range<usize> {
        let unknown = |row: usize| self.unmeasured.is_missing("reference", row);
        let mut longest = 0..0;
        let (mut begin, mut row) = (0, 0);
        while row < self.rows {
            let gap = (row..self.rows).take_while(|&row| unknown(row)).count();
            if gap > plan.bridged_rows {
                begin = row + gap;
            }
            row += gap.max(1);
            if row.min(self.rows) - begin.min(row) > longest.len() {
                longest = begin..row.min(self.rows);
            }
        }
        longest
    }

    /// Start time of a row \[s\].
    pub fn begin_s(&self, row: usize) -> f64 {
        self.start_s + row as f64 / self.rate_hz
    }

    /// Name of a channel not measured in this row.
    pub fn unmeasured_channel(&self, row: usize) -> String {
        self.unmeasured.channel(row).unwrap_or_default().to_string()
    }

    /// True if no gyro was measured in this row: the recorder lost it, and not one of its channels.
    pub fn is_row_lost(&self, row: usize) -> bool {
        let mut gyros = AXES.iter().map(|axis| format!("gyro_{axis}"));
        gyros.all(|gyro| self.unmeasured.is_missing(&gyro, row))
    }

    /// Mid-time of a row \[s\].
    pub fn middle_s(&self, row: usize) -> f64 {
        self.start_s + (row as f64 + 0.5) / self.rate_hz
    }

    /// End time of the last row \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.rows as f64 / self.rate_hz
    }

    /// Returns the row whose start is nearest to `time_s`, at most `rows`.
    pub fn row_at(&self, time_s: f64) -> usize {
        (((time_s - self.start_s) * self.rate_hz).round().max(0.0) as usize).min(self.rows)
    }
}

impl Rows {
    /// Masks rows that overlap gyro rows with the case's motion unmeasured or its attitude discontinuous.
    pub fn mask(&mut self, streams: &Streams, plan: &AlignPlan) {
        let carried = streams.longest_carried(plan);
        let unknown: Vec<f64> = streams
            .usable
            .iter()
            .enumerate()
            .map(|(row, usable)| f64::from(u8::from(!usable || !carried.contains(&row))))
            .collect();
        let unknown = self.gather(&unknown);
        for (usable, unknown) in self.usable.iter_mut().zip(unknown) {
            // Overlap below this share of a gyro row is rounding.
            *usable &= unknown < 1e-3;
        }
    }
}
