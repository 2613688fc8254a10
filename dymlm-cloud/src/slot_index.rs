use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;

use crate::block_store::{BlockKey, CUBE_BLOCKS, NEIGHBORS};

/// Slots of blocks by their place, grouped by cubes of 4^3 blocks: blocks that are looked up together lie
/// together, and clones share the cubes that neither has changed since. O(1) expected a look-up.
#[derive(Debug, Clone, Default)]
pub(crate) struct SlotIndex {
    /// For each place of a cube 1 + the slot of its block, or 0.
    cubes: HashMap<BlockKey, Arc<[u32; CUBE_BLOCKS]>, BuildHasherDefault<KeyHasher>>,
}

impl SlotIndex {
    #[inline]
    pub(crate) fn slot(&self, key: BlockKey) -> Option<usize> {
        let (cube, place) = key.in_cube();
        (self.cubes.get(&cube)?[place] as usize).checked_sub(1)
    }

    /// 1 + the slots of the blocks in the neighbourhood of a block, or 0. Each cube is looked up only once.
    pub(crate) fn neighborhood(&self, key: BlockKey) -> [u32; NEIGHBORS] {
        let (first, place) = key.lowest_around().in_cube();
        // Coordinates in the cube of the lowest block around; those from 4 on are in the next cube.
        let [x, y, z] = [place & 3, place >> 2 & 3, place >> 4];
        let reached = [x, y, z].map(|c| usize::from(c + 2 >= 4));
        let cubes: [_; 8] = std::array::from_fn(|number| {
            let step = [number & 1, number >> 1 & 1, number >> 2];
            let is_reached = (0..3).all(|axis| step[axis] <= reached[axis]);
            is_reached.then(|| self.cubes.get(&first.cube_after(step))).flatten()
        });
        let mut slots = [0; NEIGHBORS];
        for (row, slots) in slots.chunks_exact_mut(3).enumerate() {
            let [y, z] = [y + row % 3, z + row / 3];
            let (cube, place) = ((z >> 2) << 2 | (y >> 2) << 1, (z & 3) << 4 | (y & 3) << 2);
            for (x, slot) in (x..).zip(slots) {
                if let Some(cube) = cubes[cube | x >> 2] {
                    *slot = cube[place | x & 3];
                }
            }
        }
        slots
    }

    /// The slots of the blocks in the cube that contains a block.
    pub(crate) fn slots_around(&self, key: BlockKey) -> impl Iterator<Item = usize> {
        let slots = self.cubes.get(&key.in_cube().0).into_iter().flat_map(|cube| cube.iter());
        slots.filter_map(|&slot| (slot as usize).checked_sub(1))
    }

    /// Notes the slot of a block.
    pub(crate) fn insert(&mut self, key: BlockKey, slot: usize) {
        let (cube, place) = key.in_cube();
        let cube = self.cubes.entry(cube).or_insert_with(|| Arc::new([0; CUBE_BLOCKS]));
        Arc::make_mut(cube)[place] = slot as u32 + 1;
    }

    /// Bytes held that another index does not share.
    pub(crate) fn memory_bytes_beside(&self, other: &Self) -> usize {
        let cube = size_of::<[u32; CUBE_BLOCKS]>() + 2 * size_of::<usize>();
        let is_shared = |(key, cube)| other.cubes.get(key).is_some_and(|other| Arc::ptr_eq(cube, other));
        // The sum does not depend on the order.
        let own = self.cubes.iter().filter(|entry| !is_shared(*entry)).count();
        self.cubes.capacity() * (size_of::<(BlockKey, Arc<[u32; CUBE_BLOCKS]>)>() + 1) + own * cube
    }
}

/// Multiplies and folds: keys are distinct words already, no attacker chooses them, and the standard hasher
/// would cost more than the rest of the look-up.
#[derive(Debug, Clone, Default)]
pub(crate) struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let product = (self.0 ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = product ^ product >> 32;
    }
}
