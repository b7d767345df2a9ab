//! Section on the noise of the unit: the terms of IEEE 952, measured and declared by the model, and Allan deviations.

use maud::{Markup, html};

use super::beside::{Beside, Declared};
use super::chart::{self, Chart};
use super::words::{
    ARCSEC_PER_RAD, DEG_H_PER_RAD_S, DEG_SQRT_H_PER_RAD_SQRT_S, MICRO_G_PER_M_S2, number, rounded,
    spaced, with_spread,
};
use rlg_findings::result::{Diagnosis, LevelEntry, NoiseEntry};
use rlg_recording::AXES;

/// °/h/√h in one rad/s/√s.
const DEG_H_SQRT_H_PER_RAD_S_SQRT_S: f64 = 60.0 * DEG_H_PER_RAD_S;

/// Noise term: heading, factor to the heading's unit, measured value, value declared by the model.
struct Term {
    heading: &'static str,
    factor: f64,
    measured: fn(&NoiseEntry) -> Option<LevelEntry>,
    declared: fn(&Declared) -> Option<[f64; 3]>,
}

/// Level without a standard deviation, as used for the whitening.
fn judged(value: f64) -> LevelEntry {
    LevelEntry { value, std: 0.0 }
}

/// Terms in the order of their slopes.
const TERMS: [Term; 4] = [
    Term {
        heading: "Q [″]",
        factor: ARCSEC_PER_RAD,
        measured: |noise| {
            Some(noise.terms.map_or(judged(noise.angle_noise_rad), |terms| {
                terms.quantisation_rad
            }))
        },
        declared: |_| None,
    },
    Term {
        heading: "N [°/√h]",
        factor: DEG_SQRT_H_PER_RAD_SQRT_S,
        measured: |noise| {
            let walk = judged(noise.angle_random_walk_rad_sqrt_s);
            Some(
                noise
                    .terms
                    .map_or(walk, |terms| terms.angle_random_walk_rad_sqrt_s),
            )
        },
        declared: |model| model.angle_random_walk_rad_sqrt_s,
    },
    Term {
        heading: "B [°/h]",
        factor: DEG_H_PER_RAD_S,
        measured: |noise| Some(noise.terms?.bias_instability_rad_s),
        declared: |model| model.bias_instability_rad_s,
    },
    Term {
        heading: "K [°/h/√h]",
        factor: DEG_H_SQRT_H_PER_RAD_S_SQRT_S,
        measured: |noise| Some(noise.terms?.rate_random_walk_rad_s_sqrt_s),
        declared: |model| model.rate_random_walk_rad_s_sqrt_s,
    },
];

/// Section; empty if no noise is known.
pub fn section(diagnosis: &Diagnosis, beside: &Beside, allan: &[Chart]) -> Markup {
    if diagnosis.noise.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "Noise" }
            div.tables {
                (gyros(diagnosis, &beside.declared))
                (accelerometers(diagnosis))
            }
            p.note { "Terms of IEEE 952. <: the bound, 3σ up, of a term that does not stand out. Without ±: what the residual was judged with." }
            (chart::row(allan))
        }
    }
}

fn gyros(diagnosis: &Diagnosis, declared: &Declared) -> Markup {
    let plan = &diagnosis.thresholds().findings;
    let known = |term: &&Term| {
        (term.declared)(declared).is_some()
            || diagnosis
                .noise
                .iter()
                .any(|noise| (term.measured)(noise).is_some())
    };
    let terms: Vec<&Term> = TERMS.iter().filter(known).collect();
    let model = |term: &Term, channel: &str| {
        let axis = AXES.iter().position(|axis| channel.ends_with(axis))?;
        Some(number(rounded(
            (term.declared)(declared)?[axis] * term.factor,
        )))
    };
    html! {
        div.scroll { table {
            thead { tr {
                th { "noise of" }
                @for term in &terms {
                    th { (term.heading) }
                    @if (term.declared)(declared).is_some() { th { "model" } }
                }
            } }
            tbody {
                @for noise in &diagnosis.noise {
                    tr {
                        td.number { (spaced(&noise.channel)) }
                        @for term in &terms {
                            td.number {
                                @match (term.measured)(noise) {
                                    Some(level) if level.is_measured(plan) && level.std > 0.0 => (with_spread(level.value * term.factor, level.std * term.factor)),
                                    Some(level) if level.std > 0.0 => { "< " (number(rounded(level.bound(plan) * term.factor))) },
                                    Some(level) => (number(level.value * term.factor)),
                                    None => "–",
                                }
                            }
                            @if (term.declared)(declared).is_some() {
                                td.number { (model(term, &noise.channel).unwrap_or_default()) }
                            }
                        }
                    }
                }
            }
        } }
    }
}

fn accelerometers(diagnosis: &Diagnosis) -> Markup {
    html! {
        @if !diagnosis.accelerometer_noise.is_empty() {
            div.scroll { table {
                thead { tr { th { "noise of" } th { "white noise [µg/√Hz]" } th { "velocity noise [m/s]" } } }
                tbody {
                    @for noise in &diagnosis.accelerometer_noise {
                        tr {
                            td { (spaced(&noise.channel)) }
                            td.number { (number(noise.noise_m_s2_sqrt_hz * MICRO_G_PER_M_S2)) }
                            td.number { (number(noise.velocity_noise_m_s)) }
                        }
                    }
                }
            } }
        }
    }
}
