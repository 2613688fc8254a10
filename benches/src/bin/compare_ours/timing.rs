use std::time::{Duration, Instant};

use dymlm_test_support::processor_time;

/// How long something took.
pub(crate) struct Timing {
    /// By the clock on the wall.
    pub(crate) wall: Duration,
    /// Processor time of this process, all its threads: what other programs on the machine do hardly changes
    /// it.
    pub(crate) cpu: Duration,
}

/// Runs and times `work`. What it returns is dropped by the caller, outside the measurement.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Timing) {
    let (wall, cpu) = (Instant::now(), processor_time());
    let output = work();
    let timing = Timing { cpu: processor_time().saturating_sub(cpu), wall: wall.elapsed() };
    (output, timing)
}
