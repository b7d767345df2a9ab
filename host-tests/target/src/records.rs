//! Turns samples into the records that an emulated counter bank plays.
//!
//! Records have free-running counters, sequence numbers, check sums, and the slow channels and stamps of a bank at rest;
//! block frame.

use trueaxis::Sample;
use trueaxis::bank_record::BankRecord;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame, BankService};
use trueaxis::slow_channels::CHANNELS;

/// One ordinary record a sample. The counts of the first are lost: a bank's first frame only primes the
/// differences, and the chain's first sample adds no rotation either.
pub fn records_of(samples: impl IntoIterator<Item = Sample>) -> Vec<BankRecord> {
    samples
        .into_iter()
        .enumerate()
        .scan(BankFrame::default(), |bank, (period, sample)| {
            *bank = bank.followed_by(&sample, AccelerometerInput::Counters);
            bank.service = service(period);
            Some(BankRecord::ordinary(bank.to_bytes()))
        })
        .collect()
}

/// Slow channel and stamp of a bank whose channels do not change, at 4 kHz, with a pulse each second.
fn service(period: usize) -> BankService {
    BankService {
        channel: (period % CHANNELS) as u8,
        value: 300 * 64,
        since_pulse: (period % 4_000) as u32 * 4_000,
    }
}

/// `samples` played forward, backward, forward and so on, `count` in all.
///
/// Played backward, a period's pulses change their sign and its end is the beginning that it had. So pulses and
/// pickoffs fit together at every sample, also where the direction changes, at which only the rate reverses within one
/// period. Such a change of direction is no real motion of the unit. Accelerometer codes keep their sign, as a specific
/// force does.
pub fn reflected(samples: &[Sample], count: usize) -> impl Iterator<Item = Sample> {
    let legs = samples.len().saturating_sub(1).max(1);
    (0..count).map_while(move |at| {
        let Some(step) = at.checked_sub(1) else {
            return samples.first().copied();
        };
        let (leg, step) = (step / legs, step % legs);
        if leg.is_multiple_of(2) {
            return samples.get(step + 1).copied();
        }
        let undone = samples.get(legs - step)?;
        let beginning = samples.get(legs - step - 1)?;
        Some(Sample {
            pulse_counts: undone.pulse_counts.map(i32::wrapping_neg),
            pickoff_codes: beginning.pickoff_codes,
            accelerometer_codes: undone.accelerometer_codes,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::reflected;
    use trueaxis::Sample;

    #[test]
    fn there_and_back_keeps_counts_and_pickoffs_together() {
        // A block that only dithers: the running count is the pickoff.
        let angle = [0, 5, 9, 4, -3, -8];
        let samples: Vec<Sample> = (0..angle.len())
            .map(|at| Sample {
                pulse_counts: [angle[at] - angle[at.saturating_sub(1)]; 3],
                pickoff_codes: [angle[at]; 3],
                accelerometer_codes: [7; 3],
            })
            .collect();
        let played: Vec<Sample> = reflected(&samples, 23).collect();
        assert_eq!(played.len(), 23);
        let mut count = 0;
        for sample in &played {
            count += sample.pulse_counts[0];
            assert_eq!(count, sample.pickoff_codes[0]);
        }
        let shown: Vec<i32> = played
            .iter()
            .map(|sample| sample.pickoff_codes[0])
            .collect();
        assert_eq!(shown[..12], [0, 5, 9, 4, -3, -8, -3, 4, 9, 5, 0, 5]);
    }
}
