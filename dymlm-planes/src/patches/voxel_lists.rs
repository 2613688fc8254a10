use std::collections::BTreeMap;

use super::block::{BLOCK_VOXELS, BlockKey, cell_of, local};

/// Bits of a word of the set of voxels.
const WORD: usize = u64::BITS as usize;

/// Voxels in the order in which samples fell into them, by block: the first half of a counting sort, which
/// takes a third of the time of sorting the samples. Their memory is kept for the next patch.
#[derive(Debug, Default)]
pub(crate) struct VoxelLists {
    /// The place of each block's list. Lists behind these are empty.
    places: BTreeMap<BlockKey, usize>,
    lists: Vec<Vec<u16>>,
    /// The block of the last sample, and the place of its list: neighbouring samples mostly share it. (Its
    /// coordinates, because a key takes longer to compute.)
    last: Option<([i32; 3], usize)>,
}

impl VoxelLists {
    pub(super) fn clear(&mut self) {
        self.lists.iter_mut().take(self.places.len()).for_each(Vec::clear);
        self.places.clear();
        self.last = None;
    }

    pub(super) fn add(&mut self, voxel: [i32; 3]) {
        let block = cell_of(voxel);
        let place = match self.last {
            Some((last, place)) if last == block => place,
            _ => self.find(block),
        };
        if let Some(list) = self.lists.get_mut(place) {
            list.push(local(voxel));
        }
    }

    /// The place of a block's list, which is begun if there is none.
    fn find(&mut self, block: [i32; 3]) -> usize {
        let next = self.places.len();
        let place = *self.places.entry(BlockKey::new(block)).or_insert(next);
        if place == self.lists.len() {
            self.lists.push(Vec::new());
        }
        self.last = Some((block, place));
        place
    }

    /// The blocks, each with the places of its voxels and the numbers of samples in them, in order.
    pub(super) fn counted(&self) -> impl Iterator<Item = (BlockKey, Vec<(u16, u32)>)> {
        let mut counts = [0_u32; BLOCK_VOXELS];
        self.places.iter().map(move |(&block, &place)| {
            let list = self.lists.get(place).map_or(&[][..], Vec::as_slice);
            (block, count(list, &mut counts))
        })
    }
}

/// The distinct places of a list, ascending, with their numbers. `counts` are zeros before and after.
fn count(list: &[u16], counts: &mut [u32; BLOCK_VOXELS]) -> Vec<(u16, u32)> {
    let mut present = [0_u64; BLOCK_VOXELS / WORD];
    for &place in list {
        let place = usize::from(place) % BLOCK_VOXELS;
        counts[place] += 1;
        present[place / WORD] |= 1 << (place % WORD);
    }
    let distinct = present.iter().map(|word| word.count_ones() as usize).sum();
    let mut counted = Vec::with_capacity(distinct);
    for (first, mut word) in (0..).step_by(WORD).zip(present) {
        while word != 0 {
            let place = first + word.trailing_zeros() as usize;
            counted.push((place as u16, std::mem::take(&mut counts[place])));
            word &= word - 1;
        }
    }
    counted
}
