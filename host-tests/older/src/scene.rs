//! What a hypothesis may look at: the aligned channels and the motion derived from them.
//!
//! Enters: [`Streams`]. Leaves: [`Scene`] with body rate ω \[rad/s\], angular acceleration α \[rad/s²\] at row
//! middles, dither increments \[rad\], and spectra for further derivatives and delays.

use std::ops::Range;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use realfft::num_complex::Complex64;
use rlg_signal::derivatives::row_means;

use super::motion::{
    AngleNoise, NoiseShape, Reading, RowNoise, Spectra, clear_in_time, clear_together,
    last_clear_hz, strongest_hz,
};
use super::pieces::Piece;
use super::streams::{Streams, Triad, each_axis};

/// Temperature changes slower than this in a gyro block; faster ones are converter noise.
const THERMAL_EDGE_HZ: f64 = 0.5;

/// The recording and its motion.
pub struct Scene {
    /// The channels.
    pub streams: Streams,
    /// Where the motion's spectrum ends \[Hz\].
    pub motion_edge_hz: f64,
    /// Where each block swings \[Hz\], where there are pickoffs.
    pub dither_hz: Option<[f64; 3]>,
    /// Body rate ω at row middles \[rad/s\].
    pub rate_rad_s: Triad,
    /// Angular acceleration α at row middles \[rad/s²\].
    pub acceleration_rad_s2: Triad,
    /// Scale error of the model, for the 1/(1 − s_i) of the sensed increment.
    pub scale_error: [f64; 3],
    /// Rates along the sensing axes from body rates: the inverse of Eq. (7)'s matrix; identity until set.
    pub sensing_from_body: Matrix3<f64>,
    body_from_start: Vec<UnitQuaternion<f64>>,
    case: [Spectra; 3],
    pickoff: Option<[Spectra; 3]>,
    force: Option<[Spectra; 3]>,
    temperature: Option<[Spectra; 3]>,
}

impl Scene {
    /// Derives the motion. `declared` is the noise of what it is read from, if that is known.
    pub fn new(streams: Streams, declared: Option<AngleNoise>, scale_error: [f64; 3]) -> Self {
        let rate_hz = streams.rate_hz;
        let pieces: Vec<Range<usize>> = streams.pieces.iter().map(|one| one.rows.clone()).collect();
        let edge_hz = last_clear_hz(
            &streams.case_rad,
            &pieces,
            rate_hz,
            NoiseShape::Angle,
            declared.map(|noise| noise.white_rad.powi(2)),
        );
        let noise =
            [0, 1, 2].map(|axis: usize| RowNoise::of(&streams.case_rad[axis], rate_hz, declared));
        let case = each_axis(|axis| {
            let moved = clear_in_time(&streams.case_rad[axis], &pieces, rate_hz, noise[axis]);
            Spectra::new(&moved, &pieces, rate_hz, edge_hz)
        });
        let case = clear_together(case, noise);
        let read = |derivative| {
            [0, 1, 2].map(|axis: usize| {
                let mut values = case[axis].read(Reading {
                    derivative,
                    ahead_s: 0.0,
                    undo_row_mean: true,
                });
                values.iter_mut().for_each(|value| *value *= rate_hz);
                values
            })
        };
        let spectra = |triad: &Option<Triad>, pieces: &[Range<usize>], edge_hz: f64| {
            let triad = triad.as_ref()?;
            Some([0, 1, 2].map(|axis| Spectra::new(&triad[axis], pieces, rate_hz, edge_hz)))
        };
        // The pickoff's angles stand at the rows' ends, after the one before the first row.
        let angles: Vec<Range<usize>> = pieces
            .iter()
            .map(|rows| (if rows.start == 0 { 0 } else { rows.start + 1 })..rows.end + 1)
            .collect();
        let whole_band_hz = rate_hz;
        let force_edge_hz = streams.force_m_s2.as_ref().map_or(edge_hz, |force| {
            last_clear_hz(force, &pieces, rate_hz, NoiseShape::White, None)
        });
        Self {
            motion_edge_hz: edge_hz,
            dither_hz: streams
                .pickoff_rad
                .as_ref()
                .map(|pickoff| each_axis(|axis| strongest_hz(&pickoff[axis], rate_hz))),
            rate_rad_s: read(0),
            acceleration_rad_s2: read(1),
            pickoff: spectra(&streams.pickoff_rad, &angles, whole_band_hz),
            force: spectra(&streams.force_m_s2, &pieces, force_edge_hz),
            temperature: spectra(&streams.temperature_k, &pieces, THERMAL_EDGE_HZ),
            case,
            scale_error,
            sensing_from_body: Matrix3::identity(),
            body_from_start: integrate_attitude(&streams.case_rad, &streams.pieces),
            streams,
        }
    }

    /// Temperature of the first row \[K\], in the band in which a block changes.
    pub fn start_temperature_k(&self) -> Option<[f64; 3]> {
        let reading = Reading {
            derivative: 0,
            ahead_s: 0.0,
            undo_row_mean: false,
        };
        let spectra = self.temperature.as_ref()?;
        Some([0, 1, 2].map(|axis: usize| spectra[axis].read(reading)[0]))
    }

    /// Attitude at a row's beginning against that at the first row's recording's start.
    pub fn start_from_body(&self, row: usize) -> UnitQuaternion<f64> {
        match row.checked_sub(1) {
            Some(before) => self.body_from_start[before].inverse(),
            None => {
                let origin = self.streams.pieces[0].origin.as_ref();
                origin.map_or(UnitQuaternion::identity(), |one| one.start_from_body)
            }
        }
    }

    /// One row's period \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.streams.rate_hz
    }

    /// d²ω/dt² at row middles \[rad/s³\].
    pub fn jerk_rad_s3(&self, axis: usize) -> Vec<f64> {
        self.rate_derived(axis, 2)
    }

    /// The `derivative`-th derivative of ω at row middles.
    pub fn rate_derived(&self, axis: usize, derivative: i32) -> Vec<f64> {
        let reading = Reading {
            derivative,
            ahead_s: 0.0,
            undo_row_mean: true,
        };
        let rate_hz = self.streams.rate_hz;
        self.case[axis]
            .read(reading)
            .into_iter()
            .map(|value| value * rate_hz)
            .collect()
    }

    /// The case's increments `ahead_s` later than the row says, differentiated `derivative` times.
    pub fn case_ahead_rad(&self, axis: usize, derivative: i32, ahead_s: f64) -> Vec<f64> {
        self.case[axis].read(Reading {
            derivative,
            ahead_s,
            undo_row_mean: false,
        })
    }

    /// The case's increments behind a linear system \[rad\]; `response` at a frequency \[Hz\].
    pub fn case_through_rad(&self, axis: usize, response: &dyn Fn(f64) -> Complex64) -> Vec<f64> {
        let reading = Reading {
            derivative: 0,
            ahead_s: 0.0,
            undo_row_mean: false,
        };
        self.case[axis].read_through(reading, response)
    }

    /// Angular acceleration at row middles behind a linear system \[rad/s²\].
    pub fn acceleration_through_rad_s2(
        &self,
        axis: usize,
        response: &dyn Fn(f64) -> Complex64,
    ) -> Vec<f64> {
        let reading = Reading {
            derivative: 1,
            ahead_s: 0.0,
            undo_row_mean: true,
        };
        let mut values = self.case[axis].read_through(reading, response);
        let rate_hz = self.streams.rate_hz;
        values.iter_mut().for_each(|value| *value *= rate_hz);
        values
    }

    /// Increment of the block relative to its case over each row \[rad\], as the pickoff says.
    pub fn dither_increment_rad(&self, axis: usize) -> Option<Vec<f64>> {
        let pickoff = self.streams.pickoff_rad.as_ref()?;
        Some(
            pickoff[axis]
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .collect(),
        )
    }

    /// The same `ahead_s` later, of the pickoff's angle differentiated `derivative` times.
    pub fn dither_ahead_rad(&self, axis: usize, derivative: i32, ahead_s: f64) -> Option<Vec<f64>> {
        let spectrum = &self.pickoff.as_ref()?[axis];
        let angle = spectrum.read(Reading {
            derivative,
            ahead_s,
            undo_row_mean: false,
        });
        Some(angle.windows(2).map(|pair| pair[1] - pair[0]).collect())
    }

    /// Specific force at row middles \[m/s²\], in the band of the motion.
    pub fn force_m_s2(&self, axis: usize, derivative: i32) -> Option<Vec<f64>> {
        Some(self.force.as_ref()?[axis].read(Reading {
            derivative,
            ahead_s: 0.0,
            undo_row_mean: false,
        }))
    }

    /// Temperature since the start \[K\] (derivative 0) or its rate of change \[K/s\] (derivative 1).
    pub fn temperature_change_k(&self, axis: usize, derivative: i32) -> Option<Vec<f64>> {
        let reading = Reading {
            derivative,
            ahead_s: 0.0,
            undo_row_mean: false,
        };
        let mut values = self.temperature.as_ref()?[axis].read(reading);
        if derivative == 0 {
            for piece in &self.streams.pieces {
                let values = &mut values[piece.rows.clone()];
                let origin = piece
                    .origin
                    .as_ref()
                    .and_then(|origin| origin.temperature_k);
                let start = origin.map_or(values[0], |temperature_k| temperature_k[axis]);
                values.iter_mut().for_each(|value| *value -= start);
            }
        }
        Some(values)
    }

    /// Component along body `axis` of a unit vector fixed in space that lay along body axis `at_start`.
    pub fn space_vector_in_body(&self, at_start: usize, axis: usize) -> Vec<f64> {
        self.body_from_start
            .iter()
            .map(|body_from_start| {
                let rotation: Matrix3<f64> = *body_from_start.to_rotation_matrix().matrix();
                rotation[(axis, at_start)]
            })
            .collect()
    }

    /// The mean, fixed in space as the body lay at the start, of increments that the gyros sensed \[rad/s\].
    pub fn mean_rate_in_space_rad_s(&self, sensed_rad: &Triad) -> Vector3<f64> {
        let rows = self.streams.usable.iter().enumerate();
        let (sum, count) = rows.filter(|(_, usable)| **usable).fold(
            (Vector3::zeros(), 0.0),
            |(sum, count), (row, _)| {
                let rate = Vector3::from_fn(|axis, _| {
                    sensed_rad[axis][row] * (1.0 - self.scale_error[axis]) / self.period_s()
                });
                (
                    sum + self.body_from_start[row].inverse() * rate,
                    count + 1.0,
                )
            },
        );
        sum / count
    }

    /// What a rate added to gyro `axis`, known at the rows' middles \[rad/s\], adds to its sensed increment \[rad\].
    pub fn sensed_from_rate_at_middles(
        &self,
        axis: usize,
        rate_rad_s: impl Iterator<Item = f64>,
    ) -> Vec<f64> {
        let at_middles: Vec<f64> = rate_rad_s.collect();
        self.sensed_from_rate(axis, row_means(&at_middles).into_iter())
    }

    /// What a rate added to gyro `axis`, its mean over each row \[rad/s\], adds to its sensed increment \[rad\]: × T/(1 − s_i).
    pub fn sensed_from_rate(&self, axis: usize, rate_rad_s: impl Iterator<Item = f64>) -> Vec<f64> {
        let factor = self.period_s() / (1.0 - self.scale_error[axis]);
        rate_rad_s.map(|rate| rate * factor).collect()
    }
}

/// Attitude at each row's end against the beginning, from the increments alone: good to what coning
/// within a row would add (parts in 1e4 of the angle), plenty for carrying a vector along.
fn integrate_attitude(case_rad: &Triad, pieces: &[Piece]) -> Vec<UnitQuaternion<f64>> {
    let mut start_from_body = UnitQuaternion::identity();
    (0..case_rad[0].len())
        .map(|row| {
            if let Some(piece) = pieces.iter().find(|piece| piece.rows.start == row) {
                let origin = piece.origin.as_ref();
                start_from_body =
                    origin.map_or(UnitQuaternion::identity(), |one| one.start_from_body);
            }
            let turn = Vector3::new(case_rad[0][row], case_rad[1][row], case_rad[2][row]);
            start_from_body *= UnitQuaternion::from_scaled_axis(turn);
            start_from_body.inverse()
        })
        .collect()
}

/// How a tilt of gyro `axis` about body axis `about` changes what it senses: (k, sign) for sign · δ · ω_k.
/// The tilted axis is e_i + δ e_j × e_i (physics §1: x: +δ_xz ω_y − δ_xy ω_z, and cyclic).
pub fn tilt_senses(axis: usize, about: usize) -> (usize, f64) {
    debug_assert_ne!(
        axis, about,
        "a gyro does not notice a turn about its own axis"
    );
    let other = 3 - axis - about;
    // e_j × e_i = sign · e_k, positive when (j, i, k) is cyclic.
    let sign = if (about + 1) % 3 == axis { 1.0 } else { -1.0 };
    (other, sign)
}
