//! Codes the voxels of a block in as few bits as a fast code can: about 14 bytes a voxel, of which 10 are the
//! sums of positions and colours, whose low bits are noise.

use dymlm_core::{BitReader, BitWriter};

use super::cells::{next_cells, put_cells};
use super::number_code::{NumberCode, read_below, write_below};
use crate::block_store::count;
use crate::voxel::{SUBVOXEL_BITS, SUMS, Sums, Voxel};
use crate::voxel_block::VoxelBlock;

/// The code takes weights below this one, whose sums do not overflow.
const MOST_WEIGHT: u64 = 1 << 48;
/// Bits of a byte, which the mean of a colour fits into.
const COLOR_BITS: u32 = 8;

/// Appends a block.
pub(super) fn put_block(block: &VoxelBlock, bits: &mut BitWriter) {
    put_cells(block.places().cells(), bits);
    let voxels = block.voxels(block.places().cells());
    let is_usual = voxels.iter().all(|(_, voxel)| is_usual(voxel));
    bits.put(is_usual.into(), 1);
    if is_usual {
        let mut code = VoxelCode::new(voxels.iter().all(|(_, voxel)| voxel.sums.uncolored == 0));
        bits.put(code.are_colored.into(), 1);
        for (_, voxel) in &voxels {
            code.put(voxel, bits);
        }
    } else {
        for (_, voxel) in &voxels {
            put_unusual(voxel, bits);
        }
    }
}

/// The next block; `None` where the bits are none that were put.
pub(super) fn next_block(bits: &mut BitReader<'_>) -> Option<VoxelBlock> {
    let cells = next_cells(bits)?;
    let places = 0..count(&cells);
    let voxels: Option<Vec<Voxel>> = if bits.next(1)? == 1 {
        let mut code = VoxelCode::new(bits.next(1)? == 1);
        places.map(|_| code.next(bits)).collect()
    } else {
        places.map(|_| next_unusual(bits)).collect()
    };
    Some(VoxelBlock::restored(cells, voxels?))
}

/// Whether a voxel holds nothing but what was read in it: nothing was taken out that had not been put in.
fn is_usual(voxel: &Voxel) -> bool {
    let Sums { weight, position, color, uncolored } = voxel.sums;
    (1..MOST_WEIGHT).contains(&weight)
        && uncolored <= weight
        && position.iter().all(|&sum| sum >> SUBVOXEL_BITS < weight)
        && color.iter().all(|&sum| sum >> COLOR_BITS < divisor(weight - uncolored))
}

/// The number by which sums of colours are divided.
fn divisor(colored: u64) -> u64 {
    colored.max(1)
}

/// Codes voxels one after the other: neighbours are alike.
struct VoxelCode {
    /// Whether each reading of the block has a colour.
    are_colored: bool,
    observations: NumberCode,
    rates: NumberCode,
    colors: [NumberCode; 3],
    /// Of the last voxel.
    last: Likeness,
}

/// In what voxels are like their neighbours.
struct Likeness {
    observations: i64,
    /// The order of magnitude of the weight that a frame has put in.
    rate: i64,
    /// Mean colour: green, then how much more red and blue there is.
    color: [i64; 3],
}

impl VoxelCode {
    fn new(are_colored: bool) -> Self {
        Self {
            are_colored,
            observations: NumberCode::default(),
            rates: NumberCode::default(),
            colors: Default::default(),
            // A guess, which matters only for the first of hundreds of voxels.
            last: Likeness { observations: 0, rate: 8, color: [128, 0, 0] },
        }
    }

    fn put(&mut self, voxel: &Voxel, bits: &mut BitWriter) {
        let Sums { weight, position, color, uncolored } = voxel.sums;
        let observations = i64::from(voxel.observations);
        self.observations.put_signed(observations - self.last.observations, bits);
        let (magnitude, rate) = (weight.ilog2(), rate(weight, observations));
        self.rates.put_signed(rate - self.last.rate, bits);
        bits.put_long(weight ^ 1 << magnitude, magnitude);
        if !self.are_colored {
            bits.put((uncolored == weight).into(), 1);
            if uncolored < weight {
                write_below(bits, uncolored, weight);
            }
        }

        let colored = divisor(weight - uncolored);
        let means = color.map(|sum| sum / colored);
        // A single reading is at the mean.
        let is_single = color.iter().zip(means).all(|(&sum, mean)| sum == mean * colored)
            && position.iter().all(|&sum| sum.is_multiple_of(weight));
        bits.put(is_single.into(), 1);
        // The mean is about equally likely to be anywhere in the voxel, so the sum may be any number below this.
        for sum in position {
            if is_single {
                bits.put_long(sum / weight, SUBVOXEL_BITS);
            } else {
                write_below(bits, sum, weight << SUBVOXEL_BITS);
            }
        }
        let likeness = Likeness { observations, rate, color: apart(means.map(|mean| mean as i64)) };
        for ((code, color), last) in self.colors.iter_mut().zip(likeness.color).zip(self.last.color) {
            code.put_signed(color - last, bits);
        }
        if !is_single {
            for (sum, mean) in color.into_iter().zip(means) {
                write_below(bits, sum - mean * colored, colored);
            }
        }
        self.last = likeness;
    }

    fn next(&mut self, bits: &mut BitReader<'_>) -> Option<Voxel> {
        let observations = self.last.observations.checked_add(self.observations.next_signed(bits)?)?;
        let rate = self.last.rate.checked_add(self.rates.next_signed(bits)?)?;
        let voxel_observations = u32::try_from(observations).ok()?;
        let magnitude = u32::try_from(rate.checked_add(magnitude(observations))?).ok()?;
        if magnitude >= MOST_WEIGHT.ilog2() {
            return None;
        }
        let weight = bits.next_long(magnitude)? | 1 << magnitude;
        let uncolored = if self.are_colored {
            0
        } else if bits.next(1)? == 1 {
            weight
        } else {
            read_below(bits, weight)?
        };

        let is_single = bits.next(1)? == 1;
        let mut position = [0; 3];
        for sum in &mut position {
            *sum = if is_single {
                bits.next_long(SUBVOXEL_BITS)? * weight
            } else {
                read_below(bits, weight << SUBVOXEL_BITS)?
            };
        }
        let mut likeness = Likeness { observations, rate, color: self.last.color };
        for (code, color) in self.colors.iter_mut().zip(&mut likeness.color) {
            *color = color.checked_add(code.next_signed(bits)?)?;
        }
        let colored = divisor(weight - uncolored);
        let mut color = [0; 3];
        for (sum, mean) in color.iter_mut().zip(together(likeness.color)?) {
            let rest = if is_single { 0 } else { read_below(bits, colored)? };
            *sum = u64::from(mean) * colored + rest;
        }
        self.last = likeness;
        let sums = Sums { weight, position, color, uncolored };
        Some(Voxel { sums, observations: voxel_observations })
    }
}

/// The order of magnitude of a number of frames, and that of the weight that one of them has put in.
fn magnitude(observations: i64) -> i64 {
    observations.max(1).ilog2().into()
}

fn rate(weight: u64, observations: i64) -> i64 {
    i64::from(weight.ilog2()) - magnitude(observations)
}

/// Red and blue mostly change with green.
fn apart([r, g, b]: [i64; 3]) -> [i64; 3] {
    [g, r - g, b - g]
}

/// The colour of which these are the parts; `None` when it is none.
fn together([g, r, b]: [i64; 3]) -> Option<[u8; 3]> {
    let channel = |channel: Option<i64>| channel.and_then(|channel| u8::try_from(channel).ok());
    Some([channel(r.checked_add(g))?, channel(Some(g))?, channel(b.checked_add(g))?])
}

/// Sums of any size, as they are.
fn put_unusual(voxel: &Voxel, bits: &mut BitWriter) {
    bits.put(voxel.observations, u32::BITS);
    voxel.sums.to_array().into_iter().for_each(|sum| bits.put_long(sum, u64::BITS));
}

fn next_unusual(bits: &mut BitReader<'_>) -> Option<Voxel> {
    let observations = bits.next(u32::BITS)?;
    let mut sums = [0; SUMS];
    for sum in &mut sums {
        *sum = bits.next_long(u64::BITS)?;
    }
    Some(Voxel { sums: Sums::from_array(sums), observations })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_store::{CellBits, put};

    /// A block whose voxels, at every third cell, have these readings.
    fn block(voxels: &[Voxel]) -> VoxelBlock {
        let mut cells = CellBits::default();
        (0..voxels.len()).for_each(|index| put(&mut cells, 3 * index));
        VoxelBlock::restored(cells, voxels.to_vec())
    }

    /// A block, coded and decoded, and the number of its bytes.
    fn coded(block: &VoxelBlock) -> (VoxelBlock, usize) {
        let (mut bits, mut bytes) = (BitWriter::default(), Vec::new());
        put_block(block, &mut bits);
        bits.finish(&mut bytes);
        let mut bits = BitReader::take(&mut bytes.as_slice()).unwrap();
        let back = next_block(&mut bits).unwrap();
        assert!(bits.is_done());
        (back, bytes.len())
    }

    /// A voxel with readings all over it.
    fn voxel(random: u64, uncolored: u64) -> Voxel {
        let weight = 1 + (random >> 20 & 0xfff) + uncolored;
        let within =
            |shift: u64, most: u64, weight: u64| (random.rotate_right(shift as u32) & 0xff) % most * weight;
        let position = [3, 19, 41].map(|shift| within(shift, 256, weight) + random % weight);
        let color =
            [7, 23, 47].map(|shift| within(shift, 200, weight - uncolored) + random % (weight - uncolored));
        Voxel { sums: Sums { weight, position, color, uncolored }, observations: 1 + (random >> 60) as u32 }
    }

    fn voxels(uncolored: impl Fn(u64) -> u64) -> Vec<Voxel> {
        let random = |index: u64| (index + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (0..170).map(|index| voxel(random(index), uncolored(index))).collect()
    }

    fn assert_comes_back(voxels: &[Voxel]) -> usize {
        let block = block(voxels);
        let (back, bytes) = coded(&block);
        assert_eq!(back.places().cells(), block.places().cells());
        assert!(back.iter().eq(block.iter()));
        bytes
    }

    #[test]
    fn voxels_come_back_with_and_without_colours() {
        assert_comes_back(&[]);
        let all = assert_comes_back(&voxels(|_| 0));
        assert!(all < 170 * 18, "{all} bytes");
        assert_comes_back(&voxels(|index| index % 3 * 1000));
        let mut uncolored = voxels(|_| 0);
        for voxel in &mut uncolored {
            (voxel.sums.color, voxel.sums.uncolored) = ([0; 3], voxel.sums.weight);
        }
        assert!(assert_comes_back(&uncolored) < all * 3 / 4);
    }

    #[test]
    fn single_readings_take_few_bytes() {
        let mut single = voxels(|_| 0);
        for voxel in &mut single {
            let weight = voxel.sums.weight;
            voxel.sums.position = voxel.sums.position.map(|sum| sum / weight * weight);
            voxel.sums.color = voxel.sums.color.map(|sum| sum / weight * weight);
        }
        let bytes = assert_comes_back(&single);
        assert!(bytes < 170 * 9, "{bytes} bytes");
    }

    #[test]
    fn voxels_of_which_more_was_taken_out_than_put_in_come_back() {
        for sum in 0..SUMS {
            let mut voxels = voxels(|_| 0);
            let mut sums = voxels[30].sums.to_array();
            sums[sum] = sums[sum].wrapping_sub(1 << 50);
            voxels[30].sums = Sums::from_array(sums);
            assert_comes_back(&voxels);
        }
        assert_comes_back(&[Voxel { observations: u32::MAX, ..Voxel::default() }]);
        let wide = Sums { weight: MOST_WEIGHT - 1, position: [5; 3], ..Sums::default() };
        assert_comes_back(&[Voxel { sums: wide, observations: u32::MAX }]);
    }

    #[test]
    fn damaged_bits_are_refused_or_give_a_block() {
        let (mut bits, mut bytes) = (BitWriter::default(), Vec::new());
        put_block(&block(&voxels(|index| index % 2 * 500)), &mut bits);
        bits.finish(&mut bytes);
        for at in 4..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << (at % 8);
            next_block(&mut BitReader::take(&mut damaged.as_slice()).unwrap());
        }
    }
}
