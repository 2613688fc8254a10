use std::collections::BTreeMap;

use dymlm::{FrameReport, MapConfig, MapCounts, MapMemory, MultiLevelMap, Stage};
use serde::Serialize;

use crate::Milliseconds;

/// `report.json`: what a run did, how long its steps took, and how it was configured.
#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    /// Frames of the sequence.
    pub frames: usize,
    /// Frames that could not be loaded or were refused.
    pub frames_skipped: usize,
    /// Frames that were mapped.
    pub key_frames: usize,
    /// Times of the whole insertion of key frames ("insert") and of each of its steps.
    pub stages: BTreeMap<&'static str, Milliseconds>,
    /// What is in the maps.
    pub counts: MapCounts,
    /// Bytes that each map holds.
    pub memory: MapMemory,
    /// Most memory the process held, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// The config.
    pub config: MapConfig,
}

impl RunReport {
    /// Sums a run up from the reports of its frames.
    pub fn new(frames: usize, reports: &[FrameReport], map: &MultiLevelMap, config: MapConfig) -> Self {
        let mut stages: BTreeMap<_, _> =
            Stage::ALL.iter().map(|&stage| (stage.name(), step_time(reports, stage))).collect();
        stages.insert("insert", insertion_time(reports));
        Self {
            frames,
            frames_skipped: frames - reports.len(),
            key_frames: reports.iter().filter(|report| report.update().is_some()).count(),
            stages,
            counts: map.counts(),
            memory: map.memory(),
            peak_memory_bytes: peak_memory_bytes(),
            config,
        }
    }
}

/// How long a step took; what only key frames take is timed over key frames.
pub fn step_time(reports: &[FrameReport], stage: Stage) -> Milliseconds {
    let timed = reports.iter().filter(|report| stage < Stage::Cloud || report.update().is_some());
    Milliseconds::of(timed.map(|report| report.stages.of(stage).as_secs_f64() * 1e3).collect())
}

/// How long the whole insertion of a key frame took.
pub fn insertion_time(reports: &[FrameReport]) -> Milliseconds {
    let mapped = reports.iter().filter(|report| report.update().is_some());
    Milliseconds::of(mapped.map(|report| report.stages.total().as_secs_f64() * 1e3).collect())
}

/// Most memory this process ever held, as Linux tells it.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
