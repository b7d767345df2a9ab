//! Figures of a navigated trajectory: attitude after the motion against before it, largest velocity.
//!
//! [`TrajectoryFigures`] are in degrees, arcsec and °/h as the names indicate; they are those of the paper's Tables 4 and
//! 5.
//!
//! The unit did not travel, so velocity and offset are errors. Its attitude did move: it is compared only at rest.

use nalgebra::Vector3;
use serde::Serialize;
use strapdown::EulerAngles;

use super::readings::Readings;
use super::trajectory::{Place, Trajectory};
use rlg_recording::Segment;

/// °/h in one rad/s, and arcseconds in one rad.
const DEG_H_PER_RAD_S: f64 = 180.0 / std::f64::consts::PI * 3600.0;

/// Averaging time at the end of a trajectory \[s\]: many periods of any vibration, little drift.
const END_S: f64 = 1.0;

/// Figures of one trajectory.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrajectoryFigures {
    /// Attitude estimated at rest \[°\].
    pub alignment: Angles,
    /// Mean rate at rest less the Earth's, north, east, down \[°/h\].
    pub rate_residual_deg_h: [f64; 3],
    /// Mean specific force at rest less gravity \[m/s²\].
    pub force_residual_m_s2: f64,
    /// Mean attitude of each later stretch of rest, less the alignment's \[°\].
    pub attitude_change_at_rest: Vec<AtRest>,
    /// Largest north and east velocity, either sign \[m/s\].
    pub max_velocity_m_s: [f64; 2],
    /// North and east velocity at the end \[m/s\].
    pub final_velocity_m_s: [f64; 2],
    /// North and east offset from the site at the end \[m\].
    pub final_offset_m: [f64; 2],
    /// Error against the reference over the last second, about north, east, down \[arcsec\].
    pub final_attitude_error_arcsec: Option<[f64; 3]>,
}

/// Angles \[°\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Angles {
    pub roll_deg: f64,
    pub pitch_deg: f64,
    pub heading_deg: f64,
}

/// Stretch of rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AtRest {
    /// Segment name.
    pub segment: String,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// Mean attitude less the alignment's.
    pub change: Angles,
}

impl Angles {
    fn from_rad([roll, pitch, heading]: [f64; 3]) -> Self {
        Self {
            roll_deg: roll.to_degrees(),
            pitch_deg: pitch.to_degrees(),
            heading_deg: heading.to_degrees(),
        }
    }
}

impl TrajectoryFigures {
    /// Computes the figures of a trajectory through `readings`.
    pub fn of(
        trajectory: &Trajectory,
        place: &Place,
        readings: &Readings,
        segments: &[Segment],
    ) -> Self {
        let begin = EulerAngles::of(&trajectory.alignment.ned_from_body);
        let changes: Vec<[f64; 3]> = trajectory.attitude_change_rad().collect();
        let at_rest = segments
            .iter()
            .filter(|segment| segment.kind == "still")
            .filter_map(|segment| {
                let periods = readings.periods_in(segment.start_s, segment.end_s);
                let first = periods.start.checked_sub(trajectory.first_period)?;
                let of_rest =
                    changes.get(first..periods.end.checked_sub(trajectory.first_period)?)?;
                let count = of_rest.len();
                (count > 0).then(|| AtRest {
                    segment: segment.name.clone(),
                    start_s: segment.start_s,
                    end_s: segment.end_s,
                    change: Angles::from_rad([0, 1, 2].map(|angle| {
                        of_rest.iter().map(|change| change[angle]).sum::<f64>() / count as f64
                    })),
                })
            })
            .collect();
        let last = trajectory.solutions.last();
        let largest = |axis: usize| {
            let values = trajectory
                .solutions
                .iter()
                .map(|s| s.velocity_m_s[axis].abs());
            values.fold(0.0, f64::max)
        };
        let final_velocity_m_s = last.map_or([0.0; 2], |s| [s.velocity_m_s.x, s.velocity_m_s.y]);
        Self {
            alignment: Angles::from_rad([begin.roll_rad, begin.pitch_rad, begin.heading_rad]),
            rate_residual_deg_h: (trajectory.rate_residual_rad_s * DEG_H_PER_RAD_S).into(),
            force_residual_m_s2: trajectory.force_residual_m_s2,
            attitude_change_at_rest: at_rest,
            max_velocity_m_s: [largest(0), largest(1)],
            final_velocity_m_s,
            final_offset_m: last.map_or([0.0; 2], |s| s.offset_m(place.latitude_rad, 0.0)),
            final_attitude_error_arcsec: final_error_arcsec(trajectory, readings.period_s),
        }
    }
}

/// Returns `None` without a reference, or if it was not measured to the end.
fn final_error_arcsec(trajectory: &Trajectory, period_s: f64) -> Option<[f64; 3]> {
    let errors = trajectory.attitude_error_rad.as_ref()?;
    let count = ((END_S / period_s).round() as usize).clamp(1, errors.len().max(1));
    let end = &errors[errors.len().saturating_sub(count)..];
    let mean = end.iter().sum::<Vector3<f64>>() / count as f64;
    let mean = mean * DEG_H_PER_RAD_S;
    mean.iter()
        .all(|value| value.is_finite())
        .then(|| mean.into())
}
