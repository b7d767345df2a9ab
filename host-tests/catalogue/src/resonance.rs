//! Second-order systems between motion and measurement.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_plan::GridPlan;

/// Natural frequency and damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Undamped natural frequency \[Hz\].
    pub hz: f64,
    /// Damping ratio ζ \[1\].
    pub damping: f64,
}

/// Critical damping ratio \[1\]: a system damped more does not oscillate and is a low pass.
pub const CRITICAL: f64 = 1.0;

/// Response or its derivative with respect to a parameter of the resonance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Response.
    Response,
    /// Derivative with respect to the natural frequency \[1/Hz\].
    ByFrequency,
    /// Derivative with respect to the damping ratio \[1\].
    ByDamping,
}

/// All parts, the response first.
pub const PARTS: [Part; 3] = [Part::Response, Part::ByFrequency, Part::ByDamping];

impl Resonance {
    /// ω0² − ω² + 2iζω0ω.
    fn denominator(self, hz: f64) -> Complex64 {
        let (omega, natural) = (TAU * hz, TAU * self.hz);
        Complex64::new(
            natural * natural - omega * omega,
            2.0 * self.damping * natural * omega,
        )
    }

    /// Derivatives of the denominator with respect to frequency \[Hz\] and damping ratio.
    fn slopes(self, hz: f64) -> [Complex64; 2] {
        let (omega, natural) = (TAU * hz, TAU * self.hz);
        [
            Complex64::new(2.0 * natural, 2.0 * self.damping * omega) * TAU,
            Complex64::new(0.0, 2.0 * natural * omega),
        ]
    }

    /// Tilt of a suspension over that of a stiff one: Ω0²/(Ω0² − ω² + 2iζΩ0ω), or its derivative.
    pub fn suspension(self, hz: f64, part: Part) -> Complex64 {
        let below = self.denominator(hz);
        let natural = TAU * self.hz;
        let value = natural * natural / below;
        let [by_frequency, by_damping] = self.slopes(hz);
        match part {
            Part::Response => value,
            Part::ByFrequency => value * (2.0 / self.hz) - value / below * by_frequency,
            Part::ByDamping => -value / below * by_damping,
        }
    }

    /// Complete response of a soft mount; 1 far below the resonance.
    pub fn whole(self, hz: f64) -> Complex64 {
        1.0 + self.beyond_mount(hz, Part::Response)
    }

    /// Motion of an isolated case relative to its reference: H − 1 = ω²/(ω0² − ω² + 2iζω0ω), or its derivative.
    pub fn beyond_mount(self, hz: f64, part: Part) -> Complex64 {
        let below = self.denominator(hz);
        let omega = TAU * hz;
        let value = omega * omega / below;
        let [by_frequency, by_damping] = self.slopes(hz);
        match part {
            Part::Response => value,
            Part::ByFrequency => -value / below * by_frequency,
            Part::ByDamping => -value / below * by_damping,
        }
    }
}

/// Grid of natural frequencies from `least_hz` to `most_hz`, each with light to heavy damping.
pub fn grid(least_hz: f64, most_hz: f64, plan: &GridPlan) -> Vec<Resonance> {
    let dampings = plan.resonance_dampings;
    std::iter::successors(Some(least_hz), |hz| Some(hz * plan.resonance_ratio))
        .take_while(|hz| *hz <= most_hz)
        .flat_map(|hz| dampings.map(|damping| Resonance { hz, damping }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{PARTS, Part, Resonance};
    use realfft::num_complex::Complex64;

    #[test]
    fn derivatives_are_those_of_the_response() {
        let at = Resonance {
            hz: 80.0,
            damping: 0.12,
        };
        let laws: [fn(Resonance, f64, Part) -> Complex64; 2] =
            [Resonance::suspension, Resonance::beyond_mount];
        for law in laws {
            for hz in [3.0, 70.0, 300.0] {
                for part in PARTS {
                    let step = 1e-5;
                    let moved = |sign: f64| match part {
                        Part::ByFrequency => Resonance {
                            hz: at.hz + sign * step,
                            ..at
                        },
                        _ => Resonance {
                            damping: at.damping + sign * step,
                            ..at
                        },
                    };
                    if part == Part::Response {
                        continue;
                    }
                    let numeric = (law(moved(1.0), hz, Part::Response)
                        - law(moved(-1.0), hz, Part::Response))
                        / (2.0 * step);
                    let exact = law(at, hz, part);
                    assert!(
                        (numeric - exact).norm() < 1e-5 * (1.0 + exact.norm()),
                        "{hz} {part:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_stiff_suspension_follows_and_a_stiff_mount_adds_nothing() {
        let stiff = Resonance {
            hz: 1e5,
            damping: 0.1,
        };
        assert!((stiff.suspension(10.0, Part::Response) - 1.0).norm() < 1e-4);
        assert!(stiff.beyond_mount(10.0, Part::Response).norm() < 1e-4);
    }
}
