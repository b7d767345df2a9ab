//! Stretches and stamps at which the reference was wrong, as findings.

use std::collections::BTreeMap;

use rlg_findings::entries::by_axis;
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::attitude_samples::AttitudeSample;

/// Stamps in a row that were left out.
pub(crate) struct Span {
    start_s: f64,
    end_s: f64,
    stamps: usize,
}

/// Up to so many stamps are a spike.
const SPIKE_STAMPS: usize = 3;

/// Contiguous stamps that were left out of the fit but not for the test.
pub(crate) fn spans(samples: &[AttitudeSample], tested: &[bool], left_out: &[bool]) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut is_open = false;
    for (stamp, sample) in samples.iter().enumerate() {
        let is_faulty = left_out[stamp] && !tested[stamp];
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
    fn kind(&self) -> &'static str {
        if self.stamps <= SPIKE_STAMPS {
            "reference_spike"
        } else {
            "reference_dropout"
        }
    }

    /// As the contract has it: a spike of one stamp at its time, else from begin to end.
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

    pub(crate) fn entry(&self) -> EffectEntry {
        let number = |name: &str, value: f64| ParameterEntry::Number {
            name: name.to_string(),
            value,
            std: 0.0,
            unit: "s".to_string(),
        };
        let (_, mut covariance) = by_axis([0.0; 3], [0.0; 3], "s");
        covariance.truncate(2);
        covariance.iter_mut().for_each(|row| row.truncate(2));
        EffectEntry {
            kind: self.kind().to_string(),
            indistinguishable_from: Vec::new(),
            gravity_speaks_against: Vec::new(),
            equation: String::new(),
            parameters: vec![number("start_s", self.start_s), number("end_s", self.end_s)],
            covariance,
            identifiable: Vec::new(),
            log_evidence_gain: 0.0,
            p_value: 0.0,
            what_was_left_out: format!(
                "The reference is wrong from {:.3} to {:.3} s ({} stamps): it leaves its own neighbours by far more than its noise, or is far rougher than elsewhere. Those stamps were left out of everything else.",
                self.start_s, self.end_s, self.stamps
            ),
            expression: None,
            regimes: Vec::new(),
            evidence: None,
        }
    }
}

/// One sentence on all of them.
pub(crate) fn sentence(spans: &[Span]) -> Option<String> {
    let first = spans.first()?;
    let stamps: usize = spans.iter().map(|span| span.stamps).sum();
    Some(format!(
        "Reference: {stamps} attitudes in {} places are wrong and were left out, the first at {:.3} s: glitches of the reference, not of the gyros.",
        spans.len(),
        first.start_s
    ))
}
