use std::time::{Duration, Instant};

use dymlm_test_support::processor_time;

/// The time that some work took.
pub(crate) struct Timing {
    /// Wall-clock time.
    pub(crate) wall: Duration,
    /// Processor time of all threads of this process, which other programs on the machine hardly affect.
    pub(crate) cpu: Duration,
}

/// Runs `work` and measures its time. The caller drops its output, outside the measurement.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Timing) {
    let (wall, cpu) = (Instant::now(), processor_time());
    let output = work();
    let timing = Timing { cpu: processor_time().saturating_sub(cpu), wall: wall.elapsed() };
    (output, timing)
}
