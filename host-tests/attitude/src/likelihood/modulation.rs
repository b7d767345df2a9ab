//! Modulation of the noise level along a record: a hand shakes, a filter settles, a unit lies still.
//!
//! In every octave noise is a stationary process times a time-dependent level (Priestley, J. R. Statist. Soc. B 27, 1965: an
//! evolutionary spectrum; here of one level an octave). The variances of the record's pieces have an inverse-gamma prior, so
//! that a piece by itself is Student's t. The prior's width and the pieces' length maximise the evidence; one constant level
//! is kept if they gain less than their price.

use rlg_plan::ModulationPlan;
use statrs::function::gamma::ln_gamma;

/// Energy of a short piece of a record, whitened by a single level.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Middle of the piece \[s\].
    pub middle_s: f64,
    /// Sum of squares.
    pub energy: f64,
    /// Number of values in the sum.
    pub count: f64,
}

/// Levels along a record, of mean square 1; a single one by default.
#[derive(Debug, Clone, Default)]
pub struct Modulation {
    /// Middle of each piece \[s\], and the logarithm of its level.
    nodes: Vec<(f64, f64)>,
}

impl Modulation {
    /// True if the level is constant.
    pub fn is_none(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Interpolates the level at a time: its logarithm is linear between pieces, and constant beyond the ends.
    pub fn at(&self, time_s: f64) -> f64 {
        let after = self.nodes.partition_point(|(node_s, _)| *node_s <= time_s);
        let last = match self.nodes.last() {
            None => return 1.0,
            Some((_, last)) => *last,
        };
        let log = match (after.checked_sub(1), self.nodes.get(after)) {
            (Some(before), Some((to_s, to))) => {
                let (from_s, from) = self.nodes[before];
                from + (to - from) * (time_s - from_s) / (to_s - from_s)
            }
            (None, Some((_, first))) => *first,
            (_, None) => last,
        };
        log.exp()
    }

    /// Least and largest level of the pieces.
    pub fn range(&self) -> [f64; 2] {
        let logs = self.nodes.iter().map(|(_, log)| *log);
        let least = logs.clone().fold(f64::INFINITY, f64::min);
        let largest = logs.fold(f64::NEG_INFINITY, f64::max);
        match self.is_none() {
            true => [1.0; 2],
            false => [least.exp(), largest.exp()],
        }
    }

    /// Estimates levels of pieces under the prior of most evidence.
    pub fn of_pieces(pieces: &[Piece], plan: &ModulationPlan) -> Self {
        if pieces.is_empty() {
            return Self::default();
        }
        let single = Law::single(pieces);
        let laws = plan.lengths.iter().filter_map(|&length| {
            let joined: Vec<Piece> = pieces.chunks(length).map(join).collect();
            let law = Law::likeliest(&joined, plan.least_pieces)?;
            Some((law, joined))
        });
        let best = laws.max_by(|a, b| a.0.evidence.total_cmp(&b.0.evidence));
        let least = single.evidence + plan.least_gain;
        let Some((law, joined)) = best.filter(|(law, _)| law.evidence > least) else {
            return Self::default();
        };
        let powers: Vec<f64> = joined.iter().map(|piece| law.power_of(piece)).collect();
        let counts: f64 = joined.iter().map(|piece| piece.count).sum();
        let sum: f64 = joined
            .iter()
            .zip(&powers)
            .map(|(one, power)| one.count * power)
            .sum();
        let mean = sum / counts;
        let nodes = joined.iter().zip(&powers);
        let nodes = nodes.map(|(piece, power)| (piece.middle_s, 0.5 * (power / mean).ln()));
        Self {
            nodes: nodes.collect(),
        }
    }
}

fn join(pieces: &[Piece]) -> Piece {
    let count: f64 = pieces.iter().map(|one| one.count).sum();
    Piece {
        middle_s: pieces
            .iter()
            .map(|one| one.count * one.middle_s)
            .sum::<f64>()
            / count,
        energy: pieces.iter().map(|one| one.energy).sum(),
        count,
    }
}

/// Inverse-gamma prior of the pieces' powers.
struct Law {
    /// Shape; infinite for a single power.
    shape: f64,
    /// Harmonic mean of the pieces' powers, by their expected inverses.
    power: f64,
    /// Log evidence, up to a constant common to all laws.
    evidence: f64,
}

impl Law {
    fn single(pieces: &[Piece]) -> Self {
        let all = join(pieces);
        let power = (all.energy / all.count).max(f64::MIN_POSITIVE);
        Self {
            shape: f64::INFINITY,
            power,
            evidence: -0.5 * all.count * (power.ln() + 1.0),
        }
    }

    /// Fits the law of most evidence; `None` for fewer than `least` pieces.
    fn likeliest(pieces: &[Piece], least: usize) -> Option<Self> {
        /// Grid of shapes, by steps of a quarter of an octave: from independent levels to levels within a tenth of each
        /// other.
        const SHAPES: i32 = 40;
        const FIRST: f64 = 0.25;
        if pieces.len() < least {
            return None;
        }
        let shapes = (0..SHAPES).map(|step| FIRST * (0.25 * f64::from(step)).exp2());
        let laws = shapes.map(|shape| Self::of_shape(shape, pieces));
        laws.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// Solves for the maximum-likelihood power p of a shape a: Σ (a + n/2)/(a p + e/2) is the number of pieces over p.
    fn of_shape(shape: f64, pieces: &[Piece]) -> Self {
        const TURNS: usize = 30;
        let mut law = Self {
            power: Self::single(pieces).power,
            shape,
            evidence: 0.0,
        };
        for _ in 0..TURNS {
            let inverse: f64 = pieces.iter().map(|one| 1.0 / law.power_of(one)).sum();
            law.power = pieces.len() as f64 / inverse;
        }
        let scale = law.shape * law.power;
        let of_piece = |one: &Piece| {
            let after = shape + 0.5 * one.count;
            ln_gamma(after) - ln_gamma(shape) + shape * scale.ln()
                - after * (scale + 0.5 * one.energy).ln()
        };
        law.evidence = pieces.iter().map(of_piece).sum();
        law
    }

    /// Inverse of the expected inverse power of a piece, given its energy.
    fn power_of(&self, piece: &Piece) -> f64 {
        (self.shape * self.power + 0.5 * piece.energy) / (self.shape + 0.5 * piece.count)
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{ChiSquared, Distribution};

    use super::{Modulation, Piece};

    const COUNT: f64 = 36.0;

    /// Draws pieces of a second at given levels.
    fn drawn(levels: &[f64], seed: u64) -> Vec<Piece> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let law = ChiSquared::new(COUNT).expect("degrees above 0");
        let each = levels.iter().enumerate();
        each.map(|(second, level)| Piece {
            middle_s: second as f64 + 0.5,
            energy: level * level * law.sample(&mut random),
            count: COUNT,
        })
        .collect()
    }

    #[test]
    fn noise_of_one_level_keeps_it() {
        let changed = (0..200).filter(|&seed| {
            let modulation = Modulation::of_pieces(&drawn(&[3.0; 120], seed), &Default::default());
            !modulation.is_none()
        });
        assert!(changed.count() <= 2);
    }

    #[test]
    fn a_record_that_is_thirty_times_louder_at_first_has_both_levels() {
        let level = |second: u32| if second < 20 { 30.0 } else { 1.0 };
        let levels: Vec<f64> = (0..60).map(level).collect();
        let modulation = Modulation::of_pieces(&drawn(&levels, 7), &Default::default());
        let rms = ((20.0 * 900.0 + 40.0) / 60.0_f64).sqrt();
        let mut square = 0.0;
        for second in 0..60_u32 {
            let found = modulation.at(f64::from(second) + 0.5);
            let is_edge = second.abs_diff(20) < 3;
            let ratio = found / (level(second) / rms);
            assert!(is_edge || (0.7..1.4).contains(&ratio), "{second}: {ratio}");
            square += found * found / 60.0;
        }
        assert!((square - 1.0).abs() < 0.1, "{square}");
    }

    #[test]
    fn levels_that_stay_for_long_are_of_long_pieces() {
        let level = |second: u32| {
            if (second / 16).is_multiple_of(2) {
                1.0
            } else {
                1.5
            }
        };
        let levels: Vec<f64> = (0..128).map(level).collect();
        let modulation = Modulation::of_pieces(&drawn(&levels, 3), &Default::default());
        let count = modulation.nodes.len();
        assert!((6..=32).contains(&count), "{count}");
        let [least, largest] = modulation.range();
        assert!((1.3..1.8).contains(&(largest / least)), "{least} {largest}");
    }
}
