use dymlm::{FrameReport, MapMemory, Stage};
use serde::Serialize;

/// Most columns of the plot: more cannot be distinguished.
const MOST_COLUMNS: usize = 240;

/// The duration of each step over the time of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct StageSeries {
    /// Seconds since the first frame.
    times: Vec<f64>,
    /// Number of frames for each value, which is the slowest of them.
    frames_each: usize,
    /// The steps that ran, in order.
    stages: Vec<StageColumn>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct StageColumn {
    name: &'static str,
    /// One a time.
    milliseconds: Vec<f64>,
}

impl StageSeries {
    /// Takes the slowest frame of every few frames.
    pub(super) fn of(reports: &[FrameReport]) -> Self {
        let frames_each = reports.len().div_ceil(MOST_COLUMNS).max(1);
        let slowest = |chunk: &'_ [FrameReport]| {
            let index = (0..chunk.len()).max_by_key(|&index| chunk[index].stages.total()).unwrap_or(0);
            chunk[index].clone()
        };
        let shown: Vec<FrameReport> = reports.chunks(frames_each).map(slowest).collect();
        let start = reports.first().map_or(0.0, |report| report.timestamp);
        let thousandths = |value: f64| (value * 1e3).round() / 1e3;
        let column = |&stage: &Stage| StageColumn {
            name: stage.name(),
            milliseconds: shown
                .iter()
                .map(|report| thousandths(report.stages.of(stage).as_secs_f64() * 1e3))
                .collect(),
        };
        let ran = |column: &StageColumn| column.milliseconds.iter().any(|&time| time > 0.0);
        Self {
            times: shown.iter().map(|report| thousandths(report.timestamp - start)).collect(),
            frames_each,
            stages: Stage::ALL.iter().map(column).filter(ran).collect(),
        }
    }
}

/// The memory of the maps over the time of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MemorySeries {
    /// Seconds since the first frame.
    times: Vec<f64>,
    maps: Vec<MapBytes>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct MapBytes {
    name: &'static str,
    /// One a time.
    bytes: Vec<usize>,
}

impl MemorySeries {
    /// From samples (seconds since the first frame, bytes).
    pub(super) fn of(samples: &[(f64, MapMemory)]) -> Self {
        let part = |name, part: fn(&MapMemory) -> usize| MapBytes {
            name,
            bytes: samples.iter().map(|(_, memory)| part(memory)).collect(),
        };
        let maps = [
            part("cloud", |memory| memory.cloud),
            part("octree", |memory| memory.octree),
            part("planes", |memory| memory.planes),
            part("objects", |memory| memory.objects),
            part("history", |memory| memory.history),
            part("snapshots", |memory| memory.snapshots),
            part("published", |memory| memory.published),
        ];
        let is_used = |map: &MapBytes| map.bytes.iter().any(|&bytes| bytes > 0);
        Self {
            times: samples.iter().map(|(time, _)| (time * 1e3).round() / 1e3).collect(),
            maps: maps.into_iter().filter(is_used).collect(),
        }
    }
}
