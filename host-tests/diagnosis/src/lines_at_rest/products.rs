//! Intermodulation products: frequencies of lines that follow from those of stronger ones, folded at the row rate.

use rlg_plan::LinePlan;

use super::line::{Clock, Line, Orders, Origin};

/// Products of the strongest independent lines: multiples, and sums and differences of two and three, the simplest first.
pub(crate) fn products(lines: &[Line], plan: &LinePlan) -> Vec<Orders> {
    let mut own: Vec<usize> = (0..lines.len())
        .filter(|&place| matches!(lines[place].origin, Origin::Own(_)))
        .collect();
    own.sort_by(|&a, &b| lines[b].gain.total_cmp(&lines[a].gain));
    own.truncate(plan.fundamentals);
    let mut all = Vec::new();
    let mut of_order: Vec<Orders> = vec![Vec::new()];
    for order in 1..=plan.highest_order {
        let mut next: Vec<Orders> = Vec::new();
        for orders in &of_order {
            for &place in &own {
                for sign in [1, -1] {
                    let Some(more) = with(orders, place, sign) else {
                        continue;
                    };
                    let opposite: Orders = more.iter().map(|&(at, n)| (at, -n)).collect();
                    if !next.contains(&more) && !next.contains(&opposite) {
                        next.push(more);
                    }
                }
            }
        }
        if order > 1 {
            all.extend(next.iter().cloned());
        }
        of_order = next;
    }
    all
}

/// Product with one factor more; `None` if that cancels one.
fn with(orders: &Orders, place: usize, sign: i32) -> Option<Orders> {
    let mut more = orders.clone();
    match more.iter_mut().find(|(known, _)| *known == place) {
        Some((_, order)) if order.signum() != sign => return None,
        Some((_, order)) => *order += sign,
        None => more.push((place, sign)),
    }
    more.sort_unstable_by_key(|&(place, _)| place);
    // The first order is positive: the conjugate rotates as fast the other way.
    if more[0].1 < 0 {
        more.iter_mut().for_each(|(_, order)| *order = -*order);
    }
    Some(more)
}

/// Apparent frequency of a product in the rows \[Hz\].
pub(crate) fn shown_hz(orders: &Orders, lines: &[Line], clock: Clock) -> f64 {
    let each = orders.iter();
    let sum = each.map(|&(place, order)| f64::from(order) * own_hz(&lines[place]));
    clock.folded_hz(sum.sum())
}

fn own_hz(line: &Line) -> f64 {
    match &line.origin {
        Origin::Own(phase) => phase.hz,
        Origin::Product(_) => line.shown_hz,
    }
}

/// Expression of a product in a file: `line(9.17737)^2*conj(line(29.88819))`.
pub(crate) fn expression(orders: &Orders, lines: &[Line]) -> String {
    let each = orders.iter().map(|&(place, order)| {
        let of = format!("line({:.5})", own_hz(&lines[place]));
        let turned = if order < 0 { format!("conj({of})") } else { of };
        match order.abs() {
            1 => turned,
            times => format!("{turned}^{times}"),
        }
    });
    each.collect::<Vec<_>>().join("*")
}

/// The same in words.
pub(crate) fn words(orders: &Orders, lines: &[Line]) -> String {
    if let [(place, order)] = orders[..] {
        return format!("{} times {:.3} Hz", order.abs(), own_hz(&lines[place]));
    }
    let mut text = String::new();
    for &(place, order) in orders {
        let sign = match (text.is_empty(), order > 0) {
            (true, _) => "",
            (false, true) => " + ",
            (false, false) => " - ",
        };
        text += &format!("{sign}{} x {:.3} Hz", order.abs(), own_hz(&lines[place]));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::line::{Clock, Line, Origin, Phase};
    use super::{expression, products, shown_hz, words};
    use realfft::num_complex::Complex64;

    fn own(hz: f64, gain: f64) -> Line {
        Line {
            origin: Origin::Own(Phase {
                hz,
                hz_std: 0.0,
                course_rad: Vec::new(),
                wander_hz: [0.0; 2],
            }),
            shown_hz: hz,
            amplitude_rad: [Complex64::ONE; 3],
            measured_rad: [Complex64::ONE; 3],
            std_rad: [0.1; 3],
            gain,
            ln_chance: -100.0,
        }
    }

    #[test]
    fn products_of_two_lines_are_recognised_where_they_fold_to() {
        let lines = [own(9.186, 2.0), own(29.912, 3.0)];
        let clock = Clock {
            rows: 19_200,
            rate_hz: 64.0,
        };
        let all = products(&lines, &rlg_plan::LinePlan::default());
        let of = |hz: f64| {
            let found = all
                .iter()
                .find(|one| (shown_hz(one, &lines, clock) - hz).abs() < 0.004)?;
            Some((words(found, &lines), expression(found, &lines)))
        };
        let (said, written) = of(20.726).expect("a difference");
        assert_eq!(said, "1 x 9.186 Hz - 1 x 29.912 Hz");
        assert_eq!(written, "line(9.18600)*conj(line(29.91200))");
        // 2 x 29.912 = 59.824 Hz, seen at 64 - 59.824.
        let (said, written) = of(4.176).expect("a multiple");
        assert_eq!(said, "2 times 29.912 Hz");
        assert_eq!(written, "line(29.91200)^2");
        assert_eq!(of(13.3), None);
        // 2a, 2b, a ± b; 3a, 3b, 2a ± b, a ± 2b.
        assert_eq!(all.len(), 10);
    }
}
