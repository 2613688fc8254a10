use bytes::{Buf, BufMut};
use dymlm_core::Point;

/// Deflate's level: level 6 saves 2 % and takes half as long again, at a lidar's ten or twenty scans per
/// second.
const LEVEL: u8 = 1;
const BYTES_A_POINT: usize = size_of::<Point>();

/// Packs points without loss.
///
/// A scanner's points come ring by ring: each coordinate is near the one before, and so are its bits. Their
/// differences are deflated byte by byte; the lowest bytes are noise and do not become shorter.
pub(crate) fn pack_scan(points: &[Point]) -> Vec<u8> {
    let mut planes = Vec::with_capacity(BYTES_A_POINT * points.len());
    for axis in 0..3 {
        let mut before = 0;
        let difference = |point: &Point| {
            let bits = point[axis].to_bits();
            folded(bits.wrapping_sub(std::mem::replace(&mut before, bits)))
        };
        let differences: Vec<u32> = points.iter().map(difference).collect();
        // All lowest bytes first, then the next ones: bytes of one rank are alike.
        for byte in 0..size_of::<u32>() {
            planes.extend(differences.iter().map(|difference| difference.to_le_bytes()[byte]));
        }
    }
    let mut out = Vec::new();
    out.put_u64_le(points.len() as u64);
    out.extend(miniz_oxide::deflate::compress_to_vec_zlib(&planes, LEVEL));
    out
}

/// Reads the points that were packed; `None` when they are damaged.
pub(crate) fn unpack_scan(mut packed: &[u8]) -> Option<Vec<Point>> {
    let count = usize::try_from(packed.try_get_u64_le().ok()?).ok()?;
    let length = count.checked_mul(BYTES_A_POINT)?;
    let planes = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(packed, length).ok()?;
    if planes.len() != length {
        return None;
    }
    let bytes = &mut planes.as_slice();
    let mut points = vec![[0.0; 3]; count];
    for axis in 0..3 {
        let mut differences = vec![[0; size_of::<u32>()]; count];
        for byte in 0..size_of::<u32>() {
            let plane = bytes.split_off(..count)?;
            for (difference, &value) in differences.iter_mut().zip(plane) {
                difference[byte] = value;
            }
        }
        let mut bits = 0_u32;
        for (point, difference) in points.iter_mut().zip(differences) {
            bits = bits.wrapping_add(unfolded(u32::from_le_bytes(difference)));
            point[axis] = f32::from_bits(bits);
        }
    }
    Some(points)
}

/// Maps small differences of either sign to small numbers.
fn folded(difference: u32) -> u32 {
    (difference << 1) ^ (difference.cast_signed() >> 31).cast_unsigned()
}

fn unfolded(number: u32) -> u32 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall 3 m before the scanner, ring by ring.
    fn wall() -> Vec<Point> {
        let direction = |i: usize| [((i % 100) as f32 - 50.0) * 0.01, (i / 100) as f32 * 0.02];
        (0..2000).map(direction).map(|[y, z]| [3.0, 3.0 * y, 3.0 * z]).collect()
    }

    fn bits(points: &[Point]) -> Vec<u32> {
        points.iter().flatten().map(|c| c.to_bits()).collect()
    }

    #[test]
    fn points_come_back_to_the_bit() {
        let odd = [[f32::NAN, -f32::NAN, f32::INFINITY], [-0.0, f32::MIN_POSITIVE / 2.0, f32::MAX]];
        for points in [wall(), odd.to_vec(), Vec::new()] {
            assert_eq!(bits(&unpack_scan(&pack_scan(&points)).unwrap()), bits(&points));
        }
        let packed = pack_scan(&wall()).len();
        assert!(packed < 2000 * BYTES_A_POINT / 2, "{packed} bytes");
    }

    #[test]
    fn damage_is_noticed() {
        let packed = pack_scan(&wall());
        for place in (0..packed.len()).step_by(7) {
            assert!(unpack_scan(&packed[..place]).is_none());
            let mut damaged = packed.clone();
            damaged[place] ^= 0x10;
            // A damaged reference that copies equal bytes does no harm.
            let points = unpack_scan(&damaged);
            assert!(points.is_none_or(|points| points == wall()), "byte {place} of {}", packed.len());
        }
    }
}
