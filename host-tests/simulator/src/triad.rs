//! Gyros, pickoffs, accelerometers and slow sensors: the recorded values of one row.
//!
//! From the window of periods around the row, one value a column, in the layout's order.
//!
//! Equation, per period T: sensed increment of gyro i = (∫ \[M⁻¹ω + effects\] dt + b T/(1 − s))_i /(1 − s_i) + block
//! increment (the contract's form), converted to the angle of the beat (`lock_in`), plus the random walk; counted. An
//! accelerometer measures (f + errors + b/(1 − s))/(1 − s), with the gyros' sign convention.

use super::attitude::Quadrature;
use super::dither::BlockDither;
use super::effects::faults::Fault;
use super::instrument::{PulseCounter, Seeds, Stream, normal, stream};
use super::layout::TableLayout;
use super::lock_in::{BeatPhase, sub_steps};
use super::references::ReferenceTriad;
use super::scenario::{GyroOutput, Scenario};
use super::slow_channels::SlowChannels;
use super::window::{Shift, Window};
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Angular acceleration of the case for which the beat's sub-steps are sized, in addition to the dither's \[rad/s²\]: twice
/// that of coning at 15 Hz and 0.63°.
const CASE_ACCELERATION_RAD_S2: f64 = 200.0;

/// Instruments and their states.
pub struct Triad<'a> {
    scenario: &'a Scenario,
    quadrature: &'a Quadrature,
    period_s: f64,
    counters: Vec<PulseCounter>,
    converters: Vec<Option<PulseCounter>>,
    gyro_rngs: Vec<ChaCha8Rng>,
    bias_walk_rad_s: [f64; 3],
    gyro_shifts: [Option<Shift>; 3],
    zeroings: [Option<Zeroing>; 3],
    lasers: [Option<BeatPhase>; 3],
    /// Cumulative weights of the nodes at the sub-steps' ends, in periods.
    sub_weights: Vec<[f64; 4]>,
    sub_blocks_rad: Vec<[f64; 3]>,
    /// Dithers, which also move the case.
    pub dithers: Vec<BlockDither>,
    pickoff_rngs: Vec<ChaCha8Rng>,
    block_before_rad: [f64; 3],
    references: Vec<ReferenceTriad<'a>>,
    accelerometer_rngs: Vec<ChaCha8Rng>,
    accelerometer_shifts: [Option<Shift>; 3],
    thermometer_rngs: Vec<ChaCha8Rng>,
    magnetometer_rngs: Vec<ChaCha8Rng>,
    slow_channels: Option<SlowChannels<'a>>,
    faults: Vec<(usize, usize, f64, Fault)>,
}

/// Automatic zeroing of a gyro: the mean rate that it takes away follows the sensed rate.
struct Zeroing {
    /// Periods of a time constant.
    periods: f64,
    /// Angle a period that is taken away, at a period's begin \[rad\].
    mean_rad: f64,
}

impl Zeroing {
    fn new(time_s: f64, period_s: f64) -> Option<Self> {
        (time_s > 0.0).then(|| Self {
            periods: time_s / period_s,
            mean_rad: 0.0,
        })
    }

    /// Angle that is taken away from a period in which the gyro sensed `sensed_rad`: what is known before it.
    fn passed_rad(&mut self, sensed_rad: f64) -> f64 {
        let known_rad = self.mean_rad;
        let kept = 1.0 - self.periods.recip();
        self.mean_rad = kept * known_rad + sensed_rad / self.periods;
        known_rad
    }
}

impl<'a> Triad<'a> {
    /// Instruments before the first row.
    pub fn new(
        scenario: &'a Scenario,
        tables: &[TableLayout],
        seeds: Seeds,
        quadrature: &'a Quadrature,
    ) -> Self {
        let period_s = 1.0 / scenario.rate_hz;
        let effects = &scenario.effects;
        let duration_s = scenario.rows() as f64 * period_s;
        let streams = |kind| (0..3).map(move |axis| stream(seeds, kind, axis));
        let mut gyro_rngs: Vec<_> = streams(Stream::Gyro).collect();
        let counters = gyro_rngs
            .iter_mut()
            .zip(scenario.gyro.pulse_weight_rad)
            .map(|(rng, weight_rad)| PulseCounter::new(weight_rad, rng))
            .collect();
        let converters = streams(Stream::Converter).enumerate();
        let converters = converters.map(|(axis, mut rng)| {
            let weight_rad = effects.converter_rad(axis);
            (weight_rad > 0.0).then(|| PulseCounter::new(weight_rad, &mut rng))
        });
        let dithers = scenario.dither.iter().flat_map(|dither| {
            streams(Stream::Dither)
                .enumerate()
                .map(move |(axis, mut rng)| {
                    BlockDither::new(
                        dither.frequency_hz[axis],
                        dither.amplitude_rad[axis],
                        dither.amplitude_spread,
                        scenario.start_s,
                        duration_s,
                        &mut rng,
                    )
                    .with_factors(scenario.unit_faults.dither_factors(axis))
                })
        });
        let shift =
            |delay_s: f64| (delay_s != 0.0).then(|| Shift::new(delay_s, quadrature, period_s));
        let (lasers, steps) = lasers(scenario, seeds, period_s);
        let mut triad = Self {
            scenario,
            quadrature,
            period_s,
            counters,
            converters: converters.collect(),
            gyro_rngs,
            bias_walk_rad_s: [0.0; 3],
            gyro_shifts: [0, 1, 2].map(|axis| shift(effects.gyro_delay_s(axis))),
            zeroings: [0, 1, 2].map(|axis| Zeroing::new(effects.high_pass_s(axis), period_s)),
            lasers,
            sub_weights: (0..=steps)
                .map(|step| quadrature.weights_until(step as f64 / steps.max(1) as f64))
                .collect(),
            sub_blocks_rad: vec![[0.0; 3]; steps + 1],
            dithers: dithers.collect(),
            pickoff_rngs: streams(Stream::Pickoff).collect(),
            block_before_rad: [0.0; 3],
            references: ReferenceTriad::all(scenario, seeds, quadrature),
            accelerometer_rngs: streams(Stream::Accelerometer).collect(),
            accelerometer_shifts: [0, 1, 2].map(|axis| shift(effects.accelerometer_delay_s(axis))),
            thermometer_rngs: streams(Stream::Thermometer).collect(),
            magnetometer_rngs: streams(Stream::Magnetometer).collect(),
            slow_channels: scenario.slow_channels.as_ref().map(|entry| {
                SlowChannels::new(entry, &scenario.unit_faults, scenario.start_s, seeds)
            }),
            faults: faults(scenario, tables),
        };
        triad.block_before_rad = triad.sensed_block_rad(scenario.start_s);
        triad
    }

    /// Number of rows needed before the recorded one, and after it.
    pub fn reach(&self) -> (usize, usize) {
        let shifts = self.gyro_shifts.iter().chain(&self.accelerometer_shifts);
        let reaches = shifts.flatten().map(Shift::reach);
        let references = self.references.iter().map(ReferenceTriad::reach);
        reaches
            .chain(references)
            .fold((0, 0), |(behind, ahead), (b, a)| {
                (behind.max(b), ahead.max(a))
            })
    }

    /// Writes row `row` into `rows`, a vector a table; slow tables stay empty between their rows.
    pub fn read(&mut self, row: usize, window: &Window, rows: &mut [Vec<f64>]) {
        rows.iter_mut().for_each(Vec::clear);
        let scenario = self.scenario;
        let begin_s = scenario.start_s + row as f64 * self.period_s;
        let end_s = scenario.start_s + (row + 1) as f64 * self.period_s;
        let counts = self.gyros(window, begin_s, end_s);
        rows[0].extend(counts);
        self.pickoffs(end_s, &mut rows[0]);
        let mut table = 1;
        for index in 0..self.references.len() {
            let reading = self.references[index].read(window, self.quadrature, self.period_s);
            if index == 0 && scenario.reference.is_some() {
                rows[0].extend(reading);
            } else {
                rows[table].extend(reading);
                table += 1;
            }
        }
        self.accelerometers(window, &mut rows[0]);
        if let Some(attitude) = self.references.first_mut().and_then(|r| r.attitude(window)) {
            rows[0].extend(attitude);
        }
        if let Some(thermal) = &scenario.thermal {
            if due(row, scenario.rate_hz / thermal.rate_hz) {
                for (axis, rng) in self.thermometer_rngs.iter_mut().enumerate() {
                    let reading = thermal.start_k
                        + window.now().warming_k[axis]
                        + thermal.sensor_noise_k * normal(rng);
                    rows[table].push(rounded(reading, thermal.sensor_weight_k));
                }
            }
            table += 1;
        }
        if let Some(magnetic) = &scenario.magnetic {
            if due(row, scenario.rate_hz / magnetic.rate_hz) {
                for (axis, rng) in self.magnetometer_rngs.iter_mut().enumerate() {
                    let reading =
                        window.now().field_t[axis] + magnetic.sensor_noise_t * normal(rng);
                    rows[table].push(rounded(reading, magnetic.sensor_weight_t));
                }
            }
            table += 1;
        }
        if let Some((slow, entry)) = self
            .slow_channels
            .as_mut()
            .zip(scenario.slow_channels.as_ref())
            && due(row, scenario.rate_hz / entry.rate_hz)
        {
            slow.read(end_s, &window.now().warming_k, &mut rows[table]);
        }
        for (table, column, weight, fault) in &mut self.faults {
            if let Some(value) = rows[*table].get_mut(*column) {
                *value = fault.keep(*value, begin_s, *weight);
            }
        }
    }

    fn pickoff_angle_rad(&self, axis: usize, time_s: f64) -> f64 {
        self.dithers
            .get(axis)
            .map_or(0.0, |dither| dither.angle_rad(time_s))
    }

    fn sensed_block_rad(&self, time_s: f64) -> [f64; 3] {
        let Some(dither) = &self.scenario.dither else {
            return [0.0; 3];
        };
        let pickoff = std::array::from_fn(|axis| self.pickoff_angle_rad(axis, time_s));
        let effects = &self.scenario.effects;
        let block = effects.block_angle_rad(dither.pickoff_gain, pickoff);
        effects.sensed_block_angle_rad(block, self.scenario.gyro.scale_error)
    }

    fn gyros(&mut self, window: &Window, begin_s: f64, end_s: f64) -> [f64; 3] {
        let scenario = self.scenario;
        let effects = &scenario.effects;
        let gyro = &scenario.gyro;
        let now = window.now();
        let block_rad = self.sensed_block_rad(end_s);
        let whole_rad = self.quadrature.integrate(&now.sensed_rad_s, self.period_s);
        if self.lasers.iter().any(Option::is_some) {
            let last = self.sub_blocks_rad.len() - 1;
            self.sub_blocks_rad[0] = self.block_before_rad;
            for step in 1..last {
                let share = step as f64 / last as f64;
                self.sub_blocks_rad[step] = self.sensed_block_rad(begin_s + share * self.period_s);
            }
            self.sub_blocks_rad[last] = block_rad;
        }
        let mut readings = [0.0; 3];
        for axis in 0..3 {
            let keep = 1.0 - gyro.scale_error[axis];
            let rng = &mut self.gyro_rngs[axis];
            let mut case_rad = whole_rad[axis]
                + gyro.bias_rad_s[axis] * self.period_s / keep
                + effects.stepped_angle_rad(axis, begin_s, end_s);
            if let Some(shift) = &self.gyro_shifts[axis] {
                case_rad += window.shifted(shift, |period| period.case_rad_s)[axis]
                    - self.quadrature.integrate(&now.case_rad_s, self.period_s)[axis];
            }
            if gyro.rate_random_walk_rad_s_sqrt_s[axis] > 0.0 {
                self.bias_walk_rad_s[axis] +=
                    gyro.rate_random_walk_rad_s_sqrt_s[axis] * self.period_s.sqrt() * normal(rng);
                case_rad += self.bias_walk_rad_s[axis] * self.period_s;
            }
            if let Some(zeroing) = &mut self.zeroings[axis] {
                case_rad -= zeroing.passed_rad(case_rad);
            }
            // a scale that depends on temperature acts on the dither too
            let stretch = 1.0 + effects.warm_scale(axis, now.warming_k[axis]) / keep;
            let walk_rad = effects.angle_random_walk(axis, gyro.angle_random_walk_rad_sqrt_s[axis])
                * self.period_s.sqrt()
                * normal(rng);
            let beat_rad = match &mut self.lasers[axis] {
                None => case_rad / keep + (block_rad[axis] - self.block_before_rad[axis]) * stretch,
                Some(laser) => {
                    let nodes = now.sensed_rad_s.map(|node| node[axis] * self.period_s);
                    // contributions outside the nodes are spread evenly
                    let even_rad = case_rad - whole_rad[axis];
                    let steps = self.sub_weights.len() - 1;
                    let step_s = self.period_s / steps as f64;
                    let mut shown_rad = 0.0;
                    for step in 0..steps {
                        let (from, to) = (&self.sub_weights[step], &self.sub_weights[step + 1]);
                        let turned: f64 = (0..4).map(|j| (to[j] - from[j]) * nodes[j]).sum();
                        let block =
                            self.sub_blocks_rad[step + 1][axis] - self.sub_blocks_rad[step][axis];
                        let angle = (turned + even_rad / steps as f64) / keep + block * stretch;
                        shown_rad += laser.step(angle, step_s);
                    }
                    laser.disturb(walk_rad);
                    shown_rad
                }
            };
            let mut sensed_rad =
                beat_rad + effects.slipped_angle_rad(axis, begin_s, end_s) + walk_rad;
            if let Some(converter) = &mut self.converters[axis] {
                sensed_rad = converter.count(sensed_rad) * effects.converter_rad(axis);
            }
            readings[axis] = self.counters[axis].count(sensed_rad);
            if gyro.output == GyroOutput::Increment {
                readings[axis] *= gyro.pulse_weight_rad[axis];
            }
        }
        self.block_before_rad = block_rad;
        readings
    }

    fn pickoffs(&mut self, end_s: f64, row: &mut Vec<f64>) {
        let Some(dither) = &self.scenario.dither else {
            return;
        };
        for axis in 0..3 {
            let shown_s = end_s - self.scenario.effects.dither_delay_s(axis);
            let angle_rad = self.pickoff_angle_rad(axis, shown_s)
                + dither.pickoff_noise_rad[axis] * normal(&mut self.pickoff_rngs[axis]);
            row.push(rounded(angle_rad, dither.pickoff_weight_rad));
        }
    }

    fn accelerometers(&mut self, window: &Window, row: &mut Vec<f64>) {
        let Some(accelerometer) = &self.scenario.accelerometer else {
            return;
        };
        let effects = &self.scenario.effects;
        let mut force = self.quadrature.integrate(&window.now().force_m_s2, 1.0);
        for (axis, shift) in self.accelerometer_shifts.iter().enumerate() {
            if let Some(shift) = shift {
                let late: Vector3<f64> = window.shifted(shift, |period| period.force_m_s2);
                force[axis] = late[axis] * self.scenario.rate_hz;
            }
        }
        let felt = force + effects.accelerometer_error(&force);
        // white noise of one-sided density n, averaged over a row
        let noise = accelerometer.noise_m_s2_sqrt_hz * (0.5 * self.scenario.rate_hz).sqrt();
        for (axis, rng) in self.accelerometer_rngs.iter_mut().enumerate() {
            let keep = 1.0 - accelerometer.scale_error[axis];
            let reading =
                (felt[axis] + accelerometer.bias_m_s2[axis] / keep) / keep + noise * normal(rng);
            row.push(rounded(reading, accelerometer.weight_m_s2));
        }
    }
}

/// Faults of channels, each with its table, its column and the column's resolution.
fn faults(scenario: &Scenario, tables: &[TableLayout]) -> Vec<(usize, usize, f64, Fault)> {
    let mut found = Vec::new();
    let of_unit = scenario.unit_faults.of_channels();
    for entry in scenario.effects.faults().iter().chain(&of_unit) {
        for (table, layout) in tables.iter().enumerate() {
            for (index, column) in layout.columns.iter().enumerate() {
                if column.fault_name.as_ref() == Some(&entry.channel) {
                    let weight = column.weight.unwrap_or(f64::MIN_POSITIVE);
                    found.push((table, index, weight, Fault::new(entry)));
                }
            }
        }
    }
    found
}

/// Beats with lock-in, and the sub-steps per row for the fastest of them.
fn lasers(scenario: &Scenario, seeds: Seeds, period_s: f64) -> ([Option<BeatPhase>; 3], usize) {
    let mut steps = 0;
    let lasers = [0, 1, 2].map(|axis| {
        let threshold_rad_s = scenario.effects.lock_in_rad_s(axis);
        if threshold_rad_s == 0.0 {
            return None;
        }
        let dithered = scenario.dither.as_ref().map_or(0.0, |dither| {
            dither.pickoff_gain[axis]
                * dither.amplitude_rad[axis]
                * (TAU * dither.frequency_hz[axis]).powi(2)
                * (1.0 + dither.amplitude_spread)
        });
        let pulse_rad = scenario.gyro.pulse_weight_rad[axis];
        let acceleration = dithered + CASE_ACCELERATION_RAD_S2;
        steps = steps.max(sub_steps(acceleration, pulse_rad, period_s));
        let phase_rad = stream(seeds, Stream::LockIn, axis).random::<f64>() * TAU;
        Some(BeatPhase::new(pulse_rad, threshold_rad_s, phase_rad))
    });
    (lasers, steps)
}

/// True if a row completes a row of a table that is `rows` times slower.
fn due(row: usize, rows: f64) -> bool {
    (row + 1).is_multiple_of(rows.round() as usize)
}

fn rounded(value: f64, weight: f64) -> f64 {
    (value / weight).round() * weight
}
