//! Noise of the gyros and their reference as declared by a model.

use rlg_findings::excess::excess_square;
use rlg_inference::NoiseLevels;
use rlg_model::Model;

/// Declared noise of one gyro, of its reference, or of one against the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeclaredNoise {
    /// Angle random walk squared \[rad²/s\].
    pub walk_rad2_s: f64,
    /// White angle noise squared \[rad²\].
    pub white_rad2: f64,
}

impl DeclaredNoise {
    /// Levels per row at a row rate of `rate_hz`.
    pub fn levels(&self, rate_hz: f64) -> NoiseLevels {
        NoiseLevels {
            white: self.walk_rad2_s / rate_hz,
            angle: self.white_rad2,
            ..NoiseLevels::default()
        }
    }

    /// Power spectral density of the rate noise at a frequency, of rows at `rate_hz` \[(rad/s)²/Hz, two-sided\].
    pub fn rate_power(&self, frequency_hz: f64, rate_hz: f64) -> f64 {
        self.levels(rate_hz).of_share(frequency_hz / rate_hz) * rate_hz
    }

    /// Noise of slower rows, see [`NoiseLevels::of_other_rows`].
    pub fn read_at(&self, slower_hz: f64, rate_hz: f64) -> NoiseLevels {
        let span_s = 1.0;
        let levels = self.levels(rate_hz);
        levels.of_other_rows((rate_hz, span_s), (slower_hz, span_s))
    }
}

/// Returns the declared noise of the gyros alone; `None` if their angle random walk is not stated.
pub fn of_gyros(model: &Model) -> Option<[DeclaredNoise; 3]> {
    let walks = model.gyro.angle_random_walk_rad_sqrt_s?;
    Some([0, 1, 2].map(|axis: usize| DeclaredNoise {
        walk_rad2_s: walks[axis].powi(2),
        white_rad2: model.gyro_white_rad2(axis),
    }))
}

/// Returns the declared noise of the reference alone; zero if it is not stated.
pub fn of_reference(model: &Model) -> DeclaredNoise {
    let reference = model.reference.as_ref();
    let square = |noise: Option<f64>| noise.unwrap_or_default().powi(2);
    DeclaredNoise {
        walk_rad2_s: square(reference.and_then(|one| one.angle_random_walk_rad_sqrt_s)),
        white_rad2: square(reference.and_then(|one| one.angle_noise_rad)),
    }
}

/// Returns the declared noise of gyros and reference with the excess noise of the model's effects; `None` if the gyros' angle
/// random walk is not stated, or the total walk of an axis is zero.
pub fn declared(model: &Model) -> Option<[DeclaredNoise; 3]> {
    let (gyros, reference) = (of_gyros(model)?, of_reference(model));
    let noise = [0, 1, 2].map(|axis: usize| DeclaredNoise {
        walk_rad2_s: gyros[axis].walk_rad2_s
            + reference.walk_rad2_s
            + excess_square(model, "angle_random_walk", axis),
        white_rad2: gyros[axis].white_rad2
            + reference.white_rad2
            + excess_square(model, "pulse_quantisation", axis) / 12.0,
    });
    noise
        .iter()
        .all(|noise| noise.walk_rad2_s > 0.0)
        .then_some(noise)
}

#[cfg(test)]
mod tests {
    use super::DeclaredNoise;

    #[test]
    fn slower_rows_have_the_same_power_a_hertz() {
        let noise = DeclaredNoise {
            walk_rad2_s: 2e-13,
            white_rad2: 1e-12,
        };
        let slower = noise.read_at(400.0, 4000.0);
        for hz in [0.0, 1.0, 10.0] {
            let power = noise.rate_power(hz, 4000.0);
            let of_slower = slower.of_share(hz / 400.0) * 400.0;
            // 4 sin²(πf/fs) is (2πf/fs)² to a third of the square of half that angle.
            assert!(
                (of_slower / power - 1.0).abs() < 3e-3,
                "{hz}: {of_slower} {power}"
            );
        }
    }
}
