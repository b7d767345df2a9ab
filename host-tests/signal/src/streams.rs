//! The recording resampled for the diagnosis: every channel on the gyros' rows.
//!
//! Enters: [`Recording`] and [`Model`]. Leaves: [`Streams`], row k covering \[start + k/rate, start + (k+1)/rate),
//! increments in rad (body axes), slow channels interpolated to the row's middle (channels.rs), and a mask of the rows with
//! all needed channels measured.
//!
//! At rest on the Earth the case's motion is the Earth's rotation (still.rs), and no reference is needed.
//!
//! The first row of a dithered recording is dropped: its increment needs the pickoff before it. Deliberately not here:
//! filling gaps with anything but a straight line (those rows are masked), and references slower than the gyros.

use super::accelerometer_rows::Rows;
pub use super::axes::{AXES, Triad, add, add_triad, each_axis, weighted_sum};
use super::channels::{Finder, Grid, bridge_gaps};
use super::known_channels;
use super::piece::Piece;
use super::still::{self, AtRest};
use super::unmeasured::Unmeasured;
use rlg_model::{Model, MotionSource};
use rlg_plan::AlignPlan;
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Clock, Quantity, Recording, Site, Table};

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
    unmeasured: Unmeasured,
}

impl Streams {
    /// Puts the recording's channels on the gyros' rows.
    pub fn align(
        recording: &Recording,
        model: &Model,
        plan: &AlignPlan,
    ) -> Result<Self, InputError> {
        Self::align_with(recording, model, false, plan)
    }

    /// Puts the channels on the gyros' rows without a reference: the case's motion stays zero, to be filled in from the
    /// gyros.
    pub fn align_without_reference(
        recording: &Recording,
        model: &Model,
        plan: &AlignPlan,
    ) -> Result<Self, InputError> {
        Self::align_with(recording, model, true, plan)
    }

    fn align_with(
        recording: &Recording,
        model: &Model,
        own_motion: bool,
        plan: &AlignPlan,
    ) -> Result<Self, InputError> {
        let file = recording.folder.join("recording.toml");
        let at_rest = !own_motion && model.motion == MotionSource::Static;
        let finder = Finder::new(recording);
        let gyro = finder.gyro(&file)?;
        gyro.expect_pulse_weights(&file, model)?;
        let (rate_hz, table_start_s) = gyro.clock;
        let dithered = gyro.quantity == Quantity::GyroCount;
        // Increments and rates carry no dither to strip (contract).
        let pickoff = finder.triad(&Quantity::DitherAngle).filter(|_| dithered);
        if dithered && pickoff.is_none() && model.dither.is_some() {
            return Err(InputError::new(
                &file,
                "the model has a dither pickoff, the recording none",
            )
            .channel("dither_angle")
            .expected("dither_angle channels on x, y and z"));
        }
        let reference = match at_rest || own_motion {
            true => None,
            false => Some(finder.triad(&Quantity::ReferenceIncrement).ok_or_else(|| {
                InputError::new(&file, "no reference to predict the gyros from")
                    .channel("reference_increment")
                    .expected(
                        "reference_increment channels on x, y and z, or a model with static motion",
                    )
            })?),
        };
        let skip = usize::from(pickoff.is_some());
        let table_rows = gyro.channels[0].values.len();
        if table_rows < skip + 2 {
            return Err(InputError::new(&file, "too few rows")
                .value(table_rows)
                .expected("at least 3 rows"));
        }
        let rows = table_rows - skip;
        let grid = Grid {
            rate_hz,
            start_s: table_start_s,
            rows: table_rows,
            plan,
        };

        let mut unmeasured = Unmeasured::default();
        let mut missing = |stem: &str, axis: usize, missing: Vec<bool>| {
            unmeasured.note(format!("{stem}_{}", AXES[axis]), missing);
        };
        let mut increments = |stem: &str,
                              channels: &[(&Channel, &Table); 3],
                              factor: &dyn Fn(usize) -> f64| {
            let mut triad: Triad = Default::default();
            for (axis, (channel, table)) in channels.iter().enumerate() {
                let all = grid.on_rows(&file, channel, table)?;
                let mut values: Vec<f64> = all[skip..].iter().map(|v| v * factor(axis)).collect();
                missing(
                    stem,
                    axis,
                    values.iter().map(|value| !value.is_finite()).collect(),
                );
                bridge_gaps(&mut values);
                triad[axis] = values;
            }
            Ok::<Triad, InputError>(triad)
        };
        let gyro_pairs = [0, 1, 2].map(|axis| (gyro.channels[axis], gyro.table));
        let sensed_rad = match gyro.quantity {
            Quantity::GyroCount => increments("gyro", &gyro_pairs, &|axis| {
                model.gyro.pulse_weight_rad[axis]
            })?,
            Quantity::GyroRate => increments("gyro", &gyro_pairs, &|_| 1.0 / rate_hz)?,
            _ => increments("gyro", &gyro_pairs, &|_| 1.0)?,
        };
        let case_rad: Triad = match &reference {
            Some(reference) => increments("reference", reference, &|_| 1.0)?,
            None => [0, 1, 2].map(|_| vec![0.0; rows]),
        };
        let pickoff_rad = match &pickoff {
            None => None,
            Some(channels) => {
                let mut triad: Triad = Default::default();
                for (axis, (channel, table)) in channels.iter().enumerate() {
                    let mut values = grid.on_rows(&file, channel, table)?;
                    let either = |pair: &[f64]| !pair[0].is_finite() || !pair[1].is_finite();
                    missing("dither", axis, values.windows(2).map(either).collect());
                    bridge_gaps(&mut values);
                    triad[axis] = values;
                }
                Some(triad)
            }
        };
        let measured: Vec<bool> = (0..rows)
            .map(|row| unmeasured.channel(row).is_none())
            .collect();
        let mut usable = measured.clone();
        let mut slow = |quantity: &Quantity| grid.slow(finder.triad(quantity)?, skip, &mut usable);
        let force_m_s2 = slow(&Quantity::SpecificForce).or_else(|| {
            let velocity = finder.triad(&Quantity::VelocityIncrement)?;
            let Clock::Uniform { rate_hz, .. } = velocity[0].1.clock else {
                return None;
            };
            let force = slow(&Quantity::VelocityIncrement)?;
            Some(force.map(|values| values.iter().map(|value| value * rate_hz).collect()))
        });
        let (temperature_k, magnetic_t) =
            (slow(&Quantity::Temperature), slow(&Quantity::MagneticField));
        let others = grid.others(recording, skip);
        let stamps_s = gyro.stamps_s().map(|stamps_s| stamps_s[skip..].to_vec());
        let start_s = table_start_s + skip as f64 / rate_hz;
        let gyro_rows = (rate_hz, start_s, rows);
        let mut streams = Self {
            accelerometers: Rows::new(recording, gyro_rows, &plan.accelerometers),
            site: recording.site,
            rate_hz,
            start_s,
            rows,
            reports_rates: gyro.quantity == Quantity::GyroRate,
            pulse_rad: if dithered {
                model.gyro.pulse_weight_rad
            } else {
                [0.0; 3]
            },
            sensed_rad,
            pickoff_rad,
            case_rad,
            reference_hz: None,
            own_motion,
            at_rest: None,
            stamps_s,
            force_m_s2,
            temperature_k,
            magnetic_t,
            others,
            usable,
            measured,
            piece: Piece {
                origin: None,
                recording: recording.name.clone(),
                segments: recording.segments.clone(),
                held_out: false,
            },
            unmeasured,
        };
        if at_rest {
            streams.stand_still(model, plan);
        } else {
            known_channels::apply(
                &mut streams.case_rad,
                &mut streams.pickoff_rad,
                &model.effects,
            );
        }
        Ok(streams)
    }

    /// Sets the case's motion to the Earth's rotation, estimated from the gyros' usable rows.
    fn stand_still(&mut self, model: &Model, plan: &AlignPlan) {
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
