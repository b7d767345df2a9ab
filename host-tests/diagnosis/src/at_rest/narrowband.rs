//! Removes steady lines from a residual: coefficients far above their neighbours.

use rlg_inference::{Dct, Observations};
use rlg_plan::SteadyPlan;
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
        let mut near = power[near].to_vec();
        let middle = near.len() / 2;
        let median = *near.select_nth_unstable_by(middle, f64::total_cmp).1;
        if power[k] > far_out * median {
            spectrum[k] *= (median / power[k]).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::clip;

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
}
