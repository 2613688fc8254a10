/// What the people of a sequence do, after the TUM RGB-D benchmark (Sturm 2012).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Activity {
    /// They walk through the room at 0.6 to 1 m/s: highly dynamic.
    #[default]
    Walking,
    /// They sit on chairs, gesture and turn their heads: slightly dynamic.
    Sitting,
    /// They sit close at desks with their legs below, and type: surfaces behind them are hardly ever seen.
    AtDesks,
}
