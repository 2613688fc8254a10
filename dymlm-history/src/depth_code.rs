use bytes::{Buf, BufMut};
use dymlm_core::DepthImage;

use crate::byte_planes::{put_byte_planes, take_byte_planes};
use crate::foretelling::Numbers;

/// Appends a depth image without loss, to be deflated.
///
/// A sensor's readings take few values (a Kinect's disparities: some hundred in a frame). Each is replaced by
/// its rank among those of the frame, and foretold by its neighbours; what is left is mostly 0.
pub(crate) fn put_depth(depth: &DepthImage, out: &mut Vec<u8>) {
    // Depths are not negative: their bits have their order.
    let mut values: Vec<u32> = depth.data().iter().map(|z| z.to_bits()).collect();
    values.sort_unstable();
    values.dedup();
    out.put_u32_le(values.len() as u32);
    for &value in &values {
        out.put_u32_le(value);
    }
    // Most pixels repeat the one before.
    let (mut last, mut rank) = (values[0], 0);
    let rank_of = |z: &f32| {
        if z.to_bits() != last {
            last = z.to_bits();
            rank = values.partition_point(|&value| value < last) as u32;
        }
        rank
    };
    let ranks: Vec<u32> = depth.data().iter().map(rank_of).collect();
    let count = values.len() as u32;
    let numbers = Numbers { width: depth.width(), count, has_holes: has_holes(&values) };
    put_byte_planes(&numbers.errors_of(&ranks), count, out);
}

/// The image that was put; `None` when the bytes are no such.
pub(crate) fn take_depth(bytes: &mut &[u8], [width, height]: [usize; 2]) -> Option<DepthImage> {
    let count = bytes.try_get_u32_le().ok()?;
    let pixels = width.checked_mul(height)?;
    // Before anything is allocated.
    if count as usize > pixels || pixels > bytes.len() {
        return None;
    }
    let values: Option<Vec<u32>> = (0..count).map(|_| bytes.try_get_u32_le().ok()).collect();
    let values = values?;
    let mut ranks = take_byte_planes(bytes, pixels, count)?;
    Numbers { width, count, has_holes: has_holes(&values) }.undo(&mut ranks)?;
    let depth_of = |rank: u32| values.get(rank as usize).map(|&bits| f32::from_bits(bits));
    let depths: Option<Vec<f32>> = ranks.into_iter().map(depth_of).collect();
    DepthImage::new(width, height, depths?).ok()
}

/// Whether pixels without a reading are among the values: they have rank 0.
fn has_holes(values: &[u32]) -> bool {
    values.len() > 1 && values.first() == Some(&0)
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
            let mut bytes = Vec::new();
            put_depth(&depth, &mut bytes);
            let mut rest = bytes.as_slice();
            assert_eq!(take_depth(&mut rest, [width, 45]).unwrap(), depth);
            assert!(rest.is_empty());
            for end in 0..bytes.len() {
                assert!(take_depth(&mut &bytes[..end], [width, 45]).is_none());
            }
        }
    }
}
