use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::deflate::compress_to_vec_zlib;

use super::lattice_places::LatticePlaces;

/// Level of deflate: 9 saves 1 % more in three times the time.
const LEVEL: u8 = 6;

/// Packs places and their channels as text for the page: base64 of a zlib stream.
///
/// The stream holds the differences of successive keys in zigzag code (0, -1, 1, -2 ... as 0, 1, 2, 3 ...):
/// for each axis the low bytes of all places, then their high bytes; then, for each channel, the differences
/// of successive bytes. Successive places of a map are mostly neighbours in space, so that most of these
/// bytes are small.
pub(super) fn section(places: &LatticePlaces) -> String {
    STANDARD.encode(compress_to_vec_zlib(&bytes(places), LEVEL))
}

fn bytes(places: &LatticePlaces) -> Vec<u8> {
    let count = places.keys.len();
    let mut bytes = Vec::with_capacity(count * (6 + places.channels.len()));
    for axis in 0..3 {
        let codes = differences(places.keys.iter().map(|key| key[axis]));
        let codes: Vec<[u8; 2]> = codes.map(u16::to_le_bytes).collect();
        bytes.extend(codes.iter().map(|[low, _]| low));
        bytes.extend(codes.iter().map(|[_, high]| high));
    }
    for channel in &places.channels {
        let mut before = 0_u8;
        bytes.extend(channel.iter().map(|&value| value.wrapping_sub(std::mem::replace(&mut before, value))));
    }
    bytes
}

/// Each key minus the one before, in zigzag code.
fn differences(keys: impl Iterator<Item = u16>) -> impl Iterator<Item = u16> {
    keys.scan(0_u16, |before, key| {
        let difference = key.wrapping_sub(std::mem::replace(before, key)) as i16;
        Some(((difference << 1) ^ (difference >> 15)) as u16)
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    /// Unpacks the keys and channels of a section, as the page's `sections.js` does.
    pub(crate) fn unpacked(text: &str, count: usize, channels: usize) -> (Vec<[u16; 3]>, Vec<Vec<u8>>) {
        let bytes = decompress_to_vec_zlib(&STANDARD.decode(text).unwrap()).unwrap();
        assert_eq!(bytes.len(), count * (6 + channels));
        let mut keys = vec![[0_u16; 3]; count];
        for axis in 0..3 {
            let mut sum = 0_u16;
            for (index, key) in keys.iter_mut().enumerate() {
                let [low, high] = [2 * axis, 2 * axis + 1].map(|row| u16::from(bytes[row * count + index]));
                let code = low | (high << 8);
                sum = sum.wrapping_add((code >> 1) ^ (code & 1).wrapping_neg());
                key[axis] = sum;
            }
        }
        let channels = (0..channels).map(|channel| {
            let values = bytes[(6 + channel) * count..][..count].iter();
            values
                .scan(0_u8, |sum, &value| {
                    *sum = sum.wrapping_add(value);
                    Some(*sum)
                })
                .collect()
        });
        (keys, channels.collect())
    }

    fn check(keys: Vec<[u16; 3]>, channels: Vec<Vec<u8>>) {
        let places = LatticePlaces { origin: [0.0; 3], step: 1.0, keys, channels };
        let (keys, channels) = unpacked(&section(&places), places.keys.len(), places.channels.len());
        assert_eq!((keys, channels), (places.keys, places.channels));
    }

    #[test]
    fn what_was_packed_is_unpacked() {
        check(Vec::new(), vec![Vec::new(); 3]);
        check(vec![[65_535, 0, 32_768]], vec![vec![255], vec![0], vec![128]]);
        // All kinds of differences: to both ends, across the middle, and zero.
        let ends = [0, 65_535, 0, 32_767, 32_768, 32_768, 65_535, 1];
        let keys: Vec<[u16; 3]> = (0..8).map(|i| [ends[i], ends[7 - i], (i * 9_001) as u16]).collect();
        check(keys, vec![vec![0, 255, 0, 128, 127, 127, 255, 1]]);
    }

    #[test]
    fn places_side_by_side_take_few_bytes() {
        let keys: Vec<[u16; 3]> = (0..40_000).map(|i| [i % 200 * 10, i / 200 * 10, 500]).collect();
        let places = LatticePlaces { origin: [0.0; 3], step: 0.001, keys, channels: Vec::new() };
        assert!(section(&places).len() < 2_000);
    }
}
