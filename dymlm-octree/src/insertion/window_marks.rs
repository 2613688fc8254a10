use super::marks::Marks;
use crate::lattice::Key;
use crate::storage::{Bits, has};

/// Largest window, in bits. 16 MB: 512 cells along each axis, 25 m at 5 cm.
const MAX_BITS: u64 = 1 << 27;

/// Cells added around a window on each side: rounding may carry a ray a cell past its end; one that went
/// farther would be out of bounds.
const MARGIN: i32 = 2;

/// Marks in a dense box of cells around one scan.
///
/// The address of a cell interleaves fixed bits of x, y and z. Within an 8^3 block they are in Morton order,
/// so that a block's marks have the layout of the map's bit masks; the number of blocks along each axis but
/// the outermost is rounded up to a power of two. So a step along one axis is one addition with carry through
/// that axis's bits ("dilated integers").
///
/// Rays pass most blocks, but readings hit few: only blocks with hits have bits for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct WindowMarks {
    /// Key of the first cell; a multiple of 8, may be negative.
    base: [i32; 3],
    /// Number of blocks.
    blocks: [usize; 3],
    /// The axes by their place in the address, the lowest first.
    order: [usize; 3],
    /// The address bits of each axis.
    masks: [u32; 3],
    /// The bit of a block address at which each axis's block index begins.
    shifts: [u32; 3],
    /// Address of each cell index along each axis.
    addresses: [Vec<u32>; 3],
    passed: Vec<u64>,
    /// For each block the number of its bits in `hit`, counted from 1; 0 without hits.
    hit_slots: Vec<u32>,
    hit: Vec<Bits>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct WindowCursor {
    /// Address bits of x, y, z.
    axes: [u32; 3],
    /// The address bits of each axis.
    masks: [u32; 3],
    /// What a step along each axis adds.
    steps: [u32; 3],
}

impl WindowCursor {
    #[inline]
    fn address(self) -> u32 {
        self.axes[0] | self.axes[1] | self.axes[2]
    }
}

impl WindowMarks {
    /// Lays the window over the cells `min..=max`; `false` when they are too many.
    pub(crate) fn lay(&mut self, min: [i32; 3], max: [i32; 3]) -> bool {
        let base = min.map(|index| (index - MARGIN) & !7);
        let blocks: [usize; 3] =
            std::array::from_fn(|axis| ((max[axis] + MARGIN - base[axis]) / 8 + 1).unsigned_abs() as usize);
        let padded = blocks.map(usize::next_power_of_two);
        let widths = padded.map(usize::trailing_zeros);
        if 9 + widths.iter().map(|&width| u64::from(width)).sum::<u64>()
            > u64::from(MAX_BITS.trailing_zeros())
        {
            return false;
        }
        (self.base, self.blocks) = (base, blocks);
        // The outermost axis is not padded: it is the one that would need most.
        let padding = |axis: &usize| padded[*axis] as f64 / blocks[*axis] as f64;
        let outer = (0..3).max_by(|a, b| padding(a).total_cmp(&padding(b))).unwrap_or(2);
        let (inner, middle) = ((outer + 1) % 3, (outer + 2) % 3);
        self.order = [inner, middle, outer];
        self.shifts[inner] = 0;
        self.shifts[middle] = widths[inner];
        self.shifts[outer] = widths[inner] + widths[middle];
        self.masks = std::array::from_fn(|axis| {
            (((1 << widths[axis]) - 1) << (9 + self.shifts[axis])) | 0b100_1001 << axis
        });
        for (axis, addresses) in self.addresses.iter_mut().enumerate() {
            let shift = 9 + self.shifts[axis];
            addresses.clear();
            addresses.extend((0..blocks[axis] as u32 * 8).map(|i| {
                let within = i & 1 | (i & 2) << 2 | (i & 4) << 4;
                (i >> 3) << shift | within << axis
            }));
        }
        let count = blocks[outer] << self.shifts[outer];
        // Both are all zero between scans.
        self.passed.resize(8 * count, 0);
        self.hit_slots.resize(count, 0);
        true
    }

    #[inline]
    fn axes_of(&self, key: Key) -> [u32; 3] {
        std::array::from_fn(|axis| self.addresses[axis][(i32::from(key[axis]) - self.base[axis]) as usize])
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<u64>() * self.passed.capacity()
            + size_of::<u32>() * self.hit_slots.capacity()
            + size_of::<Bits>() * self.hit.capacity()
    }
}

impl Marks for WindowMarks {
    type Cursor = WindowCursor;

    #[inline]
    fn hit(&mut self, key: Key) -> bool {
        let [x, y, z] = self.axes_of(key);
        let address = x | y | z;
        let slot = &mut self.hit_slots[address as usize / 512];
        if *slot == 0 {
            self.hit.push([0; 8]);
            *slot = self.hit.len() as u32;
        }
        let word = &mut self.hit[*slot as usize - 1][address as usize / 64 % 8];
        let bit = 1 << (address % 64);
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    #[inline]
    fn is_hit(&self, key: Key) -> bool {
        // A cell outside the window, beyond the range, gets an address that no cell has.
        let address_along = |axis: usize| {
            let index = (i32::from(key[axis]) - self.base[axis]) as usize;
            self.addresses[axis].get(index).copied().unwrap_or(u32::MAX)
        };
        let address = (address_along(0) | address_along(1) | address_along(2)) as usize;
        let slot = self.hit_slots.get(address / 512).map_or(0, |&slot| slot as usize);
        slot > 0 && has(&self.hit[slot - 1], address % 512)
    }

    #[inline]
    fn cursor(&self, key: Key, up: [bool; 3]) -> WindowCursor {
        // Up: the step has ones in the bits of the other axes, so that the carry runs through them. Down:
        // these bits of the cursor are zeros, and the borrow runs through them.
        let step = |axis: usize| if up[axis] { (!self.masks[axis]).wrapping_add(1) } else { u32::MAX };
        WindowCursor { axes: self.axes_of(key), masks: self.masks, steps: [step(0), step(1), step(2)] }
    }

    #[inline]
    fn advance<const AXIS: usize>(cursor: &mut WindowCursor) {
        cursor.axes[AXIS] = cursor.axes[AXIS].wrapping_add(cursor.steps[AXIS]) & cursor.masks[AXIS];
    }

    #[inline]
    fn same(a: &WindowCursor, b: &WindowCursor) -> bool {
        a.address() == b.address()
    }

    #[inline]
    fn pass(&mut self, cursor: &WindowCursor) {
        let address = cursor.address();
        self.passed[address as usize / 64] |= 1 << (address % 64);
    }

    fn drain(&mut self, mut f: impl FnMut(Key, &Bits, &Bits)) {
        let [inner, middle, outer] = self.order;
        let mut place = [0; 3];
        for o in 0..self.blocks[outer] {
            for m in 0..self.blocks[middle] {
                (place[middle], place[outer]) = (m, o);
                let first = m << self.shifts[middle] | o << self.shifts[outer];
                let row = first..first + self.blocks[inner];
                let passed = self.passed[8 * row.start..8 * row.end].as_chunks_mut::<8>().0;
                for (i, (passed, slot)) in passed.iter_mut().zip(&mut self.hit_slots[row]).enumerate() {
                    if *slot == 0 && *passed == [0; 8] {
                        continue;
                    }
                    let hit = self.hit.get((*slot as usize).wrapping_sub(1)).unwrap_or(&[0; 8]);
                    for (passed, &hit) in passed.iter_mut().zip(hit) {
                        *passed &= !hit;
                    }
                    // A window may reach beyond the map, its marks do not.
                    place[inner] = i;
                    let corner: [i32; 3] =
                        std::array::from_fn(|axis| self.base[axis] + place[axis] as i32 * 8);
                    if corner.iter().all(|index| (0..=i32::from(u16::MAX)).contains(index)) {
                        f(corner.map(|index| index as u16), passed, hit);
                    }
                    (*passed, *slot) = ([0; 8], 0);
                }
            }
        }
        self.hit.clear();
    }
}
