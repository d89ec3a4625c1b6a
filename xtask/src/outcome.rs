//! What the steps of the suite have in common: how one ends that did not fail, and the command that runs
//! tests.

use std::process::Command;

use crate::shell;

/// How a step ended that did not fail.
pub(crate) enum Outcome {
    Passed,
    /// It could not run on this machine; the reason is printed in the table.
    Skipped(String),
}

/// The suite is the same sample each time; campaigns take others.
pub(crate) const SEED: &str = "1";

/// The tests, each of chance the same sample.
pub(crate) fn cargo_test() -> Command {
    let mut command = shell::cargo("test");
    command.env("PROPTEST_RNG_SEED", SEED);
    command
}
