use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// The time that some work took.
pub(crate) struct Timing {
    pub(crate) wall: Duration,
    /// Processor time of all threads of this process.
    pub(crate) cpu: Duration,
}

/// Runs `work` and measures its time. The caller drops its output, outside the measurement.
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
