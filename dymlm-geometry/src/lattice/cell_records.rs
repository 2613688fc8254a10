use dymlm_core::{Point, Rgb};

use super::CubicLattice;
use super::bounds::Bounds;
use super::cell_keys::CellKeys;
use super::cell_table::{CellTable, spread};

/// Most records that are sorted by the library: for up to 20 its stable sort inserts, and asks for no memory.
const FEW: usize = 20;
/// At most one part is made for so many records.
const PART: usize = 4;
/// Records are put into at most 2^`MAX_PART_BITS` parts at a time: to so many places a processor writes in turn
/// without waiting for memory.
const MAX_PART_BITS: u32 = 9;

/// Cells of which a table stays in a processor's caches. Clouds of fewer than twice as many points are not sorted.
const CACHED: usize = 1 << 18;
/// One cell in so many is counted.
const SAMPLED: u64 = 64;

/// The points of a large, scattered cloud with their colours, brought into the order of their lattice cells.
///
/// Cells ascend by x, then y, then z; the points of a cell keep the order of the cloud. Points that are not finite
/// are left out.
///
/// What is moved is the points themselves. [`CellNumbers`](super::CellNumbers) looks up each point's cell in a table,
/// which is less work as long as the table stays in the caches. Records are put into parts by the upper bits of their
/// keys, then those of a part by the next bits, until a part is small: O(n), with memory read and written in turn.
/// Each part is handed over as soon as it is sorted, while it is in the caches.
#[derive(Debug, Default)]
pub(crate) struct CellRecords {
    records: Vec<Record>,
    /// At least as many as the largest part has.
    spare: Vec<Record>,
    /// Where the parts end that records are being put into.
    ends: Vec<usize>,
    /// Cells by which their number is estimated.
    sampled: CellTable,
}

/// A point, with the lower bits of the key of its cell: those that differ in a part.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Record {
    key: u32,
    pub(crate) point: Point,
    /// Black where the cloud has no colours.
    pub(crate) color: Rgb,
}

impl CellRecords {
    /// Calls `visit` with the points of each cell of a large cloud that has too many cells for the caches, and says
    /// whether it did. It does not, either, where the extent holds more than 2^41 cells (of 1 cm, those of a hall of
    /// 130 m in each direction). `colors` are as many or none.
    pub(crate) fn visit_if_scattered(
        &mut self,
        lattice: CubicLattice,
        points: &[Point],
        colors: &[Rgb],
        mut visit: impl FnMut(&[Record]),
    ) -> bool {
        if points.len() < 2 * CACHED {
            return false;
        }
        let keys = Bounds::of(points).and_then(|bounds| CellKeys::new(lattice, &bounds));
        let Some(cell_keys) = keys else { return false };
        let bits = u64::BITS - cell_keys.max_key().leading_zeros();
        let rest = bits.saturating_sub(MAX_PART_BITS);
        if rest > u32::BITS || self.count(&cell_keys, points, rest) <= CACHED {
            return false;
        }
        let largest = self.put_into_parts(&cell_keys, points, colors, rest);
        // What is in there is overwritten, so that it need not be cleared.
        self.spare.resize(self.spare.len().max(largest), Record::default());
        let Self { records, spare, ends, .. } = self;
        let mut first = 0;
        for part in 0..ends.len() {
            let end = ends[part];
            let records = &mut records[first..end];
            sort(records, &mut spare[..end - first], rest, false, ends);
            records.chunk_by(|one, next| one.key == next.key).for_each(&mut visit);
            first = end;
        }
        true
    }

    /// Counts the points of each part, and returns about how many cells hold points. `rest`: the bits of the keys by
    /// which no part is chosen.
    fn count(&mut self, cell_keys: &CellKeys, points: &[Point], rest: u32) -> usize {
        let Self { ends, sampled, .. } = self;
        ends.clear();
        ends.resize(1 << MAX_PART_BITS, 0);
        sampled.clear(points.len() / SAMPLED as usize);
        // By bits in the middle: the upper ones choose the place in the table.
        let is_sampled = |key: u64| (spread(key) >> 32).is_multiple_of(SAMPLED);
        cell_keys.for_each_batch(points, |_, keys| {
            for &key in keys {
                // Points that are not finite are in no part.
                if let Some(count) = ends.get_mut((key >> rest) as usize) {
                    *count += 1;
                    if is_sampled(key) {
                        sampled.number(key);
                    }
                }
            }
        });
        sampled.keys().len() * SAMPLED as usize
    }

    /// Puts all points into the parts that are counted; returns the size of the largest.
    fn put_into_parts(&mut self, cell_keys: &CellKeys, points: &[Point], colors: &[Rgb], rest: u32) -> usize {
        let Self { records, ends, .. } = self;
        let largest = ends.iter().copied().max().unwrap_or(0);
        let count = begin_parts(ends);
        // Room that was made before is overwritten, so that it need not be cleared.
        records.resize(records.len().max(count), Record::default());
        let mut index = 0;
        cell_keys.for_each_batch(points, |points, keys| {
            for (&point, &key) in points.iter().zip(keys) {
                if let Some(place) = ends.get_mut((key >> rest) as usize) {
                    let color = colors.get(index).copied().unwrap_or_default();
                    records[*place] = Record { key: key as u32, point, color };
                    *place += 1;
                }
                index += 1;
            }
        });
        largest
    }
}

/// Replaces counts by where their parts begin; returns their sum.
fn begin_parts(counts: &mut [usize]) -> usize {
    counts.iter_mut().fold(0, |sum, count| sum + std::mem::replace(count, sum))
}

/// Sorts records by the lowest `bits` of their keys, in which alone they differ; those of equal keys keep their
/// order. The result is in `spare` if `into_spare`, else in `records`; the content of the other is lost. What is in
/// `ends` stays.
fn sort(records: &mut [Record], spare: &mut [Record], bits: u32, into_spare: bool, ends: &mut Vec<usize>) {
    if records.len() <= FEW || bits == 0 {
        // Without a bit all keys are the same; the library would ask for memory to find that out.
        if bits > 0 {
            records.sort_by_key(|record| record.key);
        }
        if into_spare {
            spare.copy_from_slice(records);
        }
        return;
    }
    let part_bits = (records.len() / PART).ilog2().min(MAX_PART_BITS).min(bits);
    let rest = bits - part_bits;
    let part = |record: &Record| (record.key >> rest) as usize & ((1 << part_bits) - 1);
    let (own, parts) = (ends.len(), 1 << part_bits);
    ends.resize(own + parts, 0);
    let counts = &mut ends[own..];
    for record in records.iter() {
        counts[part(record)] += 1;
    }
    begin_parts(counts);
    for record in records.iter() {
        let place = &mut counts[part(record)];
        spare[*place] = *record;
        *place += 1;
    }
    let mut first = 0;
    for part in own..own + parts {
        let end = ends[part];
        sort(&mut spare[first..end], &mut records[first..end], rest, !into_spare, ends);
        first = end;
    }
    ends.truncate(own);
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn records_are_sorted_stably_however_their_keys_are_spread() {
        let mut random = SplitMix64::new(3);
        for count in [0, 1, 2, 19, 21, 300, 20_000] {
            for bits in [0, 1, 9, 27, 32] {
                // Evenly, and most of them in one part of the parts.
                for spread in [bits, bits.min(5)] {
                    let mut key = || {
                        let bits = if random.below(50) == 0 { bits } else { spread };
                        random.below(1 << bits) as u32
                    };
                    let record = |index| Record { key: key(), point: [index as f32; 3], color: [0; 3] };
                    let mut records: Vec<Record> = (0..count).map(record).collect();
                    let mut expected = records.clone();
                    expected.sort_by_key(|record| record.key);
                    let mut spare = vec![Record::default(); records.len()];
                    let mut ends = Vec::new();
                    for into_spare in [true, false] {
                        sort(&mut records, &mut spare, bits, into_spare, &mut ends);
                        let sorted = if into_spare { &mut spare } else { &mut records };
                        assert_eq!(*sorted, expected, "{count} records, {bits} bits");
                        records.copy_from_slice(&expected);
                    }
                    assert!(ends.is_empty());
                }
            }
        }
    }
}
