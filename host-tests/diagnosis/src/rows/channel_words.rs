//! Sentences on gyros that follow the reference, or their pickoffs, in other axes, with another sign or in another unit.

use rlg_plan::ChannelCausePlan;
use rlg_signal::channel_check::Crossing;
use rlg_signal::channel_map::Lead;
use rlg_signal::same_motion::Apart;
use rlg_signal::streams::AXES;

/// Name of the channel that the gyros follow.
fn name(lead: Lead) -> &'static str {
    match lead {
        Lead::Reference => "the reference",
        Lead::Pickoff => "the pickoffs",
    }
}

/// Sentence on gyros and reference with two different motions.
pub fn apart(found: &Apart, plan: &ChannelCausePlan) -> String {
    let most_here = plan.here_over_there * found.by_chance;
    let elsewhere = match found.by_chance >= plan.other_piece && found.share < most_here {
        true => format!(
            "; with its stamps {:.2} s later it follows them: do the two begin at different times?",
            found.at_lag_s
        ),
        false => format!(
            "; lags beyond any delay give {:.0} % by chance",
            100.0 * found.by_chance
        ),
    };
    format!(
        "gyros and reference measure different motions: at delays up to half a second the reference explains at most {:.0} % of the gyros' power{elsewhere}",
        100.0 * found.share,
    )
}

/// Factors caused by units and counters, with their suggested cause.
const CAUSES: [(f64, &str); 12] = [
    (57.295_779_513_082_32, "degrees where radians are meant?"),
    (3600.0, "arcseconds for degrees, or seconds for hours?"),
    (206_264.806_247, "arcseconds where radians are meant?"),
    (1000.0, "milli-units, or milliseconds for seconds?"),
    (1e6, "micro-units?"),
    (std::f64::consts::TAU, "turns where radians are meant?"),
    (
        9.549_296_585_513_72,
        "turns a minute where radians a second are meant?",
    ),
    (60.0, "minutes for seconds?"),
    (
        2.0,
        "counts or degrees? Pulses counted twice, or the range of the sensor set to its half, do this",
    ),
    (
        4.0,
        "all four edges of a quadrature counted, or the range of the sensor set to its quarter?",
    ),
    (8.0, "the range of the sensor set to its eighth?"),
    (16.0, "the range of the sensor set to its sixteenth?"),
];

/// First listed cause near a factor: its nominal factor and the suggestion.
///
/// # Inputs
/// `rate_hz`: row rate \[Hz\], the factor of increments read as rates; NaN to leave that cause out.
pub fn cause(factor: f64, rate_hz: f64, plan: &ChannelCausePlan) -> Option<(f64, &'static str)> {
    let size = factor.abs();
    let is_near = |wanted: f64| (size / wanted - 1.0).abs() < plan.near_cause;
    let listed = CAUSES
        .iter()
        .flat_map(|(one, words)| [(*one, *words), (1.0 / one, *words)]);
    let of_rows = [rate_hz, 1.0 / rate_hz].map(|one| (one, "increments read as rates?"));
    listed
        .chain(of_rows)
        .find(|(one, _)| is_near(*one))
        .map(|(one, words)| (one * factor.signum(), words))
}

/// True if a factor is that between two units: small powers of two are settings of a sensor.
pub fn is_unit(factor: f64, plan: &ChannelCausePlan) -> bool {
    let settings = plan.settings;
    let is_setting = |one: f64| settings.contains(&one) || settings.contains(&(1.0 / one));
    cause(factor, f64::NAN, plan).is_some_and(|(one, _)| !is_setting(one.abs()))
}

/// Formats a number with three decimals, in exponential form with four where it is large or small.
fn times(factor: f64) -> String {
    match factor.abs() {
        size if !(0.1..1000.0).contains(&size) => format!("{factor:.4e}"),
        _ => format!("{factor:.3}"),
    }
}

/// Sentence on a crossing of axes, signs or units.
pub fn sentence(lead: Lead, crossing: &Crossing, plan: &ChannelCausePlan) -> String {
    let what = said(lead, crossing, f64::NAN, plan);
    let done = match (crossing.is_registration(), lead) {
        (true, _) => {
            "taken as the mount of the unit: the reference was rotated into the gyros' axes"
        }
        (false, Lead::Reference) => "the reference was corrected before the diagnosis",
        (false, Lead::Pickoff) => "the pickoffs were corrected before the diagnosis",
    };
    let mut what = what;
    if let Some(first) = what.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    format!("{what}; {done}.")
}

/// Describes the axes, signs and factors in which the gyros follow a channel.
fn said(lead: Lead, crossing: &Crossing, rate_hz: f64, plan: &ChannelCausePlan) -> String {
    let mut parts = Vec::new();
    if crossing.is_turned() {
        parts.push(axes(lead, crossing));
    }
    if crossing.has_factor() {
        parts.push(factors(lead, crossing, rate_hz, plan));
    }
    let still: Vec<&str> = (0..3)
        .filter(|&axis| !crossing.measured.moves[axis])
        .map(|axis| AXES[axis])
        .collect();
    if crossing.is_turned() && !still.is_empty() {
        let of = still.join(" and ");
        parts.push(format!("about {of} not measured"));
    }
    parts.join("; ")
}

/// Measured coefficient of a gyro on an axis, with its standard deviation.
fn measured(crossing: &Crossing, gyro: usize, axis: usize) -> String {
    let (value, std) = (
        crossing.measured.map[(gyro, axis)],
        crossing.measured.std[(gyro, axis)],
    );
    format!("{value:.3} \u{b1} {std:.3}")
}

/// Describes the order and the signs of the axes.
fn axes(lead: Lead, crossing: &Crossing) -> String {
    let lead_name = name(lead);
    let moves = |axis: usize| crossing.measured.moves[axis];
    let Some(order) = crossing.order() else {
        let turn = nalgebra::Rotation3::from_matrix_unchecked(crossing.axes);
        let said = match (crossing.is_improper(), turn.axis_angle()) {
            (false, Some((axis, angle_rad))) => format!(
                "the gyros' axes are rotated against {lead_name}'s by {:.1}\u{b0} about ({:.3}, {:.3}, {:.3})",
                angle_rad.to_degrees(),
                axis.x,
                axis.y,
                axis.z
            ),
            _ => format!(
                "no rotation maps {lead_name}'s axes to the gyros': one of them is reversed"
            ),
        };
        return said;
    };
    let is_exchanged = (0..3).any(|gyro| order[gyro].0 != gyro);
    if is_exchanged {
        let names: Vec<String> = order
            .iter()
            .map(|(axis, sign)| format!("{}{}", if *sign < 0.0 { "-" } else { "" }, AXES[*axis]))
            .collect();
        let numbers: Vec<String> = (0..3)
            .filter(|&gyro| order[gyro].0 != gyro && moves(order[gyro].0))
            .map(|gyro| {
                let axis = order[gyro].0;
                format!(
                    "gyro {} reads {:.3} times {lead_name} on {}",
                    AXES[gyro],
                    crossing.measured.map[(gyro, axis)],
                    AXES[axis]
                )
            })
            .collect();
        return format!(
            "gyro columns follow {lead_name}'s {} ({})",
            names.join(", "),
            numbers.join(", ")
        );
    }
    let turned: Vec<usize> = (0..3).filter(|&gyro| order[gyro].1 < 0.0).collect();
    let numbers: Vec<String> = turned
        .iter()
        .map(|&gyro| measured(crossing, gyro, gyro))
        .collect();
    format!(
        "{} -1.00 times {lead_name} (measured: {})",
        who(&turned),
        numbers.join(", ")
    )
}

/// Subject and verb: "gyro z reads", "gyros x and y read", "all three read".
fn who(gyros: &[usize]) -> String {
    let names: Vec<&str> = gyros.iter().map(|&gyro| AXES[gyro]).collect();
    match gyros.len() {
        3 => "all three read".to_string(),
        1 => format!("gyro {} reads", names[0]),
        _ => format!("gyros {} read", names.join(" and ")),
    }
}

/// Describes the gross factors, gyros of one factor together.
fn factors(lead: Lead, crossing: &Crossing, rate_hz: f64, plan: &ChannelCausePlan) -> String {
    let mut left: Vec<usize> = (0..3)
        .filter(|&gyro| crossing.factors[gyro] != 1.0)
        .collect();
    let mut parts = Vec::new();
    while let Some(&first) = left.first() {
        let factor = crossing.factors[first];
        let alike = |gyro: &usize| {
            let relative = crossing.factors[*gyro] / factor - 1.0;
            relative.abs() < plan.one_cause
        };
        let (together, rest): (Vec<usize>, Vec<usize>) = left.iter().copied().partition(alike);
        left = rest;
        let mean = together
            .iter()
            .map(|&gyro| crossing.factors[gyro])
            .sum::<f64>()
            / together.len() as f64;
        let why =
            cause(mean, rate_hz, plan).map_or(String::new(), |(_, words)| format!(": {words}"));
        parts.push(format!(
            "{} {} times {}{why}",
            who(&together),
            times(mean),
            name(lead)
        ));
    }
    parts.join("; ")
}

/// Reason for the refusal of a recording.
pub fn refusal(
    crossings: &[(Lead, Crossing)],
    recording: &str,
    rate_hz: f64,
    plan: &ChannelCausePlan,
) -> String {
    let each: Vec<String> = crossings
        .iter()
        .map(|(lead, crossing)| said(*lead, crossing, rate_hz, plan))
        .collect();
    format!(
        "disagrees on the axes with recording {recording}: {}; most likely {}",
        each.join("; "),
        advice(crossings)
    )
}

/// Channel most likely at fault, and its fault.
fn advice(crossings: &[(Lead, Crossing)]) -> String {
    let of = |wanted: Lead| {
        let mut all = crossings.iter();
        all.find(|(lead, _)| *lead == wanted).map(|(_, one)| one)
    };
    let whose = match (of(Lead::Reference), of(Lead::Pickoff)) {
        (Some(_), Some(_)) => "the gyro's own channel",
        (None, _) => "the pickoff's channel",
        (Some(_), None) => "either the reference's channel or the gyro's",
    };
    let (_, first) = &crossings[0];
    let is_exchanged = first
        .order()
        .is_none_or(|order| (0..3).any(|gyro| order[gyro].0 != gyro));
    let what = match (first.is_turned(), is_exchanged) {
        (true, true) => "is exchanged with another axis",
        (true, false) => "has the wrong sign",
        (false, _) => "has the wrong scale (or the model another pulse weight)",
    };
    format!("{whose} {what}")
}
