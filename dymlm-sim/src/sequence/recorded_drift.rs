use dymlm_core::Pose;

/// The drift of a real odometry as a function of the distance travelled, to be applied to other paths.
///
/// Between two poses of the recorded path, the odometry's motion differs from the true one by a small motion
/// in the sensor's frame, the departure. On another path the same departures happen at the same distances
/// travelled, one after the other: estimate <- estimate * step * departure. A sensor at rest does not drift.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_sim::RecordedDrift;
///
/// let at = |x: f64| Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
/// // An odometry that measures distances 2 % too long.
/// let drift = RecordedDrift::new(&[at(0.0)?, at(5.0)?, at(10.0)?], &[at(0.0)?, at(5.1)?, at(10.2)?]);
/// let drift = drift.ok_or("no path")?;
/// let estimated = drift.on_path(&[at(1.0)?, at(3.0)?, at(3.0)?, at(2.0)?]);
/// let places: Vec<f64> = estimated.iter().map(|pose| pose.translation()[0]).collect();
/// for (place, expected) in places.into_iter().zip([1.0, 3.04, 3.04, 2.06]) {
///     assert!((place - expected).abs() < 1e-9);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct RecordedDrift {
    /// Accumulated drift along the recorded path.
    records: Vec<Record>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    /// Distance travelled, metres.
    way: f64,
    /// The product of the departures of all steps so far.
    departure: Pose,
}

/// How often the whole recorded path has been travelled, and the product of the departures of that.
struct Rounds {
    count: f64,
    departure: Pose,
}

/// Length that a recorded path exceeds, metres.
const LEAST_LENGTH: f64 = 0.01;

impl RecordedDrift {
    /// Takes the drift from the true poses of a path and the odometry's at the same times (both world from
    /// sensor). `None` when their numbers differ, or the path is not longer than a centimetre: that is a
    /// sensor at rest, and a path of metres would be thousands of such.
    pub fn new(exact: &[Pose], estimated: &[Pose]) -> Option<Self> {
        if exact.len() != estimated.len() {
            return None;
        }
        let mut records = vec![Record { way: 0.0, departure: Pose::identity() }];
        let mut last = records[0];
        for (exact, estimated) in exact.windows(2).zip(estimated.windows(2)) {
            let [step, measured] = [exact, estimated].map(|pair| pair[0].inverse() * pair[1]);
            last.way += exact[0].distance(&exact[1]);
            last.departure = last.departure * (step.inverse() * measured);
            records.push(last);
        }
        (last.way > LEAST_LENGTH).then_some(Self { records })
    }

    /// Length of the recorded path, metres.
    pub fn length(&self) -> f64 {
        self.records.last().map_or(0.0, |last| last.way)
    }

    /// The odometry's estimates on a path, beginning with the path's first pose. On a path longer than the
    /// recorded one, the recorded drift repeats.
    pub fn on_path(&self, exact: &[Pose]) -> Vec<Pose> {
        let mut estimated: Vec<Pose> = exact.first().copied().into_iter().collect();
        let (mut way, mut before) = (0.0, Pose::identity());
        let mut rounds = Rounds { count: 0.0, departure: Pose::identity() };
        for pair in exact.windows(2) {
            let step = pair[0].inverse() * pair[1];
            way += pair[0].distance(&pair[1]);
            let departure = self.departure(way, &mut rounds);
            let last = estimated.last().copied().unwrap_or_default();
            estimated.push(last * step * (before.inverse() * departure));
            before = departure;
        }
        estimated
    }

    /// The product of the departures up to a distance travelled; `rounds`: those of a shorter distance.
    fn departure(&self, way: f64, rounds: &mut Rounds) -> Pose {
        let length = self.length();
        let whole = self.records.last().map_or(Pose::identity(), |last| last.departure);
        let count = (way / length).floor();
        while rounds.count < count {
            rounds.count += 1.0;
            rounds.departure = rounds.departure * whole;
        }
        let departure = rounds.departure;
        let rest = way - count * length;
        let after = self.records.partition_point(|record| record.way <= rest);
        let Some(from) = self.records.get(after.saturating_sub(1)) else { return departure };
        let Some(to) = self.records.get(after) else { return departure * from.departure };
        let share = (rest - from.way) / (to.way - from.way);
        departure * from.departure.interpolate(&to.departure, share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(x: f64, angle: f64) -> Pose {
        Pose::new([x, 0.2 * x, 0.0], [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()]).unwrap()
    }

    #[test]
    fn on_its_own_path_it_is_the_recorded_odometry() {
        let path = |scale: f64| (0..50).map(move |i| turned(0.1 * f64::from(i), scale * f64::from(i)));
        let (exact, estimated): (Vec<Pose>, Vec<Pose>) = (path(0.05).collect(), path(0.052).collect());
        let drift = RecordedDrift::new(&exact, &estimated).unwrap();
        for (again, estimated) in drift.on_path(&exact).iter().zip(&estimated) {
            let [apart, turned] = [again.distance(estimated), again.angle(estimated)];
            assert!(apart < 1e-6 && turned < 1e-6, "{apart} m, {turned} rad");
        }
    }

    #[test]
    fn a_longer_path_drifts_on() {
        let exact: Vec<Pose> = (0..11).map(|i| turned(f64::from(i), 0.0)).collect();
        let estimated: Vec<Pose> = (0..11).map(|i| turned(1.01 * f64::from(i), 0.0)).collect();
        let drift = RecordedDrift::new(&exact, &estimated).unwrap();
        let long: Vec<Pose> = (0..=250).map(|i| turned(0.1 * f64::from(i), 0.0)).collect();
        let last = drift.on_path(&long)[250];
        assert!((last.translation()[0] - 1.01 * 25.0).abs() < 1e-9, "{last:?}");
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let [here, there] = [turned(0.0, 0.0), turned(1.0, 0.0)];
        assert!(RecordedDrift::new(&[here, there], &[here]).is_none());
        assert!(RecordedDrift::new(&[here, here], &[here, there]).is_none());
        assert!(RecordedDrift::new(&[], &[]).is_none());
        // A sensor at rest, with rounding: a path of 10 m would be 10^10 times as long.
        let nearby = turned(1e-9, 0.0);
        assert!(RecordedDrift::new(&[here, nearby], &[here, nearby]).is_none());
        assert!(RecordedDrift::new(&[here, there], &[here, there]).unwrap().on_path(&[]).is_empty());
    }
}
