//! The firmware's chain and its f64 reference on the same counts, and both compared with motions in closed form.
//!
//! Rates below are means over the named stretch; 1 °/h = 4.848e-6 rad/s.

mod motion;
mod unit;

mod arithmetic;
mod flexure;
mod lost;
mod strip;
mod terms;
mod velocity;
mod warming;

/// T of every stream here \[s\].
pub const PERIOD_S: f64 = 1.0 / 4000.0;

/// 1 °/h \[rad/s\].
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// 10 min at 4 kHz.
pub const TEN_MINUTES: usize = 2_400_000;
