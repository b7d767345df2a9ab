//! Values on the three body axes.

use nalgebra::Matrix3;
pub use rlg_recording::AXES;

/// Channels of one kind on the three body axes, `[axis][row]`.
pub type Triad = [Vec<f64>; 3];

/// Adds `size` times `part`, row by row.
pub fn add(into: &mut [f64], part: &[f64], size: f64) {
    into.iter_mut()
        .zip(part)
        .for_each(|(sum, part)| *sum += size * part);
}

/// Computes a value for each axis, in parallel.
pub fn each_axis<T: Send>(of: impl Fn(usize) -> T + Sync) -> [T; 3] {
    let (x, (y, z)) = rayon::join(|| of(0), || rayon::join(|| of(1), || of(2)));
    [x, y, z]
}

/// Adds `size` times `part` on every axis.
pub fn add_triad(into: &mut Triad, part: &Triad, size: f64) {
    for (into, part) in into.iter_mut().zip(part) {
        add(into, part, size);
    }
}

/// Maps three channels into other axes, row by row.
pub fn mapped(channels: &Triad, map: &Matrix3<f64>) -> Triad {
    std::array::from_fn(|axis| weighted_sum([0, 1, 2].map(|of| map[(axis, of)]), channels))
}

/// Computes a weighted sum of the three channels.
pub fn weighted_sum(weights: [f64; 3], channels: &Triad) -> Vec<f64> {
    let mut sum = vec![0.0; channels[0].len()];
    for (weight, channel) in weights.into_iter().zip(channels) {
        if weight != 0.0 {
            add(&mut sum, channel, weight);
        }
    }
    sum
}
