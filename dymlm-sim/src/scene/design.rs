use rand::RngExt;

use super::{Activity, Room, Scene};
use crate::noise::{Use, stream};

impl Scene {
    /// A room with up to two people; the seed decides where they start, or all of a random room.
    pub(crate) fn new(room: Room, activity: Activity, people: usize, seed: u64) -> Self {
        let mut rng = stream(seed, Use::Scene, 0, 0);
        let choice = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(0.0..1.0)));
        match (room, activity) {
            (Room::Office, Activity::Walking) => Self::office(people, choice),
            (Room::Office, Activity::Sitting) => Self::seated_office(people, choice),
            (Room::TwoTables, _) => Self::two_tables(activity, people, choice),
            (Room::Random, _) => Self::random_room(activity, people, seed),
        }
    }
}
