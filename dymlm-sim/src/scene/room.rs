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
}
