//! The chain's equations in f64: strip, Eq. (7), Eq. (6) with the settled signs, coning sums.

use trueaxis::{Parameters, Sample};

/// The equations over one stream.
pub struct Equations {
    parameters: Parameters,
    previous_codes: Option<[i32; 3]>,
    /// Latest first.
    history: Vec<[f64; 3]>,
    last_two: [[f64; 3]; 2],
    angle: [f64; 3],
    coning: [f64; 3],
    in_period: u16,
}

/// c_p of α̂ = Σ c_p (D_k − D_{k−p})/T², by order (physics: Σ c_p sin(p x) 2 (1 − cos x) = x³ in powers of x;
/// `acceleration.rs` tests them against that).
fn filter(order: u8) -> Vec<f64> {
    match order {
        1 => vec![1.0],
        2 => vec![1.5, -0.25],
        3 => vec![43.0 / 24.0, -29.0 / 60.0, 7.0 / 120.0],
        _ => vec![107.0 / 54.0, -727.0 / 1080.0, 44.0 / 315.0, -41.0 / 3024.0],
    }
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl Equations {
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: *parameters,
            previous_codes: None,
            history: Vec::new(),
            last_two: [[0.0; 3]; 2],
            angle: [0.0; 3],
            coning: [0.0; 3],
            in_period: 0,
        }
    }

    /// The rotation vector of the period that this sample ends \[rad\].
    pub fn process(&mut self, sample: &Sample) -> Option<[f64; 3]> {
        let case = match self.previous_codes.replace(sample.pickoff_codes) {
            None => [0.0; 3],
            Some(previous) => self.case(sample, previous),
        };
        let [one, two] = self.last_two;
        let lever = [0, 1, 2].map(|i| self.angle[i] / 2.0 + 7.0 / 60.0 * one[i] - two[i] / 60.0);
        let within = cross(lever, case);
        for i in 0..3 {
            self.coning[i] += within[i];
            self.angle[i] += case[i];
        }
        self.last_two = [case, one];
        self.in_period += 1;
        if self.in_period < self.parameters.samples_per_output {
            return None;
        }
        self.in_period = 0;
        let rotation = [0, 1, 2].map(|i| self.angle[i] + self.coning[i]);
        self.angle = [0.0; 3];
        self.coning = [0.0; 3];
        Some(rotation)
    }

    fn case(&mut self, sample: &Sample, previous: [i32; 3]) -> [f64; 3] {
        let p = &self.parameters;
        let period_s = 1.0 / p.sample_rate_hz;
        let r = [0, 1, 2].map(|i| {
            let sensed = p.pulse_weight_rad[i] * f64::from(sample.pulse_counts[i]);
            let step = i64::from(sample.pickoff_codes[i]) - i64::from(previous[i]);
            let stripped = sensed - p.pickoff_gain[i] * p.pickoff_weight_rad * step as f64;
            (1.0 - p.scale_error[i]) * stripped - p.bias_rad_s[i] * period_s
        });
        let e0 = p.installation_rad;
        let apply = |xy: f64, xz: f64, yx: f64, yz: f64, zx: f64, zy: f64| {
            [
                r[0] + xy * r[2] + xz * r[1],
                r[1] + yz * r[0] + yx * r[2],
                r[2] + zx * r[1] + zy * r[0],
            ]
        };
        let at_rest = apply(e0.xy, e0.xz, e0.yx, e0.yz, e0.zx, e0.zy);
        if self.history.is_empty() {
            self.history = vec![at_rest; 4];
        }
        let mut a = [0.0; 3];
        for (c, past) in filter(p.acceleration_order).iter().zip(&self.history) {
            for i in 0..3 {
                a[i] += c * (at_rest[i] - past[i]) / (period_s * period_s);
            }
        }
        self.history.rotate_right(1);
        self.history[0] = at_rest;
        let k = p.flexure_s2;
        apply(
            e0.xy - k.xy * a[1],
            e0.xz + k.xz * a[2],
            e0.yx + k.yx * a[0],
            e0.yz - k.yz * a[2],
            e0.zx - k.zx * a[0],
            e0.zy + k.zy * a[1],
        )
    }
}
