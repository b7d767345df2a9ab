//! The chain's equations in f64: strip, Eq. (7), Eq. (6) with the settled signs, coning sums.

use trueaxis::{Parameters, Sample};

/// The equations over one stream.
pub struct Equations {
    parameters: Parameters,
    previous_codes: Option<[i32; 3]>,
    /// Increments of the case at rest, latest first, of three samples before and after the one that is corrected.
    history: Vec<[f64; 3]>,
    last_two: [[f64; 3]; 2],
    angle: [f64; 3],
    coning: [f64; 3],
    in_period: u16,
}

/// a_p of α̂_k = Σ a_p (D_{k+p} − D_{k−p})/T² (2 Σ a_p sin(p x) = x/sinc²(x/2) in powers of x; `acceleration.rs` tests them
/// against that).
pub const CENTRAL: [f64; 3] = [43.0 / 48.0, -29.0 / 120.0, 7.0 / 240.0];

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
        let e = p.installation_rad;
        let eq_7 = |r: [f64; 3]| {
            [
                r[0] + e.xy * r[2] + e.xz * r[1],
                r[1] + e.yz * r[0] + e.yx * r[2],
                r[2] + e.zx * r[1] + e.zy * r[0],
            ]
        };
        let now = eq_7(r);
        if self.history.is_empty() {
            self.history = vec![now; 7];
        }
        self.history.rotate_right(1);
        self.history[0] = now;
        // The sample three before has both its sides: the gyros' excess angle by its tilts is subtracted now.
        let mut a = [0.0; 3];
        for (c, pair) in CENTRAL.iter().zip(1..) {
            let (after, before) = (self.history[3 - pair], self.history[3 + pair]);
            for (a, (after, before)) in a.iter_mut().zip(after.iter().zip(before)) {
                *a += c * (after - before) / (period_s * period_s);
            }
        }
        let (k, d) = (p.flexure_s2, self.history[3]);
        let more = [
            -k.xz * a[2] * d[1] + k.xy * a[1] * d[2],
            -k.yx * a[0] * d[2] + k.yz * a[2] * d[0],
            -k.zy * a[1] * d[0] + k.zx * a[0] * d[1],
        ];
        eq_7([0, 1, 2].map(|i| r[i] - more[i]))
    }
}
