use std::time::{Duration, Instant};

/// A named step of [`MapBuilder::insert`](crate::MapBuilder::insert).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// Preprocessing: movers tracked, missed ones predicted, boxes corrected, the static mask.
    Dynamics,
    /// The dense cloud and the evidence of what is static.
    Cloud,
    /// The occupancy octree.
    Octree,
    /// Planes found in the depth image, fitted robustly and filtered.
    PlaneDetection,
    /// The key frame's observation is copied for the history.
    History,
    /// Planes associated, fused and merged in their map.
    PlaneMap,
    /// Objects fitted, associated, updated, merged and removed.
    Objects,
    /// Octree, planes and objects leave out what the evidence has found to be no part of the static world.
    GhostRemoval,
    /// The maps are shared with readers, when the interval has passed.
    Publishing,
}

/// Number of steps; private, so that a further step breaks no caller.
const STAGES: usize = 9;

impl Stage {
    /// All steps.
    pub const ALL: &[Self] = &[
        Self::Dynamics,
        Self::Cloud,
        Self::Octree,
        Self::PlaneDetection,
        Self::History,
        Self::PlaneMap,
        Self::Objects,
        Self::GhostRemoval,
        Self::Publishing,
    ];

    /// Name in reports, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dynamics => "dynamics",
            Self::Cloud => "cloud",
            Self::Octree => "octree",
            Self::PlaneDetection => "plane_detection",
            Self::History => "history",
            Self::PlaneMap => "plane_map",
            Self::Objects => "objects",
            Self::GhostRemoval => "ghost_removal",
            Self::Publishing => "publishing",
        }
    }
}

/// How long each step of one insertion took, by the system's clock: no map depends on it. With the feature
/// `parallel` cloud and octree are built beside planes and objects, so the steps may add up to more than the
/// whole.
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

/// Runs a step; returns its result and how long it took.
pub(crate) fn timed<T>(step: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let result = step();
    (result, start.elapsed())
}

/// Times the steps of one insertion.
#[derive(Debug)]
pub(crate) struct StageClock {
    start: Instant,
    times: StageTimes,
}

impl StageClock {
    pub(crate) fn start() -> Self {
        Self { start: Instant::now(), times: StageTimes::default() }
    }

    /// Runs one step and notes how long it took.
    pub(crate) fn time<T>(&mut self, stage: Stage, step: impl FnOnce() -> T) -> T {
        self.note(stage, timed(step))
    }

    /// Notes how long a [timed] step took; returns its result.
    pub(crate) fn note<T>(&mut self, stage: Stage, (result, taken): (T, Duration)) -> T {
        self.times.times[stage as usize] = taken;
        result
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
        clock.time(Stage::Dynamics, || std::hint::black_box(1));
        clock.time(Stage::Octree, || std::hint::black_box(2));
        let times = clock.finish();
        let sum: Duration = Stage::ALL.iter().map(|&stage| times.of(stage)).sum();
        assert!(sum <= times.total());
        assert_eq!(times.of(Stage::Cloud), Duration::ZERO);
    }
}
