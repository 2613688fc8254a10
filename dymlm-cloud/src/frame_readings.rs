use crate::block_store::BlockKey;
use crate::slot_numbers::SlotNumbers;

/// The readings of a frame or scan, by the blocks of voxels that they lie in: so a frame fetches each block
/// from memory once and changes it once, however many rows of the image meet it. 12 bytes a reading, which
/// are kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct FrameReadings {
    /// In the order in which they came.
    readings: Vec<Reading>,
    /// Readings that came one after the other and lie in one block; each run ends where the next one begins.
    runs: Vec<Run>,
    /// The block of the last run.
    last: Option<[i32; 3]>,
    /// Blocks met lately, with their numbers, by the lowest bits of their coordinates: where a surface lies
    /// along the face of two blocks, noise takes the readings to and fro between them.
    recent: Vec<Option<([i32; 3], usize)>>,
    /// Numbers of the blocks, by their slots.
    numbers: SlotNumbers,
    /// By these numbers, 1 + the block's last run.
    last_runs: Vec<u32>,
}

/// Number of blocks that are remembered.
const RECENT: usize = 64;

/// A reading in a block of voxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reading {
    pub(crate) weight: u32,
    /// The place of its voxel in the block.
    pub(crate) place: u16,
    /// Its place within the voxel, 1/256 voxel.
    pub(crate) within: [u8; 3],
    /// Black where there is no colour.
    pub(crate) color: [u8; 3],
}

#[derive(Debug, Clone, Copy)]
struct Run {
    /// Its first reading.
    first: u32,
    /// 1 + the run before it in the same block, or 0.
    before: u32,
}

impl FrameReadings {
    /// Begins a frame.
    pub(crate) fn clear(&mut self) {
        self.readings.clear();
        self.runs.clear();
        self.last = None;
        self.recent.clear();
        self.numbers.clear();
        self.last_runs.clear();
    }

    /// Notes readings, each with the coordinates of its block; `find_slot` gives the slot of a block.
    pub(crate) fn extend(
        &mut self,
        readings: impl Iterator<Item = ([i32; 3], Reading)>,
        mut find_slot: impl FnMut(BlockKey) -> usize,
    ) {
        self.recent.resize(RECENT, None);
        for (block, reading) in readings {
            // Neighbouring readings mostly share a block.
            if self.last != Some(block) {
                self.last = Some(block);
                self.begin_run(block, &mut find_slot);
            }
            self.readings.push(reading);
        }
    }

    fn begin_run(&mut self, block: [i32; 3], find_slot: impl FnMut(BlockKey) -> usize) {
        let number = self.number(block, find_slot);
        self.runs.push(Run { first: self.readings.len() as u32, before: self.last_runs[number] });
        self.last_runs[number] = self.runs.len() as u32;
    }

    fn number(&mut self, block: [i32; 3], mut find_slot: impl FnMut(BlockKey) -> usize) -> usize {
        let [x, y, z] = block.map(|c| (c & 3) as usize);
        let recent = &mut self.recent[z << 4 | y << 2 | x];
        if let Some((place, number)) = *recent
            && place == block
        {
            return number;
        }
        let number = self.numbers.number_or_insert(find_slot(BlockKey::new(block)));
        *recent = Some((block, number));
        if number == self.last_runs.len() {
            self.last_runs.push(0);
        }
        number
    }

    /// Number of readings.
    pub(crate) fn len(&self) -> usize {
        self.readings.len()
    }

    /// Bytes that the readings take.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.readings.capacity() * size_of::<Reading>()
            + self.runs.capacity() * size_of::<Run>()
            + self.recent.capacity() * size_of::<Option<([i32; 3], usize)>>()
            + self.numbers.memory_bytes()
            + self.last_runs.capacity() * size_of::<u32>()
    }

    /// The slots of the blocks with readings, in the order in which the frame met them.
    pub(crate) fn slots(&self) -> &[usize] {
        self.numbers.slots()
    }

    /// Calls `visit` with each reading in the block with this number: its place among the slots.
    #[inline]
    pub(crate) fn for_each_in(&self, number: usize, mut visit: impl FnMut(&Reading)) {
        let mut next = self.last_runs[number] as usize;
        while let Some(Run { first, before }) = next.checked_sub(1).map(|run| self.runs[run]) {
            let end = self.runs.get(next).map_or(self.readings.len(), |run| run.first as usize);
            self.readings[first as usize..end].iter().for_each(&mut visit);
            next = before as usize;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reading_is_in_its_block_once() {
        let mut readings = FrameReadings::default();
        for frame in 1..3 {
            let slot_of = |index: u32| (index / 3 % 7 * frame % 5) as usize;
            for index in 0..200 {
                let reading = Reading { weight: index, place: 7, within: [1, 2, 3], color: [4, 5, 6] };
                let block = [slot_of(index) as i32, 0, 0];
                readings.extend(std::iter::once((block, reading)), |key| key.block()[0] as usize);
            }
            let mut found = Vec::new();
            for (number, &slot) in readings.slots().iter().enumerate() {
                readings.for_each_in(number, |reading| {
                    assert_eq!(slot_of(reading.weight), slot);
                    found.push(reading.weight);
                });
            }
            found.sort_unstable();
            assert!(found.into_iter().eq(0..200) && readings.len() == 200);
            readings.clear();
        }
    }
}
