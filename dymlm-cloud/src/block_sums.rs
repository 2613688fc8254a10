use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit, put};
use crate::frame_readings::Reading;
use crate::voxel_records::FIELDS;

/// What a frame has read in the voxels of one block: the numbers to add to their records.
#[derive(Debug, Default)]
pub(crate) struct BlockSums {
    /// The voxels with readings.
    read: CellBits,
    /// By place, zero where there are no readings: the sums of the readings' weights, of weight times place
    /// within the voxel, and of weight times colour; then 1 for the frame, and in the upper half of that number
    /// how many readings there are. Empty until there are readings.
    numbers: Vec<[u64; FIELDS]>,
    /// Not 0 when a voxel has several readings.
    repeated: u64,
}

/// A reading, in the upper half of a number whose lower half counts frames.
const ONE_READING: u64 = 1 << u32::BITS;

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
        let frames = &mut numbers[FIELDS - 1];
        self.repeated |= *frames;
        *frames = (*frames | 1) + ONE_READING;
    }

    /// Makes the numbers those whose addition takes the readings out.
    pub(crate) fn negate(&mut self) {
        for_each_bit(self.read, |place| {
            let (frames, readings) = self.counts(place);
            let numbers = &mut self.numbers[place];
            *numbers = numbers.map(u64::wrapping_neg);
            numbers[FIELDS - 1] = joined(frames.wrapping_neg(), readings.wrapping_neg());
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
        self.repeated = 0;
        std::mem::take(&mut self.read)
    }

    /// Whether a voxel has several readings.
    pub(crate) fn has_repeats(&self) -> bool {
        self.repeated > 0
    }

    /// How many readings of a voxel there are beyond the first one.
    pub(crate) fn repeats(&self, place: usize) -> u32 {
        let (frames, readings) = self.counts(place);
        readings.wrapping_sub(frames)
    }

    /// How many frames have read a voxel, and how many readings there are.
    fn counts(&self, place: usize) -> (u32, u32) {
        let both = self.numbers[place][FIELDS - 1];
        (both as u32, (both >> u32::BITS) as u32)
    }

    /// Sum of weights of the readings in a voxel.
    pub(crate) fn weight(&self, place: usize) -> u64 {
        self.numbers[place][0]
    }

    /// Takes out the numbers of a voxel, the last of which counts frames alone.
    #[inline]
    pub(crate) fn take(&mut self, place: usize) -> [u64; FIELDS] {
        let mut numbers = std::mem::take(&mut self.numbers[place]);
        // The sign is extended, so that a number that is negative in 32 bits is negative in 64.
        numbers[FIELDS - 1] = i64::from(numbers[FIELDS - 1] as i32) as u64;
        numbers
    }
}

fn joined(frames: u32, readings: u32) -> u64 {
    u64::from(readings) << u32::BITS | u64::from(frames)
}
