use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time of all threads of this process: other programs on the machine hardly affect it.
pub fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
