//! Computes the chain in f64, written from the paper's equations: the reference for the firmware's number systems.
//!
//! It takes, per period T, the sensed increment of each gyro \[rad\], the pickoff angle at the period's end \[rad\] and
//! the velocity increment of each accelerometer \[m/s\]. It gives the case's increment \[rad\], body frame, and every N
//! periods its rotation vector \[rad\] and velocity increment \[m/s\].
//!
//! Equations, D the sensed increment less the block's (`strip`), all per period:
//! 1. v = (1 − s) D − b T, the bracket of Eq. (7);
//! 2. D = M₀v, M₀ the matrix of Eq. (7) with ε_ij0; α̂T² of the period three before, from the increments about it
//!    (`acceleration`);
//! 3. δ_ij = −K_ij α̂_j, or the tilt of a block that rings, Eq. (6) with the tilt of gyro i about axis j as a right-hand rotation,
//!    and the gyros' excess angle by these tilts over that period's D (`flexure`);
//! 4. case increment = M₀ (v − that excess), Eq. (7): the period's own angle at once, the correction of the period three
//!    before with it;
//! 5. the body's velocity increment, size effect off (`velocity`);
//! 6. errors that only some builds correct (`terms`), on v before 2 (of blocks, on D), on the velocity increment before its
//!    size effect;
//! 7. rotation vector and velocity increment over N periods by two-speed coning and sculling (`coning`).
//!
//! The strip's taps are followed in windows (`adaptation`).
//!
//! The first period has no pickoff reading before it: it primes the strip and contributes neither rotation
//! nor velocity. Before the second the rate is taken as constant.
//!
//! Lost periods ([`ReferenceChain::process_lost`]) pass without an increment. The next reading's counts cover them
//! too (the counters run on), so that the angle is kept; the motion within them is not known, and there is no
//! dynamic term, no size effect and no coning within it. The period after it starts as the second did; the corrections of
//! the three periods before the gap are left out.
//!
//! Independent of the firmware core and of the simulator: it imports neither.
//!
//! Out of scope: any rounding; ranges and health. Numbers are f64 from end to end.

pub mod acceleration;
pub mod adaptation;
pub mod coning;
pub mod flexure;
pub mod strip;
pub mod terms;
pub mod velocity;

use acceleration::Latest;
use adaptation::{Adaptation, AdaptationCalibration};
use coning::{Coning, Output};
use flexure::{Flexure, FlexureCalibration};
use nalgebra::{Matrix3, Vector3};
use strip::Strip;
use terms::{TermCalibration, Terms};
use velocity::AccelerometerCalibration;

/// Six numbers ij, gyro i and axis j.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Six {
    pub xy: f64,
    pub xz: f64,
    pub yx: f64,
    pub yz: f64,
    pub zx: f64,
    pub zy: f64,
}

/// Calibration of the triad: errors that the chain corrects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// b \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// s of Eq. (7) \[1\].
    pub scale_error: [f64; 3],
    /// ε_ij0 \[rad\].
    pub installation_rad: Six,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// The pickoff shows the block this much late \[s\].
    pub pickoff_delay_s: [f64; 3],
    /// Settings of the strip's adaptation.
    pub adaptation: AdaptationCalibration,
    /// The accelerometers, where there are any.
    pub accelerometers: Option<AccelerometerCalibration>,
    /// Errors that only some builds of the chain correct.
    pub terms: TermCalibration,
    /// Tilts under acceleration.
    pub flexure: FlexureCalibration,
    /// T \[s\].
    pub period_s: f64,
    /// N \[periods\].
    pub periods_per_output: usize,
}

/// The readings of one period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Angle that each gyro sensed, its block's dither included \[rad\].
    pub sensed_rad: [f64; 3],
    /// Pickoff angles at the end \[rad\].
    pub pickoff_rad: [f64; 3],
    /// Velocity increments of the accelerometers \[m/s\].
    pub velocity_m_s: [f64; 3],
}

/// The chain's result for one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Case increment \[rad\], body frame.
    pub case_rad: Vector3<f64>,
    /// Rotation and velocity over the last N periods, at every N-th period.
    pub output: Option<Output>,
}

/// The chain with its state.
#[derive(Debug, Clone)]
pub struct ReferenceChain {
    calibration: Calibration,
    strip: Strip,
    adaptation: Adaptation,
    acceleration: Latest,
    coning: Coning,
    terms: Terms,
    flexure: Flexure,
    lost_periods: usize,
}

impl ReferenceChain {
    /// The chain before the first period.
    pub fn new(calibration: &Calibration) -> Self {
        let known = calibration;
        let strip = Strip::new(
            known.pickoff_gain,
            known.pickoff_delay_s,
            known.adaptation.frequency_hz,
            known.period_s,
        );
        Self {
            calibration: *known,
            adaptation: Adaptation::new(
                &known.adaptation,
                strip.phasor(),
                known.period_s,
                known.periods_per_output,
            ),
            strip,
            acceleration: Latest::default(),
            coning: Coning::new(known.periods_per_output),
            terms: Terms::new(&known.terms, known.period_s),
            flexure: Flexure::new(&known.flexure, known.period_s),
            lost_periods: 0,
        }
    }

    /// The strip's present a and b.
    pub fn phasor(&self) -> strip::Phasor {
        self.strip.phasor()
    }

    /// Sets the gyros' temperatures \[K\] and their derivatives \[K/s\].
    pub fn temperature(&mut self, now_k: [f64; 3], rate_k_s: [f64; 3]) {
        self.terms.temperature(now_k, rate_k_s);
    }

    /// Sets the magnetic flux density, body frame \[T\].
    pub fn magnetic_field(&mut self, now_t: [f64; 3]) {
        self.terms.magnetic_field(now_t);
    }

    /// Advances by periods whose reading did not come; gives the output if an interval ends in them.
    pub fn process_lost(&mut self, periods: usize) -> Option<Output> {
        self.lost_periods += periods;
        let ends = self.coning.ends_in(periods);
        (0..ends).for_each(|_| self.end_output());
        self.coning.advance_time(periods)
    }

    /// Processes one period, and the lost periods before it.
    pub fn process(&mut self, reading: &Reading) -> Step {
        let known = self.calibration;
        let pickoff = Vector3::from(reading.pickoff_rad);
        let lost = std::mem::take(&mut self.lost_periods);
        let elapsed_s = (lost + 1) as f64 * known.period_s;

        let beyond = |strip: &Strip| {
            let known = &self.calibration;
            let angle = strip.angle();
            (known.terms).of_blocks(&angle, known.pickoff_gain, known.scale_error)
        };
        let before = beyond(&self.strip);
        let block = if lost == 0 {
            self.strip.add(pickoff)
        } else {
            self.strip.add_after_gap(pickoff)
        };
        let (case, velocity) = match block {
            None => {
                self.adaptation.prime(pickoff);
                (Vector3::zeros(), Vector3::zeros())
            }
            Some(block) => {
                let beyond = beyond(&self.strip) - before;
                let stripped = Vector3::from(reading.sensed_rad) - block - beyond;
                let v = self.without_scale_error(&stripped)
                    - Vector3::from(known.bias_rad_s) * elapsed_s;
                let velocity = known.accelerometers.map_or(Vector3::zeros(), |known| {
                    known.increment(reading.velocity_m_s, elapsed_s)
                });
                if lost == 0 {
                    self.adaptation.add(v, pickoff);
                    let corrected = self.terms.correct(v, velocity);
                    let shifted = equation_7(&known.installation_rad) * corrected.shifted_rad;
                    self.coning.shift(shifted, corrected.shifted_m_s);
                    self.compensate(corrected.angle_rad, corrected.velocity_m_s)
                } else {
                    self.adaptation.disturb();
                    self.adaptation.prime(pickoff);
                    self.acceleration = Latest::default();
                    self.flexure.forget();
                    let v = self.terms.correct_after_gap(v, velocity, (lost + 1) as f64);
                    (equation_7(&known.installation_rad) * v, velocity)
                }
            }
        };
        if lost == 0 {
            self.coning.add(case, velocity);
        } else {
            self.coning.add_after_gap(case, velocity);
        }
        (0..self.coning.ends_in(1)).for_each(|_| self.end_output());
        Step {
            case_rad: case,
            output: self.coning.advance_time(1),
        }
    }

    /// The case's increment and the body's, from v and from the accelerometers' readings.
    fn compensate(
        &mut self,
        v: Vector3<f64>,
        velocity_m_s: Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let known = &self.calibration;
        let case_from_sensed = equation_7(&known.installation_rad);
        let increment = case_from_sensed * v;
        let turn_per_period2 = self.acceleration.add(increment);
        let more = self.flexure.add(increment);
        let case = case_from_sensed * (v - more);
        let size = known
            .accelerometers
            .map_or(Vector3::zeros(), |accelerometers| {
                accelerometers.size_effect(&case, &turn_per_period2, known.period_s)
            });
        (case, velocity_m_s - size)
    }

    /// Angles about the sensing axes with the scale error corrected \[rad\]: (1 − s) D.
    fn without_scale_error(&self, sensed: &Vector3<f64>) -> Vector3<f64> {
        sensed - Vector3::from(self.calibration.scale_error).component_mul(sensed)
    }

    /// Closes the adaptation's window if it ends with this output. The step of the block's angle that new taps cause is
    /// added as an angle.
    fn end_output(&mut self) {
        let gain = Vector3::from(self.calibration.pickoff_gain);
        let Some(phasor) = self.adaptation.end_output(&gain, self.strip.phasor()) else {
            return;
        };
        let block = self.strip.turn_taps(phasor);
        let case =
            equation_7(&self.calibration.installation_rad) * self.without_scale_error(&block);
        self.coning.shift(-case, Vector3::zeros());
    }
}

/// The matrix of Eq. (7): case from sensed.
fn equation_7(eps: &Six) -> Matrix3<f64> {
    Matrix3::new(
        1.0, eps.xz, eps.xy, //
        eps.yz, 1.0, eps.yx, //
        eps.zy, eps.zx, 1.0,
    )
}
