//! Alignment of a recording's channels on the gyros' rows.
//!
//! Enters: [`Recording`] and [`Model`]. Leaves: [`Streams`], with slow channels interpolated to the row's middle
//! (channels.rs), and a mask of the rows with all needed channels measured.
//!
//! The first row of a dithered recording is dropped: its increment needs the pickoff before it. Deliberately not here:
//! filling gaps with anything but a straight line (those rows are masked), and references slower than the gyros.

use std::path::PathBuf;

use super::accelerometer_rows::Rows;
use super::axes::{AXES, Triad};
use super::channels::{Finder, Grid, GyroTable, OfAxes, bridge_gaps};
use super::known_channels;
use super::piece::Piece;
use super::streams::Streams;
use super::unmeasured::Unmeasured;
use rlg_model::{Model, MotionSource};
use rlg_plan::AlignPlan;
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording};

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
        let at_rest = !own_motion && model.motion == MotionSource::Static;
        let needs_reference = !at_rest && !own_motion;
        let mut table = Alignment::new(recording, model, needs_reference, plan)?;
        let sensed_rad = table.sensed_rad(model)?;
        let case_rad = table.case_rad()?;
        let pickoff_rad = table.pickoff_rad()?;
        let rows = sensed_rad[0].len();
        let measured: Vec<bool> = (0..rows)
            .map(|row| table.unmeasured.channel(row).is_none())
            .collect();
        let mut usable = measured.clone();
        let force_m_s2 = table.force_m_s2(&mut usable);
        let temperature_k = table.slow(&Quantity::Temperature, &mut usable);
        let magnetic_t = table.slow(&Quantity::MagneticField, &mut usable);
        let piece = Piece {
            origin: None,
            recording: recording.name.clone(),
            segments: recording.segments.clone(),
            held_out: false,
        };
        let Alignment {
            gyro, grid, skip, ..
        } = &table;
        let rate_hz = grid.rate_hz;
        let start_s = grid.start_s + *skip as f64 / rate_hz;
        let mut streams = Self {
            accelerometers: Rows::new(recording, (rate_hz, start_s, rows), &plan.accelerometers),
            site: recording.site,
            reports_rates: gyro.quantity == Quantity::GyroRate,
            pulse_rad: match gyro.quantity {
                Quantity::GyroCount => model.gyro.pulse_weight_rad,
                _ => [0.0; 3],
            },
            sensed_rad,
            pickoff_rad,
            case_rad,
            own_motion,
            stamps_s: gyro.stamps_s().map(|stamps_s| stamps_s[*skip..].to_vec()),
            force_m_s2,
            temperature_k,
            magnetic_t,
            others: grid.others(recording, *skip),
            measured,
            unmeasured: table.unmeasured,
            ..Self::bare(rate_hz, start_s, usable, &piece)
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
}

/// Channels of a recording on the rows of the gyros' table.
struct Alignment<'a> {
    file: PathBuf,
    finder: Finder<'a>,
    gyro: GyroTable<'a>,
    pickoff: Option<OfAxes<'a>>,
    reference: Option<OfAxes<'a>>,
    grid: Grid<'a>,
    /// Rows of the table before the first row.
    skip: usize,
    unmeasured: Unmeasured,
}

impl<'a> Alignment<'a> {
    /// Finds the channels.
    ///
    /// # Errors
    /// A needed channel is absent, or the table has less than two rows.
    fn new(
        recording: &'a Recording,
        model: &Model,
        needs_reference: bool,
        plan: &'a AlignPlan,
    ) -> Result<Self, InputError> {
        let file = recording.folder.join("recording.toml");
        let finder = Finder::new(recording);
        let gyro = finder.gyro(&file)?;
        gyro.expect_pulse_weights(&file, model)?;
        let dithered = gyro.quantity == Quantity::GyroCount;
        // Increments and rates carry no dither to strip (contract).
        let pickoff = finder.triad(&Quantity::DitherAngle).filter(|_| dithered);
        if dithered && pickoff.is_none() && model.dither.is_some() {
            let what = "the model has a dither pickoff, the recording none";
            return Err(InputError::new(&file, what)
                .channel("dither_angle")
                .expected("dither_angle channels on x, y and z"));
        }
        let found = || {
            let found = finder.triad(&Quantity::ReferenceIncrement);
            found.ok_or_else(|| {
                InputError::new(&file, "no reference to predict the gyros from")
                    .channel("reference_increment")
                    .expected(
                        "reference_increment channels on x, y and z, or a model with static motion",
                    )
            })
        };
        let reference = needs_reference.then(found).transpose()?;
        let skip = usize::from(pickoff.is_some());
        let rows = gyro.channels[0].values.len();
        if rows < skip + 2 {
            return Err(InputError::new(&file, "too few rows")
                .value(rows)
                .expected("at least 3 rows"));
        }
        let (rate_hz, start_s) = gyro.clock;
        Ok(Self {
            grid: Grid {
                rate_hz,
                start_s,
                rows,
                plan,
            },
            file,
            finder,
            gyro,
            pickoff,
            reference,
            skip,
            unmeasured: Unmeasured::default(),
        })
    }

    /// Sensed increments \[rad\], bridged over unmeasured rows.
    fn sensed_rad(&mut self, model: &Model) -> Result<Triad, InputError> {
        let pairs = self.gyro.channels.map(|channel| (channel, self.gyro.table));
        let rate_hz = self.grid.rate_hz;
        let factors = match self.gyro.quantity {
            Quantity::GyroCount => model.gyro.pulse_weight_rad,
            Quantity::GyroRate => [1.0 / rate_hz; 3],
            _ => [1.0; 3],
        };
        self.increments("gyro", pairs, factors)
    }

    /// Increments of the reference \[rad\], bridged over unmeasured rows; zero without one.
    fn case_rad(&mut self) -> Result<Triad, InputError> {
        match self.reference {
            Some(reference) => self.increments("reference", reference, [1.0; 3]),
            None => Ok([0, 1, 2].map(|_| vec![0.0; self.grid.rows - self.skip])),
        }
    }

    /// Values of three channels on the rows times their factors; unmeasured rows are noted and bridged.
    fn increments(
        &mut self,
        stem: &str,
        channels: OfAxes,
        factors: [f64; 3],
    ) -> Result<Triad, InputError> {
        let mut triad = Triad::default();
        for (axis, (channel, table)) in channels.into_iter().enumerate() {
            let all = self.grid.on_rows(&self.file, channel, table)?;
            let own = all[self.skip..].iter();
            let mut values: Vec<f64> = own.map(|value| value * factors[axis]).collect();
            let missing = values.iter().map(|value| !value.is_finite()).collect();
            self.unmeasured
                .note(format!("{stem}_{}", AXES[axis]), missing);
            bridge_gaps(&mut values);
            triad[axis] = values;
        }
        Ok(triad)
    }

    /// Angles of the pickoffs at the ends of all rows of the table \[rad\]; a row is measured if both its ends are.
    fn pickoff_rad(&mut self) -> Result<Option<Triad>, InputError> {
        let Some(channels) = self.pickoff else {
            return Ok(None);
        };
        let mut triad = Triad::default();
        for (axis, (channel, table)) in channels.into_iter().enumerate() {
            let mut values = self.grid.on_rows(&self.file, channel, table)?;
            let either = |pair: &[f64]| !pair[0].is_finite() || !pair[1].is_finite();
            let missing = values.windows(2).map(either).collect();
            self.unmeasured
                .note(format!("dither_{}", AXES[axis]), missing);
            bridge_gaps(&mut values);
            triad[axis] = values;
        }
        Ok(Some(triad))
    }

    /// Slow channels at the middles of the rows, see [`Grid::slow`].
    fn slow(&self, quantity: &Quantity, usable: &mut [bool]) -> Option<Triad> {
        self.grid
            .slow(self.finder.triad(quantity)?, self.skip, usable)
    }

    /// Specific force at the middles of the rows \[m/s²\], measured or from increments of velocity.
    fn force_m_s2(&self, usable: &mut [bool]) -> Option<Triad> {
        self.slow(&Quantity::SpecificForce, usable).or_else(|| {
            let velocity = self.finder.triad(&Quantity::VelocityIncrement)?;
            let Clock::Uniform { rate_hz, .. } = velocity[0].1.clock else {
                return None;
            };
            let force = self.slow(&Quantity::VelocityIncrement, usable)?;
            Some(force.map(|values| values.iter().map(|value| value * rate_hz).collect()))
        })
    }
}
