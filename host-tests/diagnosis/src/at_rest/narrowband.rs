//! Steady lines of a residual: coefficients far above their neighbours, removed or listed.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_inference::{Dct, Observations};
use rlg_plan::SteadyPlan;
use rlg_signal::quantiles::median;
use rlg_signal::streams::{Triad, each_axis};

/// Returns the values on the rows of the spans, each outlying coefficient reduced to its neighbours' level.
pub(super) fn without_lines(
    values: &Triad,
    observations: &Observations,
    plan: &SteadyPlan,
) -> Triad {
    each_axis(|axis| {
        let mut quiet = values[axis].clone();
        for span in &observations.spans {
            let mut rows = span.bridge(&quiet);
            let dct = Dct::new(rows.len());
            dct.forward(&mut rows);
            clip(&mut rows, plan);
            dct.inverse(&mut rows);
            quiet[span.rows.clone()].copy_from_slice(&rows);
        }
        quiet
    })
}

/// A steady line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steady {
    /// Frequency as a share of the row rate.
    pub(super) share: f64,
    /// Amplitude, in the unit of the values.
    pub(super) amplitude: f64,
}

/// Lists the steady lines of one channel: neighbouring coefficients count as one.
pub(super) fn lines(values: &[f64], observations: &Observations, plan: &SteadyPlan) -> Vec<Steady> {
    let mut found = Vec::new();
    for span in &observations.spans {
        let bridged = span.bridge(values);
        let mut before = bridged.clone();
        let rows = before.len() as f64;
        Dct::new(before.len()).forward(&mut before);
        let mut after = before.clone();
        clip(&mut after, plan);
        let is_out = |k: &usize| before[*k] != after[*k];
        let mut out = (0..before.len()).filter(is_out).peekable();
        while let Some(first) = out.next() {
            let mut last = first;
            while let Some(next) = out.next_if(|next| *next <= last + plan.beside / 2) {
                last = next;
            }
            let near = first.saturating_sub(1)..(last + 2).min(before.len());
            let power = |k: usize| before[k] * before[k];
            let sum: f64 = near.clone().map(power).sum();
            let middle: f64 = near.map(|k| power(k) * k as f64).sum::<f64>() / sum;
            found.push(refined(&bridged, 0.5 * middle / rows));
        }
    }
    found
}

/// Maximum of the periodogram within half a resolution about a frequency, by golden sections.
fn refined(values: &[f64], share: f64) -> Steady {
    /// To 1e-5 of a resolution.
    const SECTIONS: usize = 24;
    let rows = values.len() as f64;
    let amplitude = |share: f64| {
        let step = Complex64::from_polar(1.0, -TAU * share);
        let mut phase = Complex64::new(1.0, 0.0);
        let mut sum = Complex64::new(0.0, 0.0);
        for value in values {
            sum += phase * value;
            phase *= step;
        }
        2.0 * sum.norm() / rows
    };
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut from, mut to] = [share - 0.5 / rows, share + 0.5 / rows];
    for _ in 0..SECTIONS {
        let inner = [to - golden * (to - from), from + golden * (to - from)];
        match amplitude(inner[0]) > amplitude(inner[1]) {
            true => to = inner[1],
            false => from = inner[0],
        }
    }
    let share = 0.5 * (from + to);
    Steady {
        share,
        amplitude: amplitude(share),
    }
}

fn clip(spectrum: &mut [f64], plan: &SteadyPlan) {
    let SteadyPlan {
        first,
        beside,
        far_out,
    } = *plan;
    let power: Vec<f64> = spectrum.iter().map(|value| value * value).collect();
    for k in first..power.len() {
        let near = k.saturating_sub(beside).max(first / 2)..(k + beside + 1).min(power.len());
        // A power that is small against the mean needs no median.
        let mean = power[near.clone()].iter().sum::<f64>() / near.len() as f64;
        if power[k] < 2.0 * mean {
            continue;
        }
        let median = median(power[near].iter().copied()).unwrap_or(0.0);
        if power[k] > far_out * median {
            spectrum[k] *= (median / power[k]).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{clip, lines};
    use rlg_inference::Observations;

    #[test]
    fn a_line_goes_and_what_is_as_strong_as_its_neighbours_stays() {
        let mut spectrum: Vec<f64> = (0..500).map(|k| 1.0 + f64::from(k % 7) / 7.0).collect();
        let before = spectrum.clone();
        spectrum[200] = 1e3;
        spectrum[3] = 1e5;
        clip(&mut spectrum, &rlg_plan::SteadyPlan::default());
        assert!(spectrum[200].abs() < 2.0);
        assert_eq!(spectrum[3], 1e5);
        assert_eq!(spectrum[201..], before[201..]);
    }

    #[test]
    fn a_line_is_listed_once_with_its_frequency_and_amplitude() {
        let noise = |row: usize| (row as f64 * 0.754_877_666).fract() - 0.5;
        let turn = std::f64::consts::TAU * 0.1234;
        let values: Vec<f64> = (0..6000)
            .map(|row| noise(row * row) + 0.8 * (turn * row as f64 + 0.4).sin())
            .collect();
        let seen = Observations::bridged(&[true; 6000]).expect("rows");
        let found = lines(&values, &seen, &rlg_plan::SteadyPlan::default());
        let [line] = found[..] else {
            panic!("{found:?}");
        };
        assert!((line.share - 0.1234).abs() < 1e-6, "{line:?}");
        assert!((line.amplitude - 0.8).abs() < 0.01, "{line:?}");
    }
}
