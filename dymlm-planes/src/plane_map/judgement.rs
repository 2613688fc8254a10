use std::collections::BTreeMap;

use crate::patches::PatchVoxel;

/// What the evidence says of a plane's voxels in a block.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Judgement {
    /// Places in the block, ascending, of the voxels of which nothing is known.
    unknown: Vec<u16>,
    /// The same of those in free space: what was there is gone.
    free: Vec<u16>,
}

/// What is known of a voxel; of two planes' voxels in one place, the greater counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum State {
    Unknown,
    Free,
    Stands,
}

impl Judgement {
    /// The judgement on a block's voxels, in their order. `is_free` tells whether one is in free space; `None`:
    /// unknown. There is none where all of them stand.
    pub(super) fn of(
        voxels: impl Iterator<Item = PatchVoxel>,
        is_free: impl Fn(PatchVoxel) -> Option<bool>,
    ) -> Option<Self> {
        let mut judgement = Self::default();
        for voxel in voxels {
            match is_free(voxel) {
                None => judgement.unknown.push(voxel.place_in_block()),
                Some(true) => judgement.free.push(voxel.place_in_block()),
                Some(false) => {}
            }
        }
        (!judgement.is_empty()).then_some(judgement)
    }

    /// The judgement on the voxels of a block that two planes have together, each with its own judgement: what
    /// stands for one of them stands, and what is free for one of them and not there for the other is free.
    pub(super) fn united<V: Iterator<Item = PatchVoxel>>(planes: [(Option<&Self>, V); 2]) -> Option<Self> {
        let mut states: BTreeMap<u16, State> = BTreeMap::new();
        for (own, voxels) in planes {
            for place in voxels.map(PatchVoxel::place_in_block) {
                let state = own.map_or(State::Stands, |own| own.state(place));
                states.entry(place).and_modify(|known| *known = state.max(*known)).or_insert(state);
            }
        }
        let places =
            |of: State| states.iter().filter(move |(_, state)| **state == of).map(|(&place, _)| place);
        let united = Self { unknown: places(State::Unknown).collect(), free: places(State::Free).collect() };
        (!united.is_empty()).then_some(united)
    }

    fn state(&self, place: u16) -> State {
        match place {
            _ if self.free.binary_search(&place).is_ok() => State::Free,
            _ if self.unknown.binary_search(&place).is_ok() => State::Unknown,
            _ => State::Stands,
        }
    }

    /// Whether all voxels stand.
    fn is_empty(&self) -> bool {
        self.unknown.is_empty() && self.free.is_empty()
    }

    /// Whether a voxel of the block is in free space.
    pub(super) fn is_free(&self, voxel: PatchVoxel) -> bool {
        self.free.binary_search(&voxel.place_in_block()).is_ok()
    }

    /// Number of voxels in free space.
    pub(super) fn free_voxels(&self) -> usize {
        self.free.len()
    }

    /// Number of voxels of which nothing is known.
    pub(super) fn unknown_voxels(&self) -> usize {
        self.unknown.len()
    }

    /// Forgets voxels that the block no longer has; returns whether it still says anything.
    pub(super) fn keep(&mut self, voxels: impl Iterator<Item = PatchVoxel>) -> bool {
        let left: Vec<u16> = voxels.map(PatchVoxel::place_in_block).collect();
        for places in [&mut self.free, &mut self.unknown] {
            places.retain(|place| left.binary_search(place).is_ok());
        }
        !self.is_empty()
    }

    /// Bytes that it owns.
    pub(super) fn memory_bytes(&self) -> usize {
        (self.free.capacity() + self.unknown.capacity()) * size_of::<u16>()
    }

    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        let is_possible = |places: &[u16]| {
            places.is_sorted_by(|a, b| a < b) && places.last().is_none_or(|&place| place < 1 << 12)
        };
        is_possible(&self.free) && is_possible(&self.unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_for_one_of_two_planes_stands() {
        let voxels =
            |columns: std::ops::Range<i32>| columns.map(|x| PatchVoxel { cell: [x, 0, 0], count: 1 });
        let place = |x: i32| PatchVoxel { cell: [x, 0, 0], count: 1 }.place_in_block();
        // Voxels 0 to 5, of which 0 to 2 are free and 3 is unknown; voxels 2 to 8, of which 3, 7 and 8 are unknown.
        let one = Judgement::of(voxels(0..6), |voxel| match voxel.cell[0] {
            3 => None,
            x => Some(x < 3),
        });
        let other = Judgement::of(voxels(2..9), |voxel| match voxel.cell[0] {
            3 | 7 | 8 => None,
            _ => Some(false),
        });
        let united =
            Judgement::united([(one.as_ref(), voxels(0..6)), (other.as_ref(), voxels(2..9))]).unwrap();
        assert_eq!(united.free, [0, 1].map(place));
        assert_eq!(united.unknown, [3, 7, 8].map(place));
        assert_eq!(Judgement::united([(None, voxels(0..6)), (None, voxels(2..9))]), None);
        // One that was judged alone, and one of which the block has nothing.
        assert_eq!(Judgement::united([(one.as_ref(), voxels(0..6)), (None, voxels(0..0))]), one);
        let mut left = one.unwrap();
        assert!(left.keep(voxels(2..6)) && left.free == [place(2)] && left.unknown_voxels() == 1);
        assert!(!left.keep(voxels(4..6)));
    }
}
