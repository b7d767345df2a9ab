//! Spectrum in octaves, each as a time series: the distribution of noise over time and frequency.
//!
//! The coefficients m + 1 to 2 m of a DCT-II, in reverse order, are those of m samples of the band-passed record, evenly
//! spaced (Shannon's wavelets; Mallat, A Wavelet Tour of Signal Processing, 3rd ed., sec. 7.2.2). The transform is
//! orthonormal: white noise stays white.

use std::ops::Range;

use rlg_inference::Dct;
use rlg_plan::AttitudeBandPlan;

use crate::likelihood::modulation::Modulation;

/// Octave bands; the lowest reaches down to the constant, and a few of the highest coefficients are in none.
#[derive(Clone)]
pub struct Octaves(Vec<Octave>);

#[derive(Clone)]
struct Octave {
    range: Range<usize>,
    /// The highest coefficient is the lowest of the series.
    is_reversed: bool,
    dct: Dct,
}

impl Octave {
    fn series(&self, spectrum: &[f64]) -> Vec<f64> {
        let mut values = spectrum[self.range.clone()].to_vec();
        if self.is_reversed {
            values.reverse();
        }
        self.dct.inverse(&mut values);
        values
    }

    fn set(&self, spectrum: &mut [f64], mut series: Vec<f64>) {
        self.dct.forward(&mut series);
        if self.is_reversed {
            series.reverse();
        }
        spectrum[self.range.clone()].copy_from_slice(&series);
    }
}

impl Octaves {
    /// Divides the first `cut` coefficients into octaves.
    pub fn new(cut: usize, plan: &AttitudeBandPlan) -> Self {
        let mut halvings = 0;
        while (cut - 1) >> (halvings + 1) >= plan.least_of_octave && halvings < plan.most_octaves {
            halvings += 1;
        }
        let lowest = (cut - 1) >> halvings;
        let lowest_band = std::iter::once((0..lowest + 1, false));
        let others = (0..halvings).map(|octave| {
            let from = lowest << octave;
            (from + 1..2 * from + 1, true)
        });
        let octaves = lowest_band
            .chain(others)
            .map(|(range, is_reversed)| Octave {
                dct: Dct::new(range.len()),
                range,
                is_reversed,
            });
        Self(octaves.collect())
    }

    /// Number of samples of each octave, the lowest first.
    pub fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().map(|octave| octave.range.len())
    }

    /// Time series of each octave along the record.
    pub fn series<'a>(&'a self, spectrum: &'a [f64]) -> impl Iterator<Item = Vec<f64>> + 'a {
        self.0.iter().map(|octave| octave.series(spectrum))
    }

    /// Divides every sample by its level; an empty spectrum stays empty.
    pub fn divide(&self, spectrum: &mut [f64], levels: &[Option<Vec<f64>>]) {
        if spectrum.is_empty() {
            return;
        }
        for (octave, levels) in self.0.iter().zip(levels) {
            if let Some(levels) = levels {
                let mut series = octave.series(spectrum);
                for (value, level) in series.iter_mut().zip(levels) {
                    *value /= level;
                }
                octave.set(spectrum, series);
            }
        }
    }

    /// Computes the level of every sample, by octave, for rows bounded by `times_s`.
    ///
    /// # Inputs
    /// `modulations`: of each octave; empty if all levels are constant.
    pub fn levels(&self, modulations: &[Modulation], times_s: &[f64]) -> Vec<Option<Vec<f64>>> {
        let pairs = self.counts().zip(modulations);
        pairs
            .map(|(count, modulation)| {
                let at = |sample: usize| modulation.at(time_s(times_s, sample as f64 + 0.5, count));
                (!modulation.is_none()).then(|| (0..count).map(at).collect())
            })
            .collect()
    }
}

/// Time of a place among `count` samples of a record \[s\].
pub fn time_s(times_s: &[f64], place: f64, count: usize) -> f64 {
    let last = times_s.len() - 1;
    let stamp = place / count as f64 * last as f64;
    let before = (stamp as usize).min(last - 1);
    let share = stamp - before as f64;
    times_s[before] + share * (times_s[before + 1] - times_s[before])
}

#[cfg(test)]
mod tests {
    use rlg_inference::Dct;

    use super::Octaves;

    /// A short event appears at its time in every octave, and division by 1 is the identity.
    #[test]
    fn a_short_event_stays_where_it_is() {
        let rows = 2048;
        let at = 700;
        let mut values = vec![0.0; rows];
        // A broadband event, so that no phase is special.
        for (k, value) in values[at..at + 16].iter_mut().enumerate() {
            *value = (1.7 * (k * k) as f64).sin();
        }
        let mut spectrum = values.clone();
        Dct::new(rows).forward(&mut spectrum);
        let octaves = Octaves::new(rows, &Default::default());
        let mut same = spectrum.clone();
        let ones: Vec<_> = octaves
            .counts()
            .map(|count| Some(vec![1.0; count]))
            .collect();
        octaves.divide(&mut same, &ones);
        for (same, was) in same.iter().zip(&spectrum) {
            assert!((same - was).abs() < 1e-12);
        }
        for series in octaves
            .series(&spectrum)
            .filter(|series| series.len() >= 128)
        {
            let place = (at + 8) * series.len() / rows;
            let all: f64 = series.iter().map(|value| value * value).sum();
            let near = series[place.saturating_sub(4)..place + 5].iter();
            let near: f64 = near.map(|value| value * value).sum();
            assert!(
                near > 0.85 * all,
                "{} samples: {near} of {all}",
                series.len()
            );
        }
    }
}
