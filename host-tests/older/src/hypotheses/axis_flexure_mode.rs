//! Flexure of the sensing axes with a resonance of its own.
//!
//! δ'' + 2ζΩ0 δ' + Ω0² δ = −Ω0² K_ij α_j (contract; Cheng 2023, Eq. 3 with inertia and friction kept): the tilt of
//! axis_flexure behind a second-order mode that all blocks share. K = J/k > 0.
//!
//! axis_flexure is its limit Ω0 → ∞: the mode is named only where it beats that by its own evidence. Confused with it
//! whenever the motion stays well below Ω0, or shakes at one frequency only, where the mode merely scales K.

use rayon::prelude::*;
use realfft::num_complex::Complex64;
use std::ops::Range;

use super::{Card, Hypothesis, Named, SIX, Shape, Sought};
use crate::portion::{Bins, inner};
use crate::scene::{Scene, tilt_senses};
use crate::streams::{Triad, add};
use crate::workbench::Workbench;

/// See the page above.
pub struct AxisFlexureMode;

static CARD: Card = Card {
    kind: "axis_flexure_mode",
    equation: "delta'' + 2 z W0 delta' + W0^2 delta = -W0^2 K_ij alpha_j",
    shape: Shape::Six,
    unit: "s^2",
    typical: 1e-7,
    // 1/Ω0² of a mode at 5 Hz.
    largest: 1e-3,
    positive: true,
    others: &[
        // Dither suspensions bend laterally at some hundred hertz; an error of assembly may bring that down.
        Named {
            name: "frequency_hz",
            unit: "Hz",
            typical: 200.0,
            range: [2.0, 5000.0],
        },
        // Metal: below 0.1; with the potting around it up to a few tenths.
        Named {
            name: "damping",
            unit: "1",
            typical: 0.1,
            range: [0.0, 2.0],
        },
    ],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither suspension is not stiff and resonates within reach of the motion: each laser block lags its case through a mode, its sensing axis tilts most near the resonance, and tilt times cross rate rectifies into drift.",
    next_experiment: "A sweep of coning, or vibration about two axes at once, across the suspension's resonance and well below it.",
};

const FREQUENCY: usize = 6;
const DAMPING: usize = 7;

/// Tilt over its static limit at a frequency \[Hz\], and its derivatives by frequency_hz and damping.
fn response(frequency_hz: f64, mode_hz: f64, damping: f64) -> [Complex64; 3] {
    let share = frequency_hz / mode_hz;
    let value = Complex64::new(1.0 - share * share, 2.0 * damping * share).inv();
    let slope = -value * value;
    [
        value,
        slope * Complex64::new(2.0 * share * share, -2.0 * damping * share) / mode_hz,
        slope * Complex64::new(0.0, 2.0 * share),
    ]
}

/// −sign · ω_k · α_j of one pair, α behind the mode, as a sensed increment.
fn sensed(scene: &Scene, gyro: usize, about: usize, bent_rad_s2: &[f64]) -> Vec<f64> {
    let (k, sign) = tilt_senses(gyro, about);
    let product = scene.rate_rad_s[k].iter().zip(bent_rad_s2);
    scene.sensed_from_rate_at_middles(gyro, product.map(|(rate, bent)| -sign * rate * bent))
}

impl Hypothesis for AxisFlexureMode {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn refines(&self) -> Option<&'static str> {
        Some("axis_flexure")
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        let (mode_hz, damping) = (at[FREQUENCY], at[DAMPING]);
        if mode_hz <= 0.0 {
            return None;
        }
        let bent = |about: usize, which: usize| {
            scene.acceleration_through_rad_s2(about, &|frequency_hz| {
                response(frequency_hz, mode_hz, damping)[which]
            })
        };
        if parameter < FREQUENCY {
            let about = CARD.shape.second(parameter, axis)?;
            return Some(sensed(scene, axis, about, &bent(about, 0)));
        }
        let mut total = vec![0.0; scene.streams.rows];
        for (pair, (gyro, about)) in SIX.into_iter().enumerate() {
            if gyro != axis || at[pair] == 0.0 {
                continue;
            }
            let part = sensed(scene, axis, about, &bent(about, parameter - FREQUENCY + 1));
            add(&mut total, &part, at[pair]);
        }
        Some(total)
    }

    fn columns_at_once(&self, scene: &Scene, at: &[f64]) -> Option<Vec<(usize, usize, Vec<f64>)>> {
        let (mode_hz, damping) = (at[FREQUENCY], at[DAMPING]);
        if mode_hz <= 0.0 {
            return Some(Vec::new());
        }
        let pairs_about = |about: usize| {
            let pairs = SIX.into_iter().enumerate();
            pairs.filter(move |(_, (_, other))| *other == about)
        };
        // α behind the mode, and what it changes by with frequency and damping.
        let bent: Vec<Vec<f64>> = (0..9_usize)
            .into_par_iter()
            .map(|place| {
                let (about, which) = (place / 3, place % 3);
                let tilts = |(pair, _): (usize, (usize, usize))| at[pair] != 0.0;
                if which > 0 && !pairs_about(about).any(tilts) {
                    return Vec::new();
                }
                scene.acceleration_through_rad_s2(about, &|frequency_hz| {
                    response(frequency_hz, mode_hz, damping)[which]
                })
            })
            .collect();
        let of_pairs = SIX.into_iter().enumerate().map(|(pair, (gyro, about))| {
            (pair, gyro, sensed(scene, gyro, about, &bent[3 * about]))
        });
        let of_others = (1..3).flat_map(|which| {
            let bent = &bent;
            (0..3).map(move |axis| {
                let mut total = vec![0.0; scene.streams.rows];
                for (pair, (gyro, about)) in SIX.into_iter().enumerate() {
                    if gyro == axis && at[pair] != 0.0 {
                        let part = sensed(scene, axis, about, &bent[3 * about + which]);
                        add(&mut total, &part, at[pair]);
                    }
                }
                (FREQUENCY + which - 1, axis, total)
            })
        });
        Some(of_pairs.chain(of_others).collect())
    }

    fn proportional_to(&self) -> Range<usize> {
        0..FREQUENCY
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// Linear in K: its prediction is the sum over the pairs alone.
    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        [0, 1, 2].map(|axis| {
            let mut total = vec![0.0; scene.streams.rows];
            for (pair, (gyro, _)) in SIX.into_iter().enumerate() {
                if gyro != axis || at[pair] == 0.0 {
                    continue;
                }
                let column = self.column(scene, at, pair, axis).unwrap_or_default();
                add(&mut total, &column, at[pair]);
            }
            total
        })
    }

    fn stands_behind(&self) -> &'static [&'static str] {
        &["axis_flexure", "axis_flexure_cubic"]
    }

    fn seek(&self, bench: &Workbench, left: &[Bins; 3]) -> Option<Sought> {
        /// 2 Δ ln L of eight parameters that chance over the grid does not reach.
        const CLEAR: f64 = 60.0;
        /// A third of that, as no look need be near the mode; chance hardly ever comes so far.
        const WORTH_A_LOOK: f64 = 20.0;
        let scene = bench.scene();
        let edge_hz = scene.motion_edge_hz;
        let weights = [0, 1, 2].map(|axis: usize| bench.noise[axis].weights(&bench.portion));
        let look = |points: Vec<(f64, f64)>| -> Vec<Look> {
            points
                .into_par_iter()
                .map(|(mode_hz, damping)| Look::at(bench, left, &weights, mode_hz, damping))
                .collect()
        };
        let coarse_from = (edge_hz / LOWEST_SHARE).max(CARD.others[0].range[0]);
        // Few looks tell whether anything tilts at all.
        let shares = (0..FEW_LOOKS).map(|k| FEW.powi(k) / LOWEST_SHARE);
        let few: Vec<(f64, f64)> = shares
            .chain([STATIC])
            .map(|share| (share * edge_hz, COARSE_DAMPING))
            .collect();
        let mut trials = few.len();
        if Look::best(&look(few))?.ratio < WORTH_A_LOOK {
            return None;
        }
        let count = ((REACH * edge_hz / coarse_from).ln() / COARSE.ln()).ceil() as i32;
        let coarse: Vec<(f64, f64)> = (0..=count)
            .map(|k| (coarse_from * COARSE.powi(k), COARSE_DAMPING))
            .chain([(STATIC * edge_hz, COARSE_DAMPING)])
            .collect();
        trials += coarse.len();
        let mut looks = look(coarse);
        let rigid = looks.pop()?;
        let first = Look::best(&looks)?;
        // A mode just beyond reach is better begun at the reach's end than not at all.
        let fine: Vec<(f64, f64)> = [-0.5, 0.0, 0.5]
            .into_iter()
            .flat_map(|step: f64| {
                let mode_hz = first.mode_hz * COARSE.powf(step);
                FINE_DAMPINGS.map(|damping| (mode_hz, damping))
            })
            .collect();
        trials += fine.len();
        let second = look(fine);
        let best = Look::best(&second)
            .filter(|best| best.ratio > first.ratio)
            .unwrap_or(first);
        if best.ratio.max(rigid.ratio) < CLEAR {
            return None;
        }
        let mut at = best.flexure_s2.to_vec();
        at.extend([best.mode_hz, best.damping]);
        Some(Sought {
            at,
            trials,
            within_reach: best.ratio > rigid.ratio - NO_LOSS,
        })
    }
}

/// Likelihood ratio that a right hypothesis loses to chance in one case of a hundred (3 degrees).
const NO_LOSS: f64 = 11.3;

/// The slowest mode looked for, as a share of the motion's last frequency.
const LOWEST_SHARE: f64 = 12.0;

/// Beyond three times the motion's last frequency a mode adds less than 12 % to the static tilt.
const REACH: f64 = 3.0;

/// As good as static: 1 % at the motion's last frequency.
const STATIC: f64 = 10.0;

/// Ratio of neighbouring frequencies on the first grid: a mode of the damping below is that wide.
const COARSE: f64 = 1.25;
const COARSE_DAMPING: f64 = 0.12;
const FINE_DAMPINGS: [f64; 3] = [0.03, 0.1, 0.35];

/// Ratio of neighbours and number of the few looks before, from the slowest to the motion's last frequency.
const FEW: f64 = 1.8;
const FEW_LOOKS: i32 = 5;

/// What a mode on the grid explains.
struct Look {
    mode_hz: f64,
    damping: f64,
    flexure_s2: [f64; 6],
    ratio: f64,
}

impl Look {
    fn at(
        bench: &Workbench,
        left: &[Bins; 3],
        weights: &[Vec<f64>; 3],
        mode_hz: f64,
        damping: f64,
    ) -> Self {
        let scene = bench.scene();
        let bent = [0, 1, 2].map(|about| {
            scene.acceleration_through_rad_s2(about, &|frequency_hz| {
                response(frequency_hz, mode_hz, damping)[0]
            })
        });
        let mut look = Self {
            mode_hz,
            damping,
            flexure_s2: [0.0; 6],
            ratio: 0.0,
        };
        for (gyro, (left, weights)) in left.iter().zip(weights).enumerate() {
            let columns = [2 * gyro, 2 * gyro + 1].map(|pair| {
                let about = SIX[pair].1;
                bench
                    .portion
                    .transform(&sensed(scene, gyro, about, &bent[about]))
            });
            let product = |a: &Bins, b: &Bins| inner(a, b, weights);
            let (aa, ab, bb) = (
                product(&columns[0], &columns[0]),
                product(&columns[0], &columns[1]),
                product(&columns[1], &columns[1]),
            );
            let right = [0, 1].map(|k| product(&columns[k], left));
            // Under coning the two columns are one: a little ridge then shares K between them.
            let ridge = 1e-6 * (aa + bb);
            let (aa, bb) = (aa + ridge, bb + ridge);
            let determinant = aa * bb - ab * ab;
            if determinant <= 0.0 {
                continue;
            }
            let both = [
                (bb * right[0] - ab * right[1]) / determinant,
                (aa * right[1] - ab * right[0]) / determinant,
            ];
            // K > 0: where both together want a negative one, one alone.
            let values = match (right[0] / aa, right[1] / bb) {
                _ if both.iter().all(|value| *value >= 0.0) => both,
                (first, second) if first * right[0] >= second * right[1] => [first.max(0.0), 0.0],
                (_, second) => [0.0, second.max(0.0)],
            };
            look.flexure_s2[2 * gyro..2 * gyro + 2].copy_from_slice(&values);
            look.ratio += values[0] * right[0] + values[1] * right[1];
        }
        look
    }

    fn best(looks: &[Self]) -> Option<&Self> {
        looks.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio))
    }
}
