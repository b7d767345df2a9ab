//! Design numbers of the chain: unit, value and reason of each.

/// Sample rate the chain was designed for \[Hz\]: ten samples per period of the fastest block dither
/// (400 Hz), so that the strip and the acceleration see its sine and not its alias.
pub const DESIGN_SAMPLE_RATE_HZ: f64 = 4000.0;

/// Exponent s of the increment unit 2ˢ rad: increments, and velocities over one sample, are counted in it. 0 from
/// 4 kHz on; one more for every halving of the rate, since the angle per sample doubles.
pub const fn increment_unit_log2(sample_rate_hz: f64) -> u32 {
    let design = DESIGN_SAMPLE_RATE_HZ;
    if sample_rate_hz >= design {
        0
    } else if sample_rate_hz >= design / 2.0 {
        1
    } else if sample_rate_hz >= design / 4.0 {
        2
    } else {
        3
    }
}

/// Sample rates a configuration may ask for \[Hz\]: below 500 Hz the dither itself would alias; above
/// 8 kHz one sample's instructions no longer fit its period on a 168 MHz Cortex-M4F with margin.
pub const SAMPLE_RATE_RANGE_HZ: (f64, f64) = (500.0, 8000.0);

/// Most samples in one output period \[samples\].
pub const MAX_SAMPLES_PER_OUTPUT: u16 = 40;

/// Largest angle that the samples of one output period may sum to \[rad\], by the limits of the configuration:
/// its square, which bounds the coning sum, stays within the ±2⁻⁵ of that sum's fixed-point format.
pub const OUTPUT_PERIOD_LIMIT_RAD: f64 = 0.1767;

/// Angle of one output code \[rad\]: 2⁻³⁵ = 6e-6 arcsec. One code per 5 ms is 0.0012 °/h, and the part of a
/// code is carried; an `i32` of them spans ±0.0625 rad, 716 °/s over 5 ms, 358 °/s over 10 ms.
pub const OUTPUT_RAD_PER_CODE: f64 = 1.0 / (1u64 << 35) as f64;

/// Velocity of one output code \[m/s\]: 2⁻²⁷ = 7.5e-9 m/s, 1.5 µm/s² at 200 frames a second; an `i32` of
/// them spans ±16 m/s, 65 g over 25 ms.
pub const OUTPUT_M_S_PER_CODE: f64 = 1.0 / (1u64 << 27) as f64;

/// Fine units in one output code, as an exponent: exact sums are `i64` of 2⁻²⁹ of a code
/// (2⁻⁶⁴ rad, 2⁻⁵⁶ m/s), which spans eight times the range of a frame.
pub const FINE_PER_CODE_LOG2: u32 = 29;

/// Largest sensed increment \[increment units per sample\]: 5/8 of 2⁻⁸, 559 °/s at 4 kHz: the case's 400 °/s
/// plus the dither's 100 °/s, with margin. An increment unit is 1 rad from 4 kHz on and doubles with every halving
/// of the sample rate ([`increment_unit_log2`]), so the limits are at least these rates at every sample rate.
pub const SENSED_LIMIT_RAD: f64 = 5.0 / 8.0 / 256.0;

/// Largest dither increment \[increment units per sample\]: 2⁻¹⁰, 223 °/s at 4 kHz: 200″ at 500 Hz peaks at
/// 175 °/s.
pub const DITHER_LIMIT_RAD: f64 = 2.0 / 8.0 / 256.0;

/// Largest angle after lost samples that is composed with the rest of its output period \[rad\]: 1/16, the range of one
/// frame; 36 ms at 100 °/s. A larger one is shown by as many frames as it takes.
pub const GAP_IN_FRAME_RAD: f64 = 1.0 / 16.0;

/// Largest angular acceleration that terms of cubic and resonant flexure follow \[increment units per sample²\]: 2⁻¹⁰,
/// 15 600 rad/s² at 4 kHz. Shaker tests reach 100 rad/s²; pulse quantisation of 1″ adds some 50 rad/s².
pub const ACCELERATION_LIMIT_RAD: f64 = 1.0 / 1024.0;

/// Largest |K|/T² \[1\]: 8, K = 5e-7 s² at 4 kHz, seven times the paper's values (Table 3: 7e-8 s²): a block that
/// rings at 225 Hz.
pub const FLEXURE_LIMIT: f64 = 8.0;

/// Largest |K|/T² times the increment unit \[1\]: 32, the fixed-point format's range. It binds below 1 kHz.
pub const SCALED_FLEXURE_LIMIT: f64 = 32.0;

/// Most that flexure adds to one increment where it is a factor of coning's products \[increment units\]: 2⁻¹⁶, a tilt of
/// 1/256 rad at half the largest increment.
pub const BENT_LIMIT_RAD: f64 = 1.0 / 65536.0;

/// Largest known installation angle |ε_ij0| \[rad\]: 1/128 (0.45°); real ones stay within 1e-3 rad. With the
/// largest tilt a matrix term stays within 1/64.
pub const INSTALLATION_LIMIT_RAD: f64 = 1.0 / 128.0;

/// Largest |scale error| \[1\]: 1/128; real ones are below 1e-3.
pub const SCALE_ERROR_LIMIT: f64 = 1.0 / 128.0;

/// Largest |bias| \[rad/s\]: 0.01 (2000 °/h); real ones are below 1 °/h.
pub const BIAS_LIMIT_RAD_S: f64 = 0.01;

/// Pulse weights a configuration may ask for \[rad\]: with 2⁻³⁴ (1.2e-5″, resampled recordings) the counts of
/// 40 samples at the sensed limit of 4 kHz are 1.7e9, and their sum fits an `i32`; below 4 kHz fewer samples may make an
/// output period. Up to 20″.
pub const PULSE_WEIGHT_RANGE_RAD: (f64, f64) = (1.0 / (1u64 << 34) as f64, 1e-4);

/// Pickoff codes a configuration may ask for \[rad\]: 2⁻³⁵ (6e-6″), with which 40 steps at their limit fit an `i32`;
/// 1e-4 rad is a sixth of the dither's amplitude, useless beyond.
pub const PICKOFF_WEIGHT_RANGE_RAD: (f64, f64) = (1.0 / (1u64 << 35) as f64, 1e-4);

/// Farthest that a block may be from where its pickoff was first read while the strip's taps follow it \[rad\]: three
/// times the largest dither amplitude. No suspension lets a block go there, and the angle by a moved tap over all of it
/// fits the exact sums.
pub const PICKOFF_REACH_RAD: f64 = 1.0 / 32.0;

/// Largest velocity with which an accelerometer may swing about the body origin at the largest increment of the
/// configuration \[m/s\]: turned with the case, at an output period's end and at its start, it takes half of the exact
/// sums' ±128 m/s. The other half is the velocity's.
pub const SWING_LIMIT_M_S: f64 = 20.0;

/// Periods of bias that one output period's exact sums take at once \[sampling periods\]: 0.02 rad and 2 m/s of the
/// largest bias at the lowest rate. After a longer outage the rest is subtracted in later frames.
pub const BIAS_PERIODS: u32 = 1000;

/// Pickoff gains a configuration may ask for \[1\]: 0 for gyros without dither, 2 far beyond any tolerance.
pub const PICKOFF_GAIN_RANGE: (f64, f64) = (0.0, 2.0);

/// Pickoff delays a configuration may ask for \[s\], either sign: 100 µs is 16° of a 450 Hz dither, beyond
/// any converter's.
pub const PICKOFF_DELAY_LIMIT_S: f64 = 1e-4;

/// Dither frequencies that may stand in a block where they are not used \[Hz\].
pub const DITHER_FREQUENCY_RANGE_HZ: (f64, f64) = (1.0, 4000.0);

/// Dither frequencies a configuration may ask for \[cycles per sample\], where the frequency is used: the
/// quadrature formed from two samples is ill-conditioned near 0 and near ½.
pub const DITHER_CYCLES_RANGE: (f64, f64) = (0.04, 0.4);

/// Largest dither amplitude \[rad\]: 0.01 (34′), ten times the largest in use.
pub const DITHER_AMPLITUDE_LIMIT_RAD: f64 = 0.01;

/// Adaptation times a configuration may ask for \[s\]: below 0.1 s a window of 30 ms would be more than a
/// third of the estimate; 1000 s is longer than a pickoff's warm-up.
pub const ADAPTATION_TIME_RANGE_S: (f64, f64) = (0.1, 1000.0);

/// Accelerometer weights a configuration may ask for \[m/s per code\]: 1e-9 is 0.4 µg per code at 4 kHz;
/// beyond 1e-2 one pulse is 4 g over a period.
pub const ACCELEROMETER_WEIGHT_RANGE_M_S: (f64, f64) = (1e-9, 1e-2);

/// Largest accelerometer bias \[m/s²\]: 0.1 g; real ones are below 1e-2 m/s².
pub const ACCELEROMETER_BIAS_LIMIT_M_S2: f64 = 1.0;

/// Largest distance of an accelerometer from the body origin \[m\], each coordinate.
pub const LEVER_ARM_LIMIT_M: f64 = 0.5;

/// Largest velocity of one sample \[m/s, times the increment unit\]: 1/4, 102 g at 4 kHz; 40 samples of it reach
/// 10 m/s, inside a frame's 16 m/s. The codes of an output period sum in an `i32`: with the finest weights the limit is
/// [`ACCELEROMETER_SUM_CODES`].
pub const VELOCITY_LIMIT_M_S: f64 = 0.25;

/// Largest velocity after lost samples that is composed with the rest of its output period \[m/s\]: 4, a quarter of one
/// frame's range; 0.4 s at 1 g. A larger one is shown by as many frames as it takes.
pub const VELOCITY_GAP_IN_FRAME_M_S: f64 = 4.0;

/// Most accelerometer codes of an output period's samples \[codes\]: their sum fits an `i32`. With codes of 2⁻²⁹ m/s (replayed recordings) and ten samples 81 g at 4 kHz.
pub const ACCELEROMETER_SUM_CODES: i32 = 1 << 30;

/// Length of an adaptation window \[s\]: a dozen dither periods; a fault is found within two windows.
pub const ADAPTATION_WINDOW_S: f64 = 0.03;

/// Fewest samples of a window \[samples\]: each axis is observed in every third, and 24 observations are six times the
/// estimated unknowns.
pub const LEAST_WINDOW_SAMPLES: f64 = 72.0;

/// Share of the first window's estimate that is followed, and the most of any \[1\]: half, so that noise is averaged even
/// with the shortest adaptation time.
pub const FIRST_ADAPTATION_SHARE: f32 = 0.5;

/// Largest step of the tracked gain and quadrature in one window \[1\]: 1 %, 0.3 a second. A real drift takes
/// minutes; a disturbed window can do no more than this.
pub const ADAPTATION_STEP_LIMIT: f32 = 0.01;

/// Largest departure of tracked gain and quadrature from nominal \[1\]: 20 % is beyond any pickoff's tolerance; a
/// quadrature of 0.2 at 400 Hz is a delay of 80 µs.
pub const ADAPTATION_RANGE: f32 = 0.2;

/// Dither amplitude over nominal that is healthy \[1\]: randomised amplitudes wander by a third.
pub const HEALTHY_AMPLITUDE: (f32, f32) = (0.5, 1.5);

/// Dither amplitude over nominal below which a pickoff stands still \[1\].
pub const STILL_AMPLITUDE: f32 = 0.1;

/// Dither frequency over nominal that is healthy \[1\]: the drive's loop keeps the suspension's resonance,
/// which moves by parts of a per cent; 20 % is another mode or another unit. The ends of a window alone can
/// look like 8 %.
pub const HEALTHY_FREQUENCY: (f64, f64) = (0.8, 1.2);

/// Part of the dither's own energy in the stripped increments from which a still pickoff counts as failed \[1\]:
/// half the amplitude.
pub const UNSTRIPPED_ENERGY: f32 = 0.25;

/// Terms of a filter over successive increments.
pub const FILTER_TERMS: usize = 4;

/// Pairs of increments about a sample from which its angular acceleration is formed.
pub const CENTRAL_PAIRS: usize = 3;

/// α̂_k T² = Σ_p a_p (D_{k+p} − D_{k−p}), tuned so that the mean of α̂ × D is right (the *product* rectifies, not α̂
/// alone): 2 Σ_p a_p sin px = x/sinc²(x/2), x = ΩT, in powers of x. Antisymmetric, so that nothing rectifies where
/// two axes move in phase. Error of the product at 100, 200, 400 Hz and 4 kHz: 2e-7, 1.3e-5, 7.5e-4.
pub const CENTRAL_COEFFICIENTS: [f64; CENTRAL_PAIRS] = [43.0 / 48.0, -29.0 / 120.0, 7.0 / 240.0];

/// Frequencies at which the response of a block's mode is matched, over the mode's own \[1\]; and at most
/// \[cycles per sample\], 120 and 220 Hz at 4 kHz. Also at rest. Left between them: 3e-4 of the drift with a mode of
/// 593 Hz.
pub const MODE_MATCHED_AT: [(f64, f64); 2] = [(0.2, 0.03), (0.36, 0.055)];

/// Damping of the mode that a flexure implies, unless given \[1\]: metal springs have 0.001 to 0.01.
pub const FLEXURE_DAMPING: f64 = 0.005;

/// Most that the flexure's correction adds to an output period's angle \[increment units\]: 2⁻⁹, 400″. A tilt of
/// 1/128 rad at the largest increment for the longest period.
pub const FLEXURE_ANGLE_LIMIT_RAD: f64 = 1.0 / 512.0;

/// Coning within one sample, ½∫α×ω dt ≈ (c₁ D_{k−1} + c₂ D_{k−2}) × D_k: Σ c_j 2(1 − cos x) sin jx =
/// ½(x − sin x), x = ΩT, matched to x⁵. With c₁ alone (1/12, matched to x³) the residual at 4 kHz, 100 Hz,
/// 0.1° is 4e-3 °/h; with both 2.1e-5 °/h, for a multiplication and an addition more per axis.
pub const CONING_COEFFICIENTS: [f64; 2] = [7.0 / 60.0, -1.0 / 60.0];

/// κ = 1/√12: the mean of D D + (κ ΔD) (κ ΔD) is T² times that of ω ω, D the increments and ΔD their
/// differences; D D alone lacks the part averaged out within a sample, x²/12 (x = ΩT; 3.3 % at 400 Hz and 4 kHz). The
/// residual is x⁴/90: 0.17 % at 400 Hz. A correction by D ΔD would cost less, and shift ω ω in time.
pub const WITHIN_SAMPLE: f64 = 0.288_675_134_594_812_9;

/// Time that bank and dithers may take to start before their faults are latched as the first fault \[s\]: a
/// dither reaches its amplitude within a second or so.
pub const START_UP_LIMIT_S: f64 = 2.0;

/// An interrupt that is entered later than this share of a period after the period's end counts as late
/// \[1\]: 1/16, 15.6 µs at 4 kHz. Nothing in the image holds it that long (only the reset handlers mask it),
/// so a late entry means that the previous one overran its deadline.
pub const LATE_SHARE: u32 = 16;

/// Temperatures that a gyro may have \[K\]; readings beyond are a sensor's fault.
pub const TEMPERATURE_RANGE_K: (f32, f32) = (150.0, 450.0);

/// Delays of gyros and accelerometers that a term may correct \[sampling periods\], either sign: 100 µs at 4 kHz. The
/// extrapolation's noise grows with it.
pub const DELAY_LIMIT_SAMPLES: f64 = 0.4;

/// Variances of a gyro's path that a term may correct \[squares of the sampling period\], either sign: a rms width of
/// 250 µs at 4 kHz.
pub const VARIANCE_LIMIT_SAMPLES: f64 = 1.0;

/// Most that the corrections of delay and bandwidth and of elastic rates each add to one increment \[increment units\]: 2⁻¹¹, more than the
/// largest delay times the largest acceleration.
pub const RESPONSE_LIMIT_RAD: f64 = 1.0 / 2048.0;

/// Largest increment of a chain with terms \[increment units per sample\]: the difference of two must fit the
/// fixed-point format's 2⁻⁶.
pub const INCREMENT_LIMIT_RAD: f64 = 0.0078;

/// Largest bias by specific force \[rad/s per m/s²\]: 100 °/h per g; real ones are below 0.1.
pub const BIAS_BY_FORCE_LIMIT: f64 = 5e-5;

/// Largest scale error per increment, or per its square \[1 per increment unit, or per its square\]: 4e-6 s²/rad² of a
/// cubic one at 4 kHz.
pub const SLOPE_LIMIT: f64 = 63.0;

/// Largest angle by the square of the force that a term takes off one sample \[increment units\]: 2⁻¹⁴, 2 °/h per g² at
/// 4 kHz; forty of them, at the largest velocity of one sample, keep to the fixed-point format of a sum.
pub const FORCE_SQUARED_LIMIT_RAD: f64 = 1.0 / 16384.0;

/// Largest tilt by force that a term corrects \[rad\], at the largest velocity of one sample: 1e-3, 0.6 µrad per m/s² at
/// 4 kHz. With it and the largest flexure the sums of tilts keep to their fixed-point format.
pub const TILT_BY_FORCE_LIMIT_RAD: f64 = 1.0 / 1024.0;

/// Most that the correction of a pickoff's cubic error and of crosstalk adds to one increment \[rad\]: 2⁻¹³, an eighth of
/// the largest dither increment.
pub const DITHER_ERROR_LIMIT_RAD: f64 = 1.0 / 8192.0;

/// Largest tilt by a cubic or a resonant flexure, each \[rad\]: with it and the largest linear flexure the sums of tilts
/// keep to their fixed-point format.
pub const FLEXURE_TERM_LIMIT_RAD: f64 = 1.0 / 1024.0;

/// Frequencies of a suspension's mode that a term corrects \[cycles per sample\]: 40 Hz to 2 kHz at 4 kHz.
pub const MODE_CYCLES_RANGE: (f64, f64) = (0.01, 0.5);

/// Dampings of a suspension's mode that are corrected \[1\].
pub const MODE_DAMPING_RANGE: (f64, f64) = (0.002, 0.99);

/// Largest magnetic flux density that a reading may have \[T\]: 0.1 is a strong magnet; beyond it is a sensor's fault.
pub const MAGNETIC_FIELD_LIMIT_T: f32 = 0.1;
