//! Effects between the blocks' angles, the pickoffs and the gyros.
//!
//! Pickoff angles p \[rad\] give the block angles and the gyros' measurement of them \[rad\].
//!
//! Equation: block = gain (1 + g) p + c p³; gyro i measures block_i + (s_i block_i + Σ c_ij block_j)/(1 − s_i).

use super::Effects;
use nalgebra::Vector3;

impl Effects {
    /// Block angles from pickoff angles, both relative to the case \[rad\].
    pub fn block_angle_rad(&self, pickoff_gain: [f64; 3], pickoff_rad: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let p = pickoff_rad[i];
            pickoff_gain[i] * (1.0 + self.dither_gain[i]) * p + self.dither_cubic[i] * p.powi(3)
        })
    }

    /// Measurement of the blocks' angles by gyro i \[rad\]: its own block with the concealed scale error (a term before
    /// 1/(1 − s)), and crosstalk from the others (likewise).
    pub fn sensed_block_angle_rad(&self, block_rad: [f64; 3], scale_error: [f64; 3]) -> [f64; 3] {
        let block = Vector3::from(block_rad);
        let added = self.scale.component_mul(&block) + self.dither_crosstalk * block;
        std::array::from_fn(|i| block[i] + added[i] / (1.0 - scale_error[i]))
    }

    /// Scale error of gyro `axis` by its warming \[1\], for dither and case motion alike.
    pub fn warm_scale(&self, axis: usize, warming_k: f64) -> f64 {
        self.scale_temperature[axis] * warming_k
    }

    /// Delay of the pickoff against the block \[s\].
    pub fn dither_delay_s(&self, axis: usize) -> f64 {
        self.dither_delay_s[axis]
    }
}
