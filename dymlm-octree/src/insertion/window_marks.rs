use super::marks::Marks;
use crate::lattice::Key;
use crate::storage::Bits;

/// Largest window, in bits. Two bit sets of 16 MB: 512 cells along each axis, 25 m at 5 cm.
const MAX_BITS: u64 = 1 << 27;

/// Cells added around a window on each side: rounding may carry a ray a cell past its end.
const MARGIN: i32 = 2;

/// Marks in a dense box of cells around one scan.
///
/// The address of a cell interleaves fixed bits of x, y and z. Within an 8^3 block they are in Morton order,
/// so that a block's marks have the layout of the map's bit masks; the number of blocks along each axis is
/// rounded up to a power of two. So a step along one axis is one addition with carry through that axis's bits
/// ("dilated integers").
#[derive(Debug, Clone, Default)]
pub(crate) struct WindowMarks {
    /// Key of the first cell; a multiple of 8, may be negative.
    base: [i32; 3],
    /// Number of blocks.
    blocks: [usize; 3],
    /// The address bits of each axis.
    masks: [u32; 3],
    /// The bit of a block address at which each axis's block index begins.
    shifts: [u32; 3],
    /// Address of each cell index along each axis.
    addresses: [Vec<u32>; 3],
    passed: Vec<u64>,
    hit: Vec<u64>,
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
        let widths = blocks.map(|count| count.next_power_of_two().trailing_zeros());
        if 9 + widths.iter().map(|&width| u64::from(width)).sum::<u64>()
            > u64::from(MAX_BITS.trailing_zeros())
        {
            return false;
        }
        (self.base, self.blocks) = (base, blocks);
        self.shifts = [0, widths[0], widths[0] + widths[1]];
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
        let words = 8 << widths.iter().sum::<u32>();
        // Both are all zero between scans.
        self.passed.resize(words, 0);
        self.hit.resize(words, 0);
        true
    }

    #[inline]
    fn axes_of(&self, key: Key) -> [u32; 3] {
        std::array::from_fn(|axis| self.addresses[axis][(i32::from(key[axis]) - self.base[axis]) as usize])
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        (self.passed.capacity() + self.hit.capacity()) * 8
    }
}

impl Marks for WindowMarks {
    type Cursor = WindowCursor;

    #[inline]
    fn hit(&mut self, key: Key) -> bool {
        let [x, y, z] = self.axes_of(key);
        let address = x | y | z;
        let word = &mut self.hit[address as usize / 64];
        let bit = 1 << (address % 64);
        let new = *word & bit == 0;
        *word |= bit;
        new
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
        for z in 0..self.blocks[2] {
            for y in 0..self.blocks[1] {
                let row = (y << self.shifts[1] | z << self.shifts[2]) * 8;
                let words = row..row + self.blocks[0] * 8;
                let passed = self.passed[words.clone()].as_chunks_mut::<8>().0;
                let hit = self.hit[words].as_chunks_mut::<8>().0;
                for (x, (passed, hit)) in passed.iter_mut().zip(hit).enumerate() {
                    let mut any = 0;
                    for (passed, &hit) in passed.iter_mut().zip(&*hit) {
                        any |= *passed | hit;
                        *passed &= !hit;
                    }
                    if any == 0 {
                        continue;
                    }
                    // A window may reach beyond the map, its marks do not.
                    let corner = [x, y, z].map(|block| block as i32 * 8);
                    let corner: [i32; 3] = std::array::from_fn(|axis| self.base[axis] + corner[axis]);
                    if corner.iter().all(|index| (0..=i32::from(u16::MAX)).contains(index)) {
                        f(corner.map(|index| index as u16), passed, hit);
                    }
                    *passed = [0; 8];
                    *hit = [0; 8];
                }
            }
        }
    }
}
