use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit, put};
use crate::frame_readings::Reading;
use crate::voxel_records::FIELDS;

/// What a frame has read in the voxels of one block: the numbers to add to their records.
#[derive(Debug, Default)]
pub(crate) struct BlockSums {
    /// The voxels with readings.
    read: CellBits,
    /// By place, zero where there are no readings: the sums of the readings' weights, of weight times place
    /// within the voxel, and of weight times colour; then 1 for the frame. Empty until there are readings.
    numbers: Vec<[u64; FIELDS]>,
}

impl BlockSums {
    #[inline]
    pub(crate) fn add(&mut self, reading: &Reading) {
        let place = usize::from(reading.place);
        let ([x, y, z], [r, g, b]) = (reading.within, reading.color);
        let weight = u64::from(reading.weight);
        put(&mut self.read, place);
        if place >= self.numbers.len() {
            self.numbers.resize(BLOCK_CELLS, [0; FIELDS]);
        }
        let numbers = &mut self.numbers[place];
        for (number, factor) in numbers.iter_mut().zip([1, x, y, z, r, g, b]) {
            *number += weight * u64::from(factor);
        }
        numbers[FIELDS - 1] = 1;
    }

    /// Makes the numbers those whose addition takes the readings out.
    pub(crate) fn negate(&mut self) {
        for_each_bit(self.read, |place| {
            self.numbers[place] = self.numbers[place].map(u64::wrapping_neg);
        });
    }

    /// Forgets the readings.
    pub(crate) fn clear(&mut self) {
        for_each_bit(self.take_read(), |place| _ = self.take(place));
    }

    /// Bytes that the numbers take.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.numbers.capacity() * size_of::<[u64; FIELDS]>()
    }

    /// The voxels with readings.
    pub(crate) fn read(&self) -> &CellBits {
        &self.read
    }

    /// Takes out which voxels have readings.
    pub(crate) fn take_read(&mut self) -> CellBits {
        std::mem::take(&mut self.read)
    }

    /// Sum of weights of the readings in a voxel.
    pub(crate) fn weight(&self, place: usize) -> u64 {
        self.numbers[place][0]
    }

    /// Takes out the numbers of a voxel.
    #[inline]
    pub(crate) fn take(&mut self, place: usize) -> [u64; FIELDS] {
        std::mem::take(&mut self.numbers[place])
    }
}
