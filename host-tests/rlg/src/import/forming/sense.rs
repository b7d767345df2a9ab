//! Compares the rotations of attitudes with the gyros', for the attitudes and for their conjugates: logs do not state the
//! sense.

use crate::recording::{Quantity, Table};

/// Largest misfit ratio of conjugates to attitudes for a warning: either sense fits rotation about one axis of the same
/// name.
const BETTER: f64 = 0.5;

/// Smallest share of the largest squared rotation of an axis that turns.
const TURNS: f64 = 0.1;

/// Returns a warning if the conjugates of a table's attitudes fit its gyros much better than the attitudes themselves.
pub fn other_sense(table: &Table) -> Option<String> {
    let period_s = table.clock.period_s(table.rows);
    let gyro = |axis: &str| {
        let rate = table.channel(&Quantity::GyroRate, axis);
        let increment = || table.channel(&Quantity::GyroIncrement, axis);
        let in_rad = rate.map(|channel| (channel, period_s));
        in_rad.or_else(|| Some((increment()?, 1.0)))
    };
    let attitude = |axis: &str| table.channel(&Quantity::ReferenceAttitude, axis);
    let gyros = [gyro("x")?, gyro("y")?, gyro("z")?];
    let attitude = [
        attitude("w")?,
        attitude("x")?,
        attitude("y")?,
        attitude("z")?,
    ];
    let at = |row: usize, sign: f64| {
        let [w, x, y, z] = attitude.map(|channel| channel.values[row]);
        [w, sign * x, sign * y, sign * z]
    };
    let mut off_rad2 = [[0.0; 3]; 2];
    let mut turned_rad2 = [0.0; 3];
    for row in 1..table.rows {
        let turned = [1.0, -1.0].map(|sign| turn_rad(at(row - 1, sign), at(row, sign)));
        for ((channel, to_rad), axis) in gyros.iter().zip(0..3) {
            let off = turned.map(|turned| (turned[axis] - channel.values[row] * to_rad).powi(2));
            if off.iter().all(|off| off.is_finite()) {
                off_rad2[0][axis] += off[0];
                off_rad2[1][axis] += off[1];
                turned_rad2[axis] += turned[1][axis].powi(2);
            }
        }
    }
    // A reversed gyro follows the conjugates too, but about its own axis alone.
    let most_rad2 = turned_rad2
        .iter()
        .fold(0.0, |most: f64, one| most.max(*one));
    let mut turning = (0..3).filter(|&axis| turned_rad2[axis] > TURNS * most_rad2);
    let is_every_axis = turning.all(|axis| off_rad2[1][axis] < off_rad2[0][axis]);
    let [as_is, conjugate] = off_rad2.map(|axes| axes.iter().sum::<f64>().sqrt());
    (is_every_axis && conjugate < BETTER * as_is).then(|| {
        format!(
            "{}: the conjugates of the attitudes follow the gyros {:.1} times better than the attitudes; if they are \
             navigation to body, map them to reference_attitude_inverse",
            table.file,
            as_is / conjugate.max(f64::MIN_POSITIVE)
        )
    })
}

/// Computes the small rotation from one quaternion to the next in the axes of the first \[rad\].
fn turn_rad([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 3] {
    let real = a * e + b * f + c * g + d * h;
    let vector = [
        a * f - b * e - c * h + d * g,
        a * g - c * e - d * f + b * h,
        a * h - d * e - b * g + c * f,
    ];
    vector.map(|part| 2.0 * part * real.signum())
}
