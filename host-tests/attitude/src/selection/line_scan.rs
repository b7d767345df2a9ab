//! Spectral lines of single gyros, in the whitened residual of a fit.

use nalgebra::Vector3;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::families::{Family, lines_about};
use rlg_inference::Dct;
use rlg_inference::lines::strongest;
use rlg_signal::axes::Triad;

use crate::gyros::scanned::{Scanned, Wave};
use crate::rows::blocks::Null;
use crate::selection::residual_scan::{Given, Sought};

/// Finds the line of largest statistic among the strongest of each gyro; `None` if none stands out of the neighbouring power.
///
/// # Inputs
/// `is_free`: true for a frequency \[Hz\] at which lines are sought.
pub(crate) fn seek(given: Given, null: &Null, is_free: &dyn Fn(f64) -> bool) -> Option<Sought> {
    let least = given.plan.attitude.least_gain;
    let coefficients = given.blocks.coefficients();
    let places = 3.0 * coefficients as f64;
    let span_s = span_s(&given);
    let by_gyro = on_gyros(&given, null);
    let lines = by_gyro.iter().enumerate().filter_map(|(axis, values)| {
        let mut spectrum = values.clone();
        Dct::new(coefficients).forward(&mut spectrum);
        let line = strongest(&spectrum, coefficients, &given.plan.inference.lines)?;
        let hz = line.share * coefficients as f64 / span_s;
        (line.surplus(places) > least && is_free(hz)).then_some(Wave {
            axis,
            hz,
            hz_std: f64::INFINITY,
        })
    });
    let fitted = lines.filter_map(|line| refined(&given, null, line));
    let best = fitted.max_by(|a, b| a.1.total_cmp(&b.1))?.0;
    let columns = best.columns(given.about, given.gyro);
    let sought = Sought {
        statistic: given.statistic(&columns),
        columns,
        scanned: best,
        places: places as usize,
    };
    given.is_beyond_drift(&sought).then_some(sought)
}

/// Duration of the fitted stamps \[s\].
fn span_s(given: &Given) -> f64 {
    let times_s = &given.about.increments.times_s;
    times_s[times_s.len() - 1] - times_s[0]
}

/// Whitened residual on each gyro, at equal intervals of time \[σ\].
fn on_gyros(given: &Given, null: &Null) -> Triad {
    let (about, coefficients) = (given.about, given.blocks.coefficients());
    let increments = &about.increments;
    let rows = increments.rows() as f64 / coefficients as f64;
    let residual: Triad = [0, 1, 2].map(|axis| null.residual(axis));
    let times_s = &increments.times_s;
    let at = |sample: usize| {
        let place = (sample as f64 + 0.5) * rows;
        let stamp = (place as usize).min(increments.rows() - 1);
        let share = place - stamp as f64;
        let time_s = times_s[stamp] + share * (times_s[stamp + 1] - times_s[stamp]);
        let value = Vector3::from_fn(|axis, _| residual[axis][sample]);
        let in_body = increments.in_body(&about.motion, stamp, value);
        (time_s, given.gyro.on_gyros(in_body))
    };
    let samples: Vec<(f64, Vector3<f64>)> = (0..coefficients).map(at).collect();
    let step_s = span_s(given) / coefficients as f64;
    let mut next = 1;
    let mut all = Triad::default();
    for sample in 0..coefficients {
        let time_s = times_s[0] + (sample as f64 + 0.5) * step_s;
        while next + 1 < coefficients && samples[next].0 < time_s {
            next += 1;
        }
        let ((from_s, from), (to_s, to)) = (samples[next - 1], samples[next]);
        let share = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
        let value = from.lerp(&to, share);
        for (axis, values) in all.iter_mut().enumerate() {
            values.push(value[axis]);
        }
    }
    all
}

/// Line of largest likelihood about another, with its gain in log likelihood: by a parabola through the best of a grid of
/// frequencies and its neighbours, amplitude and phase at their best in each.
fn refined(given: &Given, null: &Null, line: Wave) -> Option<(Scanned, f64)> {
    let Family { groups, .. } = lines_about(line.hz, 0.1, line.axis, &given.gyro.signals);
    let grid = groups.iter().filter_map(|pair| match pair[0].variant {
        Variant::Expression { expression, .. } => expression.wave_hz(),
        _ => None,
    });
    let gain = |hz: f64| {
        let columns = Scanned::Line(Wave { hz, ..line }).columns(given.about, given.gyro);
        given.blocks.project(null, &columns).gain().log_likelihood
    };
    let tried: Vec<(f64, f64)> = grid.map(|hz| (hz, gain(hz))).collect();
    let inner = tried.windows(3);
    let best = inner.max_by(|a, b| a[1].1.total_cmp(&b[1].1))?;
    let [(before_hz, before), (hz, most), (_, after)] = [best[0], best[1], best[2]];
    let step_hz = hz - before_hz;
    // Minus the second derivative of the log likelihood is the information on the frequency.
    let curvature = 2.0 * most - before - after;
    let is_peak = curvature > 0.0 && most >= before.max(after);
    let away = 0.5 * (after - before) / curvature;
    is_peak.then(|| {
        let found = Wave {
            hz: hz + away * step_hz,
            hz_std: step_hz / curvature.sqrt(),
            ..line
        };
        (Scanned::Line(found), most)
    })
}
