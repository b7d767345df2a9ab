//! Applies effects between the blocks' angles, the pickoffs and the gyros.
//!
//! From pickoff angles p in rad it gives the block angles, and what each gyro reads of them, in rad.
//!
//! Equation: block = gain (1 + g) p + c p³; gyro i reads block_i + (s_i block_i + Σ c_ij block_j)/(1 − s_i).

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

    /// What gyro i reads of the blocks' angles \[rad\]: its own, the concealed scale on it (which stands
    /// before 1/(1 − s)), and crosstalk from the others (likewise).
    pub fn sensed_block_angle_rad(&self, block_rad: [f64; 3], scale_error: [f64; 3]) -> [f64; 3] {
        let block = Vector3::from(block_rad);
        let added = self.scale.component_mul(&block) + self.dither_crosstalk * block;
        std::array::from_fn(|i| block[i] + added[i] / (1.0 - scale_error[i]))
    }

    /// Scale error of gyro `axis` by its warming \[1\]: on the dither as on the case.
    pub fn warm_scale(&self, axis: usize, warming_k: f64) -> f64 {
        self.scale_temperature[axis] * warming_k
    }

    /// How late the pickoff shows the block \[s\].
    pub fn dither_delay_s(&self, axis: usize) -> f64 {
        self.dither_delay_s[axis]
    }
}
