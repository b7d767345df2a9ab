//! The chain's flexure compensation against the true motion: attitude by quaternions from analytic rates, tilting sensing
//! axes integrated on a fine grid (`firmware_tests::sensing_block`).
//!
//! A drift is *left* if the chain on the flexing unit drifts otherwise than the same chain without flexure on a stiff unit
//! under the same motion, so that residuals of the coning algorithm itself do not count. Tables print both.

mod predicted;
mod simulator;

mod coning;
mod dithered;
mod in_phase;
mod random;
mod spin;

use firmware_tests::sensing_block::measure::{Drift, attitude_error};
use firmware_tests::sensing_block::{Flexure, Motion, Recording, Unit};
use trueaxis::{F32, Fixed, NumberSystem};

/// Sample rate \[Hz\].
const RATE_HZ: f64 = 4000.0;

/// Time from which drifts are measured \[s\]: the motion has risen to its full size, and the ringing has decayed.
const FROM_S: f64 = 1.0;

/// K of every pair alike \[s²\].
const EQUAL_S2: [f64; 6] = [70e-9; 6];

/// K with a difference of 60e-9 s² in each gyro's pair.
const UNEQUAL_S2: [f64; 6] = [100e-9, 40e-9, 45e-9, 105e-9, 95e-9, 35e-9];

/// A mode as K = 72e-9 s² implies it: 1/(2π√K).
const MODE_HZ: f64 = 593.0;
const MODE_S2: f64 = 72e-9;
const MODE_DAMPING: f64 = 0.005;

/// A frequency near a round one \[Hz\], of which no multiple is the sample rate: pulses and output codes then round
/// differently in every period, and their errors average out.
fn near(frequency_hz: f64) -> f64 {
    frequency_hz * 1.000_618_034
}

/// A unit in motion, with a stiff one that is otherwise the same.
struct Trial {
    unit: Unit,
    recording: Recording,
    period_s: f64,
    samples_per_output: u16,
}

impl Trial {
    /// `seconds` after the start.
    fn new(unit: &Unit, motion: &Motion, seconds: f64) -> Self {
        let stiff = unit.with(|u| u.flexure = Flexure::default());
        let count = ((FROM_S + seconds) * RATE_HZ) as usize;
        Self {
            unit: *unit,
            recording: Recording::new(motion, &[*unit, stiff], RATE_HZ, count),
            period_s: motion.period_s(),
            samples_per_output: 4,
        }
    }

    fn with_samples_per_output(mut self, samples: u16) -> Self {
        self.samples_per_output = samples;
        self
    }

    /// Outcomes of both number systems, printed.
    fn both(&self, known: &Flexure, name: &str) -> [Outcome; 2] {
        let outcomes = [self.outcome::<F32>(known), self.outcome::<Fixed>(known)];
        for outcome in &outcomes {
            outcome.print(name);
        }
        outcomes
    }

    /// Drift of the chain with this flexure on the flexing unit (0) or on the stiff one (1).
    fn drift<N: NumberSystem>(&self, known: &Flexure, of: usize) -> Drift {
        let parameters = self
            .unit
            .chain_parameters(known)
            .with(|p| p.samples_per_output = self.samples_per_output);
        attitude_error::<N>(&parameters, &self.recording, of).drift(FROM_S, self.period_s)
    }

    /// Residual and created drift of a chain that knows this flexure.
    fn outcome<N: NumberSystem>(&self, known: &Flexure) -> Outcome {
        let none = Flexure::default();
        let absolute = self.drift::<N>(known, 0);
        let stiff = self.drift::<N>(&none, 1);
        Outcome {
            system: N::NAME,
            absolute,
            left: absolute.less(&stiff),
            uncompensated: self.drift::<N>(&none, 0).less(&stiff),
        }
    }
}

/// Drifts of one number system.
struct Outcome {
    system: &'static str,
    /// From the truth.
    absolute: Drift,
    /// Beyond the stiff unit's.
    left: Drift,
    /// Of a chain without flexure, beyond the stiff unit's.
    uncompensated: Drift,
}

impl Outcome {
    /// Share of the drift that is left: largest component over largest component \[1\].
    fn share(&self) -> f64 {
        self.left.largest_deg_h() / self.uncompensated.largest_deg_h()
    }

    fn print(&self, name: &str) {
        println!(
            "{name:<34} {:<6} uncompensated {:9.2e}  left {:9.2e} +- {:7.1e}  of it {:8.1e}  from truth {:9.2e} deg/h",
            self.system,
            self.uncompensated.largest_deg_h(),
            self.left.largest_deg_h(),
            self.left.resolution_deg_h() / 3.0,
            self.share(),
            self.absolute.largest_deg_h(),
        );
    }

    /// Asserts a residual drift of at most `mark_deg_h`, or of the resolution of three standard errors.
    fn assert_left(&self, name: &str, mark_deg_h: f64) {
        self.assert_within(name, "left", &self.left, mark_deg_h);
    }

    /// Asserts a drift from the truth of at most `mark_deg_h`, or of the resolution of three standard errors.
    fn assert_true(&self, name: &str, mark_deg_h: f64) {
        self.assert_within(name, "from the truth", &self.absolute, mark_deg_h);
    }

    fn assert_within(&self, name: &str, what: &str, drift: &Drift, mark_deg_h: f64) {
        let (largest, resolution) = (drift.largest_deg_h(), drift.resolution_deg_h());
        assert!(
            largest <= mark_deg_h.max(resolution),
            "{name}, {}: {largest:.2e} deg/h {what}, mark {mark_deg_h:.1e}, resolution {resolution:.1e}",
            self.system
        );
    }
}
