//! The motion that an attitude reference shows, as increments of the body on the gyros' rows.
//!
//! Between stamps the body turns by a rotation vector; less the coning of adjacent ones it is the angle that the rates add up
//! to (Savage 1998, eq. 33), which a cubic spline takes to the rows.

use nalgebra::{UnitQuaternion, Vector3};

/// Stamps further apart than this many of their median steps leave what is between them unknown.
const LONGEST_STEP: f64 = 3.5;

/// Increments of the body by row \[rad\]; `None` where the stamps do not show them.
///
/// # Inputs
/// `stamps`: time on the gyros' clock \[s\] and attitude; `jumps_s`: after which the attitudes are turned; rows of `period_s` begin
/// at `start_s`.
pub fn increments(
    stamps: &[(f64, UnitQuaternion<f64>)],
    jumps_s: &[f64],
    (start_s, period_s, rows): (f64, f64, usize),
) -> Vec<Option<Vector3<f64>>> {
    let mut shown = vec![None; rows];
    let mut steps: Vec<f64> = stamps
        .windows(2)
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    steps.sort_by(f64::total_cmp);
    let Some(median_s) = steps.get(steps.len() / 2) else {
        return shown;
    };
    let is_one_run = |a: &(f64, UnitQuaternion<f64>), b: &(f64, UnitQuaternion<f64>)| {
        let mut jumps = jumps_s.iter();
        b.0 - a.0 < LONGEST_STEP * median_s && !jumps.any(|jump_s| (a.0..b.0).contains(jump_s))
    };
    for run in stamps.chunk_by(is_one_run).filter(|run| run.len() > 3) {
        let times_s: Vec<f64> = run.iter().map(|stamp| stamp.0).collect();
        let angles = angles(run);
        let splines: [Spline; 3] = std::array::from_fn(|axis| {
            Spline::new(&times_s, angles.iter().map(|angle| angle[axis]).collect())
        });
        let row = |time_s: f64| ((time_s - start_s) / period_s).max(0.0);
        let first = row(times_s[0]).ceil() as usize;
        let last = (row(times_s[times_s.len() - 1]).floor() as usize).min(rows);
        let at = |boundary: usize| {
            let time_s = start_s + boundary as f64 * period_s;
            Vector3::from_fn(|axis, _| splines[axis].at(time_s))
        };
        for (row, shown) in shown.iter_mut().enumerate().take(last).skip(first) {
            *shown = Some(at(row + 1) - at(row));
        }
    }
    shown
}

/// Angles that the rates add up to at each stamp \[rad\].
fn angles(run: &[(f64, UnitQuaternion<f64>)]) -> Vec<Vector3<f64>> {
    let mut sum = Vector3::zeros();
    let mut angles = vec![sum];
    let mut before = Vector3::zeros();
    for pair in run.windows(2) {
        let turned = (pair[0].1.inverse() * pair[1].1).scaled_axis();
        sum += turned - before.cross(&turned) / 12.0;
        before = turned;
        angles.push(sum);
    }
    angles
}

/// A natural cubic spline.
struct Spline<'a> {
    places: &'a [f64],
    values: Vec<f64>,
    /// Second derivatives.
    bends: Vec<f64>,
}

impl<'a> Spline<'a> {
    fn new(places: &'a [f64], values: Vec<f64>) -> Self {
        let last = places.len() - 1;
        let step = |k: usize| places[k + 1] - places[k];
        let slope = |k: usize| (values[k + 1] - values[k]) / step(k);
        // Elimination forwards, then backwards, of a matrix of three diagonals.
        let (mut above, mut right) = (vec![0.0; last + 1], vec![0.0; last + 1]);
        for k in 1..last {
            let whole = 2.0 * (step(k - 1) + step(k)) - step(k - 1) * above[k - 1];
            above[k] = step(k) / whole;
            right[k] = (6.0 * (slope(k) - slope(k - 1)) - step(k - 1) * right[k - 1]) / whole;
        }
        let mut bends = vec![0.0; last + 1];
        for k in (1..last).rev() {
            bends[k] = right[k] - above[k] * bends[k + 1];
        }
        Self {
            places,
            values,
            bends,
        }
    }

    fn at(&self, place: f64) -> f64 {
        let last = self.places.len() - 1;
        let right = self
            .places
            .partition_point(|one| *one < place)
            .clamp(1, last);
        let left = right - 1;
        let step = self.places[right] - self.places[left];
        let share = (place - self.places[left]) / step;
        let bend = |share: f64| share.powi(3) - share;
        (1.0 - share) * self.values[left]
            + share * self.values[right]
            + step * step / 6.0
                * (bend(1.0 - share) * self.bends[left] + bend(share) * self.bends[right])
    }
}
