//! Removes the size effect: the acceleration sensed by accelerometers away from the body's origin.
//!
//! It takes D \[rad\] in the body frame every sample, and the period's rotation. Once per output period it gives the
//! velocity to add to the sensed one before it is turned into the frame at the period's start, and the velocity to
//! subtract afterwards \[fine units\].
//!
//! Accelerometer i at r_i feels (α × r_i + ω × (ω × r_i))_i more. Let (L ω)_i = (ω × r_i)_i, row by row. In the
//! frame at the period's start, C the rotation since, dC/dt = C ω×:
//!
//! ```text
//! ∫ C L α dt = [C L ω]_start^end − ∫ C (ω × L ω) dt
//! ```
//!
//! so the velocity to subtract is
//!
//! ```text
//! C L ω_end − L ω_start − ∫ C Q dt        Q_i = (ω × L ω − ω × (ω × r_i))_i
//! ```
//!
//! No α appears, hence no delay of its estimate. The first two terms telescope from frame to frame: an error of ω at a
//! period's end is a velocity error of r δω there, and cancels with the next frame; none of it rectifies, however hard
//! the vibration. Q is of second order, needs ω ω alone, and has only differences of arms in it (common arms
//! fall out, as they must):
//!
//! ```text
//! Q_x = ω_x ω_y (z_y − x_y) + ω_x ω_z (y_z − x_z) + ω_y² (x_x − z_x) + ω_z² (x_x − y_x)    and cyclic,
//! ```
//!
//! x_y the y coordinate of accelerometer x. The sums of ω ω are corrected for the average within a sample
//! ([`WITHIN_SAMPLE`](crate::chain::design_parameters::WITHIN_SAMPLE)). ω_end T = D_k + ½ (D_k − D_{k−1}): its relative
//! error is (ΩT)²/3, 0.8 % at 100 Hz and 4 kHz.
//!
//! Pulse quantisation q shows twice: as some 2.5 q r/(√12 T) of velocity at a period's end, which telescopes (0.6 mm/s
//! for 0.8″ and 50 mm), and in the squares as q²/(6T²) times the difference of arms (0.2 µg for the same), a bias.
//!
//! While the increments contain a block's dither (a failed pickoff), ω is unknown: the last known L ω is used, and Q is
//! left out. The same holds for lost samples.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactLever;
use crate::chain::parameters::{AccelerometerParameters, Parameters};
use crate::chain::triad::Triad;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct SizeEffect {
    /// (L ω)_i: of the next axis' ω and of the one after \[m/s per rad\].
    rate: [[ExactLever; 2]; 3],
    /// Q_i: of ω_i ω_j, ω_i ω_k, ω_j², ω_k², with j and k the next axes, over half the sums
    /// \[m/s per rad²\].
    square: [[ExactLever; 4]; 3],
    /// Exponent of the increment unit.
    unit_log2: u32,
}

/// Sums over the period, and the latest increments \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct SizeEffectState<N: NumberSystem> {
    /// D_k, and D_{k−1}.
    latest: Triad<N::Increment>,
    previous: Triad<N::Increment>,
    /// T² Σ ω_x², ω_y², ω_z².
    squares: Triad<N::Cross>,
    /// T² Σ ω_y ω_z, ω_z ω_x, ω_x ω_y.
    products: Triad<N::Cross>,
    /// L ω at the period's start \[fine units\].
    start: [i64; 3],
    begun: bool,
    /// True if the latest two increments are those of the last two periods.
    current: bool,
}

/// The size effect's part of one output period's velocity \[fine units\].
#[derive(Debug, Clone, Copy)]
pub struct PeriodSizeEffect {
    /// ∫ Q dt, a velocity of the body frame.
    pub gathered: [i64; 3],
    /// L ω at the period's start.
    pub start: [i64; 3],
    /// L ω at its end.
    pub end: [i64; 3],
}

impl SizeEffect {
    pub(crate) fn new(parameters: &Parameters, accelerometers: &AccelerometerParameters) -> Self {
        let arms = accelerometers.lever_arm_m;
        let rate = parameters.sample_rate_hz;
        let lever = |arm_m: f64| ExactLever::of(arm_m * rate);
        // Twice, because the sums are given halved.
        let square = |to_m: f64, from_m: f64| ExactLever::of(2.0 * rate * (to_m - from_m));
        let next = |axis: usize| [(axis + 1) % 3, (axis + 2) % 3];
        Self {
            unit_log2: parameters.increment_unit_log2(),
            rate: [0, 1, 2].map(|i| {
                let [j, k] = next(i);
                [lever(arms[i][k]), lever(-arms[i][j])]
            }),
            square: [0, 1, 2].map(|i| {
                let [j, k] = next(i);
                [
                    square(arms[k][j], arms[i][j]),
                    square(arms[j][k], arms[i][k]),
                    square(arms[i][i], arms[k][i]),
                    square(arms[i][i], arms[j][i]),
                ]
            }),
        }
    }

    /// Starts from this increment \[rad\], at the stream's start or after lost samples.
    #[cold]
    #[inline(never)]
    pub fn start<N: NumberSystem>(
        &self,
        state: &mut SizeEffectState<N>,
        increment: Triad<N::Increment>,
    ) {
        state.latest = increment;
        state.previous = increment;
        state.current = true;
        if !state.begun {
            // Half a sample late: an error of r α T/2 in this one period.
            state.begun = true;
            state.start = self.swing(state);
        }
    }

    /// Gives the period's size effect and starts the next period's sums.
    ///
    /// # Inputs
    /// `known`: the increments are the case's own, free of dither.
    #[inline(always)]
    pub fn finish<N: NumberSystem>(
        &self,
        state: &mut SizeEffectState<N>,
        known: bool,
    ) -> PeriodSizeEffect {
        let squares = core::mem::take(&mut state.squares);
        let products = core::mem::take(&mut state.products);
        let start = state.start;
        let mut gathered = [0; 3];
        if known {
            let half = |sum| N::fine(N::Tilted::default(), sum) << (2 * self.unit_log2);
            let squares = squares.map(half).to_array();
            let products = products.map(half).to_array();
            for i in 0..3 {
                let (j, k) = NEXT[i];
                let [ij, ik, jj, kk] = self.square[i];
                gathered[i] = ij
                    .times(products[k])
                    .wrapping_add(ik.times(products[j]))
                    .wrapping_add(jj.times(squares[j]))
                    .wrapping_add(kk.times(squares[k]));
            }
            if state.current {
                state.start = self.swing(state);
            }
        }
        PeriodSizeEffect {
            gathered,
            start,
            end: state.start,
        }
    }

    /// L ω at the latest sample's end \[fine units\].
    #[inline(always)]
    fn swing<N: NumberSystem>(&self, state: &SizeEffectState<N>) -> [i64; 3] {
        let (now, past) = (state.latest, state.previous);
        let rate = [
            N::at_end(now.x, past.x) << self.unit_log2,
            N::at_end(now.y, past.y) << self.unit_log2,
            N::at_end(now.z, past.z) << self.unit_log2,
        ];
        let mut swing = [0; 3];
        for i in 0..3 {
            let (j, k) = NEXT[i];
            let [of_j, of_k] = self.rate[i];
            swing[i] = of_j.times(rate[j]).wrapping_add(of_k.times(rate[k]));
        }
        swing
    }
}

/// For each axis, the next two in cyclic order.
const NEXT: [(usize, usize); 3] = [(1, 2), (2, 0), (0, 1)];

/// Adds one sample's increments `d` \[rad\].
#[inline(always)]
pub fn process<N: NumberSystem>(state: &mut SizeEffectState<N>, d: Triad<N::Increment>) {
    let past = state.latest;
    let e = Triad {
        x: N::within_sample(N::difference(d.x, past.x)),
        y: N::within_sample(N::difference(d.y, past.y)),
        z: N::within_sample(N::difference(d.z, past.z)),
    };
    let add = |sum, a, b, e_a, e_b| N::add_product_of(N::add_product_of(sum, a, b), e_a, e_b);
    let (squares, products) = (state.squares, state.products);
    state.squares = Triad {
        x: add(squares.x, d.x, d.x, e.x, e.x),
        y: add(squares.y, d.y, d.y, e.y, e.y),
        z: add(squares.z, d.z, d.z, e.z, e.z),
    };
    state.products = Triad {
        x: add(products.x, d.y, d.z, e.y, e.z),
        y: add(products.y, d.z, d.x, e.z, e.x),
        z: add(products.z, d.x, d.y, e.x, e.y),
    };
    state.previous = past;
    state.latest = d;
}

/// Records lost samples: the latest increments no longer give the present rate.
pub fn discontinue<N: NumberSystem>(state: &mut SizeEffectState<N>) {
    state.current = false;
}
