use crate::lattice::Key;
use crate::storage::Bits;

/// Two bits for each cell of a scan: passed by a ray, hit by a reading.
pub(crate) trait Marks {
    /// Where a ray is.
    type Cursor: Copy;

    /// Marks a cell as hit; `true` when it was not marked before.
    fn hit(&mut self, key: Key) -> bool;

    /// Whether a cell is marked as hit.
    fn is_hit(&self, key: Key) -> bool;

    /// A cursor at a cell, for a ray that goes upwards or downwards along each axis.
    fn cursor(&self, key: Key, up: [bool; 3]) -> Self::Cursor;

    /// Moves to the next cell along an axis.
    fn advance<const AXIS: usize>(cursor: &mut Self::Cursor);

    /// Whether two cursors are at the same cell.
    fn same(a: &Self::Cursor, b: &Self::Cursor) -> bool;

    /// Marks the cell as passed.
    fn pass(&mut self, cursor: &Self::Cursor);

    /// Hands over every block that holds marks as (lower corner, passed but not hit, hit), in a fixed order,
    /// and takes all marks away.
    fn drain(&mut self, f: impl FnMut(Key, &Bits, &Bits));
}
