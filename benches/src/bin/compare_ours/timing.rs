use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// How long something took.
pub(crate) struct Timing {
    /// By the clock on the wall.
    pub(crate) wall: Duration,
    /// Processor time of this process, all its threads: what other programs on the machine do hardly changes it.
    pub(crate) cpu: Duration,
}

/// Runs and times `work`. What it returns is dropped by the caller, outside the measurement.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Timing) {
    let (wall, cpu) = (Instant::now(), process_time());
    let output = work();
    let timing = Timing { cpu: process_time().saturating_sub(cpu), wall: wall.elapsed() };
    (output, timing)
}

fn process_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
