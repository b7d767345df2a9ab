//! The command `rlg`.
fn main() {}
