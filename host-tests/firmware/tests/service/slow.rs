//! Temperatures on their way to the terms, and what is said where none comes.

use std::sync::atomic::{AtomicBool, Ordering};

use trueaxis::slow_channels::{NOT_MEASURED, channel};
use trueaxis::terms::Temperature;
use trueaxis::{
    BankService, BootReport, F32, Parameters, Processor, Sample, SlowFilter, SlowMailbox,
    SlowReadings, Status, TermKind, TermRecords, Timing, sample_source::Reading,
};

type Warm = Processor<F32, (Temperature,)>;

/// A unit whose bias follows the temperature: 1e-6 rad/s/K about 300 K.
fn parameters() -> Parameters {
    Parameters::default().with(|parameters| {
        parameters.terms = TermRecords::NONE;
        let values = [300.0, 300.0, 300.0, 1e-6, 1e-6, 1e-6, 0.0, 0.0, 0.0];
        let pushed = parameters
            .terms
            .push(TermKind::GyroBiasTemperature, &values);
        assert_eq!(pushed, Ok(()));
    })
}

fn warm() -> Warm {
    Warm::with_terms(&parameters(), BootReport::default()).expect("in range")
}

/// The status bits of all frames over so many periods.
fn run(processor: &mut Warm, periods: u32, service: impl Fn(u32) -> BankService) -> Status {
    let mut status = Status::default();
    for period in 0..periods {
        let reading = Reading::new(Some(Sample::default()), 1, None).with_service(service(period));
        if let Some(frame) = processor.period(reading, Timing::default()) {
            status = status.union(frame.output.status);
        }
    }
    status
}

fn temperatures(period: u32) -> BankService {
    BankService {
        channel: (period % 16) as u8,
        value: 310 * 64,
        since_pulse: BankService::NO_PULSE,
    }
}

#[test]
fn a_term_without_a_thermometer_is_said() {
    let absent = Status::TEMPERATURE_ABSENT;
    assert!(run(&mut warm(), 800, |_| BankService::NONE).contains(absent));
    let mut processor = warm();
    assert!(!run(&mut processor, 800, temperatures).contains(absent));
    // One block's is enough to say so, and a reading that the bank could not take is none.
    let broken = |period: u32| {
        let mut service = temperatures(period);
        if service.channel == channel::TEMPERATURE + 1 {
            service.value = NOT_MEASURED;
        }
        service
    };
    assert!(run(&mut processor, 800, broken).contains(absent));
    // Without a term that needs it, nothing is.
    let mut cold = Warm::with_terms(&Parameters::default(), BootReport::default()).expect("fine");
    assert!(!run(&mut cold, 800, |_| BankService::NONE).contains(absent));
}

#[test]
fn a_thermometer_of_the_firmwares_own_counts_until_it_falls_silent() {
    let mut processor = warm();
    let readings = SlowReadings {
        temperature_k: [305.0; 3],
        ..SlowReadings::default()
    };
    let mut slow = processor.slow_terms();
    let update = slow.prepare_measured(&readings);
    processor.take_slow(&update);
    let absent = Status::TEMPERATURE_ABSENT;
    assert!(!run(&mut processor, 8_000, |_| BankService::NONE).contains(absent));
    assert!(run(&mut processor, 4_000, |_| BankService::NONE).contains(absent));
    // A reading that is no temperature is none.
    let update = slow.prepare_measured(&SlowReadings::default());
    processor.take_slow(&update);
    assert!(run(&mut processor, 400, |_| BankService::NONE).contains(absent));
}

#[test]
fn an_update_prepared_aside_gives_the_same_bits_as_one_at_once() {
    let readings = |kelvin: f32| SlowReadings {
        temperature_k: [kelvin, kelvin + 1.0, kelvin - 1.0],
        temperature_rate_k_s: [0.01; 3],
        ..SlowReadings::default()
    };
    let (mut at_once, mut aside) = (warm(), warm());
    let mut slow = aside.slow_terms();
    for kelvin in [310.0, 311.0, 290.0, f32::NAN, 305.5] {
        at_once.slow(&readings(kelvin));
        let update = slow.prepare(&readings(kelvin));
        aside.take_slow(&update);
        for _ in 0..400 {
            let reading = Reading::new(Some(Sample::default()), 1, None);
            let one = at_once.period(reading, Timing::default());
            let other = aside.period(reading, Timing::default());
            assert_eq!(
                one.map(|frame| frame.output.dtheta_codes),
                other.map(|frame| frame.output.dtheta_codes)
            );
        }
    }
}

#[test]
fn the_mailbox_gives_whole_readings_while_it_is_filled() {
    let mailbox = SlowMailbox::new();
    assert!(mailbox.temperature_k().iter().all(|kelvin| kelvin.is_nan()));
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for period in 0..200_000_u32 {
                // Two values whose mixture is neither.
                let value = if period % 2 == 0 { 0x1234 } else { 0x2ACD };
                mailbox.put(BankService {
                    channel: channel::TEMPERATURE,
                    value,
                    since_pulse: 0,
                });
            }
            done.store(true, Ordering::Release);
        });
        while !done.load(Ordering::Acquire) {
            if let Some((code, count)) = mailbox.code(channel::TEMPERATURE) {
                assert!(code == 0x1234 || code == 0x2ACD, "{code:#x}");
                assert_ne!(count, 0);
            }
        }
    });
    mailbox.put(temperatures(1));
    assert_eq!(mailbox.temperature_k()[1], 310.0);
    mailbox.put(BankService::NONE);
    assert_eq!(mailbox.code(BankService::NO_CHANNEL), None);
}

#[test]
fn the_filter_follows_a_ramp() {
    let mut filter = SlowFilter::new();
    let mut rate = 0.0;
    for second in 0..100 {
        let kelvin = 300.0 + 0.02 * second as f32;
        rate = filter
            .readings([kelvin, f32::NAN, 300.0], 1.0)
            .temperature_rate_k_s[0];
    }
    assert!((rate - 0.02).abs() < 2e-4, "{rate}");
    let readings = filter.readings([f32::NAN; 3], 1.0);
    assert!(readings.temperature_k[0].is_nan());
    assert_eq!(
        filter.readings([300.0; 3], 1.0).temperature_rate_k_s[2],
        0.0
    );
}
