use std::collections::BTreeMap;
use std::time::Instant;

use dymlm::{FrameReport, MapBuilder, MapConfig, MapCounts, MapMemory, Stage};
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

use crate::Milliseconds;

/// `report.json`: the results of a run, the times of its steps, and its config.
#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    /// Number of frames of the sequence.
    pub frames: usize,
    /// Number of frames that could not be loaded or were refused.
    pub frames_skipped: usize,
    /// Number of frames after the one at which the user interrupted the run.
    pub frames_not_reached: usize,
    /// Number of frames that were mapped.
    pub key_frames: usize,
    /// Times of the whole insertion of key frames ("insert") and of each of its steps.
    pub stages: BTreeMap<&'static str, Milliseconds>,
    /// Sizes of the maps.
    pub counts: MapCounts,
    /// Memory in bytes of each map and of the stored key frames.
    pub memory_bytes: MapMemory,
    /// The cost of correcting the poses, if they were corrected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corrections: Option<CorrectionCost>,
    /// The cost of refining the poses, if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<CorrectionCost>,
    /// Peak memory of the process, if the system reports it.
    pub peak_memory_bytes: Option<u64>,
    /// The config.
    pub config: MapConfig,
}

/// The cost of correcting the poses.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CorrectionCost {
    /// Number of key frames whose pose has changed.
    pub key_frames: usize,
    /// Time that passed, milliseconds.
    pub wall_ms: f64,
    /// Processor time of all threads, milliseconds.
    pub cpu_ms: f64,
}

impl RunReport {
    /// Summarizes a run from the reports of its frames: of `frames` in the sequence, `tried` came to their
    /// turn until its end or an interruption, and each of these was skipped or has a report.
    pub fn new(frames: usize, tried: usize, reports: &[FrameReport], builder: &MapBuilder) -> Self {
        let mut stages: BTreeMap<_, _> =
            Stage::ALL.iter().map(|&stage| (stage.name(), step_time(reports, stage))).collect();
        stages.insert("insert", insertion_time(reports));
        Self {
            frames,
            frames_skipped: tried.saturating_sub(reports.len()),
            frames_not_reached: frames.saturating_sub(tried),
            key_frames: reports.iter().filter(|report| report.update().is_some()).count(),
            stages,
            counts: builder.map().counts(),
            memory_bytes: builder.memory(),
            corrections: None,
            refinement: None,
            peak_memory_bytes: peak_memory_bytes(),
            config: builder.config().clone(),
        }
    }
}

/// Times of a step; a step that only key frames take is timed over key frames.
pub fn step_time(reports: &[FrameReport], stage: Stage) -> Milliseconds {
    let timed = reports.iter().filter(|report| stage < Stage::Cloud || report.update().is_some());
    Milliseconds::of(timed.map(|report| report.stages.of(stage).as_secs_f64() * 1e3).collect())
}

/// Times of the whole insertion of key frames.
pub fn insertion_time(reports: &[FrameReport]) -> Milliseconds {
    let mapped = reports.iter().filter(|report| report.update().is_some());
    Milliseconds::of(mapped.map(|report| report.stages.total().as_secs_f64() * 1e3).collect())
}

/// Runs something and returns its cost.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, CorrectionCost) {
    let (wall, cpu) = (Instant::now(), processor_ms());
    let result = work();
    let wall_ms = wall.elapsed().as_secs_f64() * 1e3;
    (result, CorrectionCost { key_frames: 0, wall_ms, cpu_ms: processor_ms() - cpu })
}

/// Processor time of all threads of this process so far, milliseconds.
fn processor_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Peak memory of this process, as Linux reports it.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
