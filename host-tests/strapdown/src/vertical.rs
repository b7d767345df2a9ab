//! Damps the vertical channel, or leaves it free: the classical third-order loop holds it to a given height.
//!
//! From the channel's mode and its own height \[m\] it forms corrections of the rate of height \[m/s\] and of the rate
//! of downward velocity \[m/s²\].
//!
//! A free vertical channel is unstable: gravity falls with height, so an error grows e-fold in
//! √(R/2g) = 570 s. With e = h − h_aid and time constant τ of a triple pole:
//!
//! ```text
//! ḣ = −v_D − k1 e     v̇_D = … + k2 e + b     ḃ = k3 e     k1 = 3/τ   k2 = 3/τ² + 2g/R   k3 = 1/τ³
//! ```
//! Source: the baro-inertial loop of Siouris, *Aerospace Avionics Systems*, 1993, section 4.6.

/// Time constant of the loop \[s\]. Long against waves and vibration, whose vertical velocity is then the
/// accelerometers' own. Not the 100 s that noisy barometers ask for: an error of the east velocity pulls at
/// the vertical by 2 Ω cos L, the loop answers with 3τ²ω_s times that downward, and Coriolis brings it back to
/// the east: with 100 s it shifts the Schuler frequency by 2e-4, with 30 s by 2e-5.
const TIME_CONSTANT_S: f64 = 30.0;

/// Growth rate of the free height's error, squared: 2g/R \[1/s²\].
const INSTABILITY_S2: f64 = 2.0 * 9.8 / 6.371e6;

/// Source of the height in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VerticalChannel {
    /// From the accelerometers alone: for minutes at most.
    Free,
    /// Held to this height over the ellipsoid \[m\].
    Aided(f64),
}

/// State of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeightLoop {
    acceleration_m_s2: f64,
}

/// Corrections of the vertical rates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Correction {
    /// Correction of the rate of the height \[m/s\].
    pub climb_m_s: f64,
    /// Correction of the rate of the downward velocity \[m/s²\].
    pub down_m_s2: f64,
}

impl HeightLoop {
    /// Advances the loop by `period_s`, at the height `height_m`.
    pub fn correct(
        &mut self,
        channel: VerticalChannel,
        height_m: f64,
        period_s: f64,
    ) -> Correction {
        let VerticalChannel::Aided(aid_m) = channel else {
            return Correction::default();
        };
        let pole = 1.0 / TIME_CONSTANT_S;
        let excess_m = height_m - aid_m;
        self.acceleration_m_s2 += pole.powi(3) * excess_m * period_s;
        Correction {
            climb_m_s: -3.0 * pole * excess_m,
            down_m_s2: (3.0 * pole * pole + INSTABILITY_S2) * excess_m + self.acceleration_m_s2,
        }
    }
}
