//! The unit in service: slow channels, pulse per second, identity of the parameters, messages, single increments.

mod campaign;
mod identity;
mod increments;
mod messages;
mod pulses;
mod slow;
