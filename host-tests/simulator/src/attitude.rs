//! Attitude of the case relative to the ground, and the Earth's rotation, gravity and field in body axes.
//!
//! From the body rates relative to the ground at the quadrature nodes of one period (rad/s, body frame): at the same nodes
//! the Earth's rotation (rad/s), the specific force at rest (m/s²) and the Earth's magnetic field (T), body frame; and the
//! attitude at the period's end.
//!
//! Frame: navigation frame n = north, west, up; a body at identity has z up. With latitude L,
//! ω_ie = ω_E (cos L, 0, sin L) and specific force at rest is (0, 0, +g).
//! Equations: θ_i = T Σ_j a_ij ω_j with the collocation matrix of the nodes; rotation over the period
//! Θ = θ(T) + ½ ∫ θ × ω dt (Bortz to second order in θ: the next term is below 1e-10 rad a period at 400 °/s).
//!
//! Out of scope: transport rate. The case stays at its site.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

/// Earth's rotation rate (WGS 84) \[rad/s\].
pub const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;

/// Nodes of the four-point Gauss–Legendre rule on \[0, 1\], its weights, and the collocation matrix
/// a_ij = ∫₀^{c_i} ℓ_j: exact for polynomials of degree 7, so that a 400 Hz motion at 4 kHz is integrated
/// to 1e-11 of itself.
#[derive(Debug, Clone)]
pub struct Quadrature {
    /// c_i \[periods\].
    pub nodes: [f64; 4],
    /// b_i \[1\].
    pub weights: [f64; 4],
    /// a_ij \[1\].
    pub collocation: Matrix4<f64>,
}

impl Quadrature {
    /// Computes the rule from its closed form.
    pub fn new() -> Self {
        let root = (6.0_f64 / 5.0).sqrt();
        let inner = (3.0 / 7.0 - 2.0 / 7.0 * root).sqrt();
        let outer = (3.0 / 7.0 + 2.0 / 7.0 * root).sqrt();
        let (heavy, light) = (
            (18.0 + 30.0_f64.sqrt()) / 36.0,
            (18.0 - 30.0_f64.sqrt()) / 36.0,
        );
        let nodes = [-outer, -inner, inner, outer].map(|x| 0.5 * (1.0 + x));
        let weights = [light, heavy, heavy, light].map(|w| 0.5 * w);
        let mut rule = Self {
            nodes,
            weights,
            collocation: Matrix4::zeros(),
        };
        for (i, end) in nodes.into_iter().enumerate() {
            for (j, weight) in rule.weights_until(end).into_iter().enumerate() {
                rule.collocation[(i, j)] = weight;
            }
        }
        rule
    }

    /// ∫₀^end ℓ_j: weights of an integral over the first part of a period, `end` in periods.
    pub fn weights_until(&self, end: f64) -> [f64; 4] {
        let lagrange = |j: usize, x: f64| -> f64 {
            (0..4)
                .filter(|m| *m != j)
                .map(|m| (x - self.nodes[m]) / (self.nodes[j] - self.nodes[m]))
                .product()
        };
        std::array::from_fn(|j| {
            (0..4)
                .map(|n| end * self.weights[n] * lagrange(j, end * self.nodes[n]))
                .sum()
        })
    }

    /// ∫ over one period of length `period_s` of a vector given at the nodes.
    pub fn integrate(&self, values: &[Vector3<f64>; 4], period_s: f64) -> Vector3<f64> {
        values
            .iter()
            .zip(self.weights)
            .map(|(value, weight)| value * (weight * period_s))
            .sum()
    }
}

impl Default for Quadrature {
    fn default() -> Self {
        Self::new()
    }
}

/// Quantities at rest on the ground, navigation frame; zero if the scenario has no site.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ground {
    /// ω_ie \[rad/s\].
    pub earth_rate_rad_s: Vector3<f64>,
    /// Specific force at rest \[m/s²\].
    pub specific_force_m_s2: Vector3<f64>,
    /// Magnetic flux density \[T\].
    pub field_t: Vector3<f64>,
    /// Rotation of the Earth that the reference does not contain \[rad/s\].
    pub unreferenced_rate_rad_s: Vector3<f64>,
}

impl Ground {
    /// Ground at a latitude and a local gravity, without a magnetic field; `turning` = false leaves the Earth's rotation
    /// out.
    pub fn at(latitude_rad: f64, gravity_m_s2: f64, turning: bool) -> Self {
        let rate = if turning { EARTH_RATE_RAD_S } else { 0.0 };
        Self {
            earth_rate_rad_s: Vector3::new(
                rate * latitude_rad.cos(),
                0.0,
                rate * latitude_rad.sin(),
            ),
            specific_force_m_s2: Vector3::new(0.0, 0.0, gravity_m_s2),
            ..Self::default()
        }
    }
}

/// Ground quantities at one node, body frame.
#[derive(Debug, Clone, Copy)]
pub struct GroundInBody {
    /// ω_ie \[rad/s\].
    pub earth_rate_rad_s: Vector3<f64>,
    /// Specific force \[m/s²\].
    pub specific_force_m_s2: Vector3<f64>,
    /// Magnetic flux density \[T\].
    pub field_t: Vector3<f64>,
    /// Rotation of the Earth that the reference does not contain \[rad/s\].
    pub unreferenced_rate_rad_s: Vector3<f64>,
}

/// Attitude, body to navigation frame.
#[derive(Debug, Clone)]
pub struct Attitude {
    /// Rotation from body to navigation frame.
    pub navigation_from_body: UnitQuaternion<f64>,
}

impl Attitude {
    /// From a quaternion w, x, y, z (any length but 0).
    pub fn new(wxyz: [f64; 4]) -> Self {
        let [w, x, y, z] = wxyz;
        Self {
            navigation_from_body: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
        }
    }

    /// Computes the ground quantities at the nodes of the next period, and advances the attitude to its end.
    pub fn advance(
        &mut self,
        quadrature: &Quadrature,
        rates_rad_s: &[Vector3<f64>; 4],
        period_s: f64,
        ground: &Ground,
    ) -> [GroundInBody; 4] {
        let body_from_navigation = self.navigation_from_body.inverse();
        let earth = body_from_navigation * ground.earth_rate_rad_s;
        let force = body_from_navigation * ground.specific_force_m_s2;
        let field = body_from_navigation * ground.field_t;
        let unreferenced = body_from_navigation * ground.unreferenced_rate_rad_s;
        let angles: [Vector3<f64>; 4] = std::array::from_fn(|i| {
            (0..4)
                .map(|j| rates_rad_s[j] * (period_s * quadrature.collocation[(i, j)]))
                .sum()
        });
        // second order in the angle: the third, θ³/6, is 1e-9 at 400 °/s
        let turn = |v: &Vector3<f64>, angle: &Vector3<f64>| {
            let first = angle.cross(v);
            v - first + 0.5 * angle.cross(&first)
        };
        let seen = std::array::from_fn(|i| GroundInBody {
            earth_rate_rad_s: turn(&earth, &angles[i]),
            specific_force_m_s2: turn(&force, &angles[i]),
            field_t: turn(&field, &angles[i]),
            unreferenced_rate_rad_s: turn(&unreferenced, &angles[i]),
        });
        let noncommuting = std::array::from_fn(|i| 0.5 * angles[i].cross(&rates_rad_s[i]));
        let rotation = quadrature.integrate(rates_rad_s, period_s)
            + quadrature.integrate(&noncommuting, period_s);
        self.navigation_from_body *= UnitQuaternion::from_scaled_axis(rotation);
        seen
    }
}
