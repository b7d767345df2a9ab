//! Values with their time derivatives, and the smooth steps of the motions.
//!
//! A jet at time t (s) is a value and its derivatives per s, per s², and so on.
//!
//! Equation: 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷, the lowest-order step from 0 to 1 with three continuous derivatives, as required by
//! jerk (the second derivative of a rate, itself a first derivative).

/// Value and first three derivatives of a scalar of time.
pub type Jet = [f64; 4];

/// Value and first two derivatives.
pub type ShortJet = [f64; 3];

/// Step from 0 to 1 over `duration_s`.
pub fn smooth_step(time_s: f64, duration_s: f64) -> Jet {
    if time_s <= 0.0 {
        return [0.0; 4];
    }
    if time_s >= duration_s {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let x = time_s / duration_s;
    let y = 1.0 - x;
    let per_s = 1.0 / duration_s;
    [
        x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))),
        140.0 * (x * y).powi(3) * per_s,
        420.0 * (x * y).powi(2) * (1.0 - 2.0 * x) * per_s.powi(2),
        840.0 * x * y * (1.0 - 5.0 * x * y) * per_s.powi(3),
    ]
}

/// Taper: up over `ramp_s`, 1, down over `ramp_s` at the end of `duration_s`.
pub fn taper(time_s: f64, duration_s: f64, ramp_s: f64) -> Jet {
    if 2.0 * time_s <= duration_s {
        smooth_step(time_s, ramp_s)
    } else {
        let [value, first, second, third] = smooth_step(duration_s - time_s, ramp_s);
        [value, -first, second, -third]
    }
}

/// a·b by Leibniz's rule, three derivatives.
pub fn product(a: &Jet, b: &Jet) -> Jet {
    [
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
        a[3] * b[0] + 3.0 * (a[2] * b[1] + a[1] * b[2]) + a[0] * b[3],
    ]
}

/// a·b by Leibniz's rule, two derivatives.
pub fn short_product(a: &ShortJet, b: &ShortJet) -> ShortJet {
    [
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
    ]
}
