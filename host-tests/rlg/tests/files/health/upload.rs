//! `rlg upload` over a socket to the firmware's own service on simulated flash: a block of another unit is refused with both
//! numbers, one of the same unit is stored.
#![cfg(unix)]

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::thread;

use firmware_tests::nor::{Nor, SECTOR};
use trueaxis::frame_finder::FrameFinder;
use trueaxis::parameter_slots::ParameterSlots;
use trueaxis::service::Service;
use trueaxis::service_frame::{REQUEST_BYTES, Request};
use trueaxis::terms::TermKinds;
use trueaxis::{Identity, Parameters, UnitNumber};

use super::bench::Bench;

/// A stopped unit that answers on the socket until its peer hangs up; returns its flash afterwards.
fn unit(listener: UnixListener, flash: Nor<4>) -> Nor<4> {
    let mut flash = flash;
    let slots = ParameterSlots::new(&mut flash, [0, SECTOR as u32]);
    let mut service = Service::new(slots, TermKinds::NONE);
    let (mut stream, _) = listener.accept().expect("a peer");
    let mut requests = FrameFinder::<Request, REQUEST_BYTES>::new();
    let mut bytes = [0; 256];
    while let Ok(length @ 1..) = stream.read(&mut bytes) {
        for byte in &bytes[..length] {
            if let Some(request) = requests.push(*byte) {
                let reply = service.answer(&request, || true);
                if stream.write_all(&reply.answer.to_bytes()).is_err() {
                    break;
                }
            }
        }
    }
    flash
}

fn flash_of(unit: &str) -> Nor<4> {
    let mut flash = Nor::<4>::erased();
    let number = UnitNumber::of_text(unit).expect("a number");
    let own = Parameters::default().with(|known| known.identity = Some(Identity::new(number)));
    let stored = ParameterSlots::new(&mut flash, [0, SECTOR as u32]).store(&own);
    assert_eq!(stored.ok(), Some(1));
    flash
}

#[test]
fn a_block_of_another_unit_is_refused_with_both_numbers() {
    let bench = Bench::new();
    for (name, number) in [("own.bin", "RLG-1000"), ("other.bin", "RLG-0007")] {
        bench.json(&[
            "params",
            "model.toml",
            "--unit-number",
            number,
            "--out",
            name,
        ]);
    }
    let talk = |block: &str, port: &str, flash: Nor<4>| {
        let listener = UnixListener::bind(bench.at(port)).expect("a socket");
        let unit = thread::spawn(move || unit(listener, flash));
        let output = bench.run(&["upload", block, "--port", port, "--json"]);
        (output, unit.join().expect("the unit"))
    };
    let before = flash_of("RLG-1000");
    let (output, after) = talk("other.bin", "a.sock", before.clone());
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(
        words.contains("other.bin: is refused by the unit, found a block of unit RLG-0007"),
        "{words}"
    );
    assert!(words.contains("whose number ends in 1000"), "{words}");
    assert!(after.content == before.content, "flash was touched");

    let (output, after) = talk("own.bin", "b.sock", before);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{words}");
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (&result["generation"], &result["unit"]),
        (&2.into(), &"RLG-1000".into())
    );
    let mut flash = after;
    let loaded = ParameterSlots::new(&mut flash, [0, SECTOR as u32]).load();
    assert_eq!(loaded.parameters, bench.block("own.bin"));
}
