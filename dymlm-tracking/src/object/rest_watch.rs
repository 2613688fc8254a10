use dymlm_core::Pose;

use super::state::RestReport;

/// Notices when the object comes to rest.
#[derive(Debug, Clone)]
pub(super) struct RestWatch {
    /// The pose that the object has stayed near since `since`.
    anchor: Pose,
    since: f64,
    /// The pose of the last rest.
    place: Pose,
    is_resting: bool,
}

/// An object at rest has moved when it exceeds the limits this many times: poses of real cameras jitter.
const LEAVING: f64 = 3.0;

/// When an object counts as standing still.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestLimits {
    pub(super) time: f64,
    pub(super) distance: f64,
    pub(super) angle: f64,
}

impl RestLimits {
    fn holds(&self, a: &Pose, b: &Pose, factor: f64) -> bool {
        a.distance(b) <= factor * self.distance && a.angle(b) <= factor * self.angle
    }
}

impl RestWatch {
    /// An object at rest at `place`.
    pub(super) fn new(place: Pose, time: f64) -> Self {
        Self { anchor: place, since: time, place, is_resting: true }
    }

    pub(super) fn is_resting(&self) -> bool {
        self.is_resting
    }

    /// Converts the poses after the world frame was moved.
    pub(super) fn move_world(&mut self, new_from_old: &Pose) {
        (self.anchor, self.place) = (*new_from_old * self.anchor, *new_from_old * self.place);
    }

    /// Takes the pose of a frame; reports a new place of rest once.
    pub(super) fn observe(&mut self, pose: &Pose, time: f64, limits: RestLimits) -> Option<RestReport> {
        if !limits.holds(&self.anchor, pose, if self.is_resting { LEAVING } else { 1.0 }) {
            (self.anchor, self.since, self.is_resting) = (*pose, time, false);
            return None;
        }
        if self.is_resting || time - self.since < limits.time {
            return None;
        }
        self.is_resting = true;
        let moved_from = self.place;
        if limits.holds(&moved_from, pose, LEAVING) {
            return None;
        }
        self.place = *pose;
        Some(RestReport { world_from_object: *pose, moved_from, since: self.since })
    }

    /// Without a pose it is unknown whether the object stands still.
    pub(super) fn unseen(&mut self, time: f64) {
        (self.since, self.is_resting) = (time, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        Pose::new([x, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
    }

    const LIMITS: RestLimits = RestLimits { time: 1.0, distance: 0.01, angle: 0.05 };

    #[test]
    fn tells_once_of_a_new_place() {
        let mut watch = RestWatch::new(at(0.0), 0.0);
        let mut reports = Vec::new();
        for i in 0..60 {
            let time = 0.1 * f64::from(i);
            let x = (time - 1.0).clamp(0.0, 2.0) * 0.3;
            reports.extend(watch.observe(&at(x + 0.002 * f64::from(i % 2)), time, LIMITS));
        }
        assert_eq!(reports.len(), 1);
        assert!((reports[0].since - 3.0).abs() < 0.15, "{}", reports[0].since);
        assert!((reports[0].world_from_object.translation()[0] - 0.6).abs() < 0.01);
        assert_eq!(reports[0].moved_from, at(0.0));
    }

    #[test]
    fn wavering_is_no_motion() {
        let mut watch = RestWatch::new(at(0.0), 0.0);
        for i in 0..60 {
            let x = 0.025 * f64::from(i * i % 7) / 6.0;
            assert_eq!(watch.observe(&at(x), 0.1 * f64::from(i), LIMITS), None);
            assert!(watch.is_resting());
        }
        watch.observe(&at(0.04), 6.0, LIMITS);
        assert!(!watch.is_resting());
    }

    #[test]
    fn lifted_and_put_back_is_no_new_place() {
        let mut watch = RestWatch::new(at(0.0), 0.0);
        for i in 0..60 {
            let time = 0.1 * f64::from(i);
            let x = if (10..20).contains(&i) { 0.2 } else { 0.0 };
            assert_eq!(watch.observe(&at(x), time, LIMITS), None);
        }
        assert!(watch.is_resting());
    }
}
