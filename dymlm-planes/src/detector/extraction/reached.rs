/// Sides of a block through which a plane enters: bits in the order of `BlockGrid::neighbors`.
const LEFT: u8 = 0b0001;
const RIGHT: u8 = 0b0010;
const ABOVE: u8 = 0b0100;
const BELOW: u8 = 0b1000;

/// A bit for each pixel of a block, by rows: whether it is near a plane, and whether the plane reaches it.
#[derive(Debug, Clone, Default)]
pub(super) struct PixelBits {
    near: Vec<u64>,
    reached: Vec<u64>,
}

/// Keeps those pixels of a block, `width` per row, that a growing plane can reach from the sides through
/// which it entered: over pixels near the plane (of finite distance) that touch, also at corners. The
/// distances of all other pixels become infinite. Returns whether there are no others.
///
/// Planes grow block by block. Without this test they would cross, within a block, the gap between two
/// screens that stand side by side: far away and at a slant, a gap of 15 cm is 3 pixels wide.
///
/// O(rows of the block) for most shapes, because whole rows are processed at once.
pub(super) fn keep_reached(distances: &mut [f32], width: usize, sides: u8, bits: &mut PixelBits) -> bool {
    let PixelBits { near, reached } = bits;
    near.clear();
    near.extend(distances.chunks_exact(width).map(bits_of));
    spread(near, width, sides, reached);
    if reached == near {
        return true;
    }
    for (row, &reached) in distances.chunks_exact_mut(width).zip(&*reached) {
        for (k, distance) in row.iter_mut().enumerate() {
            *distance = if reached >> k & 1 == 1 { *distance } else { f32::INFINITY };
        }
    }
    false
}

/// A bit for each finite distance.
fn bits_of(distances: &[f32]) -> u64 {
    let eights = distances.chunks(8).enumerate();
    eights.fold(0, |all, (place, eight)| {
        let bits = eight.iter().enumerate().map(|(k, &d)| if d < f32::INFINITY { 1_u32 << k } else { 0 });
        all | u64::from(bits.fold(0, |all, bit| all | bit)) << (8 * place)
    })
}

/// Finds the pixels near a plane that are connected to one of the sides.
fn spread(near: &[u64], width: usize, sides: u8, reached: &mut Vec<u64>) {
    let height = near.len();
    let first = u64::from(sides & LEFT != 0);
    let last = u64::from(sides & RIGHT != 0) << (width - 1);
    reached.clear();
    reached.extend(near.iter().enumerate().map(|(row, near)| {
        let whole = (sides & ABOVE != 0 && row == 0) || (sides & BELOW != 0 && row + 1 == height);
        near & if whole { u64::MAX } else { first | last }
    }));
    loop {
        let mut grown = false;
        for row in (0..height).chain((0..height).rev()) {
            let around = &reached[row.saturating_sub(1)..(row + 2).min(height)];
            let around = around.iter().fold(0, |all, row| all | row);
            let with = reached[row] | near[row] & (around | around << 1 | around >> 1);
            grown |= with != reached[row];
            reached[row] = with;
        }
        if !grown {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn reached_from(near: &[u64], width: usize, sides: u8) -> (Vec<u64>, bool) {
        let mut reached = Vec::new();
        spread(near, width, sides, &mut reached);
        let is_all = reached == near;
        (reached, is_all)
    }

    #[test]
    fn a_gap_of_a_pixel_stops_it() {
        let near = [0b1110_0111_u64; 8];
        assert_eq!(reached_from(&near, 8, LEFT), (vec![0b0000_0111; 8], false));
        assert_eq!(reached_from(&near, 8, RIGHT), (vec![0b1110_0000; 8], false));
        assert_eq!(reached_from(&near, 8, LEFT | RIGHT), (near.to_vec(), true));
        assert_eq!(reached_from(&near, 8, ABOVE), (near.to_vec(), true));
    }

    #[test]
    fn it_goes_round_corners_and_through_holes() {
        // A winding path: in at the left of the last row, out at the top right.
        let near = [0b1000, 0b0100, 0b0010, 0b1100, 0b0010, 0b0001_u64];
        assert_eq!(reached_from(&near, 4, LEFT), (near.to_vec(), true));
        assert_eq!(reached_from(&near, 4, BELOW), (near.to_vec(), true));
    }

    proptest! {
        #[test]
        fn it_is_what_a_flood_pixel_by_pixel_reaches(
            near in prop::collection::vec(0_u64..1 << 9, 1..10),
            sides in 0_u8..16,
        ) {
            let (width, height) = (9_i64, near.len() as i64);
            let is_near = |u: i64, v: i64| {
                (0..width).contains(&u) && (0..height).contains(&v) && near[v as usize] >> u & 1 == 1
            };
            let mut expected = vec![0_u64; near.len()];
            let mut stack: Vec<(i64, i64)> = (0..height)
                .flat_map(|v| (0..width).map(move |u| (u, v)))
                .filter(|&(u, v)| {
                    let entries = [(LEFT, u == 0), (RIGHT, u == width - 1), (ABOVE, v == 0), (BELOW, v == height - 1)];
                    entries.iter().any(|&(side, at)| at && sides & side != 0)
                })
                .collect();
            while let Some((u, v)) = stack.pop() {
                if is_near(u, v) && expected[v as usize] >> u & 1 == 0 {
                    expected[v as usize] |= 1 << u;
                    stack.extend((-1..=1).flat_map(|dv| (-1..=1).map(move |du| (u + du, v + dv))));
                }
            }
            let is_all = expected == near;
            prop_assert_eq!(reached_from(&near, width as usize, sides), (expected, is_all));
        }
    }
}
