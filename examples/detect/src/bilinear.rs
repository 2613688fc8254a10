use dymlm::core::Rgb;

/// The weight 1 in `OpenCV`'s fixed point: weights are whole multiples of 1/2048.
const ONE: f32 = 2048.0;

/// The two pixels between which a pixel of the scaled image is along one axis, and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tap {
    pixels: [usize; 2],
    weights: [i32; 2],
}

/// Scales an image of `size` (width, height) to `new_size` as `cv2.resize` with `INTER_LINEAR` does, to the
/// last bit: pixels are squares (centres at halves), two neighbours along each axis are interpolated however
/// much smaller the image becomes, in fixed point.
///
/// A network must see images scaled as in training: interpolation that averages over all pixels when it
/// shrinks an image, as the crate `image` does, loses detections.
///
/// An image that is empty, or whose number of pixels is not that of `size`, gives black.
///
/// ```
/// let image = [[0; 3], [100; 3]];
/// assert_eq!(dymlm_detect::resize_bilinear(&image, [2, 1], [4, 1]), [[0; 3], [25; 3], [75; 3], [100; 3]]);
/// ```
pub fn resize_bilinear(image: &[Rgb], size: [usize; 2], new_size: [usize; 2]) -> Vec<Rgb> {
    let [width, height] = size;
    let mut scaled = vec![[0; 3]; new_size[0] * new_size[1]];
    if image.is_empty() || width.checked_mul(height) != Some(image.len()) {
        return scaled;
    }
    let columns = taps(width, new_size[0], Ends::Repeated);
    let rows = taps(height, new_size[1], Ends::Interpolated);
    // The two scaled rows between which the last row was: neighbouring rows of the scaled image share them.
    let mut across: [(Option<usize>, Vec<[i32; 3]>); 2] = Default::default();
    for (scaled, tap) in scaled.chunks_exact_mut(new_size[0].max(1)).zip(&rows) {
        if across[1].0 == Some(tap.pixels[0]) {
            across.swap(0, 1);
        }
        for (kept, row) in across.iter_mut().zip(tap.pixels) {
            if kept.0 != Some(row) {
                interpolate_row(image.get(row * width..).unwrap_or_default(), &columns, &mut kept.1);
                kept.0 = Some(row);
            }
        }
        let [(_, upper), (_, lower)] = &across;
        for (pixel, (upper, lower)) in scaled.iter_mut().zip(upper.iter().zip(lower)) {
            *pixel = std::array::from_fn(|channel| between(upper[channel], lower[channel], tap.weights));
        }
    }
    scaled
}

/// How pixels with a neighbour outside the image are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Ends {
    /// They copy the outermost pixel.
    Repeated,
    /// They are interpolated between the outermost pixel and itself, which rounds differently.
    Interpolated,
}

/// For each of `new_count` pixels along an axis of `count`, its neighbours. The first weights are rounded
/// from `f32`, the position is computed in `f64`, as in `OpenCV`.
fn taps(count: usize, new_count: usize, ends: Ends) -> Vec<Tap> {
    let last = count.saturating_sub(1) as i64;
    let scale = 1.0 / (new_count as f64 / count as f64);
    let tap = |pixel: usize| {
        let place = ((pixel as f64 + 0.5) * scale - 0.5) as f32;
        let before = place.floor() as i64;
        let mut share = place - place.floor();
        if ends == Ends::Repeated && (before < 0 || before >= last) {
            share = 0.0;
        }
        let within = |pixel: i64| pixel.clamp(0, last) as usize;
        let weight = |share: f32| (share * ONE).round_ties_even() as i32;
        Tap { pixels: [before, before + 1].map(within), weights: [weight(1.0 - share), weight(share)] }
    };
    (0..new_count).map(tap).collect()
}

/// A row of the image, scaled along the row; in 1/2048.
fn interpolate_row(row: &[Rgb], columns: &[Tap], scaled: &mut Vec<[i32; 3]>) {
    let pixel = |index: usize| row.get(index).copied().unwrap_or_default().map(i32::from);
    scaled.clear();
    scaled.extend(columns.iter().map(|tap| {
        let [before, after] = tap.pixels.map(pixel);
        std::array::from_fn(|channel| before[channel] * tap.weights[0] + after[channel] * tap.weights[1])
    }));
}

/// A value between two rows in 1/2048, rounded as `OpenCV` does: each share is truncated to quarters before
/// they are added.
fn between(upper: i32, lower: i32, weights: [i32; 2]) -> u8 {
    let share = |value: i32, weight: i32| (weight * (value >> 4)) >> 16;
    ((share(upper, weights[0]) + share(lower, weights[1]) + 2) >> 2).clamp(0, 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of a linear congruential generator (Numerical Recipes), the same that `OpenCV` was given.
    fn noise(size: [usize; 2]) -> Vec<Rgb> {
        let mut state = 1_u32;
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        (0..size[0] * size[1]).map(|_| std::array::from_fn(|_| byte())).collect()
    }

    /// CRC-32 of zlib, bit by bit.
    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg()))
        })
    }

    /// Checksums of `zlib.crc32(cv2.resize(noise, new_size, interpolation=cv2.INTER_LINEAR))`, `OpenCV` 5.0.
    #[test]
    fn the_bits_are_those_of_opencv() {
        let known = [
            ([7, 5], [4, 3], 0x6e62_cd47),
            ([5, 3], [9, 7], 0xa6ad_1784),
            ([1, 1], [3, 2], 0x4ff3_24f9),
            ([8, 6], [4, 3], 0xf600_3953),
            ([6, 4], [6, 4], 0xcc75_b433),
            ([13, 9], [5, 7], 0x8067_9b0a),
            ([64, 48], [41, 31], 0x7da0_cdfc),
            ([640, 480], [416, 312], 0x1ef3_21e9),
        ];
        for (size, new_size, checksum) in known {
            let scaled = resize_bilinear(&noise(size), size, new_size);
            assert_eq!(crc32(scaled.as_flattened()), checksum, "{size:?} to {new_size:?}");
        }
    }

    /// Compared with the definition, in real numbers and pixel by pixel: fixed point is off by at most one.
    #[test]
    fn it_is_bilinear_interpolation() {
        for (size, new_size) in [([17, 11], [7, 9]), ([9, 30], [31, 13]), ([2, 2], [5, 1]), ([1, 9], [4, 4])]
        {
            let image = noise(size);
            let scaled = resize_bilinear(&image, size, new_size);
            let at = |u: f64, v: f64, channel: usize| {
                let (u, v) = (u.clamp(0.0, size[0] as f64 - 1.0), v.clamp(0.0, size[1] as f64 - 1.0));
                let corner = |du: usize, dv: usize| {
                    let (column, row) = (u as usize + du, v as usize + dv);
                    let index = row.min(size[1] - 1) * size[0] + column.min(size[0] - 1);
                    f64::from(image[index][channel])
                };
                let along = |dv: usize| corner(0, dv) + (corner(1, dv) - corner(0, dv)) * u.fract();
                along(0) + (along(1) - along(0)) * v.fract()
            };
            for (index, pixel) in scaled.iter().enumerate() {
                let (u, v) = (index % new_size[0], index / new_size[0]);
                let place = |pixel: usize, axis: usize| {
                    (pixel as f64 + 0.5) * size[axis] as f64 / new_size[axis] as f64 - 0.5
                };
                for (channel, &value) in pixel.iter().enumerate() {
                    let exact = at(place(u, 0), place(v, 1), channel);
                    assert!((f64::from(value) - exact).abs() <= 1.0, "{size:?} {u} {v}: {value}, {exact}");
                }
            }
        }
    }

    #[test]
    fn images_without_pixels_are_black() {
        assert_eq!(resize_bilinear(&[], [0, 0], [2, 1]), [[0; 3]; 2]);
        assert_eq!(resize_bilinear(&[[9; 3]], [2, 1], [1, 1]), [[0; 3]]);
        assert!(resize_bilinear(&[[9; 3]], [1, 1], [0, 4]).is_empty());
    }
}
