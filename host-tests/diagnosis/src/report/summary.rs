//! Texts on a set besides its findings: the summary, the kinds not excluded, and the runners-up.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use rlg_catalogue::Signals;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries;
use rlg_catalogue::signals::AXES;
use rlg_findings::result::{RunnerUp, Verdict};
use rlg_findings::sentences::REJECTED;
use rlg_inference::{Drift, Fit};
use rlg_signal::streams::Streams;

use super::finding::{Finding, Numbers, numbers};
use crate::confirm::ConfirmedSet;
use crate::confirm::goodness::Misfit;
use crate::search::structure::Found;

pub(crate) fn summary(
    verdict: Verdict,
    findings: &[Finding],
    confirmed: &ConfirmedSet,
    found: &Found,
) -> Vec<String> {
    let fit = &confirmed.fit;
    let kind_of = |place: usize| found.candidates[found.judged[place].hypothesis].kind;
    let mut lines = vec![rlg_findings::sentences::opening(verdict).to_string()];
    // Effects of practical size first; the others are quantified all the same.
    let mut ordered: Vec<&Finding> = findings.iter().collect();
    ordered.sort_by(|a, b| {
        (a.is_slight, b.share)
            .partial_cmp(&(b.is_slight, a.share))
            .unwrap_or(Ordering::Equal)
    });
    let signals = &found.motion.signals;
    lines.extend(ordered.into_iter().map(|one| found_line(one, fit, signals)));
    for &place in &confirmed.unconfirmed {
        lines.push(format!(
            "{REJECTED}{}: fails blocked cross-validation.",
            kind_of(place)
        ));
    }
    let fallen = confirmed.reenacted_away.iter();
    let fallen = fallen.map(|&place| kind_of(place));
    for kind in confirmed.shown_anyway.iter().copied().chain(fallen) {
        lines.push(format!(
            "{REJECTED}{kind}: a parametric bootstrap without it reproduces it."
        ));
    }
    for &place in &confirmed.impossible {
        lines.push(format!(
            "{REJECTED}{}: estimate outside physical bounds.",
            kind_of(place)
        ));
    }
    let drifting: Vec<&str> = (0..3)
        .filter(|&axis| fit.drift[axis] != Drift::None)
        .map(|axis| AXES[axis])
        .collect();
    if !drifting.is_empty() {
        lines.push(format!(
            "Drift: gyro {} beyond white noise.",
            drifting.join(", ")
        ));
    }
    lines
}

/// Sentence on a finding.
fn found_line(one: &Finding, fit: &Fit, signals: &Signals) -> String {
    let Numbers {
        each, covariance, ..
    } = numbers(one, fit);
    let numbers: Vec<String> = each
        .iter()
        .enumerate()
        .map(|(k, number)| {
            let std = covariance[(k, k)].max(0.0).sqrt();
            let unit = match number.unit {
                "1" => String::new(),
                unit => format!(" {unit}"),
            };
            format!("{} {:.3e} ± {std:.1e}{unit}", number.name, number.value)
        })
        .collect();
    let kind = match one.candidate.variant {
        Variant::Expression { axis, expression } => format!(
            "gyro {} follows {}, outside the catalogue",
            AXES[axis],
            expression.text(signals)
        ),
        _ => one.candidate.kind.to_string(),
    };
    let alike = match (one.alike.is_empty(), one.or_drift) {
        (true, false) => String::new(),
        (true, true) => ", or drift".to_string(),
        (false, false) => format!(", or {}", one.alike.join(" or ")),
        (false, true) => format!(", or {} or drift", one.alike.join(" or ")),
    };
    let size = if one.is_slight {
        format!(
            "; {:.1e} of the residual's power, below the angle noise of every gyro",
            one.share
        )
    } else {
        String::new()
    };
    let place = one.recording.map(|name| format!(" in {name}"));
    format!(
        "Found{}: {kind}{alike}: {}; gains {:.1} in cross-validated log score{size}.",
        place.unwrap_or_default(),
        numbers.join(", "),
        one.confirmed_gain
    )
}

/// Sentence on the band in which a gyro's residual deviates most from its noise.
pub(crate) fn unlike_noise(gyro: usize, misfits: &[Misfit], rate_hz: f64) -> Option<String> {
    let of_gyro = misfits.iter().filter(|one| one.gyro == gyro);
    let most = of_gyro.max_by(|a, b| a.ratio.total_cmp(&b.ratio))?;
    let [from, to] = most.band.map(|share| share * rate_hz);
    Some(format!(
        "Not explained: residual of gyro {} inconsistent with the fitted spectrum; between {from:.2} and {to:.2} Hz it has {:.2} times its power.",
        AXES[gyro], most.ratio
    ))
}

/// Channel that a kind needs, if the recording lacks it.
pub fn no_channel(kind: &str, streams: &Streams) -> Option<&'static str> {
    if kind == entries::PULL && !streams.own_motion {
        Some("no attitudes as the reference")
    } else if kind == entries::PULL && streams.force_m_s2.is_none() {
        Some("no specific force channel")
    } else if kind.contains("temperature") && streams.temperature_k.is_none() {
        Some("no temperature channel")
    } else if kind.contains("magnetic") && streams.magnetic_t.is_none() {
        Some("no magnetic field channel")
    } else if kind.starts_with("dither") && streams.pickoff_rad.is_none() {
        Some("no dither")
    } else if (kind.contains("force") || kind.contains("_g")) && streams.force_m_s2.is_none() {
        Some("no specific force channel")
    } else {
        None
    }
}

/// Kinds of the catalogue without a candidate, with the reason.
pub(crate) fn not_excluded(found: &Found, streams: &Streams) -> Vec<String> {
    let tried: BTreeSet<&str> = found.candidates.iter().map(|one| one.kind).collect();
    let reason = |kind: &str| {
        let unseen = match streams.at_rest {
            Some(_) => "needs motion; the unit was at rest",
            None => "motion below the reference's noise: not observable",
        };
        no_channel(kind, streams).unwrap_or(unseen)
    };
    entries::CATALOGUE
        .iter()
        .filter(|entry| !tried.contains(entry.kind))
        .map(|entry| format!("{}: {}", entry.kind, reason(entry.kind)))
        .collect()
}

pub(crate) fn runners_up(found: &Found) -> Vec<RunnerUp> {
    let rivals = found.judged.iter().flat_map(|judged| &judged.rivals);
    RunnerUp::nearest(rivals.map(|(rival, behind)| (found.candidates[*rival].kind, *behind)))
}
