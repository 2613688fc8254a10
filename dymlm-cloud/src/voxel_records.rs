use crate::block_store::{CellBits, count};
use crate::block_sums::BlockSums;
use crate::paging::record_of_cases;
use crate::places::Places;
use crate::voxel::SUMS;

/// Numbers of a record: the sums of a voxel without the last one, and its observations.
pub(crate) const FIELDS: usize = SUMS;

/// The sums and observations of a block's voxels, in as few bits as the largest of these numbers needs.
///
/// In a kitchen a voxel is read by three frames, before a robot at rest by a hundred thousand. A record lies
/// in one place, so that reading a voxel is one fetch from memory.
#[derive(Debug, Clone)]
pub(crate) enum VoxelRecords {
    /// 24 bits a number, one after the other: 24 bytes a voxel.
    Narrow(Vec<[u64; 3]>),
    Medium(Vec<[u32; FIELDS]>),
    Wide(Vec<[u64; FIELDS]>),
}

record_of_cases!(VoxelRecords { 0 => Narrow(records), 1 => Medium(records), 2 => Wide(records) });

impl Default for VoxelRecords {
    fn default() -> Self {
        Self::Narrow(Vec::new())
    }
}

impl VoxelRecords {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Narrow(records) => records.len(),
            Self::Medium(records) => records.len(),
            Self::Wide(records) => records.len(),
        }
    }

    /// Inserts a record of zeros.
    pub(crate) fn insert(&mut self, index: usize) {
        match self {
            Self::Narrow(records) => insert(records, index, [0; 3]),
            Self::Medium(records) => insert(records, index, [0; FIELDS]),
            Self::Wide(records) => insert(records, index, [0; FIELDS]),
        }
    }

    /// Inserts records of zeros for new places; `old`: the places that have records.
    pub(crate) fn insert_all(&mut self, old: &Places, new: &CellBits) {
        match self {
            Self::Narrow(records) => insert_all(records, old, new, [0; 3]),
            Self::Medium(records) => insert_all(records, old, new, [0; FIELDS]),
            Self::Wide(records) => insert_all(records, old, new, [0; FIELDS]),
        }
    }

    /// The numbers of a record.
    #[inline]
    pub(crate) fn get(&self, index: usize) -> [u64; FIELDS] {
        match self {
            Self::Narrow(records) => unpacked(records[index]),
            Self::Medium(records) => records[index].map(u64::from),
            Self::Wide(records) => records[index],
        }
    }

    /// The first number of a record.
    #[inline]
    pub(crate) fn first(&self, index: usize) -> u64 {
        match self {
            Self::Narrow(records) => records[index][0] & NARROW,
            Self::Medium(records) => records[index][0].into(),
            Self::Wide(records) => records[index][0],
        }
    }

    /// The last number of a record.
    #[inline]
    pub(crate) fn last(&self, index: usize) -> u64 {
        match self {
            Self::Narrow(records) => records[index][2] >> 40,
            Self::Medium(records) => records[index][FIELDS - 1].into(),
            Self::Wide(records) => records[index][FIELDS - 1],
        }
    }

    /// Adds to the numbers of a record, which wrap at 64 bits. Records become wider when a number does not
    /// fit.
    #[inline]
    pub(crate) fn add(&mut self, index: usize, numbers: &[u64; FIELDS]) {
        let before = self.get(index);
        let sums = std::array::from_fn(|field| before[field].wrapping_add(numbers[field]));
        // The widest records hold any number.
        while !self.set(index, &sums) {
            self.widen();
        }
    }

    /// Takes the numbers of some places out of `sums`, and adds them to the records of these places.
    pub(crate) fn add_all(&mut self, places: &Places, chosen: &CellBits, sums: &mut BlockSums) {
        let Self::Narrow(records) = self else {
            return places.for_each(chosen, |place, index| self.add(index, &sums.take(place)));
        };
        // A record that becomes too large waits: widening changes all records, which are borrowed here.
        let mut left = Vec::new();
        places.for_each(chosen, |place, index| {
            let (record, numbers) = (&mut records[index], sums.take(place));
            let before = unpacked(*record);
            let sums = std::array::from_fn(|field| before[field].wrapping_add(numbers[field]));
            if all_bits(&sums) <= NARROW {
                *record = packed(&sums);
            } else {
                left.push((index, numbers));
            }
        });
        for (index, numbers) in left {
            self.add(index, &numbers);
        }
    }

    /// Reads a number in each of the records' cache lines, which brings them from memory; returns what nobody
    /// needs.
    pub(crate) fn touch(&self) -> u64 {
        match self {
            Self::Narrow(records) => records.iter().step_by(2).fold(0, |all, record| all ^ record[0]),
            Self::Medium(records) => {
                records.iter().step_by(2).fold(0, |all, record| all ^ u64::from(record[0]))
            }
            Self::Wide(records) => records.iter().fold(0, |all, record| all ^ record[0]),
        }
    }

    /// Bytes that the records take.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::Narrow(records) => records.capacity() * size_of::<[u64; 3]>(),
            Self::Medium(records) => records.capacity() * size_of::<[u32; FIELDS]>(),
            Self::Wide(records) => records.capacity() * size_of::<[u64; FIELDS]>(),
        }
    }

    /// Sets the numbers of a record; returns whether they fit.
    #[inline]
    fn set(&mut self, index: usize, numbers: &[u64; FIELDS]) -> bool {
        let all = all_bits(numbers);
        match self {
            Self::Narrow(records) if all <= NARROW => records[index] = packed(numbers),
            Self::Medium(records) if all <= u32::MAX.into() => {
                records[index] = numbers.map(|number| number as u32);
            }
            Self::Wide(records) => records[index] = *numbers,
            Self::Narrow(_) | Self::Medium(_) => return false,
        }
        true
    }

    #[cold]
    fn widen(&mut self) {
        *self = match &*self {
            Self::Narrow(records) => {
                Self::Medium(records.iter().map(|&record| unpacked(record).map(|n| n as u32)).collect())
            }
            Self::Medium(records) => Self::Wide(records.iter().map(|record| record.map(u64::from)).collect()),
            Self::Wide(records) => Self::Wide(records.clone()),
        };
    }
}

/// The largest number of a narrow record.
const NARROW: u64 = (1 << 24) - 1;

/// All bits of some numbers.
#[inline]
fn all_bits(numbers: &[u64; FIELDS]) -> u64 {
    numbers.iter().fold(0, |all, number| all | number)
}

/// Packs eight numbers of 24 bits.
#[inline]
fn packed(&[a, b, c, d, e, f, g, h]: &[u64; FIELDS]) -> [u64; 3] {
    [a | b << 24 | c << 48, c >> 16 | d << 8 | e << 32 | f << 56, f >> 8 | g << 16 | h << 40]
}

#[inline]
fn unpacked([low, middle, high]: [u64; 3]) -> [u64; FIELDS] {
    [
        low,
        low >> 24,
        low >> 48 | middle << 16,
        middle >> 8,
        middle >> 32,
        middle >> 56 | high << 8,
        high >> 16,
        high >> 40,
    ]
    .map(|number| number & NARROW)
}

fn insert<T>(records: &mut Vec<T>, index: usize, record: T) {
    reserve(records, 1);
    records.insert(index, record);
}

/// Inserts a record for each new place; `old`: the places that have records.
pub(crate) fn insert_all<T: Copy>(records: &mut Vec<T>, old: &Places, new: &CellBits, record: T) {
    let (mut from, mut to) = (records.len(), records.len() + count(new));
    reserve(records, to - from);
    records.resize(to, record);
    // From the last new place on, the records behind it move to where they are in the end.
    for (word, mut bits) in new.iter().copied().enumerate().rev() {
        while bits != 0 {
            let bit = bits.ilog2() as usize;
            bits ^= 1 << bit;
            let behind = old.rank(64 * word + bit)..from;
            to -= behind.len() + 1;
            from = behind.start;
            records.copy_within(behind, to + 1);
            records[to] = record;
        }
    }
}

fn reserve<T>(records: &mut Vec<T>, more: usize) {
    if records.len() + more > records.capacity() {
        // Small steps: doubling would waste a quarter of the map's memory.
        records.reserve_exact(more + 3 + records.len() / 16);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_records_hold_what_they_are_given() {
        for seed in 0..200_u64 {
            let numbers = std::array::from_fn(|field| {
                (seed * 7919 + field as u64).wrapping_mul(0x9E37_79B9_7F4A) & NARROW
            });
            assert_eq!(unpacked(packed(&numbers)), numbers);
        }
    }

    #[test]
    fn records_widen_as_soon_as_a_number_needs_it_and_no_number_changes() {
        let mut records = VoxelRecords::default();
        (0..3).for_each(|index| records.insert(index));
        let mut expected = [[0_u64; FIELDS]; 3];
        for step in 0..64_u32 {
            let (index, field) = ((step % 3) as usize, (step % 8) as usize);
            let mut numbers = [0; FIELDS];
            numbers[field] = 1_u64.wrapping_shl(step) - u64::from(step);
            records.add(index, &numbers);
            expected[index][field] = expected[index][field].wrapping_add(numbers[field]);
            for (index, expected) in expected.iter().enumerate() {
                assert_eq!(&records.get(index), expected);
                assert_eq!([records.first(index), records.last(index)], [expected[0], expected[FIELDS - 1]]);
            }
            match step {
                0..=22 => assert!(matches!(records, VoxelRecords::Narrow(_)), "{step}"),
                26..=30 => assert!(matches!(records, VoxelRecords::Medium(_)), "{step}"),
                34.. => assert!(matches!(records, VoxelRecords::Wide(_)), "{step}"),
                _ => {}
            }
        }
    }
}
