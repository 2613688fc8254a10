use crate::block_store::{BLOCK_CELLS, CellBits, put};
use crate::direction::Direction;
use crate::frame_readings::Reading;
use crate::voxel_records::FIELDS;

/// What a frame has read in the voxels of one block: the numbers to add to their records.
#[derive(Debug, Clone)]
pub(crate) struct BlockSums {
    /// The voxels with readings.
    read: CellBits,
    /// By place, zero where there are no readings: the sums of the readings' weights, of weight times place
    /// within the voxel, and of weight times colour; the last number is left for the frames.
    numbers: Vec<[u64; FIELDS]>,
}

impl Default for BlockSums {
    fn default() -> Self {
        Self { read: CellBits::default(), numbers: vec![[0; FIELDS]; BLOCK_CELLS] }
    }
}

impl BlockSums {
    #[inline]
    pub(crate) fn add(&mut self, reading: &Reading) {
        let place = usize::from(reading.place);
        let ([x, y, z], [r, g, b]) = (reading.within, reading.color);
        let weight = u64::from(reading.weight);
        put(&mut self.read, place);
        let numbers = &mut self.numbers[place];
        for (number, factor) in numbers.iter_mut().zip([1, x, y, z, r, g, b, 0]) {
            *number += weight * u64::from(factor);
        }
    }

    /// Takes out which voxels have readings.
    pub(crate) fn take_read(&mut self) -> CellBits {
        std::mem::take(&mut self.read)
    }

    /// Takes the numbers of a voxel out.
    #[inline]
    pub(crate) fn take(&mut self, place: usize, direction: Direction) -> [u64; FIELDS] {
        let mut numbers = std::mem::take(&mut self.numbers[place]);
        numbers[FIELDS - 1] = 1;
        match direction {
            Direction::Insert => numbers,
            Direction::Remove => numbers.map(u64::wrapping_neg),
        }
    }
}
