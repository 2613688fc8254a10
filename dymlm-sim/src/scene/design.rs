use super::{Cast, Room, Scene};
use crate::SequenceConfig;

impl Scene {
    /// The room of a sequence with its people. The seed decides where they start; it decides everything in a
    /// random room.
    pub(crate) fn new(config: &SequenceConfig) -> Self {
        let cast = Cast::new(config);
        if let Some(plan) = &config.plan {
            return Self::planned(config, plan);
        }
        match config.room {
            Room::Office => Self::office(&cast),
            Room::TwoTables => Self::two_tables(&cast),
            Room::Random => Self::random_room(&cast, config.seed),
            Room::Building { rooms } => Self::building(config, rooms),
        }
    }
}
