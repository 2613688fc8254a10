use std::time::{Duration, Instant};

/// A named step of [`MapBuilder::insert`](crate::MapBuilder::insert).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// Multi-object tracking of the detected boxes.
    Tracking,
    /// Foreground clustering in each box.
    Foreground,
    /// Missed-detection compensation.
    Compensation,
    /// Box correction.
    Correction,
    /// The static mask.
    Mask,
    /// The dense cloud and the evidence for late ghost removal.
    Cloud,
    /// The occupancy octree.
    Octree,
    /// Planes found in the depth image.
    PlaneExtraction,
    /// Planes fitted again, robustly, and filtered.
    PlaneRefinement,
    /// Planes associated, fused and merged in their map.
    PlaneMap,
    /// Boxes in space from the detections of objects.
    ObjectParameterization,
    /// Which detection is which object.
    ObjectAssociation,
    /// Objects take their observations in.
    ObjectUpdate,
    /// Duplicates merged, ghosts removed.
    ObjectOptimization,
}

/// Number of steps; private, so that more steps break nobody.
const STAGES: usize = 14;

impl Stage {
    /// All steps, in the order in which they run.
    pub const ALL: &[Self] = &[
        Self::Tracking,
        Self::Foreground,
        Self::Compensation,
        Self::Correction,
        Self::Mask,
        Self::Cloud,
        Self::Octree,
        Self::PlaneExtraction,
        Self::PlaneRefinement,
        Self::PlaneMap,
        Self::ObjectParameterization,
        Self::ObjectAssociation,
        Self::ObjectUpdate,
        Self::ObjectOptimization,
    ];

    /// Name in reports, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Foreground => "foreground",
            Self::Compensation => "compensation",
            Self::Correction => "correction",
            Self::Mask => "mask",
            Self::Cloud => "cloud",
            Self::Octree => "octree",
            Self::PlaneExtraction => "plane_extraction",
            Self::PlaneRefinement => "plane_refinement",
            Self::PlaneMap => "plane_map",
            Self::ObjectParameterization => "object_parameterization",
            Self::ObjectAssociation => "object_association",
            Self::ObjectUpdate => "object_update",
            Self::ObjectOptimization => "object_optimization",
        }
    }
}

/// How long each step of one insertion took. The only clock of the library: no map depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StageTimes {
    times: [Duration; STAGES],
    total: Duration,
}

impl StageTimes {
    /// The time of one step; zero when it did not run.
    pub fn of(&self, stage: Stage) -> Duration {
        self.times[stage as usize]
    }

    /// The time of the whole insertion, from the tracking on.
    pub fn total(&self) -> Duration {
        self.total
    }
}

/// Times steps one after the other.
#[derive(Debug)]
pub(crate) struct StageClock {
    start: Instant,
    lap: Instant,
    times: StageTimes,
}

impl StageClock {
    pub(crate) fn start() -> Self {
        let start = Instant::now();
        Self { start, lap: start, times: StageTimes::default() }
    }

    /// Ends a step.
    pub(crate) fn end(&mut self, stage: Stage) {
        let now = Instant::now();
        self.times.times[stage as usize] = now - self.lap;
        self.lap = now;
    }

    pub(crate) fn finish(mut self) -> StageTimes {
        self.times.total = self.start.elapsed();
        self.times
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_stand_at_their_place() {
        assert_eq!(Stage::ALL.len(), STAGES);
        for (place, &stage) in Stage::ALL.iter().enumerate() {
            assert_eq!(stage as usize, place);
        }
    }

    #[test]
    fn steps_add_up_to_no_more_than_the_whole() {
        let mut clock = StageClock::start();
        clock.end(Stage::Mask);
        clock.end(Stage::Octree);
        let times = clock.finish();
        let sum: Duration = Stage::ALL.iter().map(|&stage| times.of(stage)).sum();
        assert!(sum <= times.total());
        assert_eq!(times.of(Stage::Cloud), Duration::ZERO);
    }
}
