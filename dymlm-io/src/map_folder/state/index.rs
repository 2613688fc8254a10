use std::collections::BTreeMap;

use dymlm_core::{DamagedState, decode_part, encode_part};
use serde::{Deserialize, Serialize};

/// Where the parts of a state are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::map_folder) struct StateIndex {
    /// The segments by number: size in bytes.
    pub(super) segments: BTreeMap<u32, u64>,
    /// The parts of each section, by key.
    pub(super) sections: BTreeMap<String, BTreeMap<u64, Part>>,
}

/// Where a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Part {
    pub(super) segment: u32,
    pub(super) offset: u64,
    /// Bytes in the segment.
    pub(super) packed: u64,
    /// Length of the part itself; equal to `packed` when the part is not deflated.
    pub(super) bytes: u64,
    /// Checksum of the bytes in the segment.
    pub(super) crc32: u32,
}

impl StateIndex {
    pub(super) fn encode(&self) -> std::io::Result<Vec<u8>> {
        encode_part(self)
    }

    /// Decodes an index; an error when a part lies outside its segment.
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, DamagedState> {
        let index: Self = decode_part(0, bytes)?;
        for part in index.parts() {
            let end = part.offset.checked_add(part.packed);
            let segment = index.segments.get(&part.segment);
            if end.is_none_or(|end| segment.is_none_or(|&segment| end > segment)) {
                return Err(DamagedState::new(0, "a part lies outside its segment"));
            }
        }
        Ok(index)
    }

    pub(super) fn parts(&self) -> impl Iterator<Item = &Part> {
        self.sections.values().flat_map(BTreeMap::values)
    }

    /// For each segment, the number of its bytes that are in use.
    pub(super) fn bytes_in_use(&self) -> BTreeMap<u32, u64> {
        let mut in_use: BTreeMap<u32, u64> = self.segments.keys().map(|&number| (number, 0)).collect();
        for part in self.parts() {
            *in_use.entry(part.segment).or_default() += part.packed;
        }
        in_use
    }

    /// The segments whose parts are to be copied into a new segment that gets `new_bytes` anyway.
    pub(super) fn to_be_folded(&self, new_bytes: u64) -> Vec<u32> {
        let in_use = self.bytes_in_use();
        let mut written = new_bytes;
        let mut folded = Vec::new();
        let mut is_newest = true;
        for (&number, &bytes) in self.segments.iter().rev() {
            let live = in_use.get(&number).copied().unwrap_or(0);
            is_newest &= live <= 2 * written;
            if is_newest || 2 * live < bytes {
                folded.push(number);
                written += live;
            }
        }
        folded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Saves parts of these sizes, none of which replaces another; returns the number of segments and the
    /// bytes written.
    fn saved(sizes: impl Iterator<Item = u64>) -> (usize, u64) {
        let (mut index, mut written) = (StateIndex::default(), 0);
        for (number, size) in (1..).zip(sizes) {
            let folded = index.to_be_folded(size);
            let mut end = size;
            for folded in &folded {
                end += index.segments.remove(folded).unwrap();
            }
            let parts = index.sections.entry("a".into()).or_default();
            parts.retain(|_, part| !folded.contains(&part.segment));
            let part = Part { segment: number, offset: 0, packed: end, bytes: end, crc32: 0 };
            parts.insert(number.into(), part);
            index.segments.insert(number, end);
            written += end;
        }
        (index.segments.len(), written)
    }

    #[test]
    fn there_are_few_segments_and_each_part_is_written_few_times() {
        let (segments, written) = saved(std::iter::repeat_n(1000, 4000));
        assert!(segments <= 12 && written <= 12 * 4_000_000, "{segments}, {written}");
        let (segments, written) = saved([1_000_000].into_iter().chain(std::iter::repeat_n(1000, 200)));
        assert!(segments <= 10 && written <= 2_500_000, "{segments}, {written}");
    }

    #[test]
    fn parts_outside_their_segment_are_refused() {
        let mut index = StateIndex::default();
        let part = Part { segment: 3, offset: 10, packed: 5, bytes: 9, crc32: 7 };
        index.sections.insert("a".into(), [(1, part)].into());
        for (segment, is_right) in [((3, 15), true), ((3, 14), false), ((2, 15), false)] {
            index.segments = [segment].into();
            let back = StateIndex::decode(&index.encode().unwrap());
            assert_eq!(back.is_ok_and(|back| back == index), is_right);
        }
        index.sections.insert("a".into(), [(1, Part { offset: u64::MAX, ..part })].into());
        assert!(StateIndex::decode(&index.encode().unwrap()).is_err());
    }
}
