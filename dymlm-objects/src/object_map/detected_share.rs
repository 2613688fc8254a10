use dymlm_core::vector3::{Vector3, difference, norm, unit};

use super::view_weight::{ENOUGH, is_same_direction};

/// In how many of the frames that had an object in view it was detected, look by look.
///
/// A look is what the camera sees from one side and distance: what a detector finds or misses there once it
/// finds or misses in the next frame too. So the frames of a look beyond the first [`ENOUGH`] say how often the
/// object was detected in it, but do not make the look count more. Otherwise a robot at rest, from where the
/// detector does not find a chair, would outvote in half a minute all that it has seen on its way around it.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct DetectedShare {
    /// Of the looks before.
    earlier: Tally,
    /// Of the look that goes on.
    current: Tally,
    /// Direction and distance, metres, from the object to the camera when that look began.
    direction: Option<Vector3>,
    distance: f64,
}

/// Frames that had the object in view, and those in which it was detected.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Tally {
    in_view: f64,
    detected: f64,
}

/// Factor of the distance from which on looks differ: at half the distance a thing has four times the pixels.
/// A higher value takes an approach through a room for one look, a lower one the sway of whoever holds the camera
/// for several (`a_camera_at_rest_outvotes_no_way_around_the_object`).
const DISTANCE_FACTOR: f64 = 1.5;

impl DetectedShare {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        let is_tally = |tally: &Tally| tally.in_view >= 0.0 && tally.in_view < 1e15 && tally.detected >= 0.0;
        let is_unit = self.direction.iter().flatten().all(|c| c.abs() <= 1.01);
        is_tally(&self.earlier) && is_tally(&self.current) && is_unit && self.distance.is_finite()
    }

    /// Counts a frame that had the object in view.
    pub(crate) fn count(&mut self, object: Vector3, camera: Vector3, is_detected: bool) {
        let from_object = difference(camera, object);
        let (direction, distance) = (unit(from_object), norm(from_object));
        let is_near =
            distance < DISTANCE_FACTOR * self.distance && self.distance < DISTANCE_FACTOR * distance;
        if !(is_near && is_same_direction(self.direction, direction)) {
            self.earlier = self.total();
            (self.current, self.direction, self.distance) = (Tally::default(), direction, distance);
        }
        self.current.in_view += 1.0;
        self.current.detected += f64::from(is_detected);
    }

    /// The share, 0 before any frame.
    pub(crate) fn share(&self) -> f64 {
        let Tally { in_view, detected } = self.total();
        if in_view > 0.0 { detected / in_view } else { 0.0 }
    }

    /// Adds what was counted of a duplicate: it was in view in the same frames, and whenever one of both was
    /// detected, this was the object.
    pub(crate) fn merge(&mut self, other: &Self) {
        let (own, theirs) = (self.total(), other.total());
        let detected = own.detected + theirs.detected;
        let in_view = own.in_view.max(theirs.in_view).max(detected);
        *self = Self { earlier: Tally { in_view, detected }, ..Self::default() };
    }

    fn total(&self) -> Tally {
        let Tally { in_view, detected } = self.current;
        let counted = f64::from(ENOUGH).min(in_view) / in_view.max(1.0);
        Tally {
            in_view: self.earlier.in_view + counted * in_view,
            detected: self.earlier.detected + counted * detected,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Camera places on a circle of two metres around the object, three degrees apart.
    fn around(step: u32) -> Vector3 {
        let angle = 3_f64.to_radians() * f64::from(step);
        [2.0 * angle.cos(), 2.0 * angle.sin(), 0.0]
    }

    #[test]
    fn a_camera_at_rest_outvotes_no_way_around_the_object() {
        let mut share = DetectedShare::default();
        (0..80).for_each(|step| share.count([0.0; 3], around(step), step % 4 > 0));
        assert!((share.share() - 0.75).abs() < 1e-9, "each frame of a way counts: {}", share.share());
        let docked = [4.0, 0.1, 0.0];
        (0..144_000).for_each(|_| share.count([0.0; 3], docked, false));
        assert!(share.share() > 0.5, "{}", share.share());
        // What it was detected in while the camera stood counts as little.
        let mut seen = DetectedShare::default();
        (0..144_000).for_each(|_| seen.count([0.0; 3], docked, true));
        (0..80).for_each(|step| seen.count([0.0; 3], around(step), false));
        assert!(seen.share() < 0.25, "{}", seen.share());
        // Within a look, the share is that of all of its frames.
        let mut half = DetectedShare::default();
        (0..1000).for_each(|step| half.count([0.0; 3], docked, step >= 500));
        assert!((half.share() - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_camera_that_comes_nearer_looks_anew() {
        let mut share = DetectedShare::default();
        (0..100).for_each(|_| share.count([0.0; 3], [8.0, 0.0, 0.0], false));
        (0..20).for_each(|_| share.count([0.0; 3], [2.0, 0.0, 0.0], true));
        assert!((share.share() - 0.5).abs() < 1e-9, "{}", share.share());
    }

    #[test]
    fn duplicates_were_one_object_in_the_same_frames() {
        let [mut often, mut seldom] = [DetectedShare::default(), DetectedShare::default()];
        for step in 0..20 {
            often.count([0.0; 3], around(step), step % 2 == 0);
            seldom.count([0.0; 3], around(step), step % 4 == 1);
        }
        often.merge(&seldom);
        assert!((often.share() - 0.75).abs() < 1e-9, "{}", often.share());
        assert!(DetectedShare::default().share().abs() < 1e-9);
    }
}
