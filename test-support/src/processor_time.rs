use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time of all threads of this process: other programs on the machine hardly affect it.
pub fn processor_time() -> Duration {
    time_of(ClockId::ProcessCPUTime)
}

/// Processor time of the thread that asks.
pub(crate) fn thread_time() -> Duration {
    time_of(ClockId::ThreadCPUTime)
}

fn time_of(clock: ClockId) -> Duration {
    let now = clock_gettime(clock);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
