//! End of windows, and dithers that are still starting.

use trueaxis::sample_source::Reading;
use trueaxis::{BootReport, F32, Fixed, NumberSystem, Processor, Status, Timing};

use crate::frames;
use crate::triad::Triad;

/// 30 ms are 120 samples, twelve frames of ten: the result of a window is in the frame that ends it.
#[test]
fn a_window_closes_with_its_twelfth_frame() {
    fn first_finding<N: NumberSystem>() -> Option<usize> {
        let weak = Triad {
            amplitude_rad: Triad::default().amplitude_rad.map(|rad| 0.3 * rad),
            ..Triad::default()
        };
        let parameters = Triad::default()
            .parameters()
            .with(|p| p.adaptation_time_s = 1.0);
        let (frames, _) = frames::<N>(&parameters, weak.stream().take(400));
        let mut statuses = frames.iter().map(|frame| frame.status);
        statuses.position(|status| status.contains(Status::DITHER_OUT_OF_BAND))
    }
    assert_eq!(
        (first_finding::<F32>(), first_finding::<Fixed>()),
        (Some(11), Some(11))
    );
}

/// A unit whose dithers stand still for `still` samples.
fn started<N: NumberSystem>(still: usize) -> Processor<N> {
    let parameters = Triad::default().parameters();
    let mut processor = Processor::<N>::new(&parameters, BootReport::default()).expect("in range");
    let at_rest = Triad {
        amplitude_rad: [0.0; 3],
        ..Triad::default()
    };
    let samples = at_rest
        .stream()
        .take(still)
        .chain(Triad::default().stream().take(12_000 - still));
    for sample in samples {
        let reading = Reading::new(Some(sample), 1, None);
        processor.period(
            reading,
            Timing {
                missed: 0,
                late: false,
            },
        );
    }
    processor
}

#[test]
fn a_dither_that_is_still_starting_is_counted_and_not_the_first_fault() {
    fn judged<N: NumberSystem>() {
        let slow = started::<N>(4000);
        assert!(slow.faults().dither_stopped > 300, "{:?}", slow.faults());
        assert_eq!(slow.health().first.stages, Status::default(), "{}", N::NAME);
        // A start may take 2 s.
        let dead = started::<N>(10_000);
        let first = dead.health().first;
        assert!(
            first.stages.contains(Status::DITHER_STOPPED),
            "{}: {first:?}",
            N::NAME
        );
        assert!(
            (8000..8200).contains(&first.sample),
            "{}: {first:?}",
            N::NAME
        );
    }
    judged::<F32>();
    judged::<Fixed>();
}
