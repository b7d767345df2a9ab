//! Stretches and stamps with a faulty reference, as findings.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rlg_findings::entries::unlisted;
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_model::{EffectValue, ModelEffect};
use rlg_plan::ReferenceFaultPlan;
use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::AXES;

use crate::fits::report_inputs::Said;
use crate::rows::increments::Stamps;

/// Consecutive stamps that were left out.
pub(crate) struct Span {
    start_s: f64,
    end_s: f64,
    stamps: usize,
}

/// Finds contiguous stamps left out of the fit as faulty, not as held out.
///
/// # Inputs
/// `known`: flags before the search; `found`: after it.
pub(crate) fn spans(samples: &[SlowSample], known: &Stamps, found: &Stamps) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut is_open = false;
    for (stamp, sample) in samples.iter().enumerate() {
        let is_faulty = found.left_out[stamp] && !known.left_out[stamp];
        match spans.last_mut().filter(|_| is_open && is_faulty) {
            Some(span) => {
                span.end_s = sample.time_s;
                span.stamps += 1;
            }
            None if is_faulty => spans.push(Span {
                start_s: sample.time_s,
                end_s: sample.time_s,
                stamps: 1,
            }),
            None => {}
        }
        is_open = is_faulty;
    }
    spans
}

impl Span {
    fn kind(&self, plan: &ReferenceFaultPlan) -> &'static str {
        if self.stamps <= plan.spike_stamps {
            "reference_spike"
        } else {
            "reference_dropout"
        }
    }

    /// Effect of the contract: a dropout from begin to end.
    pub(crate) fn effect(&self) -> ModelEffect {
        let number = |name: &str, value: f64| (name.to_string(), EffectValue::Number(value));
        ModelEffect {
            kind: "reference_dropout".to_string(),
            parameters: BTreeMap::from([
                number("start_s", self.start_s),
                number("end_s", self.end_s),
            ]),
        }
    }

    pub(crate) fn entry(&self, plan: &ReferenceFaultPlan) -> EffectEntry {
        let number = |name: &str, value: f64| ParameterEntry::number(name, value, 0.0, "s");
        EffectEntry {
            parameters: vec![number("start_s", self.start_s), number("end_s", self.end_s)],
            covariance: vec![vec![0.0; 2]; 2],
            ..fault(
                self.kind(plan),
                format!(
                    "Reference faulty from {:.3} to {:.3} s ({} stamps): outliers or excess noise against its neighbours. Those stamps were excluded.",
                    self.start_s, self.end_s, self.stamps
                ),
            )
        }
    }
}

/// A jump of the reference in the body's axes.
pub(crate) struct JumpSeen {
    /// Time of the first attitude after the jump \[s\].
    time_s: f64,
    size_rad: Vector3<f64>,
    /// Standard deviation by body axis \[rad\].
    std_rad: [f64; 3],
}

/// Jumps not listed in the model.
pub(crate) fn jumps(said: &Said) -> Vec<JumpSeen> {
    let registered = said.registered;
    let known = &said.observed.known.jumped;
    let new = registered.jumps.iter().filter(|jump| !known[jump.stamp]);
    let about = &registered.about;
    new.map(|jump| JumpSeen {
        time_s: said.observed.samples[jump.stamp].time_s,
        size_rad: about
            .increments
            .in_body(&about.motion, jump.row, Vector3::from(jump.size_rad)),
        std_rad: jump.std_rad,
    })
    .collect()
}

impl JumpSeen {
    /// Axis of the largest component.
    fn axis(&self) -> usize {
        self.size_rad.iamax()
    }

    /// Effects of the contract, one per axis.
    pub(crate) fn effects(&self) -> [ModelEffect; 3] {
        [0, 1, 2].map(|axis: usize| ModelEffect {
            kind: "reference_jump".to_string(),
            parameters: BTreeMap::from([
                (
                    "axis".to_string(),
                    EffectValue::Text(AXES[axis].to_string()),
                ),
                ("time_s".to_string(), EffectValue::Number(self.time_s)),
                ("size".to_string(), EffectValue::Number(self.size_rad[axis])),
            ]),
        })
    }

    pub(crate) fn entry(&self) -> EffectEntry {
        let axis = self.axis();
        let (size_rad, std_rad) = (self.size_rad[axis], self.std_rad[axis]);
        EffectEntry {
            parameters: vec![
                ParameterEntry::number("time_s", self.time_s, 0.0, "s"),
                ParameterEntry::number("size", size_rad, std_rad, "rad"),
                ParameterEntry::text("axis", AXES[axis]),
            ],
            covariance: vec![vec![0.0, 0.0], vec![0.0, std_rad.powi(2)]],
            ..fault(
                "reference_jump",
                format!(
                    "Step of the reference by ({:.2e}, {:.2e}, {:.2e}) rad just before {:.3} s, absent from the gyros: its frame moved, or its filter was corrected.",
                    self.size_rad.x, self.size_rad.y, self.size_rad.z, self.time_s
                ),
            )
        }
    }
}

/// Returns one sentence on all jumps.
pub(crate) fn jumps_sentence(jumps: &[JumpSeen]) -> Option<String> {
    let largest = jumps
        .iter()
        .max_by(|a, b| a.size_rad.norm().total_cmp(&b.size_rad.norm()))?;
    Some(format!(
        "Reference: its attitude steps {}, by {:.2e} rad at {:.3} s{}; not slips of the gyros.",
        match jumps.len() {
            1 => "once".to_string(),
            count => format!("{count} times"),
        },
        largest.size_rad.norm(),
        largest.time_s,
        if jumps.len() == 1 { "" } else { " the most" },
    ))
}

/// Entry of a reference fault without parameters.
fn fault(kind: &str, what: String) -> EffectEntry {
    EffectEntry {
        kind: kind.to_string(),
        ..unlisted(String::new(), what)
    }
}

/// Returns one sentence on all spans.
pub(crate) fn sentence(spans: &[Span]) -> Option<String> {
    let first = spans.first()?;
    let stamps: usize = spans.iter().map(|span| span.stamps).sum();
    Some(format!(
        "Reference: {stamps} attitudes in {} places are faulty and were excluded, the first at {:.3} s; faults of the reference, not of the gyros.",
        spans.len(),
        first.start_s
    ))
}
