use std::ops::Range;

use crate::block_store::{BLOCK_CELLS, CellBits, has, put};
use crate::voxel::{SUMS, Sums, Voxel};

/// The voxels of 8^3 places that are not empty, by their places.
///
/// A kitchen's voxel is read by three frames, a robot's at rest by a hundred thousand: of each sum the block
/// keeps 32 bits, of the observations 16, and the rest only for those voxels that need more. So a voxel takes
/// 30 bytes, and a sum is exact all the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct VoxelBlock {
    /// The places that have a voxel.
    places: CellBits,
    /// For each word of `places` the number of voxels before it.
    before: [u16; BLOCK_CELLS / 64],
    /// The lower halves of weights, of the sums of position and colour, of the observations.
    weights: Vec<u32>,
    sums: Vec<[u32; 6]>,
    observations: Vec<u16>,
    rest: Option<Box<Rest>>,
    /// The voxels that the current frame has read.
    pub(crate) read: CellBits,
    /// The voxels that have changed since the static cloud was made last.
    pub(crate) changed: CellBits,
    /// Stamp of the last change of the block, and of the last that took something out.
    pub(crate) stamp: u32,
    pub(crate) lowered: u32,
}

/// What few blocks have.
#[derive(Debug, Clone, Default)]
struct Rest {
    /// The lower halves of the weights without colour; none where each reading has one.
    uncolored: Vec<u32>,
    /// The upper halves of voxels that need them, by place.
    upper: Vec<(u16, Upper)>,
}

/// The upper halves of a voxel's sums and observations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Upper {
    sums: [u32; SUMS],
    observations: u16,
}

impl VoxelBlock {
    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    /// The places that have a voxel.
    pub(crate) fn places(&self) -> &CellBits {
        &self.places
    }

    /// Number of voxels at places before this one: the index of the voxel there.
    #[inline]
    pub(crate) fn rank(&self, place: usize) -> usize {
        let below = self.places[place / 64] & ((1 << (place % 64)) - 1);
        usize::from(self.before[place / 64]) + below.count_ones() as usize
    }

    /// Makes the voxel at a place when there is none; tells whether it did.
    #[inline]
    pub(crate) fn make(&mut self, place: usize) -> bool {
        let is_new = !has(&self.places, place);
        if is_new {
            self.insert(place);
        }
        is_new
    }

    fn insert(&mut self, place: usize) {
        let index = self.rank(place);
        if self.weights.len() == self.weights.capacity() {
            // Small steps: doubling would waste a quarter of the map.
            let more = 4 + self.weights.len() / 8;
            self.weights.reserve_exact(more);
            self.sums.reserve_exact(more);
            self.observations.reserve_exact(more);
        }
        self.weights.insert(index, 0);
        self.sums.insert(index, [0; 6]);
        self.observations.insert(index, 0);
        if let Some(rest) = self.rest.as_mut().filter(|rest| !rest.uncolored.is_empty()) {
            rest.uncolored.insert(index, 0);
        }
        put(&mut self.places, place);
        self.before.iter_mut().skip(place / 64 + 1).for_each(|before| *before += 1);
    }

    /// Adds a reading to the voxel at a place, which has one.
    #[inline]
    pub(crate) fn add(&mut self, place: usize, reading: Sums) {
        let index = self.rank(place);
        let sums = reading.to_array();
        let mut carried = [0; SUMS];
        if let (Some(weight), Some(lower)) = (self.weights.get_mut(index), self.sums.get_mut(index)) {
            carried[0] = add_lower(weight, sums[0]);
            for ((lower, carried), sum) in lower.iter_mut().zip(&mut carried[1..]).zip(&sums[1..]) {
                *carried = add_lower(lower, *sum);
            }
        }
        if sums[7] != 0 {
            carried[7] = self.add_uncolored(index, sums[7]);
        }
        if carried.iter().fold(0, |any, carried| any | carried) != 0 {
            self.carry(place, carried, 0);
        }
    }

    /// Adds to the number of frames that have read the voxel at a place.
    #[inline]
    pub(crate) fn count(&mut self, place: usize, frames: u32) {
        let index = self.rank(place);
        let Some(observations) = self.observations.get_mut(index) else { return };
        let sum = u32::from(*observations) + (frames & 0xFFFF);
        *observations = sum as u16;
        let carried = ((frames >> 16) + (sum >> 16)) as u16;
        if carried != 0 {
            self.carry(place, [0; SUMS], carried);
        }
    }

    fn add_uncolored(&mut self, index: usize, weight: u64) -> u32 {
        let count = self.weights.len();
        let uncolored = &mut self.rest.get_or_insert_default().uncolored;
        uncolored.resize(count, 0);
        uncolored.get_mut(index).map_or(0, |lower| add_lower(lower, weight))
    }

    #[cold]
    fn carry(&mut self, place: usize, sums: [u32; SUMS], observations: u16) {
        let upper = &mut self.rest.get_or_insert_default().upper;
        let index = match upper.binary_search_by_key(&(place as u16), |(place, _)| *place) {
            Ok(index) => index,
            Err(index) => {
                upper.reserve_exact(1);
                upper.insert(index, (place as u16, Upper::default()));
                index
            }
        };
        let (_, upper) = &mut upper[index];
        for (upper, carried) in upper.sums.iter_mut().zip(sums) {
            *upper = upper.wrapping_add(carried);
        }
        upper.observations = upper.observations.wrapping_add(observations);
    }

    /// The voxel at a place.
    pub(crate) fn get(&self, place: usize) -> Option<Voxel> {
        has(&self.places, place).then(|| self.voxel(place, self.rank(place)))
    }

    /// The voxel at a place, whose index is known.
    #[inline]
    pub(crate) fn voxel(&self, place: usize, index: usize) -> Voxel {
        let upper = if self.rest.is_some() { self.upper(place) } else { Upper::default() };
        let [x, y, z, r, g, b] = self.sums[index];
        let uncolored = self.rest.as_ref().and_then(|rest| rest.uncolored.get(index)).copied().unwrap_or(0);
        let lower = [self.weights[index], x, y, z, r, g, b, uncolored];
        let sums = std::array::from_fn(|k| u64::from(upper.sums[k]) << 32 | u64::from(lower[k]));
        let observations = u32::from(upper.observations) << 16 | u32::from(self.observations[index]);
        Voxel { sums: Sums::from_array(sums), observations }
    }

    fn upper(&self, place: usize) -> Upper {
        let Some(rest) = &self.rest else { return Upper::default() };
        let index = rest.upper.binary_search_by_key(&(place as u16), |(place, _)| *place);
        index.map_or(Upper::default(), |index| rest.upper[index].1)
    }

    /// Sum of weights of the voxel at a place with this index.
    #[inline]
    pub(crate) fn weight(&self, place: usize, index: usize) -> u64 {
        let upper = if self.rest.is_some() { self.upper(place).sums[0] } else { 0 };
        u64::from(upper) << 32 | u64::from(self.weights[index])
    }

    /// Number of frames that have read the voxel at a place with this index.
    #[inline]
    pub(crate) fn observations(&self, place: usize, index: usize) -> u32 {
        let upper = if self.rest.is_some() { self.upper(place).observations } else { 0 };
        u32::from(upper) << 16 | u32::from(self.observations[index])
    }

    /// Calls `visit` for the place and the index of each voxel at these places, by place.
    #[inline]
    pub(crate) fn for_each(&self, places: &CellBits, visit: impl FnMut(usize, usize)) {
        self.for_each_in(0..places.len(), |layer| places[layer], visit);
    }

    /// The same for places that are given layer by layer: each is a word.
    #[inline]
    pub(crate) fn for_each_in(
        &self,
        layers: Range<usize>,
        places: impl Fn(usize) -> u64,
        mut visit: impl FnMut(usize, usize),
    ) {
        for word in layers {
            let mut bits = places(word);
            if bits == 0 {
                continue;
            }
            let all = self.places[word];
            bits &= all;
            let (before, in_rows) = (usize::from(self.before[word]), sums_before(all));
            while bits != 0 {
                let place = bits.trailing_zeros();
                bits &= bits - 1;
                let (row, x) = (place & !7, place & 7);
                let in_row = (all >> row) as u8 & ((1 << x) - 1);
                let index = before + (in_rows >> row & 0xFF) as usize + in_row.count_ones() as usize;
                visit(64 * word + place as usize, index);
            }
        }
    }

    /// Those of the voxels that are at these places, by place.
    pub(crate) fn voxels(&self, places: &CellBits) -> Vec<(usize, Voxel)> {
        let mut voxels = Vec::with_capacity(self.len());
        self.for_each(places, |place, index| voxels.push((place, self.voxel(place, index))));
        voxels
    }

    /// The voxels by place.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, Voxel)> {
        self.voxels(&self.places).into_iter()
    }

    /// Adds a voxel's readings to the voxel at a place.
    pub(crate) fn merge(&mut self, place: usize, voxel: &Voxel) {
        self.make(place);
        self.add(place, voxel.sums);
        self.count(place, voxel.observations);
        put(&mut self.changed, place);
    }

    /// Takes the readings out of the voxel at a place.
    pub(crate) fn take(&mut self, place: usize) -> Voxel {
        let voxel = self.get(place).unwrap_or_default();
        self.add(place, voxel.sums.negated());
        self.count(place, voxel.observations.wrapping_neg());
        voxel
    }

    /// Begins a change with this stamp; what changed before `seen` is known. Tells whether it has just begun.
    #[inline]
    pub(crate) fn begin(&mut self, stamp: u32, seen: u32) -> bool {
        let begins = self.stamp != stamp;
        if begins {
            self.read = CellBits::default();
            if self.stamp <= seen {
                self.changed = CellBits::default();
            }
            self.stamp = stamp;
        }
        begins
    }

    /// Whether the current frame has taken out more than was put in.
    pub(crate) fn is_overdrawn(&self) -> bool {
        self.voxels(&self.read).iter().any(|(_, voxel)| voxel.is_overdrawn())
    }

    /// Bytes that the block owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        let rest = self.rest.as_ref().map_or(0, |rest| {
            size_of::<Rest>()
                + rest.uncolored.capacity() * size_of::<u32>()
                + rest.upper.capacity() * size_of::<(u16, Upper)>()
        });
        let voxel = size_of::<u32>() + size_of::<[u32; 6]>() + size_of::<u16>();
        self.weights.capacity() * voxel + rest
    }

    /// Drops the empty voxels; gives how many there were.
    pub(crate) fn drop_empty(&mut self) -> usize {
        let before = self.len();
        let mut kept =
            Self { changed: self.changed, stamp: self.stamp, lowered: self.lowered, ..Self::default() };
        if self.iter().any(|(_, voxel)| voxel.is_empty()) || self.rest.is_some() {
            for (place, voxel) in self.iter().filter(|(_, voxel)| !voxel.is_empty()) {
                kept.merge(place, &voxel);
            }
            kept.changed = self.changed;
            *self = kept;
        }
        before - self.len()
    }
}

/// For each byte of a word the number of ones in the bytes below.
#[inline]
fn sums_before(word: u64) -> u64 {
    let pairs = word - (word >> 1 & 0x5555_5555_5555_5555);
    let quads = (pairs & 0x3333_3333_3333_3333) + (pairs >> 2 & 0x3333_3333_3333_3333);
    let bytes = (quads + (quads >> 4)) & 0x0F0F_0F0F_0F0F_0F0F;
    // The product sums each byte and those below.
    bytes.wrapping_mul(0x0101_0101_0101_0101) << 8
}

/// Adds to the lower half of a sum; gives what is carried to the upper one.
#[inline]
fn add_lower(lower: &mut u32, number: u64) -> u32 {
    let sum = u64::from(*lower) + (number & 0xFFFF_FFFF);
    *lower = sum as u32;
    ((number >> 32) as u32).wrapping_add((sum >> 32) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_any_size_are_exact_and_can_be_taken_out() {
        let mut block = VoxelBlock::default();
        let mut sums = vec![Voxel::default(); BLOCK_CELLS];
        let mut readings = Vec::new();
        for step in 0..2000_u64 {
            let place = (step * step % 509) as usize;
            let weight = if place == 4 { 1 << 40 } else { 1 << (step % 32) };
            let color = (step % 3 > 0).then_some([step as u8, 255, 7]);
            readings.push((place, Sums::of(weight, [step % 256, 255, 0], color), 70_000 * (step % 2) as u32));
        }
        for &(place, reading, frames) in &readings {
            block.make(place);
            block.add(place, reading);
            block.count(place, frames);
            sums[place].sums.add(&reading);
            sums[place].observations += frames;
        }
        let expected = || sums.iter().enumerate().filter(|(_, voxel)| !voxel.is_empty());
        assert!(block.iter().eq(expected().map(|(place, voxel)| (place, *voxel))));
        for (place, voxel) in expected() {
            let (index, upper) = (block.rank(place), block.get(place).unwrap());
            assert_eq!(block.weight(place, index), voxel.sums.weight);
            assert_eq!(block.observations(place, index), upper.observations);
        }
        for &(place, reading, frames) in &readings {
            block.add(place, reading.negated());
            block.count(place, frames.wrapping_neg());
        }
        assert!(block.iter().all(|(_, voxel)| voxel == Voxel::default()));
        block.read = *block.places();
        assert!(!block.is_overdrawn());
        let (place, reading, _) = readings[0];
        block.add(place, reading.negated());
        assert!(block.is_overdrawn());
        block.add(place, reading);
        assert_eq!((block.drop_empty(), block.len()), (expected().count(), 0));
    }
}
