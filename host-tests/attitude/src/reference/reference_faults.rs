//! Detection of faulty stamps of the reference before the search for physics: spikes, and rough stretches.

use nalgebra::Vector3;
use rlg_plan::{AttitudePlan, ReferenceFaultPlan};
use rlg_signal::axes::Triad;
use rlg_signal::quantiles::{median, quantile};

use crate::rows::fitting::Fitting;
use crate::rows::increments::{Increments, Stamps};
use crate::rows::linearised_rows::About;

/// Leaves out stamps far from a running median; true if there are any.
pub fn spikes(
    about: &About,
    (_, left_rad): (&Fitting, &Triad),
    known: &mut Stamps,
    plan: &AttitudePlan,
) -> bool {
    let plan = &plan.reference_faults;
    let increments = &about.increments;
    let error_rad = errors(increments, left_rad);
    let mut faulty = vec![false; error_rad[0].len()];
    if increments.period_s < plan.slow_s {
        out_of_median(&error_rad, increments.period_s, plan, &mut faulty);
    }
    known.leave_out(&increments.stamps, &faulty)
}

/// Leaves out stretches far rougher than others; true if there are any.
pub fn rough_stretches(
    about: &About,
    (_, left_rad): (&Fitting, &Triad),
    known: &mut Stamps,
    plan: &AttitudePlan,
) -> bool {
    let plan = &plan.reference_faults;
    let increments = &about.increments;
    let error_rad = errors(increments, left_rad);
    let places = increments.places().iter();
    let rate_rad_s: Vec<Vector3<f64>> = places
        .map(|place| about.motion.rate_rad_s(*place))
        .collect();
    let mut faulty = vec![false; error_rad[0].len()];
    rough(
        &error_rad,
        &rate_rad_s,
        (increments.period_s, plan),
        &mut faulty,
    );
    known.leave_out(&increments.stamps, &faulty)
}

/// Attitude error at every stamp, the cumulative sum of the rows' residuals \[rad\].
fn errors(increments: &Increments, left_rad: &Triad) -> Triad {
    std::array::from_fn(|axis| {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for (row, grown) in left_rad[axis].iter().enumerate() {
            if !increments.is_free(row) {
                sum += grown;
            }
            sums.push(sum);
        }
        sums
    })
}

fn out_of_median(error_rad: &Triad, period_s: f64, plan: &ReferenceFaultPlan, faulty: &mut [bool]) {
    let width = ((plan.median_s / period_s).round() as usize).max(5) | 1;
    let medians = error_rad
        .each_ref()
        .map(|values| running_median(values, width / 2));
    let away: Vec<f64> = (0..faulty.len())
        .map(|stamp| {
            let squares =
                (0..3).map(|axis| (error_rad[axis][stamp] - medians[axis][stamp]).powi(2));
            squares.sum::<f64>().sqrt()
        })
        .collect();
    let whole = median(away.iter().copied()).unwrap_or(0.0);
    // The scale changes with the motion: the 80th percentile over four widths, of which a fifth may be faulty.
    let sizes = away.chunks(4 * width).flat_map(|stretch| {
        let scale = quantile(stretch.iter().copied(), 0.8).unwrap_or(0.0) + 0.25 * whole;
        stretch.iter().map(move |away| away / scale)
    });
    let sizes: Vec<f64> = sizes.collect();
    let reach = (plan.joined_s / period_s) as usize + 1;
    join(&sizes, reach, plan, faulty);
    join_back(&sizes, reach, plan, faulty);
}

/// Marks spikes, and stamps that still deviate within `reach` stamps of the last marked one: a reference recovers gradually
/// from a fault.
fn join(sizes: &[f64], reach: usize, plan: &ReferenceFaultPlan, faulty: &mut [bool]) {
    let mut last: Option<usize> = None;
    for stamp in 0..sizes.len() {
        let is_near = last.is_some_and(|last| stamp - last <= reach);
        if sizes[stamp] > plan.spike || (is_near && sizes[stamp] > plan.shoulder) {
            let from = last.filter(|_| is_near).unwrap_or(stamp);
            faulty[from..=stamp].fill(true);
            last = Some(stamp);
        }
    }
}

/// Joins faulty stamps before a spike, from the end.
fn join_back(sizes: &[f64], reach: usize, plan: &ReferenceFaultPlan, faulty: &mut [bool]) {
    let backwards: Vec<f64> = sizes.iter().rev().copied().collect();
    faulty.reverse();
    join(&backwards, reach, plan, faulty);
    faulty.reverse();
}

/// Marks stretches rougher than the median of all and than that of similar motion: an error that grows with the rate of one
/// gyro is no fault, and several gyros seldom turn alike.
fn rough(
    error_rad: &Triad,
    rate_rad_s: &[Vector3<f64>],
    (period_s, plan): (f64, &ReferenceFaultPlan),
    faulty: &mut [bool],
) {
    let length = ((plan.stretch_s / period_s) as usize).max(8);
    let stamps = faulty.len();
    let count = stamps / length;
    if count < plan.least_stretches {
        return;
    }
    let range = |stretch: usize| match stretch + 1 == count {
        true => stretch * length..stamps,
        false => stretch * length..(stretch + 1) * length,
    };
    let sizes: Vec<(f64, Vector3<f64>)> = (0..count)
        .map(|stretch| {
            let used: Vec<usize> = range(stretch).filter(|stamp| !faulty[*stamp]).collect();
            let square: f64 = error_rad.iter().map(|values| scatter(values, &used)).sum();
            let squares = used
                .iter()
                .map(|stamp| rate_rad_s[*stamp].map(|rate| rate * rate));
            let square_rate = squares.sum::<Vector3<f64>>() / used.len().max(1) as f64;
            (square.sqrt(), square_rate.map(f64::sqrt))
        })
        .collect();
    let typical = median(sizes.iter().map(|(size, _)| *size)).unwrap_or(0.0);
    for (stretch, (size, rate)) in sizes.iter().enumerate() {
        let axis = rate.imax();
        let least_rate = plan.similar_rate * rate[axis];
        let alike = sizes.iter().filter(|(_, other)| other[axis] >= least_rate);
        let of_alike = median(alike.map(|(size, _)| *size)).unwrap_or(0.0);
        if *size > plan.rough * typical && *size > plan.rough * of_alike {
            faulty[range(stretch)].fill(true);
        }
    }
}

/// Mean square about two levels, separated at the best change point: a jump is no roughness.
fn scatter(values: &[f64], used: &[usize]) -> f64 {
    let own: Vec<f64> = used.iter().map(|stamp| values[*stamp]).collect();
    let count = own.len() as f64;
    let sum: f64 = own.iter().sum();
    let mean = sum / count.max(1.0);
    let whole: f64 = own.iter().map(|value| (value - mean).powi(2)).sum();
    let mut before = 0.0;
    let explained = own.iter().enumerate().map(|(k, value)| {
        before += value - mean;
        let share = (k + 1) as f64 / count;
        match share < 1.0 {
            true => before * before / (count * share * (1.0 - share)),
            false => 0.0,
        }
    });
    let explained = explained.fold(0.0, f64::max);
    (whole - explained).max(0.0) / count.max(1.0)
}

/// Median of the values up to `half` places away, by a sorted window.
pub(crate) fn running_median(values: &[f64], half: usize) -> Vec<f64> {
    let mut window: Vec<f64> = Vec::with_capacity(2 * half + 2);
    let place_of = |window: &[f64], value: f64| {
        window.partition_point(|other| other.total_cmp(&value).is_lt())
    };
    let mut entered = 0;
    let medians = (0..values.len()).map(|place| {
        while entered < values.len().min(place + half + 1) {
            window.insert(place_of(&window, values[entered]), values[entered]);
            entered += 1;
        }
        if let Some(left) = place.checked_sub(half + 1) {
            window.remove(place_of(&window, values[left]));
        }
        window[window.len() / 2]
    });
    medians.collect()
}

#[cfg(test)]
mod tests {
    use rlg_plan::ReferenceFaultPlan;

    use nalgebra::Vector3;

    use super::{join, join_back, rough, running_median};

    #[test]
    fn an_error_of_the_gyro_that_turns_is_no_fault_and_one_in_usual_motion_is() {
        const PERIOD_S: f64 = 0.02;
        const STRETCH: usize = 200;
        // The axes turn one after the other, ten stretches each; the third gyro has an error.
        let rate = |stamp: usize| {
            let mut rate = Vector3::repeat(0.01);
            rate[stamp / (10 * STRETCH)] = 1.0;
            rate
        };
        let rates: Vec<Vector3<f64>> = (0..30 * STRETCH).map(rate).collect();
        let marked = |failed: std::ops::Range<usize>| -> Vec<usize> {
            let error = |stamp: usize| {
                let size = match stamp {
                    _ if failed.contains(&stamp) => 0.05,
                    stamp if stamp >= 20 * STRETCH => 0.02,
                    _ => 1e-3,
                };
                size * (0.37 * (stamp * stamp % 101) as f64).sin()
            };
            let errors = [0.0, 0.0, 1.0].map(|share| {
                (0..30 * STRETCH)
                    .map(|stamp| share * error(stamp))
                    .collect()
            });
            let mut faulty = vec![false; 30 * STRETCH];
            let plan = ReferenceFaultPlan::default();
            rough(&errors, &rates, (PERIOD_S, &plan), &mut faulty);
            (0..30)
                .filter(|stretch| faulty[stretch * STRETCH + 7])
                .collect()
        };
        assert_eq!(marked(0..0), Vec::<usize>::new());
        assert_eq!(marked(5 * STRETCH..6 * STRETCH), [5]);
    }

    #[test]
    fn a_running_median_is_that_of_each_window() {
        let values: Vec<f64> = (0..50).map(|k| f64::from(k * k % 17)).collect();
        for half in [0, 3, 60] {
            let medians = running_median(&values, half);
            for (place, found) in medians.iter().enumerate() {
                let mut near =
                    values[place.saturating_sub(half)..50.min(place + half + 1)].to_vec();
                near.sort_by(f64::total_cmp);
                assert_eq!(*found, near[near.len() / 2], "{place} of {half}");
            }
        }
    }

    #[test]
    fn what_still_stands_out_beside_a_spike_belongs_to_it_and_nothing_further_away() {
        let mut sizes = vec![1.0; 40];
        // A shoulder before, the spike, quiet stamps, a shoulder after; another shoulder out of reach.
        for (stamp, size) in [(8, 5.0), (10, 20.0), (13, 6.0), (30, 6.0)] {
            sizes[stamp] = size;
        }
        let mut faulty = vec![false; sizes.len()];
        let plan = ReferenceFaultPlan::default();
        join(&sizes, 4, &plan, &mut faulty);
        join_back(&sizes, 4, &plan, &mut faulty);
        let found: Vec<usize> = (0..sizes.len()).filter(|stamp| faulty[*stamp]).collect();
        assert_eq!(found, (8..=13).collect::<Vec<_>>());
    }
}
