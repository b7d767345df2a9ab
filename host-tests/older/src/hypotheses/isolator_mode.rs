//! A soft mount between the reference and the case.
//!
//! The case follows the reference through H = (ω0² + 2ζω0 s)/(s² + 2ζω0 s + ω0²), an axis at a time, so gyro i senses
//! H − 1 = −s²/(s² + 2ζω0 s + ω0²) times the reference's motion beside what the model predicts (contract). An
//! axis of frequency 0 here is rigid and has no parameters in files.
//!
//! Seen by any vibration that reaches a good part of ω0. Far below it H − 1 = −s²/ω0², an elastic rate by jerk with
//! W_ii = −1/ω0²; a delay or a scale error imitates it over a narrow band. All other regressors keep using the
//! reference's motion in place of the case's: beside an isolator they are right only well below ω0.

use realfft::num_complex::Complex64;
use std::f64::consts::TAU;

use super::{Card, Hypothesis, Named, Shape, Sought};
use crate::portion::{Bins, Portion};
use crate::scene::Scene;
use crate::streams::{Triad, add};
use crate::workbench::Workbench;

/// See the page above.
pub struct IsolatorMode;

/// Mounts of inertial units: 20 to 100 Hz; beyond 1 kHz a mount is a bracket.
const fn frequency(name: &'static str) -> Named {
    Named {
        name,
        unit: "Hz",
        typical: 50.0,
        range: [1.0, 1000.0],
    }
}

/// Elastomers: 0.05 to 0.3; beyond 1 nothing resonates.
const fn damping(name: &'static str) -> Named {
    Named {
        name,
        unit: "1",
        typical: 0.15,
        range: [0.0, 1.0],
    }
}

static CARD: Card = Card {
    kind: "isolator_mode",
    equation: "case = (w0^2 + 2 z w0 s)/(s^2 + 2 z w0 s + w0^2) reference, by axis",
    shape: Shape::Named,
    unit: "1",
    typical: 1.0,
    largest: 1.0,
    positive: false,
    others: &[
        frequency("x_frequency_hz"),
        frequency("y_frequency_hz"),
        frequency("z_frequency_hz"),
        damping("x_damping"),
        damping("y_damping"),
        damping("z_damping"),
    ],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The case does not move as the reference says: it stands on a soft mount that amplifies vibration near its resonance and swallows it above.",
    next_experiment: "A sine sweep through the mount's resonance on each axis: amplitude and phase of gyro over reference draw H.",
};

/// H − 1 at a frequency \[Hz\], and its derivatives by frequency_hz and damping.
fn response(frequency_hz: f64, mode_hz: f64, damping: f64) -> [Complex64; 3] {
    let (omega, mode) = (TAU * frequency_hz, TAU * mode_hz);
    let below = Complex64::new(mode * mode - omega * omega, 2.0 * damping * mode * omega);
    let value = omega * omega / below;
    let slope = -value / below;
    [
        value,
        slope * Complex64::new(2.0 * mode, 2.0 * damping * omega) * TAU,
        slope * Complex64::new(0.0, 2.0 * mode * omega),
    ]
}

impl Hypothesis for IsolatorMode {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        let of = parameter % 3;
        // The tilts between axes matter to the prediction, not to the direction of a step towards it.
        if of != axis || at[of] <= 0.0 {
            return None;
        }
        let (mode_hz, damping) = (at[axis], at[axis + 3]);
        let slope = scene.case_through_rad(axis, &|frequency_hz| {
            response(frequency_hz, mode_hz, damping)[1 + parameter / 3]
        });
        let sensed = scene.sensing_from_body[(axis, axis)] / (1.0 - scene.scale_error[axis]);
        Some(slope.into_iter().map(|slope| slope * sensed).collect())
    }

    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        let rows = scene.streams.rows;
        let mut total: Triad = [0, 1, 2].map(|_| vec![0.0; rows]);
        for of in (0..3).filter(|&of| at[of] > 0.0) {
            let beside = scene.case_through_rad(of, &|frequency_hz| {
                response(frequency_hz, at[of], at[of + 3])[0]
            });
            for (axis, sum) in total.iter_mut().enumerate() {
                let share = scene.sensing_from_body[(axis, of)] / (1.0 - scene.scale_error[axis]);
                add(sum, &beside, share);
            }
        }
        total
    }

    fn is_linear(&self) -> bool {
        false
    }

    fn has(&self, at: &[f64], parameter: usize) -> bool {
        at[parameter % 3] > 0.0
    }

    fn stands_behind(&self) -> &'static [&'static str] {
        &[
            "elastic_rate_by_jerk",
            "gyro_delay",
            "reference_delay",
            "gyro_scale",
            "reference_scale",
            "installation",
            "reference_misalignment",
        ]
    }

    /// Every axis by itself, on the spectra of reference and residual: a look costs one pass over the band.
    fn seek(&self, bench: &Workbench, left: &[Bins; 3]) -> Option<Sought> {
        /// 2 Δ ln L of two parameters that chance over the whole grid does not reach.
        const CLEAR: f64 = 40.0;
        let scene = bench.scene();
        let mut at = vec![0.0; CARD.count()];
        let mut trials = 0;
        for axis in 0..3 {
            let reference = bench.portion.transform(&scene.case_ahead_rad(axis, 0, 0.0));
            let weights = bench.noise[axis].weights(&bench.portion);
            let band = Band::new(
                &bench.portion,
                &reference,
                &left[axis],
                &weights,
                scene.motion_edge_hz,
            );
            let (mut best, mut most) = ((0.0, 0.0), CLEAR);
            for damping in DAMPINGS {
                let mut mode_hz = LOWEST_HZ;
                while mode_hz < scene.motion_edge_hz * FURTHEST {
                    trials += 1;
                    let ratio = band.ratio(mode_hz, damping);
                    if ratio > most {
                        (best, most) = ((mode_hz, damping), ratio);
                    }
                    mode_hz *= 1.0 + damping.min(WIDEST_STEP);
                }
            }
            (at[axis], at[axis + 3]) = best;
        }
        at.iter().any(|value| *value > 0.0).then_some(Sought {
            at,
            trials,
            within_reach: true,
        })
    }
}

/// Modes slower than this follow everything that vibrates.
const LOWEST_HZ: f64 = 2.0;

/// Beyond this many times the motion's last frequency an isolator is an elastic rate by jerk.
const FURTHEST: f64 = 4.0;

/// Damping ratios tried; Gauss–Newton goes on from the best.
const DAMPINGS: [f64; 5] = [0.02, 0.05, 0.12, 0.3, 0.7];

/// Frequencies are tried at half a resonance's width, at most this far apart.
const WIDEST_STEP: f64 = 0.1;

/// Bins in the motion's band: frequency, weighted powers of reference and of its product with the residual.
struct Band {
    bins: Vec<(f64, f64, Complex64)>,
}

impl Band {
    /// Neighbouring bins are summed where no resonance is narrower than their distance.
    fn new(
        portion: &Portion,
        reference: &Bins,
        left: &Bins,
        weights: &[f64],
        edge_hz: f64,
    ) -> Self {
        /// Relative width over which H hardly changes: a quarter of the narrowest resonance.
        const ALIKE: f64 = 0.005;
        let mut bins: Vec<(f64, f64, Complex64)> = Vec::new();
        let mut begin_hz = 0.0;
        for bin in 1..portion.bins() {
            let frequency_hz = portion.frequency_hz(bin);
            if frequency_hz > edge_hz {
                break;
            }
            let power = reference[bin].norm_sqr() * weights[bin];
            let cross = reference[bin].conj() * left[bin] * weights[bin];
            match bins.last_mut() {
                Some(last) if frequency_hz < begin_hz * (1.0 + ALIKE) => {
                    last.1 += power;
                    last.2 += cross;
                }
                _ => {
                    begin_hz = frequency_hz;
                    bins.push((frequency_hz, power, cross));
                }
            }
        }
        Self { bins }
    }

    /// 2 Δ ln L of the mode over nothing.
    fn ratio(&self, mode_hz: f64, damping: f64) -> f64 {
        self.bins
            .iter()
            .map(|(frequency_hz, power, cross)| {
                let beside = response(*frequency_hz, mode_hz, damping)[0];
                2.0 * (beside.conj() * cross).re - beside.norm_sqr() * power
            })
            .sum()
    }
}
