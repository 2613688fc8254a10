use dymlm_core::vector3::{Vector3, along, dot, unit};

/// Most normals that are told apart: more than there are directions as far from each other as the default
/// `max_support_slope`, some 700.
const MOST_NORMALS: usize = 1024;

/// The upward direction in the world: given, or learnt from the planes on which things rest.
///
/// Each observation that counts fully votes for the normal of the plane on which it rests, level or not.
/// Tables and floors share one normal; walls against which things lean have several. The vertical is known
/// once one normal has more votes than all others together. The camera's attitude plays no part.
#[derive(Debug, Clone)]
pub(crate) struct Vertical {
    given: Option<Vector3>,
    /// Normals between which the cosine is at least this share their votes.
    least_cosine: f64,
    votes: VerticalVotes,
}

/// The votes for each normal.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct VerticalVotes {
    normals: Vec<Normal>,
}

#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Normal {
    /// Sum of the normals that got these votes.
    sum: Vector3,
    votes: u64,
}

#[cfg(feature = "state")]
impl VerticalVotes {
    /// Whether the numbers are plausible; a damaged file may hold others.
    pub(crate) fn is_possible(&self) -> bool {
        let is_possible =
            |normal: &Normal| normal.sum.iter().all(|c| c.is_finite()) && normal.votes < 1 << 32;
        self.normals.len() < 1 << 16 && self.normals.iter().all(is_possible)
    }
}

#[cfg(feature = "state")]
impl Vertical {
    pub(crate) fn votes(&self) -> &VerticalVotes {
        &self.votes
    }

    pub(crate) fn restore(&mut self, votes: VerticalVotes) {
        self.votes = votes;
    }
}

impl Vertical {
    pub(crate) fn new(given: Option<Vector3>, least_cosine: f64) -> Self {
        Self { given: given.and_then(unit), least_cosine, votes: VerticalVotes::default() }
    }

    /// Counts a vote.
    pub(crate) fn vote(&mut self, normal: Vector3) {
        let place = self.place_of(normal);
        let normals = &mut self.votes.normals;
        if let Some(own) = place.map(|place| &mut normals[place]) {
            *own = Normal { sum: along(own.sum, 1.0, normal), votes: own.votes + 1 };
        } else if normals.len() < MOST_NORMALS {
            normals.push(Normal { sum: normal, votes: 1 });
        } else if let Some(fewest) = normals.iter_mut().min_by_key(|own| own.votes) {
            // The normal with the fewest votes, the oldest of those, makes room and leaves its votes to the
            // new one, so that their sum stays that of all votes, and what most have voted for is found
            // (Space-Saving; Metwally, Agrawal, El Abbadi 2005).
            *fewest = Normal { sum: normal, votes: fewest.votes + 1 };
        }
    }

    /// Takes a vote back.
    pub(crate) fn withdraw(&mut self, normal: Vector3) {
        if let Some(place) = self.place_of(normal) {
            let normals = &mut self.votes.normals;
            let own = &mut normals[place];
            *own = Normal { sum: along(own.sum, -1.0, normal), votes: own.votes.saturating_sub(1) };
            if own.votes == 0 {
                normals.remove(place);
            }
        }
    }

    /// Where the votes for a normal are counted.
    fn place_of(&self, normal: Vector3) -> Option<usize> {
        let is_same = |own: &Normal| unit(own.sum).is_some_and(|own| dot(own, normal) >= self.least_cosine);
        self.votes.normals.iter().position(is_same)
    }

    /// A unit vector that points up; `None` until it is known.
    pub(crate) fn direction(&self) -> Option<Vector3> {
        let normals = &self.votes.normals;
        let all: u64 = normals.iter().map(|normal| normal.votes).sum();
        let leader = normals.iter().find(|normal| 2 * normal.votes > all);
        self.given.or_else(|| unit(leader?.sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However fine the votes are told apart, they are bounded, and the direction of most of them is found.
    #[test]
    fn votes_for_ever_new_normals_are_bounded() {
        let mut vertical = Vertical::new(None, 1.0);
        for k in 0..20_000 {
            let angle = 1e-4 * f64::from(k);
            vertical.vote([angle.cos(), angle.sin(), 0.0]);
            assert_eq!(vertical.direction().is_some(), k == 0, "vote {k}");
        }
        assert!(vertical.votes.normals.len() <= 1024, "{}", vertical.votes.normals.len());
        for _ in 0..=20_000 {
            vertical.vote([0.0, 0.0, 1.0]);
        }
        assert_eq!(vertical.direction(), Some([0.0, 0.0, 1.0]));
    }

    #[test]
    fn what_most_things_rest_on_is_level() {
        let mut vertical = Vertical::new(None, 0.99);
        assert_eq!(vertical.direction(), None);
        vertical.vote([0.0, 1.0, 0.0]);
        vertical.vote([0.0, 0.0, 1.0]);
        assert_eq!(vertical.direction(), None, "a wall or a floor");
        for tilt in [-0.02, 0.02] {
            vertical.vote([tilt, 0.0, 1.0]);
        }
        vertical.vote([1.0, 0.0, 0.0]);
        vertical.withdraw([1.0, 0.0, 0.0]);
        assert_eq!(vertical.direction(), Some([0.0, 0.0, 1.0]));
        assert_eq!(Vertical::new(Some([2.0, 0.0, 0.0]), 0.99).direction(), Some([1.0, 0.0, 0.0]));
    }
}
