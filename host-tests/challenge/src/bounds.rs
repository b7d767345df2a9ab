//! Attainable accuracy: strengths, separations and the Cramér–Rao bound, from inner products of predictions.
//!
//! From the Fisher information of the catalogue ([`PredictionProducts`]) and an effect's prediction s: the matched-filter
//! SNR ρ = |s|, its remainder given other effects |(I − P)s|, and the joint bound of the parameters.

use nalgebra::{DMatrix, DVector};

use super::kinds::LINEAR;
use super::predict::PredictionProducts;

/// Standard deviation, in typical sizes, of the weak prior on each parameter: it keeps inverses finite and changes bounds
/// by a part in a million. A direction with a larger bound counts as not identifiable.
const UNFIXED: f64 = 1e3;

/// |(I − P)s|² with the projection P on the parameters at `places`, from inner products.
pub fn beside(gram: &DMatrix<f64>, power: f64, against: &DVector<f64>, places: &[usize]) -> f64 {
    if places.is_empty() {
        return power;
    }
    let scale = |place: usize| gram[(place, place)].max(f64::MIN_POSITIVE).sqrt().recip();
    // Directions below this share of the largest are rounding errors of the simulations' differences.
    const ROUNDING: f64 = 1e-9;
    let count = places.len();
    let inside = DMatrix::from_fn(count, count, |a, b| {
        gram[(places[a], places[b])] * scale(places[a]) * scale(places[b])
    });
    let right = DVector::from_fn(count, |a, _| against[places[a]] * scale(places[a]));
    let root = inside.symmetric_eigen();
    let largest = root.eigenvalues.iter().copied().fold(0.0, f64::max);
    let rotated = root.eigenvectors.transpose() * right;
    let explained: f64 = rotated
        .iter()
        .zip(root.eigenvalues.iter())
        .filter(|(_, value)| **value > ROUNDING * largest)
        .map(|(part, value)| part * part / value)
        .sum();
    (power - explained).max(0.0)
}

/// Nearest rival of an effect: its kind and |(I − P)s|, P on the rival and the true `others`.
pub fn nearest(
    products: &PredictionProducts,
    power: f64,
    against: &DVector<f64>,
    own: &str,
    others: &[&str],
) -> Option<(&'static str, f64)> {
    let given: Vec<usize> = others.iter().flat_map(|kind| products.of(kind)).collect();
    products
        .kinds()
        .into_iter()
        .filter(|rival| rival.kind != own && !others.contains(&rival.kind))
        .map(|rival| {
            let mut places = given.clone();
            places.extend(products.of(rival.kind));
            (
                rival.kind,
                beside(&products.gram[0], power, against, &places).sqrt(),
            )
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Joint Cramér–Rao covariance of the parameters at `places`.
pub fn bound(products: &PredictionProducts, places: &[usize]) -> DMatrix<f64> {
    let width = |place: usize| UNFIXED * LINEAR[products.names[places[place]].entry].typical;
    let count = places.len();
    if count == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scaled = DMatrix::from_fn(count, count, |a, b| {
        let own = if a == b { 1.0 } else { 0.0 };
        products.gram[0][(places[a], places[b])] * width(a) * width(b) + own
    });
    let root = scaled.symmetric_eigen();
    let inverse = &root.eigenvectors
        * DMatrix::from_diagonal(&root.eigenvalues.map(|value| value.max(1.0).recip()))
        * root.eigenvectors.transpose();
    DMatrix::from_fn(count, count, |a, b| inverse[(a, b)] * width(a) * width(b))
}

/// Number of directions with a bound below `widths` typical sizes.
pub fn degrees(products: &PredictionProducts, places: &[usize], widths: f64) -> usize {
    let width = |place: usize| widths * LINEAR[products.names[places[place]].entry].typical;
    if places.is_empty() {
        return 0;
    }
    let scaled = DMatrix::from_fn(places.len(), places.len(), |a, b| {
        products.gram[0][(places[a], places[b])] * width(a) * width(b)
    });
    let values = scaled.symmetric_eigenvalues();
    values.iter().filter(|value| **value > 1.0).count()
}
