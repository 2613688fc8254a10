use std::hint::black_box;

use crate::block_store::{BlockStore, CellBits, count, put, union, without};
use crate::block_sums::BlockSums;
use crate::paging::record;
use crate::places::Places;
use crate::voxel::{Sums, Voxel};
use crate::voxel_records::{VoxelRecords, insert_all};

/// The voxels of a block of 8^3 places that are not empty, by their places.
#[derive(Debug, Clone, Default)]
pub(crate) struct VoxelBlock {
    /// The places that have a voxel.
    places: Places,
    /// Their sums, without the weights of readings without colour, and their observations.
    records: VoxelRecords,
    /// The weights of readings without colour; empty where each reading has one.
    uncolored: Vec<u64>,
    /// The voxels that have changed since the static cloud took in changes last.
    pub(crate) changed: CellBits,
    /// Stamps of the last change of the block, and of the last change that took something out.
    pub(crate) stamp: u32,
    pub(crate) lowered: u32,
}

record!(VoxelBlock { places, records, uncolored, changed, stamp, lowered });

impl BlockStore<VoxelBlock> {
    /// A block that is about to change: see [`VoxelBlock::begin`].
    pub(crate) fn begin_change(&mut self, slot: usize, stamp: u32, seen: u32) -> Option<&mut VoxelBlock> {
        self.stamps_mut().note(slot, stamp);
        let block = self.block_mut(slot)?;
        block.begin(stamp, seen);
        Some(block)
    }

    /// Brings blocks that are about to change from memory, all at once: one after the other, each would be
    /// waited for. Nothing but time depends on it.
    pub(crate) fn fetch(&self, slots: &[usize]) {
        let blocks = || slots.iter().filter_map(|&slot| self.blocks()[slot].in_memory());
        // Where the records are is in the blocks themselves.
        black_box(blocks().fold(0, |all, block| all ^ u64::from(block.stamp) ^ block.records.len() as u64));
        black_box(blocks().fold(0, |all, block| all ^ block.touch_numbers()));
    }
}

impl VoxelBlock {
    /// A block of these voxels, all of which have just changed: see [`CloudMap::restore`](crate::CloudMap).
    #[cfg(feature = "state")]
    pub(crate) fn restored(cells: CellBits, voxels: Vec<Voxel>) -> Self {
        let mut block = Self { changed: cells, stamp: 1, ..Self::default() };
        let mut voxels = voxels.into_iter();
        crate::block_store::for_each_bit(cells, |place| {
            if let Some(voxel) = voxels.next() {
                block.make(place);
                block.add(place, voxel.sums, voxel.observations);
            }
        });
        block
    }

    pub(crate) fn len(&self) -> usize {
        self.records.len()
    }

    /// Reads a number in each of the cache lines that the numbers of the voxels take; returns what nobody needs.
    fn touch_numbers(&self) -> u64 {
        self.uncolored.iter().step_by(8).fold(self.records.touch(), |all, weight| all ^ weight)
    }

    /// The places that have a voxel; a voxel's index is its rank among them.
    pub(crate) fn places(&self) -> &Places {
        &self.places
    }

    /// Makes the voxel at a place when there is none; returns whether there was none.
    #[inline]
    pub(crate) fn make(&mut self, place: usize) -> bool {
        let is_new = !self.places.has(place);
        if is_new {
            self.insert(place);
        }
        is_new
    }

    fn insert(&mut self, place: usize) {
        let index = self.places.rank(place);
        self.records.insert(index);
        if !self.uncolored.is_empty() {
            self.uncolored.insert(index, 0);
        }
        self.places.insert(place);
    }

    /// Adds readings of `frames` frames to the voxel at a place, which must be there. Arithmetic wraps.
    #[inline]
    pub(crate) fn add(&mut self, place: usize, readings: Sums, frames: u32) {
        let index = self.places.rank(place);
        let [weight, x, y, z, r, g, b, uncolored] = readings.to_array();
        // The sign is extended, so that a number that is negative in 32 bits is negative in 64.
        let frames = i64::from(frames as i32) as u64;
        self.records.add(index, &[weight, x, y, z, r, g, b, frames]);
        if uncolored != 0 {
            self.uncolored.resize(self.records.len(), 0);
            self.uncolored[index] = self.uncolored[index].wrapping_add(uncolored);
        }
    }

    /// Takes what a frame has read out of `sums` and adds it, and makes the voxels that are not there yet;
    /// returns how many these are. Arithmetic wraps.
    pub(crate) fn add_frame(&mut self, sums: &mut BlockSums, are_colored: bool) -> usize {
        let read = sums.take_read();
        let new = without(read, *self.places.cells());
        self.make_all(&new);
        self.changed = union(self.changed, read);
        if !are_colored {
            self.uncolored.resize(self.records.len(), 0);
            self.places.for_each(&read, |place, index| {
                self.uncolored[index] = self.uncolored[index].wrapping_add(sums.weight(place));
            });
        }
        self.records.add_all(&self.places, &read, sums);
        count(&new)
    }

    /// Makes the voxels at places that have none.
    fn make_all(&mut self, new: &CellBits) {
        if *new == CellBits::default() {
            return;
        }
        self.records.insert_all(&self.places, new);
        if !self.uncolored.is_empty() {
            insert_all(&mut self.uncolored, &self.places, new, 0);
        }
        self.places = Places::new(union(*self.places.cells(), *new));
    }

    /// The voxel at a place.
    pub(crate) fn get(&self, place: usize) -> Option<Voxel> {
        self.places.has(place).then(|| self.voxel(self.places.rank(place)))
    }

    /// The voxel with this index.
    #[inline]
    pub(crate) fn voxel(&self, index: usize) -> Voxel {
        let [weight, x, y, z, r, g, b, observations] = self.records.get(index);
        let uncolored = self.uncolored.get(index).copied().unwrap_or(0);
        let sums = Sums::from_array([weight, x, y, z, r, g, b, uncolored]);
        Voxel { sums, observations: observations as u32 }
    }

    /// Sum of weights of the voxel with this index.
    #[inline]
    pub(crate) fn weight(&self, index: usize) -> u64 {
        self.records.first(index)
    }

    /// Number of frames that have read the voxel with this index.
    #[inline]
    pub(crate) fn observations(&self, index: usize) -> u32 {
        self.records.last(index) as u32
    }

    /// Whether each reading has a colour.
    pub(crate) fn is_colored(&self) -> bool {
        self.uncolored.is_empty()
    }

    /// The voxels at these places, by place.
    pub(crate) fn voxels(&self, places: &CellBits) -> Vec<(usize, Voxel)> {
        let mut voxels = Vec::with_capacity(self.len());
        self.places.for_each(places, |place, index| voxels.push((place, self.voxel(index))));
        voxels
    }

    /// The voxels by place.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, Voxel)> + use<> {
        self.voxels(self.places.cells()).into_iter()
    }

    /// Adds a voxel's readings to the voxel at a place.
    pub(crate) fn merge(&mut self, place: usize, voxel: &Voxel) {
        self.make(place);
        self.add(place, voxel.sums, voxel.observations);
        put(&mut self.changed, place);
    }

    /// Takes all readings out of the voxel at a place, and returns them.
    pub(crate) fn take(&mut self, place: usize) -> Voxel {
        let voxel = self.get(place).unwrap_or_default();
        self.add(place, voxel.sums.negated(), voxel.observations.wrapping_neg());
        voxel
    }

    /// Begins a change with this stamp; the static cloud knows what changed before `seen`.
    fn begin(&mut self, stamp: u32, seen: u32) {
        if self.stamp != stamp {
            if self.stamp <= seen {
                self.changed = CellBits::default();
            }
            self.stamp = stamp;
        }
    }

    /// Whether more was taken out of any voxel at these places than put in.
    pub(crate) fn is_overdrawn(&self, places: &CellBits) -> bool {
        self.voxels(places).into_iter().any(|(_, voxel)| voxel.is_overdrawn())
    }

    /// Bytes that the block owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.records.memory_bytes() + self.uncolored.capacity() * size_of::<u64>()
    }

    /// Drops the empty voxels; returns how many there were.
    pub(crate) fn drop_empty(&mut self) -> usize {
        let before = self.len();
        let mut kept =
            Self { changed: self.changed, stamp: self.stamp, lowered: self.lowered, ..Self::default() };
        if self.iter().any(|(_, voxel)| voxel.is_empty()) {
            for (place, voxel) in self.iter().filter(|(_, voxel)| !voxel.is_empty()) {
                kept.merge(place, &voxel);
            }
            kept.changed = self.changed;
            *self = kept;
        }
        before - self.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_store::{BLOCK_CELLS, has};
    use crate::frame_readings::Reading;

    /// One reading.
    fn reading(weight: u64, within: [u64; 3], color: Option<[u8; 3]>) -> Sums {
        Sums {
            weight,
            position: within.map(|c| weight * c),
            color: color.unwrap_or_default().map(|c| weight * u64::from(c)),
            uncolored: if color.is_none() { weight } else { 0 },
        }
    }

    fn sum(one: Sums, other: Sums) -> Sums {
        let (one, other) = (one.to_array(), other.to_array());
        Sums::from_array(std::array::from_fn(|field| one[field] + other[field]))
    }

    #[test]
    fn a_frame_adds_what_its_readings_add_one_by_one() {
        for are_colored in [true, false] {
            let (mut block, mut expected) = (VoxelBlock::default(), VoxelBlock::default());
            let mut sums = BlockSums::default();
            for frame in 0..60_u64 {
                let (mut read, mut made) = (CellBits::default(), 0);
                for index in 0..frame * 3 {
                    let random = (frame * 300 + index + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                    let (place, [x, y, z, r, g, b, ..]) = ((random >> 55) as usize, random.to_le_bytes());
                    // Far readings, later near ones.
                    let weight = 1 << (frame / 4 + random % 4);
                    let (within, color) = ([x, y, z], if are_colored { [r, g, b] } else { [0; 3] });
                    sums.add(&Reading { weight, place: place as u16, within, color });
                    let reading = reading(weight.into(), within.map(u64::from), are_colored.then_some(color));
                    made += usize::from(expected.make(place));
                    expected.add(place, reading, u32::from(!has(&read, place)));
                    put(&mut read, place);
                }
                assert_eq!(sums.read(), &read);
                assert_eq!(block.add_frame(&mut sums, are_colored), made);
                assert!(block.iter().eq(expected.iter()), "frame {frame}");
            }
            assert!(matches!(block.records, VoxelRecords::Medium(_)));
        }
    }

    #[test]
    fn sums_of_any_size_are_exact_and_can_be_taken_out() {
        let mut block = VoxelBlock::default();
        let mut sums = vec![Voxel::default(); BLOCK_CELLS];
        let mut readings = Vec::new();
        for step in 0..2000_u64 {
            let place = (step * step % 509) as usize;
            let weight = if place == 4 { 1 << 40 } else { 1 << (step % 32) };
            let color = (step % 3 > 0).then_some([step as u8, 255, 7]);
            readings.push((place, reading(weight, [step % 256, 255, 0], color), 70_000 * (step % 2) as u32));
        }
        for &(place, reading, frames) in &readings {
            block.make(place);
            block.add(place, reading, frames);
            sums[place].sums = sum(sums[place].sums, reading);
            sums[place].observations += frames;
        }
        let expected = || sums.iter().enumerate().filter(|(_, voxel)| !voxel.is_empty());
        assert!(block.iter().eq(expected().map(|(place, voxel)| (place, *voxel))));
        for (place, voxel) in expected() {
            let (index, upper) = (block.places().rank(place), block.get(place).unwrap());
            assert_eq!(block.weight(index), voxel.sums.weight);
            assert_eq!(block.observations(index), upper.observations);
        }
        for &(place, reading, frames) in &readings {
            block.add(place, reading.negated(), frames.wrapping_neg());
        }
        assert!(block.iter().all(|(_, voxel)| voxel == Voxel::default()));
        let all = [u64::MAX; BLOCK_CELLS / 64];
        assert!(!block.is_overdrawn(&all));
        let (place, reading, _) = readings[0];
        block.add(place, reading.negated(), 0);
        assert!(block.is_overdrawn(&all));
        assert!(!block.is_overdrawn(&CellBits::default()));
        block.add(place, reading, 0);
        assert_eq!((block.drop_empty(), block.len()), (expected().count(), 0));
    }
}
