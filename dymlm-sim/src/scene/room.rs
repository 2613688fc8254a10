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
    /// A room generated from the config's seed: its size, the furniture, the things on it, the people's ways
    /// and the camera's place. Things do not intersect, and everything that is not fixed to a wall stands on
    /// something.
    Random,
    /// One floor of a building generated from the config's seed: rooms on both sides of a corridor 2.4 m
    /// wide, with a ramp in its middle if the building is long enough. Each room has a door to the corridor;
    /// on one side of the corridor, neighbouring rooms are connected by doors too. Desks with the same things
    /// stand back to back on both sides of walls; there are pillars, and windows and cabinets that give no
    /// depth. People sit in every fourth room and walk in another fourth. The camera goes into all rooms, and
    /// back through the connected ones.
    Building {
        /// Number of rooms, 2..=60.
        rooms: usize,
    },
}
