use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::marks::Marks;
use crate::lattice::{Key, pack};
use crate::storage::{Bits, entry_of, has};

/// A multiplicative hash for keys that are one integer.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct IntegerHasher(u64);

impl Hasher for IntegerHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    #[inline]
    fn write_u64(&mut self, value: u64) {
        // Fibonacci hashing. The high bits are well mixed; they are folded into the low bits, since hash maps
        // use both.
        let product = (self.0 ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = product ^ product >> 32;
    }
}

pub(crate) type IntegerMap<V> = HashMap<u64, V, BuildHasherDefault<IntegerHasher>>;

/// Marks in a hash map of blocks, for scans too wide for a window: a laser that sees hundreds of metres.
#[derive(Debug, Clone, Default)]
pub(crate) struct SparseMarks {
    slots: IntegerMap<u32>,
    blocks: Vec<MarkedBlock>,
    /// The block of the last mark: a ray stays in one block for several steps.
    last: Option<(Key, u32)>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct SparseCursor {
    key: Key,
    /// What a step along each axis adds.
    steps: [u16; 3],
}

#[derive(Debug, Clone)]
struct MarkedBlock {
    corner: Key,
    passed: Bits,
    hit: Bits,
}

impl SparseMarks {
    #[inline]
    fn block(&mut self, key: Key) -> &mut MarkedBlock {
        let corner = key.map(|index| index & !7);
        let slot = match self.last {
            Some((last, slot)) if last == corner => slot,
            _ => self.find(corner),
        };
        self.last = Some((corner, slot));
        &mut self.blocks[slot as usize]
    }

    fn find(&mut self, corner: Key) -> u32 {
        let next = self.blocks.len() as u32;
        let slot = *self.slots.entry(pack(corner)).or_insert(next);
        if slot == next {
            self.blocks.push(MarkedBlock { corner, passed: [0; 8], hit: [0; 8] });
        }
        slot
    }

    /// Number of cells marked.
    pub(crate) fn count(&self) -> usize {
        let words = self.blocks.iter().flat_map(|block| block.passed.iter().zip(&block.hit));
        words.map(|(passed, hit)| (passed | hit).count_ones() as usize).sum()
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<MarkedBlock>() + self.slots.capacity() * 16
    }
}

impl Marks for SparseMarks {
    type Cursor = SparseCursor;

    #[inline]
    fn hit(&mut self, key: Key) -> bool {
        let entry = entry_of(key, 0);
        let word = &mut self.block(key).hit[entry / 64];
        let bit = 1 << (entry % 64);
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    #[inline]
    fn is_hit(&self, key: Key) -> bool {
        let slot = self.slots.get(&pack(key.map(|index| index & !7)));
        slot.is_some_and(|&slot| has(&self.blocks[slot as usize].hit, entry_of(key, 0)))
    }

    #[inline]
    fn cursor(&self, key: Key, up: [bool; 3]) -> SparseCursor {
        SparseCursor { key, steps: up.map(|up| if up { 1 } else { u16::MAX }) }
    }

    #[inline]
    fn advance<const AXIS: usize>(cursor: &mut SparseCursor) {
        cursor.key[AXIS] = cursor.key[AXIS].wrapping_add(cursor.steps[AXIS]);
    }

    #[inline]
    fn same(a: &SparseCursor, b: &SparseCursor) -> bool {
        a.key == b.key
    }

    #[inline]
    fn pass(&mut self, cursor: &SparseCursor) {
        let entry = entry_of(cursor.key, 0);
        self.block(cursor.key).passed[entry / 64] |= 1 << (entry % 64);
    }

    fn drain(&mut self, mut f: impl FnMut(Key, &Bits, &Bits)) {
        self.blocks.sort_unstable_by_key(|block| pack(block.corner));
        for block in &mut self.blocks {
            for (passed, &hit) in block.passed.iter_mut().zip(&block.hit) {
                *passed &= !hit;
            }
            f(block.corner, &block.passed, &block.hit);
        }
        self.blocks.clear();
        self.slots.clear();
        self.last = None;
    }
}
