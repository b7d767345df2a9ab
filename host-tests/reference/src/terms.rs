//! Corrects readings for errors of gyros and accelerometers beyond bias, scale, installation and flexure.
//!
//! It takes, per period, the angles v \[rad\] about the sensing axes and the velocity increments u \[m/s\] in the body
//! frame. It gives both as they would be without the errors
//!
//! ```text
//! gyro i reads        ω_i(t − d_i) + (v_i/2) ω″_i + a_i |ω_i| + q_i ω_i² + c_i ω_i³ + Σ_j G_ij f_j
//!                     + Σ_j (U_ij df_j/dt + W_ij d²ω_j/dt²) + g_i f_i² + Σ_j c_ij B_j + b_i(ΔT) + r_i dT_i/dt + s_i(ΔT) ω_i + tilts δ_ij(ΔT) + τ_ij f_k
//! accelerometer i     f_i(t − d_i) + q_i f_i²
//! gyro i, of blocks   c_i p_i³ + Σ_j c_ij h_j p_j/(1 − s_i), an angle; p free of the pickoff's delay
//! ```
//!
//! to first order, with polynomials of second order in ΔT_i = T_i − T₀_i. Tilts turn the sensing axes as in Eq. (7), with
//! the signs of the rotation convention.
//!
//! Extrapolation ahead of the readings uses the polynomial of fourth degree through the last five angles A_k, …,
//! A_{k−4} at a period's end (Lagrange): A(k + d/T), and A″(k) by its second derivative; f_k likewise by the first
//! derivative of the velocity's polynomial. Before five angles are known the rate is taken to be steady.

use nalgebra::{Matrix3, Vector3};

use crate::Six;

/// T₀ \[K\], and the factors of ΔT and ΔT².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ByTemperature<T> {
    /// T₀ of each gyro \[K\]; 0: the first temperature that is set.
    pub reference_k: [f64; 3],
    /// Factor of ΔT.
    pub first: T,
    /// Factor of ΔT².
    pub second: T,
}

/// The errors' sizes; all 0 by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TermCalibration {
    /// b(ΔT) \[rad/s\].
    pub bias_temperature: ByTemperature<[f64; 3]>,
    /// r \[rad/K\].
    pub bias_temperature_rate: [f64; 3],
    /// s(ΔT) \[1\].
    pub scale_temperature: ByTemperature<[f64; 3]>,
    /// δ(ΔT) \[rad\].
    pub installation_temperature: ByTemperature<Six>,
    /// d of the gyros \[s\].
    pub gyro_delay_s: [f64; 3],
    /// v \[s²\].
    pub gyro_variance_s2: [f64; 3],
    /// a \[1\].
    pub asymmetry: [f64; 3],
    /// q \[s/rad\].
    pub quadratic_s: [f64; 3],
    /// c \[s²/rad²\].
    pub cubic_s2: [f64; 3],
    /// G, rows by gyro \[rad/s per m/s²\].
    pub bias_by_force: [[f64; 3]; 3],
    /// τ \[rad per m/s²\].
    pub tilt_by_force: Six,
    /// g \[rad/s per (m/s²)²\].
    pub bias_by_force_squared: [f64; 3],
    /// U, rows by gyro \[rad per m/s²\].
    pub elastic_by_force: [[f64; 3]; 3],
    /// W, rows by gyro \[s²\].
    pub elastic_by_jerk: [[f64; 3]; 3],
    /// c of the field, rows by gyro \[rad/s/T\].
    pub bias_magnetic: [[f64; 3]; 3],
    /// c of the pickoffs \[1/rad²\].
    pub dither_cubic: [f64; 3],
    /// c_ij, share of a block's angle that a neighbour senses \[1\].
    pub dither_crosstalk: Six,
    /// q of the accelerometers \[s²/m\].
    pub accelerometer_quadratic: [f64; 3],
    /// d of the accelerometers \[s\].
    pub accelerometer_delay_s: [f64; 3],
}

/// Correction of three delayed or smoothed paths at a period's end.
#[derive(Debug, Clone)]
struct Ahead {
    delay_periods: [f64; 3],
    variance_periods2: [f64; 3],
    /// The last four increments of each axis, latest first; none before the first and after a gap.
    increments: Option<[Vector3<f64>; 4]>,
    /// The last result.
    last: Option<Vector3<f64>>,
}

impl Ahead {
    fn new(delay_s: [f64; 3], variance_s2: [f64; 3], period_s: f64) -> Self {
        Self {
            delay_periods: delay_s.map(|delay| delay / period_s),
            variance_periods2: variance_s2.map(|variance| variance / period_s.powi(2)),
            increments: None,
            last: None,
        }
    }

    /// Takes a period's increment.
    ///
    /// # Returns
    /// The correction of the increment, and that of the angle beyond it since the last known period.
    fn take(&mut self, increment: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let resumes = self.increments.is_none();
        let [a, b, c, _] = self.increments.unwrap_or([increment; 4]);
        let latest = [increment, a, b, c];
        self.increments = Some(latest);
        let now = Vector3::from_fn(|axis, _| self.ahead(axis, latest.map(|one| one[axis])));
        let gained = now - self.last.unwrap_or(now);
        self.last = Some(now);
        if resumes {
            (Vector3::zeros(), gained)
        } else {
            (gained, Vector3::zeros())
        }
    }

    /// A(d) − A(0) − (v/2) A″(0) from the last increments, time in periods.
    fn ahead(&self, axis: usize, increments: [f64; 4]) -> f64 {
        // Angles at 0, −1, … −4, with A(0) = 0.
        let mut angles = [0.0; 5];
        for (at, increment) in increments.into_iter().enumerate() {
            angles[at + 1] = angles[at] - increment;
        }
        let time = self.delay_periods[axis];
        let extrapolated: f64 = (0..5)
            .map(|node| {
                let others = (0..5).filter(|other| *other != node);
                let basis: f64 = others
                    .map(|other| (time + other as f64) / (other as f64 - node as f64))
                    .product();
                basis * angles[node]
            })
            .sum();
        let second: f64 = [35.0, -104.0, 114.0, -56.0, 11.0]
            .iter()
            .zip(angles)
            .map(|(weight, angle)| weight / 12.0 * angle)
            .sum();
        extrapolated - 0.5 * self.variance_periods2[axis] * second
    }

    fn forget(&mut self) {
        self.increments = None;
    }
}

/// Excess angle by the blocks' elastic turns under force and acceleration at a period's end.
#[derive(Debug, Clone)]
struct Elastic {
    by_force: Matrix3<f64>,
    by_jerk: Matrix3<f64>,
    period_s: f64,
    /// The last four increments of angle and velocity, latest first; none before the first and after a gap.
    increments: Option<[[Vector3<f64>; 4]; 2]>,
    last: Option<Vector3<f64>>,
}

impl Elastic {
    fn new(known: &TermCalibration, period_s: f64) -> Self {
        let matrix = |rows: [[f64; 3]; 3]| Matrix3::from_fn(|row, column| rows[row][column]);
        Self {
            by_force: matrix(known.elastic_by_force),
            by_jerk: matrix(known.elastic_by_jerk),
            period_s,
            increments: None,
            last: None,
        }
    }

    /// Takes a period's increments of angle and velocity.
    ///
    /// # Returns
    /// The excess of the increment, and that of the angle beyond it since the last known period.
    fn take(
        &mut self,
        angle: Vector3<f64>,
        velocity: Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let resumes = self.increments.is_none();
        let [angles, velocities] = self.increments.unwrap_or([[angle; 4], [velocity; 4]]);
        let with = |now, [a, b, c, _]: [Vector3<f64>; 4]| [now, a, b, c];
        let latest = [with(angle, angles), with(velocity, velocities)];
        self.increments = Some(latest);
        let acceleration =
            derivative(&latest[0], [35.0, -104.0, 114.0, -56.0, 11.0]) / self.period_s.powi(2);
        let force = derivative(&latest[1], [25.0, -48.0, 36.0, -16.0, 3.0]) / self.period_s;
        let now = self.by_force * force + self.by_jerk * acceleration;
        let gained = now - self.last.unwrap_or(now);
        self.last = Some(now);
        if resumes {
            (Vector3::zeros(), gained)
        } else {
            (gained, Vector3::zeros())
        }
    }
}

/// A derivative at the last of five points, by weights in twelfths, from the increments between them, latest first.
fn derivative(increments: &[Vector3<f64>; 4], weights: [f64; 5]) -> Vector3<f64> {
    let mut before = Vector3::zeros();
    let mut sum = Vector3::zeros();
    for (increment, weight) in increments.iter().zip(&weights[1..]) {
        before -= increment;
        sum += before * (weight / 12.0);
    }
    sum
}

/// The errors, and the state of their corrections.
#[derive(Debug, Clone)]
pub struct Terms {
    known: TermCalibration,
    period_s: f64,
    temperature: Option<Temperature>,
    magnetic_field_t: Vector3<f64>,
    gyros: Ahead,
    accelerometers: Ahead,
    elastic: Elastic,
}

#[derive(Debug, Clone, Copy)]
struct Temperature {
    first_k: [f64; 3],
    now_k: [f64; 3],
    rate_k_s: [f64; 3],
}

impl Temperature {
    fn difference_k(&self, gyro: usize, reference_k: [f64; 3]) -> f64 {
        let reference = reference_k[gyro];
        self.now_k[gyro]
            - if reference == 0.0 {
                self.first_k[gyro]
            } else {
                reference
            }
    }
}

/// Both increments of one period without the errors, and angle and velocity that belong to no motion of this period.
#[derive(Debug, Clone, Copy)]
pub struct Corrected {
    /// About the sensing axes \[rad\].
    pub angle_rad: Vector3<f64>,
    /// Body frame \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// \[rad\].
    pub shifted_rad: Vector3<f64>,
    /// \[m/s\].
    pub shifted_m_s: Vector3<f64>,
}

impl TermCalibration {
    /// Excess angle of the gyros by blocks at these angles \[rad\], of pickoff gains h and scale errors s.
    pub fn of_blocks(
        &self,
        block: &Vector3<f64>,
        gain: [f64; 3],
        scale_error: [f64; 3],
    ) -> Vector3<f64> {
        let c = &self.dither_crosstalk;
        let across = Matrix3::new(
            0.0, c.xy, c.xz, //
            c.yx, 0.0, c.yz, //
            c.zx, c.zy, 0.0,
        ) * block;
        Vector3::from_fn(|i, _| {
            let pickoff = if gain[i] == 0.0 {
                0.0
            } else {
                block[i] / gain[i]
            };
            self.dither_cubic[i] * pickoff.powi(3) + across[i] / (1.0 - scale_error[i])
        })
    }
}

impl Terms {
    /// Before the first period.
    pub fn new(known: &TermCalibration, period_s: f64) -> Self {
        Self {
            known: *known,
            period_s,
            temperature: None,
            magnetic_field_t: Vector3::zeros(),
            gyros: Ahead::new(known.gyro_delay_s, known.gyro_variance_s2, period_s),
            accelerometers: Ahead::new(known.accelerometer_delay_s, [0.0; 3], period_s),
            elastic: Elastic::new(known, period_s),
        }
    }

    /// Sets the gyros' temperatures \[K\] and their derivatives \[K/s\], which hold until set anew.
    pub fn temperature(&mut self, now_k: [f64; 3], rate_k_s: [f64; 3]) {
        let first_k = self.temperature.map_or(now_k, |known| known.first_k);
        self.temperature = Some(Temperature {
            first_k,
            now_k,
            rate_k_s,
        });
    }

    /// Sets the magnetic flux density, body frame \[T\], which holds until set anew.
    pub fn magnetic_field(&mut self, now_t: [f64; 3]) {
        self.magnetic_field_t = now_t.into();
    }

    /// Removes the errors from one period's increments.
    pub fn correct(&mut self, angle: Vector3<f64>, velocity: Vector3<f64>) -> Corrected {
        let (velocity_ahead, shifted_m_s) = self.accelerometers.take(velocity);
        let warm = self.slow(angle, 1.0);
        let (ahead, shifted_rad) = self.gyros.take(warm);
        let prompt = warm + ahead;
        let known = &self.known;
        let nonlinear = Vector3::from_fn(|axis, _| {
            let rate = prompt[axis] / self.period_s;
            let read = known.asymmetry[axis] * rate.abs()
                + known.quadratic_s[axis] * rate.powi(2)
                + known.cubic_s2[axis] * rate.powi(3);
            read * self.period_s
        });
        let prompt_m_s = velocity + velocity_ahead;
        let quadratic = Vector3::from(known.accelerometer_quadratic);
        let felt = prompt_m_s
            - quadratic.component_mul(&prompt_m_s.component_mul(&prompt_m_s)) / self.period_s;
        let body = prompt - nonlinear;
        let rigid = body - self.by_force(velocity) - self.by_products(&body, &felt);
        let (bent, bent_meanwhile) = self.elastic.take(rigid, felt);
        Corrected {
            angle_rad: rigid - bent,
            velocity_m_s: felt,
            shifted_rad: shifted_rad - bent_meanwhile,
            shifted_m_s,
        }
    }

    /// The same for increments that cover several periods: rates within them are not known.
    pub fn correct_after_gap(
        &mut self,
        angle: Vector3<f64>,
        velocity: Vector3<f64>,
        periods: f64,
    ) -> Vector3<f64> {
        self.gyros.forget();
        self.accelerometers.forget();
        self.elastic.increments = None;
        let warm = self.slow(angle, periods);
        let asymmetry = Vector3::from(self.known.asymmetry).component_mul(&warm.abs());
        warm - asymmetry - self.by_force(velocity)
    }

    /// Returns `angle` less the effects of field and temperature over `periods`.
    fn slow(&self, angle: Vector3<f64>, periods: f64) -> Vector3<f64> {
        let magnetic = Vector3::from_fn(|i, _| {
            Vector3::from(self.known.bias_magnetic[i]).dot(&self.magnetic_field_t)
        });
        let angle = angle - magnetic * (self.period_s * periods);
        let Some(temperature) = self.temperature else {
            return angle;
        };
        let known = &self.known;
        let (bias, scale) = (&known.bias_temperature, &known.scale_temperature);
        let polynomial = |difference: f64, first: f64, second: f64| {
            first * difference + second * difference.powi(2)
        };
        let own = Vector3::from_fn(|i, _| {
            let b = polynomial(
                temperature.difference_k(i, bias.reference_k),
                bias.first[i],
                bias.second[i],
            ) + known.bias_temperature_rate[i] * temperature.rate_k_s[i];
            let s = polynomial(
                temperature.difference_k(i, scale.reference_k),
                scale.first[i],
                scale.second[i],
            );
            b * self.period_s * periods + s * angle[i]
        });
        let tilts = &known.installation_temperature;
        let delta = |gyro: usize, first: f64, second: f64| {
            polynomial(
                temperature.difference_k(gyro, tilts.reference_k),
                first,
                second,
            )
        };
        let (one, two) = (&tilts.first, &tilts.second);
        let turned = turned_by(&Six {
            xy: delta(0, one.xy, two.xy),
            xz: delta(0, one.xz, two.xz),
            yx: delta(1, one.yx, two.yx),
            yz: delta(1, one.yz, two.yz),
            zx: delta(2, one.zx, two.zx),
            zy: delta(2, one.zy, two.zy),
        });
        angle - own - turned * angle
    }

    /// Excess angle by one period's products of the force with the rate and with itself.
    fn by_products(&self, angle: &Vector3<f64>, velocity: &Vector3<f64>) -> Vector3<f64> {
        let force = velocity / self.period_s;
        let tau = &self.known.tilt_by_force;
        let tilts = turned_by(&Six {
            xy: tau.xy * force.z,
            xz: tau.xz * force.y,
            yx: tau.yx * force.z,
            yz: tau.yz * force.x,
            zx: tau.zx * force.y,
            zy: tau.zy * force.x,
        });
        let squares = Vector3::from(self.known.bias_by_force_squared);
        tilts * angle + squares.component_mul(&force.component_mul(&force)) * self.period_s
    }

    fn by_force(&self, velocity: Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| Vector3::from(self.known.bias_by_force[i]).dot(&velocity))
    }
}

/// Matrix of the excess rates by tilts δ_ij: with δ_xz gyro x senses δ_xz ω_y more, δ_xy −δ_xy ω_z; and round the axes.
fn turned_by(delta: &Six) -> Matrix3<f64> {
    Matrix3::new(
        0.0, delta.xz, -delta.xy, //
        -delta.yz, 0.0, delta.yx, //
        delta.zy, -delta.zx, 0.0,
    )
}
