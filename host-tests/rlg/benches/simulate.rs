//! Rows a second of the simulator: `cargo bench --package rlg --bench simulate`.
//!
//! `plain`: `scenarios/vibration.toml`, three dithered gyros with pickoffs, reference and accelerometers at 4 kHz.
//! `with_lock_in`: the same with the beat of every gyro integrated through lock-in.

use divan::Bencher;
use divan::counter::ItemsCount;
use rlg::simulate::Simulator;
use rlg::simulate::scenario::Scenario;
use std::path::Path;

const SCENARIO: &str = include_str!("../../scenarios/vibration.toml");

const LOCK_IN: &str = "\n[[effect]]\nkind = \"lock_in\"\nx = 1e-3\ny = 1e-3\nz = 1e-3\n";

fn main() {
    divan::main();
}

fn run(bencher: Bencher, text: &str) {
    let scenario =
        Scenario::parse(text, Path::new("vibration.toml")).expect("it comes with the tool");
    let rows = scenario.rows();
    bencher.counter(ItemsCount::new(rows)).bench(|| {
        let mut simulator = Simulator::new(&scenario, 1);
        let mut made = 0;
        while let Some(block) = simulator.next_block() {
            made = block.end_row;
        }
        assert_eq!(made, rows);
    });
}

/// 60 s.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn plain(bencher: Bencher) {
    run(bencher, SCENARIO);
}

/// 60 s.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn with_lock_in(bencher: Bencher) {
    run(bencher, &(SCENARIO.to_owned() + LOCK_IN));
}
