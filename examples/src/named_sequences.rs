use std::ops::Range;

use dymlm_sim::{Room, SequenceConfig, SequenceType};

/// A synthetic sequence with a name.
#[derive(Debug, Clone)]
pub struct NamedSequence {
    /// Such as `walking_xyz`, `two_tables`, `random_room_N`.
    pub name: String,
    /// The config of the sequence.
    pub config: SequenceConfig,
    /// The set that it belongs to.
    pub set: SequenceSet,
}

/// Sets of sequences that figures are averaged over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SequenceSet {
    /// The eight types of the paper's table.
    Eight,
    /// The second room.
    SecondRoom,
    /// Rooms made from seeds.
    RandomRooms,
    /// One room as several depth cameras see it.
    Sensors,
    /// People and things that move and are never detected.
    Undetected,
    /// Rooms, people and paths drawn from a seed of the command line, with sitting people.
    FreshSitting,
    /// The same with walking people.
    FreshWalking,
    /// Floors of buildings.
    Building,
}

/// Frames of a random room: one round of the camera's path.
const RANDOM_ROOM_FRAMES: usize = 80;

/// The eight sequences, the second room, and the random rooms of these seeds.
pub fn named_sequences(random_rooms: Range<u64>) -> Vec<NamedSequence> {
    let eight = SequenceType::ALL.iter().map(|kind| NamedSequence {
        name: kind.name().to_owned(),
        config: kind.config(),
        set: SequenceSet::Eight,
    });
    let mut config = SequenceConfig::default();
    config.room = Room::TwoTables;
    let second = NamedSequence { name: "two_tables".to_owned(), config, set: SequenceSet::SecondRoom };
    let random = random_rooms.map(|seed| {
        let mut config = SequenceConfig::random_room(seed);
        config.frames = RANDOM_ROOM_FRAMES;
        NamedSequence { name: format!("random_room_{seed}"), config, set: SequenceSet::RandomRooms }
    });
    eight.chain([second]).chain(random).collect()
}

/// The sequence with a name; the error lists all names.
///
/// # Errors
///
/// When there is no sequence with that name.
pub fn named_sequence(name: &str) -> Result<NamedSequence, String> {
    let seed: Option<u64> = name.strip_prefix("random_room_").and_then(|seed| seed.parse().ok());
    let all = named_sequences(seed.map_or(0..0, |seed| seed..seed.saturating_add(1)));
    let names = || all.iter().map(|sequence| sequence.name.as_str()).collect::<Vec<_>>().join(", ");
    let unknown = format!("no sequence {name:?}; there are: {}, random_room_0, random_room_1, ...", names());
    all.into_iter().find(|sequence| sequence.name == name).ok_or(unknown)
}
