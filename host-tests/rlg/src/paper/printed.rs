//! Numbers printed in the paper, with which every experiment is compared.
//!
//! Source: Cheng et al. 2023, doi 10.16356/j.1005-1120.2023.06.002. The names hold the units; for plots the numbers are
//! those stated in the text. Nothing here is ours.

use trueaxis::CrossAxis;

/// Angular accelerations of Tables 1 and 2 \[rad/s²\].
pub const ACCELERATIONS_RAD_S2: [f64; 4] = [100.0, 200.0, 500.0, 1000.0];

/// Table 1, deflection of points A and B, acceleration about x \[µrad\].
pub const TABLE_1_URAD: [[f64; 4]; 2] =
    [[6.73, 13.46, 33.65, 67.30], [13.63, 27.26, 68.15, 136.30]];

/// Table 2, the same about y \[µrad\].
pub const TABLE_2_URAD: [[f64; 4]; 2] =
    [[7.55, 15.10, 37.75, 75.51], [15.02, 30.04, 75.09, 150.19]];

/// Coefficient estimated in the paper from the block's inertia and the suspension's stiffness \[s²\].
pub const INERTIA_OVER_STIFFNESS_S2: f64 = 7.9e-8;

/// Table 3: the coefficients as calibrated \[s²\].
pub const TABLE_3_S2: CrossAxis<f64> = CrossAxis {
    xy: 6.9e-8,
    xz: 7.1e-8,
    yx: 7.5e-8,
    yz: 7.3e-8,
    zx: 6.7e-8,
    zy: 7.6e-8,
};

/// Fig. 4: the two gyros' difference while coning at 15 Hz \[°/h\].
pub const FIGURE_4_DEG_H: f64 = 0.5;

/// One row of Table 4 or 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Angle or velocity.
    pub name: &'static str,
    /// Error before compensation, ° or m/s.
    pub before: f64,
    /// Error after compensation, ° or m/s.
    pub after: f64,
    /// Reduction by compensation \[%\].
    pub reduction_percent: f64,
}

const fn row(name: &'static str, before: f64, after: f64, reduction_percent: f64) -> Row {
    Row {
        name,
        before,
        after,
        reduction_percent,
    }
}

/// Table 4, attitude error \[°\]: pitch, roll, yaw under x vibration, then under y vibration.
pub const TABLE_4: [[Row; 3]; 2] = [
    [
        row("pitch", 0.0038, 0.0015, 60.53),
        row("roll", 0.012, 0.008, 33.33),
        row("yaw", 0.10, 0.0018, 98.20),
    ],
    [
        row("pitch", 0.021, 0.015, 28.57),
        row("roll", 0.0024, 0.0010, 58.33),
        row("yaw", 0.062, 0.011, 82.26),
    ],
];

/// Table 5, largest velocity error \[m/s\]: east, north under x vibration, then under y vibration.
pub const TABLE_5: [[Row; 2]; 2] = [
    [
        row("east", 3.83, 2.16, 43.60),
        row("north", 2.27, 1.45, 36.12),
    ],
    [
        row("east", 2.83, 1.40, 50.53),
        row("north", -10.57, -5.51, 47.87),
    ],
];
