//! Text on the differences between recording and model, and on held-out time before and after, a line each.

use rlg_findings::names::spaced;
use rlg_findings::numbers::{Scale, band, chance, happened, seconds};
use rlg_findings::result::{ChannelEntry, Diagnosis};

use super::sizes::to_two_digits;

/// Two-sided probability of 3 σ in noise alone.
const SIGNIFICANT_CHANCE: f64 = 0.0027;

/// Power over noise below which held-out time is quieter than the fitted: noise of one level scatters less.
pub(crate) const QUIET: f64 = 0.5;

/// Number of stretches of one channel that are written out; more are counted.
const MOST_STRETCHES: usize = 2;

/// Locations where the difference exceeds the noise, channel by channel.
pub(super) fn places(diagnosis: &Diagnosis) -> Option<String> {
    let mut channels: Vec<&str> = Vec::new();
    for location in &diagnosis.locations {
        if !channels.contains(&location.channel.as_str()) {
            channels.push(&location.channel);
        }
    }
    // Until an effect is named, the relation to the motion replaces the name.
    let is_named = diagnosis
        .effects
        .iter()
        .any(|effect| !effect.parameters.is_empty());
    let each = channels.iter().map(|channel| {
        let own = diagnosis
            .locations
            .iter()
            .filter(|one| one.channel == *channel);
        let own: Vec<_> = own.collect();
        let ends = own
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[from, to], one| {
                [from.min(one.start_s), to.max(one.end_s)]
            });
        let low_hz = own
            .iter()
            .map(|one| one.low_hz)
            .fold(f64::INFINITY, f64::min);
        let high_hz = own.iter().map(|one| one.high_hz).fold(0.0, f64::max);
        let largest = own.iter().map(|one| one.size.abs()).fold(0.0, f64::max);
        let scale = Scale::of("size", &own[0].unit, largest);
        let when = match own.len() {
            0..=MOST_STRETCHES => own
                .iter()
                .map(|one| format!("{}–{} s", seconds(one.start_s), seconds(one.end_s)))
                .collect::<Vec<_>>()
                .join(", "),
            count => format!(
                "{count} stretches in {}–{} s",
                seconds(ends[0]),
                seconds(ends[1])
            ),
        };
        let size = scale.with_unit(&to_two_digits(largest * scale.factor));
        let regime = match own[0].regime.as_str() {
            regime if is_named || regime.is_empty() => String::new(),
            regime => format!(", {regime}"),
        };
        format!(
            "{} {when} ({}, {size}{regime})",
            spaced(channel),
            band(low_hz, high_hz)
        )
    });
    let each: Vec<String> = each.collect();
    (!each.is_empty()).then(|| format!("Where: {}.", each.join("; ")))
}

/// Channels compared on held-out time.
fn held_out(diagnosis: &Diagnosis) -> &[ChannelEntry] {
    match &diagnosis.fit.whole {
        Some(whole) if diagnosis.fit.channels.is_empty() => &whole.channels,
        _ => &diagnosis.fit.channels,
    }
}

/// Significant mean rates on held-out time, before and after.
pub(super) fn drift(diagnosis: &Diagnosis) -> Option<String> {
    let channels = held_out(diagnosis);
    if channels.is_empty() && !diagnosis.fit.fitted_on.is_empty() {
        return Some(
            "Held out: no rows (too few); the fit is not tested on unseen time.".to_owned(),
        );
    }
    let deviations = diagnosis.thresholds().findings.significant_deviations;
    let is_significant = |channel: &&ChannelEntry| {
        let figures = [&channel.held_out_before, &channel.held_out_after];
        let mut far = figures.iter();
        far.any(|one| one.drift_rad_s.abs() > deviations * one.drift_std_rad_s)
    };
    let shown: Vec<&ChannelEntry> = channels.iter().filter(is_significant).collect();
    let said = shown.chunk_by(|a, b| a.unit == b.unit).map(|alike| {
        let drifts = alike.iter().flat_map(|channel| {
            let figures = [&channel.held_out_before, &channel.held_out_after];
            figures.map(|one| one.drift_rad_s.abs())
        });
        let largest = drifts.fold(0.0, f64::max);
        let scale = Scale::of("drift", alike[0].unit.unwrap_or("rad/s"), largest);
        let each: Vec<String> = alike
            .iter()
            .map(|channel| drift_of(channel, &scale))
            .collect();
        scale.with_unit(&each.join("; "))
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| format!("Held-out drift: {}.", said.join("; ")))
}

/// Mean rate of one channel, as "gyro x falls 1.436 → 0.030 ± 0.055".
fn drift_of(channel: &ChannelEntry, scale: &Scale) -> String {
    let (before, after) = (&channel.held_out_before, &channel.held_out_after);
    let (from, to) = (before.drift_rad_s, after.drift_rad_s);
    let first = scale.pair(from, before.drift_std_rad_s);
    let first = match first.split_once(" ± ") {
        Some((value, _)) if !value.starts_with('(') => value.to_owned(),
        _ => first,
    };
    format!(
        "{} {} {first} → {}",
        spaced(&channel.channel),
        happened(from, to, after.drift_std_rad_s),
        scale.pair(to, after.drift_std_rad_s),
    )
}

/// Power over noise on held-out time, before and after.
pub(super) fn power(diagnosis: &Diagnosis) -> Option<String> {
    let channels = held_out(diagnosis);
    let shown = |power: f64| match power {
        power if (0.1..100.0).contains(&power) => format!("{power:.2}"),
        power => to_two_digits(power),
    };
    let held_s: f64 = diagnosis
        .fit
        .held_out
        .iter()
        .map(|[from, to]| to - from)
        .sum();
    let mut said: Vec<String> = Vec::new();
    let mut same: Vec<f64> = Vec::new();
    for channel in channels {
        let before = channel.held_out_before.normalised_power;
        let after = channel.held_out_after.normalised_power;
        if shown(before) == shown(after) {
            same.push(after);
            continue;
        }
        // The mean of 2 B T squares of unit variance has the relative standard deviation 1/√(B T).
        let [low_hz, high_hz] = channel.band_hz;
        let scatter = after / ((high_hz - low_hz) * held_s).sqrt();
        said.push(format!(
            "{} {} {} → {}",
            spaced(&channel.channel),
            happened(before, after, scatter),
            shown(before),
            shown(after)
        ));
    }
    if let (Some(least), Some(most)) = (
        same.iter().copied().reduce(f64::min),
        same.iter().copied().reduce(f64::max),
    ) {
        let range = match shown(least) == shown(most) {
            true => shown(least),
            false => format!("{} to {}", shown(least), shown(most)),
        };
        let which = if said.is_empty() { "all" } else { "the other" };
        let word = if same.len() == 1 { "stays" } else { "stay" };
        said.push(format!("{which} {} {word} at {range}", same.len()));
    }
    let quieter = quieter(channels).map_or_else(String::new, |said| format!(": {said}"));
    (!said.is_empty()).then(|| {
        format!(
            "Held-out power over noise: {} (1 = noise alone{quieter}).",
            said.join("; ")
        )
    })
}

/// States which channels are quieter on held-out time than the fitted noise: that varies, and its mean is no measure of a
/// quieter time.
pub(crate) fn quieter(channels: &[ChannelEntry]) -> Option<String> {
    let quiet = channels
        .iter()
        .filter(|one| one.held_out_after.normalised_power < QUIET);
    let quiet: Vec<String> = quiet.map(|one| spaced(&one.channel)).collect();
    let of = match quiet.len() {
        0 => return None,
        count if count == channels.len() => String::new(),
        _ => format!(" of {}", quiet.join(", ")),
    };
    Some(format!("the held-out time{of} is quieter than the fitted"))
}

/// Channels with a held-out residual that is not white (unexplained remainder).
pub(super) fn unlike_noise(diagnosis: &Diagnosis) -> Option<String> {
    if diagnosis.verdict.is_consistent() {
        return None;
    }
    let left = held_out(diagnosis).iter().filter_map(|channel| {
        let p_value = channel.held_out_after.white_p_value;
        (p_value < SIGNIFICANT_CHANCE)
            .then(|| format!("{} (chance {})", spaced(&channel.channel), chance(p_value)))
    });
    let left: Vec<String> = left.collect();
    (!left.is_empty()).then(|| format!("Held-out residual exceeds its noise: {}.", left.join(", ")))
}
