use crate::lattice::Key;
use crate::storage::Bits;

/// Two bits for each cell of a scan: passed by a ray, hit by a reading.
pub(crate) trait Marks {
    /// Where a ray is.
    type Cursor: Copy;

    /// Marks a cell as hit, and says whether it was not yet.
    fn hit(&mut self, key: Key) -> bool;

    fn cursor(&self, key: Key) -> Self::Cursor;

    /// Moves to the next cell along `axis`, upwards or downwards.
    fn advance(&self, cursor: &mut Self::Cursor, axis: usize, up: bool);

    /// Whether two cursors are at the same cell.
    fn same(a: &Self::Cursor, b: &Self::Cursor) -> bool;

    /// Marks the cell as passed.
    fn pass(&mut self, cursor: &Self::Cursor);

    /// Hands over every block that holds marks as (lower corner, passed but not hit, hit), in a fixed order, and
    /// takes all marks away.
    fn drain(&mut self, f: impl FnMut(Key, &Bits, &Bits));
}
