//! Codes the voxels of a block in as few bits as a fast code can: about 13 bytes a voxel, of which most are
//! sums of positions and colours, whose low bits are noise.

use dymlm_core::{BitReader, BitWriter};

use super::cells::{next_cells, put_cells};
use super::number_code::{NumberCode, read_below, write_below};
use crate::block_store::count;
use crate::voxel::{SUBVOXEL_BITS, SUMS, Sums, Voxel};
use crate::voxel_block::VoxelBlock;

/// The code takes weights below this one, whose sums do not overflow.
const MOST_WEIGHT: u64 = 1 << 48;
/// Sums that are multiples of a smaller number become too few bits shorter to say so.
const LEAST_UNIT: u64 = 16;
/// Bits of a byte, which the mean of a colour fits into.
const COLOR_BITS: u32 = 8;

/// Appends a block.
pub(super) fn put_block(block: &VoxelBlock, bits: &mut BitWriter) {
    put_cells(block.places().cells(), bits);
    // By place.
    let voxels = || (0..block.len()).map(|index| block.voxel(index));
    let is_usual = voxels().all(|voxel| is_usual(&voxel));
    bits.put(is_usual.into(), 1);
    if is_usual {
        let are_colored = block.is_colored() || voxels().all(|voxel| voxel.sums.uncolored == 0);
        bits.put(are_colored.into(), 1);
        let mut code = VoxelCode::new(are_colored);
        voxels().for_each(|voxel| code.put(&voxel, bits));
    } else {
        voxels().for_each(|voxel| put_unusual(&voxel, bits));
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
    units: NumberCode,
    readings: NumberCode,
    colors: [NumberCode; 3],
    /// Of the last voxel.
    last: Likeness,
}

/// In what voxels are like their neighbours.
struct Likeness {
    observations: i64,
    /// The order of magnitude of the weight that a frame has put in.
    rate: i64,
    /// The weight of each reading, in the last voxel whose readings weigh the same.
    unit: i64,
    /// Mean colour: green, then how much more red and blue there is.
    color: [i64; 3],
}

impl VoxelCode {
    fn new(are_colored: bool) -> Self {
        Self {
            are_colored,
            observations: NumberCode::default(),
            rates: NumberCode::default(),
            units: NumberCode::default(),
            readings: NumberCode::default(),
            colors: Default::default(),
            // A guess, which matters only for the first of hundreds of voxels.
            last: Likeness { observations: 0, rate: 8, unit: 256, color: [128, 0, 0] },
        }
    }

    fn put(&mut self, voxel: &Voxel, bits: &mut BitWriter) {
        let observations = i64::from(voxel.observations);
        self.observations.put_signed(observations - self.last.observations, bits);
        self.last.observations = observations;
        let unit = if voxel.observations == 1 { common_unit(&voxel.sums) } else { None };
        if voxel.observations == 1 {
            bits.put(unit.is_some().into(), 1);
        }
        if let Some(unit) = unit {
            self.put_unit(unit, bits);
            self.readings.put(voxel.sums.weight / unit, bits);
            self.put_means(Sums::from_array(voxel.sums.to_array().map(|sum| sum / unit)), bits);
        } else {
            self.put_weight(voxel.sums.weight, bits);
            self.put_means(voxel.sums, bits);
        }
    }

    fn put_unit(&mut self, unit: u64, bits: &mut BitWriter) {
        let unit = unit as i64;
        bits.put((unit == self.last.unit).into(), 1);
        if unit != self.last.unit {
            self.units.put_signed(unit - self.last.unit, bits);
            self.last.unit = unit;
        }
    }

    fn put_weight(&mut self, weight: u64, bits: &mut BitWriter) {
        let (magnitude, rate) = (weight.ilog2(), rate(weight, self.last.observations));
        self.rates.put_signed(rate - self.last.rate, bits);
        bits.put_long(weight ^ 1 << magnitude, magnitude);
        self.last.rate = rate;
    }

    /// Puts sums whose weight is known.
    fn put_means(&mut self, sums: Sums, bits: &mut BitWriter) {
        let Sums { weight, position, color, uncolored } = sums;
        if !self.are_colored {
            bits.put((uncolored == weight).into(), 1);
            if uncolored < weight {
                write_below(bits, uncolored, weight);
            }
        }
        // The mean is about equally likely to be anywhere in the voxel, so the sum may be any number below this.
        for sum in position {
            write_below(bits, sum, weight << SUBVOXEL_BITS);
        }
        let colored = divisor(weight - uncolored);
        let means = color.map(|sum| sum / colored);
        let likeness = apart(means.map(|mean| mean as i64));
        for ((code, color), last) in self.colors.iter_mut().zip(likeness).zip(self.last.color) {
            code.put_signed(color - last, bits);
        }
        for (sum, mean) in color.into_iter().zip(means) {
            write_below(bits, sum - mean * colored, colored);
        }
        self.last.color = likeness;
    }

    fn next(&mut self, bits: &mut BitReader<'_>) -> Option<Voxel> {
        let observations = self.last.observations.checked_add(self.observations.next_signed(bits)?)?;
        self.last.observations = observations;
        let observations = u32::try_from(observations).ok()?;
        let sums = if observations == 1 && bits.next(1)? == 1 {
            let unit = self.next_unit(bits)?;
            let weight = self.readings.next(bits).filter(|readings| (1..MOST_WEIGHT).contains(readings))?;
            weight.checked_mul(unit).filter(|&weight| weight < MOST_WEIGHT)?;
            Sums::from_array(self.next_means(weight, bits)?.to_array().map(|sum| sum * unit))
        } else {
            let weight = self.next_weight(bits)?;
            self.next_means(weight, bits)?
        };
        Some(Voxel { sums, observations })
    }

    fn next_unit(&mut self, bits: &mut BitReader<'_>) -> Option<u64> {
        if bits.next(1)? == 0 {
            self.last.unit = self.last.unit.checked_add(self.units.next_signed(bits)?)?;
        }
        u64::try_from(self.last.unit).ok().filter(|&unit| unit > 0)
    }

    fn next_weight(&mut self, bits: &mut BitReader<'_>) -> Option<u64> {
        let rate = self.last.rate.checked_add(self.rates.next_signed(bits)?)?;
        let magnitude = u32::try_from(rate.checked_add(magnitude(self.last.observations))?).ok()?;
        self.last.rate = rate;
        if magnitude >= MOST_WEIGHT.ilog2() {
            return None;
        }
        Some(bits.next_long(magnitude)? | 1 << magnitude)
    }

    fn next_means(&mut self, weight: u64, bits: &mut BitReader<'_>) -> Option<Sums> {
        let uncolored = if self.are_colored {
            0
        } else if bits.next(1)? == 1 {
            weight
        } else {
            read_below(bits, weight)?
        };
        let mut position = [0; 3];
        for sum in &mut position {
            *sum = read_below(bits, weight << SUBVOXEL_BITS)?;
        }
        for (code, color) in self.colors.iter_mut().zip(&mut self.last.color) {
            *color = color.checked_add(code.next_signed(bits)?)?;
        }
        let colored = divisor(weight - uncolored);
        let mut color = [0; 3];
        for (sum, mean) in color.iter_mut().zip(together(self.last.color)?) {
            *sum = u64::from(mean) * colored + read_below(bits, colored)?;
        }
        Some(Sums { weight, position, color, uncolored })
    }
}

/// The weight of each of a voxel's readings, if they all weigh the same: one frame's readings of a surface
/// often do, since a sensor's depths have steps. Then all sums are multiples of it.
///
/// `None` below [`LEAST_UNIT`].
fn common_unit(sums: &Sums) -> Option<u64> {
    // What divides the sums so far mostly divides the next one as well, or hardly anything does.
    let greatest_common_divisor = |mut divisor: u64, mut sum: u64| {
        while divisor > 0 {
            (sum, divisor) = (divisor, sum % divisor);
        }
        Some(sum).filter(|&divisor| divisor >= LEAST_UNIT)
    };
    sums.to_array().into_iter().try_fold(0, greatest_common_divisor)
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
    fn readings_of_one_depth_take_few_bytes() {
        // One to four readings, each of which weighs 300.
        let mut voxels = voxels(|index| index % 7 * 500);
        for (voxel, readings) in voxels.iter_mut().zip((1..=4).cycle()) {
            let Sums { weight, position, color, .. } = voxel.sums;
            let scaled = |sum: u64| sum * readings / weight * 300;
            let [position, color] = [position, color].map(|sums| sums.map(scaled));
            voxel.sums = Sums { weight: 300 * readings, position, color, uncolored: 0 };
            voxel.observations = 1;
        }
        let bytes = assert_comes_back(&voxels);
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
