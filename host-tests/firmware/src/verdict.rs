//! Tests that each fault raised its counter, and no fault another's.
//!
//! It takes the injections and the health items at their boundaries, and gives a [`Row`] for each kind of fault, to be
//! printed. It panics with the first injection that was miscounted, because this is for tests.

use std::collections::BTreeMap;
use std::fmt;

use trueaxis::Status;
use trueaxis::health::{HEALTH_ITEMS, item};

use crate::campaign::{Fault, Injection};
use crate::player::HealthItems;

/// The result of one kind of fault over all its injections.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The fault.
    pub fault: Fault,
    /// Number of injections.
    pub injected: u32,
    /// Number of injections for which its counter grew.
    pub seen: u32,
    /// Events that were to be counted; of a fault that lasts, its injections.
    pub due: u32,
    /// Count of its counter; of a fault that lasts, the output periods that it stood.
    pub counted: u32,
    /// Other counters that grew, each of which the fault entails, and how often.
    pub consequences: BTreeMap<u8, u32>,
}

/// Names of a [`Row`]'s columns.
pub const HEADER: &str = "fault | injected | seen | due | counted | with it";

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            injected,
            seen,
            due,
            counted,
            ..
        } = self;
        let name = self.fault.name();
        write!(
            f,
            "{name} | {injected} | {seen} | {due} | {counted} |{}",
            if self.consequences.is_empty() {
                " –"
            } else {
                ""
            }
        )?;
        for (number, (index, times)) in self.consequences.iter().enumerate() {
            let name = match *index {
                item::STUCK_LINES => "stuck lines",
                bit => Status::name(bit).unwrap_or("?"),
            };
            let comma = if number == 0 { "" } else { "," };
            write!(f, "{comma} {name} {times}")?;
        }
        Ok(())
    }
}

/// True if item `index` counts faults.
fn is_counter(index: u8) -> bool {
    index < 32 || index == item::STUCK_LINES
}

/// The periods at which [`judge`] needs the health items: the beginning of each interval, and the end of the last.
pub fn boundaries(injections: &[Injection]) -> Vec<u32> {
    let ends = injections.last().map(|one| one.end);
    injections.iter().map(|one| one.begin).chain(ends).collect()
}

/// Checks that a unit without faults counts nothing.
pub fn nothing_is_counted(health: &HealthItems) {
    for (index, value) in HEALTH_ITEMS.into_iter().zip(health) {
        assert!(!is_counter(index) || *value == 0, "{index} counts {value}");
    }
}

/// Compares every injection's counters with the injection; rows in the order of [`Fault::ALL`].
pub fn judge(injections: &[Injection], health_at: &[HealthItems]) -> Vec<Row> {
    let mut rows = Fault::ALL.map(|fault| Row {
        fault,
        injected: 0,
        seen: 0,
        due: 0,
        counted: 0,
        consequences: BTreeMap::new(),
    });
    for (injection, health) in injections.iter().zip(health_at.windows(2)) {
        let row = &mut rows[injection.fault as usize];
        row.injected += 1;
        row.due += injection.counted;
        for (place, index) in HEALTH_ITEMS.into_iter().enumerate() {
            if !is_counter(index) {
                continue;
            }
            let counted = health[1][place] - health[0][place];
            if index == injection.fault.counter() {
                row.counted += counted;
                row.seen += u32::from(counted > 0);
                if injection.fault.lasts() {
                    assert!(counted >= injection.counted, "not seen: {injection:?}");
                } else {
                    assert_eq!(counted, injection.counted, "{injection:?}");
                }
            } else if counted > 0 {
                assert!(
                    injection.fault.consequences().contains(&index),
                    "counter {index} grew by {counted}: {injection:?}"
                );
                *row.consequences.entry(index).or_default() += 1;
            }
        }
    }
    rows.to_vec()
}

/// Checks that the first injection is latched, by its own bit or by one that the fault also raises and that showed
/// before it.
pub fn first_is_latched(first: &Injection, health: &HealthItems) {
    let value = |index| {
        let place = HEALTH_ITEMS.iter().position(|known| *known == index);
        health[place.expect("an item")]
    };
    let entailed = first.fault.consequences().iter().copied();
    let bits = entailed
        .chain([first.fault.counter()])
        .filter(|bit| *bit < 32)
        .fold(0, |bits, bit| bits | 1 << bit);
    let latched = value(item::FIRST_FAULT_STATUS);
    assert!(
        latched != 0 && latched & !bits == 0,
        "{latched:#x}: {first:?}"
    );
    // A fault found by a window has the number of the window's last sample; none is longer than the settled stretch's
    // beginning.
    let period = value(item::FIRST_FAULT_PERIOD);
    assert!(
        (first.onset..first.end).contains(&period),
        "{period}: {first:?}"
    );
}
