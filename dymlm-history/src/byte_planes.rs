/// Appends numbers below `count` byte by byte: all lowest bytes first, since the upper ones are nearly all 0.
pub(crate) fn put_byte_planes(numbers: &[u32], count: u32, out: &mut Vec<u8>) {
    for shift in shifts(count) {
        out.extend(numbers.iter().map(|number| (number >> shift) as u8));
    }
}

/// So many numbers below `count`; `None` when there are fewer bytes.
pub(crate) fn take_byte_planes(bytes: &mut &[u8], length: usize, count: u32) -> Option<Vec<u32>> {
    let mut numbers = vec![0; length];
    for shift in shifts(count) {
        let (plane, rest) = bytes.split_at_checked(length)?;
        numbers.iter_mut().zip(plane).for_each(|(number, &byte)| *number |= u32::from(byte) << shift);
        *bytes = rest;
    }
    Some(numbers)
}

/// Of the bytes that numbers below `count` have: one at least.
fn shifts(count: u32) -> impl Iterator<Item = u32> {
    let bits = u32::BITS - count.saturating_sub(1).leading_zeros();
    (0..bits.max(1)).step_by(8)
}
