use dymlm_core::vector3::{Vector3, difference, dot, unit};

use super::ObjectSighting;
use super::view_weight::VIEW_COSINE;

/// Seconds after which a side that is still in view is sighted anew, at first: outlines of one side err
/// alike, and the drift of poses in less time is below that error.
const FIRST_INTERVAL: f64 = 3.0;
/// Most sightings kept of a side. With fewer, poses between them are held by fewer objects; more are memory:
/// 8 of them are 1.2 kB.
const MOST_OF_A_SIDE: usize = 8;

/// A bounded selection of what was seen of an object: of each side a few sightings, spread evenly over the
/// time in which it was seen, each the one that says most of its interval.
///
/// Where a side is sighted too often, as by a robot at rest, every second sighting is dropped, and from then
/// on the side is sighted half as often. So memory does not grow with time but with the number of sides.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Sightings {
    sides: Vec<Side>,
}

/// The sightings from about one direction.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Side {
    /// Unit vector from the object to the camera at the first sighting, world.
    direction: Vector3,
    /// In the order of time.
    kept: Vec<ObjectSighting>,
    /// Time of the first sighting in the newest interval, seconds.
    begin: f64,
    /// Length of an interval, seconds.
    interval: f64,
}

impl Sightings {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.sides.iter().all(Side::is_possible)
    }

    /// Adds a sighting of an object whose centre is at `center`, if it says anything of where that is.
    /// Sightings come in the order of their time.
    pub(crate) fn add(&mut self, sighting: &ObjectSighting, center: Vector3) {
        if sighting.has_both_ends() == [false; 2] {
            return;
        }
        let toward_camera = difference(sighting.world_from_camera.translation(), center);
        let Some(direction) = unit(toward_camera) else { return };
        match self.side(direction) {
            Some(side) => side.add(sighting),
            None => self.sides.push(Side::new(direction, sighting)),
        }
    }

    /// Adds the sightings of a merged object.
    pub(crate) fn merge(&mut self, other: &Self) {
        for new in &other.sides {
            match self.side(new.direction) {
                Some(side) => side.merge(new),
                None => self.sides.push(new.clone()),
            }
        }
    }

    /// The side that shows to a camera in this direction, a unit vector of the world.
    fn side(&mut self, direction: Vector3) -> Option<&mut Side> {
        self.sides.iter_mut().find(|side| dot(side.direction, direction) >= VIEW_COSINE)
    }

    pub(crate) fn clear(&mut self) {
        self.sides.clear();
    }

    /// Those kept of each side, in the order of time.
    pub(crate) fn by_side(&self) -> impl Iterator<Item = &[ObjectSighting]> {
        self.sides.iter().map(|side| &side.kept[..])
    }

    /// Bytes that the sightings own.
    pub(crate) fn memory_bytes(&self) -> usize {
        let kept: usize = self.sides.iter().map(|side| side.kept.capacity()).sum();
        self.sides.capacity() * size_of::<Side>() + kept * size_of::<ObjectSighting>()
    }
}

impl Side {
    fn new(direction: Vector3, first: &ObjectSighting) -> Self {
        Self { direction, kept: vec![*first], begin: first.timestamp, interval: FIRST_INTERVAL }
    }

    #[cfg(feature = "state")]
    fn is_possible(&self) -> bool {
        self.kept.len() <= MOST_OF_A_SIDE
            && self.kept.iter().all(ObjectSighting::is_possible)
            && self.direction.iter().all(|c| c.abs() <= 1.01)
            && self.begin.is_finite()
            && self.interval >= FIRST_INTERVAL
    }

    fn add(&mut self, sighting: &ObjectSighting) {
        let is_of_newest_interval = sighting.timestamp - self.begin < self.interval;
        match self.kept.last_mut().filter(|_| is_of_newest_interval) {
            Some(newest) if sighting.says_more_than(newest) => *newest = *sighting,
            Some(_) => {}
            None => self.begin_interval(sighting),
        }
    }

    fn begin_interval(&mut self, sighting: &ObjectSighting) {
        if self.kept.len() == MOST_OF_A_SIDE {
            self.thin_out();
        }
        self.kept.push(*sighting);
        self.begin = sighting.timestamp;
    }

    /// Joins each two intervals that follow each other, and keeps the better sighting of both.
    fn thin_out(&mut self) {
        let pairs = self.kept.len().div_ceil(2);
        for pair in 0..pairs {
            let (one, other) = (self.kept[2 * pair], self.kept.get(2 * pair + 1));
            self.kept[pair] = *other.filter(|other| other.says_more_than(&one)).unwrap_or(&one);
        }
        self.kept.truncate(pairs);
        self.interval *= 2.0;
    }

    fn merge(&mut self, other: &Self) {
        self.kept.extend_from_slice(&other.kept);
        self.kept.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        self.begin = self.begin.max(other.begin);
        self.interval = self.interval.max(other.interval);
        while self.kept.len() > MOST_OF_A_SIDE {
            self.thin_out();
        }
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::Pose;

    use super::*;
    use crate::Completeness;

    /// A sighting of an object at the origin, from 2 m away at an angle.
    fn sighting(timestamp: f64, degrees: f64, nearest: f64) -> ObjectSighting {
        let (sin, cos) = degrees.to_radians().sin_cos();
        ObjectSighting {
            timestamp,
            world_from_camera: Pose::new([2.0 * cos, 2.0 * sin, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
            direction: [0.0, 0.0, 1.0],
            across: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            nearest,
            completeness: Completeness::default(),
        }
    }

    fn times(sightings: &Sightings) -> Vec<f64> {
        sightings.by_side().flatten().map(|sighting| sighting.timestamp).collect()
    }

    #[test]
    fn hours_at_rest_cost_what_a_minute_does() {
        let mut sightings = Sightings::default();
        let mut memory = 0;
        for step in 0..5 * 4 * 3600 {
            let time = 0.2 * f64::from(step);
            sightings.add(&sighting(time, 0.0, 1.8 + 0.1 * (7.0 * time).sin()), [0.0; 3]);
            if step == 5 * 60 {
                memory = sightings.memory_bytes();
            }
        }
        assert!(sightings.memory_bytes() <= memory && memory < 4096, "{}", sightings.memory_bytes());
        let times = times(&sightings);
        // Spread over the whole time.
        assert!(
            (4..=MOST_OF_A_SIDE).contains(&times.len())
                && times[0] < 3600.0
                && times[times.len() - 1] > 10000.0
        );
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn the_sighting_that_says_most_of_an_interval_is_kept() {
        let mut sightings = Sightings::default();
        let cut = Completeness { left: crate::SideView::Occluder, ..Completeness::default() };
        for (time, nearest, completeness) in [
            (0.0, 1.0, cut),
            (0.5, 2.0, Completeness::default()),
            (1.0, 1.9, Completeness::default()),
            (1.5, 1.0, cut),
        ] {
            sightings.add(&ObjectSighting { completeness, ..sighting(time, 0.0, nearest) }, [0.0; 3]);
        }
        assert_eq!(times(&sightings), [1.0]);
        // Between two cut ends there is no middle.
        let cut = Completeness { top: crate::SideView::Occluder, ..cut };
        sightings.add(&ObjectSighting { completeness: cut, ..sighting(9.0, 0.0, 0.5) }, [0.0; 3]);
        assert_eq!(times(&sightings), [1.0]);
        sightings.add(&sighting(9.5, 0.0, 2.5), [0.0; 3]);
        assert_eq!(times(&sightings), [1.0, 9.5]);
    }

    #[test]
    fn sides_are_kept_apart_and_merged_side_by_side() {
        let [mut one, mut other] = [Sightings::default(), Sightings::default()];
        for step in 0..40 {
            let time = 4.0 * f64::from(step);
            one.add(&sighting(time, 90.0, 1.8), [0.0; 3]);
            other.add(&sighting(time + 2.0, f64::from(step % 2) * 92.0, 1.8), [0.0; 3]);
        }
        one.merge(&other);
        assert_eq!(one.sides.len(), 2);
        for side in &one.sides {
            assert!(side.kept.len() > 3 && side.kept.len() <= MOST_OF_A_SIDE);
            assert!(side.kept.windows(2).all(|pair| pair[0].timestamp < pair[1].timestamp));
        }
        one.clear();
        assert!(one.by_side().next().is_none());
    }
}
