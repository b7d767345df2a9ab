//! Whitening of rows and columns: division by the noise, restriction to the analysed band, projection of free rows.

use nalgebra::{DMatrix, DVector};
use rlg_inference::Dct;
use rlg_inference::linear::invert;
use rlg_signal::axes::Triad;

use crate::likelihood::equations::{Band, BandNoise};
use crate::likelihood::noise::{Alike, Along, Levels};
use crate::rows::increments::Increments;

/// Whitening transform of rows and columns.
#[derive(Clone)]
pub(crate) struct Whitener<'a> {
    pub(crate) band: &'a Band,
    inverse: Dct,
    alike: Alike,
    along: Along,
    /// Weights by noise group.
    groups: Vec<OfGroup>,
}

/// Whitening weights of one noise group.
#[derive(Clone)]
struct OfGroup {
    weights: Vec<f64>,
    /// Whitened spectra of free rows, one axis.
    free: Vec<Vec<f64>>,
    of_free: DMatrix<f64>,
}

impl<'a> Whitener<'a> {
    pub(crate) fn new(
        BandNoise { band, terms }: &'a BandNoise,
        levels: &Levels,
        increments: &Increments,
    ) -> Self {
        let along = levels.along(&band.octaves, &increments.times_s);
        let of_group = |axes: &&[usize]| {
            let powers = terms.of_coefficients(levels.of(axes[0]));
            let powers = powers[..band.cut].iter();
            let weights: Vec<f64> = powers.map(|power| 1.0 / power.sqrt()).collect();
            let free = increments.free.iter();
            let rows: Vec<Vec<f64>> = free
                .map(|&row| weighted(&weights, band.levelled(band.of_row(row), &along[axes[0]])))
                .collect();
            let gram = DMatrix::from_fn(rows.len(), rows.len(), |a, b| dot(&rows[a], &rows[b]));
            OfGroup {
                weights,
                of_free: invert(&gram).0,
                free: rows,
            }
        };
        Self {
            groups: terms.alike.iter().map(of_group).collect(),
            alike: terms.alike,
            inverse: Dct::new(band.cut),
            along,
            band,
        }
    }

    /// Whitens values to rows of unit variance, `band.cut` of each axis.
    pub(crate) fn whiten(&self, values: &Triad) -> Triad {
        let mut all = Triad::default();
        for (axes, group) in self.alike.iter().zip(&self.groups) {
            for &axis in *axes {
                let spectrum = self.band.spectrum(&values[axis]);
                let spectrum = self.band.levelled(spectrum, &self.along[axis]);
                let mut white = weighted(&group.weights, spectrum);
                let along = group.free.iter().map(|free| dot(free, &white));
                let along = DVector::from_iterator(group.free.len(), along);
                let sizes = &group.of_free * along;
                for (free, size) in group.free.iter().zip(sizes.iter()) {
                    rlg_signal::axes::add(&mut white, free, -size);
                }
                self.inverse.inverse(&mut white);
                all[axis] = white;
            }
        }
        all
    }
}

fn weighted(weights: &[f64], mut spectrum: Vec<f64>) -> Vec<f64> {
    for (value, weight) in spectrum.iter_mut().zip(weights) {
        *value *= weight;
    }
    spectrum
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
