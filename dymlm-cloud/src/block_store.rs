use std::ops::Deref;
#[cfg(feature = "state")]
use std::sync::Arc;

use dymlm_core::Pages;

use crate::paging::{Block, Paged};
#[cfg(feature = "state")]
use crate::paging::{PageFile, page_out};
use crate::slot_index::SlotIndex;
use crate::stamps::Stamps;

/// Cells along the side of a block.
pub(crate) const BLOCK_SIDE: usize = 8;
/// Cells of a block.
pub(crate) const BLOCK_CELLS: usize = BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE;

/// Blocks in a cube of 4^3 blocks.
pub(crate) const CUBE_BLOCKS: usize = 64;
/// Blocks along the side of that cube.
const CUBE_SIDE: i32 = 4;

/// Blocks in a neighbourhood.
pub(crate) const NEIGHBORS: usize = 27;

/// A bit for each cell of a block.
pub(crate) type CellBits = [u64; BLOCK_CELLS / 64];

/// Whether the bit of a cell is set.
#[inline]
pub(crate) fn has(cells: &CellBits, index: usize) -> bool {
    cells[index / 64] >> (index % 64) & 1 == 1
}

/// Sets the bit of a cell.
#[inline]
pub(crate) fn put(cells: &mut CellBits, index: usize) {
    cells[index / 64] |= 1 << (index % 64);
}

/// Number of cells whose bit is set.
#[inline]
pub(crate) fn count(cells: &CellBits) -> usize {
    cells.iter().map(|word| word.count_ones() as usize).sum()
}

/// Calls `visit` for the index of each cell whose bit is set, by words.
#[inline]
pub(crate) fn for_each_bit(words: impl IntoIterator<Item = u64>, mut visit: impl FnMut(usize)) {
    for (word, mut bits) in words.into_iter().enumerate() {
        while bits != 0 {
            visit(word * 64 + bits.trailing_zeros() as usize);
            bits &= bits - 1;
        }
    }
}

/// The cells of the first set that are not in the second.
#[inline]
pub(crate) fn without(cells: CellBits, others: CellBits) -> CellBits {
    std::array::from_fn(|word| cells[word] & !others[word])
}

/// The cells of both sets.
#[inline]
pub(crate) fn union(cells: CellBits, others: CellBits) -> CellBits {
    std::array::from_fn(|word| cells[word] | others[word])
}

/// The place of a block on its lattice: three coordinates of 21 bits in one word, z first, so that the order
/// of keys is the order of z, then y, then x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct BlockKey(u64);

impl BlockKey {
    const BITS: u32 = 21;
    const BIAS: i32 = 1 << (Self::BITS - 1);
    /// Lattice coordinates c of cells with -LIMIT <= c < LIMIT have a key, which is less than [`Self::LAST`].
    pub(crate) const LIMIT: i32 = (Self::BIAS - 1) * BLOCK_SIDE as i32;
    /// The last key.
    #[cfg(feature = "state")]
    pub(crate) const LAST: Self = Self((1 << (3 * Self::BITS)) - 1);

    /// The block at block coordinates (cell coordinates / 8, rounded down).
    #[inline]
    pub(crate) fn new(block: [i32; 3]) -> Self {
        let [x, y, z] = block.map(|c| u64::from((c.wrapping_add(Self::BIAS)) as u32));
        Self(z << (2 * Self::BITS) | y << Self::BITS | x)
    }

    /// Whether blocks with this coordinate have a key.
    #[inline]
    pub(crate) fn has_block(coordinate: i32) -> bool {
        (-Self::BIAS..Self::BIAS).contains(&coordinate)
    }

    /// Block coordinates.
    #[inline]
    pub(crate) fn block(self) -> [i32; 3] {
        let mask = (1 << Self::BITS) - 1;
        [self.0 & mask, self.0 >> Self::BITS & mask, self.0 >> (2 * Self::BITS)]
            .map(|c| c as i32 - Self::BIAS)
    }

    /// The cube of 4^3 blocks that holds the block, by the lowest of them, and the block's place in it.
    #[inline]
    pub(crate) fn in_cube(self) -> (Self, usize) {
        const LOW: u64 = 3 | 3 << BlockKey::BITS | 3 << (2 * BlockKey::BITS);
        let [x, y, z] = [0, Self::BITS, 2 * Self::BITS].map(|shift| (self.0 >> shift & 3) as usize);
        (Self(self.0 & !LOW), z << 4 | y << 2 | x)
    }

    /// The lowest block of the block's neighbourhood.
    #[inline]
    pub(crate) fn lowest_around(self) -> Self {
        // Blocks that hold cells have others around them, so that no coordinate wraps.
        Self(self.0.wrapping_sub(1 | 1 << Self::BITS | 1 << (2 * Self::BITS)))
    }

    /// The lowest block of the cube that lies as many cubes after that of this one, which is its lowest, along
    /// each axis.
    #[inline]
    pub(crate) fn cube_after(self, [x, y, z]: [usize; 3]) -> Self {
        let cubes = x as u64 | (y as u64) << Self::BITS | (z as u64) << (2 * Self::BITS);
        Self(self.0 + CUBE_SIDE as u64 * cubes)
    }

    /// A number of 63 bits that identifies the block.
    #[cfg(feature = "state")]
    pub(crate) const fn number(self) -> u64 {
        self.0
    }

    /// The block that a [number](Self::number) stands for.
    #[cfg(feature = "state")]
    pub(crate) fn of_number(number: u64) -> Self {
        Self(number)
    }

    /// The cell with this index in the block.
    #[inline]
    pub(crate) fn cell(self, index: usize) -> [i32; 3] {
        let (block, within) = (self.block(), cell_in_block(index));
        std::array::from_fn(|axis| block[axis] * BLOCK_SIDE as i32 + within[axis])
    }

    /// The box around the block (lowest and highest corner), for cells with this side.
    pub(crate) fn bounds(self, cell_size: f64) -> [[f64; 3]; 2] {
        let (block, side) = (self.block().map(f64::from), cell_size * BLOCK_SIDE as f64);
        [block.map(|c| c * side), block.map(|c| (c + 1.0) * side)]
    }

    /// The block and the 26 around it.
    pub(crate) fn neighborhood(self) -> impl Iterator<Item = Neighbor> {
        let center = self.block();
        (0..NEIGHBORS).map(move |place| {
            let step = step_to(place);
            Neighbor { step, key: Self::new(std::array::from_fn(|axis| center[axis] + step[axis])) }
        })
    }
}

/// The step to a block by its place in a [neighbourhood](BlockKey::neighborhood).
#[inline]
pub(crate) fn step_to(place: usize) -> [i32; 3] {
    [place % 3, place / 3 % 3, place / 9].map(|c| c as i32 - 1)
}

/// A block in the neighbourhood of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Neighbor {
    /// Where the block lies, seen from the other: -1, 0 or 1 along each axis.
    pub(crate) step: [i32; 3],
    pub(crate) key: BlockKey,
}

/// Block coordinates of a cell, and the cell's index in its block.
#[inline]
pub(crate) fn split(cell: [i32; 3]) -> ([i32; 3], usize) {
    let [x, y, z] = cell.map(|c| (c & 7) as usize);
    (cell.map(|c| c >> 3), z << 6 | y << 3 | x)
}

/// Coordinates within its block of the cell with this index.
#[inline]
pub(crate) fn cell_in_block(index: usize) -> [i32; 3] {
    [index & 7, index >> 3 & 7, index >> 6].map(|c| c as i32)
}

/// Blocks by their place, each at a slot that does not change.
///
/// A clone shares the blocks, and the pages and cubes that list them; each is copied when one of the two
/// changes it.
#[derive(Debug, Clone)]
pub(crate) struct BlockStore<B> {
    index: SlotIndex,
    keys: Pages<BlockKey>,
    blocks: Pages<Paged<B>>,
    stamps: Stamps,
}

impl<B> Default for BlockStore<B> {
    fn default() -> Self {
        Self {
            index: SlotIndex::default(),
            keys: Pages::default(),
            blocks: Pages::default(),
            stamps: Stamps::default(),
        }
    }
}

impl<B: Block> BlockStore<B> {
    #[inline]
    pub(crate) fn slot(&self, key: BlockKey) -> Option<usize> {
        self.index.slot(key)
    }

    /// 1 + the slots of the blocks in the neighbourhood of the block at a slot, itself among them; 0 where
    /// there is none.
    pub(crate) fn neighborhood(&self, slot: usize) -> [u32; NEIGHBORS] {
        self.index.neighborhood(self.keys[slot])
    }

    /// The slot of the block at `key`, made when there is none. Not inlined, so that the loops over readings
    /// stay small: they remember the last block and seldom call this.
    #[inline(never)]
    pub(crate) fn slot_or_insert(&mut self, key: BlockKey) -> usize {
        self.slot(key).unwrap_or_else(|| self.insert(key))
    }

    #[cold]
    fn insert(&mut self, key: BlockKey) -> usize {
        let slot = self.blocks.len();
        self.index.insert(key, slot);
        self.keys.push(key);
        self.blocks.push(Paged::default());
        slot
    }

    #[inline]
    pub(crate) fn get(&self, key: BlockKey) -> Option<&B> {
        self.slot(key).and_then(|slot| self.blocks.get(slot)).map(Deref::deref)
    }

    #[inline]
    pub(crate) fn blocks(&self) -> &Pages<Paged<B>> {
        &self.blocks
    }

    /// The block of a slot, to change it.
    #[inline]
    pub(crate) fn block_mut(&mut self, slot: usize) -> Option<&mut B> {
        self.blocks.get_mut(slot).and_then(Paged::to_mut)
    }

    /// The last change that was noted, by slot.
    #[inline]
    pub(crate) fn stamps(&self) -> &Stamps {
        &self.stamps
    }

    #[inline]
    pub(crate) fn stamps_mut(&mut self) -> &mut Stamps {
        &mut self.stamps
    }

    /// The block of a slot, to page it out.
    pub(crate) fn paged_mut(&mut self, slot: usize) -> Option<&mut Paged<B>> {
        self.blocks.get_mut(slot)
    }

    /// Pages out the blocks from a slot on.
    #[cfg(feature = "state")]
    pub(crate) fn page_out_from(&mut self, first: usize, file: &Arc<PageFile>) -> std::io::Result<()> {
        let slots: Vec<usize> = (first..self.blocks.len()).collect();
        // A place of the file is free again when all its blocks have changed.
        slots.chunks(CUBE_BLOCKS).try_for_each(|slots| page_out(&mut self.blocks, slots, file))
    }

    /// Frees the memory of blocks that another state of the store has paged out.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        page_out_like(&mut self.blocks, &other.blocks);
    }

    /// All blocks, to change them.
    pub(crate) fn blocks_mut(&mut self) -> impl Iterator<Item = &mut B> {
        self.blocks.iter_mut().filter_map(Paged::to_mut)
    }

    /// Keys by slot.
    #[inline]
    pub(crate) fn keys(&self) -> &Pages<BlockKey> {
        &self.keys
    }

    /// Whether the blocks of an earlier store are at the same slots here. O(blocks / 64) where the stores share
    /// what they have had in common.
    pub(crate) fn begins_with(&self, earlier: &Self) -> bool {
        earlier.keys.unshared_pages(&self.keys).all(|(page, keys)| {
            let first = page * Pages::<BlockKey>::PAGE;
            keys.iter().zip(first..).all(|(key, slot)| self.keys.get(slot) == Some(key))
        })
    }

    /// The lowest and the highest coordinates of all blocks.
    pub(crate) fn bounds(&self) -> Option<[[i32; 3]; 2]> {
        let first = self.keys.get(0)?;
        let join = |[low, high]: [[i32; 3]; 2], key: &BlockKey| {
            let block = key.block();
            [0, 1].map(|end| {
                [0, 1, 2].map(|axis| match end {
                    0 => low[axis].min(block[axis]),
                    _ => high[axis].max(block[axis]),
                })
            })
        };
        Some(self.keys.iter().fold([first.block(); 2], join))
    }

    /// Calls `visit` with the slots of the blocks in a cube of `side` blocks. `side` is a power of two, and
    /// the lowest block of the cube lies at a multiple of it.
    pub(crate) fn slots_within(&self, first: [i32; 3], side: i32, mut visit: impl FnMut(usize)) {
        let is_within = |block: [i32; 3]| (0..3).all(|axis| (0..side).contains(&(block[axis] - first[axis])));
        // One look-up finds all blocks of such a cube.
        let cubes = (side / CUBE_SIDE).max(1);
        if i64::from(cubes).pow(3) > self.keys.len() as i64 {
            let within = self.keys.iter().enumerate().filter(|(_, key)| is_within(key.block()));
            within.for_each(|(slot, _)| visit(slot));
            return;
        }
        for place in 0..cubes.pow(3) {
            let step = [place % cubes, place / cubes % cubes, place / (cubes * cubes)];
            let block: [i32; 3] = std::array::from_fn(|axis| first[axis] + CUBE_SIDE * step[axis]);
            for slot in self.index.slots_around(BlockKey::new(block)) {
                if side >= CUBE_SIDE || is_within(self.keys[slot].block()) {
                    visit(slot);
                }
            }
        }
    }

    /// All slots in the order of their keys, which does not depend on the order of insertion.
    pub(crate) fn sorted_slots(&self) -> Vec<usize> {
        self.sorted_slots_after(&[])
    }

    /// The same; `earlier`: those that were there before the last blocks were added. These alone are sorted.
    pub(crate) fn sorted_slots_after(&self, earlier: &[usize]) -> Vec<usize> {
        let mut new: Vec<usize> = (earlier.len()..self.keys.len()).collect();
        new.sort_unstable_by_key(|&slot| self.keys[slot]);
        let mut slots = Vec::with_capacity(self.keys.len());
        let mut rest = earlier;
        for slot in new {
            let (before, after) = rest.split_at(rest.partition_point(|&it| self.keys[it] < self.keys[slot]));
            slots.extend_from_slice(before);
            slots.push(slot);
            rest = after;
        }
        slots.extend_from_slice(rest);
        slots
    }

    /// Keeps the blocks for whose keys `is_kept` is true; `None` when all stay. Otherwise those that stay
    /// move to lower slots, in their order.
    pub(crate) fn retain(&mut self, is_kept: impl Fn(BlockKey) -> bool) -> Option<Retained> {
        let stays: Vec<bool> = self.keys.iter().map(|&key| is_kept(key)).collect();
        let gone = self.keys.iter().zip(&stays).filter(|(_, stays)| !**stays);
        let gone: Vec<BlockKey> = gone.map(|(&key, _)| key).collect();
        if gone.is_empty() {
            return None;
        }
        self.keys.keep(&stays);
        self.blocks.keep(&stays);
        self.stamps.keep(&stays);
        self.index = SlotIndex::default();
        for (slot, &key) in self.keys.iter().enumerate() {
            self.index.insert(key, slot);
        }
        let around = gone.iter().flat_map(|key| key.neighborhood());
        let mut around: Vec<usize> = around.filter_map(|neighbor| self.slot(neighbor.key)).collect();
        around.sort_unstable();
        around.dedup();
        Some(Retained { stays, around })
    }

    /// Slots by key.
    #[cfg(feature = "state")]
    pub(crate) fn index(&self) -> &SlotIndex {
        &self.index
    }

    /// Puts a block where there is none, or in place of another.
    #[cfg(feature = "state")]
    pub(crate) fn put(&mut self, key: BlockKey, block: B) -> usize {
        let slot = self.slot_or_insert(key);
        self.blocks.set(slot, Paged::new(block));
        slot
    }

    /// The pages of the blocks that lie at most four blocks from those at some slots, by number, ascending.
    /// Costs what these are, not what the store holds.
    pub(crate) fn pages_around(&self, slots: &[usize]) -> Vec<usize> {
        let unique = |mut items: Vec<BlockKey>| {
            items.sort_unstable();
            items.dedup();
            items
        };
        let cubes = unique(slots.iter().map(|&slot| self.keys[slot].in_cube().0).collect());
        let beside = |cube: BlockKey| {
            let center = cube.block();
            (0..NEIGHBORS).map(step_to).map(move |step| {
                BlockKey::new(std::array::from_fn(|axis| center[axis] + CUBE_SIDE * step[axis]))
            })
        };
        let cubes = unique(cubes.into_iter().flat_map(beside).collect());
        let slots = cubes.into_iter().flat_map(|cube| self.index.slots_around(cube));
        let mut pages: Vec<usize> = slots.map(|slot| slot / Pages::<Paged<B>>::PAGE).collect();
        pages.sort_unstable();
        pages.dedup();
        pages
    }

    /// A clone to which blocks of some pages come back from the file when it reads them, and to it alone.
    pub(crate) fn reading_apart(&self, pages: &[usize]) -> Self {
        let mut own = self.clone();
        for page in pages {
            // Its list is copied.
            own.blocks.get_mut(page * Pages::<Paged<B>>::PAGE);
        }
        own
    }

    /// Bytes of memory that another state of the store does not share; `owned` gives those that a block owns
    /// beside the other state's block.
    pub(crate) fn memory_bytes_beside(&self, other: &Self, owned: impl Fn(&B, Option<&B>) -> usize) -> usize {
        self.list_bytes_beside(other) + block_bytes_beside(&self.blocks, &other.blocks, owned)
    }

    /// The same without the blocks.
    pub(crate) fn list_bytes_beside(&self, other: &Self) -> usize {
        self.index.memory_bytes_beside(&other.index)
            + self.keys.memory_bytes_beside(&other.keys)
            + self.stamps.memory_bytes_beside(&other.stamps)
            + self.blocks.memory_bytes_beside(&other.blocks)
    }
}

/// Bytes that blocks take which another state of their list does not share, without the list.
pub(crate) fn block_bytes_beside<B: Block>(
    blocks: &Pages<Paged<B>>,
    other: &Pages<Paged<B>>,
    owned: impl Fn(&B, Option<&B>) -> usize,
) -> usize {
    blocks.unshared(other).map(|slot| blocks[slot].memory_bytes_beside(other.get(slot), &owned)).sum()
}

/// Frees the memory of blocks that another state of a list has paged out.
pub(crate) fn page_out_like<B: Block>(blocks: &mut Pages<Paged<B>>, other: &Pages<Paged<B>>) {
    let is_filed = |slot: &usize| other.get(*slot).is_some_and(|other| other.in_memory().is_none());
    let filed: Vec<usize> = blocks.unshared(other).filter(is_filed).collect();
    for slot in filed {
        if let (Some(block), Some(other)) = (blocks.get_mut(slot), other.get(slot)) {
            block.page_out_like(other);
        }
    }
}

/// What [`BlockStore::retain`] has left.
pub(crate) struct Retained {
    /// By the slots before, whether the block stayed: for [`Pages::keep`] of data that is kept by slot
    /// elsewhere.
    pub(crate) stays: Vec<bool>,
    /// Slots, as they are now, of the blocks beside one that was dropped.
    pub(crate) around: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_hold_their_block_and_sort_by_z_y_x() {
        let corners = [-BlockKey::BIAS, -1, 0, 1, BlockKey::BIAS - 1];
        let mut keys = Vec::new();
        for z in corners {
            for y in corners {
                for x in corners {
                    assert_eq!(BlockKey::new([x, y, z]).block(), [x, y, z]);
                    keys.push(BlockKey::new([x, y, z]));
                }
            }
        }
        assert!(keys.is_sorted());
    }

    #[test]
    fn blocks_share_the_cube_that_they_lie_in() {
        let (cube, place) = BlockKey::new([5, -1, 2]).in_cube();
        assert_eq!((cube.block(), place), ([4, -4, 0], 2 << 4 | 3 << 2 | 1));
    }

    #[test]
    fn the_slots_within_a_cube_are_those_that_a_look_at_all_finds() {
        let mut store = BlockStore::<u8>::default();
        let along = |c: i32| c * c * 7 % 41 - 20;
        (0..300)
            .for_each(|c| _ = store.slot_or_insert(BlockKey::new([along(c), along(c + 90), c % 32 - 16])));
        for (first, side) in
            [([4, -3, 7], 1), ([-2, 0, 2], 2), ([-4, 8, 0], 4), ([-16, 0, -16], 16), ([0; 3], 512)]
        {
            let mut found = Vec::new();
            store.slots_within(first, side, |slot| found.push(slot));
            found.sort_unstable();
            let is_within = |key: &BlockKey| {
                key.block().iter().zip(first).all(|(c, first)| (first..first + side).contains(c))
            };
            let all = (0..store.keys().len()).filter(|&slot| is_within(&store.keys()[slot]));
            assert!(found.into_iter().eq(all), "{first:?} {side}");
        }
    }

    #[test]
    fn slots_are_sorted_into_those_that_were_sorted_before() {
        let mut store = BlockStore::<Vec<u32>>::default();
        let mut earlier = Vec::new();
        for number in 0..300_i32 {
            store.slot_or_insert(BlockKey::new([number * 37 % 11, number * 53 % 17, number * 7 % 5]));
            if number % 41 == 0 {
                earlier = store.sorted_slots_after(&earlier);
                assert_eq!(earlier, store.sorted_slots());
            }
        }
        assert!(earlier.iter().map(|&slot| store.keys()[slot]).is_sorted() && earlier.len() > 200);
    }

    #[test]
    fn the_slots_of_a_neighborhood_are_those_of_its_blocks() {
        let mut store: BlockStore<u8> = BlockStore::default();
        // Every other block, over the borders of cubes and on both sides of zero.
        let coordinates =
            || (-5..=5).flat_map(|z| (-5..=5).flat_map(move |y| (-5..=5).map(move |x| [x, y, z])));
        for block in coordinates().filter(|[x, y, z]| (x + y + z) % 2 == 0) {
            store.slot_or_insert(BlockKey::new(block));
        }
        for slot in 0..store.keys().len() {
            let one_by_one = store.keys()[slot].neighborhood().map(|neighbor| store.slot(neighbor.key));
            let together = store.neighborhood(slot).map(|slot| (slot as usize).checked_sub(1));
            assert_eq!(one_by_one.collect::<Vec<_>>(), together);
        }
    }

    #[test]
    fn the_pages_around_blocks_are_those_of_all_blocks_within_four() {
        let mut store = BlockStore::<u8>::default();
        let along = |c: i32| c * c * 7 % 41 - 20;
        (0..900)
            .for_each(|c| _ = store.slot_or_insert(BlockKey::new([along(c), along(c + 90), c % 96 - 48])));
        let pages = store.pages_around(&[5, 300]);
        let reaches = |slot: usize| {
            [5, 300].map(|center: usize| store.keys()[center].block()).iter().any(|center| {
                store.keys()[slot].block().iter().zip(center).all(|(c, center)| (c - center).abs() <= 4)
            })
        };
        let near = (0..store.keys().len()).filter(|&slot| reaches(slot)).map(|slot| slot / 64);
        assert!(near.into_iter().all(|page| pages.contains(&page)));
        assert!(pages.is_sorted() && pages.len() < store.blocks().pages().count());
    }

    #[test]
    fn cells_split_into_block_and_index() {
        for cell in [[0, 0, 0], [7, 8, -1], [-8, -9, 1_000_003]] {
            let (block, index) = split(cell);
            assert_eq!(BlockKey::new(block).cell(index), cell);
        }
    }
    #[test]
    fn the_neighborhood_is_each_block_around_once() {
        let neighbors: Vec<Neighbor> = BlockKey::new([5, -1, 0]).neighborhood().collect();
        for Neighbor { step: [x, y, z], key } in &neighbors {
            assert_eq!(key.block(), [5 + x, y - 1, *z]);
        }
        let mut keys: Vec<BlockKey> = neighbors.iter().map(|neighbor| neighbor.key).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 27);
    }
}
