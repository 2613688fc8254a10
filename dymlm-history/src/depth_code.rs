use bytes::{Buf, BufMut};
use dymlm_core::DepthImage;

use crate::number_plane::{NumberPlane, PlaneBuffers};

/// How many values are remembered: more than a sensor with 11 bits of disparity has, few enough for a
/// processor's nearest cache.
const SLOTS: usize = 4096;
/// Bits that no depth has: they are not a finite number's.
const NO_DEPTH: u32 = u32::MAX;

/// Appends a depth image without loss: its distinct values to `head`, the rank of each pixel's value to
/// `body`.
///
/// A sensor's readings take few values (a Kinect's disparities: some hundred in a frame). Each reading is
/// replaced by the rank of its value among those of the frame, which its neighbours predict.
pub(crate) fn put_depth(
    depth: &DepthImage,
    buffers: &mut PlaneBuffers,
    head: &mut Vec<u8>,
    body: &mut Vec<u8>,
) {
    // Depths are not negative, so their bits have the same order.
    let bits = depth.data().iter().map(|z| z.to_bits());
    let values = distinct(bits.clone());
    head.put_u32_le(values.len() as u32);
    for &value in &values {
        head.put_u32_le(value);
    }
    let mut known = vec![(NO_DEPTH, 0); SLOTS];
    let rank_of = |value| {
        let known = &mut known[slot_of(value)];
        if known.0 != value {
            *known = (value, values.partition_point(|&smaller| smaller < value) as u32);
        }
        known.1
    };
    plane_of(&values, depth.width()).put(bits.map(rank_of), buffers, body);
}

/// Reads the image that was put; `None` when the bytes hold none.
pub(crate) fn take_depth(
    head: &mut &[u8],
    body: &mut &[u8],
    [width, height]: [usize; 2],
) -> Option<DepthImage> {
    let count = head.try_get_u32_le().ok()? as usize;
    let pixels = width.checked_mul(height)?;
    // Checked before anything is allocated.
    if count == 0 || count > pixels || count > head.len() / 4 {
        return None;
    }
    let values: Vec<u32> = (0..count).map(|_| head.get_u32_le()).collect();
    let ranks = plane_of(&values, width).take(pixels, body)?;
    let depths = ranks.into_iter().map(|rank| f32::from_bits(values[rank as usize])).collect();
    DepthImage::new(width, height, depths).ok()
}

/// The values that occur, ascending.
fn distinct(all: impl Iterator<Item = u32>) -> Vec<u32> {
    // Values that are still remembered are left out at once, which leaves few to sort.
    let mut remembered = vec![NO_DEPTH; SLOTS];
    let mut values = Vec::new();
    for value in all {
        let remembered = &mut remembered[slot_of(value)];
        if *remembered != value {
            *remembered = value;
            values.push(value);
        }
    }
    values.sort_unstable();
    values.dedup();
    values
}

/// The place among [`SLOTS`] at which a value is remembered until another one takes it: the highest bits of
/// the value times 2^32 / the golden ratio, which spreads values that differ little (Knuth, The Art of
/// Computer Programming, 6.4).
#[inline]
fn slot_of(value: u32) -> usize {
    (value.wrapping_mul(0x9E37_79B1) >> (u32::BITS - SLOTS.ilog2())) as usize
}

/// Pixels without a reading are holes: they have rank 0.
fn plane_of(values: &[u32], width: usize) -> NumberPlane {
    let has_holes = values.len() > 1 && values.first() == Some(&0);
    NumberPlane { width, count: values.len() as u32, has_holes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_come_back_to_the_bit() {
        type DepthOf = fn(usize) -> f32;
        let images: [(usize, DepthOf); 4] = [
            (1, |_| 0.0),
            (64, |_| 1.5),
            (37, |i| (i % 300) as f32 * 0.001),
            (50, |i| ((i * 7919) % 100_003) as f32 * 1e-4),
        ];
        for (width, depth_of) in images {
            let depth = DepthImage::new(width, 45, (0..width * 45).map(depth_of).collect()).unwrap();
            let (mut head, mut body) = (Vec::new(), Vec::new());
            put_depth(&depth, &mut PlaneBuffers::default(), &mut head, &mut body);
            let taken = |mut head: &[u8], mut body: &[u8]| {
                let depth = take_depth(&mut head, &mut body, [width, 45])?;
                (head.is_empty() && body.is_empty()).then_some(depth)
            };
            assert_eq!(taken(&head, &body), Some(depth));
            for end in 0..head.len() {
                assert!(taken(&head[..end], &body).is_none());
            }
            for end in 0..body.len() {
                assert!(taken(&head, &body[..end]).is_none());
            }
        }
    }
}
