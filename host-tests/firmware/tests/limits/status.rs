//! Bits of the status: each has its own name and its own place, and sets of them behave as sets.

use trueaxis::Status;

/// Bit, constant, name in reports, and whether it is a fault in service.
const BITS: [(u8, Status, &str, bool); 32] = [
    (0, Status::COUNTS_SATURATED, "counts saturated", true),
    (1, Status::PICKOFF_SATURATED, "pickoff saturated", true),
    (
        2,
        Status::ACCELERATION_SATURATED,
        "acceleration saturated",
        true,
    ),
    (3, Status::OUTPUT_SATURATED, "output saturated", true),
    (4, Status::PRIMED, "primed", false),
    (5, Status::PICKOFF_FAILED, "pickoff failed", true),
    (6, Status::DITHER_STOPPED, "dither stopped", true),
    (7, Status::DITHER_OUT_OF_BAND, "dither out of band", true),
    (8, Status::COUNTER_STUCK, "counter stuck", true),
    (9, Status::VELOCITY_SATURATED, "velocity saturated", true),
    (10, Status::DYNAMIC_TERM_OFF, "dynamic term off", false),
    (11, Status::ADAPTING, "adapting", false),
    (12, Status::GAP, "gap", true),
    (13, Status::CARRIED_OVER, "carried over", false),
    (14, Status::DITHER_DRIVE, "dither drive out of range", true),
    (
        15,
        Status::PARAMETERS_FOREIGN,
        "parameters of another unit",
        false,
    ),
    (16, Status::INTERRUPT_MISSED, "interrupt missed", true),
    (17, Status::INTERRUPT_LATE, "interrupt late", true),
    (18, Status::SAMPLE_REPEATED, "sample repeated", true),
    (19, Status::SAMPLE_LOST, "sample lost", true),
    (20, Status::FRAME_CHECKSUM, "frame check sum", true),
    (21, Status::BUS_FAULT, "bus fault", true),
    (22, Status::OUTPUT_OVERRUN, "output overrun", true),
    (23, Status::CLOCK_FALLBACK, "clock fallback", false),
    (24, Status::PARAMETERS_DEFAULT, "nominal parameters", false),
    (25, Status::PARAMETER_SLOT_BAD, "parameter slot bad", false),
    (26, Status::BANK_RESTARTED, "bank restarted", true),
    (27, Status::INTENSITY_LOW, "intensity low", true),
    (28, Status::MODE_HOP, "mode hop", true),
    (
        29,
        Status::TEMPERATURE_RANGE,
        "temperature out of range",
        true,
    ),
    (30, Status::TEMPERATURE_ABSENT, "temperature absent", true),
    (31, Status::PULSE_LOST, "pulse per second lost", true),
];

#[test]
fn every_bit_has_its_place_its_name_and_its_gravity() {
    for (bit, status, name, is_fault) in BITS {
        assert_eq!(status.bits(), 1 << bit, "{name}");
        assert_eq!(Status::name(bit), Some(name), "bit {bit}");
        assert_eq!(
            Status::IN_SERVICE_FAULTS.contains(status),
            is_fault,
            "{name}"
        );
    }
    let named = BITS.map(|(bit, ..)| bit);
    for bit in (0..=u8::MAX).filter(|bit| !named.contains(bit)) {
        assert_eq!(Status::name(bit), None, "bit {bit}");
    }
    let known = BITS
        .iter()
        .fold(0, |all, (_, status, ..)| all | status.bits());
    assert_eq!(
        Status::IN_SERVICE_FAULTS.bits() & !known,
        0,
        "faults without a name"
    );
}

#[test]
fn a_status_is_shown_by_the_names_of_its_bits() {
    assert_eq!(format!("{:?}", Status::default()), "Status()");
    let both = Status::MODE_HOP.union(Status::GAP);
    assert_eq!(format!("{both:?}"), "Status(gap, mode hop)");
}

#[test]
fn sets_of_bits_are_sets() {
    let (one, other) = (Status::GAP, Status::PRIMED);
    let both = one.union(other);
    assert_eq!(both.bits(), 1 << 12 | 1 << 4);
    assert_eq!(both.union(one), both);
    assert!(both.contains(one) && both.contains(other) && both.contains(both));
    assert!(!one.contains(both) && !one.contains(other));
    assert!(one.contains(Status::default()));
    assert_eq!(both.when(true), both);
    assert_eq!(both.when(false), Status::default());
    assert_eq!(Status::from_bits(u32::MAX).bits(), u32::MAX);
}
