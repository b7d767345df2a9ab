//! Integrates the attitude of the body from its rates.
//!
//! A quaternion q turns components along body axes into components along the axes that the body had at time 0.

use super::Vector;

/// A unit quaternion w, x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion(pub [f64; 4]);

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// The rotation by this vector \[rad\].
    pub fn from_rotation_vector(vector: Vector) -> Self {
        let angle = norm(vector);
        let (sin, cos) = (angle / 2.0).sin_cos();
        let scale = if angle < 1e-9 { 0.5 } else { sin / angle };
        let [x, y, z] = vector.map(|v| v * scale);
        Self([cos, x, y, z])
    }

    /// The rotation vector \[rad\], at most half a turn.
    pub fn rotation_vector(self) -> Vector {
        let [w, x, y, z] = self.0;
        let sin = norm([x, y, z]);
        // Either sign of a quaternion is the same rotation: the shorter one.
        let scale = if sin < 1e-12 {
            2.0 * w.signum()
        } else {
            2.0 * (sin * w.signum()).atan2(w.abs()) / sin
        };
        [x * scale, y * scale, z * scale]
    }

    /// This rotation, and then `next` about the axes that it leads to.
    pub fn times(self, next: Self) -> Self {
        let [w, x, y, z] = self.0;
        let [a, b, c, d] = next.0;
        Self([
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ])
    }

    /// The rotation back.
    pub fn inverse(self) -> Self {
        let [w, x, y, z] = self.0;
        Self([w, -x, -y, -z])
    }

    /// Turns components along the axes after the rotation into components along those before it.
    pub fn rotate(self, vector: Vector) -> Vector {
        let [x, y, z] = vector;
        let [_, x, y, z] = self.times(Self([0.0, x, y, z])).times(self.inverse()).0;
        [x, y, z]
    }

    /// The same, with the norm that rounding has changed brought back to 1.
    pub fn normalised(self) -> Self {
        let square: f64 = self.0.iter().map(|v| v * v).sum();
        Self(self.0.map(|v| v / square.sqrt()))
    }
}

fn norm(vector: Vector) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Vector product.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Rotation vector over one step \[rad\], body axes at its start, from the rates at its Gauss–Legendre nodes \[rad/s\].
///
/// Magnus expansion of sixth order (Blanes, Casas, Ros 2000, three nodes) of Y' = −(ω×) Y, which is the equation of the
/// transposed rotation matrix. The body's own matrix is the transpose of its exponential.
pub fn magnus([first, middle, last]: &[Vector; 3], step_s: f64) -> Vector {
    let combine = |terms: &[(f64, Vector)]| {
        let mut sum = [0.0; 3];
        for (factor, vector) in terms {
            for (sum, v) in sum.iter_mut().zip(vector) {
                *sum += factor * v;
            }
        }
        sum
    };
    let one = combine(&[(-step_s, *middle)]);
    let slope = 15f64.sqrt() / 3.0 * step_s;
    let two = combine(&[(-slope, *last), (slope, *first)]);
    let bend = 10.0 / 3.0 * step_s;
    let three = combine(&[(-bend, *last), (2.0 * bend, *middle), (-bend, *first)]);
    let c_one = cross(one, two);
    let c_two = cross(one, combine(&[(-2.0 / 60.0, three), (-1.0 / 60.0, c_one)]));
    let c_three = cross(
        combine(&[(-20.0, one), (-1.0, three), (1.0, c_one)]),
        combine(&[(1.0, two), (1.0, c_two)]),
    );
    combine(&[(-1.0, one), (-1.0 / 12.0, three), (-1.0 / 240.0, c_three)])
}
