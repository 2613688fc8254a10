use crate::CellState;
use crate::accessor::Accessor;
use crate::lattice::{Key, Lattice, OUTSIDE};
use crate::occupancy_grid::grid::HeightRange;

/// A line through the cells of the octree along `up`.
///
/// Which cell is at each place of the line depends on the line alone, not on the cubes through which it is
/// followed: a change elsewhere in the octree cannot change a column's state, not even by rounding.
struct Column {
    origin: [f64; 3],
    up: [f64; 3],
    lattice: Lattice,
    key: Key,
}

/// The state of a column: occupied when one of its cells is, else free when one of them is, else unknown.
/// `foot` is where the line meets height 0, metres; with NaN as a height it is unknown.
pub(super) fn column_state(
    accessor: &mut Accessor<'_>,
    foot: [f64; 3],
    up: [f64; 3],
    heights: HeightRange,
) -> CellState {
    let lattice = accessor.lattice;
    let Some([bottom, top]) = within_map(&lattice, foot, up, heights) else { return CellState::Unknown };
    let origin = std::array::from_fn(|axis| foot[axis] + bottom * up[axis]);
    let Some(key) = lattice.key(origin) else { return CellState::Unknown };
    let mut column = Column { origin, up, lattice, key };
    let mut state = CellState::Unknown;
    loop {
        match accessor.cell_state(column.key) {
            CellState::Occupied => return CellState::Occupied,
            CellState::Free => state = CellState::Free,
            CellState::Unknown => {}
        }
        let side_bits = accessor.side_bits(column.key);
        match column.leave(side_bits) {
            Some(left) if left <= top - bottom => {}
            _ => return state,
        }
    }
}

/// The part of the heights at which a line is in the map. A height on a border between cells counts for the
/// cell inside the range only.
fn within_map(
    lattice: &Lattice,
    foot: [f64; 3],
    up: [f64; 3],
    [lowest, highest]: HeightRange,
) -> Option<HeightRange> {
    let margin = 0.01 * lattice.resolution;
    // A hundredth of a cell inside the border, so that rounding cannot lead beyond it.
    let border = lattice.half_extent() - margin;
    let [mut bottom, mut top] = [lowest + margin, highest - margin];
    for axis in 0..3 {
        if up[axis] == 0.0 {
            continue;
        }
        let ends = [-border, border].map(|end| (end - foot[axis]) / up[axis]);
        bottom = bottom.max(ends[0].min(ends[1]));
        top = top.min(ends[0].max(ends[1]));
    }
    // NaN fails.
    (lowest < highest && bottom <= top.max(lowest + margin)).then_some([bottom, top])
}

impl Column {
    /// Enters the first cell outside the cube of 2^`side_bits` cells a side around the present cell. Returns
    /// the distance from the origin at which the line enters it, metres; `None` at the border of the map.
    fn leave(&mut self, side_bits: u32) -> Option<f64> {
        let within = (1_u32 << side_bits) - 1;
        let beyond = |axis: usize| {
            let index = u32::from(self.key[axis]);
            if self.up[axis] > 0.0 { (index | within) + 1 } else { (index & !within).wrapping_sub(1) }
        };
        let at =
            |axis: usize| if self.up[axis] == 0.0 { f64::INFINITY } else { self.entry(axis, beyond(axis)) };
        let ends = [at(0), at(1), at(2)];
        let left = ends[0].min(ends[1]).min(ends[2]);
        let index = |axis: usize| if ends[axis] == left { beyond(axis) } else { self.index_at(axis, left) };
        let [x, y, z] = [index(0), index(1), index(2)].map(|index| u16::try_from(index).ok());
        self.key = [x?, y?, z?];
        left.is_finite().then_some(left)
    }

    /// Distance from the origin at which the line enters the cells with an index along an axis, metres. Where
    /// it enters new indices along several axes at the same distance, it goes through an edge.
    fn entry(&self, axis: usize, index: u32) -> f64 {
        let up = self.up[axis];
        // Going down, a cell is entered at its upper side; the index before 0 is 2^32 - 1.
        let border = if up > 0.0 { index } else { index.wrapping_add(1) };
        let half = f64::from(OUTSIDE / 2);
        ((f64::from(border) - half) * self.lattice.resolution - self.origin[axis]) / up
    }

    /// The last index along an axis that the line has entered up to a distance.
    fn index_at(&self, axis: usize, distance: f64) -> u32 {
        let (first, up) = (u32::from(self.key[axis]), self.up[axis]);
        let estimate = self.lattice.index(self.origin[axis] + distance * up).map_or(first, u32::from);
        // Rounding may have put the estimate off by one.
        if up > 0.0 {
            let mut index = estimate.max(first);
            while index > first && self.entry(axis, index) > distance {
                index -= 1;
            }
            while index + 1 < OUTSIDE && self.entry(axis, index + 1) <= distance {
                index += 1;
            }
            index
        } else if up < 0.0 {
            let mut index = estimate.min(first);
            while index < first && self.entry(axis, index) > distance {
                index += 1;
            }
            while index > 0 && self.entry(axis, index - 1) <= distance {
                index -= 1;
            }
            index
        } else {
            first
        }
    }
}
