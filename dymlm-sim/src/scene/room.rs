/// The room that a sequence is taken in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Room {
    /// An office of 6.0 x 6.4 m: a desk before a partition with two monitors, keyboards, mice and small
    /// things, three swivel chairs, a cabinet, a shelf, a plant.
    #[default]
    Office,
    /// A room of 6.4 x 6.6 m with two tables of different heights that stand askew, a pillar, a plant and a
    /// cabinet.
    TwoTables,
    /// A room made up from the config's seed: its size, the furniture, the things on it, the people's ways
    /// and the camera's place. Nothing intersects, and all that is not fixed to a wall stands on something.
    Random,
    /// One floor of a building made up from the config's seed: rooms on both sides of a corridor of 2.4 m
    /// with a ramp in its middle, one door each towards it, on one side a door to each neighbour too. Desks
    /// with the same things stand back to back on both sides of walls; there are pillars, and windows and
    /// cabinets that give no depth. People sit in every fourth room, and walk in every fourth. The camera
    /// goes into all rooms, and back through those that are joined.
    Building {
        /// Number of rooms, 2..=60.
        rooms: usize,
    },
}
