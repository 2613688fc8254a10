use dymlm_core::{FrameId, Pose};

/// Key frames of a look after which it has its full say. A lower value lets a few frames without a plane outvote
/// the look in which it was found, a higher one lets a robot at rest outvote its way through the room
/// (`a_camera_at_rest_doubts_no_plane_for_longer_than_it_looks_elsewhere`).
const ENOUGH: u64 = 20;
/// The say of a key frame that counts fully.
const UNIT: u64 = 1024;
/// Where another look begins, metres and radians from where the last one began: at 1 m from a plane both change
/// the angle under which it is seen by 15 degrees, about as much as decides whether it is found.
const LOOK_TRANSLATION: f64 = 0.25;
const LOOK_ROTATION: f64 = 0.26;

/// Where the camera was when the look that goes on began.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Look {
    /// Its first key frame.
    pub(super) first: FrameId,
    world_from_camera: Pose,
}

/// In how many of the key frames that looked at a plane it was seen, look by look.
///
/// A look is what the camera sees from about one pose: what is found or missed there once is found or missed
/// there again. So the key frames of a look beyond the first [`ENOUGH`] say how often the plane is seen from
/// there, but do not make the look count more. Otherwise a robot at rest, from where a table is seen too
/// flatly to be found, would outvote in two minutes all that it has seen of it on its way; and in an hour, by
/// the error of one pose, where it has seen the table from everywhere else ([`Self::next_weight`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Looks {
    /// Of the looks before the last, in [units](UNIT).
    earlier: Tally,
    /// Of the last look, in key frames.
    last: Tally,
    /// The first key frame of that look, whether or not it looked at the plane.
    first: FrameId,
}

/// Key frames that looked at a plane, and those that saw it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Tally {
    looked: u64,
    saw: u64,
}

impl Look {
    pub(super) fn begun_by(first: FrameId, world_from_camera: &Pose) -> Self {
        Self { first, world_from_camera: *world_from_camera }
    }

    /// Whether a key frame at a pose belongs to it.
    pub(super) fn includes(&self, world_from_camera: &Pose) -> bool {
        self.world_from_camera.distance(world_from_camera) < LOOK_TRANSLATION
            && self.world_from_camera.angle(world_from_camera) < LOOK_ROTATION
    }
}

impl Default for Looks {
    fn default() -> Self {
        Self { earlier: Tally::default(), last: Tally::default(), first: FrameId::new(u64::MAX) }
    }
}

impl Looks {
    /// Whether the numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        let is_tally = |tally: &Tally| tally.saw <= tally.looked && tally.looked < 1 << 48;
        is_tally(&self.earlier) && is_tally(&self.last)
    }

    /// Counts a key frame that looked at the plane, of the look that began with `look`. Those of one look follow
    /// each other.
    pub(super) fn count(&mut self, look: FrameId, saw: bool) {
        if look != self.first {
            *self = Self { earlier: self.total(), last: Tally::default(), first: look };
        }
        self.last.looked += 1;
        self.last.saw += u64::from(saw);
    }

    /// Whether the last look at the plane is the one that began with `look`.
    pub(super) fn has(&self, look: FrameId) -> bool {
        self.first == look
    }

    /// How much the readings of the next key frame of a look that sees the plane count in its fit. The errors
    /// of the pose and of the sensor are about the same in all of a look, so they count fully while the look
    /// gains by them, and then less and less: a look never has the weight of more than twice [`ENOUGH`] key
    /// frames, but it is never deaf to what it sees.
    pub(super) fn next_weight(&self, look: FrameId) -> f32 {
        let seen = if look == self.first { self.last.saw } else { 0 };
        let share = ENOUGH as f32 / (seen + 1) as f32;
        share.min(1.0).powi(2)
    }

    /// The share of the looks that saw the plane; 1 before any.
    pub(super) fn share(&self) -> f64 {
        self.total().share()
    }

    /// The share if another whole look saw the plane.
    pub(super) fn share_after_a_look(&self) -> f64 {
        let Tally { looked, saw } = self.total();
        Tally { looked: looked + ENOUGH * UNIT, saw: saw + ENOUGH * UNIT }.share()
    }

    /// The looks of two planes that become one. Of these, `since` are what the looks at the two together have
    /// been since one that the older plane has had before the younger one was there, and `older` those at the
    /// older plane alone: all, and its since then, which may be a part of a long look.
    pub(super) fn united([all, later]: [Self; 2], since: Self) -> Self {
        let is_in_last_look = later.first == all.first && later.earlier == Tally::default();
        // A part of a look may say more, or less, than the whole of it.
        let before = if is_in_last_look { all.earlier } else { all.total().saturating_sub(later.total()) };
        Self { earlier: before.plus(since.earlier), ..since }
    }

    fn total(&self) -> Tally {
        let Tally { looked, saw } = self.last;
        // Divided last and rounded down, so that the sums do not depend on what else is summed.
        let enough = looked.min(ENOUGH) * UNIT;
        let saw = (enough * saw).checked_div(looked).unwrap_or(0);
        self.earlier.plus(Tally { looked: enough, saw })
    }
}

impl Tally {
    fn plus(self, other: Self) -> Self {
        Self { looked: self.looked + other.looked, saw: self.saw + other.saw }
    }

    /// What is left without the other, of which none was seen more often than it was looked at.
    fn saturating_sub(self, other: Self) -> Self {
        let looked = self.looked.saturating_sub(other.looked);
        Self { looked, saw: self.saw.saturating_sub(other.saw).min(looked) }
    }

    fn share(&self) -> f64 {
        if self.looked == 0 { 1.0 } else { self.saw as f64 / self.looked as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks(tallies: &[(u64, u64)]) -> Looks {
        looks_from(0, tallies)
    }

    fn looks_from(first: u64, tallies: &[(u64, u64)]) -> Looks {
        let mut looks = Looks::default();
        for (&(looked, saw), look) in tallies.iter().zip(first..) {
            (0..looked).for_each(|frame| looks.count(FrameId::new(look), frame < saw));
        }
        looks
    }

    #[test]
    fn the_key_frames_of_one_look_say_what_twenty_say() {
        assert_eq!(looks(&[(18_000, 4500)]).share(), 0.25);
        assert_eq!(looks(&[(20, 20), (18_000, 0)]).share(), 0.5);
        assert_eq!(looks(&[(5, 5), (18_000, 0)]).share(), 0.2);
        assert_eq!(looks(&[(18_000, 18_000), (20, 0), (20, 0), (20, 0)]).share(), 0.25);
        assert_eq!(looks(&[]).share(), 1.0);
        assert_eq!(looks(&[(5, 5), (18_000, 0)]).share_after_a_look(), 25.0 / 45.0);
    }

    #[test]
    fn a_look_weighs_as_much_as_forty_key_frames_at_most() {
        let (mut at_rest, mut weight) = (Looks::default(), 0.0);
        for frame in 0..200_000 {
            let next = at_rest.next_weight(FrameId::new(0));
            assert!(next > 0.0 && (frame >= 20 || next == 1.0));
            weight += f64::from(next);
            at_rest.count(FrameId::new(0), true);
        }
        assert!((38.0..40.0).contains(&weight), "{weight}");
        assert_eq!(at_rest.next_weight(FrameId::new(7)), 1.0, "from elsewhere");
        assert_eq!(looks(&[(18_000, 19)]).next_weight(FrameId::new(0)), 1.0, "seldom seen");
    }

    #[test]
    fn looks_of_merged_planes_are_those_at_both() {
        let (older, since) = (looks(&[(7, 7), (30, 10), (4, 0)]), looks(&[(0, 0), (30, 30), (9, 0)]));
        let later = looks(&[(0, 0), (30, 10), (4, 0)]);
        assert_eq!(Looks::united([older, later], since), looks(&[(7, 7), (30, 30), (9, 0)]));
    }

    #[test]
    fn the_last_part_of_a_long_look_stands_for_all_of_it() {
        // Of the last look, which has seen the older plane less and less, or of one before that.
        let (older, later, since) =
            (looks(&[(7, 7), (400, 300)]), looks_from(1, &[(200, 100)]), looks_from(1, &[(200, 150)]));
        assert_eq!(Looks::united([older, later], since), looks(&[(7, 7), (200, 150)]));
        let [older, later, since] = [(400, 300), (200, 100), (200, 150)].map(|long| looks(&[long, (30, 30)]));
        let united = Looks::united([older, later], since);
        assert_eq!(united.total(), since.total());
    }
}
