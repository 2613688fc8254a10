use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// How long something took.
pub(crate) struct Timing {
    pub(crate) wall: Duration,
    /// Of this process, all its threads.
    pub(crate) cpu: Duration,
}

/// Runs and times `work`. What it returns is dropped by the caller, outside the measurement.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Timing) {
    let (wall, cpu) = (Instant::now(), processor_time());
    let output = work();
    let timing = Timing { cpu: processor_time().saturating_sub(cpu), wall: wall.elapsed() };
    (output, timing)
}

fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
